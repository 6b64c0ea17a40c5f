//! Sets of unknowns that are coupled strongly: the connected parts of the graph of the strong couplings.
//!
//! On skin-graded meshes they are chains along the thin cells, and sheets where cells are thin along two axes. What treats
//! unknowns one after the other must not cut them.

use super::csr::CsrStructure;

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

    #[test]
    fn what_is_coupled_strongly_is_one_set() {
        // A chain of six rows, whose third coupling is weak.
        let row = |i: usize| i.saturating_sub(1)..(i + 2).min(6);
        let columns: Vec<u32> = (0..6).flat_map(|i| row(i).map(|c| c as u32)).collect();
        let starts = (0..=6).map(|i| (0..i).map(|i| row(i).len() as u32).sum()).collect();
        let structure = CsrStructure { column_count: 6, row_starts: starts, columns };
        let sets = StrongSets::new(&structure, |row, k| row.min(structure.columns[k] as usize) != 2);
        assert_eq!(sets.count(), 2);
        assert_eq!((sets.rows(0), sets.rows(1)), ([0, 1, 2].as_slice(), [3, 4, 5].as_slice()));
        assert_eq!((0..6).map(|row| sets.of(row)).collect::<Vec<_>>(), [0, 0, 0, 1, 1, 1]);
    }
}
