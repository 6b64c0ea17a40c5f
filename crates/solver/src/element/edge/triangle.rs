//! The impedance surface under edge elements: `(jω/Zs) ∫_S (A + ∇ψ)_t·(w + ∇q)_t`.
//!
//! The tangential part of `Σ_n p_n ∇λ_n` is that with surface gradients, and with the edge `e_n` opposite vertex `n`
//! and the area `S`, `S ∇λ_m·∇λ_n = e_m·e_n / 4S`. So an entry is `1/4S Σ_mn ⟨p_m q_n⟩ e_m·e_n` with means that do not
//! depend on the triangle. The vertices are in ascending order.

use std::sync::LazyLock;

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::Point;

use super::super::Complex3;
use super::super::density::ElementIntegral;
use super::super::triangle::{Triangle, quadratic_form};
use super::functions::{self, ASCENDING_TRIANGLE_EDGES};
use crate::elements::Order;

/// Edge functions on a triangle: `N` edges and faces with unknowns, `M` functions.
#[derive(Debug)]
pub(crate) struct EdgeTriangleShape<const N: usize, const M: usize> {
    slots: [(usize, usize); M],
    /// `⟨p_m q_n⟩`, index `[f][g][m][n]`.
    means: Vec<[[[f64; 3]; 3]; M]>,
}

static FIRST: LazyLock<EdgeTriangleShape<3, 6>> = LazyLock::new(|| EdgeTriangleShape::new(Order::Linear));
static SECOND: LazyLock<EdgeTriangleShape<4, 12>> =
    LazyLock::new(|| EdgeTriangleShape::new(Order::Quadratic));

impl EdgeTriangleShape<3, 6> {
    /// First order: three edges.
    pub(crate) fn triangle() -> &'static Self {
        &FIRST
    }
}

impl EdgeTriangleShape<4, 12> {
    /// Second order: three edges and the face.
    pub(crate) fn triangle() -> &'static Self {
        &SECOND
    }
}

/// The matrix of one triangle, shape `(N × 4, N × 4)`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeTriangle<const N: usize> {
    entries: [[[[f64; 4]; 4]; N]; N],
    coefficient: c64,
}

impl<const N: usize> LocalMatrix<c64, N, 4> for EdgeTriangle<N> {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[c64; 4]; 4] {
        self.entries[a][b].map(|row| row.map(|entry| self.coefficient * entry))
    }
}

impl<const N: usize, const M: usize> EdgeTriangleShape<N, M> {
    fn new(order: Order) -> Self {
        let all = functions::functions(order, &ASCENDING_TRIANGLE_EDGES, &[[0, 1, 2]]);
        let slots = std::array::from_fn(|f| (all[f].carrier, all[f].component));
        let mean = |f: usize, g: usize, m: usize, n: usize| all[f].along[m].times(&all[g].along[n]).mean(3);
        let row = |f: usize| {
            std::array::from_fn(|g| std::array::from_fn(|m| std::array::from_fn(|n| mean(f, g, m, n))))
        };
        Self { slots, means: (0..M).map(row).collect() }
    }

    /// The matrix for three vertices [m] and the coefficient `jω/Zs` [1/H].
    pub(crate) fn matrix(&self, vertices: [Point; 3], coefficient: c64) -> EdgeTriangle<N> {
        let geometry = Triangle::new(vertices);
        let mut entries = [[[[0.0; 4]; 4]; N]; N];
        for (f, &(a, i)) in self.slots.iter().enumerate() {
            for (g, &(b, j)) in self.slots.iter().enumerate() {
                let means = self.means[f][g].as_flattened().iter();
                entries[a][b][i][j] =
                    means.zip(geometry.metric.as_flattened()).map(|(mean, metric)| mean * metric).sum();
            }
        }
        EdgeTriangle { entries, coefficient }
    }

    /// `Σ_fg l_f u_g ⟨p_m q_n⟩`, shape `(3, 3)`.
    fn moment(&self, adjoint: &[[c64; 4]], state: &[[c64; 4]]) -> [Complex3; 3] {
        let mut moment = [[c64::default(); 3]; 3];
        for (f, &(a, i)) in self.slots.iter().enumerate() {
            for (g, &(b, j)) in self.slots.iter().enumerate() {
                let product = adjoint[a][i] * state[b][j];
                for m in 0..3 {
                    for n in 0..3 {
                        moment[m][n] += product * self.means[f][g][m][n];
                    }
                }
            }
        }
        moment
    }

    /// `∂/∂x_k (λᵀ M u)` for the three vertices, shape `(3, 3)`: of `c/4S Σ_mn R_mn e_m·e_n`.
    pub(crate) fn shape_derivative(
        &self,
        vertices: [Point; 3],
        coefficient: c64,
        adjoint: &[[c64; 4]],
        state: &[[c64; 4]],
    ) -> [Complex3; 3] {
        let triangle = Triangle::new(vertices);
        let moment = self.moment(adjoint, state).map(|row| row.map(|entry| coefficient * entry));
        triangle.by_vertices(&triangle.metric_form(&moment))
    }

    /// `f ∫|(A + ∇ψ)_t|² dS`.
    pub(crate) fn loss(
        &self,
        vertices: [Point; 3],
        factor: f64,
        field: &[[c64; 4]],
    ) -> ElementIntegral<N, 3> {
        let coefficient = c64::new(factor, 0.0);
        let field: &[[c64; 4]; N] = field.try_into().expect("one entry a carrier");
        quadratic_form(&self.matrix(vertices, coefficient), field, |conjugate| {
            self.shape_derivative(vertices, coefficient, conjugate, field)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::differences::values;
    use super::super::{Ascending, EdgeShape};
    use super::*;
    use fluxmorph_geometry::tet4::{Tet4, area_vector, norm};

    const TRIANGLE: [Point; 3] = [[0.1, 0.0, 0.2], [1.1, 0.3, 0.0], [0.2, 0.8, 0.5]];

    /// The functions of a tetrahedron on its face are those of the triangle: `∫_S |A_t|²` by points of both.
    fn agrees<const N: usize, const M: usize, const F: usize, const K: usize>(
        tet: &'static EdgeShape<N, M>,
        triangle: &'static EdgeTriangleShape<F, K>,
        carriers: [usize; F],
    ) {
        let vertices = [TRIANGLE[0], TRIANGLE[1], TRIANGLE[2], [0.3, 0.2, 1.5]];
        let plain = Tet4::new(vertices);
        let ascending = Ascending::new(&plain, [0, 1, 2, 3]);
        let mut whole = [[c64::default(); 4]; N];
        let own: [[c64; 4]; F] = values::<F, 4>(3);
        for (&carrier, own) in carriers.iter().zip(own) {
            whole[carrier] = own;
        }
        let normal = area_vector(TRIANGLE);
        let unit = normal.map(|c| c / norm(normal));
        // Six points, exact for degree 4 (Dunavant, Int. J. Numer. Methods Eng. 21 (1985) 1129).
        let rule = [(0.445948490915965, 0.223381589678011), (0.091576213509771, 0.109951743655322)];
        let mut sum = 0.0;
        for (a, weight) in rule {
            for k in 0..3 {
                let mut lambda = [a, a, a, 0.0];
                lambda[k] = 1.0 - 2.0 * a;
                let mut field = [c64::default(); 3];
                for (carrier, component, value, _) in tet.functions_at(&ascending, &lambda) {
                    for d in 0..3 {
                        field[d] += value[d] * whole[carrier][component];
                    }
                }
                let across: c64 = (0..3).map(|d| field[d] * unit[d]).sum();
                let square: f64 = (0..3).map(|d| (field[d] - across * unit[d]).norm_sqr()).sum();
                sum += weight * norm(normal) * square;
            }
        }
        let loss = triangle.loss(TRIANGLE, 1.0, &own).value;
        assert!((loss - sum).abs() < 1e-12 * loss, "{loss} {sum}");
    }

    #[test]
    fn a_triangle_has_the_tangential_field_of_its_tetrahedron() {
        // Edges 01, 02, 12 of the tetrahedron, and its face 012.
        agrees(EdgeShape::<6, 12>::tet(), EdgeTriangleShape::<3, 6>::triangle(), [0, 1, 3]);
        agrees(EdgeShape::<10, 30>::tet(), EdgeTriangleShape::<4, 12>::triangle(), [0, 1, 3, 6]);
    }
}
