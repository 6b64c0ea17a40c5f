//! The program as a user meets it: the real binary, its files re-read by strict readers, its messages and exit codes.
//! Every test works in its own temporary directory.
#![allow(missing_docs)]

mod accuracy;
mod cli;
mod coils;
mod commands;
mod designs;
mod deviation;
mod examples;
mod field_pieces;
mod folders;
mod forces;
mod fresh_mesh;
mod memory;
mod mesh_files;
mod morph;
mod plausible;
mod pyvista;
mod ranks;
mod run_files;
mod skins;
#[path = "../support/mod.rs"]
mod support;
#[cfg(unix)]
mod sweep;
mod walls_and_images;
