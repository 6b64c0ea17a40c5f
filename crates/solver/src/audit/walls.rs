//! How thick conductors are under their faces, by rays.

use fluxmorph_geometry::box_tree::BoxTree;
use fluxmorph_geometry::directions::unit;
use fluxmorph_geometry::ray::{hit, reach};
use fluxmorph_geometry::tet4::{Point, area_vector, centroid, dot};
use rayon::prelude::*;

/// Where the ray from the middle of a face into a conductor meets another one of its faces.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wall {
    /// [m]
    pub(super) thickness: f64,
    /// The number of the other face.
    pub(super) opposite: usize,
}

/// The wall under each of the first triangles of a surface that is oriented into its body; `None` where it is thicker than `most` [m],
/// or ends at a symmetry plane.
pub(super) fn walls(corners: &[[Point; 3]], first: usize, most: f64) -> Vec<Option<Wall>> {
    let tree = BoxTree::new(corners.iter().map(reach).collect());
    let of = |own: &[Point; 3]| {
        let (origin, direction) = (centroid(*own), unit(area_vector(*own)));
        let meets = |k: usize| {
            let met = hit(origin, direction, &corners[k])?;
            // The face opposite looks towards the ray.
            let is_wall = dot(met.normal, direction) < 0.0 && met.distance <= most;
            is_wall.then_some(Wall { thickness: met.distance, opposite: k })
        };
        let met = tree.hits(origin, direction).into_iter().filter_map(meets);
        met.min_by(|a, b| a.thickness.total_cmp(&b.thickness))
    };
    corners[..first].par_iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wedge over the unit square whose thickness grows along x from one half to one, oriented inwards.
    #[test]
    fn the_thickness_of_a_wedge_is_that_under_each_face() {
        let top = |x: f64| 0.5 + 0.5 * x;
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let [low, high] = [0.0, 1.0]
            .map(|side| square.map(|[x, y]| if side == 0.0 { [x, y, 0.0] } else { [x, y, top(x)] }));
        let faces = [
            [low[0], low[1], low[2]],
            [low[0], low[2], low[3]],
            [high[0], high[2], high[1]],
            [high[0], high[3], high[2]],
        ];
        let found = walls(&faces, 4, 2.0);
        for (face, wall) in faces.iter().zip(&found).take(2) {
            let wall = wall.expect("a face above");
            assert!(
                (wall.thickness - top(centroid(*face)[0])).abs() < 1e-14 && wall.opposite >= 2,
                "{wall:?}"
            );
        }
        // Rays from the slanted faces lean: one of them passes the rim.
        assert!(
            found[3].is_some_and(|wall| wall.opposite < 2)
                && walls(&faces, 4, 0.6).iter().all(Option::is_none),
            "{found:?}"
        );
    }
}
