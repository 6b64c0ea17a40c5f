//! Element kernels: pure functions from a few numbers to a small array.
//!
//! With the penalty `ν_p = p ν`, the weak form of the vector potential is split as
//!
//! `∫ν curl A·curl w + ∫pν div A div w = ∫ν ∇A:∇w + ∫(p−1)ν div A div w + Σ_T [ν] ∫_T (…)`
//!
//! where the last sum runs over the triangles at which `ν` jumps: on each region of constant `ν` the difference between
//! `curl·curl + div·div` and `∇:∇` is a null Lagrangian, that is, a surface integral. So for `p = 1` the three
//! components of `A` couple on those triangles only. [`volume`] holds the linear tetrahedron, [`quadratic`] that of any
//! order, [`interface`] the triangles, [`impedance`] the Leontovich surface with `ψ` on it; [`lagrange`], [`quadrature`] and
//! [`tabulated`] what they are made from; [`point`] the field at a point, the loads, and the derivative with respect to the node positions;
//! [`tensor`] what reluctivities that are tensors add to the matrix; [`density`] integrals of energy and loss with their
//! derivatives; `virtual_work` forces; `edge` all of that for edge elements.

pub mod density;
#[cfg(test)]
pub(crate) mod differences;
pub(crate) mod edge;
pub mod impedance;
pub mod interface;
pub mod lagrange;
pub mod point;
pub mod quadratic;
pub mod quadrature;
pub mod tabulated;
pub mod tensor;
pub(crate) mod triangle;
pub(crate) mod virtual_work;
pub mod volume;

use fluxmorph_geometry::fem::c64;

pub use edge::FieldPoint;

/// The three components of a nodal vector potential, or of its adjoint.
pub type Complex3 = [c64; 3];

/// `Σ_i x_i y_i`, without conjugation.
#[inline]
pub(crate) fn dot3(x: Complex3, y: Complex3) -> c64 {
    x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
}

/// `|x|`: the root of the sum of the squares of all amplitudes.
pub fn amplitude(x: &Complex3) -> f64 {
    x.iter().map(|c| c.norm_sqr()).sum::<f64>().sqrt()
}

/// `x × y`, without conjugation.
#[inline]
pub(crate) fn cross3(x: Complex3, y: Complex3) -> Complex3 {
    [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]]
}

/// `ε_ijk`, the sign of the permutation `(i, j, k)`.
#[inline]
pub(crate) fn levi_civita(i: usize, j: usize) -> (usize, f64) {
    // The third index and the sign; for i = j the caller skips.
    let k = 3 - i - j;
    (k, if (i + 1) % 3 == j { 1.0 } else { -1.0 })
}
