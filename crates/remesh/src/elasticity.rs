//! Isotropic linear elasticity on a linear tetrahedron (Eq. ): the element stiffness of Eq. 1.
//!
//! Weak form: `∫ λ (div u)(div w) + 2 μ ε(u) : ε(w)` with `ε(u) = ½ (∇u + ∇uᵀ)` and the Lamé parameters `λ`, `μ` [Pa].
//! With `B` the strain matrix `(6, 12)` and `D` the elasticity matrix `(6, 6)` of A-2, constant on the element, it is
//! `K_e = V Bᵀ D B` (Zienkiewicz, The Finite Element Method, 3rd ed., ch. 6). Index form, node `a` direction `i` against
//! node `b` direction `j`:
//!
//! `K_ai,bj = V ( λ ∂_i N_a ∂_j N_b + μ ∂_j N_a ∂_i N_b + μ δ_ij ∇N_a · ∇N_b )`.
//!
//! A law with directions of its own is the same one in the carried strain `S ε S`, `S` symmetric positive definite:
//! `W = λ/2 (tr S ε S)² + μ S ε S : S ε S`. It sees the strain only, so that rigid motions stay free, and is positive
//! definite whenever the isotropic law is. With `T = S²` and `h_a = T ∇N_a`, from `tr S ε S = T : ε` and
//! `S ε S : S ε' S = tr T ε T ε'`,
//!
//! `K_ai,bj = V ( λ (h_a)_i (h_b)_j + μ (h_a)_j (h_b)_i + μ T_ij ∇N_a · h_b )`;
//!
//! along a principal direction of `T` with the value `√w` the stiffness is `w (λ + 2 μ)`, and the shear stiffness of two
//! such directions is the geometric mean `√(w_1 w_2) μ`. `T = 1` is the isotropic law.

use fluxmorph_geometry::fem::LocalMatrix;
use fluxmorph_geometry::tet4::{Tet4, dot};

/// Isotropic linear elasticity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Isotropic {
    /// Young's modulus `E` [Pa]; its unit cancels where no force is applied (section 2 of the paper).
    pub young: f64,
    /// Poisson's ratio `ν`, in `−1 < ν < ½`.
    pub poisson: f64,
}

impl Isotropic {
    /// The Lamé parameters `(λ, μ)` [Pa].
    #[inline]
    pub fn lame(&self) -> (f64, f64) {
        let Self { young, poisson } = *self;
        let lambda = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
        (lambda, young / (2.0 * (1.0 + poisson)))
    }
}

/// The tensor `T` of a law with directions; symmetric, positive definite.
pub type Tensor = [[f64; 3]; 3];

/// `T` of the isotropic law.
pub const ISOTROPIC: Tensor = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The element stiffness `K_e`, evaluated block by block.
#[derive(Clone, Copy, Debug)]
pub struct Stiffness {
    gradients: [[f64; 3]; 4],
    /// `h_a = T ∇N_a`.
    carried: [[f64; 3]; 4],
    tensor: Tensor,
    /// `V λ` and `V μ`.
    weights: (f64, f64),
}

/// Element stiffness of linear elasticity on a linear tetrahedron, with the tensor `T` of its directions.
///
/// `K_e = V Bᵀ D B`, shape `(12, 12)` in blocks of `(3, 3)`: row `3 a + i` = node `a`, direction `i`. Exact: `B` is
/// constant on the element.
#[inline]
pub fn stiffness(tet: &Tet4, law: &Isotropic, tensor: &Tensor) -> Stiffness {
    let (lambda, mu) = law.lame();
    Stiffness {
        gradients: tet.gradients,
        carried: tet.gradients.map(|g| tensor.map(|row| dot(row, g))),
        tensor: *tensor,
        weights: (tet.volume * lambda, tet.volume * mu),
    }
}

impl LocalMatrix<f64, 4, 3> for Stiffness {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[f64; 3]; 3] {
        let (ha, hb) = (self.carried[a], self.carried[b]);
        let (lambda, mu) = self.weights;
        let shear = mu * dot(self.gradients[a], hb);
        let entry =
            |i: usize, j: usize| lambda * ha[i] * hb[j] + mu * ha[j] * hb[i] + shear * self.tensor[i][j];
        std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fluxmorph_geometry::tet4::cross;

    const SKEW: [[f64; 3]; 4] = [[0.1, 0.2, -0.1], [1.3, 0.1, 0.2], [0.3, 0.9, 0.1], [0.2, 0.3, 1.4]];
    const LAW: Isotropic = Isotropic { young: 2.5, poisson: 0.3 };

    fn full(k: &Stiffness) -> [[f64; 12]; 12] {
        std::array::from_fn(|r| std::array::from_fn(|c| k.block(r / 3, c / 3)[r % 3][c % 3]))
    }

    /// `D` of A-2, strains in the order of A-1.
    fn elasticity_matrix(law: &Isotropic) -> [[f64; 6]; 6] {
        let (e, nu) = (law.young, law.poisson);
        let factor = e * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu));
        let (side, shear) = (nu / (1.0 - nu), (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu)));
        let mut d = [[0.0; 6]; 6];
        for i in 0..3 {
            for j in 0..3 {
                d[i][j] = factor * if i == j { 1.0 } else { side };
            }
            d[i + 3][i + 3] = factor * shear;
        }
        d
    }

    /// `V Bᵀ D B` with `B` written out.
    fn product(tet: &Tet4, d: &[[f64; 6]; 6]) -> [[f64; 12]; 12] {
        let mut b = [[0.0; 12]; 6];
        for (a, [x, y, z]) in tet.gradients.into_iter().enumerate() {
            let rows = [[x, 0., 0.], [0., y, 0.], [0., 0., z], [y, x, 0.], [0., z, y], [z, 0., x]];
            for (row, values) in rows.into_iter().enumerate() {
                b[row][3 * a..3 * a + 3].copy_from_slice(&values);
            }
        }
        std::array::from_fn(|r| {
            std::array::from_fn(|c| {
                let terms = (0..6).flat_map(|s| (0..6).map(move |t| (s, t)));
                tet.volume * terms.map(|(s, t)| b[s][r] * d[s][t] * b[t][c]).sum::<f64>()
            })
        })
    }

    #[test]
    fn blocks_equal_the_explicit_product() {
        let tet = Tet4::new(SKEW);
        let blocks = full(&stiffness(&tet, &LAW, &ISOTROPIC));
        let explicit = product(&tet, &elasticity_matrix(&LAW));
        for (r, c) in (0..12).flat_map(|r| (0..12).map(move |c| (r, c))) {
            assert!((blocks[r][c] - explicit[r][c]).abs() < 1e-14 * LAW.young, "({r}, {c})");
        }
    }

    /// Orthonormal axes, none along a coordinate axis, and their weights.
    const AXES: [[f64; 3]; 3] = [
        [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0],
        [3.0 / 7.0, -6.0 / 7.0, 2.0 / 7.0],
        [6.0 / 7.0, 2.0 / 7.0, -3.0 / 7.0],
    ];
    const WEIGHTS: [f64; 3] = [0.3, 1.7, 40.0];

    fn skew_tensor() -> Tensor {
        let term = |i: usize, j: usize| {
            AXES.iter().zip(WEIGHTS).map(|(n, w): (&[f64; 3], f64)| w.sqrt() * n[i] * n[j]).sum()
        };
        std::array::from_fn(|i| std::array::from_fn(|j| term(i, j)))
    }

    /// Stiffness 2 D of the strain along its own axes, turned: `D = Rᵀ D' R` with the strain's transformation `R`.
    #[test]
    fn a_law_with_directions_equals_the_product_with_its_matrix_turned() {
        let root = WEIGHTS.map(f64::sqrt);
        let own = elasticity_matrix(&LAW);
        // Order of the strains: xx, yy, zz, xy, yz, zx; engineering shear.
        const PAIRS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [1, 2], [2, 0]];
        // The strain `p` along the axes is `S ε S` there: a factor √(√w_i √w_j) on either strain.
        let factor = |[i, j]: [usize; 2]| (root[i] * root[j]).sqrt();
        let weighted: [[f64; 6]; 6] =
            std::array::from_fn(|p| std::array::from_fn(|q| own[p][q] * factor(PAIRS[p]) * factor(PAIRS[q])));
        // ε'_kl = n_k · ε n_l, engineering shear on both sides.
        let turn: [[f64; 6]; 6] = std::array::from_fn(|p| {
            std::array::from_fn(|q| {
                let ([k, l], [i, j]) = (PAIRS[p], PAIRS[q]);
                let pair = AXES[k][i] * AXES[l][j] + AXES[k][j] * AXES[l][i];
                if k == l { 0.5 * pair } else { pair }
            })
        });
        let turned: [[f64; 6]; 6] = std::array::from_fn(|r| {
            std::array::from_fn(|c| {
                let terms = (0..6).flat_map(|p| (0..6).map(move |q| (p, q)));
                terms.map(|(p, q)| turn[p][r] * weighted[p][q] * turn[q][c]).sum()
            })
        });
        let tet = Tet4::new(SKEW);
        let (blocks, explicit) = (full(&stiffness(&tet, &LAW, &skew_tensor())), product(&tet, &turned));
        for (r, c) in (0..12).flat_map(|r| (0..12).map(move |c| (r, c))) {
            // Entries of up to forty times Young's modulus.
            assert!((blocks[r][c] - explicit[r][c]).abs() < 1e-13 * LAW.young * WEIGHTS[2], "({r}, {c})");
        }
    }

    #[test]
    fn the_stiffness_is_symmetric_and_has_the_rigid_motions_as_null_space() {
        for tensor in [ISOTROPIC, skew_tensor()] {
            let k = full(&stiffness(&Tet4::new(SKEW), &LAW, &tensor));
            let size = k.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
            for (r, c) in (0..12).flat_map(|r| (0..12).map(move |c| (r, c))) {
                assert!((k[r][c] - k[c][r]).abs() < 1e-15 * size);
            }
            for motion in MOTIONS {
                let u: Vec<f64> = SKEW.iter().flat_map(|&x| motion(x)).collect();
                for row in k {
                    assert!(row.iter().zip(&u).map(|(k, u)| k * u).sum::<f64>().abs() < 1e-14 * size);
                }
            }
        }
    }

    const MOTIONS: [fn([f64; 3]) -> [f64; 3]; 6] = [
        |_| [1.0, 0.0, 0.0],
        |_| [0.0, 1.0, 0.0],
        |_| [0.0, 0.0, 1.0],
        |x| cross([1.0, 0.0, 0.0], x),
        |x| cross([0.0, 1.0, 0.0], x),
        |x| cross([0.0, 0.0, 1.0], x),
    ];
}
