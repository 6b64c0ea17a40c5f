//! The table of all prisms and discretisations.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::refine::{RefineLimits, uniform};

use super::boxed::{Cells, boxed};
use super::discretisation::ALL;
use super::exact::Prism;
use super::problem::{Errors, try_solve};
use super::{cases, iron_circuit, unstructured};

/// Errors of B, of the loss, and what they cost: the mean of B over the observation, far from the source; the energy norm
/// of B from two coarse cells off the winding on, where the field is weak; the loss of all conductors.
#[test]
#[ignore = "a table of some minutes"]
fn of_all_cases() {
    println!(
        "{:<44} {:>4} {:>7} {:<8} {:>8} {:>7} {:>9} {:>9} {:>9}",
        "prism", "edge", "tets", "elements", "unknowns", "CPU s", "B far", "B rms", "loss"
    );
    for prism in cases::all() {
        for cells in [Cells::COARSE, Cells::FINE] {
            rows(&prism, &boxed(&prism, cells));
        }
    }
    for (prism, mesh) in unstructured::all() {
        rows(&prism, &mesh);
        rows(&prism, uniform(&mesh, RefineLimits::default()).expect("eight for each").mesh());
    }
    for refinement in [0.95, 1.1, 1.7] {
        let mesh = iron_circuit::mesh(refinement);
        for discretisation in ALL {
            let gap = iron_circuit::solve(&mesh, discretisation, 1.0);
            let error = gap.mean / iron_circuit::GAP_FIELD - 1.0;
            println!(
                "{:<44} {:>4} {:>7} {:<8} {:>8} {:>7.2} {:>9}",
                format!("iron circuit, {:.4} T", gap.mean),
                0,
                mesh.topology().tets().len(),
                discretisation.name,
                gap.unknowns,
                gap.cpu_seconds,
                per_cent(error),
            );
            assert!(discretisation.name.starts_with("nodal") || error.abs() < 0.005, "{error}");
        }
    }
}

/// The rows of a prism on a mesh.
fn rows(prism: &Prism, mesh: &Mesh) {
    for discretisation in ALL {
        let solved = match try_solve(prism, mesh, discretisation, 1.0) {
            Ok(solved) => solved,
            Err(fault) => {
                println!("{:<44} {}: {fault}", prism.name, discretisation.name);
                continue;
            }
        };
        let Errors { observed, energy, loss } = solved.errors(prism);
        assert!(!discretisation.must_solve(prism) || observed < discretisation.tolerance, "{observed}");
        println!(
            "{:<44} {:>4} {:>7} {:<8} {:>8} {:>7.2} {:>9} {:>9} {:>9}",
            prism.name,
            prism.re_entrant_edges(),
            solved.mesh.topology().tets().len(),
            discretisation.name,
            solved.model.unknown_count(),
            solved.cpu_seconds,
            per_cent(observed),
            per_cent(energy),
            loss.map_or(String::new(), per_cent),
        );
    }
}

fn per_cent(error: f64) -> String {
    format!("{:.3} %", 100.0 * error)
}
