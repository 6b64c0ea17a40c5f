//! The four number types of a factor, as the dense kernels of a panel know them.

use faer::traits::ComplexField;
use num_complex::Complex;

use super::lanes::Lanes;

/// A number that panels hold: `f32`, `f64`, and complex numbers of these.
pub trait PanelScalar:
    ComplexField
    + Lanes
    + std::fmt::Display
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
}

macro_rules! real {
    ($real:ty) => {
        impl PanelScalar for $real {
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
        }

        impl PanelScalar for Complex<$real> {
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
