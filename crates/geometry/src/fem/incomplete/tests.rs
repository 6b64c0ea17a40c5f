//! What holds for an incomplete factor: exact without fill, symmetric, independent of the threads, honest about bad pivots.

use num_complex::{Complex32, Complex64};

use super::*;
use crate::determinism::same_on_any_threads;
use crate::fem::csr::{CsrMatrix, CsrStructure};

/// The seven-point operator on an `m × m × m` grid with couplings `weights` along the axes, and `j/10` on the diagonal.
fn grid(m: usize, weights: [f64; 3]) -> CsrMatrix<Complex64> {
    let row = |i: usize| {
        let mut row = vec![(i, Complex64::new(2.0 * weights.iter().sum::<f64>(), 0.1))];
        for (stride, weight) in [m * m, m, 1].into_iter().zip(weights) {
            let (at, coupling) = (i / stride % m, Complex64::new(-weight, 0.0));
            row.extend((at > 0).then(|| (i - stride, coupling)));
            row.extend((at + 1 < m).then(|| (i + stride, coupling)));
        }
        row
    };
    CsrMatrix::from_rows(m * m * m, (0..m * m * m).map(row))
}

fn strong(matrix: &CsrMatrix<Complex64>) -> impl Fn(usize, usize) -> bool + '_ {
    |row, k| {
        let column = matrix.structure.columns[k] as usize;
        let diagonal = |i| matrix.entry(i, i).expect("the diagonal is stored").norm().sqrt();
        matrix.values[k].norm() > 0.25 * diagonal(row) * diagonal(column)
    }
}

fn vector(n: usize, step: f64) -> Vec<Complex64> {
    (0..n).map(|i| Complex64::new((step * i as f64).sin(), (step * i as f64 + 1.0).cos())).collect()
}

/// A chain of 20 000 unknowns has no fill: the factor is the exact one, in the order of the matrix. In parts the separators
/// are single rows, and the fill between the two neighbours of a slab is the only one that is dropped.
#[test]
fn without_fill_it_is_the_exact_factor() {
    let n = 20_000_usize;
    let entry = |i, c| if c == i { Complex64::new(2.2, 0.3) } else { Complex64::new(-1.0, 0.1) };
    let row = |i: usize| (i.saturating_sub(1)..(i + 2).min(n)).map(|c| (c, entry(i, c))).collect();
    let a = CsrMatrix::from_rows(n, (0..n).map(row));
    let analysis = IncompleteAnalysis::new(&a.structure);
    assert_eq!(analysis.entry_count(), n - 1);
    let factor = Incomplete::new(&analysis, |_, k| a.values[k], 1.0).expect("it is regular");
    let exact = vector(n, 0.37);
    let mut b = vec![Complex64::default(); n];
    let mut x = b.clone();
    a.mul(&exact, &mut b);
    factor.solve(|i| b[i], &mut x, |x| x);
    let error = x.iter().zip(&exact).map(|(x, e)| (x - e).norm()).fold(0.0, f64::max);
    assert!(error < 1e-13, "{error:e}");
}

/// `xᵀ M⁻¹ y = yᵀ M⁻¹ x`, in one part and in several.
#[test]
fn its_action_is_symmetric() {
    let a = grid(32, [1.0, 1.0, 8.0]);
    let n = a.structure.row_count();
    for analysis in
        [IncompleteAnalysis::new(&a.structure), IncompleteAnalysis::in_parts(&a.structure, strong(&a))]
    {
        let factor = Incomplete::new(&analysis, |_, k| a.values[k], 1.02).expect("it is regular");
        let (x, y) = (vector(n, 0.7), vector(n, 1.3));
        let applied = |v: &[Complex64]| {
            let mut x = vec![Complex64::default(); n];
            factor.solve(|i| v[i], &mut x, |x| x);
            x
        };
        let product =
            |a: &[Complex64], b: &[Complex64]| -> Complex64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let (left, right) = (product(&x, &applied(&y)), product(&y, &applied(&x)));
        // Sums of 32 768 terms that partly cancel.
        assert!((left - right).norm() < 1e-11 * left.norm(), "{left} {right}");
    }
}

#[test]
fn the_parts_are_independent_and_strong_couplings_are_not_cut() {
    let a = grid(32, [1.0, 1.0, 8.0]);
    let analysis = IncompleteAnalysis::in_parts(&a.structure, strong(&a));
    assert_eq!(analysis.slabs.len(), 8, "a slab for every 4096 rows");
    assert_eq!(analysis.separators.len(), 7);
    let part_of = |row: u32| {
        let row = analysis.inverse[row as usize] as usize;
        let slab = analysis.slabs.iter().position(|slab| slab.contains(&row));
        let separator = || analysis.separators.iter().position(|rows| rows.contains(&row));
        slab.map_or_else(|| (1, separator().expect("a row is in a part")), |slab| (0, slab))
    };
    for row in 0..a.structure.row_count() {
        for k in a.structure.row(row) {
            let (one, other) = (part_of(row as u32), part_of(a.structure.columns[k]));
            assert!(one == other || one.0 != other.0, "row {row}: {one:?} touches {other:?}");
            assert!(one == other || a.values[k].re > -8.0, "row {row}: a strong coupling is cut");
        }
    }
}

#[test]
fn the_bits_do_not_depend_on_the_threads() {
    let a = grid(32, [1.0, 2.0, 8.0]);
    same_on_any_threads(|| {
        let analysis = IncompleteAnalysis::in_parts(&a.structure, strong(&a));
        let narrow = |v: Complex64| Complex32::new(v.re as f32, v.im as f32);
        let factor = Incomplete::new(&analysis, |_, k| narrow(a.values[k]), 1.02).expect("it is regular");
        let b = vector(a.structure.row_count(), 0.3);
        let mut x = vec![(0, 0); b.len()];
        factor.solve(|i| narrow(b[i]), &mut x, |v| (v.re.to_bits(), v.im.to_bits()));
        x
    });
}

/// Couplings of 0.9 against a diagonal of 1 on a ring of four: indefinite, until the diagonal is raised.
#[test]
fn a_bad_pivot_raises_the_diagonal_and_a_diagonal_of_zero_is_an_error() {
    let structure = Arc::new(CsrStructure {
        column_count: 4,
        row_starts: vec![0, 3, 6, 9, 12],
        columns: vec![0, 1, 3, 0, 1, 2, 1, 2, 3, 0, 2, 3],
    });
    let analysis = IncompleteAnalysis::new(&structure);
    let factored = |diagonal: f64| {
        let entry = |row: usize, k: usize| if structure.columns[k] as usize == row { diagonal } else { 0.9 };
        Incomplete::<f64>::new(&analysis, entry, 1.0)
    };
    let raised = factored(1.0).expect("a raised diagonal helps").diagonal_factor();
    assert!(raised > 1.0, "{raised}");
    // The first of them, whichever thread comes first.
    let message = same_on_any_threads(|| factored(0.0).expect_err("there is no pivot").to_string());
    assert!(message.contains("row 0"), "{message}");
}
