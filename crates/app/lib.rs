//! The application: everything that a person sees of fluxmorph. Configuration, files, runs, report and command line.
//!
//! The numerical work is in the crates below; here it is set up from a configuration, watched, kept and shown. Exit codes
//! are decided here alone ([`Error::exit_code`]).

pub mod cli;
pub mod config;
mod error;
mod exit_code;
mod exports;
pub mod fields;
pub mod fresh_mesh;
pub mod journal;
mod launcher;
mod memory_limit;
pub mod morph;
pub mod observer;
pub mod output;
pub mod report;
pub mod session;
pub mod setup;
pub mod sweep;

pub use config::{diagnostics, schema};
pub use error::Error;
pub use exit_code::ExitCode;
