//! The A–ψ tetrahedron of any Lagrange order, by the exact means of its shape functions' products.
//!
//! The weak form is that of [`super::volume`], whose closed form serves linear elements faster; here
//! `∫∇N_a·∇N_b = V Σ_mn ⟨∂_m N_a ∂_n N_b⟩ g_m·g_n` (a sum over the edges once `Σ_m g_m = 0` is used) and so on, with the tables of [`super::lagrange`] and the constant
//! gradients `g_m = ∇λ_m` of a straight-sided element.

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::{EDGES, Tet4, dot};

use super::lagrange::Lagrange;
use super::volume::Coefficients;

/// The A–ψ matrix of a straight-sided tetrahedron with `N` nodes, shape `(N × 4, N × 4)`.
#[derive(Clone, Copy, Debug)]
pub struct LagrangeTet<const N: usize> {
    shape: &'static Lagrange<N, 4>,
    tet: Tet4,
    coefficients: Coefficients,
    /// `V g_m·g_n` of the edges `(m, n)`: the others follow from `Σ_m g_m = 0`.
    metric: [f64; 6],
}

impl<const N: usize> LagrangeTet<N> {
    /// The element matrix for given geometry and coefficients.
    #[inline]
    pub fn new(shape: &'static Lagrange<N, 4>, tet: Tet4, coefficients: Coefficients) -> Self {
        let g = &tet.gradients;
        let metric = EDGES.map(|[m, n]| tet.volume * dot(g[m], g[n]));
        Self { shape, tet, coefficients, metric }
    }

    /// `∫∇N_a·∇N_b`.
    #[inline]
    fn laplace(&self, a: usize, b: usize) -> f64 {
        self.shape.laplace[a][b].iter().zip(&self.metric).map(|(s, m)| s * m).sum()
    }
}

impl<const N: usize> LocalMatrix<c64, N, 4> for LagrangeTet<N> {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[c64; 4]; 4] {
        let Coefficients { reluctivity, extra_penalty, eddy } = self.coefficients;
        let (volume, g) = (self.tet.volume, &self.tet.gradients);
        let stiffness = &self.shape.stiffness[a][b];
        let laplace = self.laplace(a, b);
        let mass = volume * self.shape.mass[a][b];
        let mut block = [[c64::default(); 4]; 4];
        for i in 0..3 {
            block[i][i] = c64::new(reluctivity * laplace, 0.0) + eddy * mass;
        }
        if eddy != c64::default() {
            for i in 0..3 {
                let (mut of_b, mut of_a) = (0.0, 0.0);
                for m in 0..4 {
                    of_b += self.shape.advection[a][b][m] * g[m][i];
                    of_a += self.shape.advection[b][a][m] * g[m][i];
                }
                block[i][3] = eddy * (volume * of_b);
                block[3][i] = eddy * (volume * of_a);
            }
            block[3][3] = eddy * laplace;
        }
        if extra_penalty != 0.0 {
            for i in 0..3 {
                for j in 0..3 {
                    let mut sum = 0.0;
                    for m in 0..4 {
                        for n in 0..4 {
                            sum += stiffness[m][n] * g[m][i] * g[n][j];
                        }
                    }
                    block[i][j] += extra_penalty * volume * sum;
                }
            }
        }
        block
    }

    #[inline]
    fn scalars(&self) -> Option<[[f64; N]; N]> {
        let Coefficients { reluctivity, extra_penalty, eddy } = self.coefficients;
        if extra_penalty != 0.0 || eddy != c64::default() {
            return None;
        }
        let mut scalars = [[0.0; N]; N];
        for a in 0..N {
            for b in a..N {
                scalars[a][b] = reluctivity * self.laplace(a, b);
            }
        }
        Some(scalars)
    }
}

#[cfg(test)]
mod tests {
    use super::super::differences::{SKEW, bilinear, values};
    use super::super::point::{self, PointField};
    use super::super::volume::{AphiTet, NodalField};
    use super::super::{Complex3, dot3, quadrature};
    use super::*;

    const LAW: Coefficients = Coefficients { reluctivity: 1.7, extra_penalty: 0.6, eddy: c64::new(0.0, 2.3) };

    #[test]
    fn of_first_order_it_is_the_closed_form() {
        let (closed, general) = (
            AphiTet::new(Tet4::new(SKEW), LAW),
            LagrangeTet::new(Lagrange::<4, 4>::tet(), Tet4::new(SKEW), LAW),
        );
        for a in 0..4 {
            for b in 0..4 {
                let (x, y) = (closed.block(a, b), general.block(a, b));
                for i in 0..4 {
                    for j in 0..4 {
                        assert!((x[i][j] - y[i][j]).norm() < 1e-14, "{a} {b} {i} {j}");
                    }
                }
            }
        }
    }

    /// `∫ν∇λ:∇u + extra div λ div u + eddy (λ + ∇ψ_λ)·(u + ∇ψ_u)` by quadrature.
    #[test]
    fn the_quadratic_matrix_is_the_weak_form_by_quadrature() {
        let shape = Lagrange::<10, 4>::tet();
        let components = [values(1), values(90)];
        let [l, u] = components.map(NodalField::new);
        let tet = Tet4::new(SKEW);
        let mut sum = c64::default();
        for (lambda, weight) in quadrature::degree_5() {
            let (l, u) = (PointField::new(shape, &tet, lambda, &l), PointField::new(shape, &tet, lambda, &u));
            let trace = |g: &[Complex3; 3]| g[0][0] + g[1][1] + g[2][2];
            let laplace: c64 = (0..3).map(|d| dot3(l.gradient[d], u.gradient[d])).sum();
            sum += weight
                * tet.volume
                * (LAW.reluctivity * laplace
                    + LAW.extra_penalty * trace(&l.gradient) * trace(&u.gradient)
                    + LAW.eddy * dot3(l.electric_potential(), u.electric_potential()));
        }
        let matrix = LagrangeTet::new(shape, tet, LAW);
        let exact = bilinear(&components[0], |a, b| matrix.block(a, b), &components[1]);
        assert!((sum - exact).norm() < 1e-13 * exact.norm(), "{sum} {exact}");
    }

    #[test]
    fn the_load_of_a_magnet_is_its_weak_form() {
        let shape = Lagrange::<10, 4>::tet();
        let l = NodalField::<10>::new(values(7));
        let source = [0.3, -1.2, 0.8];
        let tet = Tet4::new(SKEW);
        let moments = [source.map(|t| c64::from(0.25 * tet.volume * t)); 4];
        let load = point::curl_load(shape, &tet, &moments);
        let value: c64 = load.iter().zip(&l.vector_potential).map(|(f, l)| dot3(*f, *l)).sum();
        // Against ∫T·curl λ by quadrature.
        let integral: c64 = quadrature::degree_2()
            .iter()
            .map(|(lambda, w)| {
                let curl = PointField::new(shape, &tet, lambda, &l).flux_density();
                w * tet.volume * dot3(curl, source.map(c64::from))
            })
            .sum();
        assert!((value - integral).norm() < 1e-14);
    }
}
