//! Fields, losses and derivatives against closed forms and measured benchmarks; the source of the table in
//! docs/verification.md.
//!
//! `cargo test --release --test physics verification -- --nocapture` prints the rows that take seconds,
//! `--include-ignored` all of them; `just verify` puts them into the page.

mod case;
mod closed_core;
mod coil_forces;
mod families;
mod forces;
mod page;
mod plate;
mod rows;
mod saturated_spheroid;
mod shield;
mod sphere;
mod steel;
mod team21a;
mod team7;
