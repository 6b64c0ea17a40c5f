//! The number types of the systems, and sums whose bits do not depend on the number of threads.

use rayon::prelude::*;

/// Double-precision complex number.
#[allow(non_camel_case_types)]
pub type c64 = num_complex::Complex64;

/// A real or complex matrix entry.
pub trait Scalar:
    Copy
    + Default
    + PartialEq
    + std::fmt::Debug
    + Send
    + Sync
    + std::ops::Add<Output = Self>
    + std::ops::Sub<Output = Self>
    + std::ops::AddAssign
    + std::ops::Mul<Output = Self>
    + std::iter::Sum
{
    /// `|x|²`.
    fn norm_squared(self) -> f64;
}

impl Scalar for f64 {
    #[inline]
    fn norm_squared(self) -> f64 {
        self * self
    }
}

impl Scalar for c64 {
    #[inline]
    fn norm_squared(self) -> f64 {
        self.norm_sqr()
    }
}

/// Terms per chunk of a sum: chunks are summed in parallel and combined in order.
const CHUNK: usize = 4096;

/// `Σ_i term(i)` for `i < n`: fixed chunks combined in order, so that the result has the same bits for any number of
/// threads.
pub fn ordered_sum<T: Scalar>(n: usize, term: impl Fn(usize) -> T + Sync) -> T {
    let chunk_sum = |c: usize| (c * CHUNK..n.min((c + 1) * CHUNK)).map(&term).sum::<T>();
    let partial: Vec<T> = (0..n.div_ceil(CHUNK)).into_par_iter().map(chunk_sum).collect();
    partial.into_iter().sum()
}

/// The bilinear product `Σ x_i y_i`, without conjugation: the one that complex symmetric systems need.
pub fn dot<T: Scalar>(x: &[T], y: &[T]) -> T {
    debug_assert_eq!(x.len(), y.len());
    ordered_sum(x.len().min(y.len()), |i| x[i] * y[i])
}

/// The Euclidean norm `sqrt(Σ |x_i|²)`.
pub fn norm<T: Scalar>(x: &[T]) -> f64 {
    ordered_sum(x.len(), |i| x[i].norm_squared()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_have_the_same_bits_for_any_number_of_threads() {
        let x: Vec<f64> = (0..50_000).map(|i| (f64::from(i) * 0.7).sin() * 1e3_f64.powi(i % 7)).collect();
        let with_threads = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| dot(&x, &x)).to_bits()
        };
        assert_eq!(with_threads(1), with_threads(2));
        assert_eq!(with_threads(1), with_threads(4));
    }

    #[test]
    fn the_complex_product_does_not_conjugate() {
        let x = [c64::new(0.0, 1.0)];
        assert_eq!(dot(&x, &x), c64::new(-1.0, 0.0));
        assert_eq!(norm(&x), 1.0);
    }
}
