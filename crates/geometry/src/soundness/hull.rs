//! The outer faces of a mesh, and which of them meet at an edge.

use std::collections::BTreeMap;

use crate::disjoint_sets::DisjointSets;
use crate::ids::NodeId;
use crate::mesh::Mesh;
use crate::tet4::{Point, area_vector, centroid, dot, norm, sub};
use crate::topology::{Facet, around_edges};

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
        Self { mesh, faces: mesh.topology().outer_facets().copied().collect() }
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
    fn edges(&self) -> BTreeMap<[NodeId; 2], Vec<usize>> {
        around_edges(&self.faces.iter().map(|face| face.nodes).collect::<Vec<_>>())
    }

    /// The edges at which two faces meet, and no more.
    pub(super) fn ridges(&self) -> Vec<Ridge> {
        let ridge =
            |(nodes, at): ([NodeId; 2], Vec<usize>)| Some(Ridge { nodes, faces: at.try_into().ok()? });
        self.edges().into_iter().filter_map(ridge).collect()
    }

    /// For every face whether it belongs to the wall of a hole: a closed part of the hull that encloses no element.
    ///
    /// The volume inside such a part, `Σ x·A / 3` over its faces, is negative.
    pub(super) fn walls_of_holes(&self) -> Vec<bool> {
        let mut parts = DisjointSets::new(self.faces.len());
        self.edges().into_values().for_each(|at| parts.join(at));
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
