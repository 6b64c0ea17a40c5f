//! Sets of orthonormal directions: what a vector has beside them, and how they grow.

use crate::tet4::{Point, dot, norm};

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
