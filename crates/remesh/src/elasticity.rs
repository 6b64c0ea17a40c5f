//! Isotropic linear elasticity on a linear tetrahedron (Eq. ): the element stiffness of Eq. 1.
//!
//! Weak form: `∫ λ (div u)(div w) + 2 μ ε(u) : ε(w)` with `ε(u) = ½ (∇u + ∇uᵀ)` and the Lamé parameters `λ`, `μ` [Pa].
//! With `B` the strain matrix `(6, 12)` and `D` the elasticity matrix `(6, 6)` of A-2, constant on the element, it is
//! `K_e = V Bᵀ D B` (Zienkiewicz, The Finite Element Method, 3rd ed., ch. 6). Index form, node `a` direction `i` against
//! node `b` direction `j`:
//!
//! `K_ai,bj = V ( λ ∂_i N_a ∂_j N_b + μ ∂_j N_a ∂_i N_b + μ δ_ij ∇N_a · ∇N_b )`.

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

/// The element stiffness `K_e`, evaluated block by block.
#[derive(Clone, Copy, Debug)]
pub struct Stiffness {
    gradients: [[f64; 3]; 4],
    /// `V λ` and `V μ`.
    weights: (f64, f64),
}

/// Element stiffness of isotropic linear elasticity on a linear tetrahedron.
///
/// `K_e = V Bᵀ D B`, shape `(12, 12)` in blocks of `(3, 3)`: row `3 a + i` = node `a`, direction `i`. Exact: `B` is
/// constant on the element.
#[inline]
pub fn stiffness(tet: &Tet4, law: &Isotropic) -> Stiffness {
    let (lambda, mu) = law.lame();
    Stiffness { gradients: tet.gradients, weights: (tet.volume * lambda, tet.volume * mu) }
}

impl LocalMatrix<f64, 4, 3> for Stiffness {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[f64; 3]; 3] {
        let (ga, gb) = (self.gradients[a], self.gradients[b]);
        let (lambda, mu) = self.weights;
        let diagonal = mu * dot(ga, gb);
        let mut block = [[0.0; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                block[i][j] = lambda * ga[i] * gb[j] + mu * ga[j] * gb[i];
            }
            block[i][i] += diagonal;
        }
        block
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

    /// `V Bᵀ D B` with `B` and `D` written out, strains in the order of A-1.
    fn product(tet: &Tet4, law: &Isotropic) -> [[f64; 12]; 12] {
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
        let (blocks, explicit) = (full(&stiffness(&tet, &LAW)), product(&tet, &LAW));
        for (r, c) in (0..12).flat_map(|r| (0..12).map(move |c| (r, c))) {
            assert!((blocks[r][c] - explicit[r][c]).abs() < 1e-14 * LAW.young, "({r}, {c})");
        }
    }

    #[test]
    fn the_stiffness_is_symmetric_and_has_the_rigid_motions_as_null_space() {
        let k = full(&stiffness(&Tet4::new(SKEW), &LAW));
        for (r, c) in (0..12).flat_map(|r| (0..12).map(move |c| (r, c))) {
            assert!((k[r][c] - k[c][r]).abs() < 1e-15);
        }
        let motions: [fn([f64; 3]) -> [f64; 3]; 6] = [
            |_| [1.0, 0.0, 0.0],
            |_| [0.0, 1.0, 0.0],
            |_| [0.0, 0.0, 1.0],
            |x| cross([1.0, 0.0, 0.0], x),
            |x| cross([0.0, 1.0, 0.0], x),
            |x| cross([0.0, 0.0, 1.0], x),
        ];
        for motion in motions {
            let u: Vec<f64> = SKEW.iter().flat_map(|&x| motion(x)).collect();
            for row in k {
                assert!(row.iter().zip(&u).map(|(k, u)| k * u).sum::<f64>().abs() < 1e-14);
            }
        }
    }
}
