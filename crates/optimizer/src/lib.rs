//! Everything above field and mesh: the configuration, the files, the optimisation and the command line.

pub mod algorithm;
mod approach;
pub mod bobyqa;
pub mod cli;
pub mod config;
pub mod constraint;
pub mod design;
pub mod driver;
mod error;
mod exports;
pub mod fields;
mod finite;
pub mod fresh_mesh;
pub mod geometric;
pub mod journal;
mod lap;
pub mod memory;
pub mod memory_estimate;
mod memory_limit;
pub mod morph;
pub mod objective;
pub mod observer;
pub mod output;
pub mod problem;
pub mod report;
pub mod rounds;
pub mod session;
pub mod setup;
pub mod stage;
pub mod sweep;
pub mod thickness;
pub mod verify;

pub use config::{diagnostics, schema};
pub use error::Error;
