//! A sparse matrix in compressed rows; structure shared, values own.

use std::sync::Arc;

use rayon::prelude::*;

use crate::fem::scalar::Scalar;

/// Rows per parallel task of a product.
const ROWS_PER_TASK: usize = 1024;

/// Row pointers and sorted column indices.
#[derive(Debug, PartialEq, Eq)]
pub struct CsrStructure {
    /// Number of columns.
    pub column_count: usize,
    /// Start of every row in `columns`, and their number at the end; shape `(n_rows + 1)`.
    pub row_starts: Vec<u32>,
    /// Column of every stored entry, ascending within a row.
    pub columns: Vec<u32>,
}

impl CsrStructure {
    /// Number of rows.
    pub fn row_count(&self) -> usize {
        self.row_starts.len() - 1
    }

    /// Range of the entries of a row.
    #[inline]
    pub fn row(&self, row: usize) -> std::ops::Range<usize> {
        self.row_starts[row] as usize..self.row_starts[row + 1] as usize
    }
}

/// A sparse matrix in compressed rows.
#[derive(Clone, Debug)]
pub struct CsrMatrix<T> {
    /// Where the entries are.
    pub structure: Arc<CsrStructure>,
    /// The entries, in the order of `structure.columns`.
    pub values: Vec<T>,
}

impl<T: Scalar> CsrMatrix<T> {
    /// A matrix of zeros.
    pub fn zeros(structure: &Arc<CsrStructure>) -> Self {
        Self { structure: Arc::clone(structure), values: vec![T::default(); structure.columns.len()] }
    }

    /// `A x`, overwriting `y`.
    ///
    /// # Panics
    /// If `x` or `y` does not fit the matrix.
    pub fn mul<X>(&self, x: &[X], y: &mut [X])
    where
        X: Scalar + std::ops::Mul<T, Output = X>,
    {
        assert_eq!((y.len(), x.len()), (self.structure.row_count(), self.structure.column_count));
        y.par_chunks_mut(ROWS_PER_TASK).enumerate().for_each(|(task, rows)| {
            for (i, y) in rows.iter_mut().enumerate() {
                let range = self.structure.row(task * ROWS_PER_TASK + i);
                let columns = &self.structure.columns[range.clone()];
                *y = self.values[range].iter().zip(columns).map(|(&a, &c)| x[c as usize] * a).sum();
            }
        });
    }

    /// `Aᵀ x`, overwriting `y`; serial, for the few rectangular products of the method.
    ///
    /// # Panics
    /// If `x` or `y` does not fit the matrix.
    pub fn mul_transposed(&self, x: &[T], y: &mut [T]) {
        assert_eq!((x.len(), y.len()), (self.structure.row_count(), self.structure.column_count));
        y.fill(T::default());
        for (row, &x) in x.iter().enumerate() {
            let range = self.structure.row(row);
            for (&a, &c) in self.values[range.clone()].iter().zip(&self.structure.columns[range]) {
                y[c as usize] += a * x;
            }
        }
    }

    /// The stored entry at `(row, column)`.
    pub fn entry(&self, row: usize, column: usize) -> Option<T> {
        let range = self.structure.row(row);
        let position = self.structure.columns[range.clone()].binary_search(&(column as u32)).ok()?;
        Some(self.values[range.start + position])
    }
}
