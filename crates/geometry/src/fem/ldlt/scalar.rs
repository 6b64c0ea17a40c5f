//! The four number types a factor can have.
//!
//! Factorisation and solves are compiled here, once for each of them: as generic functions they would be compiled again,
//! dense kernels and all, in every crate that calls them.

use std::sync::Arc;

use faer::traits::ComplexField;
use num_complex::Complex;

use super::analysis::LdltAnalysis;
use super::factor::{self, Ldlt};
use super::lanes::Lanes;
use super::solve;
use crate::error::MeshError;

/// The values of a matrix: `entry(row, k)` is the stored entry `k` of the structure, which lies in `row`.
pub type Entry<'a, T> = dyn Fn(usize, usize) -> T + Sync + 'a;

/// A number that a matrix can be factored in: `f32`, `f64`, and complex numbers of these.
pub trait FactorScalar:
    ComplexField
    + Lanes
    + std::ops::Add<Output = Self>
    + std::ops::Sub<Output = Self>
    + std::ops::Mul<Output = Self>
    + std::ops::Neg<Output = Self>
    + std::ops::MulAssign
{
    /// The number one.
    const ONE: Self;

    /// The real numbers that it consists of.
    type Part: Lanes;

    /// How many.
    const PARTS: usize;

    /// All parts in order.
    fn reals(values: &[Self]) -> &[Self::Part];

    /// `into(target_i, (a b)_i)` of the products `sums` of the parts of `a` with the parts of `b`, one part of `b` after the
    /// other.
    fn combine(sums: &[Self::Part], targets: &mut [Self], into: impl Fn(&mut Self, Self));

    /// `1 / self`, without overflow or underflow on the way; `None` where it is not finite.
    fn inverse(self) -> Option<Self>;

    /// What [`Ldlt::new`] does.
    ///
    /// # Errors
    /// Those of [`Ldlt::new`].
    fn factored(analysis: &Arc<LdltAnalysis>, entry: &Entry<'_, Self>) -> Result<Ldlt<Self>, MeshError>;

    /// What [`Ldlt::solve_in_place`] does.
    ///
    /// # Panics
    /// If the length of `columns` is not a multiple of the size.
    fn solve(factor: &Ldlt<Self>, columns: &mut [Self]);
}

/// The numeric work of one concrete type.
macro_rules! numeric_work {
    () => {
        #[inline(never)]
        fn factored(analysis: &Arc<LdltAnalysis>, entry: &Entry<'_, Self>) -> Result<Ldlt<Self>, MeshError> {
            factor::factored(analysis, entry)
        }

        #[inline(never)]
        fn solve(factor: &Ldlt<Self>, columns: &mut [Self]) {
            solve::solve_in_place(factor, columns);
        }
    };
}

macro_rules! real {
    ($real:ty) => {
        impl FactorScalar for $real {
            const ONE: Self = 1.0;
            type Part = $real;
            const PARTS: usize = 1;

            #[inline(always)]
            fn reals(values: &[Self]) -> &[$real] {
                values
            }

            #[inline(always)]
            fn combine(sums: &[$real], targets: &mut [Self], into: impl Fn(&mut Self, Self)) {
                for (target, &sum) in targets.iter_mut().zip(sums) {
                    into(target, sum);
                }
            }

            #[inline]
            fn inverse(self) -> Option<Self> {
                let inverse = 1.0 / self;
                (self.is_finite() && inverse.is_finite()).then_some(inverse)
            }

            numeric_work!();
        }

        impl FactorScalar for Complex<$real> {
            const ONE: Self = Complex::new(1.0, 0.0);
            type Part = $real;
            const PARTS: usize = 2;

            #[inline(always)]
            fn reals(values: &[Self]) -> &[$real] {
                pulp::bytemuck::cast_slice(values)
            }

            #[inline(always)]
            fn combine(sums: &[$real], targets: &mut [Self], into: impl Fn(&mut Self, Self)) {
                let (by_re, by_im) = sums.split_at(sums.len() / 2);
                let (by_re, by_im) = (by_re.as_chunks::<2>().0, by_im.as_chunks::<2>().0);
                for ((target, re), im) in targets.iter_mut().zip(by_re).zip(by_im) {
                    into(target, Complex::new(re[0] - im[1], re[1] + im[0]));
                }
            }

            /// Smith's division (R. L. Smith, Algorithm 116, CACM 1962): `|z|²` of a single-precision pivot below 1e-19
            /// would underflow.
            #[inline]
            fn inverse(self) -> Option<Self> {
                let inverse = if self.re.abs() >= self.im.abs() {
                    let ratio = self.im / self.re;
                    let scale = 1.0 / (self.re + self.im * ratio);
                    Complex::new(scale, -ratio * scale)
                } else {
                    let ratio = self.re / self.im;
                    let scale = 1.0 / (self.re * ratio + self.im);
                    Complex::new(ratio * scale, -scale)
                };
                (self.is_finite() && inverse.is_finite()).then_some(inverse)
            }

            numeric_work!();
        }
    };
}

real!(f32);
real!(f64);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_pivots_have_an_inverse_and_zero_has_none() {
        let z = Complex::new(3e-25_f32, -4e-25);
        let product = z * z.inverse().expect("it is in range");
        assert!((product - Complex::ONE).norm() < 1e-6, "{product}");
        let z = Complex::new(-1e-3, 2.0);
        assert!((z * z.inverse().expect("it is in range") - Complex::ONE).norm() < 1e-15);
        assert_eq!(Complex::new(0.0, 0.0_f64).inverse(), None);
        assert_eq!(f64::NAN.inverse(), None);
        assert_eq!(f32::INFINITY.inverse(), None);
        assert_eq!(4.0_f64.inverse(), Some(0.25));
    }
}
