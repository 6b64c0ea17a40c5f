//! The program as a user meets it: the real binary on the shipped quick configuration, its files re-read by strict
//! readers, its messages and exit codes. Every test works in its own temporary directory.

mod commands;
mod determinism;
mod folders;
mod fresh_mesh;
mod interruption;
mod memory;
mod mesh_files;
mod morph;
mod program;
mod pyvista;
mod run_files;
mod shield;
