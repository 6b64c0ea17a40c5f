//! Convergence of the field solver: manufactured solutions with fitted orders, the assembled matrix against its plain
//! weak form, and closed forms (slab, air coil).
//!
//! `cargo test --release --test physics convergence -- --nocapture` prints every error and fitted order.

mod air_coil;
mod errors;
mod layered;
mod manufactured;
mod plain_matrix;
mod quadrature;
mod slab;
