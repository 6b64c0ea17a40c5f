//! Who watches an optimisation: the driver reports what happens, an observer shows it.

use super::evaluation::Evaluation;
use crate::problem::{RoundEvent, Stage};

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

    /// Something has happened, in a line.
    fn note(&mut self, message: &str) {
        self.line(message);
    }

    /// An evaluation is complete.
    fn evaluation(&mut self, evaluation: &Evaluation) {
        let _ = evaluation;
    }

    /// The mesh has a new reference, the trust region shrank, or the mesh motion fell back.
    fn round(&mut self, event: &RoundEvent) {
        self.line(&event.describe());
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

/// Shows nothing.
#[derive(Debug, Default, Clone, Copy)]
pub struct Silent;

impl Observer for Silent {}
