//! The fictitious nodal force `f` of Eq. 1 to 3.
//!
//! Every node of a subregion carries the subregion's force vector, as it is (no weight by volume); a node shared by
//! several subregions carries the mean of theirs. Only the components that are unknown are used: `f_b` does not enter
//! Eq. 3.

use fluxmorph_geometry::{NodeId, Topology};

use crate::freedom::Freedom;
use crate::subregion::Subregion;

/// The force vector `f_d` [N] of Eq. 3, one entry per unknown; `None` when every subregion's force is zero.
pub(crate) fn nodal_force(
    topology: &Topology,
    subregions: &[Subregion],
    unknowns: &Freedom,
) -> Option<Vec<f64>> {
    if subregions.iter().all(|s| s.force == [0.0; 3]) {
        return None;
    }
    let mut sum = vec![[0.0; 3]; topology.node_count()];
    let mut count = vec![0u32; topology.node_count()];
    let mut last_seen = vec![usize::MAX; topology.node_count()];
    for (s, subregion) in subregions.iter().enumerate() {
        for node in subregion.elements.iter().flat_map(|&e| topology.tet(e)) {
            let i = node.index();
            if last_seen[i] != s {
                last_seen[i] = s;
                count[i] += 1;
                for d in 0..3 {
                    sum[i][d] += subregion.force[d];
                }
            }
        }
    }
    let mut force = vec![0.0; unknowns.dofs().count()];
    for (i, (sum, &count)) in sum.iter().zip(&count).enumerate().filter(|(_, (_, count))| **count > 0) {
        unknowns.scatter_add(&mut force, NodeId::new(i), sum.map(|f| f / f64::from(count)));
    }
    Some(force)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use fluxmorph_geometry::fem::DofMap;

    use super::*;
    use fluxmorph_geometry::{ElementId, RegionId};

    #[test]
    fn a_shared_node_carries_the_mean_and_known_components_nothing() {
        let tets = vec![[0, 1, 2, 3].map(NodeId), [4, 1, 3, 2].map(NodeId)];
        let topology = Topology::new(5, tets, vec!["all".into()], vec![RegionId(0); 2]).expect("two tets");
        let part = |e, z| Subregion { force: [0.0, 0.0, z], ..Subregion::new("part", vec![ElementId(e)]) };
        let dofs = DofMap::of_nodes(5, |node, c| c == 2 && node != NodeId(3));
        let unknowns = Freedom::new(dofs, BTreeMap::new());
        let force = nodal_force(&topology, &[part(0, 1.0), part(1, 3.0)], &unknowns);
        assert_eq!(force, Some(vec![1.0, 2.0, 2.0, 3.0]));
        assert_eq!(nodal_force(&topology, &[part(0, 0.0)], &unknowns), None);
    }
}
