//! What B–H laws add to the linear problem: energy, residual and tangent of every element with a law.
//!
//! A region with a law has a linear part as well, with the permeability `μr` of its [`crate::Material`]: penalty and
//! surface terms of nodal elements stay those of a linear material with `ν_r = 1/(μ0 μr)`, and the law adds `∫(w(|B|) − ½ ν_r B²)`
//! to the energy, `∫(H − ν_r B)·curl w` to the residual, `∫curl w·(∂H/∂B − ν_r) curl w` to the tangent. Of edge elements `ν_r`
//! cancels; of nodal ones it is the fixed penalty. The integrals are *defined* by the rule that is exact for a linear material:
//! the centroid for elements of first order, on which `B` is constant, four points for those of second order. Energy,
//! residual, tangent and shape derivative are derivatives of one another to the last digit on any mesh.

use fluxmorph_geometry::ElementId;
use fluxmorph_geometry::fem::c64;
use rayon::prelude::*;

use crate::bh::{BhCurve, Tangent};
use crate::element::Complex3;
use crate::element::density::OfFlux;
use crate::element::tensor::MOST_POINTS;
use crate::family::LocalIntegral;
use crate::solution::FieldState;
use crate::tangents::Tangents;

/// Elements whose integrals are held at once: some megabytes.
const CHUNK: usize = 8192;

/// What the laws add in one state.
pub(crate) struct Added {
    /// To the energy [J].
    pub(crate) energy: f64,
    /// To the residual, one entry an unknown.
    pub(crate) residual: Vec<c64>,
    pub(crate) tangents: Tangents,
}

/// Evaluates the laws of a model in a state.
pub(crate) fn added((model, mesh, state): FieldState<'_>) -> Added {
    let elements = model.elements_with_a_law();
    let mut residual = vec![c64::default(); model.unknown_count()];
    let (mut energy, mut tensors) = (0.0, Vec::with_capacity(elements.len()));
    for chunk in elements.chunks(CHUNK) {
        let of_chunk: Vec<_> = chunk.par_iter().map(|&e| of_element((model, mesh, state), e)).collect();
        // In the order of the elements, whatever the number of threads.
        for (&e, (integral, own)) in chunk.iter().zip(of_chunk) {
            energy += integral.value;
            tensors.push(own);
            for (&carrier, terms) in model.space().carriers_of(e).iter().zip(integral.potentials.values()) {
                model.unknowns().scatter_add(&mut residual, carrier, terms.map(|term| 2.0 * term));
            }
        }
    }
    Added { energy, residual, tangents: Tangents::new(elements.to_vec(), tensors) }
}

/// Energy with its derivatives, and tensors, of one element.
fn of_element(
    (model, mesh, state): FieldState<'_>,
    e: ElementId,
) -> (LocalIntegral<4>, [Tangent; MOST_POINTS]) {
    let curve = model.curve_of(e).expect("an element with a law");
    let (space, reluctivity) = (model.space(), model.coefficients_of(e).reluctivity);
    let (mut tensors, mut point) = ([[[0.0; 3]; 3]; MOST_POINTS], 0);
    let integral =
        space.elements().flux_integral(&space.cell(mesh, e), state.element(model, e).values(), &mut |b| {
            let (value, by_b) = energy(curve, b);
            let b = b.map(|c| c.re);
            tensors[point] = less(curve.tangent(b), reluctivity);
            point += 1;
            let linear = 0.5 * reluctivity * b.iter().map(|b| b * b).sum::<f64>();
            (value - linear, std::array::from_fn(|d| by_b[d] - 0.5 * reluctivity * b[d]))
        });
    (integral, tensors)
}

/// The energy density [J/m³], with its derivatives halved; of a phasor twice the mean over a period.
pub(crate) fn energy(curve: &BhCurve, b: Complex3) -> OfFlux {
    let law = curve.phasor(b);
    (law.energy(), law.field_strength().map(|h| 0.5 * h.conj()))
}

/// `H(B_u) − ν_r B_u` and `(∂H/∂B − ν_r) B_l`, from `B_l` and `B_u`: what the shape derivative takes. Of phasors the second has the
/// derivative's adjoint, as `crate::newton_harmonic` says.
pub(crate) fn response(curve: &BhCurve, linear: f64, l: Complex3, u: Complex3) -> [Complex3; 2] {
    let law = curve.phasor(u);
    let less = |h: Complex3, b: Complex3| std::array::from_fn(|d| h[d] - linear * b[d]);
    [less(law.field_strength(), u), less(law.adjoint(l), l)]
}

fn less(mut tensor: Tangent, reluctivity: f64) -> Tangent {
    (0..3).for_each(|d| tensor[d][d] -= reluctivity);
    tensor
}
