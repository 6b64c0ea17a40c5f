//! The gauge of edge elements: a spanning tree of the edges on which `A` may be set to zero.
//!
//! Outside conductors a gradient field changes nothing. Its values on the edges of a spanning tree determine it, so those
//! coefficients are left out (Albanese and Rubinacci, IEE Proc. A 135 (1988) 457). Where the tangential `A` is fixed, and in
//! and on conductors, where `A + ∇ψ` is the electric field, nothing may be left out: each connected set of such edges
//! counts as one vertex of the graph. The tree grows breadth first, so that its branches are short; it follows from
//! the topology and does not change while the mesh moves.

use fluxmorph_geometry::NodeId;
use fluxmorph_geometry::disjoint_sets::DisjointSets;
use fluxmorph_geometry::incidence::Incidence;

/// Which edges are branches of the tree.
///
/// `edges` by their vertices below `vertex_count`; `is_kept` says of each whether it may not be left out.
pub(crate) fn tree(vertex_count: usize, edges: &[[NodeId; 2]], is_kept: impl Fn(usize) -> bool) -> Vec<bool> {
    let mut sets = DisjointSets::new(vertex_count);
    for (e, edge) in edges.iter().enumerate() {
        if is_kept(e) {
            sets.join(edge.map(NodeId::index));
        }
    }
    // Ends of every edge in the graph of the sets, and the edges around each set.
    let ends: Vec<[NodeId; 2]> =
        edges.iter().map(|edge| edge.map(|n| NodeId::new(sets.root(n.index())))).collect();
    let incidence = Incidence::new(vertex_count, &ends);
    // The largest set first: the tree grows from it on all sides.
    let mut sizes = vec![0usize; vertex_count];
    (0..vertex_count).for_each(|n| sizes[sets.root(n)] += 1);
    let mut order: Vec<usize> = (0..vertex_count).filter(|&n| sizes[n] > 0).collect();
    order.sort_by_key(|&set| (std::cmp::Reverse(sizes[set]), set));

    let mut is_branch = vec![false; edges.len()];
    let mut reached = vec![false; vertex_count];
    let mut queue = std::collections::VecDeque::new();
    for first in order {
        if std::mem::replace(&mut reached[first], true) {
            continue;
        }
        queue.push_back(first);
        while let Some(set) = queue.pop_front() {
            for e in incidence.around(NodeId::new(set)).iter().map(|e| e.index()) {
                let [a, b] = ends[e].map(NodeId::index);
                let other = if a == set { b } else { a };
                if !std::mem::replace(&mut reached[other], true) {
                    is_branch[e] = true;
                    queue.push_back(other);
                }
            }
        }
    }
    is_branch
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_reaches_every_vertex_once_and_leaves_kept_edges_alone() {
        // A triangle 0 1 2, kept, beside a square 2 3 4 5 with a diagonal.
        let edges = [[0, 1], [1, 2], [0, 2], [2, 3], [3, 4], [4, 5], [2, 5], [3, 5]].map(|e| e.map(NodeId));
        let branch = tree(6, &edges, |e| e < 3);
        assert!(branch[..3].iter().all(|b| !b));
        assert_eq!(branch.iter().filter(|b| **b).count(), 3, "the sets {{0, 1, 2}}, 3, 4, 5");
        // Each vertex is reached: joining the branches and the kept edges leaves one set.
        let mut sets = DisjointSets::new(6);
        for (edge, _) in
            edges.iter().zip(&branch).enumerate().filter(|(e, (_, b))| *e < 3 || **b).map(|x| x.1)
        {
            sets.join(edge.map(NodeId::index));
        }
        assert!((0..6).all(|n| sets.root(n) == 0));
    }
}
