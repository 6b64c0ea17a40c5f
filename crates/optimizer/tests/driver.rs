//! The optimisation loop on a coarse shield: every algorithm, and what happens when a mesh would break.
#![allow(missing_docs, clippy::unwrap_used)]

use std::path::Path;

use fluxmorph_optimizer::Error;
use fluxmorph_optimizer::config::{Algorithm, Config, Optimizer};
use fluxmorph_optimizer::driver::{Optimised, Recorder, optimise};
use fluxmorph_optimizer::observer::{Evaluation, Observer, Silent};
use fluxmorph_optimizer::output::StopReason;
use fluxmorph_optimizer::problem::{Analysis, Problem};
use fluxmorph_optimizer::setup::{Purpose, set_up};

fn quick() -> (Problem, Optimizer) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/shield_quick.toml");
    let (config, source) = Config::from_file(&path, &[]).unwrap();
    (set_up(&config, &source, Purpose::Optimisation).unwrap().problem, config.optimizer)
}

#[derive(Default)]
struct Rows(Vec<Evaluation>);

impl Recorder for Rows {
    fn record(&mut self, row: &Evaluation, _: &Analysis, _: &Problem, _: bool) -> Result<(), Error> {
        self.0.push(row.clone());
        Ok(())
    }
}

fn run(problem: &Problem, settings: &Optimizer, observer: &mut dyn Observer) -> (Optimised, Vec<Evaluation>) {
    let mut rows = Rows::default();
    let optimised = optimise(problem, settings, observer, &mut rows, &|| false).unwrap();
    (optimised, rows.0)
}

#[test]
fn every_algorithm_improves_the_shield_within_its_bounds() {
    let (problem, settings) = quick();
    for algorithm in [
        Algorithm::Mma,
        Algorithm::Ccsaq,
        Algorithm::Slsqp,
        Algorithm::Lbfgs,
        Algorithm::Tnewton,
        Algorithm::Var2,
    ] {
        let settings = Optimizer { algorithm, max_evaluations: 8, ..settings.clone() };
        let (optimised, rows) = run(&problem, &settings, &mut Silent);
        let ratio = optimised.best.objective / optimised.initial;
        println!("{algorithm:?}: F/F0 {ratio:.4} after {} evaluations", rows.len());
        // The slowest, truncated Newton, reaches 0.89: anything that moves at all is below 0.97.
        assert!(ratio < 0.97, "{algorithm:?}: {ratio}");
        let shape = problem.shape.as_ref().unwrap();
        for (k, p) in optimised.best.values.iter().enumerate() {
            assert!(shape.lower[k] <= *p && *p <= shape.upper[k], "{algorithm:?}: variable {k} is {p}");
        }
    }
}

/// Warnings told.
#[derive(Default)]
struct Warnings(Vec<String>);

impl Observer for Warnings {
    fn warning(&mut self, message: &str) {
        self.0.push(message.to_owned());
    }
}

#[test]
fn a_mesh_below_the_quality_is_never_evaluated_and_the_run_goes_on_in_a_smaller_box() {
    let (problem, settings) = quick();
    // The free run falls to 0.094: at 0.15 it must restart.
    let settings = Optimizer { minimum_quality: 0.15, max_evaluations: 40, ..settings };
    let mut warnings = Warnings::default();
    let (optimised, rows) = run(&problem, &settings, &mut warnings);
    let last = rows.last().unwrap();
    println!("{:?} after {} rows and {} restarts", optimised.stop_reason, rows.len(), last.round);
    assert!(last.round >= 1);
    assert!(warnings.0.len() >= last.round && warnings.0[0].contains("minimum_quality"), "{:?}", warnings.0);
    for row in &rows {
        assert!(row.worst_quality >= 0.15, "{row:?}");
        assert!(row.objective.is_finite() && row.gradient_norm.is_finite(), "{row:?}");
    }
    assert!(
        (0..rows.len()).all(|k| rows[k].evaluation == k),
        "attempts without an objective are no evaluations"
    );
    let least = rows.iter().map(|row| row.objective).fold(f64::INFINITY, f64::min);
    assert_eq!(optimised.best.objective, least);
    assert!(least / optimised.initial < 0.9, "restarts keep what was reached");
}

#[test]
fn a_quality_that_no_step_keeps_ends_at_the_mesh_limit_with_the_best_design() {
    let (problem, settings) = quick();
    let initial = problem.quality(&problem.reference).worst;
    // A millionth below the initial quality: the first real step is refused, and every smaller one of note too.
    let settings = Optimizer { minimum_quality: initial * (1.0 - 1e-6), max_evaluations: 40, ..settings };
    let (optimised, rows) = run(&problem, &settings, &mut Silent);
    assert_eq!(optimised.stop_reason, StopReason::MeshLimit, "{} rows", rows.len());
    assert!(optimised.best.analysis.quality.worst >= settings.minimum_quality);
}
