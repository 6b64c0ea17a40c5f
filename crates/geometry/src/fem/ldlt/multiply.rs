//! Products of two dense blocks, `C = A Bᵀ` or `C −= A Bᵀ`, by columns, in one thread: large ones by faer, small ones and
//! triangles here.
//!
//! Complex blocks are taken as real ones: with `B = B' + j B''`, the products of the interleaved reals of `A` with `B'` and
//! with `B''` are added up at the end, as `(re, im)` and `(−im, re)`. A strip of three vectors of rows of `A` is copied
//! into the first cache and meets all columns of `B`, four reals at a time: twelve sums in registers (K. Goto and
//! R. A. van de Geijn, Anatomy of high-performance matrix multiplication, ACM TOMS 34, 2008).

use faer::linalg::matmul::matmul_with_conj;
use faer::mat::{MatMut, MatRef};
use faer::prelude::ReborrowMut;
use faer::{Accum, Conj, Par};
use pulp::{Simd, WithSimd};

use super::dense::{column, column_mut};
use super::lanes::Lanes;
use super::scalar::PanelScalar;

/// Real multiply-adds up to which a product is taken here, not by faer.
const SMALL_PRODUCT: usize = 1 << 15;

/// Columns of a large trapezoid that are taken together: their own triangle here, the rows below by faer.
const TRAPEZOID_COLUMNS: usize = 64;

/// Vectors of a strip of rows.
const STRIP: usize = 3;

/// Real columns that a strip meets at a time.
const GROUP: usize = 4;

/// What becomes of the old content of a product.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Store {
    Overwrite,
    Subtract,
}

/// Which part of a product is wanted.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    Full,
    /// On and below the diagonal that starts in the first row. What lies above may be written, too.
    LowerTrapezoid,
}

/// Copies of the operands in the order in which they are read.
#[derive(Debug)]
pub(super) struct Packing<T: PanelScalar> {
    strip: Vec<T::Part>,
    groups: Vec<T::Part>,
    sums: Vec<T::Part>,
}

impl<T: PanelScalar> Packing<T> {
    pub(super) fn new() -> Self {
        Self { strip: Vec::new(), groups: Vec::new(), sums: Vec::new() }
    }
}

/// `product = a · bᵀ` or `product −= a · bᵀ` of shapes `(m, k)` and `(c, k)`.
pub(super) fn multiply<T: PanelScalar>(
    mut product: MatMut<'_, T>,
    into: Store,
    shape: Shape,
    a: MatRef<'_, T>,
    b: MatRef<'_, T>,
    packing: &mut Packing<T>,
) {
    let (rows, depth, columns) = (a.nrows(), a.ncols(), b.nrows());
    if rows * columns * depth * T::PARTS * T::PARTS <= SMALL_PRODUCT {
        pulp::Arch::new().dispatch(Multiply { product, into, shape, a, b, packing });
        return;
    }
    if shape == Shape::Full {
        return multiply_large(product, into, a, b);
    }
    for first in (0..columns).step_by(TRAPEZOID_COLUMNS) {
        let taken = TRAPEZOID_COLUMNS.min(columns - first);
        let own = product.rb_mut().submatrix_mut(first, first, rows - first, taken);
        let (diagonal, below) = own.split_at_row_mut(taken);
        let (a, b) = (a.subrows(first, rows - first), b.subrows(first, taken));
        let (top, bottom) = a.split_at_row(taken);
        pulp::Arch::new().dispatch(Multiply { product: diagonal, into, shape, a: top, b, packing });
        if bottom.nrows() > 0 {
            multiply_large(below, into, bottom, b);
        }
    }
}

/// By faer, which has wider instructions where the processor does, and copies more.
fn multiply_large<T: PanelScalar>(product: MatMut<'_, T>, into: Store, a: MatRef<'_, T>, b: MatRef<'_, T>) {
    let (accumulate, sign) = match into {
        Store::Overwrite => (Accum::Replace, T::ONE),
        Store::Subtract => (Accum::Add, -T::ONE),
    };
    matmul_with_conj(product, accumulate, a, Conj::No, b.transpose(), Conj::No, sign, Par::Seq);
}

struct Multiply<'a, T: PanelScalar> {
    product: MatMut<'a, T>,
    into: Store,
    shape: Shape,
    a: MatRef<'a, T>,
    b: MatRef<'a, T>,
    packing: &'a mut Packing<T>,
}

impl<T: PanelScalar> WithSimd for Multiply<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { mut product, into, shape, a, b, packing } = self;
        let (rows, depth, columns) = (a.nrows(), a.ncols(), b.nrows());
        let lanes = size_of::<<T::Part as Lanes>::Vector<S>>() / size_of::<T::Part>();
        let strip_reals = STRIP * lanes;
        let (strip_rows, group_columns) = (strip_reals / T::PARTS, GROUP / T::PARTS);
        let groups = columns.div_ceil(group_columns);
        pack_groups(b, groups, &mut packing.groups);
        packing.strip.resize(depth * strip_reals, T::Part::default());
        packing.sums.resize(GROUP * strip_reals, T::Part::default());

        let mut first = 0;
        while first < rows {
            let taken = strip_rows.min(rows - first);
            for (k, packed) in packing.strip.chunks_exact_mut(strip_reals).enumerate() {
                let own = T::reals(&column(&a, k)[first..first + taken]);
                if own.len() == strip_reals {
                    packed.copy_from_slice(own);
                } else {
                    packed[..own.len()].copy_from_slice(own);
                    packed[own.len()..].fill(T::Part::default());
                }
            }
            let (strip, _) = T::Part::vectors::<S>(&packing.strip);
            let last = first + taken;
            for g in 0..groups {
                let from = g * group_columns;
                if shape == Shape::LowerTrapezoid && from >= last {
                    break;
                }
                let group = &packing.groups[g * GROUP * depth..(g + 1) * GROUP * depth];
                let tile = tile::<T::Part, S>(simd, strip, group);
                let (sums, _) = T::Part::vectors_mut::<S>(&mut packing.sums);
                for (sums, tile) in sums.chunks_exact_mut(STRIP).zip(tile) {
                    sums.copy_from_slice(&tile);
                }
                for j in 0..group_columns.min(columns - from) {
                    let sums = &packing.sums[j * T::PARTS * strip_reals..(j + 1) * T::PARTS * strip_reals];
                    let own = &mut column_mut(&mut product, from + j)[first..last];
                    match into {
                        Store::Subtract => T::combine(sums, own, |own, value| *own -= value),
                        Store::Overwrite => T::combine(sums, own, |own, value| *own = value),
                    }
                }
            }
            first = last;
        }
    }
}

/// `GROUP` reals of every column after the other, for each group.
#[inline(always)]
fn pack_groups<T: PanelScalar>(b: MatRef<'_, T>, groups: usize, packed: &mut Vec<T::Part>) {
    let depth = b.ncols();
    packed.clear();
    packed.resize(groups * depth * GROUP, T::Part::default());
    for k in 0..depth {
        let reals = T::reals(column(&b, k));
        let (whole, rest) = reals.as_chunks::<GROUP>();
        for (g, values) in whole.iter().enumerate() {
            packed[(g * depth + k) * GROUP..][..GROUP].copy_from_slice(values);
        }
        if !rest.is_empty() {
            packed[(whole.len() * depth + k) * GROUP..][..rest.len()].copy_from_slice(rest);
        }
    }
}

/// The products of a strip with a group.
#[inline(always)]
fn tile<R: Lanes, S: Simd>(simd: S, strip: &[R::Vector<S>], group: &[R]) -> [[R::Vector<S>; STRIP]; GROUP] {
    let zero = R::splat(simd, R::default());
    let mut sums = [[zero; STRIP]; GROUP];
    let (strip, _) = strip.as_chunks::<STRIP>();
    let (group, _) = group.as_chunks::<GROUP>();
    for (a, b) in strip.iter().zip(group) {
        for j in 0..GROUP {
            let b = R::splat(simd, b[j]);
            for i in 0..STRIP {
                sums[j][i] = R::multiply_add(simd, a[i], b, sums[j][i]);
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use num_complex::{Complex32, Complex64};

    use super::*;

    /// `(rows, columns, depth)`: less than a vector, odd remainders, a triangle of several groups, and a product of faer's.
    const SHAPES: [(usize, usize, usize); 5] =
        [(1, 1, 1), (7, 5, 3), (33, 12, 9), (70, 67, 11), (130, 40, 50)];

    /// Multiples of 1/8 below 2: all sums here are exact in single precision.
    fn eighths(seed: usize) -> f32 {
        (((seed * 2_654_435_761) >> 7) % 31) as f32 / 8.0 - 1.875
    }

    fn check<T: PanelScalar + PartialEq>(of: impl Fn(f32, f32) -> T) {
        for (rows, columns, depth) in SHAPES {
            let block = |start: usize, count: usize| -> Vec<T> {
                (start..start + count).map(|i| of(eighths(2 * i), eighths(2 * i + 1))).collect()
            };
            let (a, b) = (block(0, rows * depth), block(7919, columns * depth));
            let old = block(104_729, rows * columns);
            let by_hand = |i: usize, j: usize| {
                let mut sum = T::default();
                for q in 0..depth {
                    sum += a[i + q * rows] * b[j + q * columns];
                }
                sum
            };
            for (store, shape) in [
                (Store::Overwrite, Shape::Full),
                (Store::Subtract, Shape::Full),
                (Store::Subtract, Shape::LowerTrapezoid),
            ] {
                let mut product = old.clone();
                multiply(
                    MatMut::from_column_major_slice_mut(&mut product, rows, columns),
                    store,
                    shape,
                    MatRef::from_column_major_slice(&a, rows, depth),
                    MatRef::from_column_major_slice(&b, columns, depth),
                    &mut Packing::new(),
                );
                for (j, i) in (0..columns).flat_map(|j| (0..rows).map(move |i| (j, i))) {
                    if shape == Shape::LowerTrapezoid && i < j {
                        continue;
                    }
                    let mut expected = old[i + j * rows];
                    expected -= by_hand(i, j);
                    let expected = if store == Store::Overwrite { by_hand(i, j) } else { expected };
                    assert!(product[i + j * rows] == expected, "{rows} {columns} {depth}: {i} {j}");
                }
            }
        }
    }

    #[test]
    fn products_are_those_by_hand_in_all_number_types() {
        check::<f32>(|re, _| re);
        check::<f64>(|re, _| f64::from(re));
        check::<Complex32>(Complex32::new);
        check::<Complex64>(|re, im| Complex64::new(f64::from(re), f64::from(im)));
    }
}
