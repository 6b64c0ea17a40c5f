//! Functions of the shape alone, for constraints: least and greatest thickness.
//!
//! Each gives its value and its exact gradient with respect to the design variables. None of them needs a field; what
//! does lives with the objectives. Bounds on these values and their scaling are the caller's.

mod thickness_bound;
mod wall_thickness;

pub use thickness_bound::{MARGIN, ThicknessBound, ThicknessLimit, kept_back};
pub use wall_thickness::{Wall, WallThickness, faces_with_bodies};

/// The design has no thickness.
#[derive(Debug, thiserror::Error)]
#[error(
    "the thickness along the design's direction is not defined: there is no body behind the design surface, or some \
     line through it meets no opposite face; turn a direction round that points into the body, name no faces of a body but those that are \
     shaped, give the body a material, or leave the thickness limit out"
)]
pub struct NoThickness;
