//! The linear A–ψ tetrahedron in closed form.
//!
//! Weak form (paper Eq. A-4 with eddy currents; `ψ = φ/(jω)` makes it complex symmetric):
//!
//! `∫ν ∇A:∇w + ∫(p−1)ν div A div w + jω∫σ(A + ∇ψ)·w`,  `jω∫σ(A + ∇ψ)·∇q`.
//!
//! Index form for nodes `a`, `b` with constant gradients `g_a` and the volume `V`:
//!
//! | rows × columns | entry |
//! |---|---|
//! | `A_i`, `A_j` | `δ_ij (ν V g_a·g_b + jωσ V (1+δ_ab)/20) + (p−1)ν V g_a,i g_b,j` |
//! | `A_i`, `ψ` | `jωσ V/4 g_b,i` |
//! | `ψ`, `A_j` | `jωσ V/4 g_a,j` |
//! | `ψ`, `ψ` | `jωσ V g_a·g_b` |

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::{Tet4, dot};

use super::Complex3;

/// Coefficients of one element.
#[derive(Clone, Copy, Debug)]
pub struct Coefficients {
    /// `ν` [m/H].
    pub reluctivity: f64,
    /// `(p − 1) ν` [m/H]: what the penalty factor `p` adds to the vector Laplacian.
    pub extra_penalty: f64,
    /// `jωσ` [S/(m s)]; zero outside conductors and in statics.
    pub eddy: c64,
}

/// The A–ψ matrix of one linear tetrahedron, shape `(4 × 4, 4 × 4)`, components `A_x, A_y, A_z, ψ`.
#[derive(Clone, Copy, Debug)]
pub struct AphiTet {
    tet: Tet4,
    coefficients: Coefficients,
}

impl AphiTet {
    /// The element matrix for given geometry and coefficients.
    #[inline]
    pub fn new(tet: Tet4, coefficients: Coefficients) -> Self {
        Self { tet, coefficients }
    }
}

impl LocalMatrix<c64, 4, 4> for AphiTet {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[c64; 4]; 4] {
        let Coefficients { reluctivity, extra_penalty, eddy } = self.coefficients;
        let v = self.tet.volume;
        let (ga, gb) = (self.tet.gradients[a], self.tet.gradients[b]);
        let laplace = v * dot(ga, gb);
        let mass = v * if a == b { 0.1 } else { 0.05 };
        let mut block = [[c64::default(); 4]; 4];
        for i in 0..3 {
            block[i][i] = c64::new(reluctivity * laplace, 0.0) + eddy * mass;
            block[i][3] = eddy * (0.25 * v * gb[i]);
            block[3][i] = eddy * (0.25 * v * ga[i]);
        }
        if extra_penalty != 0.0 {
            for i in 0..3 {
                for j in 0..3 {
                    block[i][j] += extra_penalty * v * (ga[i] * gb[j]);
                }
            }
        }
        block[3][3] = eddy * laplace;
        block
    }

    #[inline]
    fn scalars(&self) -> Option<[[f64; 4]; 4]> {
        let Coefficients { reluctivity, extra_penalty, eddy } = self.coefficients;
        if extra_penalty != 0.0 || eddy != c64::default() {
            return None;
        }
        let (factor, g) = (reluctivity * self.tet.volume, &self.tet.gradients);
        let mut scalars = [[0.0; 4]; 4];
        for a in 0..4 {
            for b in a..4 {
                scalars[a][b] = factor * dot(g[a], g[b]);
            }
        }
        Some(scalars)
    }
}

/// The curl of a nodal vector field with gradient `g[d][j] = ∂_d A_j`; constant on a linear element.
#[inline]
pub fn curl(g: &[Complex3; 3]) -> Complex3 {
    [g[1][2] - g[2][1], g[2][0] - g[0][2], g[0][1] - g[1][0]]
}

/// Nodal `A_x, A_y, A_z, ψ` of one element with `N` nodes, of the state or of the adjoint.
#[derive(Clone, Copy, Debug)]
pub struct NodalField<const N: usize = 4> {
    /// `A` [T m] at the nodes.
    pub vector_potential: [Complex3; N],
    /// `ψ` [T m²] at the nodes.
    pub scalar_potential: [c64; N],
}

impl<const N: usize> NodalField<N> {
    /// From the four components at each node.
    pub fn new(components: [[c64; 4]; N]) -> Self {
        Self {
            vector_potential: components.map(|c| [c[0], c[1], c[2]]),
            scalar_potential: components.map(|c| c[3]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::differences::SKEW;
    use super::super::lagrange::Lagrange;
    use super::super::point::PointField;
    use super::*;

    const LAW: Coefficients = Coefficients { reluctivity: 1.7, extra_penalty: 0.6, eddy: c64::new(0.0, 2.3) };

    #[test]
    fn the_matrix_is_complex_symmetric() {
        let matrix = AphiTet::new(Tet4::new(SKEW), LAW);
        for a in 0..4 {
            for b in 0..4 {
                for i in 0..4 {
                    for j in 0..4 {
                        assert_eq!(matrix.block(a, b)[i][j], matrix.block(b, a)[j][i]);
                    }
                }
            }
        }
    }

    #[test]
    fn a_gradient_field_with_opposite_potential_carries_no_current() {
        // ψ linear and A = −∇ψ constant: E = 0, so the eddy part of K u vanishes.
        let slope = [0.3, -0.7, 0.9];
        let law = Coefficients { reluctivity: 0.0, extra_penalty: 0.0, eddy: c64::new(0.0, 1.0) };
        let matrix = AphiTet::new(Tet4::new(SKEW), law);
        for a in 0..4 {
            let mut row = [c64::default(); 4];
            for b in 0..4 {
                let u = [-slope[0], -slope[1], -slope[2], dot(slope, SKEW[b])];
                for i in 0..4 {
                    row[i] += (0..4).map(|j| matrix.block(a, b)[i][j] * u[j]).sum::<c64>();
                }
            }
            assert!(row.iter().all(|r| r.norm() < 1e-15), "{row:?}");
        }
    }

    #[test]
    fn the_curl_of_a_rigid_rotation_is_twice_its_axis() {
        let axis = [0.2, 0.5, -0.4];
        let rotation = SKEW.map(|x| fluxmorph_geometry::tet4::cross(axis, x).map(|c| c64::new(c, 0.0)));
        let nodal = NodalField { vector_potential: rotation, scalar_potential: [c64::default(); 4] };
        let tet = Tet4::new(SKEW);
        let b = PointField::new(Lagrange::<4, 4>::tet(), &tet, &[0.25; 4], &nodal).flux_density();
        for d in 0..3 {
            assert!((b[d] - 2.0 * axis[d]).norm() < 1e-14);
        }
    }
}
