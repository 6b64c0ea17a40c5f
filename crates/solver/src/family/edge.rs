//! Edge elements: circulations on edges, and more on edges and faces.

use std::sync::LazyLock;

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::Point;

use super::{Cell, EachCurl, EachFunction, Family, Local, LocalIntegral, Matrices};
use crate::element::density::OfFlux;
use crate::element::edge::triangle::{EdgeTriangle, EdgeTriangleShape};
use crate::element::edge::{EdgeShape, FieldPoint, tet::EdgeTet};
use crate::element::tabulated::Rule;
use crate::element::tensor::CurlsOfRule;
use crate::element::volume::Coefficients;
use crate::element::{Complex3, dot3};
use crate::surface::SurfaceTerm;

/// Elements with `N` carriers on a tetrahedron and `F` on a face; of `M` and `K` functions.
pub(crate) struct Edge<const N: usize, const M: usize, const F: usize, const K: usize> {
    tet: &'static EdgeShape<N, M>,
    triangle: &'static EdgeTriangleShape<F, K>,
}

pub(crate) static EDGE_1: LazyLock<Edge<6, 12, 3, 6>> = LazyLock::new(|| Edge {
    tet: EdgeShape::<6, 12>::tet(),
    triangle: EdgeTriangleShape::<3, 6>::triangle(),
});
pub(crate) static EDGE_2: LazyLock<Edge<10, 30, 4, 12>> = LazyLock::new(|| Edge {
    tet: EdgeShape::<10, 30>::tet(),
    triangle: EdgeTriangleShape::<4, 12>::triangle(),
});

impl<const N: usize, const M: usize, const F: usize, const K: usize> Family for Edge<N, M, F, K> {
    fn functions(&self, cell: &Cell, lambda: &[f64; 4], each: &mut EachFunction<'_>) {
        let lambda = cell.ascending_coordinates(lambda);
        for (carrier, component, value, curl) in self.tet.functions_at(&cell.ascending(), &lambda) {
            each(carrier, component, value, curl);
        }
    }

    fn each_curl(&self, cell: &Cell, rule: Rule, each: &mut EachCurl<'_>) {
        let points = cell.points_of(rule);
        self.tet.each_curl(&cell.ascending(), rule, &mut |point, carrier, component, curl| {
            each(points[point], carrier, component, curl);
        });
    }

    fn field(&self, cell: &Cell, lambda: &[f64; 4], coefficients: &[[c64; 4]]) -> FieldPoint {
        self.tet.field_at(&cell.ascending(), &cell.ascending_coordinates(lambda), coefficients)
    }

    fn flux_change(
        &self,
        cell: &Cell,
        lambda: &[f64; 4],
        coefficients: &[[c64; 4]],
        q: Complex3,
    ) -> [Complex3; 4] {
        // δB = (∇v) B − (div v) B with v = λ_k d.
        let b = self.field(cell, lambda, coefficients).flux_density;
        let along = dot3(q, b);
        cell.tet.gradients.map(|g| {
            let through: c64 = (0..3).map(|i| g[i] * b[i]).sum();
            std::array::from_fn(|d| q[d] * through - g[d] * along)
        })
    }

    fn at_vertex(&self, cell: &Cell, vertex: usize, coefficients: &[[c64; 4]]) -> FieldPoint {
        let place = cell.order.iter().position(|&place| usize::from(place) == vertex);
        let place = place.expect("the order names every vertex");
        self.tet.at_vertex(&cell.ascending(), place, coefficients)
    }

    fn at_centroid(&self, cell: &Cell, coefficients: &[[c64; 4]]) -> FieldPoint {
        self.tet.at_centroid(&cell.ascending(), coefficients)
    }

    fn mean_square(&self, cell: &Cell, coefficients: &[[c64; 4]]) -> f64 {
        self.tet.mean_square(&cell.ascending(), coefficients)
    }

    fn shape_derivative(
        &self,
        cell: &Cell,
        law: &Coefficients,
        adjoint: &[[c64; 4]],
        state: &[[c64; 4]],
    ) -> [Complex3; 4] {
        self.tet.shape_derivative((&cell.tet, &cell.ascending()), law, adjoint, state)
    }

    fn curl_load(&self, cell: &Cell, moments: &[Complex3; 4]) -> Local {
        let moments = cell.order.map(|place| moments[usize::from(place)]);
        self.tet.curl_load(&cell.ascending(), &moments).into()
    }

    fn current_load(&self, cell: &Cell, current_density: &Complex3) -> Local {
        self.tet.current_load(&cell.ascending(), current_density).into()
    }

    fn magnet_shape_derivative(&self, cell: &Cell, source: Point, adjoint: &[[c64; 4]]) -> [Complex3; 4] {
        self.tet.magnet_shape_derivative((&cell.tet, &cell.ascending()), source, adjoint)
    }

    fn flux_integral(
        &self,
        cell: &Cell,
        coefficients: &[[c64; 4]],
        density: &mut dyn FnMut(Complex3) -> OfFlux,
    ) -> LocalIntegral<4> {
        self.tet.flux_integral((&cell.tet, &cell.ascending()), coefficients, density).into()
    }

    fn flux_shape_derivative(
        &self,
        cell: &Cell,
        adjoint: &[[c64; 4]],
        state: &[[c64; 4]],
        law: &dyn Fn(Complex3, Complex3) -> [Complex3; 2],
    ) -> [Complex3; 4] {
        self.tet.flux_shape_derivative((&cell.tet, &cell.ascending()), adjoint, state, law)
    }

    fn eddy_loss(&self, cell: &Cell, factor: f64, coefficients: &[[c64; 4]]) -> LocalIntegral<4> {
        self.tet.eddy_loss((&cell.tet, &cell.ascending()), factor, coefficients).into()
    }

    fn surface_derivative(
        &self,
        vertices: [Point; 3],
        term: SurfaceTerm,
        adjoint: &[[c64; 4]],
        state: &[[c64; 4]],
    ) -> [Complex3; 3] {
        match term {
            SurfaceTerm::Interface(_) | SurfaceTerm::Perfect(_) => [[c64::default(); 3]; 3],
            SurfaceTerm::Impedance(coefficient, _) => {
                self.triangle.shape_derivative(vertices, coefficient, adjoint, state)
            }
        }
    }

    fn surface_loss(&self, vertices: [Point; 3], factor: f64, coefficients: &[[c64; 4]]) -> LocalIntegral<3> {
        self.triangle.loss(vertices, factor, coefficients).into()
    }
}

impl<const N: usize, const M: usize, const F: usize, const K: usize> Matrices<N, F> for Edge<N, M, F, K> {
    #[inline]
    fn tet(&self, cell: Cell, law: Coefficients) -> impl LocalMatrix<c64, N, 4> {
        EdgeTet::new(self.tet, &cell.ascending(), law)
    }

    fn flux_curls(&self, cell: &Cell) -> CurlsOfRule<N> {
        self.tet.curls(&cell.ascending())
    }

    #[inline]
    fn triangle(&self, vertices: [Point; 3], term: SurfaceTerm) -> impl LocalMatrix<c64, F, 4> {
        let coefficient = match term {
            SurfaceTerm::Interface(_) | SurfaceTerm::Perfect(_) => c64::default(),
            SurfaceTerm::Impedance(coefficient, _) => coefficient,
        };
        let matrix: EdgeTriangle<F> = self.triangle.matrix(vertices, coefficient);
        matrix
    }
}
