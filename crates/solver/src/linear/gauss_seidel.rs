//! Symmetric block Gauss–Seidel as a smoother: sets of strongly coupled unknowns are solved for at once, one colour of sets after
//! the other.
//!
//! With `K = L + D + Lᵀ`, `D` the blocks of the sets and `L` the couplings with sets of earlier colours, one application is
//!
//! ```text
//! s = r − L y,  y = D⁻¹ s   forwards        z = D⁻¹ (s − Lᵀ z)   backwards        r − K z = L (y − z)
//! ```
//!
//! Complex symmetric, and never indefinite where `K` is not. On cells much flatter than wide a field that is constant across
//! them is small in energy and large in every unknown: an incomplete factor, which drops what elimination brings between the
//! unknowns of a chain, does not see it, and a set that is solved exactly does. Numbers are in single precision, of the matrix
//! scaled as for a factor. Unknowns of one colour are worked on in parallel; the bits do not depend on the threads.

use std::ops::Range;
use std::sync::Arc;

use fluxmorph_geometry::MeshError;
use fluxmorph_geometry::fem::csr::CsrStructure;
use fluxmorph_geometry::fem::{CsrMatrix, Ldlt, LdltAnalysis, StrongSets, c32, c64, ordering};
use rayon::prelude::*;

use super::cost::Sizes;
use super::factor::{Representation, double, magnification, scaled_entry, scaling};

/// Rows per parallel task.
const ROWS: usize = 1024;

/// Entries of the matrix that couple rows with those of other colours, in the new numbering.
#[derive(Debug)]
struct Couplings {
    row_starts: Vec<u32>,
    columns: Vec<u32>,
}

/// Sets that do not touch each other.
#[derive(Debug)]
struct Colour {
    /// Its rows, in the new numbering: first those that are sets by themselves.
    rows: Range<usize>,
    /// Where the rows of larger sets begin.
    larger: usize,
    /// The symbolic factor of the larger sets, and the entry of the matrix for each of its entries.
    blocks: Option<(Arc<LdltAnalysis>, Vec<u32>)>,
}

/// Sets, colours and couplings of a pattern.
#[derive(Debug)]
pub(super) struct GaussSeidelAnalysis {
    /// `order[new] = old`.
    order: Vec<u32>,
    colours: Vec<Colour>,
    earlier: Couplings,
    later: Couplings,
}

impl GaussSeidelAnalysis {
    /// Analyses a structurally symmetric pattern with a full diagonal for the given sets.
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] when the symbolic factor of the sets does not fit.
    pub(super) fn new(structure: &CsrStructure, sets: &StrongSets) -> Result<Self, MeshError> {
        let colour_of = colours(structure, sets);
        let count = colour_of.iter().max().map_or(0, |&last| last as usize + 1);
        let mut of_colour: Vec<[Vec<u32>; 2]> = vec![Default::default(); count];
        for set in 0..sets.count() {
            let rows = sets.rows(set);
            of_colour[colour_of[set] as usize][usize::from(rows.len() > 1)].extend_from_slice(rows);
        }
        let order: Vec<u32> = of_colour.iter().flatten().flatten().copied().collect();
        let number = ordering::inverse_permutation(&order);
        let mut begin = 0;
        let colours = of_colour
            .iter()
            .map(|[single, larger]| {
                let rows = begin..begin + single.len() + larger.len();
                begin = rows.end;
                let first = rows.start + single.len();
                let blocks = (!larger.is_empty()).then(|| blocks(structure, sets, larger, (&number, first)));
                Ok(Colour { larger: first, rows, blocks: blocks.transpose()? })
            })
            .collect::<Result<Vec<_>, MeshError>>()?;
        let on_side = |side: Side| {
            let mut found = Couplings { row_starts: vec![0; order.len() + 1], columns: Vec::new() };
            couplings(structure, (&order, &number), &colours, side).for_each(|coupling| {
                found.columns.push(coupling.column);
                found.row_starts[coupling.row + 1] += 1;
            });
            for row in 0..order.len() {
                found.row_starts[row + 1] += found.row_starts[row];
            }
            found
        };
        Ok(Self { earlier: on_side(Side::Earlier), later: on_side(Side::Later), order, colours })
    }

    /// Memory of this analysis and of the numbers of one matrix [bytes].
    pub(super) fn bytes(&self) -> usize {
        let entries = self.sizes().factor_entries;
        let blocks = self.colours.iter().filter_map(|colour| colour.blocks.as_ref());
        // Of every entry its column, and where it is in the matrix.
        let of_blocks: usize = blocks.map(|(_, entries)| 2 * size_of_val(entries.as_slice())).sum();
        let couplings = self.earlier.columns.len() + self.later.columns.len();
        couplings * (size_of::<c32>() + size_of::<u32>())
            + entries * size_of::<c32>()
            + of_blocks
            + self.order.len() * (3 * size_of::<u32>() + size_of::<c32>() + size_of::<f64>())
    }

    /// Sizes of the factors of the sets, together.
    pub(super) fn sizes(&self) -> Sizes {
        Sizes {
            matrix_entries: 0,
            factor_entries: self.factors().map(LdltAnalysis::factor_entries).sum(),
            multiplications: self.factors().map(LdltAnalysis::multiplications).sum(),
        }
    }

    fn factors(&self) -> impl Iterator<Item = &LdltAnalysis> {
        self.colours.iter().filter_map(|colour| colour.blocks.as_ref()).map(|(factor, _)| &**factor)
    }
}

/// Which of the other colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Earlier,
    Later,
}

/// An entry of the matrix that couples two colours.
struct Coupling {
    /// In the new numbering.
    row: usize,
    column: u32,
    /// Its place in the matrix.
    entry: usize,
}

/// The couplings with colours on one side, row by row in the new numbering.
fn couplings(
    structure: &CsrStructure,
    (order, number): (&[u32], &[u32]),
    colours: &[Colour],
    side: Side,
) -> impl Iterator<Item = Coupling> {
    let of_row = move |row: usize| {
        let of_entry = move |entry: usize| {
            let column = number[structure.columns[entry] as usize];
            Coupling { row, column, entry }
        };
        structure.row(order[row] as usize).map(of_entry)
    };
    let of_colour = move |Colour { rows, .. }: &Colour| {
        let Range { start, end } = *rows;
        let is_there = move |found: &Coupling| match side {
            Side::Earlier => (found.column as usize) < start,
            Side::Later => found.column as usize >= end,
        };
        (start..end).flat_map(of_row).filter(is_there)
    };
    colours.iter().flat_map(of_colour)
}

/// A colour for every set, so that sets of one colour are not coupled: the first that is free, large sets first.
fn colours(structure: &CsrStructure, sets: &StrongSets) -> Vec<u32> {
    let mut by_size: Vec<usize> = (0..sets.count()).collect();
    by_size.sort_by_key(|&set| std::cmp::Reverse(sets.rows(set).len()));
    let mut colour = vec![u32::MAX; sets.count()];
    // The set for which a colour was last found to be taken.
    let mut taken: Vec<usize> = Vec::new();
    for set in by_size {
        for &row in sets.rows(set) {
            for &c in &structure.columns[structure.row(row as usize)] {
                if let Some(last) = taken.get_mut(colour[sets.of(c as usize)] as usize) {
                    *last = set;
                }
            }
        }
        let own = taken.iter().position(|&last| last != set).unwrap_or(taken.len());
        if own == taken.len() {
            taken.push(usize::MAX);
        }
        colour[set] = own as u32;
    }
    colour
}

/// The symbolic factor of the blocks of some sets, whose rows are numbered from `first`, and the entries of the matrix in them.
fn blocks(
    structure: &CsrStructure,
    sets: &StrongSets,
    rows: &[u32],
    (number, first): (&[u32], usize),
) -> Result<(Arc<LdltAnalysis>, Vec<u32>), MeshError> {
    let mut own = CsrStructure { column_count: rows.len(), row_starts: vec![0], columns: Vec::new() };
    let mut entries = Vec::new();
    let mut row_entries: Vec<(u32, u32)> = Vec::new();
    for &row in rows {
        let set = sets.of(row as usize);
        row_entries.clear();
        for k in structure.row(row as usize) {
            let c = structure.columns[k] as usize;
            if sets.of(c) == set {
                row_entries.push((number[c] - first as u32, k as u32));
            }
        }
        row_entries.sort_unstable();
        own.columns.extend(row_entries.iter().map(|entry| entry.0));
        entries.extend(row_entries.iter().map(|entry| entry.1));
        own.row_starts.push(own.columns.len() as u32);
    }
    let own = Arc::new(own);
    // By minimum degree: sets are small, and dissection takes four times as long for the same fill.
    Ok((LdltAnalysis::new(&own, None)?, entries))
}

/// The smoother of one matrix.
#[derive(Debug)]
pub(super) struct GaussSeidel {
    analysis: Arc<GaussSeidelAnalysis>,
    /// Of every row of the matrix.
    scale: Vec<f64>,
    /// `1/d_i` in the new numbering, for the rows that are sets by themselves.
    inverse: Vec<c32>,
    factors: Vec<Option<Ldlt<c32>>>,
    earlier: Vec<c32>,
    later: Vec<c32>,
}

impl GaussSeidel {
    /// Takes the values of a matrix with the analysed pattern.
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] where a diagonal entry is not positive or a pivot of a set vanishes.
    pub(super) fn new(
        analysis: &Arc<GaussSeidelAnalysis>,
        matrix: &CsrMatrix<c64>,
    ) -> Result<Self, MeshError> {
        let GaussSeidelAnalysis { order, colours, .. } = &**analysis;
        let structure = &matrix.structure;
        let scale = scaling(matrix)?;
        let scaled =
            |row: usize, entry: usize| -> c32 { scaled_entry(matrix, &scale, order[row] as usize, entry) };
        let inverse = order.iter().map(|&i| {
            let (d, s) = (matrix.entry(i as usize, i as usize).unwrap_or_default(), scale[i as usize]);
            c32::of_entry((d * s * s).inv())
        });
        let inverse = inverse.collect();
        let factors = colours.iter().map(|colour| {
            let Some((blocks, entries)) = &colour.blocks else { return Ok(None) };
            Ldlt::new(blocks, |row, k| scaled(colour.larger + row, entries[k] as usize)).map(Some)
        });
        let factors = factors.collect::<Result<_, _>>()?;
        let number = ordering::inverse_permutation(order);
        let values = |side: Side, count: usize| {
            let mut values = Vec::with_capacity(count);
            let all = couplings(structure, (order, &number), colours, side);
            all.for_each(|coupling| values.push(scaled(coupling.row, coupling.entry)));
            values
        };
        let earlier = values(Side::Earlier, analysis.earlier.columns.len());
        let later = values(Side::Later, analysis.later.columns.len());
        Ok(Self { analysis: Arc::clone(analysis), scale, inverse, factors, earlier, later })
    }

    /// Memory of the numbers [bytes].
    pub(super) fn bytes(&self) -> usize {
        (self.earlier.len() + self.later.len() + self.inverse.len()) * size_of::<c32>()
            + size_of_val(self.scale.as_slice())
            + self.factors.iter().flatten().map(Ldlt::bytes).sum::<usize>()
    }

    /// Overwrites `z` with `M⁻¹ r`, and `rest` with `r − K z`.
    pub(super) fn apply(&self, r: &[c64], z: &mut [c64], rest: &mut [c64]) {
        let GaussSeidelAnalysis { order, colours, earlier, later } = &*self.analysis;
        let scaled: Vec<c64> =
            order.par_iter().map(|&old| r[old as usize] * self.scale[old as usize]).collect();
        let factor = magnification(&scaled);
        // The right side, then `s`.
        let mut s: Vec<c32> = scaled.into_par_iter().map(|r| c32::of_entry(r * factor)).collect();
        let mut y = vec![c32::default(); s.len()];
        for (colour, factor) in colours.iter().zip(&self.factors) {
            let (before, own) = y.split_at_mut(colour.rows.start);
            subtract((earlier, &self.earlier), &colour.rows, before, 0, &mut s[colour.rows.clone()]);
            self.solve(colour, factor.as_ref(), &s[colour.rows.clone()], &mut own[..colour.rows.len()]);
        }
        let mut x = y.clone();
        let last = colours.len().saturating_sub(1);
        for (colour, factor) in colours.iter().zip(&self.factors).take(last).rev() {
            let (own, after) = x.split_at_mut(colour.rows.end);
            let mut right_side = s[colour.rows.clone()].to_vec();
            subtract((later, &self.later), &colour.rows, after, colour.rows.end, &mut right_side);
            self.solve(colour, factor.as_ref(), &right_side, &mut own[colour.rows.start..]);
        }
        y.par_iter_mut().zip(&x).for_each(|(y, x)| *y = x - *y);
        s.par_iter_mut().for_each(|s| *s = c32::default());
        subtract((earlier, &self.earlier), &(0..order.len()), &y, 0, &mut s);
        for ((&old, &x), &s) in order.iter().zip(&x).zip(&s) {
            let old = old as usize;
            z[old] = double(x) * (self.scale[old] / factor);
            rest[old] = double(s) / (factor * self.scale[old]);
        }
    }

    /// `x = D⁻¹ b` for the rows of a colour.
    fn solve(&self, colour: &Colour, factor: Option<&Ldlt<c32>>, b: &[c32], x: &mut [c32]) {
        let singles = colour.larger - colour.rows.start;
        let inverse = &self.inverse[colour.rows.clone()];
        let (single, larger) = x.split_at_mut(singles);
        single.iter_mut().zip(b).zip(inverse).for_each(|((x, b), inverse)| *x = b * inverse);
        larger.copy_from_slice(&b[singles..]);
        if let Some(factor) = factor {
            factor.solve_in_place(larger);
        }
    }
}

/// `b −= C x` for some rows; the numbers of `x` begin with that of column `first`.
fn subtract(
    (couplings, values): (&Couplings, &[c32]),
    rows: &Range<usize>,
    x: &[c32],
    first: usize,
    b: &mut [c32],
) {
    b.par_chunks_mut(ROWS).enumerate().for_each(|(task, b)| {
        for (i, b) in b.iter_mut().enumerate() {
            let row = rows.start + task * ROWS + i;
            let range = couplings.row_starts[row] as usize..couplings.row_starts[row + 1] as usize;
            // Products with real and imaginary parts apart: pairs of equal operations.
            let (mut by_re, mut by_im) = ([0.0f32; 2], [0.0f32; 2]);
            for (a, &c) in values[range.clone()].iter().zip(&couplings.columns[range]) {
                let x = x[c as usize - first];
                by_re = [by_re[0] + a.re * x.re, by_re[1] + a.re * x.im];
                by_im = [by_im[0] + a.im * x.re, by_im[1] + a.im * x.im];
            }
            *b -= c32::new(by_re[0] - by_im[1], by_re[1] + by_im[0]);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cells three times wider than high, with eddy currents in some: a complex symmetric matrix on a grid of nodes.
    fn matrix() -> CsrMatrix<c64> {
        const SIDE: usize = 6;
        let row = |i: usize| {
            let (x, y) = (i % SIDE, i / SIDE);
            let flat = |other: Option<usize>| other.map(|other| (other, c64::new(-0.3, 0.05)));
            let high = |other: Option<usize>| other.map(|other| (other, c64::new(-2.7, 0.0)));
            let own = (i, c64::new(6.1, if x < 3 { 1.5 } else { 0.0 }));
            [
                high(i.checked_sub(SIDE)),
                flat((x > 0).then(|| i - 1)),
                Some(own),
                flat((x + 1 < SIDE).then_some(i + 1)),
                high((y + 1 < SIDE).then_some(i + SIDE)),
            ]
            .into_iter()
            .flatten()
            .collect()
        };
        CsrMatrix::from_rows(SIDE * SIDE, (0..SIDE * SIDE).map(row))
    }

    fn smoother(matrix: &CsrMatrix<c64>, least: f64) -> GaussSeidel {
        let sets = StrongSets::new(&matrix.structure, |_, k| matrix.values[k].norm() > least);
        let analysis = GaussSeidelAnalysis::new(&matrix.structure, &sets).expect("it fits");
        GaussSeidel::new(&Arc::new(analysis), matrix).expect("no pivot vanishes")
    }

    /// `M⁻¹` by columns, and `1 − K M⁻¹`.
    fn columns(smoother: &GaussSeidel, n: usize) -> [Vec<Vec<c64>>; 2] {
        let mut columns = [Vec::new(), Vec::new()];
        for i in 0..n {
            let (mut r, mut z, mut rest) =
                (vec![c64::default(); n], vec![c64::default(); n], vec![c64::default(); n]);
            r[i] = c64::new(1.0, 0.0);
            smoother.apply(&r, &mut z, &mut rest);
            columns[0].push(z);
            columns[1].push(rest);
        }
        columns
    }

    fn difference(a: &[c64], b: &[c64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }

    #[test]
    fn one_application_is_symmetric_and_its_residual_that_of_the_matrix() {
        let matrix = matrix();
        let n = matrix.structure.row_count();
        // Points, columns of strongly coupled points, and all at once.
        for least in [10.0, 1.0, 0.0] {
            let [inverse, rests] = columns(&smoother(&matrix, least), n);
            for i in 0..n {
                let transposed: Vec<c64> = inverse.iter().map(|column| column[i]).collect();
                assert!(difference(&inverse[i], &transposed) < 1e-6, "{least}: column {i}");
                let mut rest = vec![c64::default(); n];
                matrix.mul(&inverse[i], &mut rest);
                rest.iter_mut().for_each(|rest| *rest = -*rest);
                rest[i] += 1.0;
                assert!(difference(&rests[i], &rest) < 1e-5, "{least}: the residual of column {i}");
            }
        }
    }

    #[test]
    fn larger_sets_leave_less_and_one_set_leaves_nothing() {
        let matrix = matrix();
        let n = matrix.structure.row_count();
        let left = |least: f64| {
            let [_, rests] = columns(&smoother(&matrix, least), n);
            rests.iter().flatten().map(|rest| rest.norm_sqr()).sum::<f64>().sqrt()
        };
        let [points, sets, all] = [10.0, 1.0, 0.0].map(left);
        assert!(sets < 0.2 * points, "{sets} of {points}");
        assert!(all < 1e-4 * sets, "{all} of {sets}");
    }

    #[test]
    fn a_diagonal_entry_of_zero_is_refused() {
        let mut matrix = matrix();
        let k = matrix.structure.row(7).find(|&k| matrix.structure.columns[k] == 7).expect("a full diagonal");
        matrix.values[k] = c64::default();
        let sets = StrongSets::new(&matrix.structure, |_, _| false);
        let analysis = Arc::new(GaussSeidelAnalysis::new(&matrix.structure, &sets).expect("it fits"));
        let error = GaussSeidel::new(&analysis, &matrix).expect_err("nothing to divide by");
        assert!(error.to_string().contains("unknown 7"), "{error}");
    }
}
