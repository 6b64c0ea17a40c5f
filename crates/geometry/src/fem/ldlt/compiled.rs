//! Factorisation and solves, compiled here once for each of the four number types: as generic functions they would be
//! compiled again, dense kernels and all, in every crate that calls them.

use std::sync::Arc;

use num_complex::Complex;

use super::analysis::LdltAnalysis;
use super::factor::{self, Entry, KeptPanels, Ldlt};
use super::scalar::PanelScalar;
use super::solve;
use crate::error::MeshError;

/// A number that a matrix can be factored in: `f32`, `f64`, and complex numbers of these.
pub trait FactorScalar: PanelScalar {
    /// What [`Ldlt::new_keeping`] does.
    ///
    /// # Errors
    /// Those of [`Ldlt::new`].
    fn factor(
        analysis: &Arc<LdltAnalysis>,
        entry: &Entry<'_, Self>,
        kept: Option<&KeptPanels<Self>>,
    ) -> Result<Ldlt<Self>, MeshError>;

    /// What [`Ldlt::solve_in_place`] does.
    ///
    /// # Panics
    /// If the length of `columns` is not a multiple of the size.
    fn solve(factor: &Ldlt<Self>, columns: &mut [Self]);
}

macro_rules! compiled {
    ($($scalar:ty),*) => {$(
        impl FactorScalar for $scalar {
            #[inline(never)]
            fn factor(
                analysis: &Arc<LdltAnalysis>,
                entry: &Entry<'_, Self>,
                kept: Option<&KeptPanels<Self>>,
            ) -> Result<Ldlt<Self>, MeshError> {
                factor::factor(analysis, entry, kept)
            }

            #[inline(never)]
            fn solve(factor: &Ldlt<Self>, columns: &mut [Self]) {
                solve::solve_in_place(factor, columns);
            }
        }
    )*};
}

compiled!(f32, f64, Complex<f32>, Complex<f64>);

impl<T: FactorScalar> Ldlt<T> {
    /// Factors a matrix whose pattern was analysed. `entry(row, k)` is the value of the stored entry `k` of the structure,
    /// which lies in `row`; it is called up to three times for every entry, from any thread.
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] when a pivot is zero or not finite, or the factor does not fit the memory.
    pub fn new(
        analysis: &Arc<LdltAnalysis>,
        entry: impl Fn(usize, usize) -> T + Sync,
    ) -> Result<Self, MeshError> {
        T::factor(analysis, &entry, None)
    }

    /// The same of a real matrix that must be positive definite.
    ///
    /// # Errors
    /// As [`Ldlt::new`], and when a pivot is negative.
    pub fn positive_definite(
        analysis: &Arc<LdltAnalysis>,
        entry: impl Fn(usize, usize) -> T + Sync,
    ) -> Result<Self, MeshError>
    where
        T: PartialOrd,
    {
        Self::new(analysis, entry)?.of_positive_definite()
    }

    /// As [`Ldlt::new`] with panels that another factor of this analysis left, wherever the matrix is as it was in all that they
    /// come from: the bits are those of [`Ldlt::new`].
    ///
    /// # Errors
    /// As [`Ldlt::new`].
    pub fn new_keeping(
        analysis: &Arc<LdltAnalysis>,
        entry: impl Fn(usize, usize) -> T + Sync,
        kept: Option<&KeptPanels<T>>,
    ) -> Result<Self, MeshError> {
        T::factor(analysis, &entry, kept)
    }

    /// Solves `A X = B` in place; `columns` holds the right sides one after the other.
    ///
    /// # Panics
    /// If the length of `columns` is not a multiple of the size.
    pub fn solve_in_place(&self, columns: &mut [T]) {
        T::solve(self, columns);
    }
}
