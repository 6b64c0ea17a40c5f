//! Files from strangers: damaged meshes, hostile configurations and folders, each refused by the real binary.
//!
//! Every command runs with a limit on its memory, so that a file that asks for more than it is worth ends in an abort and
//! not in an exit code.

mod changes;
mod configurations;
mod folders;
mod limited;
mod memory;
mod meshes;
#[path = "../../crates/geometry/tests/msh_support/mod.rs"]
mod msh_support;
mod numbers;
