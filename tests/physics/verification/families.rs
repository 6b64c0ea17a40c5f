//! Nodal and edge elements of both orders on equal meshes: an infinite plate below a loop, and field and current of TEAM 7.

use fluxmorph_geometry::fem::c64;
use fluxmorph_solver::recovery::probe;
use fluxmorph_solver::{ElementFamily, Order};

use super::case::{numbers, rms_of_peak};
use super::plate;
use super::rows::assert_rows;
use super::steel::{Solved, solved};
use super::team7::{TOWARDS_COIL, current_places, plate_currents};
use crate::references::reference;

/// The bars are above the largest of all rows, the field behind 5 mm of steel: 28, 0.8, 14.6 and 0.6 %.
const ALL: [(ElementFamily, Order, f64); 4] = [
    (ElementFamily::Nodal, Order::Linear, 0.3),
    (ElementFamily::Nodal, Order::Quadratic, 0.01),
    (ElementFamily::Edge, Order::Linear, 0.15),
    (ElementFamily::Edge, Order::Quadratic, 0.01),
];

/// Of Bz between plate and coil, over the peak of a line: what is left is the mesh's.
const FIELD_BAR: f64 = 0.05;

/// Of Jy on the plate's upper side: an independent solution of second order is as far from the measurement as all are here.
const CURRENT_BAR: f64 = 0.2;

#[test]
#[ignore = "prints a table in minutes: just test-long"]
fn loops_and_plates_by_all_elements() {
    for (family, order, bar) in ALL {
        println!("{family:?}");
        assert_rows(&plate::by_elements(family, order, bar));
    }
}

/// Errors of `B_z`, and of `J_y` on the face towards the coil, over their lines, root mean square over the peak.
fn team7(family: &str, order: usize) -> Vec<(String, f64)> {
    let [elements, order] = [format!("analysis.elements=\"{family}\""), format!("analysis.order={order}")];
    let device = solved("team7_50hz.toml", &[&elements, &order, "mesh.boxes.refinement=0.6"]);
    let Solved { model, mesh, solution } = &device;
    let measured = reference("team7.json");
    let mut errors = Vec::new();
    let mut compare = |quantity: &str, line: &serde_json::Value, found: [Vec<f64>; 2]| {
        for (found, phase) in found.iter().zip(["50Hz_0deg", "50Hz_90deg"]) {
            let error = rms_of_peak(found, &numbers(&line[phase]));
            errors.push((format!("{quantity} {} {phase}", line["line"]), error));
        }
    };
    for line in measured["bz_gauss"].as_array().expect("lines") {
        let [y, z] = ["y_mm", "z_mm"].map(|key| 1e-3 * line[key].as_f64().expect("a place"));
        let points: Vec<[f64; 3]> = numbers(&line["x_mm"]).iter().map(|x| [1e-3 * x, y, z]).collect();
        let field = probe((model, mesh, solution), "line", &points).expect("points of the mesh");
        let part = |of: fn(&c64) -> f64| field.iter().map(|b| 1e4 * of(&b[2])).collect();
        compare("Bz", line, [part(|b| b.re), part(|b| -b.im)]);
    }
    // The table that is labelled with the other face.
    let line = &measured["jy_1e6_A_per_m2"][1];
    compare("Jy", line, plate_currents(&device, &current_places(line, TOWARDS_COIL)));
    errors
}

#[test]
#[ignore = "prints a table in minutes: just test-long"]
fn field_and_current_of_team_7_by_all_elements() {
    for (family, order) in [("nodal", 1), ("nodal", 2), ("edge", 1), ("edge", 2)] {
        for (line, error) in team7(family, order) {
            println!("{family} {order}: {line}: {:.1} %", 100.0 * error);
            let bar = if line.starts_with("Bz") { FIELD_BAR } else { CURRENT_BAR };
            assert!(error < bar, "{family} {order}: {line}");
        }
    }
}
