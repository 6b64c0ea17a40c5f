//! Fields, losses and derivatives against closed forms and measured benchmarks; the source of the table in
//! docs/verification.md.

#[path = "../convergence/references.rs"]
mod references;
mod rows;
mod sphere;
