//! Injected numerical failures of evaluations and runs: each ends with its cause and exit code, and with the best design where
//! there is one. Real causes where they can be had: currents, weights and laws out of range, solvers that are cut short.

mod binary;
mod evaluation;
mod run;
mod session;

use fluxmorph::config::{Goal, Optimizer};
use fluxmorph_geometry::fem::{c64, norm};
use fluxmorph_optimizer::problem::Problem;
use fluxmorph_solver::{FieldModel, FieldModelSetup};

use crate::problems::{initial, quick};

/// Norm beyond which a right side is refused [any unit]: what an iteration makes of its squares must be numbers.
const LARGEST_NORM: f64 = 1e130;

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

/// A weight of the objective at which the adjoint of the initial design can be solved for, and no longer once the objective
/// has grown by a factor: the norm of its right side goes with the root of the objective.
fn weight(problem: &Problem, growth: f64) -> f64 {
    let model = &problem.states()[0];
    let mesh = problem.moved(&initial(problem)).expect("the initial design has a mesh").mesh;
    let state = model.solve(&mesh).expect("a sound case").0;
    let functional = &problem.objective().expect("an objective").terms[0].functional;
    let derivative = functional.evaluate((model, &mesh, &state)).expect("a sound case").derivative;
    LARGEST_NORM / (norm::<c64>(&derivative) * growth.sqrt())
}

/// A case whose objective is made large, until the adjoint's right side leaves the range of numbers.
fn overflowing(growth: f64) -> (Problem, Optimizer) {
    let (mut problem, settings) = quick(&["output.verify_refinement=0"]);
    let weight = weight(&problem, growth);
    let objective = problem.objective_mut().unwrap();
    objective.goal = Goal::Maximise;
    objective.terms[0].weight = weight;
    (problem, settings)
}
