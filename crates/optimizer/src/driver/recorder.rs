//! Who keeps what a run computes.

use super::record::Record;
use crate::error::Error;
use crate::problem::{Analysis, Problem};

/// Keeps what is computed, and replays what was kept before the run was interrupted.
pub trait Recorder {
    /// The next evaluation kept before, in their order, of those after so many refinements of the mesh; `None` once these are
    /// replayed.
    fn replay(&mut self, level: usize) -> Option<Record> {
        let _ = level;
        None
    }

    /// Whether what it replays has the bits of one process.
    fn is_bitwise_reproducible(&self) -> bool {
        true
    }

    /// An evaluation is complete.
    ///
    /// # Errors
    /// When it cannot be kept: the run ends.
    fn record(&mut self, record: &Record, analysis: &Analysis, problem: &Problem) -> Result<(), Error>;
}

/// Keeps nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unrecorded;

impl Recorder for Unrecorded {
    fn record(&mut self, _: &Record, _: &Analysis, _: &Problem) -> Result<(), Error> {
        Ok(())
    }
}
