//! Which nodes and elements of a distributed mesh a rank owns.

use std::sync::Arc;

use super::partition::Partition;
use super::rank_group::RankGroup;
use crate::ids::{ElementId, NodeId};

/// The ranks, and which nodes and elements belong to whom.
#[derive(Clone, Debug)]
pub struct Ownership {
    /// The ranks.
    pub group: RankGroup,
    /// Owners of nodes and elements.
    pub partition: Arc<Partition>,
}

impl Ownership {
    /// Whether this rank owns a node.
    #[inline]
    pub fn owns(&self, node: NodeId) -> bool {
        self.partition.owner_of(node) == self.group.rank()
    }

    /// Those of some elements that this rank owns, in their order.
    pub fn owned_among(&self, elements: &[ElementId]) -> Vec<ElementId> {
        let rank = self.group.rank();
        elements.iter().copied().filter(|&e| self.partition.element_owner(e) == rank).collect()
    }
}
