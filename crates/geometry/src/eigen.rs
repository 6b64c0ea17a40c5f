//! Eigenvalues of symmetric matrices, 3 × 3.

use crate::tet4::Point;

/// Eigenvalues and unit eigenvectors of a symmetric matrix, in no order, by cyclic Jacobi rotations (Golub & Van Loan,
/// Matrix Computations, 4th ed., section 8.5): small eigenvalues come out to their own precision where the matrix is
/// graded, and nothing is allocated.
pub fn eigen_decomposition(mut a: [Point; 3]) -> ([f64; 3], [Point; 3]) {
    let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    // Converges quadratically: 3 × 3 matrices take four or five sweeps.
    for _ in 0..10 {
        let rest = a[0][1].abs() + a[0][2].abs() + a[1][2].abs();
        if rest <= f64::MIN_POSITIVE {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = 1.0f64.copysign(theta) / (theta.abs() + theta.hypot(1.0));
            let cosine = 1.0 / t.hypot(1.0);
            let sine = t * cosine;
            let turn = |x: f64, y: f64| (cosine * x - sine * y, sine * x + cosine * y);
            for k in 0..3 {
                (a[k][p], a[k][q]) = turn(a[k][p], a[k][q]);
            }
            for k in 0..3 {
                (a[p][k], a[q][k]) = turn(a[p][k], a[q][k]);
                (axes[p][k], axes[q][k]) = turn(axes[p][k], axes[q][k]);
            }
            (a[p][q], a[q][p]) = (0.0, 0.0);
        }
    }
    ([a[0][0], a[1][1], a[2][2]], axes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tet4::dot;

    #[test]
    fn a_matrix_maps_its_axes_to_multiples_of_themselves() {
        let matrix = [[2.0, -0.3, 0.5], [-0.3, 1.0, 0.25], [0.5, 0.25, -4.0]];
        let (values, axes) = eigen_decomposition(matrix);
        for (value, axis) in values.into_iter().zip(axes) {
            for (row, c) in matrix.into_iter().zip(axis) {
                assert!((dot(row, axis) - value * c).abs() < 1e-14, "{value}: {axis:?}");
            }
        }
        let diagonal = [[3.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(eigen_decomposition(diagonal).1, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    }
}
