//! Flux density at places that stay where they are while the mesh moves through them.
//!
//! `B(x) = Σ_a λ_a(x) P_a(x)` over the vertices of the element that holds `x`, with `P_a` the polynomial fitted to `B` in the
//! elements around a vertex, of the degree of the elements: the blend of patches of Zienkiewicz and Zhu (Int. J. Numer. Methods
//! Eng. 33 (1992) 1331). As a place passes into the next element, the weight of the vertex that it leaves behind is zero: the
//! value is continuous in the positions of the nodes, and smooth while each place stays in its element; its derivative jumps there
//! by what neighbouring patches differ in, of the order of the element's own error. Which elements a patch has follows from the
//! topology and the mesh at the start, never from the design.

use std::collections::BTreeSet;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::locate::{Located, locate};
use fluxmorph_geometry::tet4::{Point, Tet4, point_at, sub};
use fluxmorph_geometry::{ElementId, Mesh, NodeId};
use rayon::prelude::*;

use super::fit::Fit;
use super::mirror::{Image, Mirrors};
use super::{has_the_material_of, samples_in, scatter_flux, superconvergent, turned};
use crate::element::quadrature::Node;
use crate::element::{Complex3, dot3};
use crate::error::SolverError;
use crate::model::FieldModel;
use crate::solution::FieldState;

/// Places in a mesh that moves.
#[derive(Clone, Debug)]
pub(crate) struct FixedPlaces {
    start: Mesh,
    /// With the element that holds each at the start.
    places: Vec<(Point, ElementId)>,
}

/// The field of a state at all of them, on one mesh.
pub(crate) struct BlendedField<'a> {
    state: FieldState<'a>,
    points: Vec<BlendedPoint>,
    samples: Samples,
}

/// `B` where patches take it: neighbouring ones share most of these points.
struct Samples {
    /// Points in each element.
    rule: &'static [Node],
    /// Elements with samples, ascending.
    elements: Vec<ElementId>,
    /// `B` [T] at the points of each, shape `(n_elements, n_points)`.
    values: Vec<Complex3>,
}

/// The field at one place as a linear function of samples.
struct BlendedPoint {
    element: ElementId,
    /// `λ_a` and `∇λ_a` [1/m].
    shares: [(f64, Point); 4],
    patches: [Patch; 4],
}

/// A polynomial fitted around a vertex to the samples in some elements.
struct Patch {
    /// With their images.
    members: Vec<(Image, ElementId)>,
    mirrors: Mirrors,
    fit: Fit,
    /// Of the samples in its value at the place.
    weights: Vec<f64>,
}

impl FixedPlaces {
    /// Places [m] with the elements that hold them on the mesh at the start.
    pub(crate) fn new(start: &Mesh, places: Vec<(Point, ElementId)>) -> Self {
        Self { start: start.clone(), places }
    }

    /// The element that holds each place now.
    ///
    /// # Errors
    /// [`SolverError::Covered`] for a place that something else than at the start has reached, and for one that the mesh has left.
    pub(crate) fn locate(&self, model: &FieldModel, mesh: &Mesh) -> Result<Vec<Located>, SolverError> {
        let points: Vec<Point> = self.places.iter().map(|(point, _)| *point).collect();
        let found = locate(mesh, &points).into_iter().zip(&self.places);
        let holder = |(found, &(place, home)): (Option<Located>, &(Point, ElementId))| {
            let covered = |by: String| SolverError::Covered { place, by };
            let (e, lambda) = found.ok_or_else(|| covered("what is not meshed".to_owned()))?;
            if !has_the_material_of(model, home)(e) {
                return Err(covered(format!("`{}`", model.topology().region_name_at(e))));
            }
            Ok((e, lambda))
        };
        found.map(holder).collect()
    }

    /// The field of a state at all of them.
    ///
    /// # Errors
    /// As [`FixedPlaces::locate`].
    pub(crate) fn field<'a>(
        &self,
        (model, mesh, solution): FieldState<'a>,
    ) -> Result<BlendedField<'a>, SolverError> {
        let located = self.locate(model, mesh)?;
        let blend = |(located, (point, _)): (&Located, &(Point, ElementId))| {
            self.blend(model, mesh, *located, *point)
        };
        let points: Vec<BlendedPoint> = located.par_iter().zip(&self.places).map(blend).collect();
        let patches = points.iter().flat_map(|point| &point.patches);
        let mut elements: Vec<ElementId> =
            patches.flat_map(|patch| patch.members.iter().map(|(_, e)| *e)).collect();
        elements.sort_unstable();
        elements.dedup();
        let rule = superconvergent(model.space().order());
        let of_element = |&e: &ElementId| {
            rule.iter().map(move |(lambda, _)| solution.at(model, mesh, e, lambda).flux_density)
        };
        let values = elements.par_iter().flat_map_iter(of_element).collect();
        Ok(BlendedField {
            state: (model, mesh, solution),
            points,
            samples: Samples { rule, elements, values },
        })
    }

    fn blend(
        &self,
        model: &FieldModel,
        mesh: &Mesh,
        (element, lambda): Located,
        point: Point,
    ) -> BlendedPoint {
        let gradients = Tet4::new(mesh.vertices(element)).gradients;
        let vertices = model.topology().tet(element);
        BlendedPoint {
            element,
            shares: std::array::from_fn(|a| (lambda[a], gradients[a])),
            patches: vertices.map(|vertex| self.patch(model, mesh, (element, vertex), point)),
        }
    }

    /// The patch around a vertex, as large as the mesh at the start needs it.
    fn patch(
        &self,
        model: &FieldModel,
        mesh: &Mesh,
        (element, vertex): (ElementId, NodeId),
        point: Point,
    ) -> Patch {
        let order = model.space().order();
        let is_alike = has_the_material_of(model, element);
        let start = (model, &self.start);
        let fitted = |members: &BTreeSet<(Image, ElementId)>, mirrors: &Mirrors, degree| {
            let samples = samples_in(order, members);
            Fit::even(degree, &offsets(&self.start, mirrors, &samples, self.start.point(vertex)))?;
            let fit = Fit::even(degree, &offsets(mesh, mirrors, &samples, point))?;
            let (members, mirrors) = (members.iter().copied().collect(), mirrors.clone());
            Some(Patch { members, mirrors, weights: fit.value(), fit })
        };
        let mut mirrors = Mirrors::new(model, element);
        let around = |mirrors: &mut Mirrors| mirrors.around_node(start, vertex, &is_alike);
        let patch = mirrors
            .fit(start, &is_alike, around, |members, mirrors| fitted(members, mirrors, order.degree()));
        // In a part too small for any fit, the mean of its own.
        let mean = || fitted(&BTreeSet::from([(0, element)]), &mirrors, 0);
        patch.or_else(mean).expect("one value determines a constant")
    }
}

/// Where samples lie [m], from a point.
pub(super) fn offsets(
    mesh: &Mesh,
    mirrors: &Mirrors,
    samples: &[(Image, ElementId, &[f64; 4])],
    origin: Point,
) -> Vec<Point> {
    let place = |(image, e, lambda): &(Image, ElementId, &[f64; 4])| {
        mirrors.place(*image, point_at(&mesh.vertices(*e), lambda))
    };
    samples.iter().map(|sample| sub(place(sample), origin)).collect()
}

impl BlendedField<'_> {
    /// `B` [T] at the places.
    pub(crate) fn flux_densities(&self) -> Vec<Complex3> {
        let at = |point: &BlendedPoint| {
            let part = |(patch, (lambda, _)): (&Patch, (f64, Point))| {
                patch.blend(&self.samples.of(patch)).map(|c| lambda * c)
            };
            let parts = point.patches.iter().zip(point.shares).map(part);
            parts.fold([c64::default(); 3], |sum, part| std::array::from_fn(|d| sum[d] + part[d]))
        };
        self.points.par_iter().map(at).collect()
    }

    /// Adds `∂(Σ_k q_k·B_k)/∂u` over the places to a vector of unknowns, and `2 Re ∂(Σ_k q_k·B_k)/∂x` [per m] at fixed potentials to
    /// one of nodes.
    pub(crate) fn add_derivatives(
        &self,
        q: &[Complex3],
        (by_potentials, by_positions): (&mut [c64], &mut [Point]),
    ) {
        let topology = self.state.0.topology();
        let mut by_samples = vec![[c64::default(); 3]; self.samples.values.len()];
        for (point, q) in self.points.iter().zip(q) {
            let vertices = topology.tet(point.element);
            for (patch, (lambda, gradient)) in point.patches.iter().zip(point.shares) {
                let values = self.samples.of(patch);
                let along = dot3(*q, patch.blend(&values));
                // The place stays: δλ_a = −∇λ_a · v, with v = λ_k d.
                for (node, (of_node, _)) in vertices.iter().zip(point.shares) {
                    let change = -2.0 * of_node * along.re;
                    (0..3).for_each(|d| by_positions[node.index()][d] += change * gradient[d]);
                }
                let own = q.map(|c| lambda * c);
                let along: Vec<c64> = values.iter().map(|b| dot3(own, *b)).collect();
                let by_points = patch.fit.value_by_points(&patch.weights, &along);
                for (((image, turn, place), weight), by_point) in
                    self.samples.places_of(patch).zip(&patch.weights).zip(by_points)
                {
                    let own = turned(&turn, own);
                    (0..3).for_each(|d| by_samples[place][d] += *weight * own[d]);
                    let (e, lambda) = self.samples.at(place);
                    let by_point = patch.mirrors.direction(image, by_point.map(|c| c.re));
                    for (a, node) in topology.tet(e).iter().enumerate() {
                        (0..3).for_each(|d| by_positions[node.index()][d] += 2.0 * lambda[a] * by_point[d]);
                    }
                }
            }
        }
        self.add_derivatives_of_samples(&by_samples, (by_potentials, by_positions));
    }

    /// Adds the derivatives of `Σ_k q_k·B_k` over the samples, which move with their elements.
    fn add_derivatives_of_samples(
        &self,
        q: &[Complex3],
        (by_potentials, by_positions): (&mut [c64], &mut [Point]),
    ) {
        let (model, mesh, solution) = self.state;
        let space = model.space();
        for (place, q) in q.iter().enumerate() {
            let (e, lambda) = self.samples.at(place);
            scatter_flux((model, mesh), (e, lambda), *q, by_potentials);
            let field = solution.element(model, e);
            let changes = space.elements().flux_change(&space.cell(mesh, e), lambda, field.values(), *q);
            for (a, node) in model.topology().tet(e).iter().enumerate() {
                (0..3).for_each(|d| by_positions[node.index()][d] += 2.0 * changes[a][d].re);
            }
        }
    }
}

impl Samples {
    /// The element and the barycentric coordinates of a sample.
    fn at(&self, place: usize) -> (ElementId, &'static [f64; 4]) {
        let count = self.rule.len();
        (self.elements[place / count], &self.rule[place % count].0)
    }

    /// The samples of a patch, each itself or an image, with what turns B there.
    fn places_of<'p>(&'p self, patch: &'p Patch) -> impl Iterator<Item = (Image, [Point; 3], usize)> + 'p {
        let count = self.rule.len();
        let of_member = move |&(image, e): &(Image, ElementId)| {
            let first = self.elements.binary_search(&e).expect("elements of all patches") * count;
            let turn = patch.mirrors.turn(image);
            (first..first + count).map(move |place| (image, turn, place))
        };
        patch.members.iter().flat_map(of_member)
    }

    /// `B` [T] at them.
    fn of(&self, patch: &Patch) -> Vec<Complex3> {
        self.places_of(patch).map(|(_, turn, place)| turned(&turn, self.values[place])).collect()
    }
}

impl Patch {
    /// `B` [T] at the place, of the values at the samples.
    fn blend(&self, values: &[Complex3]) -> Complex3 {
        std::array::from_fn(|d| values.iter().zip(&self.weights).map(|(b, w)| *w * b[d]).sum())
    }
}
