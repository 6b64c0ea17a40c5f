//! Who watches an optimisation: the driver reports what happens, an observer shows it.

use fluxmorph_solver::newton::NewtonProgress;

use super::evaluation::Evaluation;
use crate::problem::{Progress, Stage};

/// Receives what happens during a run. Nothing is shown unless a method is overridden; whatever is shown as a line goes
/// through [`Observer::line`].
pub trait Observer {
    /// Shows a line.
    fn line(&mut self, text: &str) {
        let _ = text;
    }

    /// A long part of the work begins, in a few words: `assembling`.
    fn phase(&mut self, name: &str) {
        let _ = name;
    }

    /// A part of that work begins, also within an evaluation.
    fn stage(&mut self, stage: Stage) {
        let _ = stage;
    }

    /// Newton's method has done a step.
    fn newton(&mut self, progress: NewtonProgress) {
        let _ = progress;
    }

    /// Something has happened, in a line.
    fn note(&mut self, message: &str) {
        self.line(message);
    }

    /// An evaluation is complete.
    fn evaluation(&mut self, evaluation: &Evaluation) {
        let _ = evaluation;
    }

    /// Something that was skipped, and why; nothing to act on.
    fn notice(&mut self, message: &str) {
        self.line(&format!("note: {message}"));
    }

    /// Something the user should know; the run continues.
    fn warning(&mut self, message: &str) {
        let _ = message;
    }
}

/// Reports the progress of a piece of work to an observer.
pub struct Watching<'a>(pub &'a mut dyn Observer);

impl Progress for Watching<'_> {
    fn stage(&mut self, stage: Stage) {
        self.0.stage(stage);
    }

    fn newton(&mut self, progress: NewtonProgress) {
        self.0.newton(progress);
    }
}

/// Shows nothing.
#[derive(Debug, Default, Clone, Copy)]
pub struct Silent;

impl Observer for Silent {}
