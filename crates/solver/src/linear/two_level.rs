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
use fluxmorph_geometry::fem::{
    CsrMatrix, Incomplete, IncompleteAnalysis, Ldlt, LdltAnalysis, c32, c64, norm, ordering,
};
use rayon::prelude::*;

use super::cost::Sizes;
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
    smoother: Incomplete<c32>,
    coarse: Ldlt<c32>,
    /// `1/√|c_ii|` of the coarse matrix.
    scale: Vec<f64>,
}

impl TwoLevel {
    /// Factors both levels of a matrix with the analysed pattern.
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] when a factorisation fails.
    pub(super) fn new(analysis: &Arc<TwoLevelAnalysis>, matrix: &CsrMatrix<c64>) -> Result<Self, MeshError> {
        let coarse = analysis.transfer.coarse_matrix(&analysis.structure, matrix);
        let scale: Vec<f64> = diagonal(&coarse).into_iter().map(|modulus| 1.0 / modulus.sqrt()).collect();
        let columns = &analysis.structure.columns;
        let coarse = Ldlt::new(&analysis.coarse, |row, k| {
            narrow(coarse.values[k] * (scale[row] * scale[columns[k] as usize]))
        })?;
        let entry = |_: usize, k: usize| narrow(matrix.values[k]);
        let smoother = Incomplete::new(&analysis.incomplete, entry, DIAGONAL_FACTOR)?;
        Ok(Self { analysis: Arc::clone(analysis), smoother, coarse, scale })
    }

    /// Memory of both factors [bytes].
    pub(super) fn bytes(&self) -> usize {
        self.smoother.bytes() + self.coarse.bytes() + size_of_val(self.scale.as_slice())
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
        z.fill(c64::default());
        self.smooth(r, z);
        residual(matrix, r, z, &mut rest);
        self.correct(&rest, z);
    }

    /// `z += S r`.
    fn smooth(&self, r: &[c64], z: &mut [c64]) {
        // A residual at the end of an iteration is far below what single precision can hold.
        let size = size(r);
        let factor = 1.0 / size;
        let mut x = vec![c32::default(); r.len()];
        x.par_chunks_mut(ROWS).zip(r.par_chunks(ROWS)).for_each(|(x, r)| {
            x.iter_mut().zip(r).for_each(|(x, r)| *x = narrow(r * factor));
        });
        self.smoother.solve_in_place(&mut x);
        z.par_chunks_mut(ROWS).zip(x.par_chunks(ROWS)).for_each(|(z, x)| {
            z.iter_mut().zip(x).for_each(|(z, x)| *z += wide(*x) * size);
        });
    }

    /// `z += Q r`.
    fn correct(&self, r: &[c64], z: &mut [c64]) {
        let transfer = &self.analysis.transfer;
        let mut coarse = transfer.restricted(r);
        let size = size(&coarse);
        let factor = 1.0 / size;
        let mut x: Vec<c32> = coarse.iter().zip(&self.scale).map(|(r, s)| narrow(r * (s * factor))).collect();
        self.coarse.solve_in_place(&mut x);
        for ((coarse, x), s) in coarse.iter_mut().zip(&x).zip(&self.scale) {
            *coarse = wide(*x) * (s * size);
        }
        transfer.add_prolonged(&coarse, z);
    }
}

/// The norm, or one where there is none to divide by.
fn size(r: &[c64]) -> f64 {
    let size = norm(r);
    if size > 0.0 && size.is_finite() { size } else { 1.0 }
}

#[inline]
fn narrow(z: c64) -> c32 {
    c32::new(z.re as f32, z.im as f32)
}

#[inline]
fn wide(z: c32) -> c64 {
    c64::new(f64::from(z.re), f64::from(z.im))
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
