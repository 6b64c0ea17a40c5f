//! Solves with one panel and one or two right sides, at the speed of memory: four columns of the factor at a time, each read
//! once for all sides.
//!
//! A side is a column of its own here: the panel's own unknowns, then those of the rows below.

use pulp::{Simd, WithSimd};

use super::lanes::{Lanes, add_columns, products};
use super::scalar::PanelScalar;

/// Columns of the factor that are taken together.
const GROUP: usize = 4;

/// Rows `rows` of the columns of a panel, each of `height` entries.
#[derive(Clone, Copy)]
pub(super) struct Block<'a, T> {
    pub(super) entries: &'a [T],
    pub(super) height: usize,
    pub(super) first_row: usize,
    pub(super) rows: usize,
}

impl<'a, T> Block<'a, T> {
    #[inline(always)]
    fn column(&self, j: usize) -> &'a [T] {
        &self.entries[j * self.height + self.first_row..][..self.rows]
    }

    /// The columns `j..j + K` from row `from` of the block on.
    #[inline(always)]
    fn columns<const K: usize>(&self, j: usize, from: usize) -> [&'a [T]; K] {
        let mut columns: [&[T]; K] = [&[]; K];
        for (k, column) in columns.iter_mut().enumerate() {
            *column = &self.column(j + k)[from..];
        }
        columns
    }

    #[inline(always)]
    fn width(&self) -> usize {
        self.entries.len() / self.height
    }
}

/// `−x_j` of `K` unknowns from `j` on, for every side.
#[inline(always)]
fn negated<T: PanelScalar, X: AsRef<[T]>, const K: usize, const SIDES: usize>(
    x: &[X; SIDES],
    j: usize,
) -> [[T; K]; SIDES] {
    let mut factors = [[T::default(); K]; SIDES];
    for (factors, x) in factors.iter_mut().zip(x) {
        for (k, factor) in factors.iter_mut().enumerate() {
            *factor = -x.as_ref()[j + k];
        }
    }
    factors
}

/// What every side holds from `from` on.
#[inline(always)]
fn shared<'a, T, const SIDES: usize>(sides: &'a [&mut [T]; SIDES], from: usize) -> [&'a [T]; SIDES] {
    let mut shared: [&[T]; SIDES] = [&[]; SIDES];
    for (shared, side) in shared.iter_mut().zip(sides) {
        *shared = &side[from..];
    }
    shared
}

/// `y −= L x`, with the columns of a block that lies below the diagonal.
pub(super) struct Subtract<'a, T, const SIDES: usize> {
    pub(super) block: Block<'a, T>,
    pub(super) x: [&'a [T]; SIDES],
    pub(super) y: [&'a mut [T]; SIDES],
}

impl<T: PanelScalar, const SIDES: usize> WithSimd for Subtract<'_, T, SIDES> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let Self { block, x, .. } = self;
        let width = block.width();
        let grouped = width / GROUP * GROUP;
        for j in (0..grouped).step_by(GROUP) {
            add_columns::<T, S, GROUP, SIDES>(simd, block.columns(j, 0), negated(&x, j), &mut self.y, 0);
        }
        for j in grouped..width {
            add_columns::<T, S, 1, SIDES>(simd, block.columns(j, 0), negated(&x, j), &mut self.y, 0);
        }
    }
}

/// `x −= Lᵀ y`, with columns of a block that lies below the diagonal, from `first` on, as many as `x` has unknowns.
pub(super) struct SubtractTransposed<'a, T, const SIDES: usize> {
    pub(super) block: Block<'a, T>,
    pub(super) first: usize,
    pub(super) x: [&'a mut [T]; SIDES],
    pub(super) y: [&'a [T]; SIDES],
}

impl<T: PanelScalar, const SIDES: usize> WithSimd for SubtractTransposed<'_, T, SIDES> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let Self { block, first, y, .. } = self;
        let width = self.x[0].len();
        let grouped = width / GROUP * GROUP;
        for j in (0..grouped).step_by(GROUP) {
            let sums = products::<T, S, GROUP, SIDES>(simd, block.columns(first + j, 0), y);
            for (x, sums) in self.x.iter_mut().zip(sums) {
                x[j..j + GROUP].iter_mut().zip(sums).for_each(|(x, sum)| *x -= sum);
            }
        }
        for j in grouped..width {
            let sums = products::<T, S, 1, SIDES>(simd, block.columns(first + j, 0), y);
            for (x, [sum]) in self.x.iter_mut().zip(sums) {
                x[j] -= sum;
            }
        }
    }
}

/// `x_J ← L_J⁻¹ x_J`, then `x_R −= L_R x_J`, where the block has all rows of the panel or those of its triangle only.
pub(super) struct Forward<'a, T, const SIDES: usize> {
    pub(super) block: Block<'a, T>,
    pub(super) x: [&'a mut [T]; SIDES],
}

impl<T: PanelScalar, const SIDES: usize> WithSimd for Forward<'_, T, SIDES> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let block = self.block;
        let width = block.width();
        let mut j = 0;
        while j < width {
            let taken = if j + GROUP <= width { GROUP } else { 1 };
            let next = j + taken;
            for x in &mut self.x {
                for k in j..next {
                    let (known, values) = (x[k], block.column(k));
                    for i in k + 1..next {
                        x[i] -= values[i] * known;
                    }
                }
            }
            if taken == GROUP {
                let (columns, factors) = (block.columns(j, next), negated(&self.x, j));
                add_columns::<T, S, GROUP, SIDES>(simd, columns, factors, &mut self.x, next);
            } else {
                let (columns, factors) = (block.columns(j, next), negated(&self.x, j));
                add_columns::<T, S, 1, SIDES>(simd, columns, factors, &mut self.x, next);
            }
            j = next;
        }
    }
}

/// `x_J −= L_Rᵀ x_R`, then `x_J ← L_J⁻ᵀ x_J`, where the block has all rows of the panel or those of its triangle only.
pub(super) struct Backward<'a, T, const SIDES: usize> {
    pub(super) block: Block<'a, T>,
    pub(super) x: [&'a mut [T]; SIDES],
}

impl<T: PanelScalar, const SIDES: usize> WithSimd for Backward<'_, T, SIDES> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let block = self.block;
        let width = block.width();
        let grouped = width / GROUP * GROUP;
        for j in (grouped..width).rev() {
            let columns = block.columns(j, j + 1);
            let sums = products::<T, S, 1, SIDES>(simd, columns, shared(&self.x, j + 1));
            for (x, [sum]) in self.x.iter_mut().zip(sums) {
                x[j] -= sum;
            }
        }
        for j in (0..grouped).step_by(GROUP).rev() {
            let next = j + GROUP;
            let columns = block.columns(j, next);
            let sums = products::<T, S, GROUP, SIDES>(simd, columns, shared(&self.x, next));
            for (x, sums) in self.x.iter_mut().zip(sums) {
                for k in (0..GROUP).rev() {
                    let values = &block.column(j + k)[j..next];
                    let mut sum = sums[k];
                    for i in k + 1..GROUP {
                        sum += values[i] * x[j + i];
                    }
                    x[j + k] -= sum;
                }
            }
        }
    }
}

/// Work on the sides of a panel, two at a time, and the last alone if their number is odd.
pub(super) fn by_pairs<T: Lanes>(
    sides: &mut [T],
    length: usize,
    mut pair: impl FnMut([&mut [T]; 2]),
    mut single: impl FnMut([&mut [T]; 1]),
) {
    if length == 0 {
        return;
    }
    for sides in sides.chunks_mut(2 * length) {
        if sides.len() == 2 * length {
            let (one, other) = sides.split_at_mut(length);
            pair([one, other]);
        } else {
            single([sides]);
        }
    }
}
