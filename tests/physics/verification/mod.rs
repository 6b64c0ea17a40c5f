//! Fields, losses and derivatives against closed forms and measured benchmarks; the source of the table in
//! docs/verification.md.
//!
//! `cargo test --release --test verification -- --nocapture` prints the rows that take seconds, `--include-ignored`
//! all of them; `write_the_table` puts them into the page.

mod case;
#[allow(dead_code, reason = "the convergence tests use the rest")]
#[path = "../convergence/meshes.rs"]
mod meshes;
#[allow(dead_code, reason = "the convergence tests use the rest")]
#[path = "../convergence/orders.rs"]
mod orders;
mod page;
mod plate;
#[path = "../convergence/references.rs"]
mod references;
mod rows;
mod shield;
mod sphere;
#[path = "../support/mod.rs"]
mod support;
mod team21a;
mod team7;
