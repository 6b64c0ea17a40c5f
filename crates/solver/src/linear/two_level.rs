//! The two-level preconditioner: a coarse space that a factor in single precision solves, and an incomplete factor for the
//! rest.
//!
//! With the smoother `S`, and `Q = P (Pᵀ K P)⁻¹ Pᵀ`, one application is
//!
//! ```text
//! z = S r + Q (r − K S r)
//! ```
//!
//! ("A-DEF2" of Tang, Nabben, Vuik and Erlangga, J. Sci. Comput. 39 (2009) 340). For a residual without a coarse part it is the
//! balanced `Q r + (I − Q K) S (I − K Q) r`, which is complex symmetric, at little more than half the cost; the iteration
//! keeps residuals free of it if it begins with [`TwoLevel::start`]. Unlike smoothing before and after, it does not ask that
//! `S` contracts, which an incomplete factor does not on flat elements.

use std::sync::Arc;

use fluxmorph_geometry::MeshError;
use fluxmorph_geometry::fem::csr::CsrStructure;
use fluxmorph_geometry::fem::{CsrMatrix, IncompleteAnalysis, LdltAnalysis, c32, c64, ordering};
use rayon::prelude::*;

use super::cost::Sizes;
use super::factor::{Precondition, Scaled, Unscaled};
use super::transfer::Transfer;

/// Rows per parallel task.
const ROWS: usize = 1024;

/// What the diagonal is multiplied by before the incomplete factorisation. Between 1.0 and 1.05 the iterations hardly change.
const DIAGONAL_FACTOR: f64 = 1.02;

/// Coupling over the diagonal from which two unknowns stay in one part of the incomplete factor.
const STRONG: f64 = 0.25;

/// What follows from the pattern and the couplings on the reference mesh.
#[derive(Debug)]
pub(super) struct TwoLevelAnalysis {
    transfer: Transfer,
    structure: Arc<CsrStructure>,
    coarse: Arc<LdltAnalysis>,
    incomplete: Arc<IncompleteAnalysis>,
}

impl TwoLevelAnalysis {
    /// Analyses both levels of a matrix and a prolongation onto its unknowns.
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] when the coarse factor does not fit.
    pub(super) fn new(matrix: &CsrMatrix<c64>, prolongation: CsrMatrix<f64>) -> Result<Arc<Self>, MeshError> {
        let transfer = Transfer::new(prolongation);
        let structure = transfer.coarse_structure(&matrix.structure);
        let coarse = LdltAnalysis::new(&structure, ordering::dissection(&structure))?;
        let incomplete = incomplete_analysis(matrix);
        Ok(Arc::new(Self { transfer, structure, coarse, incomplete }))
    }

    /// Sizes of the coarse level.
    pub(super) fn coarse_sizes(&self) -> Sizes {
        Sizes {
            matrix_entries: self.structure.columns.len(),
            factor_entries: self.coarse.factor_entries(),
            multiplications: self.coarse.multiplications(),
        }
    }

    /// Memory of both factors and the transfer [bytes].
    pub(super) fn bytes(&self) -> usize {
        self.coarse.factor_entries() * size_of::<c32>()
            + self.incomplete.bytes::<c32>()
            + self.transfer.bytes()
    }
}

/// Order and parts of an incomplete factor, after the strong couplings of a matrix.
pub(super) fn incomplete_analysis(matrix: &CsrMatrix<c64>) -> Arc<IncompleteAnalysis> {
    let diagonal = diagonal(matrix);
    IncompleteAnalysis::in_parts(&matrix.structure, |row, k| {
        let column = matrix.structure.columns[k] as usize;
        matrix.values[k].norm_sqr() > STRONG * STRONG * diagonal[row] * diagonal[column]
    })
}

/// The preconditioner of one matrix.
#[derive(Debug)]
pub(super) struct TwoLevel {
    analysis: Arc<TwoLevelAnalysis>,
    smoother: Unscaled,
    coarse: Scaled<c32>,
}

impl TwoLevel {
    /// Factors both levels of a matrix with the analysed pattern.
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] when a factorisation fails.
    pub(super) fn new(analysis: &Arc<TwoLevelAnalysis>, matrix: &CsrMatrix<c64>) -> Result<Self, MeshError> {
        let coarse = analysis.transfer.coarse_matrix(&analysis.structure, matrix);
        let coarse = Scaled::complete(&analysis.coarse, &coarse)?;
        let smoother = Unscaled::new(&analysis.incomplete, matrix, DIAGONAL_FACTOR)?;
        Ok(Self { analysis: Arc::clone(analysis), smoother, coarse })
    }

    /// Memory of both factors [bytes].
    pub(super) fn bytes(&self) -> usize {
        self.smoother.bytes() + self.coarse.bytes()
    }

    /// Moves `x` so that the residual `b − K x` has no coarse part: where a deflated iteration starts.
    pub(super) fn start(&self, matrix: &CsrMatrix<c64>, b: &[c64], x: &mut [c64]) {
        let mut rest = vec![c64::default(); b.len()];
        residual(matrix, b, x, &mut rest);
        self.correct(&rest, x);
    }

    /// Overwrites `z` with `M⁻¹ r`; `matrix` is the one that is solved with.
    pub(super) fn apply(&self, matrix: &CsrMatrix<c64>, r: &[c64], z: &mut [c64]) {
        let mut rest = vec![c64::default(); r.len()];
        self.smoother.apply(r, z);
        residual(matrix, r, z, &mut rest);
        self.correct(&rest, z);
    }

    /// `z += Q r`.
    fn correct(&self, r: &[c64], z: &mut [c64]) {
        let transfer = &self.analysis.transfer;
        let restricted = transfer.restrict(r);
        let mut coarse = vec![c64::default(); restricted.len()];
        self.coarse.apply(&restricted, &mut coarse);
        transfer.add_prolongation(&coarse, z);
    }
}

/// Moduli of the diagonal entries.
fn diagonal(matrix: &CsrMatrix<c64>) -> Vec<f64> {
    let of = |row: usize| matrix.entry(row, row).unwrap_or_default().norm();
    (0..matrix.structure.row_count()).into_par_iter().map(of).collect()
}

/// `rest = r − K z`.
fn residual(matrix: &CsrMatrix<c64>, r: &[c64], z: &[c64], rest: &mut [c64]) {
    matrix.mul(z, rest);
    rest.par_chunks_mut(ROWS).zip(r.par_chunks(ROWS)).for_each(|(rest, r)| {
        rest.iter_mut().zip(r).for_each(|(rest, r)| *rest = r - *rest);
    });
}
