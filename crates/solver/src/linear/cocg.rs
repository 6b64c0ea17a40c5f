//! Conjugate orthogonal conjugate gradients for complex symmetric systems (van der Vorst and Melissen, IEEE Trans.
//! Magn. 26 (1990) 706): conjugate gradients with the bilinear product `xᵀy` in place of the inner product.
//!
//! The direction update is the flexible one, `β = zᵀ(r⁺ − r) / ρ = −α zᵀq / ρ`: a preconditioner in single precision is
//! symmetric only up to its rounding, and the usual `zᵀr⁺ / ρ` would let that rounding grow.

use fluxmorph_geometry::fem::{CsrMatrix, advance, c64, dot, dots, norm, scale_add};

/// How an iteration ended; the caller checks the true residual.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    /// Iterations done.
    pub iterations: usize,
}

/// Improves `x` until the recurrence's residual norm is at most `target`.
///
/// `precondition(r, z)` overwrites `z` with an approximation of `K⁻¹ r`; it must be fixed, and complex symmetric up to
/// rounding. Stops early where a bilinear product vanishes (breakdown), and where `stop(iterations, residual norm)`, asked
/// before each iteration, says so.
pub fn solve(
    matrix: &CsrMatrix<c64>,
    right_side: &[c64],
    x: &mut [c64],
    precondition: impl Fn(&[c64], &mut [c64]),
    target: f64,
    max_iterations: usize,
    mut stop: impl FnMut(usize, f64) -> bool,
) -> Outcome {
    let n = x.len();
    let mut residual = matrix.residual(x, right_side);
    let mut direction = vec![c64::default(); n];
    let mut preconditioned = vec![c64::default(); n];
    let mut image = vec![c64::default(); n];
    let mut alpha = c64::default();
    let mut rho = c64::new(1.0, 0.0);
    let mut size = norm(&residual);
    let mut iterations = 0;
    while iterations < max_iterations && size > target && !stop(iterations, size) {
        precondition(&residual, &mut preconditioned);
        let [zr, zq] = dots(&preconditioned, [&residual, &image]);
        let beta = quotient(-alpha * zq, rho);
        rho = zr;
        scale_add(beta, &mut direction, &preconditioned);
        matrix.mul(&direction, &mut image);
        let curvature = dot(&direction, &image);
        alpha = quotient(rho, curvature);
        let vanished = curvature.norm() == 0.0 || rho.norm() == 0.0;
        if vanished || !curvature.is_finite() || !rho.is_finite() || !alpha.is_finite() {
            break;
        }
        size = advance(alpha, (&mut *x, &direction), (&mut residual, &image));
        iterations += 1;
    }
    Outcome { iterations }
}

/// `a / b`, the square of whose modulus may leave the range of numbers: both times one power of two, which rounds nothing.
fn quotient(a: c64, b: c64) -> c64 {
    let size = b.re.abs().max(b.im.abs());
    if size == 0.0 || !size.is_finite() {
        return a / b;
    }
    let scale = (-size.log2().floor()).clamp(-1000.0, 1000.0).exp2();
    (a * scale) / (b * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quotient_has_the_bits_of_the_division_and_holds_where_that_overflows() {
        let (a, b) = (c64::new(1.7, -0.3), c64::new(-0.9, 2.3));
        assert_eq!(quotient(a, b), a / b);
        for size in [1e250, 1e-250] {
            let error = (quotient(a * size, b * size) - a / b).norm();
            // Three roundings of numbers of order one.
            assert!(error < 1e-15, "{error:e}");
        }
        assert!(!quotient(a, c64::default()).is_finite());
    }

    #[test]
    fn a_small_complex_symmetric_system_is_solved() {
        // Tridiagonal (−1, 3 + j, −1) of size 40: without preconditioner it ends within 40 iterations.
        let n = 40;
        let entry = |i, j| (j, if i == j { c64::new(3.0, 1.0) } else { c64::new(-1.0, 0.0) });
        let row = |i: usize| (i.saturating_sub(1)..(i + 2).min(n)).map(|j| entry(i, j)).collect();
        let a = CsrMatrix::from_rows(n, (0..n).map(row));
        let exact: Vec<c64> = (0..n).map(|i| c64::new((i as f64).sin(), (i as f64).cos())).collect();
        let mut b = vec![c64::default(); n];
        a.mul(&exact, &mut b);
        let mut x = vec![c64::default(); n];
        let outcome = solve(&a, &b, &mut x, |r, z| z.copy_from_slice(r), 1e-13, n, |_, _| false);
        assert!(outcome.iterations < n);
        assert!(x.iter().zip(&exact).all(|(x, e)| (x - e).norm() < 1e-12));
    }
}
