//! What ends the method from inside an evaluation: a limit, a mesh, an error.

use super::stop_reason::StopReason;
use crate::error::Error;

/// What ends the method from inside an evaluation.
#[derive(Debug)]
pub(super) enum Stop {
    Limit(StopReason),
    /// The round's mesh cannot carry a design.
    Mesh(Refusal),
    /// The mesh carries a part of the step to a design, which is the best one now.
    CutShort,
    Error(Box<Error>),
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Error(Box::new(error))
    }
}

/// A design that the round's mesh cannot carry.
#[derive(Clone, Debug)]
pub(super) struct Refusal {
    pub(super) cause: String,
    /// Its variables [m].
    pub(super) wanted: Vec<f64>,
}
