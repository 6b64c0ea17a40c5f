//! Who watches a run: the driver reports what happens, an observer shows it.
//!
//! `console` shows plain lines, or warnings and results alone, `bar` a bar on a terminal with the lines above it. Both have the same
//! `lines`: the rows (`table`) and the end (`summary`, with the flux density at the probes from `probes`).

mod bar;
mod console;
mod lines;
mod probes;
pub mod report;
mod states;
mod styles;
mod summary;
mod table;
pub(crate) mod text_table;

use std::io::Write;
use std::path::Path;

use crate::config::{Constraint, FieldsKept, Objective, Optimizer};
use crate::files::RunResult;

pub use fluxmorph_optimizer::driver::{Evaluation, Observer, Silent, column};

pub use bar::{Bar, clear};
pub use console::{Amount, Console};
pub use styles::Styles;

/// What is known when a run starts.
#[derive(Debug, Clone)]
pub struct Started<'a> {
    /// Title of the configuration.
    pub title: &'a str,
    /// Algorithm and limits of the optimisation; `None` for a single analysis.
    pub optimizer: Option<&'a Optimizer>,
    /// What is optimised or measured.
    pub objective: Option<&'a Objective>,
    /// What must keep within bounds.
    pub constraints: &'a [Constraint],
    /// Design variables.
    pub variables: usize,
    /// Radius of the filter of the design [m], where there is one.
    pub filter_radius: Option<f64>,
    /// How the mesh follows the design, and why so; `None` without a design.
    pub motion: Option<String>,
    /// Nodes of the mesh.
    pub nodes: usize,
    /// Tetrahedra of the mesh.
    pub tets: usize,
    /// Unknowns of the field problem.
    pub unknowns: usize,
    /// The run directory; `None` when nothing is written.
    pub directory: Option<&'a Path>,
    /// Of which evaluations it gets the fields.
    pub fields: FieldsKept,
}

/// Shows a run from its start to its result; the optimiser reports to it as its [`Observer`].
pub trait RunObserver: Observer {
    /// The problem is set up.
    fn started(&mut self, started: &Started<'_>) {
        let _ = started;
    }

    /// The run has ended.
    fn finished(&mut self, result: &RunResult) {
        let _ = result;
    }
}

impl RunObserver for Silent {}

/// `F/F0` with five decimals, and a very small one with four digits.
pub(crate) fn ratio(value: f64) -> String {
    if value != 0.0 && value.abs() < 0.01 { format!("{value:.3e}") } else { format!("{value:.5}") }
}

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
            ..Evaluation::default()
        }
    }
}
