//! The outer faces of a mesh, and which of them meet at an edge.

use crate::disjoint_sets::DisjointSets;
use crate::ids::NodeId;
use crate::mesh::Mesh;
use crate::tet4::{Point, area_vector, centroid, dot, norm, sub};
use crate::topology::{Facet, triangle_edges};

/// Two outer faces and the edge that they, and no others, have in common.
pub(super) struct Ridge {
    pub(super) nodes: [NodeId; 2],
    /// Places in [`Hull::faces`].
    pub(super) faces: [usize; 2],
}

/// The outer faces of a mesh.
pub struct Hull<'m> {
    mesh: &'m Mesh,
    faces: Vec<Facet>,
}

impl<'m> Hull<'m> {
    /// The hull of a mesh.
    pub fn new(mesh: &'m Mesh) -> Self {
        let outer = mesh.topology().facets().iter().filter(|f| f.outside.is_none());
        Self { mesh, faces: outer.copied().collect() }
    }

    /// The mesh.
    pub fn mesh(&self) -> &'m Mesh {
        self.mesh
    }

    /// Its outer faces, in the order of [`crate::Topology::facets`].
    pub fn faces(&self) -> &[Facet] {
        &self.faces
    }

    /// The corners of a face [m].
    pub fn corners(&self, face: usize) -> [Point; 3] {
        self.faces[face].nodes.map(|n| self.mesh.point(n))
    }

    /// Area of a face [m²].
    pub(super) fn area(&self, face: usize) -> f64 {
        norm(area_vector(self.corners(face)))
    }

    /// Unit normal of a face, out of the mesh.
    pub(super) fn normal(&self, face: usize) -> Point {
        let area = area_vector(self.corners(face));
        let length = norm(area);
        area.map(|c| c / length)
    }

    /// The edges of all faces with the faces at each.
    fn edges(&self) -> Vec<([NodeId; 2], usize)> {
        let of = |(face, facet): (usize, &Facet)| triangle_edges(facet.nodes).map(|edge| (edge, face));
        let mut edges: Vec<_> = self.faces.iter().enumerate().flat_map(of).collect();
        edges.sort_unstable();
        edges
    }

    /// The edges at which two faces meet, and no more.
    pub(super) fn ridges(&self) -> Vec<Ridge> {
        let edges = self.edges();
        let at = |group: &[([NodeId; 2], usize)]| match *group {
            [(nodes, first), (_, second)] => Some(Ridge { nodes, faces: [first, second] }),
            _ => None,
        };
        edges.chunk_by(|a, b| a.0 == b.0).filter_map(at).collect()
    }

    /// For every face whether it belongs to the wall of a hole: a closed part of the hull that encloses no element.
    ///
    /// The volume inside such a part, `Σ x·A / 3` over its faces, is negative.
    pub(super) fn walls_of_holes(&self) -> Vec<bool> {
        let mut parts = DisjointSets::new(self.faces.len());
        for group in self.edges().chunk_by(|a, b| a.0 == b.0) {
            parts.join(group.iter().map(|&(_, face)| face));
        }
        let mut volumes = vec![0.0; self.faces.len()];
        for face in 0..self.faces.len() {
            let root = parts.root(face);
            let corners = self.corners(face);
            // From a corner of the part's own: small parts far from the origin keep their digits.
            let from = self.corners(root)[0];
            volumes[root] += dot(sub(centroid(corners), from), area_vector(corners)) / 3.0;
        }
        (0..self.faces.len()).map(|face| volumes[parts.root(face)] < 0.0).collect()
    }
}
