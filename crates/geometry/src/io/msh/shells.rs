//! Surfaces that share triangles, cut into shells that lie in one set of surfaces each.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, HashMap};

use crate::error::MeshError;
use crate::ids::NodeId;
use crate::mesh::Mesh;
use crate::topology::same_turn;

/// Triangles that lie in the same surfaces.
pub(super) struct Shell {
    /// Physical tags, negative where the surface sees the triangles turned around.
    pub(super) tags: Vec<i32>,
    /// Element tag and nodes.
    pub(super) triangles: Vec<(u64, [NodeId; 3])>,
}

/// Partitions the triangles of all surfaces by the set of surfaces that they lie in.
///
/// Element tags count the triangles in an order that every surface agrees with. Surfaces that put shared triangles into
/// contradicting orders get those of the contradiction in the order of the first.
pub(super) fn shells(mesh: &Mesh, surfaces: &[&str]) -> Result<Vec<Shell>, MeshError> {
    let mut triangles: Vec<([NodeId; 3], Vec<i32>)> = Vec::new();
    let mut known: HashMap<[NodeId; 3], usize> = HashMap::new();
    let mut chains: Vec<Vec<usize>> = Vec::new();
    for (tag, name) in (1..).zip(surfaces) {
        let mut chain = Vec::new();
        for &nodes in mesh.topology().surface(name)? {
            let mut key = nodes;
            key.sort_unstable();
            let index = *known.entry(key).or_insert_with(|| {
                triangles.push((nodes, Vec::new()));
                triangles.len() - 1
            });
            let (first, tags) = &mut triangles[index];
            if tags.last().is_none_or(|last: &i32| last.abs() != tag) {
                tags.push(if same_turn(*first, nodes) { tag } else { -tag });
                chain.push(index);
            }
        }
        chains.push(chain);
    }
    let mut shells: BTreeMap<Vec<i32>, Vec<(u64, [NodeId; 3])>> = BTreeMap::new();
    for (tag, index) in (1..).zip(common_order(triangles.len(), &chains)) {
        let (nodes, tags) = &triangles[index];
        shells.entry(tags.clone()).or_default().push((tag, *nodes));
    }
    Ok(shells.into_iter().map(|(tags, triangles)| Shell { tags, triangles }).collect())
}

/// An order of `count` things that keeps every chain, the smallest number first where chains leave a choice.
fn common_order(count: usize, chains: &[Vec<usize>]) -> Vec<usize> {
    let mut waits_for = vec![0usize; count];
    let mut followers: Vec<Vec<usize>> = vec![Vec::new(); count];
    for pair in chains.iter().flat_map(|chain| chain.windows(2)) {
        followers[pair[0]].push(pair[1]);
        waits_for[pair[1]] += 1;
    }
    let mut ready: BinaryHeap<_> = (0..count).filter(|&i| waits_for[i] == 0).map(Reverse).collect();
    let mut order = Vec::with_capacity(count);
    while let Some(Reverse(next)) = ready.pop() {
        order.push(next);
        for &follower in &followers[next] {
            waits_for[follower] -= 1;
            if waits_for[follower] == 0 {
                ready.push(Reverse(follower));
            }
        }
    }
    // What still waits is part of a contradiction, or behind one.
    order.extend((0..count).filter(|&i| waits_for[i] > 0));
    order
}

#[cfg(test)]
mod tests {
    use super::common_order;

    #[test]
    fn a_common_order_keeps_every_chain_and_survives_contradictions() {
        assert_eq!(common_order(5, &[vec![3, 1, 4], vec![2, 1, 0]]), [2, 3, 1, 0, 4]);
        assert_eq!(common_order(3, &[vec![0, 1], vec![1, 0]]), [2, 0, 1]);
    }
}
