//! Equations numbered by owner: the rows of a rank are contiguous in a distributed matrix.

use crate::fem::c64;
use crate::fem::dofs::DofMap;
use crate::ids::CarrierId;

/// Who owns which equation of a system, and its number in the distributed matrix.
///
/// The rows of rank 0 come first; within a rank they follow the equations' own order.
#[derive(Clone, Debug)]
pub struct RowLayout {
    /// First row of every rank, and the number of all.
    starts: Vec<u32>,
    /// Row of every equation.
    row_of: Vec<u32>,
    /// Equations of this rank, in the order of its rows.
    owned: Vec<u32>,
    rank: usize,
}

impl RowLayout {
    /// The layout seen by `rank`: an equation belongs to the owner of its node.
    ///
    /// # Panics
    /// If an owner is no rank.
    pub fn new<const C: usize>(
        dofs: &DofMap<C>,
        ranks: usize,
        rank: usize,
        owner_of: impl Fn(CarrierId) -> usize,
    ) -> Self {
        let mut owner = vec![0u32; dofs.count()];
        let mut counts = vec![0u32; ranks];
        for node in (0..dofs.carrier_count()).map(CarrierId::new) {
            for equation in (0..C).filter_map(|c| dofs.equation(node, c)) {
                let own = owner_of(node);
                owner[equation] = own as u32;
                counts[own] += 1;
            }
        }
        let mut starts = vec![0u32];
        for count in counts {
            starts.push(starts[starts.len() - 1] + count);
        }
        let mut next = starts.clone();
        let row_of: Vec<u32> = owner
            .iter()
            .map(|&own| {
                let row = next[own as usize];
                next[own as usize] += 1;
                row
            })
            .collect();
        let owned = (0..dofs.count() as u32).filter(|&e| owner[e as usize] as usize == rank).collect();
        Self { starts, row_of, owned, rank }
    }

    /// Number of equations of all ranks.
    pub fn count(&self) -> usize {
        self.row_of.len()
    }

    /// Number of rows of every rank.
    pub fn counts(&self) -> impl Iterator<Item = usize> + '_ {
        self.starts.windows(2).map(|pair| (pair[1] - pair[0]) as usize)
    }

    /// Rows of this rank.
    pub fn rows(&self) -> std::ops::Range<usize> {
        self.starts[self.rank] as usize..self.starts[self.rank + 1] as usize
    }

    /// Row of an equation.
    #[inline]
    pub fn row_of(&self, equation: usize) -> u32 {
        self.row_of[equation]
    }

    /// Row of every equation.
    pub fn row_numbers(&self) -> &[u32] {
        &self.row_of
    }

    /// Equations of this rank, in the order of its rows.
    pub fn owned(&self) -> &[u32] {
        &self.owned
    }

    /// The owned rows of a vector of all equations, given as pairs of real numbers.
    pub fn restrict(&self, numbers: &[f64]) -> Vec<c64> {
        let at = |&e: &u32| c64::new(numbers[2 * e as usize], numbers[2 * e as usize + 1]);
        self.owned.iter().map(at).collect()
    }

    /// A vector of all equations from the rows of every rank, by rank, all as pairs of real numbers.
    ///
    /// # Panics
    /// If a rank has another number of rows.
    pub fn join(&self, parts: &[Vec<f64>]) -> Vec<c64> {
        for (part, count) in parts.iter().zip(self.counts()) {
            assert_eq!(part.len(), 2 * count, "a rank has two numbers a row");
        }
        let at = |&row: &u32| {
            // The last start that is not beyond the row: ranks without rows share theirs with the next.
            let rank = self.starts.partition_point(|&start| start <= row) - 1;
            let i = 2 * (row - self.starts[rank]) as usize;
            c64::new(parts[rank][i], parts[rank][i + 1])
        };
        self.row_of.iter().map(at).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parallel::numbers_of;

    #[test]
    fn what_is_distributed_by_rows_is_joined_again() {
        let dofs = DofMap::<3>::new(40, |node, c| (node.index() + c) % 4 != 0);
        // Rank 2 owns nothing.
        let owner = |node: CarrierId| [0, 3, 1][node.index() % 3];
        let layouts: Vec<RowLayout> = (0..4).map(|rank| RowLayout::new(&dofs, 4, rank, owner)).collect();
        let values: Vec<c64> = (0..dofs.count()).map(|e| c64::new(e as f64, -(e as f64))).collect();
        let numbers: Vec<f64> = numbers_of(&values).collect();
        let parts: Vec<Vec<f64>> =
            layouts.iter().map(|layout| numbers_of(&layout.restrict(&numbers)).collect()).collect();
        assert!(parts[2].is_empty() && layouts[2].rows().is_empty());
        for layout in &layouts {
            assert_eq!(layout.join(&parts), values);
            let rows: Vec<usize> =
                layout.owned().iter().map(|&e| layout.row_of(e as usize) as usize).collect();
            assert_eq!(rows, layout.rows().collect::<Vec<_>>());
        }
    }
}
