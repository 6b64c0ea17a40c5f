//! The application: everything that a person sees of fluxmorph. Configuration, files, runs, report and command line.
//!
//! The numerical work is in the crates below; here it is set up from a configuration (`config`, `build`), run (`run`), kept
//! (`files`) and shown (`show`), as the command line (`cli`) asks for it. Exit codes are decided here alone
//! ([`Error::exit_code`]).

pub mod build;
pub mod cli;
pub mod config;
mod error;
mod exit_code;
pub mod files;
mod printable;
pub mod run;
pub mod show;

pub use config::{diagnostics, schema};
pub use error::Error;
pub use exit_code::ExitCode;
