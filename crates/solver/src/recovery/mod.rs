//! Flux density at points: the curl of a polynomial fitted to the potentials around.
//!
//! `B` of linear elements is constant in each and of first order. The potentials at the nodes are of second order, so
//! the curl of a quadratic fitted to them (of quadratic elements: of a cubic) is better by one order where the mesh is
//! regular, and it stays so beside a
//! symmetry plane or a material's face, where all elements lie on one side and a mean of their `B` would not
//! (polynomial-preserving recovery; Zhang and Naga, SIAM J. Sci. Comput. 26 (2005) 1192). Across a material boundary
//! the true field jumps, and at the face of a winding its slope does, so only elements of the probed element's material and coil
//! take part.
//!
//! At a symmetry plane the patch goes on with its images (`mirror`), so that part of a device has the values of the whole.
//!
//! A recovered value is linear in the field: [`RecoveredPoint`] holds its weights, for values and for derivatives.
//!
//! Edge elements have no potentials at nodes, and their gauge leaves `A` rough: there a polynomial is fitted to `B` itself at
//! the points of elements where it is best (Zienkiewicz and Zhu, Int. J. Numer. Methods Eng. 33 (1992) 1331).

mod fit;
mod mirror;
mod places;
mod plane;
mod symmetry;

use std::collections::BTreeSet;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::locate::locate;
use fluxmorph_geometry::tet4::{Point, norm, sub};
use fluxmorph_geometry::{CarrierId, ElementId, Mesh};
use rayon::prelude::*;

use crate::element::Complex3;
use crate::element::quadrature::Node;
use crate::element::tabulated::Rule;
use crate::elements::{ElementFamily, Order};
use crate::error::{PointsOf, SolverError};
use crate::model::FieldModel;
use crate::solution::FieldState;
use fit::Fit;
pub(crate) use mirror::Walls;
use mirror::{Image, Mirrors};
pub(crate) use places::{BlendedField, FixedPlaces};
pub(crate) use plane::Plane;

/// How fast the weight of a node falls, and that of a point within an element ([`Fit::new`]): most nodes lie on the rim of a patch,
/// and where it lies to one side of the point, values of `B` far from it keep a fit from swinging there. Of the values from
/// 0.2 to 1.5 the best around a sphere in a field, on the axes of coils, behind the paper's plate and at the end of a mesh.
fn of_nodes(order: Order) -> f64 {
    match order {
        Order::Linear => 1.0,
        // A cubic needs more of them.
        Order::Quadratic => 1.0 / 2.0,
    }
}

/// See [`of_nodes`].
const OF_SAMPLES: f64 = 1.0 / 3.0;

/// The recovered flux density at a point of an element as a linear function of the field, on one mesh.
///
/// `A` at the nodes of all elements that share a vertex with `element` and have its material, fitted by least squares with a
/// polynomial of one degree more than that of the elements; of edge elements `B` in them, with one of their degree. A further
/// layer of elements where these do not determine it; with their images where they lie at a symmetry plane.
/// In a part of the material too small for any fit, the element's own mean.
#[derive(Clone, Debug)]
pub struct RecoveredPoint {
    elements: BTreeSet<ElementId>,
    /// `B = Σ T B_i` over the elements themselves and their images.
    images: Vec<([Point; 3], Weights)>,
}

/// What a recovered value adds up of the elements themselves, or of one image.
#[derive(Clone, Debug)]
enum Weights {
    /// `B = Σ g × A` over nodes with `g` [1/m].
    Potentials(Vec<(CarrierId, Point)>),
    /// `B = Σ w B` over points of elements.
    FluxDensities(Vec<(ElementId, [f64; 4], f64)>),
}

impl RecoveredPoint {
    /// At a point of an element.
    pub fn new(model: &FieldModel, mesh: &Mesh, element: ElementId, point: Point) -> Self {
        let is_alike = has_the_material_of(model, element);
        let mut mirrors = Mirrors::new(model, element);
        let own = BTreeSet::from([(0, element)]);
        let start = |mirrors: &mut Mirrors| mirrors.around((model, mesh), &own, &is_alike);
        let fitted = |members: &BTreeSet<(Image, ElementId)>, mirrors: &Mirrors| {
            let images = match model.space().family() {
                ElementFamily::Nodal => of_potentials(model, mesh, (members, mirrors), (element, point)),
                ElementFamily::Edge => of_flux_densities(model, mesh, (members, mirrors), point),
            };
            Some(Self { elements: members.iter().map(|(_, e)| *e).collect(), images: images? })
        };
        mirrors.fit((model, mesh), &is_alike, start, fitted).unwrap_or_else(|| {
            let mean = Weights::FluxDensities(vec![(element, [0.25; 4], 1.0)]);
            Self { elements: BTreeSet::from([element]), images: vec![(mirrors.turn(0), mean)] }
        })
    }

    /// The elements that take part, ascending.
    pub fn elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        self.elements.iter().copied()
    }

    /// `B` [T] there.
    pub fn flux_density(&self, (model, mesh, solution): FieldState<'_>) -> Complex3 {
        let mut sum = [c64::default(); 3];
        for (turn, weights) in &self.images {
            let part = turned(turn, weights.flux_density((model, mesh, solution)));
            (0..3).for_each(|d| sum[d] += part[d]);
        }
        sum
    }

    /// Adds `∂(q·B)/∂u` to a vector of unknowns.
    pub(crate) fn add_derivative(
        &self,
        q: Complex3,
        model: &FieldModel,
        mesh: &Mesh,
        derivative: &mut [c64],
    ) {
        for (turn, weights) in &self.images {
            weights.add_derivative(turned(turn, q), model, mesh, derivative);
        }
    }
}

/// `Tv` of a symmetric matrix.
fn turned(t: &[Point; 3], v: Complex3) -> Complex3 {
    t.map(|row| (0..3).map(|d| row[d] * v[d]).sum())
}

impl Weights {
    fn flux_density(&self, (model, mesh, solution): FieldState<'_>) -> Complex3 {
        let mut sum = [c64::default(); 3];
        match self {
            Self::Potentials(nodes) => {
                for (node, g) in nodes {
                    let [a, b, c, _] = solution.potentials(model, *node);
                    sum[0] += g[1] * c - g[2] * b;
                    sum[1] += g[2] * a - g[0] * c;
                    sum[2] += g[0] * b - g[1] * a;
                }
            }
            Self::FluxDensities(points) => {
                for (e, lambda, weight) in points {
                    let b = solution.at(model, mesh, *e, lambda).flux_density;
                    (0..3).for_each(|d| sum[d] += *weight * b[d]);
                }
            }
        }
        sum
    }

    fn add_derivative(&self, q: Complex3, model: &FieldModel, mesh: &Mesh, derivative: &mut [c64]) {
        match self {
            Self::Potentials(nodes) => {
                for (node, g) in nodes {
                    // q·(g × A) = (q × g)·A.
                    let components = [
                        q[1] * g[2] - q[2] * g[1],
                        q[2] * g[0] - q[0] * g[2],
                        q[0] * g[1] - q[1] * g[0],
                        c64::default(),
                    ];
                    model.unknowns().scatter_add(derivative, *node, components);
                }
            }
            Self::FluxDensities(points) => {
                for (e, lambda, weight) in points {
                    scatter_flux((model, mesh), (*e, lambda), q.map(|c| *weight * c), derivative);
                }
            }
        }
    }
}

/// Whether elements have the material of one and are of the same coil: a magnet's face is one even where its permeability is that of
/// air, that of open space is one of the map, and at that of a winding the slope of `B` jumps.
fn has_the_material_of(model: &FieldModel, element: ElementId) -> impl Fn(ElementId) -> bool {
    let topology = model.topology();
    let material = move |e: ElementId| {
        let linear = model.materials()[topology.region_of()[e.index()].index()];
        let is_open = model.form().stretch_of(e).is_some();
        (linear, model.remanence_of(e), model.curve_of(e), is_open, model.coil_at(e))
    };
    let own = material(element);
    move |e| material(e) == own
}

/// Points of an element of an order at which `B` is of one order better: the centroid, or the four of the rule of degree 2.
fn superconvergent(order: Order) -> &'static [Node] {
    match order {
        Order::Linear => Rule::Centroid.nodes(),
        Order::Quadratic => Rule::Degree2.nodes(),
    }
}

/// The superconvergent points of some elements and images.
fn samples_in<'e>(
    order: Order,
    members: impl IntoIterator<Item = &'e (Image, ElementId)>,
) -> Vec<(Image, ElementId, &'static [f64; 4])> {
    let rule = superconvergent(order);
    let of_member = |&(image, e)| rule.iter().map(move |(lambda, _)| (image, e, lambda));
    members.into_iter().flat_map(of_member).collect()
}

/// Adds `∂(q·B)/∂u` at a point of an element to a vector of unknowns.
pub(crate) fn scatter_flux(
    (model, mesh): (&FieldModel, &Mesh),
    (e, lambda): (ElementId, &[f64; 4]),
    q: Complex3,
    derivative: &mut [c64],
) {
    let (cell, carriers) = (model.space().cell(mesh, e), model.space().carriers_of(e));
    model.space().functions(&cell, lambda, &mut |carrier, component, _, curl| {
        let mut local = [c64::default(); 4];
        local[component] = (0..3).map(|d| q[d] * curl[d]).sum();
        model.unknowns().scatter_add(derivative, carriers[carrier], local);
    });
}

/// The recovered flux density [T] at a point of an element ([`RecoveredPoint`]).
pub fn recovered_flux_density(
    (model, mesh, solution): FieldState<'_>,
    element: ElementId,
    point: Point,
) -> Complex3 {
    RecoveredPoint::new(model, mesh, element, point).flux_density((model, mesh, solution))
}

/// The curl at a point of an element of the polynomial fitted to the potentials at the nodes of a patch.
///
/// Of an image with the places `Qx` the potential is `det(Q) TA`, and `g × det(Q) TA = T(Qg × A)`.
fn of_potentials(
    model: &FieldModel,
    mesh: &Mesh,
    (members, mirrors): (&BTreeSet<(Image, ElementId)>, &Mirrors),
    (element, point): (ElementId, Point),
) -> Option<Vec<([Point; 3], Weights)>> {
    let space = model.space();
    let reach = mesh.vertices(element).map(|x| norm(sub(x, point))).into_iter().fold(0.0, f64::max);
    let of_member = |&(image, e): &(Image, ElementId)| {
        let distinct = move |&n| (mirrors.distinct(image, space.position(mesh, n), reach), n);
        space.carriers_of(e).iter().map(distinct)
    };
    let nodes: BTreeSet<(Image, CarrierId)> = members.iter().flat_map(of_member).collect();
    let offset = |&(image, n)| sub(mirrors.place(image, space.position(mesh, n)), point);
    let offsets: Vec<Point> = nodes.iter().map(offset).collect();
    let gradients = Fit::new(space.order().degree() + 1, &offsets, of_nodes(space.order()))?.gradient();
    let weights = nodes.into_iter().zip(gradients);
    let weights = weights.map(|((image, n), g)| (image, (n, mirrors.direction(image, g))));
    Some(by_image(mirrors, weights, Weights::Potentials))
}

/// The value at a point of the polynomial fitted to the flux densities in a patch, taken where they are of one order better.
fn of_flux_densities(
    model: &FieldModel,
    mesh: &Mesh,
    (members, mirrors): (&BTreeSet<(Image, ElementId)>, &Mirrors),
    point: Point,
) -> Option<Vec<([Point; 3], Weights)>> {
    let order = model.space().order();
    let samples = samples_in(order, members);
    let weights =
        Fit::new(order.degree(), &places::offsets(mesh, mirrors, &samples, point), OF_SAMPLES)?.value();
    let weights = samples.into_iter().zip(weights).map(|((image, e, lambda), w)| (image, (e, *lambda, w)));
    Some(by_image(mirrors, weights, Weights::FluxDensities))
}

/// Weights that ascend by image, for each of them.
fn by_image<W>(
    mirrors: &Mirrors,
    weights: impl Iterator<Item = (Image, W)>,
    of: impl Fn(Vec<W>) -> Weights,
) -> Vec<([Point; 3], Weights)> {
    let mut images: Vec<(Image, Vec<W>)> = Vec::new();
    for (image, weight) in weights {
        match images.last_mut() {
            Some((last, weights)) if *last == image => weights.push(weight),
            _ => images.push((image, vec![weight])),
        }
    }
    images.into_iter().map(|(image, weights)| (mirrors.turn(image), of(weights))).collect()
}

/// The recovered flux density [T] at the points of a probe.
///
/// # Errors
/// [`SolverError::PointOutside`] for the first point that no element holds.
pub fn probe(
    (model, mesh, solution): FieldState<'_>,
    name: &str,
    points: &[Point],
) -> Result<Vec<Complex3>, SolverError> {
    let outside = |point: Point| {
        let [lower, upper] = mesh.bounding_box();
        SolverError::PointOutside { wanted_by: PointsOf::Probe(name.to_owned()), point, lower, upper }
    };
    let located = locate(mesh, points).into_iter().zip(points);
    let elements = located
        .map(|(found, &point)| found.map(|(e, _)| (e, point)).ok_or_else(|| outside(point)))
        .collect::<Result<Vec<(ElementId, Point)>, _>>()?;
    Ok(elements
        .into_par_iter()
        .map(|(e, point)| recovered_flux_density((model, mesh, solution), e, point))
        .collect())
}
