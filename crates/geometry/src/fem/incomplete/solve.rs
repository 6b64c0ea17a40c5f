//! Triangular solves with an incomplete factor: slabs at once, separators at once, and back.
//!
//! Forward, a row gathers what was solved before it; backward, it scatters to the rows before it, so that one copy of the
//! triangle serves both. A separator's rows reach into the two slabs beside it: backward, each slab takes its own share.

use std::ops::Range;

use rayon::prelude::*;

use super::{Incomplete, Number};

/// Rows per parallel task of a permutation.
const ROWS: usize = 4096;

impl<T: Number> Incomplete<T> {
    /// Solves for the right side `value(i)`, and overwrites `x` with what `taken` makes of the solution, both in the order of the
    /// matrix.
    ///
    /// # Panics
    /// If the length of `x` is not the number of unknowns.
    pub fn solve<X: Send>(
        &self,
        value: impl Fn(usize) -> T + Sync,
        x: &mut [X],
        taken: impl Fn(T) -> X + Sync,
    ) {
        let analysis = &*self.analysis;
        assert_eq!(x.len(), analysis.size(), "a value for every unknown");
        let mut y = vec![T::default(); x.len()];
        self.solve_gathered(&mut y, value);
        x.par_iter_mut().zip(&analysis.inverse).with_min_len(ROWS).for_each(|(x, &new)| {
            *x = taken(y[new as usize] * self.scales[new as usize]);
        });
    }

    /// Writes the solution for the right side `value(old)` to `y`, in the order of elimination.
    fn solve_gathered(&self, y: &mut [T], value: impl Fn(usize) -> T + Sync) {
        let analysis = &*self.analysis;
        let (interior, border) = y.split_at_mut(analysis.interior());
        let slabs = pieces(&analysis.slabs, interior);
        slabs.into_par_iter().for_each(|(_, rows, y)| self.forward(rows, y, &[], &value));
        let separators = pieces(&analysis.separators, border);
        separators.into_par_iter().for_each(|(_, rows, y)| {
            self.forward(rows, y, interior, &value);
            self.backward(rows, y);
        });
        let slabs = pieces(&analysis.slabs, interior);
        slabs.into_par_iter().for_each(|(s, rows, y)| {
            self.divide_by_pivots(rows, y);
            // The separator before the slab has it as its second one, the separator behind as its first.
            for t in [s.checked_sub(1), Some(s)].into_iter().flatten() {
                for i in analysis.separators.get(t).cloned().unwrap_or_default() {
                    let x = border[i - analysis.interior()];
                    let [second, own] = analysis.splits[i - analysis.interior()].map(|k| k as usize);
                    let range = if t == s { analysis.row_starts[i] as usize..second } else { second..own };
                    for k in range {
                        y[analysis.columns[k] as usize - rows.start] -= self.lower[k] * x;
                    }
                }
            }
            self.substitute_backward(rows, y);
        });
    }

    /// `y ← L⁻¹ S b` within one part, where the rows before it are solved in `interior`.
    fn forward(
        &self,
        rows: &Range<usize>,
        y: &mut [T],
        interior: &[T],
        value: &(impl Fn(usize) -> T + Sync),
    ) {
        let analysis = &*self.analysis;
        for i in rows.clone() {
            let mut sum = value(analysis.order[i] as usize) * self.scales[i];
            let (before, within) = self.entries_of(i);
            for k in before {
                sum -= self.lower[k] * interior[analysis.columns[k] as usize];
            }
            for k in within {
                sum -= self.lower[k] * y[analysis.columns[k] as usize - rows.start];
            }
            y[i - rows.start] = sum;
        }
    }

    /// `y ← L⁻ᵀ D⁻¹ y` within one part.
    fn backward(&self, rows: &Range<usize>, y: &mut [T]) {
        self.divide_by_pivots(rows, y);
        self.substitute_backward(rows, y);
    }

    /// `y ← D⁻¹ y` within one part.
    fn divide_by_pivots(&self, rows: &Range<usize>, y: &mut [T]) {
        y.iter_mut().zip(&self.inverse_pivots[rows.clone()]).for_each(|(y, &d)| *y = *y * d);
    }

    /// `y ← L⁻ᵀ y` within one part.
    fn substitute_backward(&self, rows: &Range<usize>, y: &mut [T]) {
        for i in rows.clone().rev() {
            let x = y[i - rows.start];
            for k in self.entries_of(i).1 {
                y[self.analysis.columns[k] as usize - rows.start] -= self.lower[k] * x;
            }
        }
    }

    /// Entries of a row in the columns of other parts, and in those of its own.
    #[inline]
    fn entries_of(&self, i: usize) -> (Range<usize>, Range<usize>) {
        let range = self.analysis.entries(&(i..i + 1));
        let split = match i.checked_sub(self.analysis.interior()) {
            None => range.start,
            Some(s) => self.analysis.splits[s][1] as usize,
        };
        (range.start..split, split..range.end)
    }
}

/// Number, rows and values of every part.
fn pieces<'a, T>(
    ranges: &'a [Range<usize>],
    mut y: &'a mut [T],
) -> Vec<(usize, &'a Range<usize>, &'a mut [T])> {
    let mut pieces = Vec::with_capacity(ranges.len());
    for (t, rows) in ranges.iter().enumerate() {
        let (own, rest) = std::mem::take(&mut y).split_at_mut(rows.len());
        y = rest;
        pieces.push((t, rows, own));
    }
    pieces
}
