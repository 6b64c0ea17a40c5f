//! The nodes that carry unknowns: the mesh's vertices and, for quadratic elements, the midpoints of its edges.
//!
//! A space follows from topology and order alone. Its nodes are numbered vertices first, with the mesh's own numbers, then
//! the edges in ascending order of their two vertices; geometry stays linear, so a midpoint lies where its vertices put
//! it. [`Basis`] gives the shape functions of an element at a point, whatever the order.

use fluxmorph_geometry::tet4::{EDGES, Point, Tet4};
use fluxmorph_geometry::{ElementId, Mesh, NodeId, Topology};
use rayon::prelude::*;

use crate::element::lagrange::{Lagrange, TRIANGLE_EDGES};
use crate::element::point;

/// Polynomial order of `A` and `ψ` in an element.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// Linear: `B` is constant in an element.
    #[default]
    Linear,
    /// Quadratic: `B` is linear in an element.
    Quadratic,
}

impl Order {
    /// The polynomial degree.
    pub fn degree(self) -> usize {
        match self {
            Self::Linear => 1,
            Self::Quadratic => 2,
        }
    }
}

/// Nodes with unknowns, and those of each element.
#[derive(Clone, Debug)]
pub struct Space {
    vertex_count: usize,
    nodes: Nodes,
}

#[derive(Clone, Debug)]
enum Nodes {
    Linear(Vec<[NodeId; 4]>),
    Quadratic { tets: Vec<[NodeId; 10]>, edges: Vec<[NodeId; 2]> },
}

/// Most nodes of an element.
const MOST: usize = 10;

/// The shape functions of one element at one point.
#[derive(Clone, Copy, Debug)]
pub struct Basis {
    count: usize,
    nodes: [NodeId; MOST],
    values: [f64; MOST],
    gradients: [Point; MOST],
}

impl Basis {
    /// Node, `N_a` and `∇N_a` [1/m] of every shape function.
    #[inline]
    pub fn iter(&self) -> impl Iterator<Item = (NodeId, f64, Point)> + '_ {
        (0..self.count).map(|a| (self.nodes[a], self.values[a], self.gradients[a]))
    }
}

impl Space {
    /// The nodes of a topology.
    pub fn new(topology: &Topology, order: Order) -> Self {
        let vertex_count = topology.node_count();
        let nodes = match order {
            Order::Linear => Nodes::Linear(topology.tets().to_vec()),
            Order::Quadratic => {
                let mut edges: Vec<[NodeId; 2]> =
                    topology.tets().par_iter().flat_map_iter(|tet| EDGES.map(|e| edge(tet, e))).collect();
                edges.par_sort_unstable();
                edges.dedup();
                let tets = topology
                    .tets()
                    .par_iter()
                    .map(|tet| {
                        std::array::from_fn(|a| match a.checked_sub(4) {
                            None => tet[a],
                            Some(e) => midpoint(vertex_count, &edges, edge(tet, EDGES[e])),
                        })
                    })
                    .collect();
                Nodes::Quadratic { tets, edges }
            }
        };
        Self { vertex_count, nodes }
    }

    /// The order of its elements.
    pub fn order(&self) -> Order {
        match self.nodes {
            Nodes::Linear(_) => Order::Linear,
            Nodes::Quadratic { .. } => Order::Quadratic,
        }
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.vertex_count + self.edges().len()
    }

    /// Number of elements.
    pub fn element_count(&self) -> usize {
        match &self.nodes {
            Nodes::Linear(tets) => tets.len(),
            Nodes::Quadratic { tets, .. } => tets.len(),
        }
    }

    /// The vertices of every edge that carries a node.
    pub fn edges(&self) -> &[[NodeId; 2]] {
        match &self.nodes {
            Nodes::Linear(_) => &[],
            Nodes::Quadratic { edges, .. } => edges,
        }
    }

    /// Nodes of an element: vertices, then midpoints in the order of [`EDGES`].
    #[inline]
    pub fn nodes_of(&self, e: ElementId) -> &[NodeId] {
        match &self.nodes {
            Nodes::Linear(tets) => &tets[e.index()],
            Nodes::Quadratic { tets, .. } => &tets[e.index()],
        }
    }

    /// Nodes of all linear elements; `None` for another order.
    pub fn linear_tets(&self) -> Option<&[[NodeId; 4]]> {
        match &self.nodes {
            Nodes::Linear(tets) => Some(tets),
            Nodes::Quadratic { .. } => None,
        }
    }

    /// Nodes of all quadratic elements; `None` for another order.
    pub fn quadratic_tets(&self) -> Option<&[[NodeId; 10]]> {
        match &self.nodes {
            Nodes::Linear(_) => None,
            Nodes::Quadratic { tets, .. } => Some(tets),
        }
    }

    /// Nodes of a face: vertices, then the midpoints of the edges (0, 1), (1, 2), (2, 0).
    ///
    /// # Panics
    /// If the triangle is not a face of the mesh.
    pub fn quadratic_triangle(&self, triangle: [NodeId; 3]) -> [NodeId; 6] {
        std::array::from_fn(|a| match a.checked_sub(3) {
            None => triangle[a],
            Some(e) => midpoint(self.vertex_count, self.edges(), edge(&triangle, TRIANGLE_EDGES[e])),
        })
    }

    /// Nodes of a face.
    ///
    /// # Panics
    /// If the triangle is not a face of the mesh.
    pub fn triangle(&self, triangle: [NodeId; 3]) -> Vec<NodeId> {
        match self.nodes {
            Nodes::Linear(_) => triangle.to_vec(),
            Nodes::Quadratic { .. } => self.quadratic_triangle(triangle).to_vec(),
        }
    }

    /// Where a node lies [m].
    #[inline]
    pub fn position(&self, mesh: &Mesh, node: NodeId) -> Point {
        match self.vertices_of(node) {
            [a, b] if a == b => mesh.point(a),
            [a, b] => {
                let (x, y) = (mesh.point(a), mesh.point(b));
                std::array::from_fn(|d| 0.5 * (x[d] + y[d]))
            }
        }
    }

    /// The vertices that carry a node: a vertex twice, or the two ends of an edge.
    #[inline]
    pub fn vertices_of(&self, node: NodeId) -> [NodeId; 2] {
        match node.index().checked_sub(self.vertex_count) {
            None => [node; 2],
            Some(edge) => self.edges()[edge],
        }
    }

    /// The shape functions of an element at barycentric coordinates.
    #[inline]
    pub fn basis(&self, e: ElementId, tet: &Tet4, lambda: &[f64; 4]) -> Basis {
        fn fill<const N: usize>(
            shape: &Lagrange<N, 4>,
            element: &[NodeId; N],
            tet: &Tet4,
            lambda: &[f64; 4],
        ) -> Basis {
            let mut basis = Basis {
                count: N,
                nodes: [NodeId(0); MOST],
                values: [0.0; MOST],
                gradients: [[0.0; 3]; MOST],
            };
            for a in 0..N {
                basis.nodes[a] = element[a];
                basis.values[a] = shape.value(a, lambda);
                basis.gradients[a] = point::gradient(shape, tet, lambda, a);
            }
            basis
        }
        match &self.nodes {
            Nodes::Linear(tets) => fill(Lagrange::<4, 4>::tet(), &tets[e.index()], tet, lambda),
            Nodes::Quadratic { tets, .. } => fill(Lagrange::<10, 4>::tet(), &tets[e.index()], tet, lambda),
        }
    }
}

/// The vertices of a local edge, ascending.
fn edge<const N: usize>(nodes: &[NodeId; N], [i, j]: [usize; 2]) -> [NodeId; 2] {
    [nodes[i].min(nodes[j]), nodes[i].max(nodes[j])]
}

fn midpoint(vertex_count: usize, edges: &[[NodeId; 2]], edge: [NodeId; 2]) -> NodeId {
    let position =
        edges.binary_search(&edge).expect("the edge of an element or a face is an edge of the mesh");
    NodeId::new(vertex_count + position)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fluxmorph_geometry::generate::{BlockParameters, block};

    #[test]
    fn a_block_has_as_many_edges_as_eulers_formula_says() {
        let mesh = block(&BlockParameters { cells: [3, 2, 2], ..BlockParameters::default() }).unwrap();
        let topology = mesh.topology();
        let space = Space::new(topology, Order::Quadratic);
        // V − E + F − T = 1 for a ball; every tet has four faces, of which the outer ones are counted once.
        let faces = (4 * topology.tets().len() + topology.facets().len()) / 2;
        let edges = topology.node_count() + faces - topology.tets().len() - 1;
        assert_eq!(space.edges().len(), edges);
        assert_eq!(space.node_count(), topology.node_count() + edges);
        for facet in topology.facets() {
            let nodes = space.quadratic_triangle(facet.nodes);
            let inside = space.nodes_of(facet.inside);
            assert!(nodes.iter().all(|n| inside.contains(n)), "a face has the midpoints of its element");
        }
    }
}
