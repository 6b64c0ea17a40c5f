//! Preconditioned conjugate gradients for real symmetric positive definite systems, to a true residual.
//!
//! Knows a matrix and a function that preconditions, and no more. The sums are ordered: the bits do not depend on the
//! threads.

use crate::fem::csr::CsrMatrix;
use crate::fem::scalar::{advance, dot, dots, norm, ordered_sum, scale_add};

/// What an iterative solution reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IterationReport {
    /// Products with the matrix, but for those of the residual's check.
    pub iterations: usize,
    /// True residual `‖b − A x‖ / ‖b‖`.
    pub residual: f64,
    /// Whether the residual is within the tolerance, or at the rounding of its own evaluation.
    pub status: IterationStatus,
}

/// How an iterative solution ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IterationStatus {
    /// The residual is what was asked for.
    Converged,
    /// It is not, and more iterations or digits would be needed.
    Stopped,
}

/// Rounding of a residual's evaluation, in units of `ε ‖ |A| |x| + |b| ‖`: rows have some tens of terms. Below this a
/// residual says nothing, and a direct factor leaves no less.
const ROUNDING: f64 = 8.0;

/// Solves `A x = b` by preconditioned conjugate gradients, from zero, until the true relative residual is at most
/// `tolerance` or at its own rounding.
///
/// The direction update is the flexible one, `β = z⁺·(r⁺ − r) / z·r`: a preconditioner in single
/// precision is symmetric only up to its rounding. `precondition(r, z)` overwrites `z` with `M⁻¹ r`.
pub fn conjugate_gradients(
    matrix: &CsrMatrix<f64>,
    mut precondition: impl FnMut(&[f64], &mut [f64]),
    right_side: &[f64],
    tolerance: f64,
    max_iterations: usize,
) -> (Vec<f64>, IterationReport) {
    let n = right_side.len();
    let mut x = vec![0.0; n];
    let scale = norm(right_side);
    if scale == 0.0 {
        return (x, IterationReport { iterations: 0, residual: 0.0, status: IterationStatus::Converged });
    }
    let mut r = right_side.to_vec();
    let mut iterations = 0;
    let mut residual = 1.0;
    let mut status = IterationStatus::Stopped;
    // The residual of the recurrence drifts from the true one: go on from the true one where they part.
    while scale.is_finite() && iterations < max_iterations {
        let done = descend(
            matrix,
            &mut precondition,
            &mut x,
            &mut r,
            tolerance * scale,
            max_iterations - iterations,
        );
        iterations += done;
        let before = residual;
        r = matrix.residual(&x, right_side);
        residual = norm(&r) / scale;
        if residual <= tolerance
            || residual * scale <= ROUNDING * f64::EPSILON * magnitude(matrix, &x, right_side)
        {
            status = IterationStatus::Converged;
            break;
        }
        // Not even a digit by a restart (or no number any more): there is none to be had.
        if done == 0 || residual.is_nan() || residual > 0.1 * before {
            break;
        }
    }
    (x, IterationReport { iterations, residual, status })
}

/// `‖ |A| |x| + |b| ‖`.
fn magnitude(matrix: &CsrMatrix<f64>, x: &[f64], b: &[f64]) -> f64 {
    let structure = &matrix.structure;
    let of_row = |row: usize| {
        let range = structure.row(row);
        let terms = matrix.values[range.clone()].iter().zip(&structure.columns[range]);
        let sum = b[row].abs() + terms.map(|(a, &c)| (a * x[c as usize]).abs()).sum::<f64>();
        sum * sum
    };
    ordered_sum(b.len(), of_row).sqrt()
}

/// Conjugate gradients from `x` with the residual `r`, both updated, until `‖r‖ ≤ target`; iterations made.
fn descend(
    matrix: &CsrMatrix<f64>,
    precondition: &mut impl FnMut(&[f64], &mut [f64]),
    x: &mut [f64],
    r: &mut [f64],
    target: f64,
    max_iterations: usize,
) -> usize {
    let n = x.len();
    let (mut z, mut product) = (vec![0.0; n], vec![0.0; n]);
    precondition(r, &mut z);
    let mut direction = z.clone();
    let mut slope = dot(r, &z);
    let mut size = norm(r);
    for iteration in 0..max_iterations {
        if size <= target || !slope.is_finite() {
            return iteration;
        }
        matrix.mul(&direction, &mut product);
        let step = slope / dot(&direction, &product);
        if !step.is_finite() {
            return iteration;
        }
        size = advance(step, (&mut *x, &direction), (&mut *r, &product));
        precondition(r, &mut z);
        // r⁺ − r = −step A p.
        let [fresh, change] = dots(&z, [&*r, &product]);
        scale_add(-step * change / slope, &mut direction, &z);
        slope = fresh;
    }
    max_iterations
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of `n` springs of 1, held by half a spring at one end: tridiagonal, with an exact inverse.
    fn chain(n: usize) -> CsrMatrix<f64> {
        let row = |i: usize| {
            let diagonal = match i {
                0 => 1.5,
                i if i + 1 == n => 1.0,
                _ => 2.0,
            };
            let entry = |j| (j, if j == i { diagonal } else { -1.0 });
            (i.saturating_sub(1)..(i + 2).min(n)).map(entry).collect()
        };
        CsrMatrix::from_rows(n, (0..n).map(row))
    }

    fn solve(n: usize, b: &[f64], tolerance: f64, iterations: usize) -> (Vec<f64>, IterationReport) {
        conjugate_gradients(&chain(n), |r, z| z.copy_from_slice(r), b, tolerance, iterations)
    }

    /// A unit force at the free end: the holding spring yields 2, every other 1.
    #[test]
    fn a_chain_of_springs_is_solved_in_as_many_steps_as_it_has_links() {
        let n = 30;
        let mut b = vec![0.0; n];
        b[n - 1] = 1.0;
        let (x, report) = solve(n, &b, 1e-12, 100);
        assert_eq!(report.status, IterationStatus::Converged);
        assert!(report.iterations <= n + 2, "{report:?}");
        for (i, x) in x.iter().enumerate() {
            // Condition about n².
            assert!((x - (2 + i) as f64).abs() < 1e-9, "{i}: {x}");
        }
    }

    #[test]
    fn an_iteration_that_is_cut_short_says_so() {
        let b: Vec<f64> = (0..30).map(|i| (0.37 * f64::from(i)).sin()).collect();
        let (_, report) = solve(30, &b, 1e-12, 2);
        assert_eq!((report.iterations, report.status), (2, IterationStatus::Stopped));
        assert!(report.residual > 1e-12);
    }

    #[test]
    fn a_right_side_of_zeros_has_no_iteration_and_one_that_is_not_finite_no_solution() {
        let (x, report) = solve(30, &[0.0; 30], 1e-12, 100);
        assert_eq!((report.iterations, report.status), (0, IterationStatus::Converged));
        assert!(x.iter().all(|x| *x == 0.0));
        let (_, report) = solve(30, &[f64::NAN; 30], 1e-12, 100);
        assert_eq!((report.iterations, report.status), (0, IterationStatus::Stopped));
    }

    #[test]
    fn a_residual_at_its_own_rounding_is_accepted() {
        let b: Vec<f64> = (0..30).map(|i| (0.37 * f64::from(i)).sin()).collect();
        let (_, report) = solve(30, &b, 0.0, 1000);
        assert_eq!(report.status, IterationStatus::Converged);
        // ‖|A| |x|‖ is some hundred times ‖b‖.
        assert!(report.residual < 1e-12, "{:e}", report.residual);
    }
}
