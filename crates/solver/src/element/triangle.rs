//! A flat triangle in space: what surface integrals and their derivatives by the vertices are made from.
//!
//! With the area vector `N`, `S = |N|`, `n̂ = N/S` and the edges `e_m = x_{m+2} − x_{m+1}` (indices modulo 3), the surface
//! gradients are `∇λ_m = n̂ × e_m / 2S`, so that `S ∇λ_m·∇λ_n = e_m·e_n / 4S`. Vertex `k` is the end of `e_{k+1}` and the
//! start of `e_{k+2}`, and `v·∂N/∂x_k = ½ v × e_k` for any vector `v`.

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::{Point, area_vector, cross, dot, norm, sub};

use super::density::ElementIntegral;
use super::{Complex3, cross3};

/// Geometry of one triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    /// `S` [m²].
    pub(crate) area: f64,
    /// `n̂`.
    pub(crate) unit_normal: Point,
    /// `e_m` [m], the edge opposite each vertex.
    pub(crate) edges: [Point; 3],
    /// `e_m·e_n / 4S` [1].
    pub(crate) metric: [Point; 3],
}

/// Derivatives of a surface integral `s(N, e_0, e_1, e_2)`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Slopes {
    /// `∂s/∂N` at fixed edges.
    pub(crate) by_normal: Complex3,
    /// `∂s/∂e_m` at a fixed normal.
    pub(crate) by_edge: [Complex3; 3],
}

impl Triangle {
    /// The geometry for three vertices [m].
    #[inline]
    pub(crate) fn new(vertices: [Point; 3]) -> Self {
        let normal = area_vector(vertices);
        let area = norm(normal);
        let edges: [Point; 3] = std::array::from_fn(|m| sub(vertices[(m + 2) % 3], vertices[(m + 1) % 3]));
        let metric = edges.map(|a| edges.map(|b| dot(a, b) / (4.0 * area)));
        Self { area, unit_normal: normal.map(|c| c / area), edges, metric }
    }

    /// `S ∇λ_m = ½ n̂ × e_m` [m].
    #[inline]
    pub(crate) fn slopes(&self) -> [Point; 3] {
        self.edges.map(|e| cross(self.unit_normal, e).map(|c| 0.5 * c))
    }

    /// Derivatives of `Σ_mn R_mn e_m·e_n / 4S`.
    pub(crate) fn metric_form(&self, r: &[Complex3; 3]) -> Slopes {
        let mut slopes = Slopes::default();
        let mut value = c64::default();
        for m in 0..3 {
            for n in 0..3 {
                value += r[m][n] * self.metric[m][n];
                let both = (r[m][n] + r[n][m]) / (4.0 * self.area);
                for d in 0..3 {
                    slopes.by_edge[m][d] += both * self.edges[n][d];
                }
            }
        }
        slopes.by_normal = self.unit_normal.map(|c| -value * c / self.area);
        slopes
    }

    /// `∂s/∂x_k = ½ ∂s/∂N × e_k + ∂s/∂e_{k+1} − ∂s/∂e_{k+2}`, shape `(3, 3)`.
    pub(crate) fn by_vertices(&self, slopes: &Slopes) -> [Complex3; 3] {
        std::array::from_fn(|k| {
            let edge = self.edges[k].map(|c| c64::new(0.5 * c, 0.0));
            let by_area = cross3(slopes.by_normal, edge);
            let (ahead, behind) = (slopes.by_edge[(k + 1) % 3], slopes.by_edge[(k + 2) % 3]);
            std::array::from_fn(|d| by_area[d] + ahead[d] - behind[d])
        })
    }
}

/// `ūᵀ M u` for a real symmetric matrix `M` of a triangle, with `∂/∂x_k (λᵀ M u)` as a function of `λ = ū`.
pub(crate) fn quadratic_form<const N: usize>(
    matrix: &impl LocalMatrix<c64, N, 4>,
    field: &[[c64; 4]; N],
    shape_derivative: impl FnOnce(&[[c64; 4]; N]) -> [Complex3; 3],
) -> ElementIntegral<N, 3> {
    let conjugate = field.map(|values| values.map(|c| c.conj()));
    let mut potentials = [[c64::default(); 4]; N];
    for a in 0..N {
        for b in 0..N {
            let block = matrix.block(a, b);
            for i in 0..4 {
                for j in 0..4 {
                    potentials[b][j] += conjugate[a][i] * block[i][j];
                }
            }
        }
    }
    let products = potentials.as_flattened().iter().zip(field.as_flattened());
    let value = products.map(|(p, u)| (p * u).re).sum();
    let positions = shape_derivative(&conjugate).map(|row| row.map(|c| c.re));
    ElementIntegral { value, potentials, positions }
}
