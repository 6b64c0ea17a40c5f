//! Errors that point: broken configurations and mesh files, each with the very place that must be underlined, and what is
//! said compared with a text that was looked at; misspelt names, each with the name that must be offered.
//!
//! `SNAPSHOTS=overwrite cargo test --release --test diagnostics` writes the texts anew.

mod case;
mod elsewhere;
mod files;
mod many;
mod mesh_files;
mod overrides;
mod setups;
mod share;
mod syntax;
mod tables;
mod typos;
mod words;
