//! Functions of the terms of an expansion of B around an axis or a point that does not move.
//!
//! The field at the points is the recovered one, linear in the potentials; where the mesh moves through them the one that is
//! continuous then ([`crate::recovery::FixedPlaces`]). A point beyond a symmetry plane has the field of its
//! image. On a flux-parallel plane B has no component across it, on a flux-normal one none along it: mirrored, that component
//! changes its sign.

use std::borrow::Cow;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::locate::{holders, locate};
use fluxmorph_geometry::tet4::{Point, centroid, norm, sub};
use fluxmorph_geometry::{ElementId, Mesh};

use super::{Follow, FunctionalValue};
use crate::coil::{Coil, CoilShape};
use crate::element::Complex3;
use crate::elements::Order;
use crate::error::{PointsOf, SolverError};
use crate::model::FieldModel;
use crate::multipole::{Domain, Expansion, Harmonic};
use crate::recovery::{BlendedField, FixedPlaces, RecoveredPoint};
use crate::solution::FieldState;

/// Places between the centre of an expansion and each of its points, as shares of the way, at which matter is looked for.
const WITHIN: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// What bends the field by less than this share of it disturbs no expansion.
const LIKE_AIR: f64 = 1e-3;

/// A symmetry plane at right angles to an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MirrorPlane {
    /// The axis: 0, 1 or 2.
    pub axis: usize,
    /// Its coordinate [m].
    pub at: f64,
    /// Factor on the component of B across the plane in the image: −1 for a flux-parallel one, +1 for a flux-normal one.
    pub across: f64,
}

/// The terms of an expansion as linear functions of the field of a model.
#[derive(Clone, Debug)]
pub struct Multipoles {
    places: Places,
    /// Weights as of [`Expansion::terms`], of the fields at the images.
    terms: Vec<(Harmonic, Vec<Point>)>,
    domain: Domain,
}

/// Where the field is taken.
#[derive(Clone, Debug)]
enum Places {
    /// In elements that do not move, which hold each; recovered for elements of an order.
    Held { places: Vec<(Point, ElementId)>, order: Order, points: Vec<RecoveredPoint> },
    /// In whatever elements are there.
    InSpace(FixedPlaces),
}

/// The field of a state at them.
enum At<'a> {
    Held(Cow<'a, [RecoveredPoint]>),
    InSpace(Box<BlendedField<'a>>),
}

impl Places {
    fn at<'a>(&'a self, (model, mesh, solution): FieldState<'a>) -> Result<At<'a>, SolverError> {
        Ok(match self {
            Self::Held { order, points, .. } if *order == model.space().order() => {
                At::Held(Cow::Borrowed(points))
            }
            Self::Held { places, .. } => At::Held(Cow::Owned(recovered(places, model, mesh))),
            Self::InSpace(places) => At::InSpace(Box::new(places.field((model, mesh, solution))?)),
        })
    }
}

impl At<'_> {
    fn flux_densities(&self, state: FieldState<'_>) -> Vec<Complex3> {
        match self {
            Self::Held(points) => points.iter().map(|point| point.flux_density(state)).collect(),
            Self::InSpace(field) => field.flux_densities(),
        }
    }
}

/// Share of the largest term of an expansion up to which its main order is rounding, or the error of the linear solver.
const LEAST_MAIN: f64 = 1e-9;

/// Content [1] up to which all of it is rounding: 1e-14 of the main order.
const ROUNDING: f64 = 1e-28;

/// The main terms of an expansion with their coefficients in a field.
pub(super) struct MainField {
    domain: Domain,
    terms: Vec<(Harmonic, c64)>,
}

impl MainField {
    pub(super) fn domain(&self) -> &Domain {
        &self.domain
    }

    /// What is left of a field without them, as [`Domain::remainder`].
    pub(super) fn remainder(&self, place: Point, b: [c64; 3]) -> [Option<c64>; 2] {
        self.domain.remainder(&self.terms, place, b)
    }
}

/// What is made of some terms.
#[derive(Clone, Debug, PartialEq)]
pub enum OfTerms {
    /// The first of them [T]: its value in statics, its magnitude in harmonics.
    Coefficient(Harmonic),
    /// `Σ |c|²` over terms, relative to that over `main` [1].
    Content {
        /// The terms that are summed.
        terms: Vec<Harmonic>,
        /// What they are compared with.
        main: Vec<Harmonic>,
    },
}

/// A function of terms of an expansion.
#[derive(Clone, Debug)]
pub struct MultipoleFunctional {
    multipoles: Multipoles,
    of: OfTerms,
}

impl Multipoles {
    /// Of an expansion with its name, in elements that do not move or (`Follow::Space`) while the mesh moves through its points;
    /// points outside the mesh are sought beyond the planes.
    ///
    /// # Errors
    /// [`SolverError::PointOutside`] for the first point that no element holds, and no element the image of.
    pub fn new(
        model: &FieldModel,
        mesh: &Mesh,
        name: &str,
        expansion: &Expansion,
        (planes, follow): (&[MirrorPlane], Follow),
    ) -> Result<Self, SolverError> {
        let candidates: Vec<Vec<(Point, Point)>> =
            expansion.points.iter().map(|&x| images(x, planes)).collect();
        let all: Vec<Point> = candidates.iter().flatten().map(|(x, _)| *x).collect();
        let found = locate(mesh, &all);
        let count = 1usize << planes.len();
        let mut places = Vec::with_capacity(candidates.len());
        let mut factors = Vec::with_capacity(candidates.len());
        for (k, own) in candidates.iter().enumerate() {
            let hit = (0..count).find_map(|i| Some((i, found[k * count + i]?.0)));
            let Some((image, element)) = hit else {
                let [lower, upper] = mesh.bounding_box();
                let (wanted_by, point) = (PointsOf::Expansion(name.to_owned()), expansion.points[k]);
                return Err(SolverError::PointOutside { wanted_by, point, lower, upper });
            };
            places.push((own[image].0, element));
            factors.push(own[image].1);
        }
        let mirrored = |weights: &[Point]| -> Vec<Point> {
            let of = |(w, f): (&Point, &Point)| std::array::from_fn(|d| w[d] * f[d]);
            weights.iter().zip(&factors).map(of).collect()
        };
        let terms = expansion.terms.iter().map(|(term, weights)| (*term, mirrored(weights))).collect();
        let places = match follow {
            Follow::Space => Places::InSpace(FixedPlaces::new(mesh, places)),
            Follow::Held | Follow::Mesh => {
                let points = recovered(&places, model, mesh);
                Places::Held { places, order: model.space().order(), points }
            }
        };
        Ok(Self { places, terms, domain: expansion.domain })
    }

    /// What a place holds that is in no element, nor is any image of it in the planes of an expansion.
    pub const NOWHERE: &str = "a hole in the mesh, or what is beyond an oblique plane of symmetry";

    /// The first place of an expansion where B is not the field of sources outside it in one of some states, and what is there: of
    /// a ball anywhere in it, of a circle on it. The terms would be those of no field there.
    pub fn disturbance(
        states: &[FieldModel],
        mesh: &Mesh,
        expansion: &Expansion,
        planes: &[MirrorPlane],
    ) -> Option<(Point, &'static str)> {
        let domain = &expansion.domain;
        let matter_at = |element: ElementId, x: Point| {
            states.iter().find_map(|state| matter_at(state, domain, element, x)).map(|what| (x, what))
        };
        let centre = domain.centre();
        let on_the_way =
            |x: Point, share: f64| std::array::from_fn(|d| centre[d] + share * (x[d] - centre[d]));
        let shares = if domain.is_ball() { &WITHIN[..] } else { &[1.0] };
        let sampled =
            expansion.points.iter().flat_map(|&x| shares.iter().map(move |&share| on_the_way(x, share)));
        let sampled: Vec<Point> = sampled.collect();
        let candidates: Vec<Point> =
            sampled.iter().flat_map(|&x| images(x, planes)).map(|(x, _)| x).collect();
        let mut held: Vec<Vec<(Point, ElementId)>> = vec![Vec::new(); sampled.len()];
        for (i, (element, _)) in holders(mesh, &candidates) {
            held[i >> planes.len()].push((candidates[i], element));
        }
        let at_points = || {
            sampled.iter().zip(&held).find_map(|(&place, held)| {
                // On a face either side may be meant: it must be on both.
                let on_all = held.iter().map(|&(x, element)| matter_at(element, x)).reduce(Option::and);
                on_all.unwrap_or(Some((place, Self::NOWHERE)))
            })
        };
        let inside = || {
            let elements = mesh.topology().elements();
            let mut met = elements.filter(|&e| domain.is_ball() && domain.meets(mesh.vertices(e)));
            met.find_map(|e| {
                let middle = centroid(mesh.vertices(e));
                matter_at(e, middle).or_else(|| wound_place(states, domain, mesh.vertices(e)))
            })
        };
        at_points().or_else(inside)
    }

    /// Elements that must not move.
    pub fn elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        let held = match &self.places {
            Places::Held { points, .. } => points.as_slice(),
            Places::InSpace(_) => &[],
        };
        held.iter().flat_map(RecoveredPoint::elements)
    }

    /// The coefficients [T] of a field.
    ///
    /// # Errors
    /// [`SolverError::Covered`] for a place that something which moves has reached.
    pub fn coefficients(&self, state: FieldState<'_>) -> Result<Vec<(Harmonic, c64)>, SolverError> {
        Ok(self.coefficients_of(&self.places.at(state)?.flux_densities(state)))
    }

    /// Of the fields [T] at the places.
    fn coefficients_of(&self, fields: &[Complex3]) -> Vec<(Harmonic, c64)> {
        let sum = |weights: &[Point]| -> c64 {
            let dot = |(w, b): (&Point, &[c64; 3])| (0..3).map(|d| w[d] * b[d]).sum::<c64>();
            weights.iter().zip(fields).map(dot).sum()
        };
        self.terms.iter().map(|(term, weights)| (*term, sum(weights))).collect()
    }
}

/// The field at places, recovered for elements of the order of a model.
fn recovered(places: &[(Point, ElementId)], model: &FieldModel, mesh: &Mesh) -> Vec<RecoveredPoint> {
    places.iter().map(|&(x, e)| RecoveredPoint::new(model, mesh, e, x)).collect()
}

/// A point and its images in all combinations of planes, itself first, with the factors on the components of B there.
fn images(x: Point, planes: &[MirrorPlane]) -> Vec<(Point, Point)> {
    let combinations = (0..1usize << planes.len()).map(|bits| {
        let through = planes.iter().enumerate().filter(|(k, _)| bits >> k & 1 == 1);
        through.fold((x, [1.0; 3]), |(mut x, mut factors), (_, plane)| {
            x[plane.axis] = 2.0 * plane.at - x[plane.axis];
            // In a flux-normal plane the image has the components along it reversed: minus one in all, and across it.
            let along = -plane.across;
            (0..3).for_each(|d| factors[d] *= if d == plane.axis { plane.across } else { along });
            (x, factors)
        })
    });
    combinations.collect()
}

/// The coils that a current flows in.
fn fed(state: &FieldModel) -> impl Iterator<Item = &Coil> {
    let numbered = state.coils().iter().enumerate().filter(|(k, coil)| {
        let winding = state.setup().windings.get(*k).and_then(Option::as_ref);
        coil.ampere_turns != c64::default() || winding.is_some_and(|winding| winding.voltage.is_some())
    });
    numbered.map(|(_, coil)| coil)
}

const WOUND: &str = "a winding with a current";

/// A place of a ball in an element at which the current of an analytic coil flows, however thin its winding.
fn wound_place(
    states: &[FieldModel],
    domain: &Domain,
    vertices: [Point; 4],
) -> Option<(Point, &'static str)> {
    let coils = states.iter().flat_map(fed);
    let mut places = coils.filter_map(|coil| match &coil.shape {
        CoilShape::Racetrack(shape) => shape.wound_place(vertices),
        CoilShape::Region(_) | CoilShape::Solid(_) => None,
    });
    let place = places.find(|&x| norm(sub(x, domain.centre())) < domain.radius())?;
    Some((place, WOUND))
}

/// What there is at a point of an element but air.
fn matter_at(state: &FieldModel, domain: &Domain, element: ElementId, x: Point) -> Option<&'static str> {
    let is_wound = |coil: &Coil| match &coil.shape {
        CoilShape::Racetrack(shape) => shape.current_density(x) != [0.0; 3],
        CoilShape::Region(_) | CoilShape::Solid(_) => coil.shape.flows_in(element),
    };
    let material = state.materials()[state.topology().region_of()[element.index()].index()];
    // Of eddy currents the field is off by the square of the radius in skin depths.
    let depth = material.skin_depth(state.angular_frequency()).filter(|_| state.has_eddy_currents(element));
    let is_shielded = |depth: f64| (domain.radius() / depth).powi(2) > LIKE_AIR;
    if fed(state).any(is_wound) {
        Some(WOUND)
    } else if state.remanence_of(element) != [0.0; 3] {
        Some("a magnet")
    } else if state.curve_of(element).is_some() || (material.relative_permeability - 1.0).abs() > LIKE_AIR {
        Some("a material with another permeability than air")
    } else if depth.is_some_and(is_shielded) {
        Some("a conductor with eddy currents")
    } else {
        state.is_open(element).then_some("the shell of open space")
    }
}

impl MultipoleFunctional {
    pub(super) fn new(multipoles: Multipoles, of: OfTerms) -> Result<Self, SolverError> {
        let wanted: Vec<Harmonic> = match &of {
            OfTerms::Coefficient(term) => vec![*term],
            OfTerms::Content { terms, main } => terms.iter().chain(main).copied().collect(),
        };
        let known = |term: &&Harmonic| multipoles.terms.iter().any(|(own, _)| own == *term);
        if let Some(missing) = wanted.iter().find(|term| !known(term)) {
            let (value, expected) =
                (format!("{missing:?}"), "one up to the order of the expansion, of its kind");
            return Err(SolverError::parameter("term of an expansion", value, expected));
        }
        Ok(Self { multipoles, of })
    }

    pub(super) fn elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        self.multipoles.elements()
    }

    /// What the content is compared with; `None` for a single coefficient.
    pub(super) fn main_field(&self, state: FieldState<'_>) -> Option<MainField> {
        let OfTerms::Content { main, .. } = &self.of else { return None };
        let mut terms = self.multipoles.coefficients(state).ok()?;
        terms.retain(|(term, _)| main.contains(term));
        Some(MainField { domain: self.multipoles.domain, terms })
    }

    pub(super) fn check_places(&self, model: &FieldModel, mesh: &Mesh) -> Result<(), SolverError> {
        match &self.multipoles.places {
            Places::InSpace(places) => places.locate(model, mesh).map(|_| ()),
            Places::Held { .. } => Ok(()),
        }
    }

    pub(super) fn evaluate(&self, state: FieldState<'_>) -> Result<FunctionalValue, SolverError> {
        let (model, mesh, _) = state;
        let at = self.multipoles.places.at(state)?;
        let fields = at.flux_densities(state);
        let coefficients = self.multipoles.coefficients_of(&fields);
        if let OfTerms::Content { main, .. } = &self.of {
            check_main(main, &coefficients)?;
        }
        let (value, slopes) = self.value(&coefficients, model.angular_frequency());
        let mut by_fields = vec![[c64::default(); 3]; fields.len()];
        for ((_, weights), slope) in self.multipoles.terms.iter().zip(&slopes) {
            for (q, weight) in by_fields.iter_mut().zip(weights) {
                (0..3).for_each(|d| q[d] += slope * weight[d]);
            }
        }
        let mut derivative = vec![c64::default(); model.unknown_count()];
        let explicit = match at {
            At::Held(points) => {
                for (point, q) in points.iter().zip(by_fields) {
                    point.add_derivative(q, model, mesh, &mut derivative);
                }
                None
            }
            At::InSpace(field) => {
                let mut by_positions = vec![[0.0; 3]; mesh.points().len()];
                field.add_derivatives(&by_fields, (&mut derivative, &mut by_positions));
                Some(by_positions)
            }
        };
        Ok(FunctionalValue { value, derivative, explicit, ..Default::default() })
    }

    /// The value, and its derivative `s` by every coefficient: `dF = 2 Re Σ s dc`.
    fn value(&self, coefficients: &[(Harmonic, c64)], omega: f64) -> (f64, Vec<c64>) {
        let zero = c64::default();
        match &self.of {
            OfTerms::Coefficient(wanted) => {
                let of = |term: &Harmonic, c: c64| match (term == wanted, omega == 0.0, c == zero) {
                    (false, _, _) => (0.0, zero),
                    (true, true, _) => (c.re, c64::new(0.5, 0.0)),
                    // A kink, where zero prefers no side.
                    (true, false, true) => (0.0, zero),
                    (true, false, false) => (c.norm(), 0.5 * c.conj() / c.norm()),
                };
                let parts: Vec<_> = coefficients.iter().map(|(term, c)| of(term, *c)).collect();
                (parts.iter().map(|(value, _)| value).sum(), parts.iter().map(|(_, slope)| *slope).collect())
            }
            OfTerms::Content { terms, main } => {
                let reference = square(main, coefficients);
                let content = content(terms, coefficients, reference);
                if content == 0.0 {
                    return (0.0, vec![zero; coefficients.len()]);
                }
                let slope = |(term, c): &(Harmonic, c64)| {
                    let own = if terms.contains(term) { 1.0 } else { 0.0 };
                    let compared = if main.contains(term) { content } else { 0.0 };
                    c.conj() * ((own - compared) / reference)
                };
                (content, coefficients.iter().map(slope).collect())
            }
        }
    }
}

/// The largest term of the main order, and the largest of all beside which it is nothing but rounding; `None` where it is more.
pub fn rounding_of_main<'a>(
    main: &[Harmonic],
    coefficients: &'a [(Harmonic, c64)],
) -> Option<[&'a (Harmonic, c64); 2]> {
    let size = |(_, c): &&(Harmonic, c64)| c.norm();
    let by_size = |a: &&(Harmonic, c64), b: &&(Harmonic, c64)| size(a).total_cmp(&size(b));
    let largest = coefficients.iter().max_by(by_size)?;
    let of_main = coefficients.iter().filter(|(term, _)| main.contains(term)).max_by(by_size)?;
    let is_more = size(&of_main) > LEAST_MAIN * size(&largest) || size(&largest) == 0.0;
    (!is_more).then_some([of_main, largest])
}

/// Refuses a content that is compared with nothing but rounding.
fn check_main(main: &[Harmonic], coefficients: &[(Harmonic, c64)]) -> Result<(), SolverError> {
    let Some([of_main, largest]) = rounding_of_main(main, coefficients) else { return Ok(()) };
    let of = |(term, c): &(Harmonic, c64)| format!("{:.1e} T of {term}", c.norm());
    Err(SolverError::parameter(
        "the main order of an expansion",
        format!("{} beside {}", of(of_main), of(largest)),
        "an order that the field has, as the others are compared with it; planes of symmetry may forbid one",
    ))
}

/// `Σ |c|²` of some terms over that of the main order [1]; terms that symmetry forbids have zero.
fn content(terms: &[Harmonic], coefficients: &[(Harmonic, c64)], reference: f64) -> f64 {
    let content = square(terms, coefficients) / reference;
    if content < ROUNDING { 0.0 } else { content }
}

/// `Σ |c|²` of some terms.
fn square(terms: &[Harmonic], coefficients: &[(Harmonic, c64)]) -> f64 {
    coefficients.iter().filter(|(term, _)| terms.contains(term)).map(|(_, c)| c.norm_sqr()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quadrupole whose main order was left at that of a dipole, and what symmetry forbids in it.
    #[test]
    fn nothing_is_compared_with_rounding_and_rounding_is_no_content() {
        let field = [
            (Harmonic::Normal(1), c64::new(-1.5e-16, 0.0)),
            (Harmonic::Normal(2), c64::new(-0.634, 0.0)),
            (Harmonic::Normal(6), c64::new(6e-5, 0.0)),
        ];
        let error = check_main(&[Harmonic::Normal(1)], &field).expect_err("rounding").to_string();
        assert!(error.contains("1.5e-16 T of b1 beside 6.3e-1 T of b2"), "{error}");
        let main = [Harmonic::Normal(2), Harmonic::Skew(2)];
        check_main(&main, &field).expect("it has one");
        check_main(&main, &[(Harmonic::Normal(2), c64::default())]).expect("there is no field at all");
        let reference = square(&main, &field);
        assert_eq!(content(&[Harmonic::Normal(1)], &field, reference), 0.0);
        let found = content(&[Harmonic::Normal(6)], &field, reference);
        assert!((found / (6e-5f64 / 0.634).powi(2) - 1.0).abs() < 1e-12, "{found}");
    }
}
