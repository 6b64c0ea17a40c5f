//! Work that is shared out among ranks has the results of one process. The ranks are threads here; `tests/mpi` has them as
//! processes of MPI with PETSc.

mod group;
mod runs;

use fluxmorph_optimizer::problem::{Derivatives, NoProgress, Problem, SolverCache};
use fluxmorph_remesh::StiffnessPolicy;
use fluxmorph_solver::Order;
use group::{attempted, led};

use crate::support::{self, relative_difference};

/// A meshed plate, coarse: skin layers, ψ, interfaces.
const MESHED: [&str; 4] = [
    "mesh.shield.refinement=0.3",
    "mesh.shield.growth=2.5",
    "mesh.shield.skin=[4e-4,1.2e-3,2.5e-3,5e-3]",
    "analysis.linear_solver.method=\"direct\"",
];

/// Deviation of objective and gradient that solutions to 1e-11 leave.
const SAME: f64 = 1e-8;

/// Objective, gradient and worst quality at a design in the middle of nowhere.
fn numbers(problem: &Problem) -> Vec<(f64, Vec<f64>, f64)> {
    let count = problem.shape().expect("a design").surface().variable_count();
    let design = |step: f64| (0..count).map(|k| 1e-3 * step * (1.0 + (k as f64).sin())).collect::<Vec<f64>>();
    let mut numbers = Vec::new();
    for step in [0.5, 1.0] {
        let p = design(step);
        let analysis = problem
            .evaluate(&p, Derivatives::First, &mut SolverCache::default(), &mut NoProgress)
            .expect("it is solved");
        assert!(analysis.worst_residual < 1e-9, "{:e}", analysis.worst_residual);
        let gradient = analysis.gradient.expect("asked for");
        numbers.push((analysis.objective.expect("there is one"), gradient, analysis.quality.worst));
    }
    numbers
}

fn assert_same(own: &[(f64, Vec<f64>, f64)], other: &[(f64, Vec<f64>, f64)], what: &str) {
    assert_eq!(own.len(), other.len());
    for ((f, g, q), (f0, g0, q0)) in own.iter().zip(other) {
        let objective = (f / f0 - 1.0).abs();
        let gradient = relative_difference(g, g0);
        assert!(objective < SAME && gradient < SAME, "{what}: {objective:e}, {gradient:e}");
        // The mesh is moved by an elastic solution to 1e-12.
        assert!((q / q0 - 1.0).abs() < SAME, "{what}: quality {q} and {q0}");
    }
}

fn ranks_agree(name: &str, overrides: &[&str], sizes: &[usize]) {
    let alone = numbers(&support::setup(name, overrides).problem);
    for &size in sizes {
        let shared = led(size, name, overrides, |setup| numbers(&setup.problem));
        assert_same(&shared, &alone, &format!("{name} on {size} ranks"));
    }
}

#[test]
fn objective_and_gradient_of_a_meshed_conductor_are_those_of_one_process() {
    ranks_agree("shield.toml", &MESHED, &[1, 2, 5]);
}

#[test]
fn so_are_those_of_conductors_at_two_frequencies() {
    let overrides = ["mesh.shield.refinement=0.35", "analysis.linear_solver.method=\"direct\""];
    ranks_agree("shield_two_frequencies.toml", &overrides, &[3]);
}

#[test]
fn so_are_those_of_loads_on_one_matrix() {
    let overrides = ["mesh.shield.refinement=0.35", "analysis.linear_solver.method=\"direct\""];
    ranks_agree("shield_two_loads.toml", &overrides, &[3]);
}

#[test]
fn so_are_those_of_quadratic_elements() {
    let overrides =
        ["mesh.shield.refinement=0.3", "analysis.order=2", "analysis.linear_solver.method=\"direct\""];
    let order = support::setup("shield_quick.toml", &overrides).problem.states()[0].space().order();
    assert_eq!(order, Order::Quadratic);
    ranks_agree("shield_quick.toml", &overrides, &[2]);
}

#[test]
fn so_are_those_of_edge_elements() {
    for (order, skin) in [("1", "[4e-4,1.2e-3,2.5e-3,5e-3]"), ("2", "[5e-3]")] {
        let own = [format!("analysis.order={order}"), format!("mesh.shield.skin={skin}")];
        let coarse = ["mesh.shield.refinement=0.25", "mesh.shield.growth=2.5", &own[0], &own[1]];
        let method = ["analysis.elements=\"edge\"", "analysis.linear_solver.method=\"direct\""];
        ranks_agree("shield.toml", &[&coarse[..], &method].concat(), &[3]);
    }
}

#[test]
fn so_are_those_of_a_magnet_and_of_every_stiffness() {
    for policy in StiffnessPolicy::ALL {
        let stiffness = format!("remesh.stiffness=\"{}\"", policy.name());
        ranks_agree("pole.toml", &["mesh.boxes.refinement=0.5", &stiffness], &[2]);
    }
}

#[test]
fn what_one_process_solves_is_refused_at_its_key() {
    for (name, key) in
        [("actuator.toml", "bh_file = \"steel_team20.csv\""), ("busbar.toml", "conductor = \"solid\"")]
    {
        let refused = attempted(2, name, &[], |setup| setup.expect_err("it takes one process").to_string());
        assert!(refused.contains(key) && refused.contains("without `mpirun`"), "{refused}");
    }
}

#[test]
fn every_rank_has_about_the_same_number_of_rows() {
    let counts = led(4, "shield.toml", &MESHED, |setup| {
        let share = setup.problem.share().expect("it is shared out");
        (0..4).map(|rank| share.partition.nodes_of(rank).len()).collect::<Vec<_>>()
    });
    let mean = counts.iter().sum::<usize>() as f64 / 4.0;
    // Nodes in the plate count four unknowns, others three.
    assert!(counts.iter().all(|&n| (n as f64 / mean - 1.0).abs() < 0.15), "{counts:?}");
}
