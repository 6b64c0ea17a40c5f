//! A transfer between two levels: prolongation, restriction, the Galerkin product `Pᵀ K P`, and the half of it `Pᵀ K`.

use std::ops::Mul;
use std::slice;
use std::sync::Arc;

use fluxmorph_geometry::fem::csr::CsrStructure;
use fluxmorph_geometry::fem::{CsrMatrix, Scalar, c64};
use rayon::prelude::*;

use super::aggregation::Aggregates;

/// Rows per parallel task.
const ROWS: usize = 1024;

/// A prolongation `P`, shape `(n_fine, n_coarse)`, and its transpose.
#[derive(Debug)]
pub(crate) struct Transfer {
    prolongation: CsrMatrix<f64>,
    restriction: CsrMatrix<f64>,
}

impl Transfer {
    /// The transfer of a prolongation.
    pub(crate) fn new(prolongation: CsrMatrix<f64>) -> Self {
        let restriction = transpose(&prolongation);
        Self { prolongation, restriction }
    }

    /// Unknowns of the coarse level.
    pub(crate) fn coarse_count(&self) -> usize {
        self.prolongation.structure.column_count
    }

    /// Whether the coarse level has an unknown by itself; one number a row.
    pub(crate) fn is_coarse(&self) -> Vec<bool> {
        let (p, r) = (&self.prolongation.structure, &self.restriction.structure);
        let alone = |row: usize| match p.columns[p.row(row)] {
            [column] => r.row(column as usize).len() == 1,
            _ => false,
        };
        (0..p.row_count()).map(alone).collect()
    }

    /// Which coarse unknowns have a weight other than one.
    pub(crate) fn has_shares(&self) -> Vec<bool> {
        let CsrMatrix { structure, values } = &self.restriction;
        (0..structure.row_count()).map(|row| values[structure.row(row)].iter().any(|&w| w != 1.0)).collect()
    }

    /// The prolongation from aggregates of coarse unknowns, which count as equal.
    pub(crate) fn joined(&self, aggregates: &Aggregates) -> CsrMatrix<f64> {
        let CsrMatrix { structure, values } = &self.prolongation;
        let row = |row: usize| {
            let mut joined: Vec<(usize, f64)> = Vec::new();
            for k in structure.row(row) {
                let column = aggregates.of_row[structure.columns[k] as usize] as usize;
                match joined.iter_mut().find(|entry| entry.0 == column) {
                    Some(entry) => entry.1 += values[k],
                    None => joined.push((column, values[k])),
                }
            }
            joined
        };
        CsrMatrix::from_rows(aggregates.count, (0..structure.row_count()).map(row))
    }

    /// Memory held [bytes].
    pub(crate) fn bytes(&self) -> usize {
        let of = |m: &CsrMatrix<f64>| m.values.len() * 12 + m.structure.row_starts.len() * 4;
        of(&self.prolongation) + of(&self.restriction)
    }

    /// `Pᵀ r`.
    pub(crate) fn restrict(&self, r: &[c64]) -> Vec<c64> {
        let mut coarse = vec![c64::default(); self.coarse_count()];
        self.restriction.mul(r, &mut coarse);
        coarse
    }

    /// `z += P x`.
    pub(crate) fn add_prolongation(&self, x: &[c64], z: &mut [c64]) {
        let CsrMatrix { structure, values } = &self.prolongation;
        z.par_chunks_mut(ROWS).enumerate().for_each(|(task, rows)| {
            for (i, z) in rows.iter_mut().enumerate() {
                let range = structure.row(task * ROWS + i);
                let columns = &structure.columns[range.clone()];
                for (&weight, &c) in values[range].iter().zip(columns) {
                    *z += x[c as usize] * weight;
                }
            }
        });
    }

    /// The structure of `Pᵀ K P` for a matrix with the structure `fine`.
    pub(crate) fn coarse_structure(&self, fine: &CsrStructure) -> Arc<CsrStructure> {
        let p = &self.prolongation.structure;
        let parents = |g: &u32| &p.columns[p.row(*g as usize)];
        product_structure(&self.restriction.structure, fine, (self.coarse_count(), parents))
    }

    /// The structure of `Pᵀ K`.
    pub(crate) fn restricted_structure(&self, fine: &CsrStructure) -> Arc<CsrStructure> {
        product_structure(&self.restriction.structure, fine, (fine.column_count, slice::from_ref))
    }

    /// The structure of `Pᵀ K P`, from that of `Pᵀ K`.
    pub(crate) fn structure_of_restricted(&self, restricted: &CsrStructure) -> Arc<CsrStructure> {
        let columns = (self.coarse_count(), slice::from_ref);
        product_structure(restricted, &self.prolongation.structure, columns)
    }

    /// `Pᵀ K P`, with the structure of [`Self::coarse_structure`]; every entry is summed in the order of the fine rows.
    pub(crate) fn coarse_matrix(
        &self,
        structure: &Arc<CsrStructure>,
        fine: &CsrMatrix<c64>,
    ) -> CsrMatrix<c64> {
        let p = &self.prolongation;
        let parents = |g: &u32| {
            let range = p.structure.row(*g as usize);
            (&p.values[range.clone()], &p.structure.columns[range])
        };
        product(structure, &self.restriction, fine, parents)
    }

    /// `Pᵀ K`, with the structure of [`Self::restricted_structure`].
    pub(crate) fn restricted_matrix(
        &self,
        structure: &Arc<CsrStructure>,
        fine: &CsrMatrix<c64>,
    ) -> CsrMatrix<c64> {
        product(structure, &self.restriction, fine, identity_row)
    }

    /// `Pᵀ K P` from `Pᵀ K`, with the structure of [`Self::structure_of_restricted`]: where rows of `P` have several entries that
    /// is less work than [`Self::coarse_matrix`], at the price of `Pᵀ K` in memory.
    pub(crate) fn matrix_of_restricted(
        &self,
        structure: &Arc<CsrStructure>,
        restricted: &CsrMatrix<c64>,
    ) -> CsrMatrix<c64> {
        product(structure, restricted, &self.prolongation, identity_row)
    }
}

/// A row of the identity.
fn identity_row(column: &u32) -> (&[f64], &[u32]) {
    (&[1.0], slice::from_ref(column))
}

/// The structure of `A B Q`, for the number of columns of `Q` and the columns of its rows.
fn product_structure<'q>(
    a: &CsrStructure,
    b: &'q CsrStructure,
    (column_count, columns_of): (usize, impl Fn(&'q u32) -> &'q [u32] + Sync),
) -> Arc<CsrStructure> {
    let columns_of_row = |seen: &mut Vec<u32>, row: usize| {
        let mut found = Vec::new();
        for &f in &a.columns[a.row(row)] {
            for g in &b.columns[b.row(f as usize)] {
                for &c in columns_of(g) {
                    if seen[c as usize] != row as u32 {
                        seen[c as usize] = row as u32;
                        found.push(c);
                    }
                }
            }
        }
        found.sort_unstable();
        found
    };
    let rows: Vec<Vec<u32>> = (0..a.row_count())
        .into_par_iter()
        .with_min_len(ROWS)
        .map_init(|| vec![u32::MAX; column_count], columns_of_row)
        .collect();
    let mut row_starts = vec![0u32];
    let mut columns = Vec::with_capacity(rows.iter().map(Vec::len).sum());
    for row in rows {
        columns.extend(row);
        row_starts.push(columns.len() as u32);
    }
    Arc::new(CsrStructure { column_count, row_starts, columns })
}

/// `A B Q` for the weights and columns of the rows of `Q`; every entry is summed in the order of the columns of `A`.
fn product<'q, A: Scalar + Mul<B, Output = c64>, B: Scalar>(
    structure: &Arc<CsrStructure>,
    a: &CsrMatrix<A>,
    b: &'q CsrMatrix<B>,
    row_of: impl Fn(&'q u32) -> (&'q [f64], &'q [u32]) + Sync,
) -> CsrMatrix<c64> {
    let mut product = CsrMatrix::zeros(structure);
    let mut rest = product.values.as_mut_slice();
    let mut rows = Vec::with_capacity(structure.row_count());
    for row in 0..structure.row_count() {
        let (own, others) = rest.split_at_mut(structure.row(row).len());
        rest = others;
        rows.push(own);
    }
    let fill_row = |place: &mut Vec<u32>, (row, sums): (usize, &mut [c64])| {
        for (k, &c) in structure.columns[structure.row(row)].iter().enumerate() {
            place[c as usize] = k as u32;
        }
        for i in a.structure.row(row) {
            for k in b.structure.row(a.structure.columns[i] as usize) {
                let value = a.values[i] * b.values[k];
                let (weights, columns) = row_of(&b.structure.columns[k]);
                for (&w, &c) in weights.iter().zip(columns) {
                    sums[place[c as usize] as usize] += value * w;
                }
            }
        }
    };
    rows.into_par_iter()
        .enumerate()
        .with_min_len(ROWS)
        .for_each_init(|| vec![0u32; structure.column_count], fill_row);
    product
}

fn transpose(matrix: &CsrMatrix<f64>) -> CsrMatrix<f64> {
    let structure = &matrix.structure;
    let mut row_starts = vec![0u32; structure.column_count + 1];
    for &c in &structure.columns {
        row_starts[c as usize + 1] += 1;
    }
    for c in 0..structure.column_count {
        row_starts[c + 1] += row_starts[c];
    }
    let mut next = row_starts.clone();
    let mut columns = vec![0u32; structure.columns.len()];
    let mut values = vec![0.0; structure.columns.len()];
    for row in 0..structure.row_count() {
        for k in structure.row(row) {
            let place = &mut next[structure.columns[k] as usize];
            columns[*place as usize] = row as u32;
            values[*place as usize] = matrix.values[k];
            *place += 1;
        }
    }
    let structure = CsrStructure { column_count: structure.row_count(), row_starts, columns };
    CsrMatrix { structure: Arc::new(structure), values }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `P` joins the unknowns 0, 1 and 2, 3 of a tridiagonal matrix `(−1, 2 + j, −1)`, the second of each with weight 1/2.
    #[test]
    fn the_galerkin_product_is_that_of_dense_matrices() {
        let structure = Arc::new(CsrStructure {
            column_count: 4,
            row_starts: vec![0, 2, 5, 8, 10],
            columns: vec![0, 1, 0, 1, 2, 1, 2, 3, 2, 3],
        });
        let diagonal = |k: usize| [0, 3, 6, 9].contains(&k);
        let entry = |k| if diagonal(k) { c64::new(2.0, 1.0) } else { c64::new(-1.0, 0.0) };
        let fine = CsrMatrix { structure, values: (0..10).map(entry).collect() };
        let p = CsrStructure { column_count: 2, row_starts: (0..5).collect(), columns: vec![0, 0, 1, 1] };
        let transfer = Transfer::new(CsrMatrix { structure: Arc::new(p), values: vec![1.0, 0.5, 1.0, 0.5] });
        let structure = transfer.coarse_structure(&fine.structure);
        let coarse = transfer.coarse_matrix(&structure, &fine);
        // (2 + j)(1 + 1/4) − 2/2, and −1/2 across.
        assert_eq!(coarse.entry(0, 0), Some(c64::new(1.5, 1.25)));
        assert_eq!(coarse.entry(1, 1), Some(c64::new(1.5, 1.25)));
        assert_eq!(coarse.entry(0, 1), Some(c64::new(-0.5, 0.0)));
        assert_eq!(coarse.entry(1, 0), coarse.entry(0, 1));
        let half = transfer.restricted_matrix(&transfer.restricted_structure(&fine.structure), &fine);
        // The second row: (0, −1, 1 (2 + j) − 1/2, 1/2 (2 + j) − 1).
        let row = [c64::new(-1.0, 0.0), c64::new(1.5, 1.0), c64::new(0.0, 0.5)];
        assert_eq!(half.structure.columns[half.structure.row(1)], [1, 2, 3]);
        assert_eq!(half.values[half.structure.row(1)], row);
        assert_eq!(transfer.structure_of_restricted(&half.structure), structure);
        assert_eq!(transfer.matrix_of_restricted(&structure, &half).values, coarse.values);
        let mut z = vec![c64::default(); 4];
        transfer.add_prolongation(&[c64::new(1.0, 0.0), c64::new(0.0, 2.0)], &mut z);
        assert_eq!(z[1], c64::new(0.5, 0.0));
        assert_eq!(transfer.restrict(&z)[1], c64::new(0.0, 2.5));
    }

    #[test]
    fn an_unknown_that_shares_its_coarse_one_is_not_coarse() {
        let p = CsrMatrix::from_rows(
            3,
            [vec![(0, 1.0)], vec![(1, 1.0)], vec![(1, 1.0)], vec![(0, 0.5), (2, 0.5)]],
        );
        let transfer = Transfer::new(p);
        assert_eq!(transfer.is_coarse(), [false, false, false, false]);
        assert_eq!(transfer.has_shares(), [true, false, true]);
        let p = CsrMatrix::from_rows(2, [vec![(0, 1.0)], vec![(1, 1.0)], vec![(1, 1.0)]]);
        assert_eq!(Transfer::new(p).is_coarse(), [true, false, false]);
    }

    #[test]
    fn weights_of_unknowns_that_are_joined_add_up() {
        let p = CsrMatrix::from_rows(3, [vec![(0, 1.0)], vec![(0, 0.5), (1, 0.5)], vec![(1, 0.5), (2, 0.5)]]);
        let joined = Transfer::new(p).joined(&Aggregates { of_row: vec![0, 0, 1], count: 2 });
        assert_eq!(joined.structure.columns, [0, 0, 0, 1]);
        assert_eq!(joined.values, [1.0, 1.0, 0.5, 0.5]);
        assert_eq!(joined.structure.column_count, 2);
    }
}
