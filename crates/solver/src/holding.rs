//! What a rank holds of the elements and surface triangles of a mesh that is shared out.

use fluxmorph_geometry::ranks::Share;
use fluxmorph_geometry::{ElementId, NodeId, Topology};

/// Elements and triangles of one rank.
#[derive(Debug)]
pub(crate) struct Holding {
    /// Elements that touch a node of the rank, ascending: its rows are made of these.
    pub(crate) elements: Vec<ElementId>,
    /// Triangles that do, by number, ascending.
    pub(crate) triangles: Vec<usize>,
    /// Triangles that belong to the rank, by number, ascending; every triangle belongs to one.
    pub(crate) own_triangles: Vec<usize>,
}

impl Holding {
    /// What the rank of a share holds.
    pub(crate) fn new(topology: &Topology, triangles: &[[NodeId; 3]], share: &Share) -> Self {
        let numbered = |held: &dyn Fn(&[NodeId; 3]) -> bool| {
            (0..triangles.len()).filter(|&t| held(&triangles[t])).collect::<Vec<usize>>()
        };
        Self {
            elements: share.partition.touching(topology, share.team.rank()),
            triangles: numbered(&|nodes| nodes.iter().any(|&n| share.owns(n))),
            own_triangles: numbered(&|nodes| share.owns(nodes[0])),
        }
    }
}
