//! Mesh regeneration by fictitious elasticity at constant topology (Eq. 2 and 3 of the seed paper).
//!
//! The design nodes move by `Δx_b`; a fictitious elastic body, frozen on the reference mesh, carries the motion to all
//! other nodes of the remesh region: `K_dd Δx_d = f_d − K_db Δx_b`. [`ElasticMap`] is that affine map and its
//! transpose, which takes `∂F/∂x` at the nodes back to the design nodes. Who moves freely, slides or stays is decided
//! in [`boundary`], the stiffness in [`subregion`], the fictitious force `f` in [`force`]. [`guard`] says how far a
//! motion may go before the first element inverts, and refuses an inverted mesh.

pub mod boundary;
pub mod deform;
pub mod elasticity;
pub mod error;
pub mod force;
pub mod guard;
mod restraint;
mod sensitivity;
pub mod subregion;

pub use boundary::{Boundary, BoundaryKind};
pub use deform::{ElasticMap, Guidance, RemeshSetup};
pub use elasticity::Isotropic;
pub use error::RemeshError;
pub use guard::{StepToInversion, check_step, step_to_inversion};
pub use subregion::{StiffnessPolicy, Subregion};
