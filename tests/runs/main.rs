//! The program as a user meets it: the real binary, its files re-read by strict readers, its messages and exit codes.
//! Every test works in its own temporary directory.
#![allow(missing_docs)]

mod cli;
mod commands;
mod examples;
mod folders;
mod fresh_mesh;
mod memory;
mod mesh_files;
mod morph;
mod pyvista;
mod ranks;
mod run_files;
#[path = "../support/mod.rs"]
mod support;
#[cfg(unix)]
mod sweep;

/// For `bad_input` alone.
mod program {
    pub(crate) use crate::support::program::{Finished, folder};
    pub(crate) use crate::support::shield::quick;

    pub(crate) fn fluxmorph(arguments: &[impl AsRef<std::ffi::OsStr>]) -> Finished {
        crate::support::program::finish(crate::support::program::program().args(arguments))
    }
}
