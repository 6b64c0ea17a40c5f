//! The real program under what real machines do to it: signals, kills, full disks, other processes, changed files, and any
//! number of threads. What `tests/durability` shows on a simulated disk is shown here on the system's.
//!
//! Long series are written into docs/robustness.md: `just torture-runs`.
#![cfg(unix)]
#![allow(missing_docs)]

mod determinism;
mod device;
mod disks;
#[path = "../durability/essence.rs"]
mod essence;
mod intruders;
mod kills;
mod lint;
mod page;
mod process;
mod reopened;
mod signals;
#[path = "../durability/whole.rs"]
mod whole;
