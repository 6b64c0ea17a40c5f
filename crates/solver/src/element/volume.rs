//! The linear A–ψ tetrahedron and its derivative with respect to the node positions.
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
//!
//! Derivative of `s = λᵀ K_e u`: with `G_λ = Σ_a g_a ⊗ λ_a`, `G_u` likewise, every term is an integral of gradients,
//! and moving node `k` changes a gradient by `δ(∂_i N_a) = −∂_i N_k ∂_d N_a` and the volume by `V ∂_d N_k`. So
//! `∂s/∂x_k = V S g_k` with one 3 × 3 tensor `S` an element, an Eshelby tensor: `S_di = L δ_di − (terms with one
//! gradient replaced)`, `L` the integrand.

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::{Point, Tet4, dot};

use super::{Complex3, dot3};

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
}

/// The gradient of a nodal vector field, `gradient[d][j] = ∂_d A_j`; constant on a linear element.
#[inline]
pub fn gradient(tet: &Tet4, nodal: &[Complex3; 4]) -> [Complex3; 3] {
    let mut g = [[c64::default(); 3]; 3];
    for (shape, value) in tet.gradients.iter().zip(nodal) {
        for d in 0..3 {
            for j in 0..3 {
                g[d][j] += value[j] * shape[d];
            }
        }
    }
    g
}

/// The curl of a nodal vector field with gradient `g[d][j] = ∂_d A_j`; constant on a linear element.
#[inline]
pub fn curl(g: &[Complex3; 3]) -> Complex3 {
    [g[1][2] - g[2][1], g[2][0] - g[0][2], g[0][1] - g[1][0]]
}

/// The gradient of a nodal scalar field.
#[inline]
pub fn scalar_gradient(tet: &Tet4, nodal: &[c64; 4]) -> Complex3 {
    let mut g = [c64::default(); 3];
    for (shape, &value) in tet.gradients.iter().zip(nodal) {
        for d in 0..3 {
            g[d] += value * shape[d];
        }
    }
    g
}

/// Nodal `A_x, A_y, A_z, ψ` of one element, of the state or of the adjoint.
#[derive(Clone, Copy, Debug)]
pub struct NodalField {
    /// `A` [T m] at the four nodes.
    pub vector_potential: [Complex3; 4],
    /// `ψ` [T m²] at the four nodes.
    pub scalar_potential: [c64; 4],
}

impl NodalField {
    /// From the four components at each node.
    pub fn new(components: [[c64; 4]; 4]) -> Self {
        Self {
            vector_potential: components.map(|c| [c[0], c[1], c[2]]),
            scalar_potential: components.map(|c| c[3]),
        }
    }
}

/// `∂/∂x_k (λᵀ K_e u)` for the four nodes, shape `(4, 3)`; the fields at the nodes are held.
pub fn shape_derivative(
    tet: &Tet4,
    coefficients: &Coefficients,
    adjoint: &NodalField,
    state: &NodalField,
) -> [Complex3; 4] {
    let Coefficients { reluctivity, extra_penalty, eddy } = *coefficients;
    let gl = gradient(tet, &adjoint.vector_potential);
    let gu = gradient(tet, &state.vector_potential);
    let mut integrand = c64::default();
    let mut tensor = [[c64::default(); 3]; 3];

    for d in 0..3 {
        integrand += reluctivity * dot3(gl[d], gu[d]);
        for i in 0..3 {
            tensor[d][i] -= reluctivity * (dot3(gl[d], gu[i]) + dot3(gl[i], gu[d]));
        }
    }
    if extra_penalty != 0.0 {
        let div_l = gl[0][0] + gl[1][1] + gl[2][2];
        let div_u = gu[0][0] + gu[1][1] + gu[2][2];
        integrand += extra_penalty * div_l * div_u;
        for d in 0..3 {
            for i in 0..3 {
                tensor[d][i] -= extra_penalty * (div_u * gl[d][i] + div_l * gu[d][i]);
            }
        }
    }
    if eddy != c64::default() {
        let (al, au) = (&adjoint.vector_potential, &state.vector_potential);
        let sum = |nodal: &[Complex3; 4]| {
            let mut s = [c64::default(); 3];
            for value in nodal {
                for i in 0..3 {
                    s[i] += value[i];
                }
            }
            s
        };
        let (sl, su) = (sum(al), sum(au));
        // Σ_ab (1 + δ_ab)/20 λ_a·u_b.
        let mass = 0.05 * (dot3(sl, su) + (0..4).map(|a| dot3(al[a], au[a])).sum::<c64>());
        let pl = scalar_gradient(tet, &adjoint.scalar_potential);
        let pu = scalar_gradient(tet, &state.scalar_potential);
        let (ml, mu) = (sl.map(|x| 0.25 * x), su.map(|x| 0.25 * x));
        integrand += eddy * (mass + dot3(ml, pu) + dot3(mu, pl) + dot3(pl, pu));
        for d in 0..3 {
            for i in 0..3 {
                tensor[d][i] -= eddy * (pu[d] * ml[i] + pl[d] * mu[i] + pl[d] * pu[i] + pl[i] * pu[d]);
            }
        }
    }
    for (d, row) in tensor.iter_mut().enumerate() {
        row[d] += integrand;
    }
    tet.gradients.map(|g| {
        std::array::from_fn(|d| {
            tet.volume * (tensor[d][0] * g[0] + tensor[d][1] * g[1] + tensor[d][2] * g[2])
        })
    })
}

/// Load of the coil, `f_a = ∫T·curl(N_a e_i) = (∫T dV × ∇N_a)_i` for `moment = ∫_e T dV` [A m²], shape `(4, 3)`.
#[inline]
pub fn source_load(tet: &Tet4, moment: Point) -> [Point; 4] {
    tet.gradients.map(|g| fluxmorph_geometry::tet4::cross(moment, g))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) const SKEW: [Point; 4] = [[0.1, 0.2, -0.1], [1.3, 0.1, 0.2], [0.3, 0.9, 0.1], [0.2, 0.3, 1.4]];

    pub(crate) fn noise(seed: u32) -> c64 {
        let x = f64::from(seed);
        c64::new((12.9898 * x + 1.0).sin(), (78.233 * x + 2.0).sin())
    }

    fn field(seed: u32) -> NodalField {
        NodalField::new(std::array::from_fn(|a| std::array::from_fn(|c| noise(seed + (4 * a + c) as u32))))
    }

    const LAW: Coefficients = Coefficients { reluctivity: 1.7, extra_penalty: 0.6, eddy: c64::new(0.0, 2.3) };

    fn bilinear(vertices: [Point; 4], l: &NodalField, u: &NodalField) -> c64 {
        let matrix = AphiTet::new(Tet4::new(vertices), LAW);
        let all = |f: &NodalField, a: usize| {
            let v = f.vector_potential[a];
            [v[0], v[1], v[2], f.scalar_potential[a]]
        };
        let mut sum = c64::default();
        for a in 0..4 {
            for b in 0..4 {
                let block = matrix.block(a, b);
                for i in 0..4 {
                    for j in 0..4 {
                        sum += all(l, a)[i] * block[i][j] * all(u, b)[j];
                    }
                }
            }
        }
        sum
    }

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
    fn the_shape_derivative_matches_central_differences() {
        let (l, u) = (field(1), field(40));
        let exact = shape_derivative(&Tet4::new(SKEW), &LAW, &l, &u);
        let h = 1e-5;
        for k in 0..4 {
            for d in 0..3 {
                let at = |s: f64| {
                    let mut vertices = SKEW;
                    vertices[k][d] += s;
                    bilinear(vertices, &l, &u)
                };
                let difference = (at(h) - at(-h)) / (2.0 * h);
                assert!((difference - exact[k][d]).norm() < 1e-8 * (1.0 + difference.norm()));
            }
        }
    }

    #[test]
    fn the_curl_of_a_rigid_rotation_is_twice_its_axis() {
        let axis = [0.2, 0.5, -0.4];
        let rotation = SKEW.map(|x| fluxmorph_geometry::tet4::cross(axis, x).map(|c| c64::new(c, 0.0)));
        let b = curl(&gradient(&Tet4::new(SKEW), &rotation));
        for d in 0..3 {
            assert!((b[d] - 2.0 * axis[d]).norm() < 1e-14);
        }
    }
}
