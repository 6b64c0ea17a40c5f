//! What the program asks of a parallel engine: a few collective operations on numbers, and distributed linear solvers.

use std::sync::Arc;

use super::layout::RowLayout;
use crate::fem::csr::CsrStructure;
use crate::fem::{CsrMatrix, c64};

/// The ranks of a parallel program, as one of them sees them. All operations but `rank` and `size` are collective: every
/// rank calls them, in the same order.
pub trait Communicator: std::fmt::Debug + Send + Sync {
    /// The number of this rank.
    fn rank(&self) -> usize;

    /// How many ranks there are.
    fn size(&self) -> usize;

    /// Overwrites the numbers of every rank by those of rank 0; all have the same length.
    fn broadcast(&self, numbers: &mut [f64]);

    /// The numbers of every rank, by rank, at rank 0; empty elsewhere. Lengths may differ.
    fn gather(&self, own: &[f64]) -> Vec<Vec<f64>>;

    /// Overwrites the numbers of rank 0 by the sums over all ranks; all have the same length. Elsewhere they lose their
    /// meaning.
    fn sum(&self, numbers: &mut [f64]);

    /// A solver for a distributed complex matrix.
    ///
    /// # Errors
    /// What the engine says, on every rank.
    fn solver(&self, rows: Rows, options: &SolverOptions) -> Result<Box<dyn DistributedSolver>, String>;

    /// Ends the processes of all ranks at once, for a rank that can execute no further command, and says why if there is a
    /// `cause`. Not collective.
    fn abort(&self, cause: Option<&str>) -> !;
}

/// The rows of a distributed matrix that a rank owns.
#[derive(Clone, Debug)]
pub struct Rows {
    /// Their pattern: rows in the order of [`RowLayout::owned`], columns by equation.
    pub structure: Arc<CsrStructure>,
    /// Who owns which equation.
    pub layout: Arc<RowLayout>,
    /// The coarse space of a second level, where there is one.
    pub coarse: Option<Arc<CoarseSpace>>,
}

/// A coarse space, as the rows of a rank see it.
#[derive(Clone, Debug)]
pub struct CoarseSpace {
    /// The prolongation onto the own rows: its columns are the functions that this rank has for itself, and then those that reach over
    /// all ranks, in the same order on each.
    pub prolongation: CsrMatrix<f64>,
    /// How many functions this rank has for itself.
    pub own: usize,
    /// What the diagonal entries of the others are multiplied by in the coarse matrix: they may depend on the own ones.
    pub diagonal_factor: f64,
}

/// A distributed matrix and what solves with it. All operations are collective.
pub trait DistributedSolver: std::fmt::Debug + Send {
    /// Takes the values of the own rows, and factors.
    ///
    /// # Errors
    /// What the engine says, on every rank.
    fn set_matrix(&mut self, values: &[c64]) -> Result<(), String>;

    /// Solves for the own rows of the right side; overwrites the own rows of the solution.
    ///
    /// # Errors
    /// What the engine says, on every rank.
    fn solve(&mut self, right_side: &[c64], solution: &mut [c64]) -> Result<Solved, String>;
}

/// How a solution was reached.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Solved {
    /// Iterations done.
    pub iterations: usize,
    /// True relative residual `|b − K x| / |b|`.
    pub residual: f64,
}

/// The iteration around a preconditioner.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Krylov {
    /// Generalised minimal residuals.
    #[default]
    Gmres,
    /// Conjugate orthogonal conjugate gradients, for complex symmetric matrices: a few vectors.
    Cocg,
    /// Conjugate gradients, for real symmetric positive definite matrices.
    Cg,
}

/// What solves on the subdomain of one rank.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SubSolver {
    /// An incomplete factor.
    #[default]
    Incomplete,
    /// A complete factor.
    Complete,
}

/// What the iteration is preconditioned by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preconditioning {
    /// A factor of the whole matrix, distributed over the ranks.
    Direct,
    /// Additive Schwarz: one subdomain a rank, so many layers of the matrix graph larger than its own rows; with a second level
    /// where there is a [`CoarseSpace`].
    Schwarz {
        /// Layers of overlap.
        overlap: usize,
        /// What solves on a subdomain.
        sub_solver: SubSolver,
    },
}

/// What a distributed system is solved with, and how far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverOptions {
    /// What the solver is called in the engine's own options.
    pub prefix: &'static str,
    /// The iteration.
    pub krylov: Krylov,
    /// The preconditioner.
    pub preconditioning: Preconditioning,
    /// Relative residual at which the iteration stops [1].
    pub tolerance: f64,
    /// Iterations at most.
    pub max_iterations: usize,
}
