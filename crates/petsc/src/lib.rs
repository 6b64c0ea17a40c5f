//! The parallel engine: ranks by MPI, distributed linear solvers by PETSc.
//!
//! [`Petsc`] is the [`Communicator`](fluxmorph_geometry::ranks::Communicator) that a program under `mpirun` is led by. The two
//! libraries are called through a bridge in C (`bridge.c`), which knows their headers, and whose functions take plain numbers;
//! `bridge` is the only place that is not safe Rust. Which options a solver begins with is in [`options`]; a user's own
//! come after these and win. Without the feature `link` the crate is empty, so that a machine without the libraries can
//! build everything else.

#[cfg(feature = "link")]
mod bridge;
#[cfg(feature = "link")]
mod engine;
#[cfg(feature = "link")]
pub mod options;
#[cfg(feature = "link")]
mod solver;

#[cfg(feature = "link")]
pub use engine::Petsc;
