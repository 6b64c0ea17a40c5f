//! What carries the unknowns: of nodal elements the mesh's vertices and, of second order, its edges' midpoints; of edge
//! elements its edges and, of second order, its faces.
//!
//! A space follows from topology, family and order alone. Carriers have numbers of their own ([`CarrierId`]), all alike to
//! assembly: vertices first, with the mesh's own numbers, then the edges in ascending order of their two
//! vertices, then the faces likewise; each family has those that it needs. Geometry stays linear, so a midpoint lies where
//! its vertices put it. Does not live here: which carrier has which unknown ([`crate::unknowns`]), and what the functions
//! are ([`crate::family`]).

use fluxmorph_geometry::tet4::{EDGES, Point, Tet4};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{CarrierId, ElementId, Mesh, NodeId, Topology};
use rayon::prelude::*;

use crate::element::edge::functions::{ASCENDING_FACES, ASCENDING_TRIANGLE_EDGES};
use crate::element::lagrange::TRIANGLE_EDGES;
use crate::elements::{ElementFamily, Order};
use crate::family::{self, Cell, EachFunction, Family, MOST};

/// Carriers of unknowns, and those of each element.
#[derive(Clone, Debug)]
pub struct Space {
    family: ElementFamily,
    order: Order,
    vertex_count: usize,
    /// Those that carry unknowns, ascending.
    edges: Vec<[NodeId; 2]>,
    /// Those that carry unknowns, ascending.
    faces: Vec<[NodeId; 3]>,
    tets: Carriers,
    /// Place of each vertex in ascending order, of edge elements.
    ascending: Vec<[u8; 4]>,
}

/// Carriers of every element.
#[derive(Clone, Debug)]
pub(crate) enum Carriers {
    /// Vertices.
    Four(Vec<[CarrierId; 4]>),
    /// Edges.
    Six(Vec<[CarrierId; 6]>),
    /// Vertices and edges, or edges and faces.
    Ten(Vec<[CarrierId; 10]>),
}

impl Space {
    /// The carriers of a topology.
    pub fn new(topology: &Topology, family: ElementFamily, order: Order) -> Self {
        let vertex_count = topology.node_count();
        let tets = topology.tets();
        let of_edges = family == ElementFamily::Edge;
        let edges = match (family, order) {
            (ElementFamily::Nodal, Order::Linear) => Vec::new(),
            _ => collect(tets, |tet| EDGES.map(|e| edge(tet, e))),
        };
        let faces = match (family, order) {
            (ElementFamily::Edge, Order::Quadratic) => {
                collect(tets, |tet| ASCENDING_FACES.map(|face| face_key(face.map(|v| tet[v]))))
            }
            _ => Vec::new(),
        };
        let mut space = Self {
            family,
            order,
            vertex_count,
            edges,
            faces,
            tets: Carriers::Four(Vec::new()),
            ascending: if of_edges { tets.par_iter().map(ascending).collect() } else { Vec::new() },
        };
        space.tets = match (family, order) {
            (ElementFamily::Nodal, Order::Linear) => Carriers::Four(each(tets, |tet, a| tet[a].into())),
            (ElementFamily::Nodal, Order::Quadratic) => Carriers::Ten(each(tets, |tet, a| {
                a.checked_sub(4).map_or_else(|| tet[a].into(), |e| space.carrier_of_edge(edge(tet, EDGES[e])))
            })),
            (ElementFamily::Edge, Order::Linear) => {
                Carriers::Six(each(tets, |tet, a| space.carrier_of_edge(edge(&sorted(tet), EDGES[a]))))
            }
            (ElementFamily::Edge, Order::Quadratic) => Carriers::Ten(each(tets, |tet, a| {
                let tet = sorted(tet);
                match a.checked_sub(6) {
                    None => space.carrier_of_edge(edge(&tet, EDGES[a])),
                    Some(f) => space.carrier_of_face(ASCENDING_FACES[f].map(|v| tet[v])),
                }
            })),
        };
        space
    }

    /// What is continuous between its elements.
    pub fn family(&self) -> ElementFamily {
        self.family
    }

    /// The order of its elements.
    pub fn order(&self) -> Order {
        self.order
    }

    /// Number of carriers.
    pub fn carrier_count(&self) -> usize {
        self.first_edge() + self.edges.len() + self.faces.len()
    }

    /// Number of elements.
    pub fn element_count(&self) -> usize {
        match &self.tets {
            Carriers::Four(tets) => tets.len(),
            Carriers::Six(tets) => tets.len(),
            Carriers::Ten(tets) => tets.len(),
        }
    }

    /// The vertices of every edge that is a carrier, in the order of the carriers.
    pub fn edges(&self) -> &[[NodeId; 2]] {
        &self.edges
    }

    /// Carriers of an element, in the order of its functions: vertices, then edges in the order of [`EDGES`], then faces; of
    /// edge elements with the vertices in ascending order.
    #[inline]
    pub fn carriers_of(&self, e: ElementId) -> &[CarrierId] {
        match &self.tets {
            Carriers::Four(tets) => &tets[e.index()],
            Carriers::Six(tets) => &tets[e.index()],
            Carriers::Ten(tets) => &tets[e.index()],
        }
    }

    /// The triangles of all elements by their edges, as [`crate::harmonic`] takes them; of edge elements only.
    pub(crate) fn edge_triangles(&self) -> Vec<[usize; 3]> {
        const OF_TET: [[usize; 3]; 4] = [[0, 1, 3], [0, 2, 4], [1, 2, 5], [3, 4, 5]];
        let of = |e: usize| {
            let carriers = self.carriers_of(ElementId::new(e));
            OF_TET.map(|edges| edges.map(|k| carriers[k].index()))
        };
        (0..self.element_count()).flat_map(of).collect()
    }

    /// Carriers of all elements.
    pub(crate) fn carriers(&self) -> &Carriers {
        &self.tets
    }

    /// The carrier of an edge, by its ascending vertices.
    ///
    /// # Panics
    /// If there is no such edge.
    pub fn carrier_of_edge(&self, edge: [NodeId; 2]) -> CarrierId {
        let place = self.edges.binary_search(&edge).expect("the edge of an element is an edge of the mesh");
        CarrierId::new(self.first_edge() + place)
    }

    fn carrier_of_face(&self, face: [NodeId; 3]) -> CarrierId {
        let place = self.faces.binary_search(&face).expect("the face of an element is a face of the mesh");
        CarrierId::new(self.first_edge() + self.edges.len() + place)
    }

    fn first_edge(&self) -> usize {
        match self.family {
            ElementFamily::Nodal => self.vertex_count,
            ElementFamily::Edge => 0,
        }
    }

    /// Carriers of a face in the order of its functions: of nodal elements vertices and the edges (0, 1), (1, 2), (2, 0); of
    /// edge elements, with the vertices in ascending order, the edges (0, 1), (0, 2), (1, 2) and the face.
    ///
    /// # Panics
    /// If the triangle is not a face of the mesh.
    pub fn triangle(&self, triangle: [NodeId; 3]) -> Vec<CarrierId> {
        let edges =
            |of: [NodeId; 3], local: [[usize; 2]; 3]| local.map(|e| self.carrier_of_edge(edge(&of, e)));
        let ascending = face_key(triangle);
        let mut carriers = Vec::with_capacity(6);
        match (self.family, self.order) {
            (ElementFamily::Nodal, Order::Linear) => carriers.extend(triangle.map(CarrierId::from)),
            (ElementFamily::Nodal, Order::Quadratic) => {
                carriers.extend(triangle.map(CarrierId::from));
                carriers.extend(edges(triangle, TRIANGLE_EDGES));
            }
            (ElementFamily::Edge, order) => {
                carriers.extend(edges(ascending, ASCENDING_TRIANGLE_EDGES));
                carriers.extend((order == Order::Quadratic).then(|| self.carrier_of_face(ascending)));
            }
        }
        carriers
    }

    /// Where a carrier lies [m]: a vertex, the middle of an edge, the centre of a face.
    #[inline]
    pub fn position(&self, mesh: &Mesh, carrier: CarrierId) -> Point {
        let face = carrier.index().checked_sub(self.first_edge() + self.edges.len());
        if let Some(face) = face {
            return fluxmorph_geometry::tet4::centroid(self.faces[face].map(|n| mesh.point(n)));
        }
        match self.vertices_of(carrier) {
            [a, b] if a == b => mesh.point(a),
            [a, b] => {
                let (x, y) = (mesh.point(a), mesh.point(b));
                std::array::from_fn(|d| 0.5 * (x[d] + y[d]))
            }
        }
    }

    /// Vertices of a carrier: a vertex twice, the two ends of an edge, or the first two vertices of a face, whose edges are
    /// carriers as well.
    #[inline]
    pub fn vertices_of(&self, carrier: CarrierId) -> [NodeId; 2] {
        let Some(edge) = carrier.index().checked_sub(self.first_edge()) else {
            return [NodeId::new(carrier.index()); 2];
        };
        match edge.checked_sub(self.edges.len()) {
            None => self.edges[edge],
            Some(face) => [self.faces[face][0], self.faces[face][1]],
        }
    }

    /// The geometry of an element, as its functions need it.
    #[inline]
    pub fn cell(&self, mesh: &Mesh, e: ElementId) -> Cell {
        let order = self.ascending.get(e.index()).copied().unwrap_or([0, 1, 2, 3]);
        Cell { tet: Tet4::new(mesh.vertices(e)), order }
    }

    /// The coefficients of the gradient of a linear function by its values at the vertices of an element, one a carrier: of edges
    /// those of the Whitney functions, of nodes those of `ψ`.
    pub(crate) fn gradient_coefficients(&self, e: ElementId, values: &[f64; 4]) -> [f64; MOST] {
        let mut coefficients = [0.0; MOST];
        match self.family {
            ElementFamily::Nodal => {
                coefficients[..4].copy_from_slice(values);
                for (k, [i, j]) in EDGES.into_iter().enumerate().filter(|_| self.order == Order::Quadratic) {
                    coefficients[4 + k] = 0.5 * (values[i] + values[j]);
                }
            }
            ElementFamily::Edge => {
                let values = self.ascending[e.index()].map(|place| values[usize::from(place)]);
                for (k, [i, j]) in EDGES.into_iter().enumerate() {
                    coefficients[k] = values[j] - values[i];
                }
            }
        }
        coefficients
    }

    /// Calls back with every function of an element at barycentric coordinates: local carrier, component, value of what it
    /// adds to `A + ∇ψ`, and its curl.
    pub fn functions(&self, cell: &Cell, lambda: &[f64; 4], each: &mut EachFunction<'_>) {
        self.elements().functions(cell, lambda, each);
    }

    /// What the elements make of coefficients.
    pub(crate) fn elements(&self) -> &'static dyn Family {
        family::of(self.family, self.order)
    }
}

/// What some entities of all elements are called, each once, ascending.
fn collect<const K: usize, const V: usize>(
    tets: &[[NodeId; 4]],
    of: impl Fn(&[NodeId; 4]) -> [[NodeId; V]; K] + Sync,
) -> Vec<[NodeId; V]> {
    let mut all: Vec<[NodeId; V]> = tets.par_iter().flat_map_iter(&of).collect();
    all.par_sort_unstable();
    all.dedup();
    all
}

/// `N` carriers of every element.
fn each<const N: usize>(
    tets: &[[NodeId; 4]],
    of: impl Fn(&[NodeId; 4], usize) -> CarrierId + Sync,
) -> Vec<[CarrierId; N]> {
    tets.par_iter().map(|tet| std::array::from_fn(|a| of(tet, a))).collect()
}

fn sorted(tet: &[NodeId; 4]) -> [NodeId; 4] {
    let mut sorted = *tet;
    sorted.sort_unstable();
    sorted
}

/// Place of each vertex in ascending order.
fn ascending(tet: &[NodeId; 4]) -> [u8; 4] {
    let mut places = [0, 1, 2, 3];
    places.sort_unstable_by_key(|&place| tet[usize::from(place)]);
    places
}

/// The vertices of a local edge, ascending.
fn edge<const N: usize>(nodes: &[NodeId; N], [i, j]: [usize; 2]) -> [NodeId; 2] {
    [nodes[i].min(nodes[j]), nodes[i].max(nodes[j])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use fluxmorph_geometry::generate::{BlockParameters, block};

    #[test]
    fn a_block_has_as_many_edges_and_faces_as_eulers_formula_says() {
        let mesh = block(&BlockParameters { cells: [3, 2, 2], ..BlockParameters::default() }).unwrap();
        let topology = mesh.topology();
        // V − E + F − T = 1 for a ball; every tet has four faces, of which the outer ones are counted once.
        let faces = (4 * topology.tets().len() + topology.facets().len()) / 2;
        let edges = topology.node_count() + faces - topology.tets().len() - 1;
        let of = |family| Space::new(topology, family, Order::Quadratic);
        let (nodal, edge) = (of(ElementFamily::Nodal), of(ElementFamily::Edge));
        assert_eq!(nodal.edges().len(), edges);
        assert_eq!(nodal.carrier_count(), topology.node_count() + edges);
        assert_eq!(edge.carrier_count(), edges + faces);
        for space in [nodal, edge] {
            for facet in topology.facets() {
                let carriers = space.triangle(facet.nodes);
                let inside = space.carriers_of(facet.inside);
                assert!(carriers.iter().all(|n| inside.contains(n)), "a face has those of its element");
            }
        }
    }
}
