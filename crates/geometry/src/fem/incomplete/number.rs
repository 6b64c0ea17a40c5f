//! What an incomplete factor asks of its entries: real or complex, in single or double precision.

use std::fmt::Debug;
use std::ops::{Add, Mul, Sub, SubAssign};

use num_complex::Complex;

/// An entry of an incomplete factor.
pub trait Number:
    Copy
    + Default
    + Debug
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + SubAssign
    + 'static
{
    /// A real number in this type.
    fn from_real(x: f64) -> Self;
    /// `|x|`.
    fn modulus(self) -> f64;
    /// `1/x`.
    fn reciprocal(self) -> Self;
    /// The component along `direction`, a number of modulus one: `Re(x · direction*)`.
    fn along(self, direction: Self) -> f64;
}

macro_rules! real {
    ($($t:ty),*) => {$(
        impl Number for $t {
            #[inline]
            fn from_real(x: f64) -> Self {
                x as Self
            }
            #[inline]
            fn modulus(self) -> f64 {
                f64::from(self).abs()
            }
            #[inline]
            fn reciprocal(self) -> Self {
                1.0 / self
            }
            #[inline]
            fn along(self, direction: Self) -> f64 {
                f64::from(self) * f64::from(direction)
            }
        }

        impl Number for Complex<$t> {
            #[inline]
            fn from_real(x: f64) -> Self {
                Self::new(x as $t, 0.0)
            }
            #[inline]
            fn modulus(self) -> f64 {
                f64::from(self.re).hypot(f64::from(self.im))
            }
            #[inline]
            fn reciprocal(self) -> Self {
                self.inv()
            }
            #[inline]
            fn along(self, direction: Self) -> f64 {
                f64::from(self.re) * f64::from(direction.re) + f64::from(self.im) * f64::from(direction.im)
            }
        }
    )*};
}

real!(f32, f64);
