//! The number types of the systems, and sums whose bits do not depend on the number of threads.

use std::ops::Range;

use rayon::prelude::*;

/// Double-precision complex number.
#[allow(non_camel_case_types)]
pub type c64 = num_complex::Complex64;

/// Single-precision complex number, for factors that only precondition.
#[allow(non_camel_case_types)]
pub type c32 = num_complex::Complex32;

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

    /// `x += real`.
    fn add_real(&mut self, real: f64);
}

impl Scalar for f64 {
    #[inline]
    fn norm_squared(self) -> f64 {
        self * self
    }

    #[inline]
    fn add_real(&mut self, real: f64) {
        *self += real;
    }
}

impl Scalar for c64 {
    #[inline]
    fn norm_squared(self) -> f64 {
        self.norm_sqr()
    }

    #[inline]
    fn add_real(&mut self, real: f64) {
        self.re += real;
    }
}

impl Scalar for c32 {
    #[inline]
    fn norm_squared(self) -> f64 {
        f64::from(self.norm_sqr())
    }

    #[inline]
    fn add_real(&mut self, real: f64) {
        self.re += real as f32;
    }
}

/// Terms per chunk of a sum: chunks are summed in parallel and combined in order.
const CHUNK: usize = 4096;

/// Running sums of a chunk: a processor adds several at a time where each waits for the one before.
const LANES: usize = 4;

/// `Σ_i term(i)` for `i < n`: fixed chunks combined in order, so that the result has the same bits for any number of
/// threads.
pub fn ordered_sum<T: Scalar>(n: usize, term: impl Fn(usize) -> T + Sync) -> T {
    let chunks: Vec<T> =
        (0..n.div_ceil(CHUNK)).into_par_iter().map(|c| lane_sum(chunk(c, n), &term)).collect();
    chunks.into_iter().sum()
}

/// Indices of chunk `c` of `n` terms.
fn chunk(c: usize, n: usize) -> Range<usize> {
    c * CHUNK..n.min((c + 1) * CHUNK)
}

/// The sum over a range in interleaved lanes, which are then added up.
#[inline]
fn lane_sum<T: Scalar>(range: Range<usize>, mut term: impl FnMut(usize) -> T) -> T {
    let mut lanes = [T::default(); LANES];
    let whole = range.start + range.len() / LANES * LANES;
    for first in (range.start..whole).step_by(LANES) {
        for (l, lane) in lanes.iter_mut().enumerate() {
            *lane += term(first + l);
        }
    }
    for i in whole..range.end {
        lanes[0] += term(i);
    }
    lanes.into_iter().sum()
}

/// The bilinear product `Σ x_i y_i`, without conjugation: the one that complex symmetric systems need.
///
/// # Panics
/// If the lengths differ.
pub fn dot<T: Scalar>(x: &[T], y: &[T]) -> T {
    let [product] = dots(x, [y]);
    product
}

/// The bilinear products of `x` with several vectors, in one pass.
///
/// # Panics
/// If the lengths differ.
pub fn dots<T: Scalar, const N: usize>(x: &[T], ys: [&[T]; N]) -> [T; N] {
    let n = x.len();
    assert!(ys.iter().all(|y| y.len() == n), "vectors of one length");
    let of_chunk = |c: usize| {
        let x = &x[chunk(c, n)];
        ys.map(|y| {
            // Of one length that the compiler knows, so that it checks no index.
            let y = &y[chunk(c, n)][..x.len()];
            lane_sum(0..x.len(), |i| x[i] * y[i])
        })
    };
    let chunks: Vec<[T; N]> = (0..n.div_ceil(CHUNK)).into_par_iter().map(of_chunk).collect();
    std::array::from_fn(|k| chunks.iter().map(|sums| sums[k]).sum())
}

/// The Euclidean norm `sqrt(Σ |x_i|²)`.
pub fn norm<T: Scalar>(x: &[T]) -> f64 {
    ordered_sum(x.len(), |i| x[i].norm_squared()).sqrt()
}

/// `y += a x`.
///
/// # Panics
/// If the lengths differ.
pub fn axpy<T: Scalar>(a: T, x: &[T], y: &mut [T]) {
    assert_eq!(x.len(), y.len(), "vectors of one length");
    y.par_chunks_mut(CHUNK).zip(x.par_chunks(CHUNK)).for_each(|(y, x)| {
        for (y, &x) in y.iter_mut().zip(x) {
            *y += a * x;
        }
    });
}

/// `y = x + a y`: the new direction of conjugate gradients.
///
/// # Panics
/// If the lengths differ.
pub fn scale_add<T: Scalar>(a: T, y: &mut [T], x: &[T]) {
    assert_eq!(x.len(), y.len(), "vectors of one length");
    y.par_chunks_mut(CHUNK).zip(x.par_chunks(CHUNK)).for_each(|(y, x)| {
        for (y, &x) in y.iter_mut().zip(x) {
            *y = x + a * *y;
        }
    });
}

/// `x += a p` and `r −= a q` in one pass, and the norm of the new `r`: the step of conjugate gradients.
///
/// The norm has the bits of [`norm`], for any number of threads.
///
/// # Panics
/// If the lengths differ.
pub fn advance<T: Scalar>(a: T, (x, p): (&mut [T], &[T]), (r, q): (&mut [T], &[T])) -> f64 {
    let n = x.len();
    assert!(p.len() == n && r.len() == n && q.len() == n, "vectors of one length");
    let chunks: Vec<f64> = x
        .par_chunks_mut(CHUNK)
        .zip(r.par_chunks_mut(CHUNK))
        .zip(p.par_chunks(CHUNK).zip(q.par_chunks(CHUNK)))
        .map(|((x, r), (p, q))| {
            for (x, &p) in x.iter_mut().zip(p) {
                *x += a * p;
            }
            for (r, &q) in r.iter_mut().zip(q) {
                *r = *r - a * q;
            }
            lane_sum(0..r.len(), |i| r[i].norm_squared())
        })
        .collect();
    chunks.into_iter().sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::determinism::same_on_any_threads;

    #[test]
    fn sums_have_the_same_bits_for_any_number_of_threads() {
        let x: Vec<f64> = (0..50_000).map(|i| (f64::from(i) * 0.7).sin() * 1e3_f64.powi(i % 7)).collect();
        same_on_any_threads(|| dot(&x, &x).to_bits());
    }

    #[test]
    fn the_complex_product_does_not_conjugate() {
        let x = [c64::new(0.0, 1.0)];
        assert_eq!(dot(&x, &x), c64::new(-1.0, 0.0));
        assert_eq!(norm(&x), 1.0);
    }

    #[test]
    fn the_updates_of_conjugate_gradients_are_what_they_say_for_any_number_of_threads() {
        // More than two chunks, and a rest that fills no lane.
        let n = 2 * CHUNK + 3;
        let vector = |s: f64| -> Vec<c64> {
            (0..n).map(|i| c64::new((s * i as f64).sin(), (s + i as f64).cos())).collect()
        };
        let a = c64::new(0.3, -1.1);
        let (x, r, _) = same_on_any_threads(|| {
            let (mut x, p, mut r, q) = (vector(0.1), vector(0.2), vector(0.3), vector(0.4));
            let length = advance(a, (&mut x, &p), (&mut r, &q));
            assert_eq!(length.to_bits(), norm(&r).to_bits());
            assert_eq!(dots(&p, [&q, &r]), [dot(&p, &q), dot(&p, &r)]);
            axpy(a, &q, &mut x);
            scale_add(a, &mut r, &p);
            (x, r, length)
        });
        let (x0, p, r0, q) = (vector(0.1), vector(0.2), vector(0.3), vector(0.4));
        for i in [0, CHUNK - 1, CHUNK, n - 1] {
            assert_eq!(x[i], x0[i] + a * p[i] + a * q[i]);
            assert_eq!(r[i], p[i] + a * (r0[i] - a * q[i]));
        }
    }
}
