//! The boundary edges of the design surface: which are free, and which lie on a symmetry plane, where only the model ends.

use std::collections::{BTreeMap, BTreeSet};

use fluxmorph_geometry::tet4::{Point, area_vector, centroid, norm, sub};
use fluxmorph_geometry::topology::triangle_edges;
use fluxmorph_geometry::{Mesh, NodeId};

use super::symmetry_planes::{Askew, SymmetryPlanes};
use super::{Mirror, dominant_axis};

/// Largest component of a unit normal across its axis for a symmetry plane: coordinates in files carry 6 or more digits.
const PLANE_TOLERANCE: f64 = 1e-6;

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
        let mut count: BTreeMap<Edge, usize> = BTreeMap::new();
        for edge in triangles.iter().flat_map(|t| triangle_edges(*t)) {
            *count.entry(edge).or_default() += 1;
        }
        let boundary: BTreeSet<Edge> =
            count.into_iter().filter(|&(_, n)| n == 1).map(|(edge, _)| edge).collect();
        let cut: BTreeSet<Edge> =
            cuts.iter().flat_map(|t| triangle_edges(*t)).filter(|edge| boundary.contains(edge)).collect();
        let free = boundary.difference(&cut).flatten().copied().collect();
        Self { free, cut }
    }

    /// Whether a node is on a boundary edge that is not on a symmetry plane.
    pub(super) fn is_on_free_edge(&self, node: NodeId) -> bool {
        self.free.contains(&node)
    }

    /// The planes that cut the surface, each once; a point of the surface says on which side it is.
    pub(super) fn symmetry_planes(&self, mesh: &Mesh, cuts: &[[NodeId; 3]], inside: Point) -> SymmetryPlanes {
        let [lower, upper] = mesh.bounding_box();
        let mut planes = SymmetryPlanes::default();
        for triangle in cuts.iter().filter(|t| triangle_edges(**t).iter().any(|edge| self.cut.contains(edge)))
        {
            let vertices = triangle.map(|n| mesh.point(n));
            let area = area_vector(vertices);
            let axis = dominant_axis(area);
            if (0..3).any(|d| d != axis && area[d].abs() > PLANE_TOLERANCE * norm(area)) {
                let normal = area.map(|c| c / norm(area));
                planes.add_askew(Askew::new(normal, centroid(vertices), inside), norm(sub(upper, lower)));
            } else {
                let at = centroid(vertices)[axis];
                planes.add_aligned(Mirror { axis, at }, PLANE_TOLERANCE * (upper[axis] - lower[axis]));
            }
        }
        planes.settled(inside)
    }
}
