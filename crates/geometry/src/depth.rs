//! How far places lie from a surface of triangles, and where on it they are nearest.

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
        let bound = nearest_on_triangle(point, &corners[first]).1;
        let mut least = bound;
        let reach = bound * bound;
        tree.for_each(
            |around| around.square_distance(point) <= reach,
            |i| least = least.min(nearest_on_triangle(point, &corners[i]).1),
        );
        least
    };
    points.par_iter().map(depth).collect()
}

/// The point of a triangle that lies nearest to a place, by the weights of its corners [1], and its distance [m] (C. Ericson,
/// Real-Time Collision Detection, 2005, section 5.1.5). Corners may coincide: `[a, b, b]` is an edge.
pub fn nearest_on_triangle(place: Point, &[a, b, c]: &[Point; 3]) -> ([f64; 3], f64) {
    let at = |weights: [f64; 3], foot: Point| (weights, norm(sub(place, foot)));
    let along = |from: Point, edge: Point, share: f64| add(from, edge.map(|e| share * e));
    let (ab, ac) = (sub(b, a), sub(c, a));
    let [(d1, d2), (d3, d4), (d5, d6)] = [a, b, c].map(|corner| {
        let own = sub(place, corner);
        (dot(ab, own), dot(ac, own))
    });
    if d1 <= 0.0 && d2 <= 0.0 {
        return at([1.0, 0.0, 0.0], a);
    }
    if d3 >= 0.0 && d4 <= d3 {
        return at([0.0, 1.0, 0.0], b);
    }
    if d6 >= 0.0 && d5 <= d6 {
        return at([0.0, 0.0, 1.0], c);
    }
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let share = d1 / (d1 - d3);
        return at([1.0 - share, share, 0.0], along(a, ab, share));
    }
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let share = d2 / (d2 - d6);
        return at([1.0 - share, 0.0, share], along(a, ac, share));
    }
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let share = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return at([0.0, 1.0 - share, share], along(b, sub(c, b), share));
    }
    let sum = va + vb + vc;
    at([va / sum, vb / sum, vc / sum], add(along(a, ab, vb / sum), ac.map(|e| vc / sum * e)))
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
            let place = |weights: [f64; 3]| -> Point {
                std::array::from_fn(|d| (0..3).map(|k| weights[k] * corners[k][d]).sum())
            };
            let to = |weights| norm(sub(point, place(weights)));
            let least = samples.map(|(u, v)| to([1.0 - u - v, u, v])).fold(f64::INFINITY, f64::min);
            let (weights, found) = nearest_on_triangle(point, &corners);
            assert!((to(weights) - found).abs() < 1e-12 && weights.iter().all(|&w| w >= 0.0), "{weights:?}");
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
