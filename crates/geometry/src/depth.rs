//! How far places lie from a surface of triangles.

use rayon::prelude::*;

use crate::box_tree::{AxisBox, BoxTree};
use crate::ids::NodeId;
use crate::mesh::Mesh;
use crate::tet4::{Point, add, dot, norm, sub};

/// Distance of every point from the nearest of some triangles of a mesh [m]; beyond `far` [m] a lower bound of it, which is
/// at least `far`. Infinite without triangles.
pub fn depths(mesh: &Mesh, triangles: &[[NodeId; 3]], points: &[Point], far: f64) -> Vec<f64> {
    let corners: Vec<[Point; 3]> = triangles.iter().map(|t| t.map(|n| mesh.point(n))).collect();
    let tree = BoxTree::new(corners.iter().map(AxisBox::around).collect());
    let depth = |&point: &Point| {
        let Some((first, square)) = tree.nearest(point) else { return f64::INFINITY };
        if square >= far * far {
            return square.sqrt();
        }
        // No triangle whose box is farther than this one can be nearer.
        let bound = distance(point, &corners[first]);
        let mut least = bound;
        let reach = bound * bound;
        tree.for_each(
            |around| around.square_distance(point) <= reach,
            |i| least = least.min(distance(point, &corners[i])),
        );
        least
    };
    points.par_iter().map(depth).collect()
}

/// Distance of a point from a triangle [m] (C. Ericson, Real-Time Collision Detection, 2005, section 5.1.5).
pub fn distance(point: Point, &[a, b, c]: &[Point; 3]) -> f64 {
    let to = |foot: Point| norm(sub(point, foot));
    let along = |from: Point, edge: Point, share: f64| add(from, edge.map(|e| share * e));
    let (ab, ac) = (sub(b, a), sub(c, a));
    let [(d1, d2), (d3, d4), (d5, d6)] = [a, b, c].map(|corner| {
        let own = sub(point, corner);
        (dot(ab, own), dot(ac, own))
    });
    if d1 <= 0.0 && d2 <= 0.0 {
        return to(a);
    }
    if d3 >= 0.0 && d4 <= d3 {
        return to(b);
    }
    if d6 >= 0.0 && d5 <= d6 {
        return to(c);
    }
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return to(along(a, ab, d1 / (d1 - d3)));
    }
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return to(along(a, ac, d2 / (d2 - d6)));
    }
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return to(along(b, sub(c, b), (d4 - d3) / ((d4 - d3) + (d5 - d6))));
    }
    let sum = va + vb + vc;
    to(add(along(a, ab, vb / sum), ac.map(|e| vc / sum * e)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::{BlockParameters, block};

    #[test]
    fn the_distance_from_a_triangle_is_that_of_its_nearest_sample() {
        let corners = [[0.1, 0.0, 0.2], [1.3, 0.2, -0.1], [0.4, 1.1, 0.3]];
        for k in 0..200 {
            let t = k as f64;
            let point = [1.7 * (0.7 * t).sin(), 1.5 * (1.1 * t).cos(), 1.2 * (0.3 * t + 1.0).sin()];
            let samples =
                (0..=60).flat_map(|i| (0..=60 - i).map(move |j| (i as f64 / 60.0, j as f64 / 60.0)));
            let place = |(u, v): (f64, f64)| -> Point {
                std::array::from_fn(|d| (1.0 - u - v) * corners[0][d] + u * corners[1][d] + v * corners[2][d])
            };
            let least = samples.map(|s| norm(sub(point, place(s)))).fold(f64::INFINITY, f64::min);
            let found = distance(point, &corners);
            // Samples lie within 1/60 of the longest side of 1.3 m of any place in the triangle.
            assert!(found <= least + 1e-12 && least <= found + 1.3 / 60.0, "{point:?}: {found} {least}");
        }
    }

    #[test]
    fn nodes_of_a_block_lie_as_deep_as_their_height_says() {
        let mesh = block(&BlockParameters { size: [4.0, 3.0, 1.0], cells: [3, 2, 8] }).expect("a block");
        let top: Vec<[NodeId; 3]> = mesh
            .topology()
            .facets()
            .iter()
            .map(|f| f.nodes)
            .filter(|nodes| nodes.iter().all(|&n| mesh.point(n)[2] == 1.0))
            .collect();
        let found = depths(&mesh, &top, mesh.points(), 0.6);
        for (x, depth) in mesh.points().iter().zip(found) {
            let exact = 1.0 - x[2];
            assert!((depth - exact).abs() < 1e-12 || (exact >= 0.6 && depth >= 0.6), "{x:?}: {depth}");
        }
        assert_eq!(depths(&mesh, &[], &[[0.0; 3]], 1.0), [f64::INFINITY]);
    }
}
