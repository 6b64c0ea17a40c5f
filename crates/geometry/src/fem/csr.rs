//! A sparse matrix in compressed rows; structure shared, values own.

use std::sync::Arc;

use crate::fem::scalar::{Scalar, c32, c64};

/// Entries above which the rows of a product are divided between two parallel tasks: some 20 µs of work.
const ENTRIES_PER_TASK: usize = 1 << 14;

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

/// The inner loop of a matrix product, for every pair of types that is multiplied.
pub trait RowProduct<T>: Scalar {
    /// `Σ_k values[k] x[columns[k]]`, in ascending order of `k`.
    fn row_product(values: &[T], columns: &[u32], x: &[Self]) -> Self;
}

impl RowProduct<f64> for f64 {
    #[inline]
    fn row_product(values: &[f64], columns: &[u32], x: &[f64]) -> f64 {
        values.iter().zip(columns).map(|(&a, &c)| a * x[c as usize]).sum()
    }
}

impl RowProduct<f64> for c64 {
    #[inline]
    fn row_product(values: &[f64], columns: &[u32], x: &[c64]) -> c64 {
        values.iter().zip(columns).map(|(&a, &c)| x[c as usize] * a).sum()
    }
}

impl RowProduct<c64> for c64 {
    #[inline]
    fn row_product(values: &[c64], columns: &[u32], x: &[c64]) -> c64 {
        complex_row_product(values, columns, x, |a| a)
    }
}

impl RowProduct<c32> for c64 {
    #[inline]
    fn row_product(values: &[c32], columns: &[u32], x: &[c64]) -> c64 {
        complex_row_product(values, columns, x, |a| c64::new(f64::from(a.re), f64::from(a.im)))
    }
}

/// The products with Re a and with Im a are summed apart: pairs of equal operations, no exchange of parts within the loop, and
/// half as long a chain of additions.
#[inline]
fn complex_row_product<A: Copy>(values: &[A], columns: &[u32], x: &[c64], double: impl Fn(A) -> c64) -> c64 {
    let (mut by_re, mut by_im) = ([0.0; 2], [0.0; 2]);
    for (&a, &c) in values.iter().zip(columns) {
        let (a, x) = (double(a), x[c as usize]);
        by_re = [by_re[0] + a.re * x.re, by_re[1] + a.re * x.im];
        by_im = [by_im[0] + a.im * x.re, by_im[1] + a.im * x.im];
    }
    c64::new(by_re[0] - by_im[1], by_re[1] + by_im[0])
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

    /// The matrix of rows of `(column, value)`, in any order within a row.
    pub fn from_rows(column_count: usize, rows: impl IntoIterator<Item = Vec<(usize, T)>>) -> Self {
        let (mut row_starts, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
        for mut row in rows {
            row.sort_unstable_by_key(|entry| entry.0);
            columns.extend(row.iter().map(|entry| entry.0 as u32));
            values.extend(row.iter().map(|entry| entry.1));
            row_starts.push(columns.len() as u32);
        }
        Self { structure: Arc::new(CsrStructure { column_count, row_starts, columns }), values }
    }

    /// `A x`, overwriting `y`.
    ///
    /// # Panics
    /// If `x` or `y` does not fit the matrix.
    pub fn mul<X: RowProduct<T>>(&self, x: &[X], y: &mut [X]) {
        self.for_each_product(x, y, &|_, product| product);
    }

    /// `b − A x`.
    ///
    /// # Panics
    /// If `x` or `b` does not fit the matrix.
    pub fn residual<X: RowProduct<T>>(&self, x: &[X], b: &[X]) -> Vec<X> {
        let mut r = vec![X::default(); b.len()];
        self.for_each_product(x, &mut r, &|row, product| b[row] - product);
        r
    }

    /// Overwrites `y` with `value(row, (A x)_row)`.
    fn for_each_product<X: RowProduct<T>>(
        &self,
        x: &[X],
        y: &mut [X],
        value: &(impl Fn(usize, X) -> X + Sync),
    ) {
        assert_eq!((y.len(), x.len()), (self.structure.row_count(), self.structure.column_count));
        self.products_from(0, x, y, value);
    }

    /// The same for the rows from `first` on, halved by their entries: rows of coarse levels may be long, and stand together.
    fn products_from<X: RowProduct<T>>(
        &self,
        first: usize,
        x: &[X],
        y: &mut [X],
        value: &(impl Fn(usize, X) -> X + Sync),
    ) {
        let starts = &self.structure.row_starts[first..=first + y.len()];
        let entries = starts[y.len()] - starts[0];
        if y.len() > 1 && entries as usize > ENTRIES_PER_TASK {
            let half = starts.partition_point(|&start| start - starts[0] < entries / 2).clamp(1, y.len() - 1);
            let (one, other) = y.split_at_mut(half);
            let next = first + half;
            rayon::join(
                || self.products_from(first, x, one, value),
                || self.products_from(next, x, other, value),
            );
        } else {
            for (row, y) in (first..).zip(y) {
                let range = self.structure.row(row);
                let columns = &self.structure.columns[range.clone()];
                *y = value(row, X::row_product(&self.values[range], columns, x));
            }
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::determinism::same_on_any_threads;

    #[test]
    fn a_product_is_the_sum_over_the_rows_for_all_pairs_of_types() {
        let structure = Arc::new(CsrStructure {
            column_count: 3,
            row_starts: vec![0, 2, 2, 5],
            columns: vec![0, 2, 0, 1, 2],
        });
        let real = CsrMatrix { structure: Arc::clone(&structure), values: vec![2.0, -1.0, 0.5, 3.0, 4.0] };
        let x = [c64::new(1.0, 2.0), c64::new(-3.0, 0.5), c64::new(0.25, -1.0)];
        let mut y = [c64::default(); 3];
        real.mul(&x, &mut y);
        assert_eq!(y, [c64::new(1.75, 5.0), c64::default(), c64::new(-7.5, -1.5)]);
        let mut re = [0.0; 3];
        real.mul(&x.map(|c| c.re), &mut re);
        assert_eq!(re, y.map(|c| c.re));
        let turned = real.values.iter().map(|&a| a * c64::new(0.0, 1.0)).collect();
        let complex = CsrMatrix { structure, values: turned };
        let mut z = [c64::default(); 3];
        complex.mul(&x, &mut z);
        assert_eq!(z, y.map(|c| c * c64::new(0.0, 1.0)));
    }

    #[test]
    fn rows_of_any_length_have_the_same_product_on_any_threads() {
        // One row with half of the entries, none in others, and more than a task of either kind.
        let n = 4 * ENTRIES_PER_TASK;
        let length = |row: usize| if row == 7 { n } else { row % 3 };
        let entry = |row: usize, k: usize| ((row + k) % n, ((row * k) as f64 * 0.7).sin());
        let rows = (0..n).map(|row| (0..length(row)).map(|k| entry(row, k)).collect());
        let a = CsrMatrix::from_rows(n, rows);
        let x: Vec<f64> = (0..n).map(|i| (0.3 * i as f64).cos()).collect();
        let b: Vec<f64> = x.iter().map(|x| x * x).collect();
        let r = same_on_any_threads(|| a.residual(&x, &b));
        for row in [0, 1, 7, n / 2, n - 1] {
            let range = a.structure.row(row);
            let terms = range.map(|k| a.values[k] * x[a.structure.columns[k] as usize]);
            assert_eq!(r[row], b[row] - terms.sum::<f64>(), "row {row}");
        }
    }
}
