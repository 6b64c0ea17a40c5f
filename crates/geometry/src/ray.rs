//! Where rays meet triangles.

use crate::box_tree::AxisBox;
use crate::tet4::{Point, area_vector, barycentric, dot, norm, sub};

/// How far outside a triangle, in barycentric coordinates, a ray still meets it: rays from a rim run along the side of their body, and
/// those at the edge of a step along that.
const RIM_TOLERANCE: f64 = 1e-6;

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Distance along it, in lengths of its direction.
    pub distance: f64,
    /// The weights of the corners.
    pub weights: Point,
    /// That of the triangle, of any length.
    pub normal: Point,
}

/// A box that holds every place where a ray counts as meeting a triangle.
pub fn reach(triangle: &[Point; 3]) -> AxisBox {
    let tight = AxisBox::around(triangle);
    tight.grown(10.0 * RIM_TOLERANCE * tight.extent())
}

/// Where a ray meets a triangle that it does not touch at its origin.
pub fn hit(origin: Point, direction: Point, triangle: &[Point; 3]) -> Option<Hit> {
    let normal = area_vector(*triangle);
    let slope = dot(normal, direction);
    let area = norm(normal);
    if slope.abs() < RIM_TOLERANCE * area {
        return None;
    }
    let distance = dot(normal, sub(triangle[0], origin)) / slope;
    let met: Point = std::array::from_fn(|d| origin[d] + distance * direction[d]);
    let weights = barycentric(triangle, met);
    let is_inside = weights.into_iter().all(|share| share >= -RIM_TOLERANCE);
    (is_inside && distance > RIM_TOLERANCE * area.sqrt()).then_some(Hit { distance, weights, normal })
}
