//! One evaluation with something in it that cannot be computed.

use fluxmorph_geometry::fem::c64;
use fluxmorph_optimizer::Error;
use fluxmorph_optimizer::problem::{Analysis, Derivatives, NoProgress, Problem, SolverCache};
use fluxmorph_remesh::RemeshError;
use fluxmorph_solver::linear::{LinearSolver, LinearSolverSettings, Method};
use fluxmorph_solver::{FieldModel, Functional, SolverError};

use super::with_field;
use crate::problems::{initial, quick};

fn evaluate(problem: &Problem, p: &[f64], derivatives: Derivatives) -> Result<Analysis, Error> {
    problem.evaluate(p, derivatives, &mut SolverCache::default(), &mut NoProgress)
}

/// The error of an evaluation of the initial design; it must be a numerical failure.
#[track_caller]
fn refused(problem: &Problem, want: Derivatives) -> Error {
    let error = evaluate(problem, &initial(problem), want).expect_err("it cannot be computed");
    assert!(error.is_numerical(), "{error}");
    error
}

#[test]
fn currents_out_of_range_name_the_state_and_its_frequency() {
    for current in [1e200, 1e-200] {
        let problem = with_field(quick(&[]).0, |setup| setup.coils[0].ampere_turns = c64::new(current, 0.0));
        let error = refused(&problem, Derivatives::None);
        let Error::Field { cause, .. } = &error else { panic!("{error}") };
        assert!(matches!(**cause, SolverError::OutOfRange { .. }), "{error}");
        let text = error.to_string();
        assert!(text.starts_with("the state at 60 Hz: ") && text.contains("currents"), "{text}");
    }
}

#[test]
fn a_conductivity_that_overflows_leaves_no_factor() {
    let meshed = ["regions.plate.model=\"volume\"", "remesh.region=[\"plate\", \"remesh\"]"];
    let problem = with_field(quick(&meshed).0, |setup| {
        for material in setup.materials.iter_mut().filter(|material| material.conductivity > 0.0) {
            material.conductivity = 1e308;
        }
    });
    let text = refused(&problem, Derivatives::None).to_string();
    assert!(text.starts_with("the state at 60 Hz: ") && text.contains("diagonal entry"), "{text}");
}

#[test]
fn a_solver_that_is_cut_short_names_residual_and_state() {
    let problem = with_field(quick(&[]).0, |setup| {
        setup.linear_solver = LinearSolverSettings {
            method: LinearSolver::Fixed(Method::Incomplete),
            max_iterations: Some(1),
            factor_bytes: 0,
            ..LinearSolverSettings::default()
        }
    });
    let error = refused(&problem, Derivatives::None);
    let Error::Field { problem: name, cause } = &error else { panic!("{error}") };
    let SolverError::NotConverged { residual, .. } = **cause else { panic!("{error}") };
    assert!(name == "the state at 60 Hz" && residual.is_finite(), "{error}");
}

#[test]
fn a_weight_out_of_range_names_the_adjoint() {
    for weight in [1e200, -1e250, 1e-200] {
        let mut problem = quick(&[]).0;
        problem.objective_mut().unwrap().terms[0].weight = weight;
        let text = refused(&problem, Derivatives::First).to_string();
        assert!(
            text.starts_with("the adjoint of the objective at 60 Hz: ") && text.contains("weights"),
            "{text}"
        );
    }
}

#[test]
fn a_weighted_sum_that_overflows_is_named() {
    for (weight, value) in [(f64::MAX, "inf"), (-f64::MAX, "-inf"), (f64::NAN, "NaN")] {
        // Energies of terajoules: any multiple of them by the largest number is none.
        let mut problem = with_field(quick(&[]).0, |setup| setup.coils[0].ampere_turns *= 1e6);
        let energy = Functional::energy(&problem.states()[0], None).unwrap();
        let term = &mut problem.objective_mut().unwrap().terms[0];
        (term.functional, term.weight) = (energy, weight);
        let text = refused(&problem, Derivatives::None).to_string();
        assert!(text.starts_with(&format!("the objective is {value}")), "{text}");
    }
}

#[test]
fn a_design_that_is_no_number_has_no_mesh() {
    let problem = quick(&[]).0;
    for bad in [f64::NAN, f64::INFINITY] {
        let mut p = initial(&problem);
        p[17] = bad;
        let error = evaluate(&problem, &p, Derivatives::First).expect_err("no mesh");
        assert!(matches!(error, Error::Remesh(RemeshError::NotFinite { .. })), "{error}");
        assert!(error.is_numerical());
    }
}

#[test]
fn a_design_beyond_its_mesh_names_the_element() {
    let problem = quick(&[]).0;
    for far in [1.0, 1e10, 1e100] {
        let p = vec![far; initial(&problem).len()];
        let error = evaluate(&problem, &p, Derivatives::First).expect_err("no mesh");
        assert!(matches!(error, Error::Remesh(RemeshError::Inverted { .. })), "{far:e}: {error}");
    }
}

#[test]
fn of_two_frequencies_the_one_that_fails_is_named() {
    let problem = quick(&[]).0;
    let mut setups = [problem.states()[0].setup().clone(), problem.states()[0].setup().clone()];
    (setups[1].frequency, setups[1].coils[0].ampere_turns) = (200.0, c64::new(f64::INFINITY, 0.0));
    let states = setups.map(|setup| FieldModel::new(problem.original(), setup).unwrap());
    let problem = problem.with_states(states.into());
    let text = refused(&problem, Derivatives::First).to_string();
    assert!(text.starts_with("the state at 200 Hz: "), "{text}");
}
