//! The shield plate on a coarse mesh, linear against quadratic elements, with the field of the independent reference.
//!
//! Two layers of elements in the first skin depths of the plate and 21 thousand tetrahedra in all. The reference itself is
//! some tenths of a per cent away from a finer one.

use super::rows::{Case, Row, assert_rows};
use crate::problems::{analysed, variables};
use crate::support::setup;
use crate::support::shield::{ShieldReference, relative_l2};

const COARSE: [&str; 3] = [
    "mesh.shield.refinement=0.5",
    "mesh.shield.skin=[\"0.8 mm\", \"3 mm\"]",
    "mesh.shield.side_skin=[\"1 mm\", \"6 mm\"]",
];

/// All complex components of B in the twelve observation cells, flat plate.
fn cells(order: u8, bar: f64) -> Row {
    let order = format!("analysis.order={order}");
    let setup = setup("shield.toml", &[&COARSE[..], &[&order]].concat());
    let problem = &setup.problem;
    let analysis = analysed(problem, &vec![0.0; variables(problem)]);
    let (model, solution) = (&problem.states()[0], &analysis.solutions[0]);
    let objective = problem.objective().expect("an objective");
    let cells = objective.terms[0].functional.cell_flux_densities((model, &analysis.mesh, solution));
    let error = relative_l2(&cells, &ShieldReference::read().flat);
    let name = format!("shield, flat meshed plate, {:?}", model.space().order());
    let case = Case::new(name, &analysis.mesh, model);
    case.graded("B in 12 cells, relative l2", "36 components".to_owned(), "reference".to_owned(), error, bar)
}

pub(crate) fn rows() -> Vec<Row> {
    vec![cells(1, 0.08), cells(2, 0.02)]
}

#[test]
fn quadratic_elements_are_several_times_as_exact_at_a_permeable_plate() {
    let rows = rows();
    assert_rows(&rows);
    assert!(rows[0].error() > 4.0 * rows[1].error());
}
