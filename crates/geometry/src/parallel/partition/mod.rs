//! Which rank owns each node and element of a mesh, when several processes share the work.
//!
//! Every rank holds the whole mesh and owns a part of its nodes, with the unknowns there, and of its elements, as output has
//! each once. METIS cuts the graph of the nodes (k-way, G. Karypis and V. Kumar, SIAM J. Sci. Comput. 20, 1998) into parts
//! of the same weight with few edges between them. Conductors stay together: a small one is a single vertex of that graph
//! and cannot be cut, and the edges of a large one weigh more than others. Where there is no METIS, or it refuses, a rank
//! gets a range of the nodes in their order.
//!
//! Lives here: who owns what. Does not live here: how ranks talk.

mod graph;
mod sets;

use crate::error::MeshError;
use crate::ids::{ElementId, NodeId};
use crate::mesh::Mesh;
use crate::tet4::{EDGES, dot, sub};
use crate::topology::Topology;
use fluxmorph_petsc::metis;
use graph::{Graph, Strength};

/// Vertices a rank from which METIS is asked: on smaller graphs it leaves parts empty, and prints a warning.
const FEWEST_VERTICES: usize = 16;

/// Most that an edge weighs by its length [1]: the sum over all edges must stay within 32 bits for METIS.
const STRONGEST: f64 = 100.0;

/// Which rank owns each node and element; the same for the same mesh, weights and number of ranks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Partition {
    owners: Vec<u32>,
    element_owners: Vec<u32>,
    nodes: Vec<Vec<NodeId>>,
    elements: Vec<Vec<ElementId>>,
}

impl Partition {
    /// Distributes a mesh over `ranks` ranks, each of which gets about the same weight, and at least one node.
    ///
    /// `weights` are the unknowns of every node [1], shape `(n_nodes,)`; a node without any counts as one unknown, since
    /// the elements around it are computed all the same. `kept` are the elements of all conductors: a connected set of
    /// them that weighs at most half of a rank's share has one owner, and larger ones are cut where they are thin.
    ///
    /// # Errors
    /// [`MeshError::Ranks`] for no rank or more ranks than nodes, [`MeshError::ArrayLength`] unless there is one weight a
    /// node.
    ///
    /// # Panics
    /// If a kept element does not exist.
    pub fn new(
        topology: &Topology,
        ranks: usize,
        weights: &[u32],
        kept: &[ElementId],
    ) -> Result<Self, MeshError> {
        Self::cut_by(topology, ranks, weights, kept, &|_, _| 1)
    }

    /// As [`Partition::new`] for a mesh: short edges of flat elements, which couple their nodes more strongly than others, are
    /// cut last.
    ///
    /// An edge weighs as much as the square of its length goes into that of the longest one at its ends: so much stronger
    /// is its entry in the matrix of a Laplacian. At most a hundred times as much as another.
    ///
    /// # Errors
    /// As [`Partition::new`].
    ///
    /// # Panics
    /// If a kept element does not exist.
    pub fn of_mesh(
        mesh: &Mesh,
        ranks: usize,
        weights: &[u32],
        kept: &[ElementId],
    ) -> Result<Self, MeshError> {
        let square = |a: NodeId, b: NodeId| {
            let d = sub(mesh.point(a), mesh.point(b));
            dot(d, d)
        };
        let mut longest = vec![0.0_f64; mesh.points().len()];
        for tet in mesh.topology().tets() {
            for [i, j] in EDGES {
                let length = square(tet[i], tet[j]);
                for n in [tet[i], tet[j]] {
                    longest[n.index()] = longest[n.index()].max(length);
                }
            }
        }
        let strength = |a: NodeId, b: NodeId| {
            let ratio = longest[a.index()].max(longest[b.index()]) / square(a, b);
            ratio.clamp(1.0, STRONGEST) as u32
        };
        Self::cut_by(mesh.topology(), ranks, weights, kept, &strength)
    }

    fn cut_by(
        topology: &Topology,
        ranks: usize,
        weights: &[u32],
        kept: &[ElementId],
        strength: &Strength<'_>,
    ) -> Result<Self, MeshError> {
        let nodes = topology.node_count();
        if ranks == 0 || ranks > nodes {
            return Err(MeshError::Ranks { ranks, nodes });
        }
        if weights.len() != nodes {
            let array = "weights".to_owned();
            return Err(MeshError::ArrayLength { array, length: weights.len(), expected: nodes });
        }
        if ranks == 1 {
            return Ok(Self::of_owners(topology, ranks, vec![0; nodes]));
        }
        let weights: Vec<u64> = weights.iter().map(|&w| u64::from(w.max(1))).collect();
        let graph = Graph::new(topology, ranks, &weights, kept, strength);
        let part = cut(&graph, ranks).unwrap_or_else(|| ranges(&graph.weights, ranks));
        let mut owners: Vec<u32> = graph.vertex_of.iter().map(|&v| part[v as usize]).collect();
        fill_empty(&graph, ranks, &mut owners);
        Ok(Self::of_owners(topology, ranks, owners))
    }

    fn of_owners(topology: &Topology, ranks: usize, owners: Vec<u32>) -> Self {
        let owner_of_element = |tet: &[NodeId; 4]| {
            let owners = tet.map(|n| owners[n.index()]);
            let votes = |rank: u32| owners.iter().filter(|&&o| o == rank).count();
            owners.into_iter().max_by_key(|&rank| (votes(rank), std::cmp::Reverse(rank))).unwrap_or(0)
        };
        let element_owners: Vec<u32> = topology.tets().iter().map(owner_of_element).collect();
        let mut nodes = vec![Vec::new(); ranks];
        topology.nodes().for_each(|n| nodes[owners[n.index()] as usize].push(n));
        let mut elements = vec![Vec::new(); ranks];
        topology.elements().for_each(|e| elements[element_owners[e.index()] as usize].push(e));
        Self { owners, element_owners, nodes, elements }
    }

    /// Number of ranks.
    pub fn ranks(&self) -> usize {
        self.nodes.len()
    }

    /// The rank that owns a node.
    #[inline]
    pub fn owner_of(&self, node: NodeId) -> usize {
        self.owners[node.index()] as usize
    }

    /// The rank that owns an element: the one with most of its nodes, of several the lowest.
    #[inline]
    pub fn element_owner(&self, element: ElementId) -> usize {
        self.element_owners[element.index()] as usize
    }

    /// The nodes that a rank owns, ascending; at least one.
    ///
    /// # Panics
    /// If there is no such rank.
    pub fn nodes_of(&self, rank: usize) -> &[NodeId] {
        &self.nodes[rank]
    }

    /// The elements that a rank owns, ascending; there may be none.
    ///
    /// # Panics
    /// If there is no such rank.
    pub fn elements_of(&self, rank: usize) -> &[ElementId] {
        &self.elements[rank]
    }

    /// The elements with a node that a rank owns, ascending: those that add to its equations.
    pub fn touching(&self, topology: &Topology, rank: usize) -> Vec<ElementId> {
        let touches = |e: &ElementId| topology.tet(*e).iter().any(|&n| self.owner_of(n) == rank);
        topology.elements().filter(touches).collect()
    }
}

/// METIS's parts of the graph; `None` where it is too small or too heavy for it.
fn cut(graph: &Graph, ranks: usize) -> Option<Vec<u32>> {
    let total: u64 = graph.weights.iter().sum();
    if graph.nodes.len() / ranks < FEWEST_VERTICES || i32::try_from(total).is_err() {
        return None;
    }
    let weights = graph.weights.iter().map(|&w| i32::try_from(w).ok()).collect::<Option<_>>()?;
    let edge_weights = graph.edge_weights.iter().map(|&w| i32::try_from(w).ok()).collect::<Option<_>>()?;
    let structure = &graph.structure;
    metis::partition((&structure.row_starts, &structure.columns), ranks, weights, edge_weights)
}

/// Ranges of the vertices in their order, of about the same weight: a vertex goes where its middle lies.
fn ranges(weights: &[u64], ranks: usize) -> Vec<u32> {
    let twice_total = 2 * weights.iter().map(|&w| u128::from(w)).sum::<u128>();
    let mut before = 0u128;
    let rank_of = |&weight: &u64| {
        let twice_middle = 2 * before + u128::from(weight);
        before += u128::from(weight);
        // The middle of a vertex with a weight lies below the total, so that the rank is one of them.
        (twice_middle * ranks as u128 / twice_total) as u32
    };
    weights.iter().map(rank_of).collect()
}

/// Gives every rank without a node the last one of the rank with most nodes; no small conductor is cut while there are others.
fn fill_empty(graph: &Graph, ranks: usize, owners: &mut [u32]) {
    let mut counts = vec![0usize; ranks];
    owners.iter().for_each(|&owner| counts[owner as usize] += 1);
    while let Some(empty) = counts.iter().position(|&count| count == 0) {
        let donor = (0..ranks).fold(0, |most, rank| if counts[rank] > counts[most] { rank } else { most });
        let owned = |node: &usize| owners[*node] as usize == donor;
        let is_alone = |node: &usize| graph.nodes[graph.vertex_of[*node] as usize].len() == 1;
        let last = (0..owners.len()).rev().find(|n| owned(n) && is_alone(n));
        let Some(node) = last.or_else(|| (0..owners.len()).rev().find(owned)) else { return };
        owners[node] = empty as u32;
        counts[donor] -= 1;
        counts[empty] += 1;
    }
}

#[cfg(test)]
mod tests;
