//! Dense kernels of one panel: `L D Lᵀ` of its diagonal block, and the rows below it.
//!
//! Blocks are column-major. A factored diagonal block holds unit lower triangular `L` strictly below its diagonal and `D`
//! on it; what lies above is never read. Blocks are halved until they are small; the halves meet in products
//! ([`multiply`](super::multiply)).

use faer::mat::{MatMut, MatRef};
use faer::prelude::{Reborrow, ReborrowMut};
use pulp::{Simd, WithSimd};

use super::lanes::add_columns;
use super::multiply::{Packing, Shape, Store, multiply};
use super::scalar::PanelScalar;

/// Columns up to which a triangle is worked on column by column.
const SMALL_TRIANGLE: usize = 16;

/// Rows that meet a small triangle at a time: with its columns they fit the first cache.
const SMALL_ROWS: usize = 96;

/// A column of a column-major block.
#[inline(always)]
pub(super) fn column<'a, T>(block: &'a MatRef<'_, T>, j: usize) -> &'a [T] {
    block.col(j).try_as_col_major().expect("panels are stored by columns").as_slice()
}

/// A column of a column-major block, to be written.
#[inline(always)]
pub(super) fn column_mut<'a, T>(block: &'a mut MatMut<'_, T>, j: usize) -> &'a mut [T] {
    block.rb_mut().col_mut(j).try_as_col_major_mut().expect("panels are stored by columns").as_slice_mut()
}

/// `A = L D Lᵀ` of the lower triangle of a square block, in place; `scratch` has any content.
///
/// # Errors
/// The column whose pivot is zero or not finite.
pub(super) fn factor_diagonal<T: PanelScalar>(
    mut block: MatMut<'_, T>,
    scratch: &mut Vec<T>,
    packing: &mut Packing<T>,
) -> Result<(), usize> {
    let n = block.nrows();
    if n <= SMALL_TRIANGLE {
        return pulp::Arch::new().dispatch(SmallFactor { block });
    }
    let half = (n / 2).next_multiple_of(SMALL_TRIANGLE / 2);
    let (top, bottom) = block.rb_mut().split_at_row_mut(half);
    let (mut leading, _) = top.split_at_col_mut(half);
    let (mut below, mut trailing) = bottom.split_at_col_mut(half);
    factor_diagonal(leading.rb_mut(), scratch, packing)?;
    divide_by_unit_triangle(leading.rb(), below.rb_mut(), packing);
    scratch.clear();
    for j in 0..half {
        let pivot = column(&leading.rb(), j)[j];
        let inverse = pivot.inverse().ok_or(j)?;
        let entries = column_mut(&mut below, j);
        scratch.extend_from_slice(entries);
        entries.iter_mut().for_each(|entry| *entry *= inverse);
    }
    let scaled = MatRef::from_column_major_slice(scratch, n - half, half);
    multiply(trailing.rb_mut(), Store::Subtract, Shape::LowerTrapezoid, below.rb(), scaled, packing);
    factor_diagonal(trailing, scratch, packing).map_err(|column| half + column)
}

/// Column by column, each taking the updates of those before it.
struct SmallFactor<'a, T> {
    block: MatMut<'a, T>,
}

impl<T: PanelScalar> WithSimd for SmallFactor<'_, T> {
    type Output = Result<(), usize>;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> Result<(), usize> {
        for j in 0..self.block.nrows() {
            let (left, mut right) = self.block.rb_mut().split_at_col_mut(j);
            let left = left.rb();
            let own = &mut column_mut(&mut right, 0)[j..];
            for k in 0..j {
                let before = column(&left, k);
                add_columns(simd, [&before[j..]], [[-(before[j] * before[k])]], &mut [&mut *own], 0);
            }
            let inverse = own[0].inverse().ok_or(j)?;
            own[1..].iter_mut().for_each(|entry| *entry *= inverse);
        }
        Ok(())
    }
}

/// `X ← X L⁻ᵀ` with the unit triangle of a factored diagonal block.
fn divide_by_unit_triangle<T: PanelScalar>(
    diagonal: MatRef<'_, T>,
    rows: MatMut<'_, T>,
    packing: &mut Packing<T>,
) {
    let n = diagonal.ncols();
    if n <= SMALL_TRIANGLE {
        pulp::Arch::new().dispatch(SmallDivision { diagonal, rows });
        return;
    }
    let half = (n / 2).next_multiple_of(SMALL_TRIANGLE / 2);
    let (mut left, mut right) = rows.split_at_col_mut(half);
    let (top, bottom) = diagonal.split_at_row(half);
    let (leading, _) = top.split_at_col(half);
    let (below, trailing) = bottom.split_at_col(half);
    divide_by_unit_triangle(leading, left.rb_mut(), packing);
    multiply(right.rb_mut(), Store::Subtract, Shape::Full, left.rb(), below, packing);
    divide_by_unit_triangle(trailing, right, packing);
}

/// Column by column, some rows at a time.
struct SmallDivision<'a, T> {
    diagonal: MatRef<'a, T>,
    rows: MatMut<'a, T>,
}

impl<T: PanelScalar> WithSimd for SmallDivision<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        for first in (0..self.rows.nrows()).step_by(SMALL_ROWS) {
            let taken = SMALL_ROWS.min(self.rows.nrows() - first);
            for j in 1..self.diagonal.ncols() {
                let (left, mut right) = self.rows.rb_mut().split_at_col_mut(j);
                let left = left.rb();
                let own = &mut column_mut(&mut right, 0)[first..first + taken];
                let factor = |k: usize| -column(&self.diagonal, k)[j];
                let known = |k: usize| &column(&left, k)[first..first + taken];
                let mut k = 0;
                while k + 4 <= j {
                    let columns = [known(k), known(k + 1), known(k + 2), known(k + 3)];
                    let factors = [factor(k), factor(k + 1), factor(k + 2), factor(k + 3)];
                    add_columns(simd, columns, [factors], &mut [&mut *own], 0);
                    k += 4;
                }
                for k in k..j {
                    add_columns(simd, [known(k)], [[factor(k)]], &mut [&mut *own], 0);
                }
            }
        }
    }
}

/// `X ← X L⁻ᵀ D⁻¹`: the rows of a panel below its factored diagonal block.
pub(super) fn divide_by_diagonal_block<T: PanelScalar>(
    diagonal: MatRef<'_, T>,
    inverse_pivots: &[T],
    mut rows: MatMut<'_, T>,
    packing: &mut Packing<T>,
) {
    divide_by_unit_triangle(diagonal, rows.rb_mut(), packing);
    for (j, &inverse) in inverse_pivots.iter().enumerate() {
        column_mut(&mut rows, j).iter_mut().for_each(|entry| *entry *= inverse);
    }
}
