//! Who watches a run: the driver reports what happens, an observer shows it.
//!
//! `console` shows plain lines, `bar` a bar on a terminal with the lines above it, `quiet` warnings alone. The first two
//! have the same `lines`: the rows (`table`) and the end (`summary`, with the flux density at the probes from `probes`).

mod bar;
mod console;
mod lines;
mod probes;
mod quiet;
mod styles;
mod summary;
mod table;

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::config::{Objective, Optimizer};
use crate::output::RunResult;
use crate::rounds::RoundEvent;
use crate::stage::Stage;

pub use bar::{Bar, clear};
pub use console::Console;
pub use quiet::Quiet;
pub use styles::Styles;

/// One evaluation of objective, constraints and gradients; a row of the history.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Number of the evaluation, from 0.
    pub evaluation: usize,
    /// Evaluations so far that improved on the best before them; the first counts as 0.
    pub iteration: usize,
    /// The objective itself, whether it is minimised or maximised.
    pub objective: f64,
    /// The objective over that of evaluation 0.
    pub ratio: f64,
    /// Euclidean norm of the gradient with respect to the design variables [objective / m].
    pub gradient_norm: f64,
    /// Euclidean norm of the change of the design variables since the evaluation before [m].
    pub step_norm: f64,
    /// Worst quality of an element (Eq. 4).
    pub worst_quality: f64,
    /// Least thickness of the moved body along the direction of motion [m]; `None` where it has none.
    pub min_thickness_m: Option<f64>,
    /// Greatest thickness [m].
    pub max_thickness_m: Option<f64>,
    /// Iterations of the linear solver, state and adjoint.
    pub linear_iterations: usize,
    /// Wall time of the evaluation [s].
    pub seconds: f64,
    /// Multiple of the motion from the round's reference at which the first element inverts; `None` if none ever does.
    pub step_to_inversion: Option<f64>,
    /// That element.
    pub inversion_element: Option<usize>,
    /// Its region.
    pub inversion_region: Option<String>,
    /// Rounds of the mesh motion begun so far (see [`crate::driver`]).
    pub round: usize,
    /// Relative distance of every constraint from its bound, satisfied where ≤ 0, by column (see [`column`]).
    #[serde(flatten)]
    pub constraints: BTreeMap<String, f64>,
}

/// The column of the history that holds a constraint.
pub fn column(constraint: &str) -> String {
    format!("c_{constraint}")
}

impl Evaluation {
    /// The columns of `history.csv` before those of the constraints.
    pub const COLUMNS: [&'static str; 15] = [
        "evaluation",
        "iteration",
        "objective",
        "ratio",
        "gradient_norm",
        "step_norm",
        "worst_quality",
        "min_thickness_m",
        "max_thickness_m",
        "linear_iterations",
        "seconds",
        "step_to_inversion",
        "inversion_element",
        "inversion_region",
        "round",
    ];
}

/// What is known when a run starts.
#[derive(Debug, Clone, Copy)]
pub struct Started<'a> {
    /// Title of the configuration.
    pub title: &'a str,
    /// Algorithm and limits of the optimisation; `None` for a single analysis.
    pub optimizer: Option<&'a Optimizer>,
    /// What is optimised or measured.
    pub objective: Option<&'a Objective>,
    /// Design variables.
    pub variables: usize,
    /// Nodes of the mesh.
    pub nodes: usize,
    /// Tetrahedra of the mesh.
    pub tets: usize,
    /// Unknowns of the field problem.
    pub unknowns: usize,
    /// The run directory; `None` when nothing is written.
    pub directory: Option<&'a Path>,
}

/// Receives what happens during a run. Nothing is shown unless a method is overridden; what is a line in any form goes
/// through [`Observer::line`].
pub trait Observer {
    /// Shows a line.
    fn line(&mut self, text: &str) {
        let _ = text;
    }

    /// The problem is set up.
    fn started(&mut self, started: &Started<'_>) {
        let _ = started;
    }

    /// A long part of the work begins, in a few words: `assembling`.
    fn phase(&mut self, name: &str) {
        let _ = name;
    }

    /// A part of that work begins, also within an evaluation.
    fn stage(&mut self, stage: Stage) {
        let _ = stage;
    }

    /// Something has happened, in a line.
    fn note(&mut self, message: &str) {
        self.line(message);
    }

    /// An evaluation is complete.
    fn evaluation(&mut self, evaluation: &Evaluation) {
        let _ = evaluation;
    }

    /// The mesh has a new reference, or a remedy was taken.
    fn round(&mut self, event: &RoundEvent) {
        self.line(&event.describe());
    }

    /// Something that was left out, and why; nothing to act on.
    fn notice(&mut self, message: &str) {
        self.line(&format!("note: {message}"));
    }

    /// Something the user should know; the run goes on.
    fn warning(&mut self, message: &str) {
        let _ = message;
    }

    /// The run has ended.
    fn finished(&mut self, result: &RunResult) {
        let _ = result;
    }
}

/// Shows nothing.
#[derive(Debug, Default, Clone, Copy)]
pub struct Silent;

impl Observer for Silent {}

/// A message that cannot be shown, as on a closed terminal, is no reason to stop a run.
fn show(writer: &mut impl Write, text: &str) {
    let _ = writeln!(writer, "{text}").and_then(|()| writer.flush());
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn evaluation(number: usize) -> Evaluation {
        Evaluation {
            evaluation: number,
            iteration: number,
            objective: 1.2e-4,
            ratio: 0.51,
            gradient_norm: 3.0,
            step_norm: 0.004,
            worst_quality: 0.1,
            min_thickness_m: Some(0.005),
            max_thickness_m: Some(0.03),
            linear_iterations: 40,
            seconds: 1.0,
            step_to_inversion: Some(1.25),
            inversion_element: Some(17),
            inversion_region: Some("plate".to_owned()),
            round: 0,
            constraints: BTreeMap::new(),
        }
    }
}
