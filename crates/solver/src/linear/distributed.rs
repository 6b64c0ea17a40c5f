//! A system whose rows lie on several ranks: rank 0 has right sides and solutions, an engine behind
//! [`DistributedSolver`](fluxmorph_geometry::parallel::DistributedSolver) does the rest.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::parallel::{
    CommandChannel, Krylov, Preconditioning, RankError, Solved, SolverOptions, SubSolver, numbers_of,
    solution_of,
};

use super::method::LinearSolverSettings;
use super::range::checked_norm;
use super::report::LinearSolverReport;
use crate::error::{NonConvergence, SolverError};

/// The command to solve with the present matrix.
pub(crate) const SOLVE: u32 = 1;

/// How distributed systems are solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistributedSettings {
    /// Direct or not; `None`: by the number of unknowns ([`LARGEST_DIRECT`]).
    pub method: Option<DistributedMethod>,
    /// The iteration.
    pub krylov: Krylov,
    /// Layers by which the subdomains of Schwarz's method overlap.
    pub overlap: usize,
    /// What solves on a subdomain.
    pub sub_solver: SubSolver,
}

/// The methods for distributed systems.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DistributedMethod {
    /// A distributed factor.
    Direct,
    /// An iteration with additive Schwarz.
    Schwarz,
}

impl DistributedMethod {
    /// Its name in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Direct => "petsc mumps",
            Self::Schwarz => "petsc asm",
        }
    }
}

/// Unknowns up to which a distributed factor is taken without being asked for.
pub const LARGEST_DIRECT: usize = 1_000_000;

impl Default for DistributedSettings {
    /// By size; two layers of overlap: with one the iterations were more than twice as many without a coarse level.
    fn default() -> Self {
        Self { method: None, krylov: Krylov::default(), overlap: 2, sub_solver: SubSolver::default() }
    }
}

impl DistributedSettings {
    /// The method for so many unknowns.
    pub fn method_for(&self, unknowns: usize) -> DistributedMethod {
        match self.method {
            Some(method) => method,
            None if unknowns <= LARGEST_DIRECT => DistributedMethod::Direct,
            None => DistributedMethod::Schwarz,
        }
    }

    /// What the engine is to do for so many unknowns.
    pub fn options(
        &self,
        prefix: &'static str,
        unknowns: usize,
        (tolerance, max_iterations): (f64, usize),
    ) -> SolverOptions {
        let preconditioning = match self.method_for(unknowns) {
            DistributedMethod::Direct => Preconditioning::Direct,
            DistributedMethod::Schwarz => {
                Preconditioning::Schwarz { overlap: self.overlap, sub_solver: self.sub_solver }
            }
        };
        SolverOptions { prefix, krylov: self.krylov, preconditioning, tolerance, max_iterations }
    }
}

/// A matrix on several ranks, ready to be solved with.
#[derive(Debug)]
pub struct DistributedSystem {
    channel: Arc<CommandChannel>,
    required: f64,
    /// Which of the matrices that the ranks have taken it is, and how many they have.
    own: u64,
    taken: Arc<AtomicU64>,
}

impl DistributedSystem {
    /// The system whose matrix every rank has just taken.
    pub(crate) fn new(
        channel: Arc<CommandChannel>,
        settings: &LinearSolverSettings,
        taken: &Arc<AtomicU64>,
    ) -> Self {
        let own = taken.fetch_add(1, Ordering::SeqCst) + 1;
        Self { channel, required: settings.required, own, taken: Arc::clone(taken) }
    }

    /// Solves `K x = b`.
    ///
    /// # Errors
    /// [`SolverError::NotConverged`] when the true residual stays above the required one, [`SolverError::Rank`] when the
    /// engine fails, [`SolverError::NotFinite`] and [`SolverError::OutOfRange`] for a right side that cannot be solved for.
    pub(crate) fn solve(&self, right_side: &[c64]) -> Result<(Vec<c64>, LinearSolverReport), SolverError> {
        if checked_norm(right_side)? == 0.0 {
            let report = LinearSolverReport { iterations: 0, residual: 0.0 };
            return Ok((vec![c64::default(); right_side.len()], report));
        }
        if self.taken.load(Ordering::SeqCst) != self.own {
            let cause = "the ranks have taken another matrix since this one was prepared".to_owned();
            return Err(RankError { rank: 0, ranks: self.channel.group().size(), cause }.into());
        }
        let answer = self.channel.execute(SOLVE, numbers_of(right_side).collect())?;
        let (x, Solved { iterations, residual }) = solution_of(&answer);
        if residual.is_nan() || residual > self.required {
            let (required, cause) = (self.required, NonConvergence::OnRanks);
            return Err(SolverError::NotConverged { residual, required, iterations, cause });
        }
        Ok((x, LinearSolverReport { iterations, residual }))
    }
}
