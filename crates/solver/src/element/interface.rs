//! Triangles at which the reluctivity jumps: the only place where the components of `A` couple for `p = 1`.
//!
//! On a region of constant `ν` with outward normal `n`,
//! `∫ν (curl A·curl w + div A div w − ∇A:∇w) = ν ∮ w_i (n_i ∂_j − n_j ∂_i) A_j`, an integral of tangential
//! derivatives. For linear shape functions on a triangle with nodes in right-handed order about `n` and the edges
//! `e_m = x_{m+2} − x_{m+1}` (indices modulo 3), the entry of `(a, i)` against `(b, j)` is
//! `−ν ε_ijk (e_b − e_a)_k / 12` (made symmetric; the antisymmetric rest cancels over a closed surface). Between two
//! regions the factor is the jump `ν_inside − ν_outside`. The entry is linear in the coordinates.

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::{Point, sub};

use super::{Complex3, cross3, levi_civita};

/// The coupling matrix of one triangle, shape `(3 × 4, 3 × 4)`; its ψ rows and columns are zero.
#[derive(Clone, Copy, Debug)]
pub struct InterfaceTriangle {
    edges: [Point; 3],
    jump: f64,
}

impl InterfaceTriangle {
    /// The matrix for three vertices [m] in right-handed order about the normal, and `ν_inside − ν_outside` [m/H].
    #[inline]
    pub fn new(vertices: [Point; 3], jump: f64) -> Self {
        Self { edges: std::array::from_fn(|m| sub(vertices[(m + 2) % 3], vertices[(m + 1) % 3])), jump }
    }
}

impl LocalMatrix<c64, 3, 4> for InterfaceTriangle {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[c64; 4]; 4] {
        let mut block = [[c64::default(); 4]; 4];
        if a == b {
            return block;
        }
        let difference = sub(self.edges[b], self.edges[a]);
        for i in 0..3 {
            for j in 0..3 {
                if i != j {
                    let (k, sign) = levi_civita(i, j);
                    block[i][j] = c64::new(-self.jump / 12.0 * sign * difference[k], 0.0);
                }
            }
        }
        block
    }
}

/// `∂/∂x_k (λᵀ M u)` for the three nodes, shape `(3, 3)`: independent of the coordinates.
pub fn shape_derivative(jump: f64, adjoint: &[Complex3; 3], state: &[Complex3; 3]) -> [Complex3; 3] {
    let mut derivative = [[c64::default(); 3]; 3];
    for m in 0..3 {
        // λᵀMu = −jump/12 Σ_ab (λ_a × u_b)·(e_b − e_a): the factor of edge m.
        let mut weight = [c64::default(); 3];
        for a in 0..3 {
            let (from_state, from_adjoint) = (cross3(adjoint[a], state[m]), cross3(adjoint[m], state[a]));
            for d in 0..3 {
                weight[d] += from_state[d] - from_adjoint[d];
            }
        }
        for d in 0..3 {
            let term = -jump / 12.0 * weight[d];
            derivative[(m + 2) % 3][d] += term;
            derivative[(m + 1) % 3][d] -= term;
        }
    }
    derivative
}

#[cfg(test)]
mod tests {
    use super::super::volume::tests::{SKEW, noise};
    use super::*;
    use fluxmorph_geometry::tet4::{FACES, Tet4};

    #[test]
    fn over_the_faces_of_one_tet_it_is_the_null_lagrangian() {
        // curl·curl + div·div − ∇:∇ for N_a e_i against N_b e_j is V (g_a,i g_b,j − g_a,j g_b,i).
        let tet = Tet4::new(SKEW);
        let mut sum = [[[[c64::default(); 3]; 3]; 4]; 4];
        for face in FACES {
            let triangle = InterfaceTriangle::new(face.map(|v| SKEW[v]), 1.0);
            for (a, &na) in face.iter().enumerate() {
                for (b, &nb) in face.iter().enumerate() {
                    let block = triangle.block(a, b);
                    for i in 0..3 {
                        for j in 0..3 {
                            sum[na][nb][i][j] += block[i][j];
                        }
                    }
                }
            }
        }
        for a in 0..4 {
            for b in 0..4 {
                let (ga, gb) = (tet.gradients[a], tet.gradients[b]);
                for i in 0..3 {
                    for j in 0..3 {
                        let exact = tet.volume * (ga[i] * gb[j] - ga[j] * gb[i]);
                        assert!((sum[a][b][i][j] - exact).norm() < 1e-15, "{a} {b} {i} {j}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_shape_derivative_matches_central_differences() {
        let values = |seed: u32| -> [Complex3; 3] {
            std::array::from_fn(|a| std::array::from_fn(|c| noise(seed + (3 * a + c) as u32)))
        };
        let (l, u) = (values(3), values(31));
        let bilinear = |vertices: [Point; 3]| {
            let triangle = InterfaceTriangle::new(vertices, 1.3);
            let mut s = c64::default();
            for a in 0..3 {
                for b in 0..3 {
                    for i in 0..3 {
                        for j in 0..3 {
                            s += l[a][i] * triangle.block(a, b)[i][j] * u[b][j];
                        }
                    }
                }
            }
            s
        };
        let exact = shape_derivative(1.3, &l, &u);
        let base = [SKEW[0], SKEW[1], SKEW[2]];
        for k in 0..3 {
            for d in 0..3 {
                let at = |s: f64| {
                    let mut vertices = base;
                    vertices[k][d] += s;
                    bilinear(vertices)
                };
                let difference = (at(0.5) - at(-0.5)) / 1.0;
                assert!((difference - exact[k][d]).norm() < 1e-13, "linear: exact at any step");
            }
        }
    }
}
