//! Edge elements: `A + ∇ψ` by functions whose tangential components are continuous.
//!
//! Every function is a field `Σ_n p_n ∇λ_n` with polynomials `p_n` ([`functions`] has the table), its curl
//! `Σ_mn c_mn ∇λ_m × ∇λ_n`. As a node moves, coefficients are held and `∇λ_n` follows, so that a field changes by `δE =
//! −(∇v)ᵀ E` and its curl by `δB = (∇v) B − (div v) B`, `v` the displacement; with `v = λ_k d` every integral has
//! the derivative `V ⟨S⟩ ∇λ_k` of an Eshelby tensor `S` in `E` and `B` alone, whatever the order. Lives here: the
//! tables of the functions and the fields they make ([`EdgeShape`]), the matrix of a tetrahedron ([`tet`]), integrals over
//! it with their derivatives ([`integral`]), the impedance surface ([`triangle`]). Does not live here: who has which
//! unknown ([`crate::space`], [`crate::unknowns`]).

pub(crate) mod functions;
mod integral;
mod polynomial;
pub(crate) mod tet;
pub(crate) mod triangle;

use std::sync::LazyLock;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{EDGES, Point, Tet4, cross};

use super::Complex3;
use super::tabulated::Rule;
use crate::elements::Order;
use functions::ASCENDING_FACES;

/// A tetrahedron as its edge functions see it: the vertices in ascending order of their numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ascending {
    /// `V` [m³].
    pub(crate) volume: f64,
    /// `∇λ_n` [1/m].
    pub(crate) gradients: [Point; 4],
    /// `∇λ_m × ∇λ_n` [1/m²] for the pairs of [`EDGES`].
    pub(crate) products: [Point; 6],
}

impl Ascending {
    /// From a tetrahedron and the place of each ascending vertex in it.
    #[inline]
    pub(crate) fn new(tet: &Tet4, order: [u8; 4]) -> Self {
        let gradients = order.map(|place| tet.gradients[usize::from(place)]);
        let products = EDGES.map(|[m, n]| cross(gradients[m], gradients[n]));
        Self { volume: tet.volume, gradients, products }
    }
}

/// Potentials [T m] and `B` [T] at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FieldPoint {
    /// `A` of nodal elements; of edge elements `A + ∇ψ`, which they do not tell apart.
    pub vector_potential: Complex3,
    /// `A + ∇ψ`; `E = −jω(A + ∇ψ)`.
    pub electric_potential: Complex3,
    /// `B = curl A`.
    pub flux_density: Complex3,
}

impl FieldPoint {
    /// The field of edge elements.
    pub(crate) fn of_edges(electric_potential: Complex3, flux_density: Complex3) -> Self {
        Self { vector_potential: electric_potential, electric_potential, flux_density }
    }
}

/// All functions at one point: factors of `∇λ_n`, and of `∇λ_m × ∇λ_n` in the curls.
#[derive(Clone, Debug)]
pub(super) struct At<const M: usize> {
    /// Share of the volume.
    share: f64,
    along: [[f64; 4]; M],
    curl: [[f64; 6]; M],
}

/// Edge functions of one order: `N` edges and faces with unknowns, `M` functions.
#[derive(Debug)]
pub(crate) struct EdgeShape<const N: usize, const M: usize> {
    all: Vec<functions::Function>,
    curls: Vec<[polynomial::Polynomial; 6]>,
    /// Carrier and component of every function, the rotational ones first.
    slots: [(usize, usize); M],
    /// How many are rotational.
    rotational: usize,
    /// Function of every component of every carrier.
    number: [[Option<u8>; 4]; N],
    /// Factors of `λ_b` in the curls, index `[function][b][pair]`: curls are linear at most.
    curl_slope: [[[f64; 6]; 4]; M],
    tables: Vec<Vec<At<M>>>,
}

static FIRST: LazyLock<EdgeShape<6, 12>> = LazyLock::new(|| EdgeShape::new(Order::Linear));
static SECOND: LazyLock<EdgeShape<10, 30>> = LazyLock::new(|| EdgeShape::new(Order::Quadratic));

impl EdgeShape<6, 12> {
    /// First order: six edges.
    pub(crate) fn tet() -> &'static Self {
        &FIRST
    }
}

impl EdgeShape<10, 30> {
    /// Second order: six edges and four faces.
    pub(crate) fn tet() -> &'static Self {
        &SECOND
    }
}

impl<const N: usize, const M: usize> EdgeShape<N, M> {
    fn new(order: Order) -> Self {
        let all = functions::functions(order, &EDGES, &ASCENDING_FACES);
        let curls: Vec<[polynomial::Polynomial; 6]> = all.iter().map(functions::Function::curl).collect();
        let turns = |curl: &&[polynomial::Polynomial; 6]| curl.iter().any(|p| *p != Default::default());
        let slots = std::array::from_fn(|f| (all[f].carrier, all[f].component));
        let mut number = [[None; 4]; N];
        for (f, &(carrier, component)) in slots.iter().enumerate() {
            number[carrier][component] = Some(f as u8);
        }
        // A linear polynomial is the sum of its values at the vertices, each with its λ.
        let corner = |b: usize| std::array::from_fn(|i| f64::from(u8::from(i == b)));
        let curl_slope = std::array::from_fn(|f| {
            std::array::from_fn(|b| std::array::from_fn(|p| curls[f][p].value(&corner(b))))
        });
        let rotational = curls.iter().filter(turns).count();
        let mut shape = Self { all, curls, slots, rotational, number, curl_slope, tables: Vec::new() };
        let of_rule =
            |rule: Rule| rule.nodes().iter().map(|(lambda, share)| shape.at(lambda, *share)).collect();
        shape.tables = Rule::ALL.map(of_rule).into();
        shape
    }

    fn at(&self, lambda: &[f64; 4], share: f64) -> At<M> {
        At {
            share,
            along: std::array::from_fn(|f| std::array::from_fn(|n| self.all[f].along[n].value(lambda))),
            curl: std::array::from_fn(|f| std::array::from_fn(|p| self.curls[f][p].value(lambda))),
        }
    }

    /// Carrier, component, value [1/m] and curl [1/m²] of every function at a point given by the ascending coordinates.
    pub(crate) fn functions_at(
        &self,
        tet: &Ascending,
        lambda: &[f64; 4],
    ) -> impl Iterator<Item = (usize, usize, Point, Point)> {
        let at = self.at(lambda, 1.0);
        let values: [(Point, Point); M] = std::array::from_fn(|f| {
            (combine(&at.along[f], &tet.gradients), combine(&at.curl[f], &tet.products))
        });
        let slots = self.slots;
        (0..M).map(move |f| (slots[f].0, slots[f].1, values[f].0, values[f].1))
    }

    /// The curl [1/m²] of every rotational function at the points of a rule: point, carrier, component, curl.
    pub(crate) fn each_curl(
        &self,
        tet: &Ascending,
        rule: Rule,
        each: &mut dyn FnMut(usize, usize, usize, Point),
    ) {
        for (point, at) in self.tables[rule as usize].iter().enumerate() {
            for (f, &(carrier, component)) in self.slots.iter().enumerate().take(self.rotational) {
                each(point, carrier, component, combine(&at.curl[f], &tet.products));
            }
        }
    }

    /// The fields of given coefficients, by carrier and component, at the points of a rule, with the shares.
    #[inline]
    fn fields<'a>(
        &'a self,
        rule: Rule,
        tet: &'a Ascending,
        coefficients: &'a [[c64; 4]],
    ) -> impl Iterator<Item = (f64, FieldPoint)> + 'a {
        self.tables[rule as usize].iter().map(|at| (at.share, self.field(at, tet, coefficients)))
    }

    #[inline]
    fn field(&self, at: &At<M>, tet: &Ascending, coefficients: &[[c64; 4]]) -> FieldPoint {
        let (mut along, mut curl) = ([c64::default(); 4], [c64::default(); 6]);
        for (f, &(carrier, component)) in self.slots.iter().enumerate() {
            let u = coefficients[carrier][component];
            for (sum, p) in along.iter_mut().zip(&at.along[f]) {
                *sum += *p * u;
            }
            if f < self.rotational {
                for (sum, c) in curl.iter_mut().zip(&at.curl[f]) {
                    *sum += *c * u;
                }
            }
        }
        FieldPoint::of_edges(combine_complex(&along, &tet.gradients), combine_complex(&curl, &tet.products))
    }

    /// The rule that integrates a product of two curls.
    pub(super) fn curl_rule(&self) -> Rule {
        if N == 6 { Rule::Centroid } else { Rule::Degree2 }
    }

    /// The rule that integrates a product of two functions.
    pub(super) fn value_rule(&self) -> Rule {
        if N == 6 { Rule::Degree2 } else { Rule::Degree5 }
    }

    /// The field at a point given by the ascending coordinates.
    pub(crate) fn field_at(
        &self,
        tet: &Ascending,
        lambda: &[f64; 4],
        coefficients: &[[c64; 4]],
    ) -> FieldPoint {
        self.field(&self.at(lambda, 1.0), tet, coefficients)
    }

    /// The field at one of the ascending vertices.
    pub(crate) fn at_vertex(&self, tet: &Ascending, vertex: usize, coefficients: &[[c64; 4]]) -> FieldPoint {
        self.field(&self.tables[Rule::Vertices as usize][vertex], tet, coefficients)
    }

    /// The field at the centroid.
    pub(crate) fn at_centroid(&self, tet: &Ascending, coefficients: &[[c64; 4]]) -> FieldPoint {
        self.field(&self.tables[Rule::Centroid as usize][0], tet, coefficients)
    }
}

/// `Σ_k f_k v_k`.
#[inline]
fn combine<const K: usize>(factors: &[f64; K], vectors: &[Point; K]) -> Point {
    let mut sum = [0.0; 3];
    for (f, v) in factors.iter().zip(vectors) {
        for d in 0..3 {
            sum[d] += f * v[d];
        }
    }
    sum
}

/// `Σ_k f_k v_k` with complex factors.
#[inline]
fn combine_complex<const K: usize>(factors: &[c64; K], vectors: &[Point; K]) -> Complex3 {
    let mut sum = [c64::default(); 3];
    for (f, v) in factors.iter().zip(vectors) {
        for d in 0..3 {
            sum[d] += *f * v[d];
        }
    }
    sum
}
