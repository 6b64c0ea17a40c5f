//! The graph that is cut: a vertex for every node, or for all nodes of a small conductor; an edge for the edges of the mesh.

use rayon::prelude::*;

use super::sets::ConnectedSets;
use crate::fem::csr::CsrStructure;
use crate::ids::{ElementId, NodeId};
use crate::topology::Topology;

/// What an edge of a conductor that is a graph of its own weighs; other edges weigh 1. The cut goes a long way round before it
/// goes through ten edges for one.
const KEPT_EDGE: u32 = 10;

/// A conductor is one vertex if it weighs at most this share of what a rank gets: what is left is enough to balance with.
const LARGEST_VERTEX: f64 = 0.5;

/// How strongly two joined nodes hold together [1]; at least 1, and the same both ways.
pub(super) type Strength<'a> = dyn Fn(NodeId, NodeId) -> u32 + Sync + 'a;

/// Vertices with their weights, and how they are joined.
pub(super) struct Graph {
    /// Vertex of every node.
    pub(super) vertex_of: Vec<u32>,
    /// Nodes of every vertex, ascending; the vertices are in the order of their first nodes.
    pub(super) nodes: Vec<Vec<NodeId>>,
    /// Weight of every vertex.
    pub(super) weights: Vec<u64>,
    /// Which vertices are joined; symmetric, without diagonal.
    pub(super) structure: CsrStructure,
    /// Weight of every stored entry of `structure`.
    pub(super) edge_weights: Vec<u32>,
}

impl Graph {
    /// The graph for so many ranks; `weights` [1] of every node, `kept` the elements of all conductors, `strength` [1] of every
    /// edge.
    pub(super) fn new(
        topology: &Topology,
        ranks: usize,
        weights: &[u64],
        kept: &[ElementId],
        strength: &Strength<'_>,
    ) -> Self {
        let sets = ConnectedSets::new(topology, kept);
        let share = weights.iter().sum::<u64>() as f64 / ranks as f64;
        let weight = |nodes: &[NodeId]| nodes.iter().map(|n| weights[n.index()]).sum::<u64>();
        let collapsed = sets.nodes.into_iter().filter(|set| weight(set) as f64 <= LARGEST_VERTEX * share);
        let mut first_of: Vec<Option<Vec<NodeId>>> = vec![None; topology.node_count()];
        let mut is_follower = vec![false; topology.node_count()];
        for set in collapsed {
            set[1..].iter().for_each(|n| is_follower[n.index()] = true);
            let first = set[0].index();
            first_of[first] = Some(set);
        }
        let mut vertex_of = vec![0u32; topology.node_count()];
        let mut nodes: Vec<Vec<NodeId>> = Vec::new();
        for node in topology.nodes().filter(|n| !is_follower[n.index()]) {
            let own = first_of[node.index()].take().unwrap_or_else(|| vec![node]);
            own.iter().for_each(|n| vertex_of[n.index()] = nodes.len() as u32);
            nodes.push(own);
        }
        let mut is_kept = vec![false; topology.tets().len()];
        kept.iter().for_each(|e| is_kept[e.index()] = true);
        let rows: Vec<Vec<(u32, u32)>> =
            nodes.par_iter().map(|own| row(topology, &vertex_of, &is_kept, own, strength)).collect();
        let mut row_starts = vec![0u32];
        let (mut columns, mut edge_weights) = (Vec::new(), Vec::new());
        for row in &rows {
            columns.extend(row.iter().map(|&(vertex, _)| vertex));
            edge_weights.extend(row.iter().map(|&(_, weight)| weight));
            row_starts.push(columns.len() as u32);
        }
        let weights = nodes.iter().map(|own| weight(own)).collect();
        let structure = CsrStructure { column_count: nodes.len(), row_starts, columns };
        Self { vertex_of, nodes, weights, structure, edge_weights }
    }
}

/// The vertices joined with that of some nodes, ascending, and the weight of what joins them.
fn row(
    topology: &Topology,
    vertex_of: &[u32],
    is_kept: &[bool],
    nodes: &[NodeId],
    strength: &Strength<'_>,
) -> Vec<(u32, u32)> {
    let own = vertex_of[nodes[0].index()];
    let mut row: Vec<(u32, u32)> = Vec::new();
    let mut around: Vec<(NodeId, u32)> = Vec::new();
    for &node in nodes {
        around.clear();
        for &e in topology.elements_around(node) {
            let weight = if is_kept[e.index()] { KEPT_EDGE } else { 1 };
            around.extend(topology.tet(e).map(|other| (other, weight)));
        }
        around.sort_unstable();
        // The heavier of equal edges comes last.
        for same in around.chunk_by(|a, b| a.0 == b.0) {
            let (other, weight) = same[same.len() - 1];
            let vertex = vertex_of[other.index()];
            if vertex != own {
                row.push((vertex, weight * strength(node, other)));
            }
        }
    }
    row.sort_unstable();
    row.chunk_by(|a, b| a.0 == b.0).map(|same| (same[0].0, same.iter().map(|edge| edge.1).sum())).collect()
}
