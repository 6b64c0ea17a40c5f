//! Mesh regeneration by fictitious elasticity at constant topology (Eq. 2 and 3 of the seed paper).
//!
//! The design nodes move by `Δx_b`; a fictitious elastic body, frozen on the reference mesh, carries the motion to all
//! other nodes of the remesh region: `K_dd Δx_d = f_d − K_db Δx_b`. [`ElasticMap`] is that affine map and its
//! transpose, which takes `∂F/∂x` at the nodes back to the design nodes. Two other laws are one function of the design as well,
//! and go further (`equilibrium`): `rails` for designs along one axis, with the energy of `barrier`, and `hyperelastic` for all
//! others, with that of `neo_hooke`. [`motion`] is the mesh of a design by one of them, and `carried` how far it goes. Who moves
//! freely, slides or stays is decided in [`boundary`], the stiffness in [`subregion`] and [`policy`], the fictitious force `f` in
//! `force`. [`guard`] says how far a motion may go before the first element inverts, and refuses an inverted mesh.

mod barrier;
mod body;
pub mod boundary;
pub mod carried;
pub mod deform;
mod distributed;
pub mod elasticity;
mod equilibrium;
pub mod error;
mod force;
mod freedom;
pub mod guard;
mod hyperelastic;
mod linear;
pub mod motion;
mod neo_hooke;
pub mod policy;
mod rails;
mod restraint;
mod sensitivity;
mod singular_values;
mod solver;
pub mod subregion;

pub use boundary::{Boundary, BoundaryKind};
pub use carried::{Carried, LEAST_ROOM, Room, Shortfall};
pub use deform::{ElasticMap, KinematicConstraint, MotionLaw, RemeshSetup};
pub use elasticity::Isotropic;
pub use error::RemeshError;
pub use guard::{StepToInversion, check_step, step_to_inversion};
pub use motion::{Motion, Moved};
pub use policy::StiffnessPolicy;
pub use solver::SolverChoice;
pub use subregion::Subregion;
