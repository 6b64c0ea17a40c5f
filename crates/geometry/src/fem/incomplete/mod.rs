//! Incomplete factorisation without fill, `LDLᵀ(0)`, of real or complex symmetric matrices (plain transpose, never the
//! conjugate one): the preconditioner where no factor fits, and the smoother of the two-level method.
//!
//! Lives here: the numbers; the triangular solves are in `solve`. The order and the parts that are worked on at the same time are in `analysis`. The matrix is scaled to a diagonal of modulus one; its diagonal is then raised by a small factor, without
//! which the product `L D Lᵀ` of a matrix that is no M-matrix may be far from it (Manteuffel, Math. Comp. 34 (1980) 473).
//!
//! For `K + jωC` with positive semidefinite parts every exact pivot lies in the quadrant of its diagonal entry. A pivot
//! of the incomplete factor that leaves it, or nearly vanishes, raises the factor, and the factorisation is repeated.

mod analysis;
mod number;
mod solve;

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

pub use analysis::IncompleteAnalysis;
pub use number::Number;

use crate::error::MeshError;

/// Least pivot along the phase of its diagonal entry, whose modulus is one.
const LEAST_PIVOT: f64 = 1e-3;
/// What the excess of the diagonal is multiplied by after a bad pivot.
const RAISE: f64 = 3.0;
/// Attempts after which the matrix is refused; the last one raises the diagonal by `0.02 · 3⁵` or more, which makes every matrix with
/// a sensible diagonal dominant.
const ATTEMPTS: usize = 6;

/// An incomplete factor `S⁻¹ L D Lᵀ S⁻¹` of a matrix, with a real diagonal scaling `S`.
#[derive(Debug)]
pub struct Incomplete<T> {
    analysis: Arc<IncompleteAnalysis>,
    /// `1/√|a_ii|`, in the new order.
    scales: Vec<T>,
    /// Strictly lower triangle of `L`.
    lower: Vec<T>,
    /// `1/d_i`.
    inverse_pivots: Vec<T>,
    diagonal_factor: f64,
}

/// Rows and entries of one part of the factor while it is computed.
struct Part<'a, T> {
    rows: Range<usize>,
    /// Rows of the slabs this part may touch; empty for a slab.
    slabs: Range<usize>,
    lower: &'a mut [T],
    inverse_pivots: &'a mut [T],
}

impl<T: Number> Incomplete<T> {
    /// Factors the matrix with the entries `entry(row, k)`, `k` the place of the stored entry in the row `row` of the
    /// analysed pattern. The diagonal is multiplied by `diagonal_factor` first, and by more where a pivot is bad.
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] when a diagonal entry is zero or not finite, or pivots stay bad.
    pub fn new(
        analysis: &Arc<IncompleteAnalysis>,
        entry: impl Fn(usize, usize) -> T + Sync,
        diagonal_factor: f64,
    ) -> Result<Self, MeshError> {
        let failed = |cause: String| MeshError::Factorisation { unknowns: analysis.size(), cause };
        let structure = &analysis.structure;
        let modulus = |&old: &u32| {
            let range = structure.row(old as usize);
            let place = structure.columns[range.clone()].binary_search(&old).ok();
            place.map_or(0.0, |k| entry(old as usize, range.start + k).modulus())
        };
        let diagonal: Vec<f64> = analysis.order.par_iter().map(modulus).collect();
        let is_bad = |own: &(&u32, &f64)| !(*own.1 > 0.0 && own.1.is_finite());
        if let Some((row, diagonal)) =
            analysis.order.iter().zip(&diagonal).filter(is_bad).min_by_key(|own| own.0)
        {
            let expected = "expected a finite number other than zero";
            return Err(failed(format!(
                "the diagonal entry of row {row} has the modulus {diagonal}, {expected}"
            )));
        }
        let scales = diagonal.into_iter().map(|diagonal| T::from_real(1.0 / diagonal.sqrt())).collect();
        let zeros = |count| vec![T::default(); count];
        let (lower, inverse_pivots) = (zeros(analysis.columns.len()), zeros(analysis.size()));
        let analysis = Arc::clone(analysis);
        let mut factor = Self { analysis, scales, lower, inverse_pivots, diagonal_factor };
        for _ in 0..ATTEMPTS {
            if factor.attempt(&entry) {
                return Ok(factor);
            }
            factor.diagonal_factor = 1.0 + RAISE * (factor.diagonal_factor - 1.0).max(0.01);
        }
        let raised = factor.diagonal_factor;
        Err(failed(format!(
            "a pivot of the incomplete factor stays bad even with the diagonal times {raised:.1}"
        )))
    }

    /// What the diagonal was multiplied by in the end.
    pub fn diagonal_factor(&self) -> f64 {
        self.diagonal_factor
    }

    /// Memory of the factor [bytes], without the analysis.
    pub fn bytes(&self) -> usize {
        (self.scales.capacity() + self.lower.capacity() + self.inverse_pivots.capacity()) * size_of::<T>()
    }

    /// Factors once with the present diagonal factor; `false` where a pivot is bad.
    #[expect(clippy::disallowed_methods, reason = "`and` of bools has no order")]
    fn attempt(&mut self, entry: &(impl Fn(usize, usize) -> T + Sync)) -> bool {
        let Self { analysis, scales, lower, inverse_pivots, diagonal_factor } = self;
        let rows = analysis.interior();
        let (interior, border) = lower.split_at_mut(analysis.row_starts[rows] as usize);
        let (interior_pivots, border_pivots) = inverse_pivots.split_at_mut(rows);
        let kernel = Kernel { analysis, scales, factor: T::from_real(*diagonal_factor), entry };
        let slabs = cut(analysis, &analysis.slabs, interior, interior_pivots, |_| 0..0);
        if !slabs.into_par_iter().map(|part| kernel.factor(part, &[], &[])).reduce(|| true, |a, b| a && b) {
            return false;
        }
        let touched = |t: usize| analysis.slabs[t].start..analysis.slabs[t + 1].end;
        let separators = cut(analysis, &analysis.separators, border, border_pivots, touched);
        separators
            .into_par_iter()
            .map(|part| kernel.factor(part, interior, interior_pivots))
            .reduce(|| true, |a, b| a && b)
    }
}

/// What the numeric factorisation of a part needs to know.
struct Kernel<'a, T, E> {
    analysis: &'a IncompleteAnalysis,
    scales: &'a [T],
    factor: T,
    entry: &'a E,
}

impl<T: Number, E: Fn(usize, usize) -> T + Sync> Kernel<'_, T, E> {
    /// Computes the rows of one part, given the finished ones of the slabs; `false` where a pivot is bad.
    fn factor(&self, part: Part<'_, T>, interior: &[T], interior_pivots: &[T]) -> bool {
        let analysis = self.analysis;
        let Part { rows, slabs, lower, inverse_pivots } = part;
        let first = analysis.row_starts[rows.start] as usize;
        // Work space over the columns that the part can have: those of its slabs, then its own.
        let place = |c: usize| if c >= rows.start { slabs.len() + c - rows.start } else { c - slabs.start };
        let mut work = vec![T::default(); slabs.len() + rows.len()];
        for i in rows.clone() {
            let old = analysis.order[i] as usize;
            let mut pivot = T::default();
            let range = analysis.structure.row(old);
            for (k, &c) in range.clone().zip(&analysis.structure.columns[range]) {
                let c = analysis.inverse[c as usize] as usize;
                if c <= i {
                    let value = (self.entry)(old, k) * self.scales[i] * self.scales[c];
                    if c < i { work[place(c)] = value } else { pivot = value }
                }
            }
            let diagonal = pivot;
            pivot = pivot * self.factor;
            for k in analysis.entries(&(i..i + 1)) {
                let c = analysis.columns[k] as usize;
                let mut sum = work[place(c)];
                let row = analysis.entries(&(c..c + 1));
                let inverse = if c < rows.start {
                    for (&l, &j) in interior[row.clone()].iter().zip(&analysis.columns[row]) {
                        sum -= l * work[place(j as usize)];
                    }
                    interior_pivots[c]
                } else {
                    let own = row.start - first..row.end - first;
                    for (&l, &j) in lower[own].iter().zip(&analysis.columns[row]) {
                        sum -= l * work[place(j as usize)];
                    }
                    inverse_pivots[c - rows.start]
                };
                work[place(c)] = sum;
                let l = sum * inverse;
                pivot -= sum * l;
                lower[k - first] = l;
            }
            for k in analysis.entries(&(i..i + 1)) {
                work[place(analysis.columns[k] as usize)] = T::default();
            }
            if !(pivot.along(diagonal) >= LEAST_PIVOT && pivot.modulus().is_finite()) {
                return false;
            }
            inverse_pivots[i - rows.start] = pivot.reciprocal();
        }
        true
    }
}

/// The parts of a factor with contiguous rows, each with its entries.
fn cut<'a, T>(
    analysis: &IncompleteAnalysis,
    ranges: &[Range<usize>],
    mut lower: &'a mut [T],
    mut inverse_pivots: &'a mut [T],
    touched: impl Fn(usize) -> Range<usize>,
) -> Vec<Part<'a, T>> {
    let mut parts = Vec::with_capacity(ranges.len());
    for (t, rows) in ranges.iter().enumerate() {
        let (own, rest) = std::mem::take(&mut lower).split_at_mut(analysis.entries(rows).len());
        lower = rest;
        let (own_pivots, rest) = std::mem::take(&mut inverse_pivots).split_at_mut(rows.len());
        inverse_pivots = rest;
        parts.push(Part { rows: rows.clone(), slabs: touched(t), lower: own, inverse_pivots: own_pivots });
    }
    parts
}

#[cfg(test)]
mod tests;
