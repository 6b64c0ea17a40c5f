//! Numbers: fields, losses and gradients against closed forms, references, finite differences and published tables, through
//! the library and the binary. `--nocapture` prints what each test measures.
//!
//! `convergence`: fitted orders, the matrix against its weak form; `verification`: the rows of docs/verification.md;
//! `gradient`: Taylor remainders of the whole chain; `paper`, `gallery`: the shipped configurations; `constraints`,
//! `solvers`, `starts`: what must not change a result; `optimiser`: the loop itself on a coarse shield, and numerical failures.

mod constraints;
mod convergence;
mod effectivity;
mod gallery;
mod gradient;
mod meshes;
mod motion;
mod optimiser;
mod orders;
mod paper;
mod prisms;
mod problems;
mod references;
mod skins;
mod solvers;
mod starts;
#[path = "../support/mod.rs"]
mod support;
mod verification;
