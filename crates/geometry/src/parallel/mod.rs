//! Work distributed over the ranks of a parallel program: what a rank is, who owns what, and how rank 0 leads.
//!
//! Every rank holds the whole topology; rows of matrices, factors and element work are distributed by a partition of the
//! nodes. Rank 0, the *leader*, runs the program as on one machine. Where a part of it is distributed, it sends a *command*
//! to all ranks ([`rank_group`]): each does its share with the [`CommandHandler`] of its own set-up, and rank 0 has the
//! result. The other ranks, the *workers*, do nothing but execute commands, so that no decision can be taken twice and
//! differently.
//!
//! Lives here: the traits between this program and a parallel engine ([`communicator`]), owners of nodes and elements
//! ([`partition`], [`ownership`]), the numbering of equations by owner ([`layout`]), distributed matrices ([`matrix`]),
//! commands and their failures ([`rank_group`]), and an engine of threads in one process ([`threads`]), which has the tests run
//! everywhere. Does not live here: MPI or any foreign library, and what the handlers do.

pub mod communicator;
pub mod layout;
pub mod matrix;
pub mod ownership;
pub mod partition;
pub mod rank_group;
pub mod threads;

pub use communicator::{
    CoarseSpace, Communicator, DistributedSolver, Krylov, Preconditioning, Rows, Solved, SolverOptions,
    SubSolver,
};
pub use layout::RowLayout;
pub use matrix::{DistributedMatrix, solution_of};
pub use ownership::Ownership;
pub use partition::Partition;
pub use rank_group::{Command, CommandChannel, CommandHandler, RankError, RankGroup, Role};

use crate::fem::c64;

/// Complex numbers as pairs of real ones, real part first.
pub fn numbers_of(values: &[c64]) -> impl Iterator<Item = f64> + '_ {
    values.iter().flat_map(|c| [c.re, c.im])
}

/// Pairs of real numbers as complex ones.
///
/// # Panics
/// If there is an odd number of them.
pub fn complex_of(numbers: &[f64]) -> Vec<c64> {
    let (pairs, []) = numbers.as_chunks::<2>() else { panic!("complex numbers come in pairs") };
    pairs.iter().map(|&[re, im]| c64::new(re, im)).collect()
}
