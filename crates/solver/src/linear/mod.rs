//! The linear systems `K x = b` with complex symmetric `K`: the one place where a solver is chosen.
//!
//! Every method is COCG ([`cocg`]) with a preconditioner, from a factor of `K` itself to an incomplete one ([`Method`] has
//! the list); what is fixed is the true residual of the solution. State and adjoint share the matrix, hence everything
//! [`PreparedSystem`] holds; what follows from the pattern alone is made once a run in [`SystemAnalysis`]; what one
//! design leaves for the next (a factor, solutions to start from) is [`LinearSolverCache`], and whether an old factor still pays is
//! decided by counted work (`cost`), never by a clock, so that a run has the same bits on any machine. All of that is a
//! [`system::LocalSystem`]; where a mesh is distributed over ranks, a [`distributed`] system has an engine of theirs solve.

pub(crate) mod aggregation;
mod analysis;
mod cache;
pub mod cocg;
mod cost;
pub mod distributed;
mod factor;
mod gauss_seidel;
pub(crate) mod gmres;
pub(crate) mod hats;
mod method;
mod preconditioner;
mod prepared;
mod range;
mod report;
mod rounding;
mod system;
pub(crate) mod transfer;
mod two_level;

pub(crate) use analysis::SystemPattern;
pub use analysis::{SystemAnalysis, two_levels_from};
pub use cache::LinearSolverCache;
pub use distributed::{DistributedMethod, DistributedSettings, DistributedSystem};
pub use method::{FieldKind, LinearSolver, LinearSolverSettings, Method, Reuse};
pub use prepared::PreparedSystem;
pub(crate) use prepared::{FieldSystem, RealLinear};
pub use report::LinearSolverReport;
pub(crate) use rounding::Left;
pub(crate) use system::Goal;
pub use system::{LocalSystem, SolverEvent};
