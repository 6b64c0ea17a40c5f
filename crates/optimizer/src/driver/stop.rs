//! What ends the method from inside an evaluation: a limit, a mesh, an error.

use super::stop_reason::StopReason;
use crate::error::Error;

/// What ends the method from inside an evaluation.
#[derive(Debug)]
pub(super) enum Stop {
    Limit(StopReason),
    /// A design whose mesh is refused.
    Mesh(Refusal),
    /// The mesh carries a part of the step to a design, which is the best one now.
    CutShort,
    /// Constraints are not kept, and many designs have not come nearer to that.
    Astray,
    /// An evaluation has led nowhere from the best design.
    Stagnant,
    Error(Box<Error>),
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Error(Box::new(error))
    }
}

/// Why the mesh of a design is refused.
#[derive(Clone, Debug)]
pub(super) struct Refusal {
    pub(super) cause: String,
}
