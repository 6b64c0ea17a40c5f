//! Injected numerical failures of evaluations and runs: each ends with its cause and exit code, and with the best design where
//! there is one. Real causes where they can be had: currents, weights and laws out of range, solvers that are cut short.

mod evaluation;
mod run;
mod session;

use std::path::{Path, PathBuf};

use fluxmorph::build::{Mode, set_up};
use fluxmorph::config::{Config, Goal, Optimizer};
use fluxmorph_geometry::fem::{c64, norm};
use fluxmorph_optimizer::problem::Problem;
use fluxmorph_solver::{FieldModel, FieldModelSetup};

/// Norm beyond which a right side is refused [any unit]: what an iteration makes of its squares must be numbers.
const LARGEST_NORM: f64 = 1e130;

fn quick_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/shield_quick.toml")
}

/// The coarse shield with overrides `key=value`.
fn quick(overrides: &[&str]) -> (Problem, Optimizer) {
    let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
    let (config, source) = Config::from_file(&quick_path(), &overrides).unwrap_or_else(|e| panic!("{e}"));
    (set_up(&config, &source, Mode::Optimisation).unwrap().problem, config.optimizer)
}

/// The field problems of a case with something changed.
fn with_field(problem: Problem, change: impl Fn(&mut FieldModelSetup)) -> Problem {
    let changed = |model: &FieldModel| {
        let mut setup = model.setup().clone();
        change(&mut setup);
        FieldModel::new(problem.original(), setup).unwrap()
    };
    let states = problem.states().iter().map(changed).collect();
    problem.with_states(states)
}

fn initial(problem: &Problem) -> Vec<f64> {
    problem.shape().unwrap().initial().to_vec()
}

/// Norm of the right side of the initial design's adjoint problem for a weight of one.
fn adjoint_norm(problem: &Problem) -> f64 {
    let model = &problem.states()[0];
    let mesh = problem.moved(&initial(problem)).unwrap().mesh;
    let state = model.solve(&mesh).unwrap().0;
    let functional = &problem.objective().unwrap().terms[0].functional;
    norm::<c64>(&functional.evaluate(model, &mesh, &state).unwrap().derivative)
}

/// A case whose objective is made large, with a weight at which the adjoint's right side leaves the range of numbers once the
/// objective has grown by a factor: its norm goes with the root of the objective.
fn overflowing(growth: f64) -> (Problem, Optimizer) {
    let (mut problem, settings) = quick(&["output.verify_refinement=0"]);
    let weight = LARGEST_NORM / (adjoint_norm(&problem) * growth.sqrt());
    let objective = problem.objective_mut().unwrap();
    objective.goal = Goal::Maximise;
    objective.terms[0].weight = weight;
    (problem, settings)
}
