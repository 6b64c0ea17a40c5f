//! The orthonormal frame of a coil: its centre, two directions across the axis, and the axis.
//!
//! Right-handed, so that a positive turn from the first direction to the second is anticlockwise about the axis.

use fluxmorph_geometry::tet4::{Point, cross, dot, norm, sub};

use crate::error::SolverError;

/// Sine of the angle between the axis and a direction below which they count as parallel: no plane is left to turn in.
const PARALLEL: f64 = 1e-6;

/// Where a coil sits and how it is turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    centre: Point,
    directions: [Point; 3],
}

impl Frame {
    /// The frame at `centre` [m] about the coordinate axis `axis` (0, 1, 2); the two that follow it cyclically come
    /// first and second (x, y for z).
    ///
    /// # Errors
    /// [`SolverError::Parameter`] for another number.
    pub fn coordinate(centre: Point, axis: usize) -> Result<Self, SolverError> {
        if axis > 2 {
            return Err(SolverError::parameter("axis", axis, "0, 1 or 2 for x, y or z"));
        }
        Ok(Self { centre, directions: [axis + 1, axis + 2, axis].map(|d| unit(d % 3)) })
    }

    /// The frame at `centre` [m] about a vector of any length.
    ///
    /// The first direction is the part of `direction` across the axis; without it, of the coordinate direction that
    /// follows cyclically the one nearest to the axis (x for an axis near z; of two equally near the first).
    ///
    /// # Errors
    /// [`SolverError::Parameter`] for an axis without length and a direction along the axis.
    pub fn new(centre: Point, axis: Point, direction: Option<Point>) -> Result<Self, SolverError> {
        let refuse = |what: &str, value: Point, expected: &str| {
            SolverError::parameter(what, format!("{value:?}"), expected)
        };
        let normal = normalise(axis)
            .ok_or_else(|| refuse("axis", axis, "a vector with a length, such as [0.0, 0.0, 1.0]"))?;
        let nearest = (1..3).fold(0, |best, d| if normal[d].abs() > normal[best].abs() { d } else { best });
        let wanted = direction.unwrap_or_else(|| unit((nearest + 1) % 3));
        let first = normalise(wanted)
            .map(|w| {
                let along = dot(w, normal);
                sub(w, normal.map(|c| along * c))
            })
            .filter(|across| norm(*across) > PARALLEL)
            .and_then(normalise)
            .ok_or_else(|| refuse("direction", wanted, "a vector with a length across the axis"))?;
        Ok(Self { centre, directions: [first, cross(normal, first), normal] })
    }

    /// The centre [m].
    pub fn centre(&self) -> Point {
        self.centre
    }

    /// Unit vector of the axis.
    pub fn axis(&self) -> Point {
        self.directions[2]
    }

    /// Coordinates of a point relative to the centre: along the two directions, then along the axis [m].
    #[inline]
    pub fn local(&self, x: Point) -> Point {
        let from_centre = sub(x, self.centre);
        self.directions.map(|d| dot(d, from_centre))
    }

    /// A vector with components along the three directions, in space.
    #[inline]
    pub fn vector(&self, local: Point) -> Point {
        std::array::from_fn(|i| (0..3).map(|d| local[d] * self.directions[d][i]).sum())
    }
}

fn unit(d: usize) -> Point {
    let mut e = [0.0; 3];
    e[d] = 1.0;
    e
}

/// The unit vector along `v`; `None` without a finite length above zero.
fn normalise(v: Point) -> Option<Point> {
    let length = norm(v);
    (length > 0.0 && length.is_finite()).then(|| v.map(|c| c / length))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vector_along_a_coordinate_gives_the_frame_of_that_coordinate() {
        let centre = [0.1, -0.2, 0.3];
        for axis in 0..3 {
            let by_vector = Frame::new(centre, unit(axis).map(|c| 7.0 * c), None).unwrap();
            assert_eq!(by_vector, Frame::coordinate(centre, axis).unwrap());
        }
    }

    #[test]
    fn the_directions_are_orthonormal_and_right_handed() {
        let frame = Frame::new([0.0; 3], [1.0, -2.0, 0.5], Some([0.3, 0.1, 4.0])).unwrap();
        let [u, v, w] = frame.directions;
        for (a, b) in [(u, v), (v, w), (w, u)] {
            assert!(dot(a, b).abs() < 1e-15 && (norm(a) - 1.0).abs() < 1e-15);
        }
        assert!((dot(cross(u, v), w) - 1.0).abs() < 1e-15);
        assert!(dot(u, [0.3, 0.1, 4.0]) > 0.0, "the first direction points as asked");
        let x = [0.3, 0.2, 0.9];
        let back = frame.vector(frame.local(x));
        assert!(norm(sub(back, x)) < 1e-15);
    }

    #[test]
    fn an_axis_without_length_and_a_direction_along_it_are_refused() {
        let error = Frame::new([0.0; 3], [0.0; 3], None).unwrap_err();
        assert!(error.to_string().starts_with("axis = [0.0, 0.0, 0.0]"), "{error}");
        let error = Frame::new([0.0; 3], [1.0, 1.0, 0.0], Some([-2.0, -2.0, 0.0])).unwrap_err();
        assert!(error.to_string().contains("across the axis"), "{error}");
        assert!(Frame::coordinate([0.0; 3], 3).is_err());
    }
}
