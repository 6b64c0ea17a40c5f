//! Vectors of numbers as the processor has them, and the two loops over columns that solves are made of.
//!
//! `pulp` chooses the instructions when the program runs: AVX2 with fused multiply-add where there is, whatever the program
//! was compiled for. Lane by lane the order of a sum is fixed, so that bits are the same for any number of threads; they may
//! differ between processors with other instructions.

use pulp::{Simd, bytemuck};

/// A number with vectors of it.
pub trait Lanes: Copy + Default + Send + Sync + std::ops::AddAssign + std::ops::SubAssign + 'static {
    /// A vector.
    type Vector<S: Simd>: Copy + bytemuck::Pod;

    /// Whole vectors, and what is left.
    fn vectors<S: Simd>(values: &[Self]) -> (&[Self::Vector<S>], &[Self]);

    /// Whole vectors, and what is left, to be written.
    fn vectors_mut<S: Simd>(values: &mut [Self]) -> (&mut [Self::Vector<S>], &mut [Self]);

    /// A number in every lane.
    fn splat<S: Simd>(simd: S, value: Self) -> Self::Vector<S>;

    /// Less than a vector; zero in the lanes behind.
    fn load_part<S: Simd>(simd: S, values: &[Self]) -> Self::Vector<S>;

    /// The first lanes.
    fn store_part<S: Simd>(simd: S, values: &mut [Self], vector: Self::Vector<S>);

    /// `a b + c`.
    fn multiply_add<S: Simd>(
        simd: S,
        a: Self::Vector<S>,
        b: Self::Vector<S>,
        c: Self::Vector<S>,
    ) -> Self::Vector<S>;

    /// Sum over the lanes.
    fn sum<S: Simd>(simd: S, vector: Self::Vector<S>) -> Self;
}

macro_rules! lanes {
    ($scalar:ty, $vector:ident, $vectors:ident, $vectors_mut:ident, $splat:ident, $load:ident, $store:ident, $fma:ident, $sum:ident) => {
        impl Lanes for $scalar {
            type Vector<S: Simd> = S::$vector;

            #[inline(always)]
            fn vectors<S: Simd>(values: &[Self]) -> (&[S::$vector], &[Self]) {
                S::$vectors(values)
            }

            #[inline(always)]
            fn vectors_mut<S: Simd>(values: &mut [Self]) -> (&mut [S::$vector], &mut [Self]) {
                S::$vectors_mut(values)
            }

            #[inline(always)]
            fn splat<S: Simd>(simd: S, value: Self) -> S::$vector {
                simd.$splat(value)
            }

            #[inline(always)]
            fn load_part<S: Simd>(simd: S, values: &[Self]) -> S::$vector {
                simd.$load(values)
            }

            #[inline(always)]
            fn store_part<S: Simd>(simd: S, values: &mut [Self], vector: S::$vector) {
                simd.$store(values, vector);
            }

            #[inline(always)]
            fn multiply_add<S: Simd>(simd: S, a: S::$vector, b: S::$vector, c: S::$vector) -> S::$vector {
                simd.$fma(a, b, c)
            }

            #[inline(always)]
            fn sum<S: Simd>(simd: S, vector: S::$vector) -> Self {
                simd.$sum(vector)
            }
        }
    };
}

lanes!(
    f32,
    f32s,
    as_simd_f32s,
    as_mut_simd_f32s,
    splat_f32s,
    partial_load_f32s,
    partial_store_f32s,
    mul_add_e_f32s,
    reduce_sum_f32s
);
lanes!(
    f64,
    f64s,
    as_simd_f64s,
    as_mut_simd_f64s,
    splat_f64s,
    partial_load_f64s,
    partial_store_f64s,
    mul_add_e_f64s,
    reduce_sum_f64s
);
lanes!(
    pulp::c32,
    c32s,
    as_simd_c32s,
    as_mut_simd_c32s,
    splat_c32s,
    partial_load_c32s,
    partial_store_c32s,
    mul_add_e_c32s,
    reduce_sum_c32s
);
lanes!(
    pulp::c64,
    c64s,
    as_simd_c64s,
    as_mut_simd_c64s,
    splat_c64s,
    partial_load_c64s,
    partial_store_c64s,
    mul_add_e_c64s,
    reduce_sum_c64s
);

// Arrays are filled by loops here and in the kernels that call this: `<[_; N]>::map` would be compiled anew, some three
// hundred lines of it, for every closure, number type and set of instructions.

/// `y_s += Σ_k a_sk x_k` over the columns `x` and the sides `s`, which begin at `from`; columns of one length.
#[inline(always)]
pub(super) fn add_columns<T: Lanes, S: Simd, const K: usize, const SIDES: usize>(
    simd: S,
    columns: [&[T]; K],
    factors: [[T; K]; SIDES],
    sides: &mut [&mut [T]; SIDES],
    from: usize,
) {
    let length = columns[0].len();
    let (heads, tails) = parts::<T, S, K>(columns, length);
    let mut splat = [[T::splat(simd, T::default()); K]; SIDES];
    for s in 0..SIDES {
        for k in 0..K {
            splat[s][k] = T::splat(simd, factors[s][k]);
        }
    }
    let whole = heads[0].len();
    let mut split: [SplitMut<'_, T, S>; SIDES] = std::array::from_fn(|_| Default::default());
    for (split, side) in split.iter_mut().zip(sides) {
        let (head, tail) = T::vectors_mut::<S>(&mut side[from..][..length]);
        *split = (&mut head[..whole], tail);
    }
    for i in 0..whole {
        for s in 0..SIDES {
            let mut y = split[s].0[i];
            for k in 0..K {
                y = T::multiply_add(simd, splat[s][k], heads[k][i], y);
            }
            split[s].0[i] = y;
        }
    }
    if !tails[0].is_empty() {
        for s in 0..SIDES {
            let mut y = T::load_part(simd, split[s].1);
            for k in 0..K {
                y = T::multiply_add(simd, splat[s][k], T::load_part(simd, tails[k]), y);
            }
            T::store_part(simd, split[s].1, y);
        }
    }
}

/// `Σ_i x_ki y_si` of every column `x` with every side `y`, without conjugation.
#[inline(always)]
pub(super) fn products<T: Lanes, S: Simd, const K: usize, const SIDES: usize>(
    simd: S,
    columns: [&[T]; K],
    sides: [&[T]; SIDES],
) -> [[T; K]; SIDES] {
    let length = columns[0].len();
    let (heads, tails) = parts::<T, S, K>(columns, length);
    let (side_heads, side_tails) = parts::<T, S, SIDES>(sides, length);
    let whole = heads[0].len();
    let mut sums = [[T::splat(simd, T::default()); K]; SIDES];
    for i in 0..whole {
        for s in 0..SIDES {
            for k in 0..K {
                sums[s][k] = T::multiply_add(simd, side_heads[s][i], heads[k][i], sums[s][k]);
            }
        }
    }
    if !tails[0].is_empty() {
        for s in 0..SIDES {
            let side = T::load_part(simd, side_tails[s]);
            for k in 0..K {
                sums[s][k] = T::multiply_add(simd, side, T::load_part(simd, tails[k]), sums[s][k]);
            }
        }
    }
    let mut totals = [[T::default(); K]; SIDES];
    for s in 0..SIDES {
        for k in 0..K {
            totals[s][k] = T::sum(simd, sums[s][k]);
        }
    }
    totals
}

/// Whole vectors of several columns, and what is left of each.
type Split<'a, T, S, const N: usize> = ([&'a [<T as Lanes>::Vector<S>]; N], [&'a [T]; N]);

/// Whole vectors of a side, and what is left of it.
type SplitMut<'a, T, S> = (&'a mut [<T as Lanes>::Vector<S>], &'a mut [T]);

/// The first `length` numbers of several columns; all heads are as long as the first.
#[inline(always)]
fn parts<T: Lanes, S: Simd, const N: usize>(values: [&[T]; N], length: usize) -> Split<'_, T, S, N> {
    let mut heads: [&[T::Vector<S>]; N] = [&[]; N];
    let mut tails = values;
    for n in 0..N {
        (heads[n], tails[n]) = T::vectors::<S>(&values[n][..length]);
    }
    let whole = heads[0].len();
    for head in &mut heads {
        *head = &head[..whole];
    }
    (heads, tails)
}
