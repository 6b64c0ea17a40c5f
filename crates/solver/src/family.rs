//! Where physics meets space: what the elements of one family and order make of the coefficients on one of them.
//!
//! A carrier (a node; of edge elements an edge or a face) has up to four coefficients: `A_x, A_y, A_z, ψ`, or those of
//! the functions in `element::edge::functions`. All that physics asks is the field that they make, integrals of it,
//! and the derivatives of these: `Family` is that, one virtual call an element; the kernels behind it are pure
//! functions in [`crate::element`]. Assembly, which needs the matrices of all elements, is generic instead
//! (`Matrices`).

use std::sync::LazyLock;

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::{Point, Tet4, cross};

use crate::element::density::{self, ElementIntegral, OfFlux};
use crate::element::edge::triangle::{EdgeTriangle, EdgeTriangleShape};
use crate::element::edge::{Ascending, EdgeShape, FieldPoint, tet::EdgeTet};
use crate::element::lagrange::Lagrange;
use crate::element::point::{self, PointField};
use crate::element::quadratic::LagrangeTet;
use crate::element::quadrature::Node;
use crate::element::tabulated::Rule;
use crate::element::tensor::{Curls, CurlsOfRule};
use crate::element::virtual_work::{self, VirtualWork};
use crate::element::volume::{AphiTet, Coefficients, NodalField};
use crate::element::{Complex3, impedance, interface};
use crate::space::{ElementFamily, Order};
use crate::surface::{SurfaceMatrix, SurfaceTerm};

/// Most carriers of an element.
pub(crate) const MOST: usize = 10;

/// Coefficients of one element or face, by carrier and component.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Local {
    count: usize,
    values: [[c64; 4]; MOST],
}

impl Local {
    /// Those that a function gives of each of `count` carriers.
    #[inline]
    pub(crate) fn new(count: usize, mut of: impl FnMut(usize) -> [c64; 4]) -> Self {
        let mut values = [[c64::default(); 4]; MOST];
        for (a, value) in values.iter_mut().enumerate().take(count) {
            *value = of(a);
        }
        Self { count, values }
    }

    /// Adds to one coefficient.
    #[inline]
    pub(crate) fn add(&mut self, carrier: usize, component: usize, value: c64) {
        self.values[carrier][component] += value;
    }

    /// One entry a carrier.
    #[inline]
    pub(crate) fn values(&self) -> &[[c64; 4]] {
        &self.values[..self.count]
    }
}

impl<const N: usize> From<[[c64; 4]; N]> for Local {
    #[inline]
    fn from(values: [[c64; 4]; N]) -> Self {
        Self::new(N, |a| values[a])
    }
}

/// An element's vertices: its geometry, and the place of each vertex in ascending order of the numbers.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Volume and gradients, in the order of the mesh.
    pub tet: Tet4,
    /// Only edge elements have an order of their own.
    pub order: [u8; 4],
}

impl Cell {
    fn ascending(&self) -> Ascending {
        Ascending::new(&self.tet, self.order)
    }

    /// The number, in the order of the mesh's vertices, of every point of a rule in their ascending order: rules are
    /// symmetric, so that a permutation of the vertices permutes the points.
    fn points_of(&self, rule: Rule) -> Vec<usize> {
        let nodes = rule.nodes();
        let same =
            |(of_mesh, _): &Node, (ascending, _): &Node| self.ascending_coordinates(of_mesh) == *ascending;
        nodes.iter().map(|to| nodes.iter().position(|from| same(from, to)).expect("symmetric")).collect()
    }

    /// Barycentric coordinates in ascending order of the vertices.
    fn ascending_coordinates(&self, lambda: &[f64; 4]) -> [f64; 4] {
        self.order.map(|place| lambda[usize::from(place)])
    }
}

/// A real integral over an element or a face with `M` vertices, and its derivatives as in [`ElementIntegral`].
pub(crate) struct LocalIntegral<const M: usize> {
    pub(crate) value: f64,
    pub(crate) potentials: Local,
    pub(crate) positions: [Point; M],
}

impl<const N: usize, const M: usize> From<ElementIntegral<N, M>> for LocalIntegral<M> {
    fn from(integral: ElementIntegral<N, M>) -> Self {
        let ElementIntegral { value, potentials, positions } = integral;
        Self { value, potentials: potentials.into(), positions }
    }
}

impl<const N: usize> From<VirtualWork<N>> for (LocalIntegral<4>, [Point; 4]) {
    fn from(VirtualWork { rate, by_velocity }: VirtualWork<N>) -> Self {
        (rate.into(), by_velocity)
    }
}

/// What receives functions: carrier, component, value [1/m or 1], curl [1/m² or 1/m].
pub type EachFunction<'a> = dyn FnMut(usize, usize, Point, Point) + 'a;

/// What receives curls: point of the rule, carrier, component, curl [1/m² or 1/m].
pub(crate) type EachCurl<'a> = dyn FnMut(usize, usize, usize, Point) + 'a;

/// Elements of one family and order.
pub(crate) trait Family: Sync {
    /// Every function at a point given by the barycentric coordinates of the mesh's vertices.
    fn functions(&self, cell: &Cell, lambda: &[f64; 4], each: &mut EachFunction<'_>);
    /// The curl of every function that has one, at the points of a rule.
    fn each_curl(&self, cell: &Cell, rule: Rule, each: &mut EachCurl<'_>);
    /// The field at such a point.
    fn field(&self, cell: &Cell, lambda: &[f64; 4], coefficients: &[[c64; 4]]) -> FieldPoint;
    /// The field at a vertex, by its place in the mesh's order.
    fn at_vertex(&self, cell: &Cell, vertex: usize, coefficients: &[[c64; 4]]) -> FieldPoint;
    /// The field at the centroid.
    fn at_centroid(&self, cell: &Cell, coefficients: &[[c64; 4]]) -> FieldPoint;
    /// The mean of `|A + ∇ψ|²` [T² m²].
    fn mean_square(&self, cell: &Cell, coefficients: &[[c64; 4]]) -> f64;
    /// `∂/∂x_k (λᵀ K_e u)`, shape `(4, 3)`.
    fn shape_derivative(
        &self,
        cell: &Cell,
        law: &Coefficients,
        adjoint: &[[c64; 4]],
        state: &[[c64; 4]],
    ) -> [Complex3; 4];
    /// The load `∫T·curl w` of the moments `∫T λ_b dV` [A m²].
    fn curl_load(&self, cell: &Cell, moments: &[Complex3; 4]) -> Local;
    /// The load `∫J·w` of a constant current density [A/m²].
    fn current_load(&self, cell: &Cell, current_density: &Complex3) -> Local;
    /// `∂/∂x_k (λᵀ f)` for the load of a constant `T` [A/m] that moves with the element.
    fn magnet_shape_derivative(&self, cell: &Cell, source: Point, adjoint: &[[c64; 4]]) -> [Complex3; 4];
    /// The integral of a density of `B`.
    fn flux_integral(
        &self,
        cell: &Cell,
        coefficients: &[[c64; 4]],
        density: &mut dyn FnMut(Complex3) -> OfFlux,
    ) -> LocalIntegral<4>;
    /// `∂/∂x_k ∫ H(B_u)·B_l` of a law that gives `H(B_u)` and `∂H/∂B B_l` from `B_l` and `B_u`.
    fn flux_shape_derivative(
        &self,
        cell: &Cell,
        adjoint: &[[c64; 4]],
        state: &[[c64; 4]],
        law: &dyn Fn(Complex3, Complex3) -> [Complex3; 2],
    ) -> [Complex3; 4];
    /// The rate of `c ∫(|B|² + p |div A|²) dV` for velocities of the vertices, and its derivatives by these; `law` is `c` and
    /// the penalty factor `p`, which edge elements do not have.
    fn virtual_work(
        &self,
        cell: &Cell,
        law: [f64; 2],
        velocities: &[Point; 4],
        coefficients: &[[c64; 4]],
    ) -> (LocalIntegral<4>, [Point; 4]);
    /// `f ∫|A + ∇ψ|² dV`.
    fn eddy_loss(&self, cell: &Cell, factor: f64, coefficients: &[[c64; 4]]) -> LocalIntegral<4>;
    /// `∂/∂x_k (λᵀ M u)` of a surface term.
    fn surface_derivative(
        &self,
        vertices: [Point; 3],
        term: SurfaceTerm,
        adjoint: &[[c64; 4]],
        state: &[[c64; 4]],
    ) -> [Complex3; 3];
    /// `f ∫|(A + ∇ψ)_t|² dS`.
    fn surface_loss(&self, vertices: [Point; 3], factor: f64, coefficients: &[[c64; 4]]) -> LocalIntegral<3>;
}

/// The matrices of elements with `N` and faces with `F` carriers.
pub(crate) trait Matrices<const N: usize, const F: usize>: Family {
    /// The curls of all functions at the points of a rule.
    fn curls(&self, cell: &Cell, rule: Rule) -> Vec<Curls<N>> {
        let mut curls = vec![[[[0.0; 3]; 4]; N]; rule.nodes().len()];
        self.each_curl(cell, rule, &mut |point, carrier, component, curl| {
            curls[point][carrier][component] = curl
        });
        curls
    }
    /// Of a tetrahedron.
    fn tet(&self, cell: Cell, law: Coefficients) -> impl LocalMatrix<c64, N, 4>;
    /// The same at the points of [`Family::flux_integral`], in its order.
    fn flux_curls(&self, cell: &Cell) -> CurlsOfRule<N>;
    /// Of a surface term.
    fn triangle(&self, vertices: [Point; 3], term: SurfaceTerm) -> impl LocalMatrix<c64, F, 4>;
}

/// The elements of a family and order.
pub(crate) fn of(family: ElementFamily, order: Order) -> &'static dyn Family {
    match (family, order) {
        (ElementFamily::Nodal, Order::Linear) => &*NODAL_1,
        (ElementFamily::Nodal, Order::Quadratic) => &*NODAL_2,
        (ElementFamily::Edge, Order::Linear) => &*EDGE_1,
        (ElementFamily::Edge, Order::Quadratic) => &*EDGE_2,
    }
}

/// Lagrange elements: the vector potential and ψ at nodes.
pub(crate) struct Nodal<const N: usize, const F: usize> {
    tet: &'static Lagrange<N, 4>,
    triangle: &'static Lagrange<F, 3>,
}

pub(crate) static NODAL_1: LazyLock<Nodal<4, 3>> =
    LazyLock::new(|| Nodal { tet: Lagrange::<4, 4>::tet(), triangle: Lagrange::<3, 3>::triangle() });
pub(crate) static NODAL_2: LazyLock<Nodal<10, 6>> =
    LazyLock::new(|| Nodal { tet: Lagrange::<10, 4>::tet(), triangle: Lagrange::<6, 3>::triangle() });

/// Edge elements: circulations on edges, and more on edges and faces.
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
        let square = |at: &crate::element::tabulated::Tabulated<N>| {
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

    fn virtual_work(
        &self,
        cell: &Cell,
        law: [f64; 2],
        velocities: &[Point; 4],
        coefficients: &[[c64; 4]],
    ) -> (LocalIntegral<4>, [Point; 4]) {
        virtual_work::virtual_work(self.tet, &cell.tet, law, velocities, &nodal(coefficients)).into()
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

    fn virtual_work(
        &self,
        cell: &Cell,
        [factor, _]: [f64; 2],
        velocities: &[Point; 4],
        coefficients: &[[c64; 4]],
    ) -> (LocalIntegral<4>, [Point; 4]) {
        self.tet.virtual_work((&cell.tet, &cell.ascending()), factor, velocities, coefficients).into()
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
