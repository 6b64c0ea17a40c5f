//! Tetrahedral meshes and the nodal finite-element kernel of Fluxmorph.
//!
//! The mesh topology never changes during an optimisation; only coordinates move (section 2 of the seed paper). So
//! [`Topology`] (connectivity, regions, surfaces) lives apart from [`Mesh`] (topology and coordinates), and
//! everything that follows from topology alone is made once a run. Meshes come from [`generate`] or files; they leave through
//! [`io`]; [`quality`] judges them (Eq. 4). [`fem`] is the kernel that the elastic and the electromagnetic problem
//! share, as the paper's appendix suggests.

pub mod box_tree;
pub mod curved;
pub mod depth;
#[cfg(test)]
mod determinism;
pub mod directions;
pub mod disjoint_sets;
mod eigen;
pub mod error;
mod facets;
pub mod fem;
pub mod generate;
pub mod ids;
pub mod incidence;
pub mod io;
pub mod locate;
pub mod mesh;
pub mod millimetres;
pub mod parallel;
pub mod quality;
pub mod ray;
pub mod refine;
pub mod soundness;
pub mod tet4;
pub mod topology;

pub use eigen::eigen_decomposition;
pub use error::MeshError;
pub use ids::{CarrierId, ElementId, NodeId, RegionId};
pub use mesh::Mesh;
pub use millimetres::{Millimetres, Readable, millimetres};
pub use parallel::Partition;
pub use topology::{Facet, Topology};
