//! The table of all prisms and discretisations.

use fluxmorph_geometry::Mesh;

use super::boxed::{Cells, boxed};
use super::discretisation::ALL;
use super::exact::Prism;
use super::gradient::square_derivative;
use super::problem::{Errors, try_solve};
use super::refine::refined;
use super::{cases, iron_circuit, unstructured};

/// Errors of B, of the loss, and what they cost: the mean of B over the observation, far from the source; the energy norm
/// of B from two coarse cells off the winding on, where the field is weak; the loss of all conductors.
#[test]
#[ignore = "a table to read, of some minutes"]
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
        rows(&prism, &refined(&mesh));
    }
    for refinement in [0.95, 1.1, 1.7] {
        let mesh = iron_circuit::mesh(refinement);
        for discretisation in ALL {
            let gap = iron_circuit::solve(&mesh, discretisation, 1.0);
            println!(
                "{:<44} {:>4} {:>7} {:<8} {:>8} {:>7.2} {:>9}",
                format!("iron circuit, {:.4} T", gap.mean),
                0,
                mesh.topology().tets().len(),
                discretisation.name,
                gap.unknowns,
                gap.cpu_seconds,
                per_cent(gap.mean / iron_circuit::GAP_FIELD - 1.0),
            );
        }
    }
}

#[test]
#[ignore = "a table to read"]
fn of_gradients() {
    println!(
        "{:<44} {:<8} {:>13} {:>13} {:>9}",
        "prism with a moving wall", "elements", "gradient", "exact", "error"
    );
    for (prism, motion) in cases::moving() {
        let exact = prism.square_derivative(&motion);
        for cells in [Cells::COARSE, Cells::FINE] {
            let mesh = boxed(&prism, cells);
            for discretisation in ALL {
                let found = square_derivative(&prism, &mesh, &motion, discretisation);
                let error = per_cent(found / exact - 1.0);
                println!(
                    "{:<44} {:<8} {found:>13.5e} {exact:>13.5e} {error:>9}",
                    prism.name, discretisation.name
                );
            }
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
