//! What one rank has of a mesh that is shared out.

use std::sync::Arc;

use crate::ids::{ElementId, NodeId};
use crate::partition::Partition;
use crate::ranks::team::Team;

/// The team, and which nodes and elements belong to whom.
#[derive(Clone, Debug)]
pub struct Share {
    /// The ranks.
    pub team: Team,
    /// Owners of nodes and elements.
    pub partition: Arc<Partition>,
}

impl Share {
    /// Whether this rank owns a node.
    #[inline]
    pub fn owns(&self, node: NodeId) -> bool {
        self.partition.owner_of(node) == self.team.rank()
    }

    /// Those of some elements that this rank owns, in their order.
    pub fn own_among(&self, elements: &[ElementId]) -> Vec<ElementId> {
        let rank = self.team.rank();
        elements.iter().copied().filter(|&e| self.partition.element_owner(e) == rank).collect()
    }
}
