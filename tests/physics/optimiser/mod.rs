//! The optimiser on small cases of a configuration: driver, guards, geometric functionals, sources and variables.
#![allow(clippy::unwrap_used)]

mod coils;
mod design_surface;
mod driver;
mod finite;
mod first_steps;
mod geometric;
mod guards;
mod worst_case;
