//! Figures of a partition: how even it is, what it cuts, and which conductors are whole.

use super::sets::ConnectedSets;
use super::{Partition, node_weight};
use crate::ids::{ElementId, NodeId};
use crate::topology::Topology;

/// What one rank has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RankShare {
    /// Nodes that it owns.
    pub nodes: usize,
    /// Their weight, as [`Partition::new`] counts it [1].
    pub weight: u64,
    /// Elements that it owns.
    pub elements: usize,
    /// Elements with a node of its own: those that it computes.
    pub touching: usize,
}

/// How a conductor, a connected set of the kept elements, is distributed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConductorShare {
    /// Its first node.
    pub first: NodeId,
    /// Its nodes.
    pub nodes: usize,
    /// Ranks that own some of them.
    pub ranks: usize,
}

impl ConductorShare {
    /// Whether one rank owns it all.
    pub fn is_whole(&self) -> bool {
        self.ranks == 1
    }
}

/// Figures of a partition.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartitionReport {
    /// What every rank has.
    pub ranks: Vec<RankShare>,
    /// Edges of the mesh between nodes of different ranks.
    pub edge_cut: usize,
    /// Every conductor, in the order of their first nodes.
    pub conductors: Vec<ConductorShare>,
}

impl PartitionReport {
    pub(super) fn new(
        partition: &Partition,
        topology: &Topology,
        weights: &[u32],
        kept: &[ElementId],
    ) -> Self {
        let ranks = (0..partition.ranks()).map(|rank| {
            let nodes = partition.nodes_of(rank);
            RankShare {
                nodes: nodes.len(),
                weight: nodes.iter().map(|n| node_weight(weights[n.index()])).sum(),
                elements: partition.elements_of(rank).len(),
                touching: partition.touching(topology, rank).len(),
            }
        });
        let conductors = ConnectedSets::new(topology, kept).nodes.into_iter().map(|nodes| {
            let mut owners: Vec<usize> = nodes.iter().map(|&n| partition.owner_of(n)).collect();
            owners.sort_unstable();
            owners.dedup();
            ConductorShare { first: nodes[0], nodes: nodes.len(), ranks: owners.len() }
        });
        let mut above: Vec<NodeId> = Vec::new();
        let mut edge_cut = 0;
        for node in topology.nodes() {
            above.clear();
            let around = topology.elements_around(node).iter().flat_map(|&e| topology.tet(e));
            above.extend(around.filter(|&other| other > node));
            above.sort_unstable();
            above.dedup();
            let owner = partition.owner_of(node);
            edge_cut += above.iter().filter(|&&other| partition.owner_of(other) != owner).count();
        }
        Self { ranks: ranks.collect(), edge_cut, conductors: conductors.collect() }
    }

    /// The largest weight of a rank by the mean: 1 is even.
    pub fn imbalance(&self) -> f64 {
        let total: u64 = self.ranks.iter().map(|share| share.weight).sum();
        let largest = self.ranks.iter().map(|share| share.weight).max().unwrap_or(0);
        if total == 0 { 1.0 } else { largest as f64 * self.ranks.len() as f64 / total as f64 }
    }
}
