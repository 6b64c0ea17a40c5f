//! What every discretisation must get right.

use super::boxed::{Cells, boxed};
use super::cases;
use super::discretisation::ALL;
use super::exact::Prism;
use super::problem::solve;
use super::unstructured;

#[test]
fn prisms_are_right_on_the_elements_that_reach_them() {
    let structured = cases::all().into_iter().map(|prism| {
        let mesh = boxed(&prism, Cells::COARSE);
        (prism, mesh)
    });
    let mut solved = 0;
    for (prism, mesh) in structured.chain(unstructured::all()) {
        for discretisation in ALL.into_iter().filter(|d| d.must_solve(&prism)) {
            let errors = solve(&prism, &mesh, discretisation, 1.0).errors(&prism);
            println!("    {:<45} {} {errors:?}", prism.name, discretisation.name);
            // The loss is quadratic in the field.
            let worst = errors.observed.max(0.5 * errors.loss.unwrap_or(0.0));
            assert!(worst < discretisation.tolerance, "{}, {}: {errors:?}", prism.name, discretisation.name);
            solved += 1;
        }
    }
    assert!(solved > 10, "{solved}");
}

#[test]
fn the_edges_that_turn_into_a_prism_are_counted() {
    let count = |prism: Prism| prism.re_entrant_edges();
    assert_eq!(count(cases::air()) + count(cases::side(0.1, 1.0)) + count(cases::meshed_quarter(0.1)), 0);
    assert_eq!([count(cases::perfect_quarter()), count(cases::impedance_quarter(0.1, 1.0))], [1, 1]);
    assert_eq!([count(cases::tee()), count(cases::island(super::exact::Kind::Perfect, ""))], [2, 4]);
    let shapes = unstructured::SHAPES.map(|shape| count(shape.prism(1.0, super::exact::Kind::Iron(1.0), "")));
    assert_eq!(shapes, [0, 1, 2, 4]);
}
