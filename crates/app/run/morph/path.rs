//! The path of the design nodes: `t` from 0 to 1 in, displacements from the undeformed mesh out.
//!
//! A rotation turns by `t` times its angle, so that a node walks along its arc: the straight line to its end would
//! shrink the body on the way, by half for 120 degrees.

use fluxmorph_geometry::NodeId;
use fluxmorph_geometry::tet4::{Point, cross, dot, norm};

/// What one node does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NodeMotion {
    /// In proportion to `t`, up to this displacement [m].
    Straight(Point),
    /// Scaled, then turned, then shifted.
    Transformed {
        /// Place on the undeformed mesh [m].
        from: Point,
        /// Which transformation of the path.
        transform: usize,
    },
}

/// A transformation that depends on `t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// Centre [m] and factor of the scaling.
    pub scale: (Point, f64),
    /// A point on the axis [m], unit vector along it, angle [rad].
    pub rotation: (Point, Point, f64),
    /// Translation [m].
    pub displacement: Point,
}

impl Transform {
    /// Leaves everything where it is.
    pub const NONE: Self =
        Self { scale: ([0.0; 3], 1.0), rotation: ([0.0; 3], [0.0, 0.0, 1.0], 0.0), displacement: [0.0; 3] };

    /// Where a point is at `t`, as a displacement [m].
    ///
    /// Every part is written as a difference, so that what does not move gets zeros and not rounding.
    pub fn displacement(&self, point: Point, t: f64) -> Point {
        let (centre, factor) = self.scale;
        let stretch = (factor - 1.0) * t;
        let scaled: Point = std::array::from_fn(|d| stretch * (point[d] - centre[d]));
        let (on_axis, axis, angle) = self.rotation;
        let arm: Point = std::array::from_fn(|d| point[d] + scaled[d] - on_axis[d]);
        // Rodrigues: R a − a = sin φ (k × a) − (1 − cos φ)(a − k (k·a)).
        let (sine, versine) = ((t * angle).sin(), 2.0 * (0.5 * t * angle).sin().powi(2));
        let (across, along) = (cross(axis, arm), dot(axis, arm));
        std::array::from_fn(|d| {
            let turned = sine * across[d] - versine * (arm[d] - along * axis[d]);
            scaled[d] + turned + t * self.displacement[d]
        })
    }
}

/// The design nodes and their path.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Path {
    nodes: Vec<NodeId>,
    motions: Vec<NodeMotion>,
    transforms: Vec<Transform>,
}

impl Path {
    /// A path of nodes in ascending order.
    ///
    /// # Panics
    /// If there is not one motion per node, or one names a transformation that there is not.
    pub fn new(nodes: Vec<NodeId>, motions: Vec<NodeMotion>, transforms: Vec<Transform>) -> Self {
        assert_eq!(nodes.len(), motions.len(), "one motion per node");
        let known = |motion: &NodeMotion| match motion {
            NodeMotion::Straight(_) => true,
            NodeMotion::Transformed { transform, .. } => *transform < transforms.len(),
        };
        assert!(motions.iter().all(known), "every transformation is there");
        Self { nodes, motions, transforms }
    }

    /// The design nodes, ascending.
    pub fn nodes(&self) -> &[NodeId] {
        &self.nodes
    }

    /// Displacement of the design nodes at `t` from the undeformed mesh [m], shape `(n_design, 3)`; zero at 0.
    pub fn at(&self, t: f64) -> Vec<Point> {
        let of = |motion: &NodeMotion| match *motion {
            NodeMotion::Straight(u) => u.map(|u| t * u),
            NodeMotion::Transformed { from, transform } => self.transforms[transform].displacement(from, t),
        };
        self.motions.iter().map(of).collect()
    }

    /// Length of the longest displacement at the end of the path [m].
    pub fn largest(&self) -> f64 {
        self.at(1.0).into_iter().map(norm).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn scaling_comes_first_then_rotation_then_translation() {
        let transform = Transform {
            scale: ([1.0, 0.0, 0.0], 3.0),
            rotation: ([0.0; 3], [0.0, 0.0, 1.0], PI / 2.0),
            displacement: [0.0, 0.0, 5.0],
        };
        // (2, 0, 0) → (4, 0, 0) → (0, 4, 0) → (0, 4, 5).
        let u = transform.displacement([2.0, 0.0, 0.0], 1.0);
        for (found, expected) in u.into_iter().zip([-2.0, 4.0, 5.0]) {
            assert!((found - expected).abs() < 1e-14, "{u:?}");
        }
        // Half way: (3, 0, 0), turned by 45 degrees.
        let u = transform.displacement([2.0, 0.0, 0.0], 0.5);
        let half = 3.0 / 2f64.sqrt();
        for (found, expected) in u.into_iter().zip([half - 2.0, half, 2.5]) {
            assert!((found - expected).abs() < 1e-14, "{u:?}");
        }
    }

    #[test]
    fn a_path_starts_at_rest_and_a_rotation_keeps_distances_along_it() {
        let axis = [1.0, 2.0, -2.0].map(|c| c / 3.0);
        let transform = Transform { rotation: ([0.3, 0.1, 0.2], axis, 2.0), ..Transform::NONE };
        let places = [[0.0, 1.0, 0.5], [2.0, -1.0, 0.0]];
        let motions = places.map(|from| NodeMotion::Transformed { from, transform: 0 });
        let path = Path::new(vec![NodeId(0), NodeId(1)], motions.to_vec(), vec![transform]);
        assert_eq!(path.at(0.0), [[0.0; 3]; 2]);
        let distance =
            |u: &[Point]| norm(std::array::from_fn(|d| places[0][d] + u[0][d] - places[1][d] - u[1][d]));
        let rest = distance(&path.at(0.0));
        for t in [0.25, 0.5, 1.0] {
            // Rounding of lengths of order one.
            assert!((distance(&path.at(t)) - rest).abs() < 1e-14);
        }
    }
}
