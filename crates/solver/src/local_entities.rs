//! The elements and surface triangles of one rank of a distributed mesh: those it owns, and the ghosts beside them.

use fluxmorph_geometry::parallel::Ownership;
use fluxmorph_geometry::{ElementId, NodeId, Topology};

/// Elements and triangles of one rank.
#[derive(Debug)]
pub(crate) struct LocalEntities {
    /// Owned and ghost elements, those that touch a node of the rank, ascending: its rows are made of these.
    pub(crate) elements: Vec<ElementId>,
    /// Owned and ghost triangles, by number, ascending.
    pub(crate) triangles: Vec<usize>,
    /// Owned triangles, by number, ascending; every triangle belongs to one rank.
    pub(crate) owned_triangles: Vec<usize>,
}

impl LocalEntities {
    /// Those of this rank.
    pub(crate) fn new(topology: &Topology, triangles: &[[NodeId; 3]], ownership: &Ownership) -> Self {
        let numbered = |is_local: &dyn Fn(&[NodeId; 3]) -> bool| {
            (0..triangles.len()).filter(|&t| is_local(&triangles[t])).collect::<Vec<usize>>()
        };
        Self {
            elements: ownership.partition.touching(topology, ownership.group.rank()),
            triangles: numbered(&|nodes| nodes.iter().any(|&n| ownership.owns(n))),
            owned_triangles: numbered(&|nodes| ownership.owns(nodes[0])),
        }
    }
}
