//! A tetrahedron cut by planes into tetrahedra that no plane crosses.

use fluxmorph_geometry::tet4::{Point, dot};

/// The plane `n·x = offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Normal, of any length.
    pub normal: Point,
    /// `n·x` on the plane.
    pub offset: f64,
}

impl Plane {
    fn distance(&self, x: Point) -> f64 {
        dot(self.normal, x) - self.offset
    }
}

/// Calls `visit` for every piece of `tet`; the pieces fill it without overlap.
///
/// `tolerance` [m × length of the normal]: a vertex nearer to a plane than this counts as on it, so that meshes that
/// follow the coil are not cut into slivers. It must be above what the distances of the coordinates round: a vertex that a
/// cut puts on the plane then counts as on it, so that each half has one crossing fewer and every plane cuts at most four
/// levels deep.
pub fn for_each_piece(tet: [Point; 4], planes: &[Plane], tolerance: f64, visit: &mut impl FnMut([Point; 4])) {
    let Some((plane, rest)) = planes.split_first() else {
        visit(tet);
        return;
    };
    let distances = tet.map(|x| plane.distance(x));
    let above = (0..4).find(|&i| distances[i] > tolerance);
    let below = (0..4).find(|&i| distances[i] < -tolerance);
    match (above, below) {
        (Some(i), Some(j)) => {
            // Split the crossing edge at the plane; each half has one crossing fewer.
            let t = distances[i] / (distances[i] - distances[j]);
            let middle: Point = std::array::from_fn(|d| tet[i][d] + t * (tet[j][d] - tet[i][d]));
            for replaced in [i, j] {
                let mut half = tet;
                half[replaced] = middle;
                for_each_piece(half, planes, tolerance, visit);
            }
        }
        _ => for_each_piece(tet, rest, tolerance, visit),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fluxmorph_geometry::tet4::volume;

    #[test]
    fn pieces_fill_the_tet_and_no_plane_crosses_them() {
        let tet = [[0.1, 0.2, -0.1], [1.3, 0.1, 0.2], [0.3, 0.9, 0.1], [0.2, 0.3, 1.4]];
        let planes = [
            Plane { normal: [1.0, 0.0, 0.0], offset: 0.5 },
            Plane { normal: [0.0, 0.0, 1.0], offset: 0.3 },
            Plane { normal: [1.0, -1.0, 0.0], offset: 0.1 },
        ];
        let (mut sum, mut count) = (0.0, 0);
        for_each_piece(tet, &planes, 1e-12, &mut |piece| {
            sum += volume(piece);
            count += 1;
            for plane in &planes {
                let d = piece.map(|x| plane.distance(x));
                assert!(d.iter().all(|&d| d < 1e-12) || d.iter().all(|&d| d > -1e-12));
            }
        });
        assert!(count > 3);
        assert!((sum - volume(tet)).abs() < 1e-15);
    }
}
