//! The two-level preconditioner on skin-graded meshes of the shield: its iterations are few, its bits do not depend on the threads.

use crate::{STEEL, on_threads, over_a_plate};
use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::generate::{ShieldParameters, shield};
use fluxmorph_solver::linear::{LinearSolver, LinearSolverSettings, Method};
use fluxmorph_solver::{ElementFamily, FieldModel, FieldModelSetup, Order};

/// The shipped shield, coarser.
fn mesh(refinement: f64) -> Mesh {
    let parameters = ShieldParameters {
        refinement,
        skin: vec![0.3e-3, 0.8e-3, 1.6e-3, 3e-3, 5e-3],
        side_skin: vec![0.5e-3, 1.5e-3, 4e-3, 10e-3],
        side_air: 4e-3,
        growth: 1.8,
        ..ShieldParameters::default()
    };
    shield(&parameters).expect("a sound shield")
}

fn model(mesh: &Mesh, order: Order) -> FieldModel {
    let method = LinearSolver::Fixed(Method::TwoLevel);
    let setup = FieldModelSetup {
        family: ElementFamily::Nodal,
        order,
        linear_solver: LinearSolverSettings { method, ..LinearSolverSettings::default() },
        ..over_a_plate(mesh, STEEL, 40e3, 60.0)
    };
    FieldModel::new(mesh, setup).expect("a sound problem")
}

/// Iterations and unknowns of the state on one mesh.
fn solved(mesh: &Mesh, order: Order) -> (usize, usize) {
    let model = model(mesh, order);
    let (field, system) = model.solve(mesh).expect("it converges");
    assert_eq!(system.method(), Some(Method::TwoLevel), "{:?}", system.events());
    let report = field.report();
    println!(
        "{} unknowns: {} iterations, residual {:.1e}",
        model.unknown_count(),
        report.iterations,
        report.residual
    );
    // The recurrence ends at 1e-11; the true residual drifts by the rounding of some tens of products.
    assert!(report.residual < 3e-11, "{:e}", report.residual);
    (report.iterations, model.unknown_count())
}

/// An incomplete factor alone needs more than five hundred on the largest of these meshes; they grow with its width (34, 49, 54).
#[test]
fn linear_elements_take_few_iterations_on_skin_layers() {
    for refinement in [0.25, 0.5, 0.75] {
        let (count, unknowns) = solved(&mesh(refinement), Order::Linear);
        assert!(count <= 60, "{count} on {unknowns} unknowns");
    }
}

/// Flat elements are hard for the smoother: about 300 iterations, but not more on finer meshes.
#[test]
#[ignore = "minutes: just test-long"]
fn the_iterations_of_quadratic_elements_hardly_grow_with_the_mesh() {
    let counts = [0.25, 0.4, 0.5].map(|refinement| solved(&mesh(refinement), Order::Quadratic).0);
    assert!(counts.iter().all(|&count| count <= 350), "{counts:?}");
    assert!(counts[2] <= counts[0] + counts[0] / 2, "{counts:?}");
}

#[test]
fn the_bits_do_not_depend_on_the_threads() {
    let mesh = mesh(0.25);
    let values = || model(&mesh, Order::Linear).solve(&mesh).expect("it converges").0.values().to_vec();
    let one = on_threads(1, values);
    assert_eq!(on_threads(2, values), one);
    assert_eq!(on_threads(4, values), one);
}
