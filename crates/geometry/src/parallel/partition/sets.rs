//! The connected sets of some elements: what one conductor is.

use crate::disjoint_sets::DisjointSets;
use crate::ids::{ElementId, NodeId};
use crate::topology::Topology;

/// Connected sets of elements, by their nodes; elements that share a node are connected.
pub(super) struct ConnectedSets {
    /// Nodes of every set, ascending; the sets are in the order of their first nodes.
    pub(super) nodes: Vec<Vec<NodeId>>,
}

impl ConnectedSets {
    /// The sets of the given elements, in any order of theirs.
    pub(super) fn new(topology: &Topology, elements: &[ElementId]) -> Self {
        let mut sets = DisjointSets::new(topology.node_count());
        let is_in = topology.is_node_of(elements.iter().copied());
        elements.iter().for_each(|&e| sets.join(topology.tet(e).map(NodeId::index)));
        let mut nodes: Vec<Vec<NodeId>> = Vec::new();
        let mut set_of_root = vec![0usize; topology.node_count()];
        for node in topology.nodes().filter(|n| is_in[n.index()]) {
            // The first node of a set that is met.
            let root = sets.root(node.index());
            if root == node.index() {
                set_of_root[root] = nodes.len();
                nodes.push(Vec::new());
            }
            nodes[set_of_root[root]].push(node);
        }
        Self { nodes }
    }
}
