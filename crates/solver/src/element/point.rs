//! The potentials at one point of an element, of any order: what integrands are made of.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, Tet4};

use super::lagrange::Lagrange;
use super::tabulated::{Rule, Tabulated};
use super::tensor::CurlsOfRule;
use super::volume::{Coefficients, NodalField};
use super::{Complex3, cross3, dot3};

/// `A`, its gradient, and `∇ψ` at a point.
#[derive(Clone, Copy, Debug, Default)]
pub struct PointField {
    /// `A` [T m].
    pub vector_potential: Complex3,
    /// `∂_d A_j` [T], index `[d][j]`.
    pub gradient: [Complex3; 3],
    /// `∇ψ` [T m].
    pub scalar_gradient: Complex3,
}

impl PointField {
    /// The field at the barycentric coordinates `lambda`.
    #[inline]
    pub fn new<const N: usize>(
        shape: &Lagrange<N, 4>,
        tet: &Tet4,
        lambda: &[f64; 4],
        nodal: &NodalField<N>,
    ) -> Self {
        let mut field = Self::default();
        for a in 0..N {
            let (value, gradient) = (shape.value(a, lambda), gradient(shape, tet, lambda, a));
            field.add(value, gradient, nodal.vector_potential[a], nodal.scalar_potential[a]);
        }
        field
    }

    /// The field at a tabulated point.
    #[inline]
    pub fn tabulated<const N: usize>(at: &Tabulated<N>, tet: &Tet4, nodal: &NodalField<N>) -> Self {
        let mut field = Self::default();
        // `Σ_a s_k A_a` and `Σ_a s_k ψ_a` by vertex.
        let (mut vectors, mut scalars) = ([[c64::default(); 3]; 4], [c64::default(); 4]);
        for a in 0..N {
            let (vector, scalar) = (&nodal.vector_potential[a], nodal.scalar_potential[a]);
            for j in 0..3 {
                field.vector_potential[j] += at.values[a] * vector[j];
            }
            // The second slope of a vertex's function is zero.
            for k in 0..if a < 4 { 1 } else { 2 } {
                let (m, slope) = (at.along[a][k], at.slopes[a][k]);
                for j in 0..3 {
                    vectors[m][j] += slope * vector[j];
                }
                scalars[m] += slope * scalar;
            }
        }
        for (g, (vector, scalar)) in tet.gradients.iter().zip(vectors.iter().zip(scalars)) {
            for d in 0..3 {
                for j in 0..3 {
                    field.gradient[d][j] += g[d] * vector[j];
                }
                field.scalar_gradient[d] += g[d] * scalar;
            }
        }
        field
    }

    /// Adds one shape function with its nodal potentials.
    #[inline]
    pub fn add(&mut self, value: f64, gradient: Point, vector_potential: Complex3, scalar_potential: c64) {
        for j in 0..3 {
            self.vector_potential[j] += value * vector_potential[j];
            self.scalar_gradient[j] += gradient[j] * scalar_potential;
        }
        for d in 0..3 {
            for j in 0..3 {
                self.gradient[d][j] += gradient[d] * vector_potential[j];
            }
        }
    }

    /// `B = curl A` [T].
    #[inline]
    pub fn flux_density(&self) -> Complex3 {
        super::volume::curl(&self.gradient)
    }

    /// `A + ∇ψ` [T m]; `E = −jω(A + ∇ψ)`.
    #[inline]
    pub fn electric_potential(&self) -> Complex3 {
        std::array::from_fn(|d| self.vector_potential[d] + self.scalar_gradient[d])
    }
}

/// `∇N_a` [1/m] at a point.
#[inline]
pub fn gradient<const N: usize>(shape: &Lagrange<N, 4>, tet: &Tet4, lambda: &[f64; 4], a: usize) -> Point {
    let mut g = [0.0; 3];
    for m in 0..4 {
        let slope = shape.slope(a, m, lambda);
        for d in 0..3 {
            g[d] += slope * tet.gradients[m][d];
        }
    }
    g
}

/// `∂/∂x_k (λᵀ K_e u)` for the four vertices, shape `(4, 3)`; the values at the nodes are held.
///
/// Every term of the weak form is an integral of gradients and values. Moving vertex `k` of a straight-sided element
/// changes a gradient at fixed barycentric coordinates by `δ(∂_i N_a) = −∂_i λ_k ∂_d N_a` and the volume by
/// `V ∂_d λ_k`. So `∂s/∂x_k = V ⟨S⟩ ∇λ_k` with an Eshelby tensor `S_di = L δ_di − (terms with one gradient
/// replaced)`, `L` the integrand; the quadrature is exact for each order.
pub fn shape_derivative<const N: usize>(
    shape: &Lagrange<N, 4>,
    tet: &Tet4,
    coefficients: &Coefficients,
    adjoint: &NodalField<N>,
    state: &NodalField<N>,
) -> [Complex3; 4] {
    let rule = match (N, coefficients.eddy == c64::default()) {
        (4, _) => Rule::Centroid,
        (_, true) => Rule::Degree2,
        (_, false) => Rule::Degree5,
    };
    let mut tensor = [[c64::default(); 3]; 3];
    for at in shape.at(rule) {
        let l = PointField::tabulated(at, tet, adjoint);
        let u = PointField::tabulated(at, tet, state);
        add_tensor(&mut tensor, at.share, coefficients, &l, &u);
    }
    if N == 4 && coefficients.eddy != c64::default() {
        let covariance = coefficients.eddy * linear_covariance(adjoint, state);
        for d in 0..3 {
            tensor[d][d] += covariance;
        }
    }
    stretch(tet, &tensor)
}

/// What `⟨A_l·A_u⟩` of linear fields is more than the product of their means: `⟨λ_a λ_b⟩ = (1 + δ_ab)/20` against
/// `1/16`. All else in the weak form is constant or linear in an element of first order, so that the centroid serves.
#[inline]
fn linear_covariance<const N: usize>(l: &NodalField<N>, u: &NodalField<N>) -> c64 {
    let (mut sum_l, mut sum_u) = ([c64::default(); 3], [c64::default(); 3]);
    let mut pairs = c64::default();
    for (l, u) in l.vector_potential.iter().zip(&u.vector_potential) {
        pairs += dot3(*l, *u);
        for d in 0..3 {
            sum_l[d] += l[d];
            sum_u[d] += u[d];
        }
    }
    pairs / 20.0 - dot3(sum_l, sum_u) / 80.0
}

/// `V S ∇λ_k` for the four vertices: from an Eshelby tensor to the derivative with respect to the positions.
pub fn stretch(tet: &Tet4, tensor: &[Complex3; 3]) -> [Complex3; 4] {
    tet.gradients.map(|g| {
        std::array::from_fn(|d| {
            tet.volume * (tensor[d][0] * g[0] + tensor[d][1] * g[1] + tensor[d][2] * g[2])
        })
    })
}

/// `∂/∂x_k ∫ H(B_u)·B_l` for the four vertices, shape `(4, 3)`, of a law that gives `H(B_u)` and `∂H/∂B B_l` from `B_l` and
/// `B_u`; the values at the nodes are held.
pub fn flux_shape_derivative<const N: usize>(
    shape: &Lagrange<N, 4>,
    tet: &Tet4,
    adjoint: &NodalField<N>,
    state: &NodalField<N>,
    law: impl Fn(Complex3, Complex3) -> [Complex3; 2],
) -> [Complex3; 4] {
    let mut tensor = [[c64::default(); 3]; 3];
    for at in shape.at(if N == 4 { Rule::Centroid } else { Rule::Degree2 }) {
        let l = PointField::tabulated(at, tet, adjoint);
        let u = PointField::tabulated(at, tet, state);
        let b = l.flux_density();
        let [field, turned] = law(b, u.flux_density());
        let integrand = dot3(field, b);
        for d in 0..3 {
            // H·δB = −∇λ_k · (∂_d A × H).
            let (of_l, of_u) = (cross3(l.gradient[d], field), cross3(u.gradient[d], turned));
            for i in 0..3 {
                tensor[d][i] -= at.share * (of_l[i] + of_u[i]);
            }
            tensor[d][d] += at.share * integrand;
        }
    }
    stretch(tet, &tensor)
}

/// Curls of all functions at the points of the rule that is exact for their products.
pub fn curls<const N: usize>(shape: &Lagrange<N, 4>, tet: &Tet4) -> CurlsOfRule<N> {
    let mut of = CurlsOfRule::default();
    for at in shape.at(if N == 4 { Rule::Centroid } else { Rule::Degree2 }) {
        of.weights[of.count] = at.share * tet.volume;
        for (a, curls) in of.curls[of.count].iter_mut().enumerate() {
            let [x, y, z] = at.gradient(&tet.gradients, a);
            *curls = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0], [0.0; 3]];
        }
        of.count += 1;
    }
    of
}

/// Adds `share` times the Eshelby tensor of the weak form's integrand at a point.
fn add_tensor(
    tensor: &mut [Complex3; 3],
    share: f64,
    coefficients: &Coefficients,
    l: &PointField,
    u: &PointField,
) {
    let Coefficients { reluctivity, extra_penalty, eddy } = *coefficients;
    let (gl, gu) = (&l.gradient, &u.gradient);
    let mut integrand = c64::default();
    let mut minus = [[c64::default(); 3]; 3];
    let products = gl.map(|l| gu.map(|u| dot3(l, u)));
    for d in 0..3 {
        integrand += reluctivity * products[d][d];
        for i in 0..3 {
            minus[d][i] += reluctivity * (products[d][i] + products[i][d]);
        }
    }
    if extra_penalty != 0.0 {
        let div_l = gl[0][0] + gl[1][1] + gl[2][2];
        let div_u = gu[0][0] + gu[1][1] + gu[2][2];
        integrand += extra_penalty * div_l * div_u;
        for d in 0..3 {
            for i in 0..3 {
                minus[d][i] += extra_penalty * (div_u * gl[d][i] + div_l * gu[d][i]);
            }
        }
    }
    if eddy != c64::default() {
        let (al, au) = (l.electric_potential(), u.electric_potential());
        integrand += eddy * dot3(al, au);
        for d in 0..3 {
            for i in 0..3 {
                minus[d][i] += eddy * (l.scalar_gradient[d] * au[i] + u.scalar_gradient[d] * al[i]);
            }
        }
    }
    for d in 0..3 {
        tensor[d][d] += share * integrand;
        for i in 0..3 {
            tensor[d][i] -= share * minus[d][i];
        }
    }
}

/// `λ`-weighted source moments `M_b = ∫T λ_b dV` [A m²] to the load `f_a = ∫T·curl(N_a e_i) = (∫T × ∇N_a)_i`.
#[inline]
pub fn curl_load<const N: usize>(
    shape: &Lagrange<N, 4>,
    tet: &Tet4,
    moments: &[Complex3; 4],
) -> [Complex3; N] {
    std::array::from_fn(|a| {
        let mut load = [c64::default(); 3];
        for (m, g) in tet.gradients.iter().enumerate() {
            let mut weighted = [c64::default(); 3];
            for (b, moment) in moments.iter().enumerate() {
                let slope = shape.slope_coefficient(a, m, b);
                if slope == 0.0 {
                    continue;
                }
                for d in 0..3 {
                    weighted[d] += slope * moment[d];
                }
            }
            load[0] += weighted[1] * g[2] - weighted[2] * g[1];
            load[1] += weighted[2] * g[0] - weighted[0] * g[2];
            load[2] += weighted[0] * g[1] - weighted[1] * g[0];
        }
        load
    })
}

/// Load `∫J N_a dV` [A m] of a current density that is constant in the element [A/m²].
#[inline]
pub fn current_load<const N: usize>(
    shape: &Lagrange<N, 4>,
    tet: &Tet4,
    current_density: &Complex3,
) -> [Complex3; N] {
    std::array::from_fn(|a| {
        let mean: f64 = shape.mass[a].iter().sum();
        current_density.map(|j| tet.volume * mean * j)
    })
}

/// `∂/∂x_k (λᵀ f)` for the load of a source `T` that is constant in the element and moves with it (a magnet: `T = ν
/// B_r`), shape `(4, 3)`: `s = ∫T·curl λ`, whose mean gradient is all that counts.
pub fn magnet_shape_derivative<const N: usize>(
    shape: &Lagrange<N, 4>,
    tet: &Tet4,
    source: Point,
    adjoint: &NodalField<N>,
) -> [Complex3; 4] {
    let l = PointField::tabulated(&shape.at(Rule::Centroid)[0], tet, adjoint);
    let mut tensor = [[c64::default(); 3]; 3];
    let curl = l.flux_density();
    let integrand: c64 = (0..3).map(|d| source[d] * curl[d]).sum();
    for d in 0..3 {
        // T·curl A = ε_kij T_k ∂_i A_j = Σ_i ∂_i A · (T × e_i): replacing ∂_i by ∂_d.
        for i in 0..3 {
            let mut unit = [0.0; 3];
            unit[i] = 1.0;
            let across = fluxmorph_geometry::tet4::cross(source, unit);
            tensor[d][i] -= (0..3).map(|j| across[j] * l.gradient[d][j]).sum::<c64>();
        }
        tensor[d][d] += integrand;
    }
    stretch(tet, &tensor)
}
