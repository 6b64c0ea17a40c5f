//! Where physics meets space: what the elements of one family and order make of the coefficients on one of them.
//!
//! A carrier (a node; of edge elements an edge or a face) has up to four coefficients: `A_x, A_y, A_z, ψ`, or those of
//! the functions in `element::edge::functions`. All that physics asks is the field that they make, integrals of it,
//! and the derivatives of these: `Family` is that, one virtual call an element; the kernels behind it are pure
//! functions in [`crate::element`]. Assembly, which needs the matrices of all elements, is generic instead
//! (`Matrices`).

#[cfg(test)]
mod derivatives;
mod edge;
mod nodal;

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::{Point, Tet4};

pub(crate) use self::edge::{EDGE_1, EDGE_2};
pub(crate) use self::nodal::{NODAL_1, NODAL_2};
use crate::element::Complex3;
use crate::element::density::{ElementIntegral, OfFlux};
use crate::element::edge::{Ascending, FieldPoint};
use crate::element::quadrature::Node;
use crate::element::tabulated::Rule;
use crate::element::tensor::{Curls, CurlsOfRule};
use crate::element::volume::Coefficients;
use crate::elements::{ElementFamily, Order};
use crate::surface::SurfaceTerm;

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
    /// `∂/∂x_k (q·B)` at such a point, which moves with the element, shape `(4, 3)`; the coefficients are held.
    fn flux_change(
        &self,
        cell: &Cell,
        lambda: &[f64; 4],
        coefficients: &[[c64; 4]],
        q: Complex3,
    ) -> [Complex3; 4];
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
    /// The integral of a density of `B`, by points that count alike.
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
