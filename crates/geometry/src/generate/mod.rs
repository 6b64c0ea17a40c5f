//! Built-in meshes: graded tensor-product boxes, each cell cut into six tetrahedra (Kuhn).
//!
//! `grading` makes lines along one axis, `grid` makes the conforming mesh of three sets of lines, `shield` and
//! `block` are the two examples of the paper.

pub mod block;
pub mod grading;
pub mod grid;
pub mod shield;
mod shield_checks;

pub use block::{BlockParameters, block};
pub use grid::Grid;
pub use shield::{ObservationBox, ShieldParameters, shield};
