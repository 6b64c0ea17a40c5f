//! Singular values of matrices, 3 × 3.

use fluxmorph_geometry::eigen_decomposition;
use fluxmorph_geometry::tet4::{Point, cross, dot, norm};

use crate::elasticity::{ISOTROPIC, Tensor};

/// `F = Σ_k σ_k u_k v_kᵀ` with rotations of the rows `u_k` and `v_k`: `σ_1 ≥ σ_2 ≥ |σ_3|`, and `σ_3` has the sign of `det F`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SingularValues {
    /// `u_k`, right-handed.
    pub(crate) left: [Point; 3],
    pub(crate) values: [f64; 3],
    /// `v_k`, right-handed.
    pub(crate) right: [Point; 3],
}

impl SingularValues {
    /// From the eigenvectors of `FᵀF`, whose images are then made orthogonal to one another: `F` is the sum to the rounding of
    /// `ε σ_1² / σ_2`, whatever `σ_3`.
    pub(crate) fn of(f: &Tensor) -> Self {
        let product = |i: usize, j: usize| (0..3).map(|k| f[k][i] * f[k][j]).sum::<f64>();
        let (squares, axes) =
            eigen_decomposition(std::array::from_fn(|i| std::array::from_fn(|j| product(i, j))));
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| squares[b].total_cmp(&squares[a]));
        let (first, second) = (axes[order[0]], axes[order[1]]);
        let right = [first, second, cross(first, second)];
        let images = right.map(|v| f.map(|row| dot(row, v)));
        let u1 = unit(images[0]).unwrap_or([1.0, 0.0, 0.0]);
        let across = |x: Point| -> Point { std::array::from_fn(|d| x[d] - dot(u1, x) * u1[d]) };
        // A matrix of rank one leaves the others open.
        let any = || (0..3).find_map(|d| unit(across(ISOTROPIC[d])).filter(|_| u1[d].abs() < 0.9));
        // Twice: of an image that is rounding, nothing but rounding is across at first.
        let u2 =
            unit(across(images[1])).and_then(|u| unit(across(u))).or_else(any).unwrap_or([0.0, 1.0, 0.0]);
        let left = [u1, u2, cross(u1, u2)];
        Self { left, values: std::array::from_fn(|k| dot(left[k], images[k])), right }
    }
}

/// The unit vector along one; `None` for one without length.
fn unit(x: Point) -> Option<Point> {
    let length = norm(x);
    (length > f64::MIN_POSITIVE.sqrt()).then(|| x.map(|c| c / length))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SKEW: Tensor = [[1.1, 0.4, -0.2], [0.1, 0.7, 0.3], [-0.5, 0.2, 0.9]];

    fn check(f: Tensor) {
        let SingularValues { left, values, right } = SingularValues::of(&f);
        for own in [left, right] {
            for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
                assert!((dot(own[i], own[j]) - f64::from(i == j)).abs() < 1e-14, "{f:?}");
            }
            assert!(dot(own[0], cross(own[1], own[2])) > 0.0, "a rotation");
        }
        for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
            let sum: f64 = (0..3).map(|k| left[k][i] * values[k] * right[k][j]).sum();
            assert!((sum - f[i][j]).abs() < 1e-13, "{f:?}");
        }
        let determinant = dot(f[0], cross(f[1], f[2]));
        assert!((values.iter().product::<f64>() - determinant).abs() < 1e-13);
        assert!(values[0] + 1e-13 >= values[1] && values[1] + 1e-13 >= values[2].abs(), "{values:?}");
    }

    #[test]
    fn a_matrix_is_the_sum_of_its_singular_parts_however_degenerate() {
        let squeezed = |least: f64| SKEW.map(|row| [row[0], row[1], least * row[2] + row[0] - row[1]]);
        for f in [SKEW, ISOTROPIC, SKEW.map(|row| row.map(|c| -c)), [SKEW[1], SKEW[0], SKEW[2]]] {
            check(f);
        }
        for least in [1e-3, 1e-9, 0.0, -1e-9, -0.3] {
            check(squeezed(least));
        }
        check([[0.0; 3]; 3]);
        check([[1.0, 2.0, 3.0], [0.5, 1.0, 1.5], [0.0; 3]]);
    }
}
