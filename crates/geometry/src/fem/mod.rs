//! The nodal finite-element kernel shared by the elastic and the electromagnetic problem.
//!
//! Lives here: equation numbers ([`dofs`]), the sparsity pattern from topology and couplings alone ([`pattern`]),
//! parallel assembly into it ([`assemble`]), the assembled matrix ([`csr`]), fill-reducing orderings ([`ordering`],
//! [`lifted_ordering`] of functions on edges, `kept_first` where part of a factor is kept), the factor of real and complex
//! symmetric systems ([`ldlt`]), the one without fill ([`incomplete`]), what factors take beside themselves ([`workspace`]) and,
//! for elastic systems too large for a factor, conjugate gradients ([`conjugate_gradients`](mod@conjugate_gradients)) with a
//! factor per component ([`components`]). Does not live here:
//! any weak form, any material, any boundary condition. A *node* is a finite-element node: a vertex for linear elements;
//! elements of higher order number further nodes on their edges and use the same code with longer connectivity rows.

pub mod assemble;
pub mod components;
pub mod conjugate_gradients;
pub mod csr;
pub mod dofs;
pub mod incomplete;
mod kept_first;
pub mod ldlt;
pub mod lifted_ordering;
pub mod ordering;
pub mod pattern;
pub mod rotated;
pub mod scalar;
pub mod strong_sets;
pub mod workspace;

pub use assemble::LocalMatrix;
pub use components::{ComponentAnalysis, ComponentPreconditioner};
pub use conjugate_gradients::{IterationReport, IterationStatus, conjugate_gradients};
pub use csr::CsrMatrix;
pub use dofs::DofMap;
pub use incomplete::{Incomplete, IncompleteAnalysis};
pub use kept_first::{Changes, kept_first};
pub use ldlt::{FactorScalar, KeptPanels, Ldlt, LdltAnalysis};
pub use lifted_ordering::{Hosts, lifted_dissection};
pub use pattern::{BlockPattern, BoundGroup, Coupling, ElementGroup};
pub use rotated::RotatedMatrix;
pub use scalar::{Scalar, advance, axpy, c32, c64, dot, dots, norm, scale_add};
pub use strong_sets::StrongSets;
