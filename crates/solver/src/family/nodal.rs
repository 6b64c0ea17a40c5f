//! Lagrange elements: the vector potential and ψ at nodes.

use std::sync::LazyLock;

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::{Point, cross};

use super::{Cell, EachCurl, EachFunction, Family, Local, LocalIntegral, Matrices};
use crate::element::density::{self, OfFlux};
use crate::element::edge::FieldPoint;
use crate::element::lagrange::Lagrange;
use crate::element::point::{self, PointField};
use crate::element::quadratic::LagrangeTet;
use crate::element::tabulated::{Rule, Tabulated};
use crate::element::tensor::CurlsOfRule;
use crate::element::volume::{AphiTet, Coefficients, NodalField};
use crate::element::{Complex3, cross3, impedance, interface};
use crate::surface::{SurfaceMatrix, SurfaceTerm};

/// Elements with `N` nodes on a tetrahedron and `F` on a face.
pub(crate) struct Nodal<const N: usize, const F: usize> {
    tet: &'static Lagrange<N, 4>,
    triangle: &'static Lagrange<F, 3>,
}

pub(crate) static NODAL_1: LazyLock<Nodal<4, 3>> =
    LazyLock::new(|| Nodal { tet: Lagrange::<4, 4>::tet(), triangle: Lagrange::<3, 3>::triangle() });
pub(crate) static NODAL_2: LazyLock<Nodal<10, 6>> =
    LazyLock::new(|| Nodal { tet: Lagrange::<10, 4>::tet(), triangle: Lagrange::<6, 3>::triangle() });

/// The nodal potentials of an element.
#[inline]
fn nodal<const N: usize>(coefficients: &[[c64; 4]]) -> NodalField<N> {
    NodalField::new(*at_nodes(coefficients))
}

#[inline]
fn at_nodes<const N: usize>(coefficients: &[[c64; 4]]) -> &[[c64; 4]; N] {
    coefficients.try_into().expect("one entry a node")
}

fn with_psi<const N: usize>(load: [Complex3; N]) -> Local {
    Local::new(N, |a| [load[a][0], load[a][1], load[a][2], c64::default()])
}

impl From<PointField> for FieldPoint {
    fn from(field: PointField) -> Self {
        Self {
            vector_potential: field.vector_potential,
            electric_potential: field.electric_potential(),
            flux_density: field.flux_density(),
        }
    }
}

const UNIT: [Point; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

impl<const N: usize, const F: usize> Family for Nodal<N, F> {
    fn functions(&self, cell: &Cell, lambda: &[f64; 4], each: &mut EachFunction<'_>) {
        for a in 0..N {
            let value = self.tet.value(a, lambda);
            let gradient = point::gradient(self.tet, &cell.tet, lambda, a);
            for (d, unit) in UNIT.into_iter().enumerate() {
                each(a, d, unit.map(|u| value * u), cross(gradient, unit));
            }
            each(a, 3, gradient, [0.0; 3]);
        }
    }

    fn each_curl(&self, cell: &Cell, rule: Rule, each: &mut EachCurl<'_>) {
        for (point, at) in self.tet.at(rule).iter().enumerate() {
            for a in 0..N {
                let gradient = at.gradient(&cell.tet.gradients, a);
                for (d, unit) in UNIT.into_iter().enumerate() {
                    each(point, a, d, cross(gradient, unit));
                }
            }
        }
    }

    fn field(&self, cell: &Cell, lambda: &[f64; 4], coefficients: &[[c64; 4]]) -> FieldPoint {
        PointField::new(self.tet, &cell.tet, lambda, &nodal(coefficients)).into()
    }

    fn flux_change(
        &self,
        cell: &Cell,
        lambda: &[f64; 4],
        coefficients: &[[c64; 4]],
        q: Complex3,
    ) -> [Complex3; 4] {
        // δ(∂_i A_j) = −∂_i λ_k ∂_d A_j, hence q·δB = −∇λ_k · (∂_d A × q).
        let turned = PointField::new(self.tet, &cell.tet, lambda, &nodal(coefficients))
            .gradient
            .map(|row| cross3(row, q));
        cell.tet.gradients.map(|g| turned.map(|row| -(0..3).map(|i| g[i] * row[i]).sum::<c64>()))
    }

    fn at_vertex(&self, cell: &Cell, vertex: usize, coefficients: &[[c64; 4]]) -> FieldPoint {
        let table = &self.tet.at(Rule::Vertices)[vertex];
        PointField::tabulated(table, &cell.tet, &nodal(coefficients)).into()
    }

    fn at_centroid(&self, cell: &Cell, coefficients: &[[c64; 4]]) -> FieldPoint {
        let table = &self.tet.at(Rule::Centroid)[0];
        PointField::tabulated(table, &cell.tet, &nodal(coefficients)).into()
    }

    fn mean_square(&self, cell: &Cell, coefficients: &[[c64; 4]]) -> f64 {
        let field = nodal(coefficients);
        let rule = if N == 4 { Rule::Degree2 } else { Rule::Degree5 };
        let square = |at: &Tabulated<N>| {
            let potential = PointField::tabulated(at, &cell.tet, &field).electric_potential();
            at.share * potential.iter().map(|c| c.norm_sqr()).sum::<f64>()
        };
        self.tet.at(rule).iter().map(square).sum()
    }

    fn shape_derivative(
        &self,
        cell: &Cell,
        law: &Coefficients,
        adjoint: &[[c64; 4]],
        state: &[[c64; 4]],
    ) -> [Complex3; 4] {
        point::shape_derivative(self.tet, &cell.tet, law, &nodal(adjoint), &nodal(state))
    }

    fn curl_load(&self, cell: &Cell, moments: &[Complex3; 4]) -> Local {
        with_psi(point::curl_load(self.tet, &cell.tet, moments))
    }

    fn current_load(&self, cell: &Cell, current_density: &Complex3) -> Local {
        with_psi(point::current_load(self.tet, &cell.tet, current_density))
    }

    fn magnet_shape_derivative(&self, cell: &Cell, source: Point, adjoint: &[[c64; 4]]) -> [Complex3; 4] {
        point::magnet_shape_derivative(self.tet, &cell.tet, source, &nodal(adjoint))
    }

    fn flux_integral(
        &self,
        cell: &Cell,
        coefficients: &[[c64; 4]],
        density: &mut dyn FnMut(Complex3) -> OfFlux,
    ) -> LocalIntegral<4> {
        density::flux_integral(self.tet, &cell.tet, &nodal(coefficients), density).into()
    }

    fn flux_shape_derivative(
        &self,
        cell: &Cell,
        adjoint: &[[c64; 4]],
        state: &[[c64; 4]],
        law: &dyn Fn(Complex3, Complex3) -> [Complex3; 2],
    ) -> [Complex3; 4] {
        point::flux_shape_derivative(self.tet, &cell.tet, &nodal(adjoint), &nodal(state), law)
    }

    fn eddy_loss(&self, cell: &Cell, factor: f64, coefficients: &[[c64; 4]]) -> LocalIntegral<4> {
        density::eddy_loss(self.tet, &cell.tet, factor, &nodal(coefficients)).into()
    }

    fn surface_derivative(
        &self,
        vertices: [Point; 3],
        term: SurfaceTerm,
        adjoint: &[[c64; 4]],
        state: &[[c64; 4]],
    ) -> [Complex3; 3] {
        let surface = |coefficient: c64| {
            let (l, u) = (at_nodes(adjoint), at_nodes(state));
            impedance::shape_derivative(self.triangle, vertices, coefficient, l, u)
        };
        match term {
            SurfaceTerm::Interface(jump) => {
                let (l, u) = (nodal(adjoint).vector_potential, nodal(state).vector_potential);
                interface::shape_derivative(self.triangle, jump, &l, &u)
            }
            SurfaceTerm::Impedance(coefficient, _) => surface(coefficient),
            SurfaceTerm::Perfect(coefficient) => surface(coefficient.into()),
        }
    }

    fn surface_loss(&self, vertices: [Point; 3], factor: f64, coefficients: &[[c64; 4]]) -> LocalIntegral<3> {
        impedance::loss(self.triangle, vertices, factor, at_nodes(coefficients)).into()
    }
}

impl Matrices<4, 3> for Nodal<4, 3> {
    #[inline]
    fn tet(&self, cell: Cell, law: Coefficients) -> impl LocalMatrix<c64, 4, 4> {
        AphiTet::new(cell.tet, law)
    }

    fn flux_curls(&self, cell: &Cell) -> CurlsOfRule<4> {
        point::curls(self.tet, &cell.tet)
    }

    #[inline]
    fn triangle(&self, vertices: [Point; 3], term: SurfaceTerm) -> impl LocalMatrix<c64, 3, 4> {
        SurfaceMatrix::new(self.triangle, vertices, term)
    }
}

impl Matrices<10, 6> for Nodal<10, 6> {
    #[inline]
    fn tet(&self, cell: Cell, law: Coefficients) -> impl LocalMatrix<c64, 10, 4> {
        LagrangeTet::new(self.tet, cell.tet, law)
    }

    fn flux_curls(&self, cell: &Cell) -> CurlsOfRule<10> {
        point::curls(self.tet, &cell.tet)
    }

    #[inline]
    fn triangle(&self, vertices: [Point; 3], term: SurfaceTerm) -> impl LocalMatrix<c64, 6, 4> {
        SurfaceMatrix::new(self.triangle, vertices, term)
    }
}
