//! A system ready to be solved with, wherever its matrix is.

use fluxmorph_geometry::fem::{CsrMatrix, c64};

use super::cache::LinearSolverCache;
use super::distributed::DistributedSystem;
use super::method::Method;
use super::report::LinearSolverReport;
use super::system::{LocalSystem, SolverEvent};
use crate::error::SolverError;

/// A matrix ready to be solved with, for any number of right sides.
#[derive(Debug)]
pub enum PreparedSystem {
    /// In this process.
    Local(Box<LocalSystem>),
    /// On several ranks.
    Distributed(DistributedSystem),
}

impl PreparedSystem {
    /// The matrix; `None` where it is on several ranks.
    pub fn matrix(&self) -> Option<&CsrMatrix<c64>> {
        match self {
            Self::Local(system) => Some(system.matrix()),
            Self::Distributed(_) => None,
        }
    }

    /// The method in use; `None` where the matrix is on several ranks.
    pub fn method(&self) -> Option<Method> {
        match self {
            Self::Local(system) => Some(system.method()),
            Self::Distributed(_) => None,
        }
    }

    /// Bytes of the preconditioner in this process, as far as they are known.
    pub fn preconditioner_bytes(&self) -> usize {
        match self {
            Self::Local(system) => system.preconditioner_bytes(),
            Self::Distributed(_) => 0,
        }
    }

    /// What the solver did beside solving.
    pub fn events(&self) -> &[SolverEvent] {
        match self {
            Self::Local(system) => system.events(),
            Self::Distributed(_) => &[],
        }
    }

    /// What the next design may start from.
    pub fn into_cache(self) -> LinearSolverCache {
        match self {
            Self::Local(system) => system.into_cache(),
            Self::Distributed(_) => LinearSolverCache::default(),
        }
    }

    /// Solves `K x = b`.
    ///
    /// # Errors
    /// [`SolverError::NotConverged`] when the true residual stays above the required one, [`SolverError::Mesh`] and
    /// [`SolverError::Rank`] when no method has a factor, [`SolverError::NotFinite`] and [`SolverError::OutOfRange`] for a
    /// right side that cannot be solved for.
    pub fn solve(&mut self, right_side: &[c64]) -> Result<(Vec<c64>, LinearSolverReport), SolverError> {
        match self {
            Self::Local(system) => system.solve(right_side),
            Self::Distributed(system) => system.solve(right_side),
        }
    }
}
