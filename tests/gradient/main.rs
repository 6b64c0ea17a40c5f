//! The gradient through the whole chain p → mesh → field → F, against Taylor's theorem and central differences.

#[path = "../support/mod.rs"]
mod support;

use fluxmorph_optimizer::problem::Problem;
use fluxmorph_optimizer::verify::{Settings, certify};
use support::setup;

/// Small meshes: the exactness of a discrete gradient does not depend on the mesh.
const MESHED: [&str; 5] = [
    "regions.plate.model=\"volume\"",
    "mesh.shield.skin=[\"1 mm\", \"4 mm\"]",
    "remesh.region=[\"plate\", \"remesh\"]",
    "remesh.stiffness=\"inverse_volume\"",
    "remesh.poisson=0.1",
];

fn holds(problem: &Problem, p: &[f64]) {
    let certificate = certify(problem, p, &Settings::default(), |_, _| {}).unwrap_or_else(|e| panic!("{e}"));
    for direction in &certificate.directions {
        println!("slope {:.4}, central difference {:.2e}", direction.slope, direction.error);
    }
    assert!(certificate.holds, "slope {}, error {:e}", certificate.least_slope, certificate.largest_error);
    assert!(certificate.directions.len() >= 5 && certificate.directions[0].steps.len() >= 6);
}

/// A design inside the bounds that is flat nowhere.
fn wavy(problem: &Problem) -> Vec<f64> {
    let variables = problem.shape.as_ref().expect("a shape").surface.variable_count();
    (0..variables).map(|k| 4e-3 + 3e-3 * (1.7 * k as f64).sin()).collect()
}

fn flat(problem: &Problem) -> Vec<f64> {
    problem.shape.as_ref().expect("a shape").initial.clone()
}

#[test]
fn the_gradient_of_the_impedance_model_is_exact() {
    let setup = setup("shield_quick.toml", &[]);
    holds(&setup.problem, &flat(&setup.problem));
    holds(&setup.problem, &wavy(&setup.problem));
}

#[test]
fn the_gradient_of_the_volume_model_is_exact() {
    let setup = setup("shield_quick.toml", &MESHED);
    holds(&setup.problem, &flat(&setup.problem));
    holds(&setup.problem, &wavy(&setup.problem));
}

#[test]
fn the_gradient_is_exact_with_another_penalty_and_volume_weighting() {
    let mut overrides = MESHED.to_vec();
    overrides.extend(["analysis.penalty=0.3", "objective.weighting=\"volume\""]);
    let setup = setup("shield_quick.toml", &overrides);
    holds(&setup.problem, &wavy(&setup.problem));
}

#[test]
fn the_gradient_is_exact_in_statics_on_a_coarse_control_grid() {
    let mut overrides = MESHED.to_vec();
    overrides.extend(["analysis.frequency=\"0 Hz\"", "remesh.motion=\"along_design\"", "design.grid=[2, 3]"]);
    let setup = setup("shield_quick.toml", &overrides);
    holds(&setup.problem, &wavy(&setup.problem));
}
