//! Work shared by the ranks of a parallel program: what a rank is, who owns which equations, and how rank 0 leads.
//!
//! Every rank holds the whole topology; rows of matrices, factors and element work are shared out by a partition of the
//! nodes. Rank 0 runs the program as on one machine. Where a part of it is shared out, it gives an *order* to all ranks
//! ([`team`]): each does its share with the [`Part`] it has made in its own set-up, and rank 0 has the result. The other
//! ranks do nothing but follow orders, so that no decision can be taken twice and differently.
//!
//! Lives here: the traits between this program and a parallel engine ([`communicator`]), the numbering of equations by owner
//! ([`layout`]), distributed matrices ([`matrix`]), orders and their failures ([`team`]), and an engine of threads in one process ([`threads`]), which has the
//! tests run everywhere. Does not live here: MPI or any foreign library, and what the parts do.

pub mod communicator;
pub mod layout;
pub mod matrix;
pub mod share;
pub mod team;
pub mod threads;

pub use communicator::{
    Communicator, DistributedSolver, Krylov, Preconditioning, Rows, Solved, SolverOptions, SubSolver,
};
pub use layout::RowLayout;
pub use matrix::{DistributedMatrix, solution_of};
pub use share::Share;
pub use team::{Member, Order, Part, RankError, Shared, Team};

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
