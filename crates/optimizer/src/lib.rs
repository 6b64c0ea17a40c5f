//! The optimisation of a shape: design variables, objective and constraints as one function with its exact gradient, and
//! NLopt's methods driven over it.
//!
//! It composes [`fluxmorph_solver`] and [`fluxmorph_remesh`]. What a person sees is not here: configuration keys, files,
//! exit codes and the terminal belong to the application.

pub mod body;
pub mod constraint;
pub mod design;
pub mod driver;
mod error;
pub mod geometric;
pub mod memory_estimate;
pub mod nlopt;
pub mod objective;
pub mod problem;
pub mod verify;

pub use error::Error;
