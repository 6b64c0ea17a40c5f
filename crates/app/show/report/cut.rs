//! A plane across a coordinate axis through a tetrahedral mesh: the elements that it cuts, and the faces between regions.
//!
//! A vertex in the plane counts as above it, so that every cut element has vertices on both sides and no case is special.

use fluxmorph_geometry::tet4::{Point, volume};
use fluxmorph_geometry::{ElementId, NodeId, Topology};

/// A plane `x_axis = at`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CutPlane {
    /// 0, 1 or 2.
    pub(super) axis: usize,
    /// [m]
    pub(super) at: f64,
}

/// A triangle in the plane, with values at its corners.
pub(super) type Patch = [(Point, f64); 3];

impl CutPlane {
    fn is_above(&self, point: Point) -> bool {
        point[self.axis] >= self.at
    }

    /// Whether the plane goes between some of these points.
    pub(super) fn cuts(&self, points: &[Point]) -> bool {
        let above = points.iter().filter(|p| self.is_above(**p)).count();
        above > 0 && above < points.len()
    }

    /// Where the plane meets the edge between two vertices, with the value there.
    fn between(&self, (a, va): (Point, f64), (b, vb): (Point, f64)) -> (Point, f64) {
        let t = (self.at - a[self.axis]) / (b[self.axis] - a[self.axis]);
        (std::array::from_fn(|d| a[d] + t * (b[d] - a[d])), va + t * (vb - va))
    }

    /// What the plane cuts out of a tetrahedron, for values at its vertices: nothing, one triangle or two.
    pub(super) fn of_tet(&self, points: [Point; 4], values: [f64; 4]) -> Vec<Patch> {
        let vertex = |i: usize| (points[i], values[i]);
        let (above, below): (Vec<usize>, Vec<usize>) = (0..4).partition(|&i| self.is_above(points[i]));
        let meet = |i: usize, j: usize| self.between(vertex(i), vertex(j));
        match (above.as_slice(), below.as_slice()) {
            ([a], [b, c, d]) | ([b, c, d], [a]) => vec![[meet(*a, *b), meet(*a, *c), meet(*a, *d)]],
            ([a, b], [c, d]) => {
                let corners = [meet(*a, *c), meet(*a, *d), meet(*b, *d), meet(*b, *c)];
                vec![[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]]
            }
            _ => Vec::new(),
        }
    }

    /// The line in which the plane cuts a triangle.
    pub(super) fn of_triangle(&self, points: [Point; 3]) -> Option<[Point; 2]> {
        let (above, below): (Vec<usize>, Vec<usize>) = (0..3).partition(|&i| self.is_above(points[i]));
        let meet = |i: usize, j: usize| self.between((points[i], 0.0), (points[j], 0.0)).0;
        match (above.as_slice(), below.as_slice()) {
            ([a], [b, c]) | ([b, c], [a]) => Some([meet(*a, *b), meet(*a, *c)]),
            _ => None,
        }
    }
}

/// Values of elements as values at their vertices: means over the elements of the same region around a node, by volume.
///
/// A field that jumps between materials keeps its jump.
pub(super) struct NodeMeans<'a> {
    pub(super) topology: &'a Topology,
    pub(super) points: &'a [Point],
    /// One an element.
    pub(super) values: &'a [f64],
}

impl NodeMeans<'_> {
    /// The values at the vertices of an element.
    pub(super) fn of_element(&self, element: ElementId) -> [f64; 4] {
        let region = self.topology.region_of()[element.index()];
        let own = |e: &ElementId| self.topology.region_of()[e.index()] == region;
        self.topology.tet(element).map(|node| self.at(node, own))
    }

    /// The mean over some of the elements around a node; 0 where there are none.
    pub(super) fn at(&self, node: NodeId, wanted: impl Fn(&ElementId) -> bool) -> f64 {
        let (mut sum, mut weight) = (0.0, 0.0);
        for e in self.topology.elements_around(node).iter().filter(|e| wanted(e)) {
            let own = volume(self.topology.tet(*e).map(|n| self.points[n.index()])).abs();
            sum += own * self.values[e.index()];
            weight += own;
        }
        if weight > 0.0 { sum / weight } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fluxmorph_geometry::generate::{BlockParameters, block};
    use fluxmorph_geometry::tet4::{area_vector, norm};

    #[test]
    fn a_linear_field_is_cut_exactly() {
        let mesh = block(&BlockParameters { size: [3.0, 2.0, 1.0], cells: [3, 4, 5] }).expect("a block");
        let field = |p: Point| 1.0 + 2.0 * p[0] - 3.0 * p[1] + 0.5 * p[2];
        // Between the nodes and on them.
        for (axis, at, area) in [(0, 1.3, 2.0), (0, 1.0, 2.0), (1, 0.77, 3.0), (2, 0.4, 6.0)] {
            let plane = CutPlane { axis, at };
            let mut total = 0.0;
            for e in mesh.topology().elements() {
                let points = mesh.vertices(e);
                let patches = plane.of_tet(points, points.map(field));
                assert_eq!(!patches.is_empty(), plane.cuts(&points));
                for patch in patches {
                    total += norm(area_vector(patch.map(|(p, _)| p)));
                    for (p, value) in patch {
                        // A few roundings of numbers below 10.
                        assert!((p[axis] - at).abs() < 1e-14 && (value - field(p)).abs() < 1e-13);
                    }
                }
            }
            assert!((total - area).abs() < 1e-12, "{axis} {at}: {total}");
        }
    }

    #[test]
    fn the_outside_is_cut_in_a_closed_line() {
        let mesh = block(&BlockParameters { size: [3.0, 2.0, 1.0], cells: [3, 4, 5] }).expect("a block");
        let plane = CutPlane { axis: 2, at: 0.31 };
        let length: f64 = mesh
            .topology()
            .facets()
            .iter()
            .filter_map(|f| plane.of_triangle(f.nodes.map(|n| mesh.point(n))))
            .map(|[a, b]| norm(std::array::from_fn(|d| a[d] - b[d])))
            .sum();
        assert!((length - 10.0).abs() < 1e-12, "{length}");
    }

    #[test]
    fn the_mean_of_a_constant_is_the_constant() {
        let mesh = block(&BlockParameters { size: [1.0; 3], cells: [2; 3] }).expect("a block");
        let values = vec![7.0; mesh.topology().tets().len()];
        let means = NodeMeans { topology: mesh.topology(), points: mesh.points(), values: &values };
        for e in mesh.topology().elements() {
            assert!(means.of_element(e).iter().all(|v| (v - 7.0).abs() < 1e-14));
        }
        assert_eq!(means.at(NodeId(0), |_| false), 0.0);
    }
}
