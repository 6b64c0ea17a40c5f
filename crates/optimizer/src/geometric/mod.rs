//! Functions of the shape alone, for constraints: volume or mass of a region, least and greatest thickness.
//!
//! Each gives its value and its exact gradient with respect to the design variables. None of them needs a field; what
//! does lives with the objectives. Bounds on these values and their scaling are the caller's.

mod thickness_bound;
mod volume;
mod wall_thickness;

pub use thickness_bound::{MARGIN, ThicknessBound, ThicknessLimit};
pub use volume::Volume;
pub use wall_thickness::{Wall, WallThickness};

use fluxmorph_geometry::MeshError;

/// Why a geometric function cannot be built.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of a variant says what its fields are")]
pub enum GeometricError {
    /// A name that the mesh does not have.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The region has no elements, and no surface stands for it.
    #[error(
        "the region `{region}` has no elements in the mesh: its volume is not defined; name a region that is meshed"
    )]
    NoElements { region: String },
    /// The region is cut by two parallel outer planes along x, along y and along z.
    #[error(
        "the region `{region}` is replaced by its impedance surface and ends at two outer planes along each of x, y and \
         z: its volume does not follow from that surface; mesh the region instead"
    )]
    Boxed { region: String },
    /// The design has no thickness.
    #[error(
        "the thickness along the design's direction is not defined: there is no body behind the design surface, or some \
         line through it meets no opposite face; leave the thickness limit out, or name the body's region"
    )]
    NoThickness,
}
