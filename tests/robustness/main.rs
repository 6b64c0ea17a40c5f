//! Nothing is lost: runs that are cut, disks that fail, and the real program under what real machines do to it end up
//! where a run without a break does, to the last bit.
//!
//! On a disk in memory, which fails on request: `algorithms`, `resume`, `faults`. With the system's disks and
//! processes: `signals`, `kills`, `disks`, `intruders`, `races`, `reopened`, `determinism`. Long series are written into
//! docs/robustness.md: `just torture-runs`.
#![cfg(unix)]
#![allow(missing_docs)]

mod algorithms;
mod determinism;
mod disk;
mod disks;
mod faults;
mod in_memory;
mod interrupted_motions;
mod intruders;
mod kills;
mod page;
mod races;
mod reopened;
mod resume;
mod signals;
#[path = "../support/mod.rs"]
mod support;
