//! The impedance (Leontovich) surface: a conductor many skin depths thick, seen from outside.
//!
//! `(jω/Zs) ∫_S (A_t + ∇_tψ)·(w_t + ∇_t q)` with `Zs = (1+j)/(σδ)`, hence `jω/Zs = ωσδ (1+j)/2`. Without ψ on the surface
//! a nodal `A`, which is smoother than the tangential `E` along a sharp edge of the conductor, would stop the currents that
//! flow there. On a flat triangle with area `S`, unit normal `n̂`, `A_t = P A` with `P = I − n̂ n̂ᵀ`, surface gradients
//! `g_m = n̂ × e_m / 2S` (`triangle`) and `c = jω/Zs`:
//!
//! | rows × columns | entry of node `a` against node `b` |
//! |---|---|
//! | `A_i`, `A_j` | `c S ⟨N_a N_b⟩ P_ij` |
//! | `A_i`, `ψ` | `c S Σ_m ⟨N_a ∂_m N_b⟩ g_m,i` |
//! | `ψ`, `A_j` | `c S Σ_m ⟨N_b ∂_m N_a⟩ g_m,j` |
//! | `ψ`, `ψ` | `c S Σ_mn ⟨∂_m N_a ∂_n N_b⟩ g_m·g_n` |

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::Point;

use super::density::ElementIntegral;
use super::lagrange::Lagrange;
use super::triangle::{Slopes, Triangle, quadratic_form};
use super::{Complex3, cross3, dot3};

/// `jω/Zs = ωσδ(1+j)/2` [1/H] from `ω` [rad/s], `σ` [S/m] and `δ` [m].
pub fn surface_coefficient(angular_frequency: f64, conductivity: f64, skin_depth: f64) -> c64 {
    let half = 0.5 * angular_frequency * conductivity * skin_depth;
    c64::new(half, half)
}

/// The matrix of one triangle with `N` nodes, shape `(N × 4, N × 4)`.
#[derive(Clone, Copy, Debug)]
pub struct ImpedanceTriangle<const N: usize> {
    shape: &'static Lagrange<N, 3>,
    coefficient: c64,
    /// `S P`.
    projection: [Point; 3],
    /// `S g_m`.
    slopes: [Point; 3],
    /// `S g_m·g_n`.
    metric: [Point; 3],
}

impl<const N: usize> ImpedanceTriangle<N> {
    /// The matrix for three vertices [m] and the coefficient `jω/Zs` [1/H].
    #[inline]
    pub fn new(shape: &'static Lagrange<N, 3>, vertices: [Point; 3], coefficient: c64) -> Self {
        let triangle = Triangle::new(vertices);
        let Triangle { area, unit_normal: n, metric, .. } = triangle;
        let projection = std::array::from_fn(|i| {
            std::array::from_fn(|j| area * (if i == j { 1.0 } else { 0.0 } - n[i] * n[j]))
        });
        Self { shape, coefficient, projection, slopes: triangle.slopes(), metric }
    }
}

impl<const N: usize> LocalMatrix<c64, N, 4> for ImpedanceTriangle<N> {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[c64; 4]; 4] {
        let Lagrange { mass, advection, stiffness, .. } = self.shape;
        let mut block = [[c64::default(); 4]; 4];
        for i in 0..3 {
            for j in 0..3 {
                block[i][j] = self.coefficient * mass[a][b] * self.projection[i][j];
            }
            let along =
                |a: usize, b: usize| -> f64 { (0..3).map(|m| advection[a][b][m] * self.slopes[m][i]).sum() };
            block[i][3] = self.coefficient * along(a, b);
            block[3][i] = self.coefficient * along(b, a);
        }
        let products = stiffness[a][b].as_flattened().iter().zip(self.metric.as_flattened());
        block[3][3] = self.coefficient * products.map(|(s, g)| s * g).sum::<f64>();
        block
    }
}

/// What an integral of two fields over a triangle needs of these, independent of its geometry.
#[derive(Default)]
struct Moments {
    /// `Σ_ab ⟨N_a N_b⟩ u_b ⊗ λ_a`, shape `(3, 3)`.
    vector: [Complex3; 3],
    /// `Σ_ab ⟨N_a ∂_m N_b⟩ (λ_a ψ_u,b + u_a ψ_λ,b)`, by `m`.
    mixed: [Complex3; 3],
    /// `Σ_ab ⟨∂_m N_a ∂_n N_b⟩ ψ_λ,a ψ_u,b`, shape `(3, 3)`.
    scalar: [Complex3; 3],
}

impl Moments {
    fn new<const N: usize>(shape: &Lagrange<N, 3>, adjoint: &[[c64; 4]; N], state: &[[c64; 4]; N]) -> Self {
        let mut moments = Self::default();
        for (a, l) in adjoint.iter().enumerate() {
            // Σ_b ⟨N_a N_b⟩ u_b first: one outer product a node.
            let mut weighted = [c64::default(); 3];
            for (b, u) in state.iter().enumerate() {
                let product = l[3] * u[3];
                for i in 0..3 {
                    weighted[i] += u[i] * shape.mass[a][b];
                    for m in 0..3 {
                        // Node `a` has the vector, node `b` the slope, of either field.
                        moments.mixed[m][i] +=
                            shape.advection[a][b][m] * l[i] * u[3] + shape.advection[b][a][m] * u[i] * l[3];
                        moments.scalar[m][i] += shape.stiffness[a][b][m][i] * product;
                    }
                }
            }
            for i in 0..3 {
                for j in 0..3 {
                    moments.vector[i][j] += weighted[i] * l[j];
                }
            }
        }
        moments
    }
}

/// `∂/∂x_k (λᵀ M u)` for the three vertices, shape `(3, 3)`.
///
/// With `R = Σ_ab ⟨N_a N_b⟩ u_b λ_aᵀ`, `α_m = Σ_ab ⟨N_a ∂_m N_b⟩ (λ_a ψ_u,b + u_a ψ_λ,b)` and
/// `Q_mn = Σ_ab ⟨∂_m N_a ∂_n N_b⟩ ψ_λ,a ψ_u,b` the form is
///
/// `s = c (S tr R − NᵀRN/S) + c/2 Σ_m α_m·(n̂ × e_m) + c/4S Σ_mn Q_mn e_m·e_n`,
///
/// whose first part has `∂/∂N = c (n̂ tr R − (R + Rᵀ)n̂ + (n̂ᵀRn̂) n̂)`, and the second, `c/2 n̂·w` with
/// `w = Σ_m e_m × α_m`, has `∂/∂N = c/2S (w − (n̂·w) n̂)` and `∂/∂e_m = c/2 α_m × n̂`.
pub fn shape_derivative<const N: usize>(
    shape: &Lagrange<N, 3>,
    vertices: [Point; 3],
    coefficient: c64,
    adjoint: &[[c64; 4]; N],
    state: &[[c64; 4]; N],
) -> [Complex3; 3] {
    let triangle = Triangle::new(vertices);
    let n = triangle.unit_normal.map(c64::from);
    let Moments { vector: r, mixed, scalar } = Moments::new(shape, adjoint, state);
    let Slopes { mut by_normal, mut by_edge } = triangle.metric_form(&scalar);
    let trace = r[0][0] + r[1][1] + r[2][2];
    let rn: Complex3 = std::array::from_fn(|i| dot3(r[i], n));
    let normal_part = dot3(rn, n);
    let mut turned = [c64::default(); 3];
    for (m, alpha) in mixed.into_iter().enumerate() {
        let (own, slope) = (cross3(triangle.edges[m].map(c64::from), alpha), cross3(alpha, n));
        for d in 0..3 {
            turned[d] += own[d];
            by_edge[m][d] += 0.5 * slope[d];
        }
    }
    let along = dot3(turned, n);
    for i in 0..3 {
        let rtn: c64 = (0..3).map(|j| r[j][i] * n[j]).sum();
        by_normal[i] +=
            n[i] * (trace + normal_part) - rn[i] - rtn + (turned[i] - along * n[i]) / (2.0 * triangle.area);
    }
    triangle
        .by_vertices(&Slopes { by_normal, by_edge })
        .map(|row| row.map(|derivative| coefficient * derivative))
}

/// `f ∫|A_t + ∇_tψ|² dS`.
pub fn loss<const N: usize>(
    shape: &'static Lagrange<N, 3>,
    vertices: [Point; 3],
    factor: f64,
    field: &[[c64; 4]; N],
) -> ElementIntegral<N, 3> {
    let coefficient = c64::new(factor, 0.0);
    quadratic_form(&ImpedanceTriangle::new(shape, vertices, coefficient), field, |conjugate| {
        shape_derivative(shape, vertices, coefficient, conjugate, field)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [Point; 3] = [[0.1, 0.0, 0.2], [1.1, 0.3, 0.0], [0.2, 0.8, 0.5]];

    /// `A = ∇χ` and `ψ = −χ` carry no current, whatever lies across the surface.
    #[test]
    fn a_gradient_with_its_potential_is_nothing() {
        let gradient = [0.3, -1.2, 0.7];
        let at = |x: Point| {
            let chi: f64 = (0..3).map(|d| gradient[d] * x[d]).sum();
            [gradient[0], gradient[1], gradient[2], -chi].map(c64::from)
        };
        let [a, b, c] = TRIANGLE;
        let middle = |p: Point, q: Point| std::array::from_fn(|d| 0.5 * (p[d] + q[d]));
        let linear = loss(Lagrange::<3, 3>::triangle(), TRIANGLE, 1.0, &TRIANGLE.map(at));
        let nodes = [a, b, c, middle(a, b), middle(b, c), middle(c, a)];
        let quadratic = loss(Lagrange::<6, 3>::triangle(), TRIANGLE, 1.0, &nodes.map(at));
        assert!(linear.value.abs() < 1e-14 && quadratic.value.abs() < 1e-14);
    }

    #[test]
    fn only_the_tangential_potential_counts() {
        // On the triangle of area 1 in z = 0, a constant A_z gives nothing, a constant A_x the area.
        let flat = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        fn constant<const N: usize>(d: usize) -> [[c64; 4]; N] {
            [std::array::from_fn(|c| c64::new(0.0, f64::from(u8::from(c == d)))); N]
        }
        let linear = Lagrange::<3, 3>::triangle();
        assert_eq!(loss(linear, flat, 2.0, &constant(2)).value, 0.0);
        assert!((loss(linear, flat, 2.0, &constant(0)).value - 2.0).abs() < 1e-14);
        let quadratic = Lagrange::<6, 3>::triangle();
        assert!((loss(quadratic, flat, 2.0, &constant(0)).value - 2.0).abs() < 1e-14);
    }
}
