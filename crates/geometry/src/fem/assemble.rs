//! Assembly by owner-computes: every task owns a range of nodes, visits all elements that touch them and writes only
//! the rows of its own nodes.
//!
//! Elements on a border between tasks are computed twice; nothing is locked, and every entry is summed in ascending
//! element order: the bits do not depend on the tasks or the threads.

use rayon::prelude::*;

use crate::fem::pattern::{BlockPattern, BoundGroup};
use crate::fem::scalar::Scalar;
use crate::ids::ElementId;

/// The matrix of one element with `N` nodes and `C` components a node, given block by block.
pub trait LocalMatrix<T, const N: usize, const C: usize> {
    /// Entries of local node `a` (rows) against local node `b` (columns).
    fn block(&self, a: usize, b: usize) -> [[T; C]; C];
}

impl<const C: usize> BlockPattern<C> {
    /// Adds the element matrices of a group to `values` (the entries of a matrix with this pattern's structure).
    ///
    /// # Panics
    /// If `values` has another length than the pattern has entries.
    pub fn assemble<T, L, const N: usize>(
        &self,
        group: &BoundGroup<N>,
        values: &mut [T],
        element_matrix: impl Fn(ElementId) -> L + Sync,
    ) where
        T: Scalar,
        L: LocalMatrix<T, N, C>,
    {
        assert_eq!(values.len(), self.structure().columns.len(), "one value an entry");
        let mut rest = values;
        let mut tasks = Vec::with_capacity(self.tasks.len());
        for (nodes, elements) in self.tasks.iter().zip(&group.elements) {
            let entries = self.entries_of(nodes);
            let (own, others) = rest.split_at_mut(entries.len());
            rest = others;
            tasks.push((nodes, elements, own, entries.start));
        }
        tasks.into_par_iter().for_each(|(nodes, elements, own, first)| {
            for &e in elements {
                let local = element_matrix(e);
                let connectivity = &group.connectivity[e.index()];
                for (a, &node) in connectivity.iter().enumerate() {
                    if !nodes.contains(&node.index()) {
                        continue;
                    }
                    for (b, &position) in group.blocks[e.index()][a].iter().enumerate() {
                        self.add_block(node, position, &local.block(a, b), own, first);
                    }
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::fem::csr::CsrMatrix;
    use crate::fem::dofs::DofMap;
    use crate::fem::pattern::{Coupling, ElementGroup};
    use crate::ids::NodeId;

    /// Block entries that depend on element, nodes and components, so that every mix-up shows.
    struct Marked(usize);

    impl LocalMatrix<f64, 4, 3> for Marked {
        fn block(&self, a: usize, b: usize) -> [[f64; 3]; 3] {
            std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    (1 + self.0) as f64 + 0.1 * (a + 4 * b) as f64 + 7.0 * (i + 3 * j) as f64
                })
            })
        }
    }

    #[test]
    fn assembly_equals_a_sum_of_triplets() {
        let node_count = 9000;
        let connectivity: Vec<[NodeId; 4]> = (0..9000)
            .map(|e| [e, (e * 7 + 1) % 9000, (e * 13 + 5) % 9000, (e * 29 + 11) % 9000].map(NodeId))
            .filter(|n| (1..4).all(|i| !n[..i].contains(&n[i])))
            .collect();
        let coupling = |e: usize| if e.is_multiple_of(3) { Coupling::diagonal(3) } else { Coupling::full(3) };
        let couplings: Vec<Coupling> = (0..connectivity.len()).map(coupling).collect();
        let dofs = DofMap::<3>::new(node_count, |node, c| (node.index() + c) % 5 != 0);
        let group = ElementGroup::new(node_count, connectivity.clone(), couplings);
        let pattern = BlockPattern::rectangular(&dofs, &dofs, &group);
        let bound = pattern.bind(&group);
        assert!(pattern.tasks.len() > 1);
        let mut matrix = CsrMatrix::zeros(pattern.structure());
        pattern.assemble(&bound, &mut matrix.values, |e| Marked(e.index()));

        // An entry is stored where one element couples it; every element then adds its value there.
        let mut triplets = BTreeMap::<(usize, usize), (f64, bool)>::new();
        for (e, nodes) in connectivity.iter().enumerate() {
            for (a, b) in (0..4).flat_map(|a| (0..4).map(move |b| (a, b))) {
                let block = Marked(e).block(a, b);
                for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                    if let (Some(row), Some(column)) =
                        (dofs.equation(nodes[a], i), dofs.equation(nodes[b], j))
                    {
                        let entry = triplets.entry((row, column)).or_default();
                        entry.0 += block[i][j];
                        entry.1 |= i == j || !e.is_multiple_of(3);
                    }
                }
            }
        }
        triplets.retain(|_, (_, stored)| *stored);
        assert_eq!(matrix.values.len(), triplets.len());
        for ((row, column), (value, _)) in triplets {
            let entry = matrix.entry(row, column).expect("a triplet's entry is stored");
            assert!((entry - value).abs() <= 1e-12 * value.abs());
        }
    }
}
