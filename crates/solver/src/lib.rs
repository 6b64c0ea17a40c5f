//! Magnetostatic and eddy-current fields by nodal A–ψ and by edge finite elements, objectives of the field, and their adjoint.
//!
//! SI units; phasors are peak values with the time factor `exp(+jωt)`; `B = curl A`, `E = −jω(A + ∇ψ)`. A
//! [`FieldModel`] is what does not change while the mesh moves (materials, coils, boundary conditions, equation
//! numbers, sparsity pattern); [`FieldModel::solve`] gives a [`FieldSolution`] on a mesh; [`functional`] values it and
//! [`adjoint`] differentiates that value with respect to every node position. Element kernels are pure functions in
//! [`element`]; the linear solver is chosen in [`linear`] and nowhere else. Optimisation and mesh motion are other
//! crates' business.

pub mod adjoint;
pub mod audit;
pub mod bh;
pub mod boundary;
pub mod circuit;
pub mod coil;
mod discretisation;
mod distributed;
pub mod element;
pub mod elements;
pub mod enrichment;
pub mod error;
pub mod family;
mod fixed_directions;
pub mod functional;
mod gauge;
mod harmonic;
mod line_search;
pub mod linear;
mod load;
pub mod load_case;
mod local_entities;
pub mod material;
pub mod model;
pub mod multipole;
pub mod newton;
mod newton_harmonic;
mod newton_steps;
mod nonlinear;
pub mod open;
pub mod prolongation;
pub mod recovery;
mod reentrant;
pub mod saturation;
pub mod setup;
pub mod solution;
mod solve;
pub mod space;
pub mod surface;
mod tangents;
pub mod unknowns;
mod weak_form;

pub use bh::BhCurve;
pub use boundary::{Boundary, UniformField};
pub use circuit::Winding;
pub use elements::{ElementFamily, Order};
pub use error::{NewtonFailure, NonConvergence, PointsOf, SolverError};
pub use functional::{Functional, FunctionalValue, RigidMotion};
pub use linear::{LinearSolver, LinearSolverReport};
pub use load_case::{Drive, LoadCase, frequency_label};
pub use material::Material;
pub use model::FieldModel;
pub use open::OpenRegion;
pub use setup::FieldModelSetup;
pub use solution::{FieldSolution, FieldState};
pub use space::Space;
pub use surface::{Conductor, SurfaceLaw};
