//! The gradient of the program against the exact derivative of a prism whose wall moves.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::tet4::dot;
use fluxmorph_solver::functional::{Follow, Observed, Weighting};
use fluxmorph_solver::{FieldModel, Functional, adjoint};

use super::boxed::{Cells, OBSERVATION, boxed};
use super::cases;
use super::derivative::Motion;
use super::discretisation::{ALL, Discretisation};
use super::exact::Prism;
use super::problem::set_up;

/// `d/ds ∫|B|²` [T² m²] over the observation, by the adjoint and the motion of every node.
fn square_derivative(prism: &Prism, mesh: &Mesh, motion: &Motion, discretisation: Discretisation) -> f64 {
    let (mesh, setup) = set_up(prism, mesh, 1.0);
    let model = FieldModel::new(&mesh, discretisation.of(setup)).expect("a sound problem");
    let (state, mut system) = model.solve(&mesh).expect("it converges");
    let region = mesh.topology().region(OBSERVATION).expect("every mesh has it");
    let observed = Observed::Deviation { target: [0.0; 3], weighting: Weighting::Volume };
    let functional = Functional::observation(&mesh, region, observed, Follow::Held).expect("it has elements");
    let value = functional.evaluate((&model, &mesh, &state)).expect("it is finite");
    let adjoint = adjoint::solve(&mut system, &value.derivative).expect("it converges");
    let velocity = |n: fluxmorph_geometry::NodeId| motion.of_node(mesh.point(n));
    let topology = mesh.topology();
    let moving: Vec<_> =
        topology.elements().filter(|&e| topology.tet(e).iter().any(|&n| velocity(n) != [0.0; 3])).collect();
    assert!(model.torn_source(|n| velocity(n) != [0.0; 3]).is_none(), "the source stays");
    assert!(
        functional.fixed_elements().all(|held| moving.binary_search(&held).is_err()),
        "the observation stays"
    );
    let gradient = adjoint::node_gradient((&model, &mesh, &state), &adjoint, &moving).expect("one process");
    topology.nodes().map(|n| dot(gradient[n.index()], velocity(n))).sum()
}

#[test]
fn gradients_are_exact_on_the_elements_that_reach_them() {
    let mut solved = 0;
    for (prism, motion) in cases::moving() {
        let (mesh, exact) = (boxed(&prism, Cells::COARSE), prism.square_derivative(&motion));
        for discretisation in ALL.into_iter().filter(|d| d.must_solve(&prism)) {
            let found = square_derivative(&prism, &mesh, &motion, discretisation);
            println!("    {:<40} {} {found:.6e}, exact {exact:.6e}", prism.name, discretisation.name);
            let error = (found / exact - 1.0).abs();
            // It is the derivative of a square.
            assert!(
                error < 2.0 * discretisation.tolerance,
                "{}, {}: {error}",
                prism.name,
                discretisation.name
            );
            solved += 1;
        }
    }
    assert!(solved >= 4, "{solved}");
}
