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

use fluxmorph_geometry::directions::{FixedDirections, Frame, axis_of, extend, tangents, unit};
use fluxmorph_geometry::tet4::{Point, dot};

/// Angle between faces above which they are two surfaces: finer than the facets of any sensible mesh of a curved
/// surface, coarser than a corner.
pub(crate) const CREASE: f64 = 40.0;

/// Angle by which a curved surface's mean normal may miss a plane it ends at: half a facet of [`CREASE`], and some.
const SKEW: f64 = 25.0;

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
    FixedDirections::spanned_by(&basis)
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
