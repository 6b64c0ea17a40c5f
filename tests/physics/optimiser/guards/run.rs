//! Runs of which an evaluation fails.

use fluxmorph::ExitCode;
use fluxmorph::config::{Algorithm, Optimizer};
use fluxmorph::files::{OutputError, RunStatus, StopReason};
use fluxmorph::show::{Evaluation, Observer};
use fluxmorph_geometry::fem::c64;
use fluxmorph_optimizer::Error;
use fluxmorph_optimizer::driver::{Optimised, optimise};
use fluxmorph_optimizer::problem::Problem;
use fluxmorph_solver::SolverError;
use fluxmorph_solver::linear::{LinearSolver, LinearSolverSettings, Method, Reuse};

use super::{overflowing, with_field};
use crate::problems::{Rows, quick};

/// What a run warns of.
#[derive(Default)]
struct Warnings(Vec<String>);

impl Observer for Warnings {
    fn warning(&mut self, message: &str) {
        self.0.push(message.to_owned());
    }
}

fn run(
    mut problem: Problem,
    settings: &Optimizer,
    rows: &mut Rows,
) -> (Result<Optimised, Error>, Vec<String>) {
    let mut warnings = Warnings::default();
    let ended = optimise(&mut problem, &settings.settings(), &mut warnings, rows, &|| false);
    (ended, warnings.0)
}

/// What a run leaves that failed after some evaluations: the best of them, and nothing but numbers.
#[track_caller]
fn best_is_saved(optimised: &Optimised, rows: &[Evaluation]) {
    assert_eq!(optimised.stop_reason, StopReason::NumericalFailure);
    assert_eq!(ExitCode::from(optimised.stop_reason), ExitCode::Numerical);
    assert_eq!(RunStatus::from(optimised.stop_reason), RunStatus::Failed);
    assert_eq!(optimised.evaluations, rows.len());
    let best = &optimised.best;
    assert_eq!(best.objective, rows[best.evaluation].objective);
    assert!(best.values.iter().all(|p| p.is_finite()));
    assert!(best.analysis.solutions[0].values().iter().all(|x| x.is_finite()));
    for row in rows {
        let numbers = [row.objective, row.ratio, row.gradient_norm, row.step_norm, row.worst_quality];
        assert!(numbers.iter().all(|x| x.is_finite()), "{row:?}");
    }
}

/// The objective grows until the right side of the adjoint leaves the range of numbers.
#[test]
fn every_algorithm_that_runs_into_an_overflow_ends_with_its_best_design() {
    for algorithm in Algorithm::ALL {
        let (problem, settings) = overflowing(1.02);
        let settings = Optimizer { algorithm, max_evaluations: 40, ..settings };
        let mut rows = Rows::default();
        let (ended, warnings) = run(problem, &settings, &mut rows);
        best_is_saved(&ended.unwrap(), &rows.rows);
        let named = |warning: &String| warning.starts_with("the adjoint of the objective at 60 Hz: ");
        assert!(warnings.iter().any(named), "{algorithm:?}: {warnings:?}");
    }
}

/// The required residual lies between that of the first evaluations and that of a later one.
#[test]
fn a_later_design_that_does_not_converge_ends_the_run_with_the_best_one() {
    let settings_with = |required: f64| LinearSolverSettings {
        method: LinearSolver::Fixed(Method::Incomplete),
        tolerance: 1e-9,
        required,
        factor_bytes: 0,
        reuse: Reuse::Never,
        ..LinearSolverSettings::default()
    };
    let (problem, settings) = quick(&["optimizer.max_evaluations=12", "optimizer.ftol_rel=0"]);
    let mut free = Rows::default();
    let free_problem = with_field(problem, |setup| setup.linear_solver = settings_with(1e-8));
    run(free_problem, &settings, &mut free).0.unwrap();
    let residuals = free.residuals;
    let mut most = residuals[0];
    let later = residuals.iter().position(|&r| {
        r > most * 1.000_001 || {
            most = most.max(r);
            false
        }
    });
    let later = later.expect("some residual is above the first one");
    let required = 0.5 * (residuals[..later].iter().copied().fold(0.0, f64::max) + residuals[later]);
    let problem = with_field(quick(&[]).0, |setup| setup.linear_solver = settings_with(required));
    let mut rows = Rows::default();
    let (ended, warnings) = run(problem, &settings, &mut rows);
    println!("fails at evaluation {later} of {residuals:?}");
    assert_eq!(rows.rows.len(), later);
    best_is_saved(&ended.unwrap(), &rows.rows);
    let named = |w: &String| w.contains(" at 60 Hz: the linear solver stopped at the relative residual");
    assert!(warnings.iter().any(named), "{warnings:?}");
}

#[test]
fn a_field_that_cannot_be_kept_as_a_number_ends_with_the_best_design() {
    for algorithm in Algorithm::ALL {
        let (problem, settings) = quick(&[]);
        let settings = Optimizer { algorithm, ..settings };
        let lost: fn() -> Error = || SolverError::NotFinite { what: "field", value: f64::NAN }.into();
        let mut rows = Rows { fails: Some((2, lost)), ..Rows::default() };
        let (ended, warnings) = run(problem, &settings, &mut rows);
        best_is_saved(&ended.unwrap(), &rows.rows);
        assert_eq!(rows.rows.len(), 2, "{algorithm:?}");
        assert!(warnings.iter().any(|w| w.contains("the field is NaN")), "{warnings:?}");
    }
}

#[test]
fn a_row_that_cannot_be_written_ends_the_run_at_once_with_the_files_code() {
    let (problem, settings) = quick(&[]);
    let full: fn() -> Error = || {
        let source = std::io::Error::from(std::io::ErrorKind::StorageFull);
        fluxmorph::Error::from(OutputError::Io { action: "write", path: "history.csv".into(), source }).into()
    };
    let mut rows = Rows { fails: Some((1, full)), ..Rows::default() };
    let error = run(problem, &settings, &mut rows).0.expect_err("not a numerical failure");
    let error = fluxmorph::Error::from(error);
    assert_eq!(error.exit_code(), ExitCode::Files);
    assert!(error.to_string().contains("history.csv"), "{error}");
}

#[test]
fn an_initial_design_without_field_is_an_error() {
    let (problem, settings) = quick(&[]);
    let problem = with_field(problem, |setup| setup.coils[0].ampere_turns = c64::default());
    let mut rows = Rows::default();
    let error = run(problem, &settings, &mut rows).0.expect_err("nothing to optimise");
    let error = fluxmorph::Error::from(error);
    assert_eq!(error.exit_code(), ExitCode::Numerical);
    assert!(rows.rows.is_empty() && error.to_string().contains("initial design is zero"), "{error}");
}

/// The reciprocal of the initial value, by which everything is divided, overflows.
#[test]
fn an_objective_too_small_to_be_divided_by_is_an_error_before_anything_is_recorded() {
    let (mut problem, settings) = quick(&[]);
    problem.objective_mut().unwrap().terms[0].weight = 1e-306;
    let problem = with_field(problem, |setup| setup.coils[0].ampere_turns *= 1e-2);
    let mut rows = Rows::default();
    let error = run(problem, &settings, &mut rows).0.expect_err("no ratio can be told");
    assert!(error.is_numerical(), "{error}");
    assert!(rows.rows.is_empty(), "{error}");
}

#[test]
fn a_mesh_that_inverts_under_a_bound_ends_at_the_mesh_limit_with_numbers_alone() {
    for law in ["linear", "rails"] {
        let law = format!("remesh.law=\"{law}\"");
        let (mut problem, settings) = quick(&[&law]);
        let shape = problem.shape_mut().unwrap();
        let n = shape.surface().variable_count();
        shape.set_bounds([vec![-9.9e-3; n], vec![60e-3; n]]);
        let settings = Optimizer { max_evaluations: 30, ..settings };
        let mut rows = Rows::default();
        let optimised = run(problem, &settings, &mut rows).0.unwrap();
        println!("{:?} after {} evaluations", optimised.stop_reason, optimised.evaluations);
        assert_ne!(optimised.stop_reason, StopReason::NumericalFailure);
        let best = &rows.rows[optimised.best.evaluation];
        assert_eq!(optimised.best.objective, best.objective);
        assert!(!optimised.stop_reason.is_converged() && best.ratio < 0.6, "{law}: {best:?}");
        assert!(rows.rows.iter().all(|row| row.objective.is_finite() && row.worst_quality > 0.0));
    }
}
