//! Orders of convergence on prisms with corners that turn into the domain, fitted over three meshes.

use super::boxed::{Cells, boxed};
use super::cases;
use super::discretisation::ALL;
use super::exact::Prism;
use super::problem::solve;
use crate::orders::Study;

/// Cells across the axis [m].
const SIZES: [f64; 3] = [0.1, 0.07, 0.05];

/// Around corners at which `A` is singular: iron, an impedance surface, a perfect conductor.
fn corners() -> [Prism; 4] {
    let [strong, stronger] = [1e3, 1e5].map(cases::iron_corner);
    [strong, stronger, cases::impedance_quarter(0.1, 1.0), cases::perfect_quarter()]
}

/// In the energy norm off the winding: of first order B is constant in an element, of second linear. The exact H is constant there,
/// so that what is left came from the winding; half an order may be lost to the kinks of its T within cells.
#[test]
#[ignore = "half a minute of CPU time"]
fn edge_elements_keep_their_order_at_corners() {
    for prism in corners() {
        for (discretisation, least) in ALL.into_iter().zip([None, None, Some(0.9), Some(1.5)]) {
            let mut energy =
                Study::new(format!("{}, {}: B in the energy norm", prism.name, discretisation.name));
            let mut observed = Study::new(format!("{}, {}: mean B far off", prism.name, discretisation.name));
            for size in SIZES {
                let mesh = boxed(&prism, Cells { size, ..Cells::COARSE });
                let errors = solve(&prism, &mesh, discretisation, 1.0).errors(&prism);
                energy.add(size, errors.energy);
                observed.add(size, errors.observed);
            }
            // Nodal elements converge at these corners at all, but for iron of first order (docs/verification.md, 2.8).
            energy.assert_order(least.unwrap_or(f64::NEG_INFINITY));
            observed.assert_order(f64::NEG_INFINITY);
        }
    }
}
