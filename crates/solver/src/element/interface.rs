//! Triangles at which the reluctivity jumps: the only place where the components of `A` couple for `p = 1`.
//!
//! On a region of constant `ν` with outward normal `n`,
//! `∫ν (curl A·curl w + div A div w − ∇A:∇w) = ν ∮ w_i (n_i ∂_j − n_j ∂_i) A_j`, an integral of tangential
//! derivatives: `(n_i ∂_j − n_j ∂_i) f = ε_ijk (n × ∇f)_k`. On a triangle of area `S` with nodes in right-handed order
//! about `n` and the edges `e_m = x_{m+2} − x_{m+1}` (indices modulo 3), `n × ∇λ_m = −e_m/(2S)`. So the entry of
//! `(a, i)` against `(b, j)` is `−ν ε_ijk Σ_m ¼(⟨N_a ∂_m N_b⟩ − ⟨N_b ∂_m N_a⟩) (e_m)_k`, made symmetric; the
//! antisymmetric rest is a total derivative and cancels over a closed surface. Linear shape functions: `−ν ε_ijk (e_b − e_a)_k/12`.
//! Between two regions the factor is the jump `ν_inside − ν_outside`. The entry is linear in the coordinates.

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::{Point, sub};

use super::lagrange::Lagrange;
use super::{Complex3, cross3, levi_civita};

/// The coupling matrix of one triangle with `N` nodes, shape `(N × 4, N × 4)`; its ψ rows and columns are zero.
#[derive(Clone, Copy, Debug)]
pub struct InterfaceTriangle<const N: usize> {
    shape: &'static Lagrange<N, 3>,
    edges: [Point; 3],
    jump: f64,
}

impl<const N: usize> InterfaceTriangle<N> {
    /// The matrix for three vertices [m] in right-handed order about the normal, and `ν_inside − ν_outside` [m/H].
    #[inline]
    pub fn new(shape: &'static Lagrange<N, 3>, vertices: [Point; 3], jump: f64) -> Self {
        let edges = std::array::from_fn(|m| sub(vertices[(m + 2) % 3], vertices[(m + 1) % 3]));
        Self { shape, edges, jump }
    }
}

/// `¼(⟨N_a ∂_m N_b⟩ − ⟨N_b ∂_m N_a⟩)`.
#[inline]
fn weight<const N: usize>(shape: &Lagrange<N, 3>, a: usize, b: usize, m: usize) -> f64 {
    0.25 * (shape.advection[a][b][m] - shape.advection[b][a][m])
}

impl<const N: usize> LocalMatrix<c64, N, 4> for InterfaceTriangle<N> {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[c64; 4]; 4] {
        let mut block = [[c64::default(); 4]; 4];
        if a == b {
            return block;
        }
        let mut vector = [0.0; 3];
        for (m, edge) in self.edges.iter().enumerate() {
            let factor = -self.jump * weight(self.shape, a, b, m);
            for k in 0..3 {
                vector[k] += factor * edge[k];
            }
        }
        for i in 0..3 {
            for j in 0..3 {
                if i != j {
                    let (k, sign) = levi_civita(i, j);
                    block[i][j] = c64::new(sign * vector[k], 0.0);
                }
            }
        }
        block
    }
}

/// `∂/∂x_k (λᵀ M u)` for the three vertices, shape `(3, 3)`: independent of the coordinates.
pub fn shape_derivative<const N: usize>(
    shape: &Lagrange<N, 3>,
    jump: f64,
    adjoint: &[Complex3; N],
    state: &[Complex3; N],
) -> [Complex3; 3] {
    // λᵀMu = Σ_m W_m·e_m with W_m = −jump Σ_ab weight_abm λ_a × u_b.
    let mut factors = [[c64::default(); 3]; 3];
    for a in 0..N {
        for b in (0..N).filter(|&b| b != a) {
            let product = cross3(adjoint[a], state[b]);
            for (m, factor) in factors.iter_mut().enumerate() {
                let weight = jump * weight(shape, a, b, m);
                for d in 0..3 {
                    factor[d] -= weight * product[d];
                }
            }
        }
    }
    let mut derivative = [[c64::default(); 3]; 3];
    for (m, factor) in factors.iter().enumerate() {
        for d in 0..3 {
            derivative[(m + 2) % 3][d] += factor[d];
            derivative[(m + 1) % 3][d] -= factor[d];
        }
    }
    derivative
}

#[cfg(test)]
mod tests {
    use super::super::differences::SKEW;
    use super::super::lagrange::TRIANGLE_EDGES;

    use super::*;
    use fluxmorph_geometry::tet4::{EDGES, FACES, Tet4};

    /// Over the faces of one tet the terms sum to `curl·curl + div·div − ∇:∇` of `N_a e_i` against `N_b e_j`, that is
    /// `V Σ_mn (⟨∂_m N_a ∂_n N_b⟩ g_m,i g_n,j − ⟨∂_m N_a ∂_n N_b⟩ g_m,j g_n,i)`, up to what is antisymmetric under
    /// exchange of the two functions.
    fn check<const N: usize, const F: usize>(
        tet_shape: &'static Lagrange<N, 4>,
        face_shape: &'static Lagrange<F, 3>,
        nodes_of: impl Fn([usize; 3]) -> [usize; F],
    ) {
        let tet = Tet4::new(SKEW);
        let mut sum = vec![[[c64::default(); 3]; 3]; N * N];
        for face in FACES {
            let triangle = InterfaceTriangle::new(face_shape, face.map(|v| SKEW[v]), 1.0);
            for (a, &na) in nodes_of(face).iter().enumerate() {
                for (b, &nb) in nodes_of(face).iter().enumerate() {
                    let block = triangle.block(a, b);
                    for i in 0..3 {
                        for j in 0..3 {
                            sum[N * na + nb][i][j] += block[i][j];
                        }
                    }
                }
            }
        }
        for a in 0..N {
            for b in 0..N {
                for i in 0..3 {
                    for j in 0..3 {
                        let mut exact = 0.0;
                        for m in 0..4 {
                            for n in 0..4 {
                                let (gm, gn) = (tet.gradients[m], tet.gradients[n]);
                                exact += tet.volume
                                    * tet_shape.stiffness[a][b][m][n]
                                    * (gm[i] * gn[j] - gm[j] * gn[i]);
                            }
                        }
                        assert!((sum[N * a + b][i][j] - exact).norm() < 1e-14, "{a} {b} {i} {j}");
                    }
                }
            }
        }
    }

    #[test]
    fn over_the_faces_of_one_tet_it_is_the_null_lagrangian() {
        check(Lagrange::<4, 4>::tet(), Lagrange::<3, 3>::triangle(), |face| face);
        check(Lagrange::<10, 4>::tet(), Lagrange::<6, 3>::triangle(), |face| {
            let middle = |[i, j]: [usize; 2]| {
                let (i, j) = (face[i].min(face[j]), face[i].max(face[j]));
                4 + EDGES.iter().position(|e| *e == [i, j]).unwrap()
            };
            let [m0, m1, m2] = TRIANGLE_EDGES.map(middle);
            [face[0], face[1], face[2], m0, m1, m2]
        });
    }
}
