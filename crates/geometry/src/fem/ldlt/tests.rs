//! Tests of the whole factorisation on matrices with known solutions.

use std::sync::Arc;

use num_complex::{Complex32, Complex64};

use super::panels::PANEL_WIDTH;
use super::{FactorScalar, Ldlt, LdltAnalysis};
use crate::determinism::same_on_any_threads;
use crate::error::MeshError;
use crate::fem::csr::{CsrMatrix, CsrStructure};
use crate::fem::kept_first::{Changes, kept_first};
use crate::fem::ordering;

/// The seven-point pattern on an `m³` grid, `components` unknowns a node that do not know of each other.
fn grid(m: usize, components: usize) -> Arc<CsrStructure> {
    let mut row_starts = vec![0];
    let mut columns: Vec<u32> = Vec::new();
    for node in 0..m * m * m {
        let mut neighbours = vec![node];
        for (stride, at) in [(m * m, node / m / m), (m, node / m % m), (1, node % m)] {
            neighbours.extend((at > 0).then(|| node - stride));
            neighbours.extend((at + 1 < m).then(|| node + stride));
        }
        neighbours.sort_unstable();
        for c in 0..components {
            columns.extend(neighbours.iter().map(|n| (n * components + c) as u32));
            row_starts.push(columns.len() as u32);
        }
    }
    Arc::new(CsrStructure { column_count: m * m * m * components, row_starts, columns })
}

/// Laplacian plus `jω` mass where the number is complex: symmetric, and far from Hermitian.
trait Entry: FactorScalar {
    const UNIT_ROUND_OFF: f64;

    fn from_complex(value: Complex64) -> Self;

    fn distance(self, other: Self) -> f64;
}

macro_rules! entry {
    ($scalar:ty, $round_off:expr, $from:expr, $distance:expr) => {
        impl Entry for $scalar {
            const UNIT_ROUND_OFF: f64 = $round_off as f64;

            fn from_complex(value: Complex64) -> Self {
                $from(value)
            }

            fn distance(self, other: Self) -> f64 {
                $distance(self - other)
            }
        }
    };
}

entry!(f32, f32::EPSILON, |z: Complex64| z.re as f32, |d: f32| f64::from(d.abs()));
entry!(f64, f64::EPSILON, |z: Complex64| z.re, f64::abs);
entry!(Complex32, f32::EPSILON, |z: Complex64| Complex32::new(z.re as f32, z.im as f32), |d: Complex32| {
    f64::from(d.norm())
});
entry!(Complex64, f64::EPSILON, |z: Complex64| z, Complex64::norm);

/// The value of an entry of the model matrix: diagonal `6.5 + j (0.2 + …)`, neighbours `−1 + 0.05 j`.
fn value<T: Entry>(structure: &CsrStructure, row: usize, k: usize) -> T {
    let own = structure.columns[k] as usize == row;
    let diagonal = Complex64::new(6.5, 0.2 + (row % 7) as f64);
    T::from_complex(if own { diagonal } else { Complex64::new(-1.0, 0.05) })
}

fn product<T: Entry>(structure: &CsrStructure, x: &[T]) -> Vec<T> {
    let row = |row: usize| {
        let mut sum = T::default();
        for k in structure.row(row) {
            sum += value::<T>(structure, row, k) * x[structure.columns[k] as usize];
        }
        sum
    };
    (0..x.len()).map(row).collect()
}

fn exact<T: Entry>(n: usize) -> Vec<T> {
    (0..n)
        .map(|i| T::from_complex(Complex64::new((0.37 * i as f64).sin(), (0.11 * i as f64).cos())))
        .collect()
}

fn analysis(structure: &Arc<CsrStructure>) -> Arc<LdltAnalysis> {
    LdltAnalysis::new(structure, ordering::dissection(structure)).expect("a symmetric pattern")
}

fn factor<T: Entry>(analysis: &Arc<LdltAnalysis>) -> Ldlt<T> {
    Ldlt::new(analysis, |row, k| value(&analysis.structure, row, k)).expect("no pivot is zero")
}

fn largest_error<T: Entry>(structure: &Arc<CsrStructure>, sides: usize) -> f64 {
    let analysis = analysis(structure);
    let factor = factor::<T>(&analysis);
    let n = analysis.size();
    let exact = exact::<T>(n * sides);
    let mut x = Vec::new();
    for side in 0..sides {
        x.extend(product(structure, &exact[side * n..(side + 1) * n]));
    }
    factor.solve_in_place(&mut x);
    x.iter().zip(&exact).map(|(&x, &exact)| x.distance(exact)).fold(0.0, f64::max)
}

/// The condition number is below 30, and the rounding of a sparse factorisation grows slowly: 100 units.
fn all_numbers_solve(structure: &Arc<CsrStructure>, sides: usize) {
    assert!(largest_error::<f32>(structure, sides) < 100.0 * f32::UNIT_ROUND_OFF);
    assert!(largest_error::<f64>(structure, sides) < 100.0 * f64::UNIT_ROUND_OFF);
    assert!(largest_error::<Complex32>(structure, sides) < 100.0 * Complex32::UNIT_ROUND_OFF);
    assert!(largest_error::<Complex64>(structure, sides) < 100.0 * Complex64::UNIT_ROUND_OFF);
}

#[test]
fn known_solutions_on_grids_are_found_in_all_number_types() {
    for m in [1, 2, 5, 14, 22] {
        all_numbers_solve(&grid(m, 1), 1);
    }
    all_numbers_solve(&grid(9, 3), 1);
}

#[test]
fn several_right_sides_are_solved_at_once() {
    all_numbers_solve(&grid(7, 1), 3);
    all_numbers_solve(&grid(15, 1), 2);
}

/// A full matrix of `n` unknowns: one supernode.
fn full(n: usize) -> Arc<CsrStructure> {
    let columns = (0..n * n).map(|k| (k % n) as u32).collect();
    let row_starts = (0..=n).map(|row| (row * n) as u32).collect();
    Arc::new(CsrStructure { column_count: n, row_starts, columns })
}

fn natural(structure: &Arc<CsrStructure>) -> Arc<LdltAnalysis> {
    let order = (0..structure.row_count() as u32).collect();
    LdltAnalysis::new(structure, Some(order)).expect("a symmetric pattern")
}

/// `A x = b` of a full, diagonally dominant matrix with the diagonal `2 n`: condition below 3.
fn full_solves<T: Entry>(n: usize) {
    let structure = full(n);
    let analysis = natural(&structure);
    let entry = |row: usize, k: usize| {
        let column = structure.columns[k] as usize;
        let off =
            Complex64::new(0.5 + 0.4 * ((row * column) as f64).sin(), 0.3 * (row + column) as f64 % 1.0);
        T::from_complex(if row == column { Complex64::new(2.0 * n as f64, n as f64) } else { off })
    };
    let factor = Ldlt::new(&analysis, entry).expect("diagonally dominant");
    let exact = exact::<T>(n);
    let mut x = vec![T::default(); n];
    for (row, x) in x.iter_mut().enumerate() {
        for k in structure.row(row) {
            *x += entry(row, k) * exact[k - structure.row(row).start];
        }
    }
    factor.solve_in_place(&mut x);
    let error = x.iter().zip(&exact).map(|(&x, &exact)| x.distance(exact)).fold(0.0, f64::max);
    assert!(error < 100.0 * T::UNIT_ROUND_OFF, "{n}: {error:e}");
}

#[test]
fn panels_at_and_about_the_split_width_and_the_tile_height_solve() {
    for n in [16, 17, 127, 128, 129, 255, 256, 257, 600] {
        full_solves::<f64>(n);
        full_solves::<Complex64>(n);
        full_solves::<Complex32>(n);
    }
    let panels = |n| natural(&full(n)).panels.iter().map(|panel| panel.width).collect::<Vec<_>>();
    assert_eq!(panels(PANEL_WIDTH), [PANEL_WIDTH]);
    assert_eq!(panels(PANEL_WIDTH + 1), [PANEL_WIDTH / 2, PANEL_WIDTH / 2 + 1]);
}

#[test]
fn no_unknown_one_unknown_and_a_diagonal() {
    let empty = Arc::new(CsrStructure { column_count: 0, row_starts: vec![0], columns: Vec::new() });
    for order in [None, Some(Vec::new())] {
        let analysis = LdltAnalysis::new(&empty, order).expect("nothing to do");
        assert_eq!((analysis.size(), analysis.factor_entries()), (0, 0));
        let factor = Ldlt::<f64>::new(&analysis, |_, _| 1.0).expect("nothing to do");
        factor.solve_in_place(&mut []);
    }
    for n in [1, 300] {
        let diagonal = Arc::new(CsrStructure {
            column_count: n,
            row_starts: (0..=n as u32).collect(),
            columns: (0..n as u32).collect(),
        });
        let analysis = LdltAnalysis::new(&diagonal, None).expect("a pattern");
        let factor = Ldlt::new(&analysis, |row, _| Complex64::new(0.0, 2.0_f64.powi(row as i32 % 9)));
        let mut x = vec![Complex64::new(0.0, 1.0); n];
        factor.expect("no pivot is zero").solve_in_place(&mut x);
        for (i, x) in x.iter().enumerate() {
            assert_eq!(*x, Complex64::new(0.5_f64.powi(i as i32 % 9), 0.0));
        }
    }
}

#[test]
fn parts_that_do_not_know_of_each_other_are_solved_together() {
    // Two grids side by side, and unknowns without a neighbour behind them.
    let one = grid(8, 1);
    let (n, entries) = (one.row_count() as u32, one.columns.len() as u32);
    let mut row_starts = one.row_starts.clone();
    row_starts.extend(one.row_starts[1..].iter().map(|start| start + entries));
    row_starts.extend((1..=5).map(|i| 2 * entries + i));
    let mut columns = one.columns.clone();
    columns.extend(one.columns.iter().map(|column| column + n));
    columns.extend(2 * n..2 * n + 5);
    all_numbers_solve(&Arc::new(CsrStructure { column_count: 2 * n as usize + 5, row_starts, columns }), 1);
}

#[test]
fn the_factor_times_its_plain_transpose_is_the_matrix() {
    let structure = grid(4, 1);
    let analysis = analysis(&structure);
    let factor = factor::<Complex64>(&analysis);
    let n = analysis.size();
    let mut lower = vec![vec![Complex64::default(); n]; n];
    let mut pivots = vec![Complex64::default(); n];
    for (p, entries) in factor.panels.iter().enumerate() {
        let (panel, rows) = (analysis.panels.get(p), analysis.panels.rows(p));
        for (j, values) in entries.entries.chunks_exact(panel.height()).enumerate() {
            let column = panel.start + j;
            pivots[column] = values[j];
            lower[column][column] = Complex64::ONE;
            for (&row, &value) in rows[j + 1..].iter().zip(&values[j + 1..]) {
                lower[row as usize][column] = value;
            }
        }
    }
    for row in 0..n {
        for column in 0..n {
            let product: Complex64 = (0..n).map(|k| lower[row][k] * pivots[k] * lower[column][k]).sum();
            let (old_row, old_column) = (analysis.order[row] as usize, analysis.order[column]);
            let stored = structure.row(old_row).find(|&k| structure.columns[k] == old_column);
            let expected = stored.map_or(Complex64::default(), |k| value(&structure, old_row, k));
            // Entries are of the size of ten.
            assert!((product - expected).norm() < 1e-14 * 10.0, "({row}, {column}): {product} {expected}");
        }
    }
}

#[test]
fn the_bits_do_not_depend_on_the_threads() {
    // Enough work for branches, chains and tiles: several tasks of millions of multiply-adds each.
    let structure = grid(26, 2);
    let analysis = analysis(&structure);
    assert!(analysis.tasks.tasks.len() >= 2 && analysis.panels.len() > 100);
    same_on_any_threads(|| {
        let factor = factor::<Complex64>(&analysis);
        let mut x = exact::<Complex64>(2 * analysis.size());
        factor.solve_in_place(&mut x);
        let (one, _) = x.split_at_mut(analysis.size());
        factor.solve_in_place(one);
        let bits = |z: &Complex64| [z.re.to_bits(), z.im.to_bits()];
        let factor_bits: Vec<_> = factor.panels.iter().flat_map(|panel| &panel.entries).map(bits).collect();
        (factor_bits, x.iter().map(bits).collect::<Vec<_>>())
    });
}

#[test]
fn a_singular_matrix_and_one_that_is_not_finite_are_errors() {
    // A chain of springs without a support: every pivot is one, exactly, and the last is zero.
    let n = 50;
    let row = |row: usize| (row.saturating_sub(1)..(row + 2).min(n)).map(|c| (c, 0.0)).collect();
    let structure = CsrMatrix::from_rows(n, (0..n).map(row)).structure;
    let spring = |row: usize, k: usize| match structure.columns[k] as usize {
        column if column != row => -1.0,
        _ if row == 0 || row == n - 1 => 1.0,
        _ => 2.0,
    };
    let analysis = natural(&structure);
    let error = Ldlt::<f64>::new(&analysis, spring).expect_err("it is singular");
    let MeshError::Factorisation { unknowns, cause } = error else { panic!("{error}") };
    assert_eq!(unknowns, n);
    assert!(cause.contains("unknown 49") && cause.contains("singular"), "{cause}");

    let broken = |row: usize, k: usize| if row == 7 { f64::NAN } else { 3.0 * spring(row, k) };
    assert!(matches!(Ldlt::<f64>::new(&analysis, broken), Err(MeshError::Factorisation { .. })));
}

#[test]
fn an_order_that_is_no_permutation_is_an_error() {
    let structure = grid(2, 1);
    for order in [vec![0; 8], vec![0, 1, 2], (1..9).collect()] {
        let error = LdltAnalysis::new(&structure, Some(order)).expect_err("it is no permutation");
        assert!(error.to_string().contains("permutation"), "{error}");
    }
}

/// One step of iterative refinement gains the digits of single precision, about six: two steps from 1 reach 1e-12.
#[test]
fn a_single_precision_factor_preconditions_to_small_residuals() {
    let structure = grid(12, 1);
    let analysis = analysis(&structure);
    let factor = factor::<Complex32>(&analysis);
    let b = exact::<Complex64>(analysis.size());
    let norm = |v: &[Complex64]| v.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt();
    let mut x = vec![Complex64::default(); b.len()];
    for allowed in [1e-5, 1e-10] {
        let residual = |x: &[Complex64]| -> Vec<Complex64> {
            product(&structure, x).iter().zip(&b).map(|(ax, b)| b - ax).collect()
        };
        let mut step: Vec<Complex32> = residual(&x).iter().map(|&r| Complex32::from_complex(r)).collect();
        factor.solve_in_place(&mut step);
        x.iter_mut().zip(&step).for_each(|(x, z)| *x += Complex64::new(z.re.into(), z.im.into()));
        let relative = norm(&residual(&x)) / norm(&b);
        assert!(relative < allowed, "{relative:e}");
    }
}

#[test]
fn the_factor_is_counted_in_entries_bytes_and_multiplications() {
    let analysis = natural(&full(100));
    assert_eq!(analysis.factor_entries(), 100 * 100);
    let ratio = analysis.multiplications() / (100.0_f64.powi(3) / 6.0);
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
    let factor = Ldlt::<Complex32>::new(&analysis, |row, k| {
        Complex32::new(if k == 101 * row { 200.0 } else { 1.0 }, 1.0)
    });
    let bytes = factor.expect("diagonally dominant").bytes();
    // The pivots twice more, and one panel.
    assert!((81_600..82_000).contains(&bytes), "{bytes}");
}

/// Rows of a grid of three components whose first coordinate is at least seven change.
fn changing(structure: &CsrStructure) -> Vec<bool> {
    (0..structure.row_count()).map(|row| row / (3 * 11 * 11) >= 7).collect()
}

/// The model matrix with other diagonal entries in some rows.
fn with_other_rows<T: Entry>(
    structure: &CsrStructure,
    changed: impl Fn(usize) -> bool,
    row: usize,
    k: usize,
) -> T {
    let own = structure.columns[k] as usize == row;
    let more = if own && changed(row) { 0.37 } else { 0.0 };
    value::<T>(structure, row, k) + T::from_complex(Complex64::new(more, 0.0))
}

fn keeping<T: Entry>() {
    let structure = grid(11, 3);
    let changes = changing(&structure);
    let order = kept_first(&structure, None, Changes { rows: &changes, max_rim_multiplications: 1e7 });
    let analysis = LdltAnalysis::keeping(&structure, order, &changes).expect("a symmetric pattern");
    let (all, changing) = (analysis.multiplications(), analysis.changing_multiplications());
    assert!(0.0 < changing && changing < 0.8 * all, "{changing:e} of {all:e}");
    let before = factor::<T>(&analysis);
    let kept = before.kept().expect("some panels");
    let found_of = |changed: &(dyn Fn(usize) -> bool + Sync)| {
        let entry = |row, k| with_other_rows(&structure, changed, row, k);
        let own = Ldlt::<T>::new(&analysis, entry).expect("no pivot is zero");
        let found = Ldlt::new_keeping(&analysis, entry, Some(&kept)).expect("no pivot is zero");
        for (p, (own, found)) in own.panels.iter().zip(&found.panels).enumerate() {
            assert_eq!(own.entries, found.entries, "panel {p}");
            assert_eq!(own.inverse_pivots, found.inverse_pivots, "panel {p}");
        }
        kept.found_in(&found)
    };
    let of_analysis = (0..before.panels.len()).filter(|&p| analysis.is_kept(p)).count();
    assert_eq!(found_of(&|row| changes[row]), of_analysis);
    // A row among those that were to stay takes all that come from it, and no more.
    let some = found_of(&|row| row == 40 || changes[row]);
    assert!(0 < some && some < of_analysis, "{some} of {of_analysis}");
    assert_eq!(found_of(&|_| true), 0);
}

#[test]
fn a_factor_that_is_kept_in_part_has_the_bits_of_its_own() {
    keeping::<f32>();
    keeping::<f64>();
    keeping::<Complex32>();
    keeping::<Complex64>();
}

#[test]
fn panels_of_another_analysis_are_not_taken() {
    let structure = grid(11, 3);
    let changes = changing(&structure);
    let make = || {
        let order = kept_first(&structure, None, Changes { rows: &changes, max_rim_multiplications: 1e7 });
        LdltAnalysis::keeping(&structure, order, &changes).expect("a symmetric pattern")
    };
    let (one, other) = (make(), make());
    let kept = factor::<f64>(&one).kept().expect("some panels");
    let factor = Ldlt::new_keeping(&other, |row, k| value::<f64>(&structure, row, k), Some(&kept));
    let panels = factor.expect("no pivot is zero").panels;
    assert!(
        panels
            .iter()
            .zip(&kept.panels)
            .all(|(own, kept)| { kept.as_ref().is_none_or(|kept| !Arc::ptr_eq(own, kept)) })
    );
    // Without rows that stay there is nothing to keep.
    assert!(self::factor::<f64>(&analysis(&structure)).kept().is_none());
}
