//! Built-in meshes: graded tensor-product boxes, each cell cut into six tetrahedra (Kuhn), and a ball.
//!
//! `grading` makes lines along one axis from layers, `sizing` from size limits, `grid` makes the conforming mesh of
//! three sets of lines. `shield` and `block` are the two examples of the paper, `boxes` any device with faces along the
//! axes, `sphere` the ball of the closed forms; `open_shell` puts a shell around any
//! of them.

pub mod block;
pub mod boxes;
pub mod grading;
pub mod grid;
#[cfg(test)]
mod measures;
pub mod open_shell;
pub mod shield;
mod shield_checks;
pub mod sizing;
pub mod sphere;
mod sphere_nodes;

pub use block::{BlockParameters, block};
pub use boxes::{AxisSize, BoxRegion, BoxesParameters, SurfacePatch, boxes};
pub use grid::{Division, Grid};
pub use open_shell::{OpenShellParameters, open_shell};
pub use shield::{ObservationBox, ShieldParameters, shield};
pub use sizing::SizeLimit;
pub use sphere::{SphereParameters, sphere};
