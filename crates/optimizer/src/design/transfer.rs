//! Displacements of one triangulation of a design surface, transferred to another one of the same surface.
//!
//! A node takes the displacement of the nearest point of the undeformed old surface, linear on its triangle: constant and
//! linear displacements are reproduced, and a planar surface keeps its shape but for the corners between nodes. A node on
//! a boundary edge takes that of the nearest point of the old boundary edges: it stays in the planes that these slide in, and
//! a held boundary stays. Does not live here: what a displacement does to the mesh.

use std::collections::{BTreeMap, BTreeSet};

use fluxmorph_geometry::box_tree::{AxisBox, BoxTree};
use fluxmorph_geometry::depth::nearest_on_triangle;
use fluxmorph_geometry::tet4::{Point, norm, sub};
use fluxmorph_geometry::topology::rim_edges;
use fluxmorph_geometry::{Mesh, NodeId, millimetres};

/// How far a node may lie from a piece of the old surface, as a share of that piece's longest edge. Two triangulations of
/// one plane meet exactly; of a sphere with cells as wide as its radius they lie an eighth of an edge apart.
const NEAR: f64 = 0.25;

/// Two triangulations are not of one surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the fresh mesh's design surface has a node at {}, far from the run's", millimetres(*point))]
pub struct SurfaceMismatch {
    /// Place of the node [m].
    pub point: Point,
}

/// A triangulated surface, its nodes counted from 0 in ascending order of their numbers in the mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Triangulation {
    /// Places of the nodes [m].
    pub places: Vec<Point>,
    /// Nodes of every triangle.
    pub triangles: Vec<[usize; 3]>,
}

impl Triangulation {
    /// The surface that these triangles of a mesh make.
    pub fn new(mesh: &Mesh, triangles: &[[NodeId; 3]]) -> Self {
        let nodes: BTreeSet<NodeId> = triangles.iter().flatten().copied().collect();
        let places = nodes.iter().map(|&n| mesh.point(n)).collect();
        let index: BTreeMap<NodeId, usize> = nodes.into_iter().enumerate().map(|(i, n)| (n, i)).collect();
        let triangles = triangles.iter().map(|triangle| triangle.map(|n| index[&n])).collect();
        Self { places, triangles }
    }

    /// Edges of one triangle only, ascending.
    fn boundary_edges(&self) -> Vec<[usize; 2]> {
        let triangles: Vec<_> = self.triangles.iter().map(|triangle| triangle.map(NodeId::new)).collect();
        rim_edges(&triangles).into_iter().map(|edge| edge.map(NodeId::index)).collect()
    }

    /// Displacements of the nodes of `fresh`, from those of the nodes of this one, both of shape `(n_nodes, 3)` [m].
    ///
    /// # Errors
    /// [`SurfaceMismatch`] where a node has no piece of this surface near.
    ///
    /// # Panics
    /// If there is not one displacement per node.
    pub fn transfer(&self, displacement: &[Point], fresh: &Self) -> Result<Vec<Point>, SurfaceMismatch> {
        assert_eq!(displacement.len(), self.places.len(), "one displacement per node");
        let inner = Pieces::new(&self.places, self.triangles.clone());
        let edges = self.boundary_edges().into_iter().map(|[a, b]| [a, b, b]);
        let boundary = Pieces::new(&self.places, edges.collect());
        let on_boundary: BTreeSet<usize> = fresh.boundary_edges().into_iter().flatten().collect();
        let of = |(i, &place): (usize, &Point)| {
            let pieces = if on_boundary.contains(&i) { &boundary } else { &inner };
            let weights = pieces.nearest(place).ok_or(SurfaceMismatch { point: place })?;
            Ok(weights.iter().fold([0.0; 3], |sum: Point, &(node, weight)| {
                std::array::from_fn(|d| sum[d] + weight * displacement[node][d])
            }))
        };
        fresh.places.iter().enumerate().map(of).collect()
    }
}

/// Triangles, or edges as triangles whose second and third node are the same, found by place.
struct Pieces<'a> {
    places: &'a [Point],
    pieces: Vec<[usize; 3]>,
    /// The box of every piece, as much wider as a node may lie apart.
    boxes: BoxTree,
}

impl<'a> Pieces<'a> {
    fn new(places: &'a [Point], pieces: Vec<[usize; 3]>) -> Self {
        let around = |piece: &[usize; 3]| {
            let corners = piece.map(|n| places[n]);
            AxisBox::around(corners).grown(NEAR * longest_edge(corners))
        };
        let boxes = BoxTree::new(pieces.iter().map(around).collect());
        Self { places, pieces, boxes }
    }

    /// Nodes and their weights at the point of the pieces that lies nearest, the first of equals; `None` without one near.
    fn nearest(&self, place: Point) -> Option<[(usize, f64); 3]> {
        let mut best: Option<(f64, [(usize, f64); 3])> = None;
        for number in self.boxes.containing(place) {
            let piece = self.pieces[number];
            let corners = piece.map(|n| self.places[n]);
            let (weights, distance) = nearest_on_triangle(place, &corners);
            let near = distance <= NEAR * longest_edge(corners);
            if near && best.is_none_or(|(least, _)| distance < least) {
                best = Some((distance, std::array::from_fn(|k| (piece[k], weights[k]))));
            }
        }
        best.map(|(_, weights)| weights)
    }
}

/// Length of the longest edge of a triangle, or of an edge [m].
fn longest_edge([a, b, c]: [Point; 3]) -> f64 {
    [[a, b], [b, c], [c, a]].into_iter().map(|[p, q]| norm(sub(q, p))).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rectangle of `n` × `m` cells, each cut into two triangles, at a height over the plane.
    fn plate([n, m]: [usize; 2], height: impl Fn(f64, f64) -> f64) -> Triangulation {
        let places = (0..=n)
            .flat_map(|i| (0..=m).map(move |j| [0.24 * i as f64 / n as f64, 0.48 * j as f64 / m as f64]))
            .map(|[x, y]| [x, y, height(x, y)])
            .collect();
        let node = |i: usize, j: usize| i * (m + 1) + j;
        let triangles = (0..n)
            .flat_map(|i| (0..m).map(move |j| (i, j)))
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        Triangulation { places, triangles }
    }

    #[test]
    fn constant_and_linear_displacements_are_reproduced() {
        let (old, fresh) = (plate([7, 9], |_, _| -0.01), plate([11, 8], |_, _| -0.01));
        for law in [
            |_: &Point| [0.0, 0.0, 0.02],
            |x: &Point| [0.0, 0.0, 0.3 * x[0] - 0.1 * x[1] + 0.005],
            |x: &Point| [0.2 * x[1], -0.1 * x[0], 0.01],
        ] {
            let displacement: Vec<Point> = old.places.iter().map(law).collect();
            let found = old.transfer(&displacement, &fresh).expect("the same plane");
            for (place, found) in fresh.places.iter().zip(found) {
                // Rounding of places of half a metre, times slopes below one.
                assert!(norm(sub(found, law(place))) < 1e-15, "{place:?}: {found:?}");
            }
        }
    }

    #[test]
    fn a_surface_takes_its_own_displacements_over_exactly() {
        let old = plate([5, 6], |x, y| 0.1 * (3.0 * x * x - y * y));
        let displacement: Vec<Point> = (0..old.places.len()).map(|i| [0.0, 1e-3 * i as f64, 1.0]).collect();
        let found = old.transfer(&displacement, &old).expect("the same surface");
        for (found, expected) in found.iter().zip(&displacement) {
            // Rounding of displacements of a metre.
            assert!(norm(sub(*found, *expected)) < 1e-14, "{found:?}: {expected:?}");
        }
    }

    #[test]
    fn a_held_rim_stays_and_a_rim_in_a_plane_keeps_to_it() {
        // On a bent surface the nearest point to a node of the boundary may lie inside, where nodes leave its plane.
        let bent = |x: f64, y: f64| 0.3 * (x * x + x * y);
        let (old, fresh) = (plate([4, 5], bent), plate([7, 6], bent));
        let law = |x: &Point| if x[0] == 0.0 { [0.0, 0.0, 0.01] } else { [0.01, 0.0, 0.01] };
        let displacement: Vec<Point> = old.places.iter().map(law).collect();
        let found = old.transfer(&displacement, &fresh).expect("the same surface");
        assert!(fresh.places.iter().zip(&found).all(|(x, u)| x[0] > 0.0 || u[0] == 0.0));
    }

    #[test]
    fn another_surface_is_refused_with_the_place() {
        let (old, other) = (plate([4, 4], |_, _| 0.0), plate([4, 4], |_, _| 0.1));
        let displacement = vec![[0.0; 3]; old.places.len()];
        let refused = old.transfer(&displacement, &other).expect_err("a tenth of a metre apart");
        assert_eq!(refused, SurfaceMismatch { point: [0.0, 0.0, 0.1] });
    }
}
