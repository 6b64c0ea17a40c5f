//! The connected sets of some elements: what one conductor is.

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
        let mut parent: Vec<u32> = (0..topology.node_count() as u32).collect();
        let mut is_in = vec![false; topology.node_count()];
        for &e in elements {
            let tet = topology.tet(e);
            tet.iter().for_each(|n| is_in[n.index()] = true);
            for other in &tet[1..] {
                let (a, b) = (root(&mut parent, tet[0].0), root(&mut parent, other.0));
                // The smaller node stays root: the first one of a set that is met below.
                parent[a.max(b) as usize] = a.min(b);
            }
        }
        let mut nodes: Vec<Vec<NodeId>> = Vec::new();
        let mut set_of_root = vec![0usize; topology.node_count()];
        for node in topology.nodes().filter(|n| is_in[n.index()]) {
            let root = root(&mut parent, node.0);
            if root == node.0 {
                set_of_root[node.index()] = nodes.len();
                nodes.push(Vec::new());
            }
            nodes[set_of_root[root as usize]].push(node);
        }
        Self { nodes }
    }
}

/// The representative of a node's set, with path halving.
fn root(parent: &mut [u32], mut node: u32) -> u32 {
    while parent[node as usize] != node {
        let grandparent = parent[parent[node as usize] as usize];
        parent[node as usize] = grandparent;
        node = grandparent;
    }
    node
}
