//! Where a field misses what a functional of its quality asks for: a number [T] in every element that takes part.
//!
//! Of `target_field` it is `|B − B_target|`; of a homogeneity `|B − B̄|`, or what the component or the modulus has more than its
//! mean; of the content of an expansion what is left of the field inside the circle or the ball without its main terms. All of it
//! at the middle of the element; a component that alternates has its magnitude. Of elements of first order, which have one `B` each,
//! an expansion and what is left of it are of the recovered field. The elements' volumes are the picture's weights, not the
//! functional's, which may count cells.

use fluxmorph_geometry::ElementId;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::centroid;
use rayon::prelude::*;

use super::{Functional, MultipoleFunctional, Observation};
use crate::Order;
use crate::recovery::RecoveredPoint;
use crate::solution::FieldState;

/// Barycentric coordinates of the middle.
const MIDDLE: [f64; 4] = [0.25; 4];

impl Functional {
    /// The deviation [T] of every element that takes part, each once, in no order; empty for what is no quality of a field.
    pub fn deviations(&self, state: FieldState<'_>) -> Vec<(ElementId, f64)> {
        match self {
            Self::Observation(observation) => of_observation(observation, state),
            Self::Multipole(functional) => of_expansion(functional, state),
            _ => Vec::new(),
        }
    }
}

fn of_observation(
    observation: &Observation,
    (model, mesh, solution): FieldState<'_>,
) -> Vec<(ElementId, f64)> {
    let Some(deviation) = observation.deviation_of((model, mesh, solution)) else { return Vec::new() };
    let at = |e| (e, deviation(solution.at(model, mesh, e, &MIDDLE).flux_density));
    observation.elements_on(model, mesh).into_iter().map(at).collect()
}

fn of_expansion(functional: &MultipoleFunctional, state: FieldState<'_>) -> Vec<(ElementId, f64)> {
    let (model, mesh, solution) = state;
    let Some(main) = functional.main_field(state) else { return Vec::new() };
    let inside: Vec<ElementId> =
        mesh.topology().elements().filter(|&e| main.domain().meets(mesh.vertices(e))).collect();
    let at = |&e: &ElementId| {
        let middle = centroid(mesh.vertices(e));
        let b = match model.setup().order {
            Order::Linear => RecoveredPoint::new(model, mesh, e, middle).flux_density(state),
            Order::Quadratic => solution.at(model, mesh, e, &MIDDLE).flux_density,
        };
        let left = main.remainder(middle, b);
        (e, if model.angular_frequency() == 0.0 { signed(left) } else { size(left) })
    };
    inside.par_iter().map(at).collect()
}

/// The one component that is compared with its sign, or the size of a vector.
fn signed(left: [Option<c64>; 2]) -> f64 {
    match left {
        [Some(one), None] => one.re,
        _ => size(left),
    }
}

fn size(left: [Option<c64>; 2]) -> f64 {
    left.iter().flatten().map(|c| c.norm_sqr()).sum::<f64>().sqrt()
}
