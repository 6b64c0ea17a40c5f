//! What every discretisation must get right, asserted; and faults by the numbers with which they were first seen.

use fluxmorph_geometry::fem::c64;
use fluxmorph_solver::recovery::probe;

use super::boxed::{Cells, boxed};
use super::cases;
use super::discretisation::{ALL, Discretisation};
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

/// `B_z` [µT] at the middle of the far arm.
fn far_arm(prism: &Prism, cells: Cells, discretisation: Discretisation, penalty: f64) -> c64 {
    let solved = solve(prism, &boxed(prism, cells), discretisation, penalty);
    let points = [[-0.6, -0.6, 0.5 * prism.height]];
    let field = probe(&solved.solution, &solved.model, &solved.mesh, "far arm", &points);
    1e6 * field.expect("it lies in the mesh")[0][2]
}

/// A fault: what, the prism and its mesh, the penalty, and what order 1 and 2 first gave.
type Fault = (&'static str, Prism, Cells, f64, [&'static str; 2]);

fn faults() -> Vec<Fault> {
    let skin = |size: f64| Cells { skin: size, ..Cells::FINE };
    let [wide, thin] = [0.1, 0.01].map(|depth| cases::impedance_quarter(depth, 1.0));
    let (wall, iron, meshed) =
        (cases::perfect_quarter(), cases::iron_corner(1e3), cases::meshed_quarter(0.01));
    vec![
        ("impedance quarter, δ 100 mm", wide, skin(0.025), 1.0, ["-60.7+19.6j", "-74.2+23.1j"]),
        ("impedance quarter, δ 10 mm", thin, skin(0.003), 1.0, ["-25.8", "-30.3"]),
        ("re-entrant wall, penalty 1", wall.clone(), Cells::FINE, 1.0, ["", "7.5 %"]),
        ("re-entrant wall, penalty 0.1", wall.clone(), Cells::FINE, 0.1, ["", "67 %"]),
        ("re-entrant wall, penalty 0.01", wall, Cells::FINE, 0.01, ["", "96 %"]),
        ("beside iron, 100 mm", iron.clone(), Cells::COARSE, 1.0, ["4.0 ×", "1.000 ×"]),
        ("beside iron, 50 mm", iron, Cells::FINE, 1.0, ["1.8 ×", "1.001 ×"]),
        ("meshed quarter, first layer 3 mm", meshed, skin(0.003), 1.0, ["-63.7+54.0j", "exact"]),
    ]
}

/// Prints what every discretisation makes of the faults that nodal elements first had, beside these.
#[test]
#[ignore = "a table to read"]
fn table_of_faults() {
    println!(
        "{:<34} {:<8} {:>12} {:>18} {:>18} {:>8}",
        "B_z [µT]", "elements", "first seen", "now", "exact", "ratio"
    );
    for (what, prism, cells, penalty, first) in faults() {
        let exact = 1e6 * prism.flux_density([-0.6, -0.6], 1.0);
        for (i, discretisation) in ALL.into_iter().enumerate() {
            let now = far_arm(&prism, cells, discretisation, penalty);
            let text = |b: c64| format!("{:.2}{:+.2}j", b.re, b.im);
            println!(
                "{what:<34} {:<8} {:>12} {:>18} {:>18} {:>8.4}",
                discretisation.name,
                first.get(i).unwrap_or(&""),
                text(now),
                text(exact),
                now.norm() / exact.norm(),
            );
        }
    }
}
