//! Sparse Cholesky factorisation of real symmetric positive definite matrices: faer's supernodal `LLᵀ`.
//!
//! The factor is in double precision, or in single where it only preconditions. The analysis (ordering, elimination tree, supernodes) depends on the pattern only and is made once a run; the
//! numbers are factored as often as they change.

use std::num::NonZeroUsize;
use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::mat::MatMut;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::traits::RealField;
use faer::traits::math_utils::is_finite;
use faer::{Conj, Par, Side};

use crate::error::MeshError;
use crate::fem::csr::{CsrMatrix, CsrStructure};
use crate::fem::dofs::DofMap;
use crate::fem::ordering;

/// The parallel degree of the dense kernels. Bits depend on this number and not on the threads there are, so it is a
/// constant.
fn parallel() -> Par {
    Par::Rayon(const { NonZeroUsize::new(2).expect("two is not zero") })
}

/// Ordering and symbolic factor of one symmetric pattern.
#[derive(Debug)]
pub struct CholeskyAnalysis {
    structure: Arc<CsrStructure>,
    symbolic: SymbolicCholesky<u32>,
}

impl CholeskyAnalysis {
    /// Analyses a structurally symmetric pattern.
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] when the factor does not fit the index type or the memory.
    pub fn new(structure: &Arc<CsrStructure>) -> Result<Arc<Self>, MeshError> {
        Self::with_order(structure, ordering::nested_dissection(structure))
    }

    /// As [`CholeskyAnalysis::new`] for a pattern in which all components of neighbouring nodes are coupled: the graph of the
    /// nodes is a ninth of the matrix' and is dissected as well.
    ///
    /// # Errors
    /// As [`CholeskyAnalysis::new`].
    pub fn of_nodes<const C: usize>(
        structure: &Arc<CsrStructure>,
        dofs: &DofMap<C>,
    ) -> Result<Arc<Self>, MeshError> {
        let order = ordering::nested_dissection_of_nodes(structure, dofs);
        Self::with_order(structure, order.map(|order| ordering::postorder(structure, order)))
    }

    /// Analyses a structurally symmetric pattern in a given postordered elimination order, `order[new] = old`; by minimum
    /// degree without one.
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] when the factor does not fit the index type or the memory.
    pub(super) fn with_order(
        structure: &Arc<CsrStructure>,
        order: Option<Vec<u32>>,
    ) -> Result<Arc<Self>, MeshError> {
        let n = structure.row_count();
        let symbolic_matrix = symbolic_matrix(structure);
        let inverse = order.as_ref().map(|forward| ordering::inverse_permutation(forward));
        let ordering = match (&order, &inverse) {
            (Some(forward), Some(inverse)) => {
                SymmetricOrdering::Custom(PermRef::new_checked(forward, inverse, n))
            }
            _ => SymmetricOrdering::Amd,
        };
        let params = CholeskySymbolicParams::default();
        let symbolic = factorize_symbolic_cholesky(symbolic_matrix, Side::Upper, ordering, params)
            .map_err(|e| MeshError::Factorisation { unknowns: n, cause: e.to_string() })?;
        Ok(Arc::new(Self { structure: Arc::clone(structure), symbolic }))
    }

    /// Entries of the factor.
    pub fn factor_entries(&self) -> usize {
        self.symbolic.len_val()
    }
}

/// A numeric factor `P A Pᵀ = L Lᵀ`, in `f64` or `f32`.
#[derive(Debug)]
pub struct Cholesky<T = f64> {
    analysis: Arc<CholeskyAnalysis>,
    values: Vec<T>,
}

impl<T: RealField> Cholesky<T> {
    /// Factors a matrix whose pattern was analysed.
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] when a pivot is not positive: the matrix is singular or indefinite; and when an entry
    /// is not finite.
    ///
    /// # Panics
    /// If the matrix has another structure than the analysis.
    pub fn new(analysis: &Arc<CholeskyAnalysis>, matrix: &CsrMatrix<T>) -> Result<Self, MeshError> {
        assert!(
            Arc::ptr_eq(&analysis.structure, &matrix.structure),
            "the matrix has the structure that was analysed"
        );
        let n = matrix.structure.row_count();
        let failed = |cause: String| MeshError::Factorisation { unknowns: n, cause };
        // An infinite diagonal has an infinite root, which the library takes for a pivot.
        if let Some(value) = matrix.values.iter().find(|value| !is_finite(*value)) {
            return Err(failed(format!("a stored entry is {value:?}: every one must be finite")));
        }
        let symbolic = &analysis.symbolic;
        let a = SparseColMatRef::new(symbolic_matrix(&matrix.structure), matrix.values.as_slice());
        let scratch = symbolic.factorize_numeric_llt_scratch::<T>(parallel(), Default::default());
        let mut memory = MemBuffer::try_new(scratch).map_err(|_| failed("out of memory".to_owned()))?;
        let mut values = Vec::new();
        values
            .try_reserve_exact(symbolic.len_val())
            .map_err(|_| failed("out of memory for the factor".to_owned()))?;
        values.resize(symbolic.len_val(), T::zero_impl());
        symbolic
            .factorize_numeric_llt(
                &mut values,
                a,
                Side::Upper,
                LltRegularization::default(),
                parallel(),
                MemStack::new(&mut memory),
                Default::default(),
            )
            .map_err(|e| failed(format!("{e:?}: a pivot is not positive")))?;
        Ok(Self { analysis: Arc::clone(analysis), values })
    }

    /// Number of unknowns.
    pub fn size(&self) -> usize {
        self.analysis.symbolic.nrows()
    }

    /// Solves `A X = B` in place; `columns` holds the right sides one after the other.
    ///
    /// # Panics
    /// If the length of `columns` is not a multiple of the size.
    pub fn solve_in_place(&self, columns: &mut [T]) {
        let n = self.size();
        if n == 0 {
            return;
        }
        assert_eq!(columns.len() % n, 0, "whole columns");
        let count = columns.len() / n;
        let right_sides = MatMut::from_column_major_slice_mut(columns, n, count);
        let scratch = self.analysis.symbolic.solve_in_place_scratch::<T>(count, Par::Seq);
        let mut memory = MemBuffer::new(scratch);
        LltRef::new(&self.analysis.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            right_sides,
            Par::Seq,
            MemStack::new(&mut memory),
        );
    }
}

/// The structure as faer's column-compressed one: rows of a symmetric pattern are its columns.
fn symbolic_matrix(structure: &CsrStructure) -> SymbolicSparseColMatRef<'_, u32> {
    let n = structure.row_count();
    SymbolicSparseColMatRef::new_checked(n, n, &structure.row_starts, None, &structure.columns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::determinism::same_on_any_threads;

    /// The seven-point Laplacian on an `m³` grid plus a shift.
    fn laplacian(m: usize) -> CsrMatrix<f64> {
        let row = |i: usize| {
            let mut row = vec![(i, 6.5)];
            for stride in [m * m, m, 1] {
                let at = i / stride % m;
                row.extend((at > 0).then(|| (i - stride, -1.0)));
                row.extend((at + 1 < m).then(|| (i + stride, -1.0)));
            }
            row
        };
        CsrMatrix::from_rows(m * m * m, (0..m * m * m).map(row))
    }

    #[test]
    fn the_factor_solves_several_right_sides() {
        let a = laplacian(12);
        let n = a.structure.row_count();
        let analysis = CholeskyAnalysis::new(&a.structure).expect("a pattern");
        let factor = Cholesky::new(&analysis, &a).expect("positive definite");
        let exact: Vec<f64> = (0..2 * n).map(|i| (i as f64 * 0.37).sin()).collect();
        let mut x = vec![0.0; 2 * n];
        for (b, e) in x.chunks_mut(n).zip(exact.chunks(n)) {
            a.mul(e, b);
        }
        factor.solve_in_place(&mut x);
        let error = x.iter().zip(&exact).map(|(x, e)| (x - e).abs()).fold(0.0, f64::max);
        assert!(error < 1e-13, "{error:e}");
    }

    #[test]
    fn the_bits_do_not_depend_on_the_threads() {
        let a = laplacian(16);
        same_on_any_threads(|| {
            let analysis = CholeskyAnalysis::new(&a.structure).expect("a pattern");
            let mut x: Vec<f64> = (0..a.structure.row_count()).map(|i| (i as f64).cos()).collect();
            Cholesky::new(&analysis, &a).expect("positive definite").solve_in_place(&mut x);
            x.iter().map(|v| v.to_bits()).collect::<Vec<_>>()
        });
    }

    #[test]
    fn an_indefinite_matrix_is_an_error() {
        let mut a = laplacian(4);
        for row in 0..a.structure.row_count() {
            for k in a.structure.row(row) {
                if a.structure.columns[k] as usize == row {
                    a.values[k] = -1.0;
                }
            }
        }
        let analysis = CholeskyAnalysis::new(&a.structure).expect("a pattern");
        assert!(matches!(Cholesky::new(&analysis, &a), Err(MeshError::Factorisation { .. })));
    }
}
