//! What the boundary conditions fix at one node: directions of `A`, and the values along them.
//!
//! A *flux-parallel* face with the normal `n` fixes the two tangential components of `A`, a *flux-normal* one the normal
//! component. Where several faces meet at a node every condition counts, so the fixed directions span a subspace; the
//! unknowns are the components along the rest. On planes at right angles to the axes the components are those of the
//! coordinates; elsewhere the node gets a [`Frame`] of its own.
//!
//! The normals of a curved surface differ from face to face. Faces that meet at less than [`CREASE`] are one smooth
//! surface with their area-weighted mean normal; at a sharper crease each side counts. A curved surface that ends at a
//! plane meets it, in the mean normal of the faces on one side, not quite at right angles: its normal is turned into the
//! plane there.

use fluxmorph_geometry::directions::{extend, unit};
use fluxmorph_geometry::tet4::{Point, cross, dot};

/// Angle between faces above which they are two surfaces: finer than the facets of any sensible mesh of a curved
/// surface, coarser than a corner.
pub(crate) const CREASE: f64 = 40.0;

/// Angle by which a curved surface's mean normal may miss a plane it ends at: half a facet of [`CREASE`], and some.
const SKEW: f64 = 25.0;

/// Largest component of a unit vector across a coordinate axis with which it still counts as along it: coordinates in
/// files carry six or more digits.
pub(crate) const AXIS_TOLERANCE: f64 = 1e-6;

/// What is left of a unit vector below which it depends on the others: after a normal is turned into the planes it ends
/// at, directions are either new by the sine of [`CREASE`] or old up to rounding.
const DEPENDENT: f64 = 1e-3;

/// What a face asks of `A` at its nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fix {
    /// The tangential components.
    Tangential,
    /// The normal component.
    Normal,
}

/// Orthonormal directions at a node; its unknown components are along these.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Frame {
    /// Directions 0, 1, 2.
    pub(crate) axes: [Point; 3],
}

impl Frame {
    /// The coordinate axes.
    pub(crate) const COORDINATES: Self = Self { axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] };
}

/// What is fixed at one node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FixedDirections {
    /// Directions of the components.
    pub(crate) frame: Frame,
    /// Bit `k`: component `k` is fixed.
    pub(crate) fixed: u8,
}

/// The fixed directions at a node at which faces with these area vectors meet.
pub(crate) fn fixed_directions(faces: &[(Fix, Point)]) -> FixedDirections {
    let mut surfaces = smooth_surfaces(faces);
    // Planes along the axes first: they are exact.
    surfaces.sort_by_key(|(_, normal)| axis_of(*normal).is_none());
    let mut planes: Vec<Point> = Vec::new();
    let mut basis: Vec<Point> = Vec::new();
    for (fix, normal) in surfaces {
        let mut normal = normal;
        match axis_of(normal) {
            Some(axis) => {
                normal = Frame::COORDINATES.axes[axis];
                planes.push(normal);
            }
            None => {
                let skew = SKEW.to_radians().sin();
                for plane in &planes {
                    let part = dot(*plane, normal);
                    if part.abs() >= skew {
                        continue;
                    }
                    normal = std::array::from_fn(|d| normal[d] - part * plane[d]);
                }
                normal = unit(normal);
            }
        }
        match fix {
            Fix::Normal => extend(&mut basis, normal, DEPENDENT),
            Fix::Tangential => {
                let (first, second) = tangents(normal);
                extend(&mut basis, first, DEPENDENT);
                extend(&mut basis, second, DEPENDENT);
            }
        }
    }
    complete(&basis)
}

/// Area-weighted unit normals of the smooth surfaces that faces of one kind form.
fn smooth_surfaces(faces: &[(Fix, Point)]) -> Vec<(Fix, Point)> {
    let crease = CREASE.to_radians().cos();
    let mut sums: Vec<(Fix, Point)> = Vec::new();
    for &(fix, area) in faces {
        let along = |sum: Point| dot(unit(sum), unit(area)) > crease;
        match sums.iter_mut().find(|(kind, sum)| *kind == fix && along(*sum)) {
            Some((_, sum)) => (0..3).for_each(|d| sum[d] += area[d]),
            None => sums.push((fix, area)),
        }
    }
    sums.into_iter().map(|(fix, sum)| (fix, unit(sum))).collect()
}

/// The coordinate axis that a unit vector is along.
pub(crate) fn axis_of(normal: Point) -> Option<usize> {
    (0..3).find(|&axis| (0..3).all(|d| d == axis || normal[d].abs() <= AXIS_TOLERANCE))
}

/// Two unit vectors at right angles to a unit normal and to each other; coordinate axes where the normal is one.
pub(crate) fn tangents(normal: Point) -> (Point, Point) {
    let least = (0..3).fold(0, |best, d| if normal[d].abs() < normal[best].abs() { d } else { best });
    let start = Frame::COORDINATES.axes[least];
    let part = dot(start, normal);
    let first = unit(std::array::from_fn(|d| start[d] - part * normal[d]));
    (first, cross(normal, first))
}

/// The frame whose first directions are the fixed ones; the coordinate axes where these span the same.
fn complete(basis: &[Point]) -> FixedDirections {
    if basis.len() == 3 {
        return FixedDirections { frame: Frame::COORDINATES, fixed: 0b111 };
    }
    let axes: Option<Vec<usize>> = basis.iter().map(|&b| axis_of(b)).collect();
    if let Some(axes) = axes {
        let fixed = axes.iter().fold(0, |bits, axis| bits | 1 << axis);
        return FixedDirections { frame: Frame::COORDINATES, fixed };
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
        (2, Some(axis)) => FixedDirections { frame: Frame::COORDINATES, fixed: 0b111 & !(1 << axis) },
        _ => FixedDirections { frame, fixed },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_along_the_axes_fix_coordinates() {
        let x = [-2.0, 0.0, 0.0];
        let y = [0.0, 3.0, 0.0];
        let of = |faces: &[(Fix, Point)]| fixed_directions(faces);
        assert_eq!(of(&[(Fix::Tangential, x)]), FixedDirections { frame: Frame::COORDINATES, fixed: 0b110 });
        assert_eq!(of(&[(Fix::Normal, x)]), FixedDirections { frame: Frame::COORDINATES, fixed: 0b001 });
        assert_eq!(of(&[(Fix::Tangential, x), (Fix::Normal, y)]).fixed, 0b110);
        assert_eq!(of(&[(Fix::Tangential, x), (Fix::Tangential, y)]).fixed, 0b111);
        assert_eq!(of(&[(Fix::Normal, x), (Fix::Normal, y)]).fixed, 0b011);
    }

    #[test]
    fn a_curved_surface_leaves_its_mean_normal() {
        let n = unit([1.0, 2.0, 2.0]);
        let tilted = [[1.1, 2.0, 2.0], [0.9, 2.0, 2.0]].map(|v: Point| (Fix::Tangential, v));
        let c = fixed_directions(&tilted);
        assert_eq!(c.fixed, 0b011);
        assert!((dot(c.frame.axes[2], n).abs() - 1.0).abs() < 1e-12);
        // Its normal component alone:
        let c = fixed_directions(&[(Fix::Normal, n)]);
        assert_eq!(c.fixed, 0b001);
        assert!((dot(c.frame.axes[0], n).abs() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_curved_surface_that_ends_at_a_plane_is_turned_into_it() {
        // The faces of a sphere beside the plane x = 0 lie on one side of it: their mean normal leans to +x.
        let sphere = [0.1, 0.6, 0.8];
        let plane = [-1.0, 0.0, 0.0];
        let c = fixed_directions(&[(Fix::Tangential, sphere), (Fix::Normal, plane)]);
        assert_eq!(c.fixed, 0b011, "x and the tangent in the plane");
        assert!((dot(c.frame.axes[2], [0.0, 0.6, 0.8]).abs() - 1.0).abs() < 1e-12);
        let c = fixed_directions(&[(Fix::Tangential, sphere), (Fix::Tangential, plane)]);
        assert_eq!(c.fixed, 0b111);
    }

    #[test]
    fn frames_are_orthonormal() {
        for faces in [
            vec![(Fix::Normal, [0.3, -0.4, 0.7])],
            vec![(Fix::Tangential, [0.3, -0.4, 0.7])],
            vec![(Fix::Normal, [0.3, -0.4, 0.7]), (Fix::Normal, [0.9, 0.4, 0.1])],
        ] {
            let axes = fixed_directions(&faces).frame.axes;
            for i in 0..3 {
                for j in 0..3 {
                    let expected = f64::from(u8::from(i == j));
                    assert!((dot(axes[i], axes[j]) - expected).abs() < 1e-14);
                }
            }
        }
    }
}
