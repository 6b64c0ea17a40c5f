//! The boundary edges of the design surface: which are free, and which lie on a symmetry plane, where only the model ends.

use std::collections::BTreeSet;

use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::topology::{rim_edges, triangle_edges};
use fluxmorph_geometry::{Mesh, NodeId};

use super::symmetry_planes::SymmetryPlanes;

type Edge = [NodeId; 2];

/// Edges of the design surface that belong to one of its triangles only.
pub(super) struct BoundaryEdges {
    /// Nodes of those on no cut.
    free: BTreeSet<NodeId>,
    /// Those on a cut.
    cut: BTreeSet<Edge>,
}

impl BoundaryEdges {
    /// The boundary edges of `triangles`; `cuts` are the faces where the model ends.
    pub(super) fn new(triangles: &[[NodeId; 3]], cuts: &[[NodeId; 3]]) -> Self {
        let boundary = rim_edges(triangles);
        let cut: BTreeSet<Edge> =
            cuts.iter().flat_map(|t| triangle_edges(*t)).filter(|edge| boundary.contains(edge)).collect();
        let free = boundary.difference(&cut).flatten().copied().collect();
        Self { free, cut }
    }

    /// Whether a node is on a boundary edge that is not on a symmetry plane.
    pub(super) fn is_on_free_edge(&self, node: NodeId) -> bool {
        self.free.contains(&node)
    }

    /// The planes that cut the surface with nodes at these places.
    pub(super) fn symmetry_planes(
        &self,
        mesh: &Mesh,
        cuts: &[[NodeId; 3]],
        places: &[Point],
    ) -> SymmetryPlanes {
        let inside = std::array::from_fn(|d| places.iter().map(|x| x[d]).sum::<f64>() / places.len() as f64);
        let touches = |t: &&[NodeId; 3]| triangle_edges(**t).iter().any(|edge| self.cut.contains(edge));
        SymmetryPlanes::new(mesh, cuts.iter().filter(touches), inside)
    }
}
