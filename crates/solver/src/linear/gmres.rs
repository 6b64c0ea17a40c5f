//! GMRES for operators on complex vectors that are linear over the real numbers alone.
//!
//! `A(x) = P x + Q x̄` has no complex matrix; with the real inner product `Re xᴴy` it is a real operator of twice the size. The
//! preconditioner, from the right, may differ from step to step (Saad, SIAM J. Sci. Comput. 14 (1993) 461, flexible GMRES).

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::fem::scalar::{axpy, norm, ordered_sum};

use crate::error::SolverError;

/// Vectors that are held before a restart: twice so many of the length of the unknowns.
const RESTART: usize = 40;

/// An operator, or a preconditioner.
pub(crate) type Operator<'a> = dyn FnMut(&[c64]) -> Result<Vec<c64>, SolverError> + 'a;

/// How it ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ended {
    /// Applications of the operator.
    pub(crate) iterations: usize,
    /// True residual over the right side's norm.
    pub(crate) residual: f64,
}

/// Solves `A(x) = b` from zero until `|b − A(x)| ≤ tolerance |b|`, or until a restart gains nothing.
///
/// # Errors
/// Those of the operators.
pub(crate) fn solve(
    right_side: &[c64],
    operator: &mut Operator<'_>,
    preconditioner: &mut Operator<'_>,
    (tolerance, most): (f64, usize),
) -> Result<(Vec<c64>, Ended), SolverError> {
    let scale = norm(right_side);
    let mut x = vec![c64::default(); right_side.len()];
    let mut ended = Ended { iterations: 0, residual: if scale > 0.0 { 1.0 } else { 0.0 } };
    let mut residual = right_side.to_vec();
    while ended.residual > tolerance && ended.iterations < most {
        let before = ended.residual;
        let steps = RESTART.min(most - ended.iterations);
        ended.iterations += cycle(&mut x, &residual, (operator, preconditioner), tolerance * scale, steps)?;
        residual = operator(&x)?;
        residual.iter_mut().zip(right_side).for_each(|(r, b)| *r = b - *r);
        ended.residual = norm(&residual) / scale;
        // Also where it is no number.
        if ended.residual.is_nan() || ended.residual >= 0.5 * before {
            break;
        }
    }
    Ok((x, ended))
}

/// One cycle: adds its correction to `x`, and gives its number of steps.
fn cycle(
    x: &mut [c64],
    residual: &[c64],
    (operator, preconditioner): (&mut Operator<'_>, &mut Operator<'_>),
    target: f64,
    most: usize,
) -> Result<usize, SolverError> {
    let beta = norm(residual);
    let mut basis = vec![scaled(residual, 1.0 / beta)];
    let mut directions: Vec<Vec<c64>> = Vec::new();
    // Columns of the triangle that rotations leave of the Hessenberg matrix, and the right side turned alike.
    let (mut columns, mut rotations, mut turned) =
        (Vec::<Vec<f64>>::new(), Vec::<[f64; 2]>::new(), vec![beta]);
    while columns.len() < most {
        let z = preconditioner(&basis[columns.len()])?;
        let mut w = operator(&z)?;
        directions.push(z);
        let mut column = Vec::with_capacity(basis.len() + 1);
        for v in &basis {
            let h = real_dot(v, &w);
            axpy(c64::from(-h), v, &mut w);
            column.push(h);
        }
        // Once more: with one pass the basis loses its orthogonality near the end.
        for (v, h) in basis.iter().zip(&mut column) {
            let more = real_dot(v, &w);
            axpy(c64::from(-more), v, &mut w);
            *h += more;
        }
        let next = norm(&w);
        for (k, [c, s]) in rotations.iter().enumerate() {
            let (a, b) = (column[k], column[k + 1]);
            (column[k], column[k + 1]) = (c * a + s * b, c * b - s * a);
        }
        let k = columns.len();
        let length = column[k].hypot(next);
        let [c, s] = if length > 0.0 { [column[k] / length, next / length] } else { [1.0, 0.0] };
        column[k] = length;
        rotations.push([c, s]);
        columns.push(column);
        turned.push(-s * turned[k]);
        turned[k] *= c;
        if turned[k + 1].abs() <= target || next == 0.0 || !next.is_finite() {
            break;
        }
        basis.push(scaled(&w, 1.0 / next));
    }
    let mut shares = vec![0.0; columns.len()];
    for k in (0..columns.len()).rev() {
        let known: f64 = (k + 1..columns.len()).map(|j| columns[j][k] * shares[j]).sum();
        shares[k] = if columns[k][k] == 0.0 { 0.0 } else { (turned[k] - known) / columns[k][k] };
    }
    for (share, z) in shares.iter().zip(&directions) {
        axpy(c64::from(*share), z, x);
    }
    Ok(columns.len())
}

fn scaled(x: &[c64], factor: f64) -> Vec<c64> {
    x.iter().map(|x| factor * x).collect()
}

/// `Re xᴴy`.
fn real_dot(x: &[c64], y: &[c64]) -> f64 {
    ordered_sum(x.len(), |i| x[i].re * y[i].re + x[i].im * y[i].im)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `P` with a strong diagonal, and a `Q` that conjugates.
    fn operator(x: &[c64]) -> Vec<c64> {
        let n = x.len();
        let of = |i: usize| {
            let next = x[(i + 1) % n];
            (3.0 + i as f64) * x[i] + c64::new(0.3, -0.8) * next + c64::new(-0.4, 0.9) * x[i].conj()
        };
        (0..n).map(of).collect()
    }

    #[test]
    fn an_operator_that_conjugates_is_inverted() {
        let exact: Vec<c64> =
            (0..60).map(|i| c64::new((0.7 * f64::from(i)).sin(), 0.1 * f64::from(i))).collect();
        let right_side = operator(&exact);
        for most in [400, 8] {
            let apply = &mut |x: &[c64]| Ok(operator(x));
            let jacobi = &mut |r: &[c64]| -> Result<Vec<c64>, SolverError> {
                Ok(r.iter().enumerate().map(|(i, r)| r / (3.0 + i as f64)).collect())
            };
            let (x, ended) = solve(&right_side, apply, jacobi, (1e-13, most)).expect("nothing fails");
            if most == 400 {
                let worst = x.iter().zip(&exact).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
                assert!(worst < 1e-11 && ended.residual <= 1e-13, "{worst} {ended:?}");
            } else {
                assert!(
                    ended.iterations == most && ended.residual > 1e-13,
                    "it says where it stops: {ended:?}"
                );
            }
        }
    }

    #[test]
    fn nothing_on_the_right_has_the_solution_zero() {
        let apply = &mut |x: &[c64]| Ok(operator(x));
        let same = &mut |r: &[c64]| Ok(r.to_vec());
        let (x, ended) = solve(&[c64::default(); 5], apply, same, (1e-12, 10)).expect("nothing fails");
        assert!(x.iter().all(|x| *x == c64::default()) && ended.iterations == 0 && ended.residual == 0.0);
    }
}
