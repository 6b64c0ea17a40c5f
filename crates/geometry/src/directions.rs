//! Sets of orthonormal directions: what a vector has beside them, how they grow, and the frame of a node along some of which
//! components are fixed.

use crate::tet4::{Point, cross, dot, norm};

/// Largest component of a unit vector across a coordinate axis with which it still counts as along it: coordinates in
/// files carry six or more digits.
const AXIS_TOLERANCE: f64 = 1e-6;

/// A vector with the length 1.
pub fn unit(v: Point) -> Point {
    let length = norm(v);
    v.map(|c| c / length)
}

/// What a vector has beside orthonormal directions.
pub fn beside(directions: &[Point], vector: Point) -> Point {
    directions.iter().fold(vector, |rest, direction| {
        let along = dot(*direction, rest);
        std::array::from_fn(|d| rest[d] - along * direction[d])
    })
}

/// Adds what a unit vector has beside an orthonormal set, where that is longer than `least` [1].
pub fn extend(directions: &mut Vec<Point>, vector: Point, least: f64) {
    let rest = beside(directions, vector);
    if norm(rest) > least {
        directions.push(unit(rest));
    }
}

/// Orthonormal directions at a node; its unknown components are along these.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Directions 0, 1, 2.
    pub axes: [Point; 3],
}

impl Frame {
    /// The coordinate axes.
    pub const COORDINATES: Self = Self { axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] };
}

/// What is fixed at one node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixedDirections {
    /// Directions of the components.
    pub frame: Frame,
    /// Bit `k`: component `k` is fixed.
    pub fixed: u8,
}

impl FixedDirections {
    /// Fixed along orthonormal directions: the frame begins with them; the coordinate axes where these span the same.
    pub fn spanned_by(basis: &[Point]) -> Self {
        if basis.len() == 3 {
            return Self { frame: Frame::COORDINATES, fixed: 0b111 };
        }
        let axes: Option<Vec<usize>> = basis.iter().map(|&b| axis_of(b)).collect();
        if let Some(axes) = axes {
            let fixed = axes.iter().fold(0, |bits, axis| bits | 1 << axis);
            return Self { frame: Frame::COORDINATES, fixed };
        }
        let frame = match *basis {
            [only] => {
                let (first, second) = tangents(only);
                Frame { axes: [only, first, second] }
            }
            [first, second, ..] => Frame { axes: [first, second, cross(first, second)] },
            [] => Frame::COORDINATES,
        };
        let fixed = (1 << basis.len()) - 1;
        // Two directions across an axis fix the two others, however they lie in the plane.
        match (basis.len(), axis_of(frame.axes[2])) {
            (2, Some(axis)) => Self { frame: Frame::COORDINATES, fixed: 0b111 & !(1 << axis) },
            _ => Self { frame, fixed },
        }
    }
}

/// The coordinate axis that a unit vector is along.
pub fn axis_of(normal: Point) -> Option<usize> {
    (0..3).find(|&axis| (0..3).all(|d| d == axis || normal[d].abs() <= AXIS_TOLERANCE))
}

/// Two unit vectors at right angles to a unit normal and to each other; coordinate axes where the normal is one.
pub fn tangents(normal: Point) -> (Point, Point) {
    let least = (0..3).fold(0, |best, d| if normal[d].abs() < normal[best].abs() { d } else { best });
    let start = Frame::COORDINATES.axes[least];
    let part = dot(start, normal);
    let first = unit(std::array::from_fn(|d| start[d] - part * normal[d]));
    (first, cross(normal, first))
}
