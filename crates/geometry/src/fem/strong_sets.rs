//! Sets of unknowns that are coupled strongly: the connected parts of the graph of the strong couplings, or of those among them
//! that make no set too large.
//!
//! On skin-graded meshes they are chains along the thin cells, and sheets where cells are thin along two axes. What treats
//! unknowns one after the other must not cut them, or only where they hang together least.

use rayon::prelude::*;

use super::csr::CsrStructure;
use crate::disjoint_sets::DisjointSets;

/// The sets, numbered in the order of their first row.
#[derive(Debug)]
pub struct StrongSets {
    /// Set of every row.
    of: Vec<u32>,
    /// Start of every set in `rows`.
    starts: Vec<u32>,
    rows: Vec<u32>,
}

impl StrongSets {
    /// The sets of a structurally symmetric pattern; `strong(row, k)` says whether the stored entry `k` of `row` couples strongly,
    /// and must be symmetric.
    pub fn new(structure: &CsrStructure, strong: impl Fn(usize, usize) -> bool) -> Self {
        let n = structure.row_count();
        let mut of = vec![u32::MAX; n];
        let (mut starts, mut rows) = (vec![0u32], Vec::with_capacity(n));
        for seed in 0..n {
            if of[seed] != u32::MAX {
                continue;
            }
            let set = starts.len() as u32 - 1;
            let mut next = rows.len();
            of[seed] = set;
            rows.push(seed as u32);
            while let Some(&row) = rows.get(next) {
                next += 1;
                for k in structure.row(row as usize) {
                    let c = structure.columns[k];
                    if of[c as usize] == u32::MAX && strong(row as usize, k) {
                        of[c as usize] = set;
                        rows.push(c);
                    }
                }
            }
            starts.push(rows.len() as u32);
        }
        Self { of, starts, rows }
    }

    /// Sets of at most `most` rows: couplings join the sets of their ends, the strongest first, unless both together are larger.
    ///
    /// `strength(row, k)` is how strongly the stored entry `k` of `row` couples, symmetric; `None` joins nothing.
    pub fn of_at_most(
        most: usize,
        structure: &CsrStructure,
        strength: impl Fn(usize, usize) -> Option<f32> + Sync,
    ) -> Self {
        let n = structure.row_count();
        let strength = &strength;
        let of_row = |row: usize| {
            let later = structure.row(row).filter(move |&k| structure.columns[k] as usize > row);
            later.filter_map(move |k| Some((strength(row, k)?, row as u32, structure.columns[k])))
        };
        let mut couplings: Vec<(f32, u32, u32)> = (0..n).into_par_iter().flat_map_iter(of_row).collect();
        // Of equals the first: the order does not depend on the threads.
        couplings.par_sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let (mut joined, mut sizes) = (DisjointSets::new(n), vec![1usize; n]);
        for (_, row, column) in couplings {
            let [a, b] = [row, column].map(|end| joined.root(end as usize));
            let size = sizes[a] + sizes[b];
            if a != b && size <= most {
                joined.join([a, b]);
                sizes[a.min(b)] = size;
            }
        }
        let of: Vec<usize> = (0..n).map(|row| joined.root(row)).collect();
        Self::new(structure, |row, k| of[row] == of[structure.columns[k] as usize])
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The set of a row.
    #[inline]
    pub fn of(&self, row: usize) -> usize {
        self.of[row] as usize
    }

    /// The rows of a set, its first one first.
    pub fn rows(&self, set: usize) -> &[u32] {
        &self.rows[self.starts[set] as usize..self.starts[set + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of six rows, each coupled with its neighbours.
    fn chain() -> CsrStructure {
        let row = |i: usize| i.saturating_sub(1)..(i + 2).min(6);
        let columns: Vec<u32> = (0..6).flat_map(|i| row(i).map(|c| c as u32)).collect();
        let row_starts = (0..=6).map(|i| (0..i).map(|i| row(i).len() as u32).sum()).collect();
        CsrStructure { column_count: 6, row_starts, columns }
    }

    #[test]
    fn what_is_coupled_strongly_is_one_set() {
        // The third coupling is weak.
        let structure = chain();
        let sets = StrongSets::new(&structure, |row, k| row.min(structure.columns[k] as usize) != 2);
        assert_eq!(sets.count(), 2);
        assert_eq!((sets.rows(0), sets.rows(1)), ([0, 1, 2].as_slice(), [3, 4, 5].as_slice()));
        assert_eq!((0..6).map(|row| sets.of(row)).collect::<Vec<_>>(), [0, 0, 0, 1, 1, 1]);
    }

    #[test]
    fn a_set_is_cut_where_it_hangs_together_least() {
        let structure = chain();
        let strengths = [0.5, 0.9, 0.3, 0.7, 0.6];
        let strength = |row: usize, k: usize| Some(strengths[row.min(structure.columns[k] as usize)]);
        let of = |most: usize| {
            let sets = StrongSets::of_at_most(most, &structure, strength);
            (0..sets.count()).map(|set| sets.rows(set).to_vec()).collect::<Vec<_>>()
        };
        assert_eq!(of(6), [[0, 1, 2, 3, 4, 5]]);
        assert_eq!(of(4), [[0, 1, 2], [3, 4, 5]]);
        // 0.9 and 0.7 come first; what is left cannot be joined to them.
        assert_eq!(of(2), [vec![0], vec![1, 2], vec![3, 4], vec![5]]);
        assert_eq!(of(1).len(), 6);
        let none = StrongSets::of_at_most(6, &structure, |_, _| None);
        assert_eq!(none.count(), 6);
    }
}
