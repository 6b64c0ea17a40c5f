//! Functions of the shape alone, for constraints: least and greatest thickness.
//!
//! Each gives its value and its exact gradient with respect to the design variables. None of them needs a field; what
//! does lives with the objectives. Bounds on these values and their scaling are the caller's.

use fluxmorph_geometry::millimetres;
use fluxmorph_geometry::tet4::Point;

mod thickness_bound;
mod wall_thickness;

pub use thickness_bound::{MARGIN, ThicknessBound, ThicknessLimit, kept_back};
pub use wall_thickness::{Wall, WallThickness, faces_with_bodies};

/// The design has no thickness.
#[derive(Clone, Copy, Debug, Default, thiserror::Error)]
#[error(
    "the thickness along the design's direction is not defined: {}; turn a direction round that points into the body, name no faces of a \
     body but those that are shaped, give the body a material, or leave the thickness limit out",
    why(*at)
)]
pub struct NoThickness {
    /// A node of the design surface [m] from which a ray against its direction meets no opposite face; `None` without a body behind any.
    pub at: Option<Point>,
}

fn why(at: Option<Point>) -> String {
    at.map_or_else(
        || "there is no body behind the design surface".to_owned(),
        |at| {
            let at = millimetres(at);
            format!(
                "a ray from the design node at {at} against its direction meets no opposite face of a body"
            )
        },
    )
}
