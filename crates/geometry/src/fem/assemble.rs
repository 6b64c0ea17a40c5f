//! Assembly by owner-computes: every task owns a range of carriers, visits all elements that touch them and writes only
//! the rows of its own carriers.
//!
//! Elements on a border between tasks are computed twice; nothing is locked, and every entry is summed in ascending
//! element order: the bits do not depend on the tasks or the threads.

use std::ops::Range;

use rayon::prelude::*;

use crate::fem::pattern::{BlockPattern, BoundGroup, RowStarts};
use crate::fem::scalar::Scalar;
use crate::ids::ElementId;

/// The symmetric matrix of one element with `N` carriers and `C` components a carrier, given block by block.
pub trait LocalMatrix<T, const N: usize, const C: usize> {
    /// Entries of local carrier `a` (rows) against local carrier `b` (columns); `block(b, a)` is its transpose.
    fn block(&self, a: usize, b: usize) -> [[T; C]; C];

    /// The matrix as one real number a pair of carriers, shape `(N, N)`, where that is all there is to it: every block is
    /// the number times the identity on the first three components, and zero elsewhere. The upper triangle suffices.
    ///
    /// Most elements of a field problem are of this kind (a Laplacian for each component), and much faster so.
    #[inline]
    fn scalars(&self) -> Option<[[f64; N]; N]> {
        None
    }
}

/// One assembly task: the carriers it owns, and their part of the values.
struct Task<'a, T> {
    carriers: &'a Range<usize>,
    elements: &'a [ElementId],
    /// Entries of the rows of `carriers`; the first of them is entry `first` of the matrix.
    values: &'a mut [T],
    first: usize,
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
        self.assemble_where(group, values, |_| true, element_matrix);
    }

    /// As [`BlockPattern::assemble`], of those elements alone that take part.
    ///
    /// # Panics
    /// If `values` has another length than the pattern has entries.
    pub fn assemble_where<T, L, const N: usize>(
        &self,
        group: &BoundGroup<N>,
        values: &mut [T],
        takes_part: impl Fn(ElementId) -> bool + Sync,
        element_matrix: impl Fn(ElementId) -> L + Sync,
    ) where
        T: Scalar,
        L: LocalMatrix<T, N, C>,
    {
        assert_eq!(values.len(), self.structure().columns.len(), "one value an entry");
        let mut rest = values;
        let mut tasks = Vec::with_capacity(self.tasks.len());
        for (carriers, elements) in self.tasks.iter().zip(&group.elements) {
            let entries = self.entries_of(carriers);
            let (values, others) = rest.split_at_mut(entries.len());
            rest = others;
            tasks.push(Task { carriers, elements, values, first: entries.start });
        }
        tasks.into_par_iter().for_each(|mut task| {
            for &e in task.elements.iter().filter(|&&e| takes_part(e)) {
                self.add_element(group, e, &element_matrix(e), &mut task);
            }
        });
    }

    /// Adds the rows of one element matrix that a task owns.
    #[inline]
    fn add_element<T: Scalar, const N: usize>(
        &self,
        group: &BoundGroup<N>,
        e: ElementId,
        local: &impl LocalMatrix<T, N, C>,
        task: &mut Task<'_, T>,
    ) {
        let carriers = &group.connectivity[e.index()];
        let positions = &group.blocks[e.index()];
        let owned = carriers.map(|n| task.carriers.contains(&n.index()));
        let rows: [RowStarts; N] = std::array::from_fn(|a| {
            if owned[a] { self.row_starts_of(carriers[a], task.first) } else { RowStarts::default() }
        });
        let scalars = local.scalars();
        for a in 0..N {
            for b in a..N {
                let stored = |a: usize, b: usize| {
                    if owned[a] { self.block(carriers[a], positions[a][b]) } else { None }
                };
                let (upper, lower) = (stored(a, b), if a == b { None } else { stored(b, a) });
                if let Some(scalars) = &scalars {
                    for (block, row) in [(upper, a), (lower, b)] {
                        if let Some(block) = block {
                            block.add_scalar(&rows[row], task.values, scalars[a][b]);
                        }
                    }
                } else if upper.is_some() || lower.is_some() {
                    let values = local.block(a, b);
                    if let Some(block) = upper {
                        block.add(&rows[a], task.values, |i, j| values[i][j]);
                    }
                    if let Some(block) = lower {
                        block.add(&rows[b], task.values, |i, j| values[j][i]);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::determinism::same_on_any_threads;
    use crate::fem::csr::CsrMatrix;
    use crate::fem::dofs::DofMap;
    use crate::fem::pattern::{Coupling, ElementGroup};
    use crate::ids::CarrierId;

    /// Symmetric block entries that depend on element, carriers and components, so that every mix-up shows.
    struct Marked(usize);

    impl Marked {
        /// Every fifth element is a multiple of the identity, pair by pair.
        fn is_scalar(&self) -> bool {
            self.0.is_multiple_of(5)
        }

        fn scalar(&self, a: usize, b: usize) -> f64 {
            (1 + self.0) as f64 + 0.1 * (a + 4 * b).max(b + 4 * a) as f64
        }
    }

    impl LocalMatrix<f64, 4, 3> for Marked {
        fn block(&self, a: usize, b: usize) -> [[f64; 3]; 3] {
            std::array::from_fn(|i| {
                std::array::from_fn(|j| match (self.is_scalar(), (a, i) <= (b, j)) {
                    (true, _) if i == j => self.scalar(a, b),
                    (true, _) => 0.0,
                    (false, true) => self.scalar(a, b) + 7.0 * (i + 3 * j) as f64,
                    (false, false) => self.scalar(a, b) + 7.0 * (j + 3 * i) as f64,
                })
            })
        }

        fn scalars(&self) -> Option<[[f64; 4]; 4]> {
            let scalar = |a: usize, b: usize| self.scalar(a, b);
            self.is_scalar().then(|| std::array::from_fn(|a| std::array::from_fn(|b| scalar(a, b))))
        }
    }

    #[test]
    fn assembly_equals_a_sum_of_triplets() {
        let carrier_count = 9000;
        let connectivity: Vec<[CarrierId; 4]> = (0..9000)
            .map(|e| [e, (e * 7 + 1) % 9000, (e * 13 + 5) % 9000, (e * 29 + 11) % 9000].map(CarrierId))
            .filter(|n| (1..4).all(|i| !n[..i].contains(&n[i])))
            .collect();
        let coupling = |e: usize| if e.is_multiple_of(3) { Coupling::diagonal(3) } else { Coupling::full(3) };
        let couplings: Vec<Coupling> = (0..connectivity.len()).map(coupling).collect();
        let dofs = DofMap::<3>::new(carrier_count, |carrier, c| (carrier.index() + c) % 5 != 0);
        let group = ElementGroup::new(carrier_count, connectivity.clone(), couplings);
        let pattern = BlockPattern::rectangular(&dofs, &dofs, &group);
        let bound = pattern.bind(&group);
        assert!(pattern.tasks.len() > 1);
        let mut matrix = CsrMatrix::zeros(pattern.structure());
        pattern.assemble(&bound, &mut matrix.values, |e| Marked(e.index()));

        // An entry is stored where one element couples it; every element then adds its value there.
        let mut triplets = BTreeMap::<(usize, usize), (f64, bool)>::new();
        for (e, carriers) in connectivity.iter().enumerate() {
            for (a, b) in (0..4).flat_map(|a| (0..4).map(move |b| (a, b))) {
                let block = Marked(e).block(a, b);
                for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                    if let (Some(row), Some(column)) =
                        (dofs.equation(carriers[a], i), dofs.equation(carriers[b], j))
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

    #[test]
    fn the_bits_do_not_depend_on_the_threads_or_their_tasks() {
        let carrier_count = 9000;
        let connectivity: Vec<[CarrierId; 4]> = (0..9000)
            .map(|e| [e, (e + 1) % 9000, (e + 90) % 9000, (e + 2000) % 9000].map(CarrierId))
            .collect();
        let couplings = vec![Coupling::full(3); connectivity.len()];
        let group = ElementGroup::new(carrier_count, connectivity, couplings);
        let dofs = DofMap::<3>::new(carrier_count, |carrier, c| (carrier.index() + c) % 5 != 0);
        same_on_any_threads(|| {
            let pattern = BlockPattern::rectangular(&dofs, &dofs, &group);
            let bound = pattern.bind(&group);
            let mut matrix = CsrMatrix::zeros(pattern.structure());
            pattern.assemble(&bound, &mut matrix.values, |e| Marked(e.index()));
            matrix.values.iter().map(|v: &f64| v.to_bits()).collect::<Vec<_>>()
        });
    }
}
