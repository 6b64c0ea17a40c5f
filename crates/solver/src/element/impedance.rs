//! The impedance (Leontovich) surface: a conductor many skin depths thick, seen from outside.
//!
//! `(jω/Zs) ∫_S A_t·w_t` with `Zs = (1+j)/(σδ)`, hence `jω/Zs = ωσδ (1+j)/2`. On a flat triangle with area vector
//! `N`, `A_t = P A` with `P = I − N Nᵀ/|N|²`, and the entry of node `a` against node `b` is
//! `(jω/Zs) |N| ⟨N_a N_b⟩ P`; for linear shape functions `⟨N_a N_b⟩ = (1+δ_ab)/12`.

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::{Point, area_vector, norm, sub};

use super::lagrange::Lagrange;
use super::{Complex3, dot3};

/// `jω/Zs = ωσδ(1+j)/2` [1/H] from `ω` [rad/s], `σ` [S/m] and `δ` [m].
pub fn surface_coefficient(angular_frequency: f64, conductivity: f64, skin_depth: f64) -> c64 {
    let half = 0.5 * angular_frequency * conductivity * skin_depth;
    c64::new(half, half)
}

/// The matrix of one triangle with `N` nodes, shape `(N × 4, N × 4)`; its ψ rows and columns are zero.
#[derive(Clone, Copy, Debug)]
pub struct ImpedanceTriangle<const N: usize> {
    shape: &'static Lagrange<N, 3>,
    coefficient: c64,
    /// `|N| P`.
    projection: [Point; 3],
}

impl<const N: usize> ImpedanceTriangle<N> {
    /// The matrix for three vertices [m] and the coefficient `jω/Zs` [1/H].
    #[inline]
    pub fn new(shape: &'static Lagrange<N, 3>, vertices: [Point; 3], coefficient: c64) -> Self {
        let n = area_vector(vertices);
        let area = norm(n);
        let projection = std::array::from_fn(|i| {
            std::array::from_fn(|j| if i == j { area } else { 0.0 } - n[i] * n[j] / area)
        });
        Self { shape, coefficient, projection }
    }
}

impl<const N: usize> LocalMatrix<c64, N, 4> for ImpedanceTriangle<N> {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[c64; 4]; 4] {
        let factor = self.coefficient * self.shape.mass[a][b];
        let mut block = [[c64::default(); 4]; 4];
        for i in 0..3 {
            for j in 0..3 {
                block[i][j] = factor * self.projection[i][j];
            }
        }
        block
    }
}

/// `Σ_ab ⟨N_a N_b⟩ u_b ⊗ λ_a`, shape `(3, 3)`.
fn moment<const N: usize>(
    shape: &Lagrange<N, 3>,
    adjoint: &[Complex3; N],
    state: &[Complex3; N],
) -> [Complex3; 3] {
    let mut moment = [[c64::default(); 3]; 3];
    for (l, row) in adjoint.iter().zip(&shape.mass) {
        // Σ_b ⟨N_a N_b⟩ u_b first: one outer product a node.
        let mut weighted = [c64::default(); 3];
        for (u, mass) in state.iter().zip(row) {
            for i in 0..3 {
                weighted[i] += u[i] * *mass;
            }
        }
        for i in 0..3 {
            for j in 0..3 {
                moment[i][j] += weighted[i] * l[j];
            }
        }
    }
    moment
}

/// `∂/∂x_k (λᵀ M u)` for the three vertices, shape `(3, 3)`.
///
/// With `R = Σ_ab ⟨N_a N_b⟩ u_b λ_aᵀ`: `s = c (|N| tr R − NᵀRN/|N|)`,
/// `∂s/∂N = c (N̂ tr R − (R + Rᵀ)N̂ + (N̂ᵀRN̂) N̂)` and `∂s/∂x_k = ½ ∂s/∂N × e_k`, `e_k` the edge opposite node `k`.
pub fn shape_derivative<const N: usize>(
    shape: &Lagrange<N, 3>,
    vertices: [Point; 3],
    coefficient: c64,
    adjoint: &[Complex3; N],
    state: &[Complex3; N],
) -> [Complex3; 3] {
    let n = area_vector(vertices);
    let unit = n.map(|c| c / norm(n));
    let r = moment(shape, adjoint, state);
    let trace = r[0][0] + r[1][1] + r[2][2];
    let complex_unit = unit.map(|c| c64::new(c, 0.0));
    let rn: Complex3 = std::array::from_fn(|i| dot3(r[i], complex_unit));
    let normal_part = dot3(rn, complex_unit);
    let slope: Complex3 = std::array::from_fn(|i| {
        let rtn: c64 = (0..3).map(|j| r[j][i] * unit[j]).sum();
        coefficient * (unit[i] * (trace + normal_part) - rn[i] - rtn)
    });
    std::array::from_fn(|k| {
        let edge = sub(vertices[(k + 2) % 3], vertices[(k + 1) % 3]).map(|c| c64::new(0.5 * c, 0.0));
        super::cross3(slope, edge)
    })
}

/// Time-averaged loss of the triangle, `½ Re(1/Zs) ω² ∫|A_t|²` [W]. For `Zs = (1+j)/(σδ)` the real part of `jω/Zs` is
/// `ω Re(1/Zs)`.
pub fn loss<const N: usize>(
    shape: &Lagrange<N, 3>,
    vertices: [Point; 3],
    coefficient: c64,
    angular_frequency: f64,
    state: &[Complex3; N],
) -> f64 {
    let conjugate = state.map(|a| a.map(|c| c.conj()));
    let r = moment(shape, &conjugate, state);
    let n = area_vector(vertices);
    let area = norm(n);
    let mut tangential = area * (r[0][0] + r[1][1] + r[2][2]).re;
    for i in 0..3 {
        for j in 0..3 {
            tangential -= n[i] * n[j] / area * r[i][j].re;
        }
    }
    0.5 * angular_frequency * coefficient.re * tangential
}

#[cfg(test)]
mod tests {
    use super::super::differences::{assert_shape_derivative, bilinear, values};
    use super::*;

    const TRIANGLE: [Point; 3] = [[0.1, 0.0, 0.2], [1.1, 0.3, 0.0], [0.2, 0.8, 0.5]];

    fn check<const N: usize>(shape: &'static Lagrange<N, 3>) {
        let (l, u, coefficient) = (values(5), values(60), c64::new(0.7, 0.7));
        let value = |vertices: [Point; 3]| {
            let triangle = ImpedanceTriangle::new(shape, vertices, coefficient);
            bilinear(&l, |a, b| triangle.block(a, b), &u)
        };
        let exact = shape_derivative(shape, TRIANGLE, coefficient, &l, &u);
        assert_shape_derivative([1e-5, 1e-9], TRIANGLE, value, &exact);
    }

    #[test]
    fn the_shape_derivative_matches_central_differences() {
        check(Lagrange::<3, 3>::triangle());
        check(Lagrange::<6, 3>::triangle());
    }

    #[test]
    fn only_the_tangential_potential_counts() {
        // On the triangle in z = 0, a constant A_z gives nothing, a constant A_x the area.
        let flat = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        fn constant<const N: usize>(d: usize) -> [Complex3; N] {
            [std::array::from_fn(|c| c64::new(f64::from(u8::from(c == d)), 0.0)); N]
        }
        let coefficient = surface_coefficient(2.0, 3.0, 0.5);
        // ½ σδ/2 ω² · area = ½ · 0.75 · 4 · 1
        let linear = Lagrange::<3, 3>::triangle();
        assert_eq!(loss(linear, flat, coefficient, 2.0, &constant(2)), 0.0);
        assert!((loss(linear, flat, coefficient, 2.0, &constant(0)) - 1.5).abs() < 1e-14);
        let quadratic = Lagrange::<6, 3>::triangle();
        assert!((loss(quadratic, flat, coefficient, 2.0, &constant(0)) - 1.5).abs() < 1e-14);
    }
}
