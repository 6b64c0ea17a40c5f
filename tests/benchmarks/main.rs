//! Measured benchmark problems: the shipped configurations, run by the binary, against the published tables.
//!
//! `cargo test --release --test benchmarks -- --nocapture` prints every error on coarser meshes, with `--include-ignored`
//! also on the shipped ones.

#[path = "../support/mod.rs"]
mod support;

mod case;
mod team21a;
mod team7;
