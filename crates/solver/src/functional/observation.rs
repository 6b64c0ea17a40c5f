//! Functions of the flux density in observation cells.
//!
//! Cells that do not move depend on the node positions through the field alone. Those that move with the mesh have an explicit
//! derivative: of `B` at a point of an element, of the elements' shares of a cell's mean and of volumes as weights. Where the
//! cells' places at the start are kept instead ([`Follow::Space`]), so are their weights, and the field is the one that is
//! continuous as the mesh moves through them ([`crate::recovery::FixedPlaces`]).

use std::collections::BTreeSet;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, point_at, volume as volume_of};
use fluxmorph_geometry::{ElementId, Mesh, RegionId};

use super::FunctionalValue;
use super::homogeneity::{Compared, FieldQuality, Spread};
use crate::element::quadrature::{self, Node};
use crate::element::{Complex3, amplitude, dot3};
use crate::elements::Order;
use crate::error::SolverError;
use crate::model::FieldModel;
use crate::recovery::{FixedPlaces, scatter_flux};
use crate::solution::FieldState;

/// How observation cells are weighted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weighting {
    /// One term per observation cell: `F = Σ_k B_k·B_k*` [T²], the paper's.
    Point,
    /// `F = ∫ B·B* dV` [T² m³].
    Volume,
}

/// What is made of the flux densities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Observed {
    /// `Σ_k w_k |B_k − B_target|²`; with the target zero, the squared flux density.
    Deviation {
        /// `B_target` [T]; real, so in harmonics the imaginary part of B is to vanish.
        target: Point,
        /// `w_k`.
        weighting: Weighting,
    },
    /// How unlike its mean the flux density is: `Σ w |b − b̄|² / Σ w |b̄|²` [1], the square of the relative rms deviation, for
    /// `b` the vector, a component or the modulus.
    Homogeneity {
        /// `b`.
        of: Compared,
        /// `w_k`.
        weighting: Weighting,
    },
    /// The volume mean of `B·d` [T]: its real value in statics, its magnitude in harmonics.
    Component {
        /// The unit vector `d`.
        direction: Point,
    },
}

/// What cells do where the mesh may move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Follow {
    /// Nothing: none of their nodes moves.
    Held,
    /// They move with it.
    Mesh,
    /// They stay, and the mesh moves through them; the field is recovered.
    Space,
}

/// A function of the mean flux densities `B_k` of cells.
#[derive(Clone, Debug)]
pub struct Observation {
    cells: Vec<Vec<ElementId>>,
    observed: Observed,
    follow: Follow,
    fixed: Option<FixedCells>,
}

/// Cells that stay: means over places in them.
#[derive(Clone, Debug)]
struct FixedCells {
    places: FixedPlaces,
    /// Number of places, and share of each in the mean; volume [m³].
    samples: Vec<(Vec<(usize, f64)>, f64)>,
}

/// `B` [T] of a cell, or at a point of each of its elements, and the volume [m³] that it stands for.
type Sample = (Complex3, f64);

/// A function of samples: its value, and its derivatives by every `B` (`dF = 2 Re(q·dB)`) and every volume.
struct OfSamples {
    value: f64,
    by_b: Vec<Complex3>,
    by_volume: Vec<f64>,
}

impl Observation {
    /// On the cells of a region: those that the mesh defines (point), each element (volume), or the region as one.
    ///
    /// # Errors
    /// [`SolverError::EmptyRegion`].
    pub fn new(
        mesh: &Mesh,
        region: RegionId,
        observed: Observed,
        follow: Follow,
    ) -> Result<Self, SolverError> {
        let topology = mesh.topology();
        let elements = topology.elements_of(region);
        if elements.is_empty() {
            return Err(SolverError::EmptyRegion {
                region: topology.region_names()[region.index()].clone(),
                expected: "the objective observes the field there",
            });
        }
        let cells = match observed {
            Observed::Component { .. } => vec![elements],
            Observed::Deviation { weighting, .. } | Observed::Homogeneity { weighting, .. } => {
                match weighting {
                    Weighting::Point => topology.cells_of(region),
                    Weighting::Volume => elements.into_iter().map(|e| vec![e]).collect(),
                }
            }
        };
        let fixed = match follow {
            Follow::Space => Some(FixedCells::new(mesh, &cells, observed)),
            Follow::Held | Follow::Mesh => None,
        };
        Ok(Self { cells, observed, follow, fixed })
    }

    /// Elements of the region.
    pub fn elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        self.cells.iter().flatten().copied()
    }

    /// Elements that must not move.
    pub(super) fn held_elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        self.elements().filter(|_| self.follow == Follow::Held)
    }

    /// Elements in which the field is observed on a mesh, each once.
    pub(super) fn elements_on(&self, model: &FieldModel, mesh: &Mesh) -> Vec<ElementId> {
        let Some(fixed) = &self.fixed else { return self.elements().collect() };
        let located = fixed.places.locate(model, mesh).unwrap_or_default();
        let holders: BTreeSet<ElementId> = located.into_iter().map(|(e, _)| e).collect();
        holders.into_iter().collect()
    }

    /// Whether what moves has left the observed places as they were.
    ///
    /// # Errors
    /// [`SolverError::Covered`].
    pub(super) fn check_places(&self, model: &FieldModel, mesh: &Mesh) -> Result<(), SolverError> {
        self.fixed.as_ref().map_or(Ok(()), |fixed| fixed.places.locate(model, mesh).map(|_| ()))
    }

    /// Mean flux density of every cell [T], shape `(n_cells, 3)`.
    pub fn cell_flux_densities(&self, state: FieldState<'_>) -> Vec<Complex3> {
        self.cells.iter().map(|cell| mean(cell, &[0.25; 4], 1.0, state).0).collect()
    }

    pub(super) fn evaluate(&self, state: FieldState<'_>) -> Result<FunctionalValue, SolverError> {
        let (model, mesh, _) = state;
        let mut derivative = vec![c64::default(); model.unknown_count()];
        let nodes = mesh.points().len();
        let mut explicit = (self.follow != Follow::Held).then(|| vec![[0.0; 3]; nodes]);
        let value = match (&self.fixed, &mut explicit) {
            (Some(fixed), Some(explicit)) => {
                let blended = fixed.places.field(state)?;
                let fields = blended.flux_densities();
                let of = self.of_samples(&fixed.means(&fields), model);
                let mut by_fields = vec![[c64::default(); 3]; fields.len()];
                for ((parts, _), by_b) in fixed.samples.iter().zip(&of.by_b) {
                    for &(place, share) in parts {
                        (0..3).for_each(|d| by_fields[place][d] += share * by_b[d]);
                    }
                }
                blended.add_derivatives(&by_fields, (&mut derivative, explicit));
                of.value
            }
            (_, explicit) => self.differentiate(state, &mut derivative, explicit.as_deref_mut()),
        };
        Ok(FunctionalValue { value, derivative, explicit, ..Default::default() })
    }

    /// The value in cells of the mesh, with its derivatives added to those by potentials and by positions.
    fn differentiate(
        &self,
        (model, mesh, solution): FieldState<'_>,
        derivative: &mut [c64],
        mut explicit: Option<&mut [Point]>,
    ) -> f64 {
        let samples = self.samples_of_cells((model, mesh, solution));
        let of = self.of_samples(&samples, model);
        let rule = self.rule(model.space().order());
        let places = self.cells.iter().flat_map(|c| rule.iter().map(move |q| (c, q)));
        for (k, (cell, (lambda, share))) in places.enumerate() {
            let (b, volume) = samples[k];
            let by_b = of.by_b[k].map(|c| c / volume);
            for &e in cell {
                let part = share * volume_of(mesh.vertices(e));
                let q = by_b.map(|c| part * c);
                scatter_flux((model, mesh), (e, lambda), q, derivative);
                let Some(explicit) = explicit.as_deref_mut() else { continue };
                let (space, field) = (model.space(), solution.element(model, e));
                let geometry = space.cell(mesh, e);
                let changes = space.elements().flux_change(&geometry, lambda, field.values(), q);
                let own = solution.at(model, mesh, e, lambda).flux_density;
                let more: Complex3 = std::array::from_fn(|d| own[d] - b[d]);
                // δV = V ∇λ_k·v: the element's share of the mean, and what the sample stands for.
                let by_growth = 2.0 * dot3(q, more).re + part * of.by_volume[k];
                for (a, node) in model.topology().tet(e).iter().enumerate() {
                    for d in 0..3 {
                        explicit[node.index()][d] +=
                            2.0 * changes[a][d].re + by_growth * geometry.tet.gradients[a][d];
                    }
                }
            }
        }
        of.value
    }

    /// Where `B` is taken in each element of a cell.
    fn rule(&self, order: Order) -> &'static [Node] {
        match (self.observed, order) {
            // The integral of |B|² is taken exactly; a mean over a cell needs one point of a linear B.
            (
                Observed::Deviation { weighting: Weighting::Volume, .. }
                | Observed::Homogeneity { weighting: Weighting::Volume, .. },
                Order::Quadratic,
            ) => quadrature::degree_2(),
            _ => &[([0.25; 4], 1.0)],
        }
    }

    /// The samples: of every cell at every point of the rule, or of cells that stay.
    ///
    /// # Errors
    /// [`SolverError::Covered`].
    fn samples(&self, state: FieldState<'_>) -> Result<Vec<Sample>, SolverError> {
        let Some(fixed) = &self.fixed else { return Ok(self.samples_of_cells(state)) };
        Ok(fixed.means(&fixed.places.field(state)?.flux_densities()))
    }

    fn samples_of_cells(&self, state: FieldState<'_>) -> Vec<Sample> {
        let rule = self.rule(state.0.space().order());
        let at = |cell| rule.iter().map(move |(lambda, share)| mean(cell, lambda, *share, state));
        self.cells.iter().flat_map(|cell| at(cell)).collect()
    }

    /// The value of samples, and its derivatives.
    fn of_samples(&self, samples: &[Sample], model: &FieldModel) -> OfSamples {
        if let Observed::Homogeneity { of, weighting } = self.observed {
            let weighted = weighted(samples, weighting);
            let spread = Spread::new(&weighted, of, &self.odd_directions(model));
            let (value, by_b) = spread.variance_with_derivatives();
            let by_volume = match weighting {
                Weighting::Volume => spread.variance_by_weights(),
                Weighting::Point => vec![0.0; samples.len()],
            };
            return OfSamples { value, by_b, by_volume };
        }
        let mut sum = OfSamples { value: 0.0, by_b: Vec::new(), by_volume: Vec::new() };
        for &(b, volume) in samples {
            let (term, by_b) = self.term(b, volume, model.angular_frequency());
            sum.value += term;
            sum.by_b.push(by_b);
            let is_integral =
                matches!(self.observed, Observed::Deviation { weighting: Weighting::Volume, .. });
            sum.by_volume.push(if is_integral { term / volume } else { 0.0 });
        }
        sum
    }

    /// Directions in which the vectors in the region and in its images have no mean.
    fn all_odd_directions(&self, model: &FieldModel) -> Vec<Point> {
        match self.observed {
            Observed::Homogeneity { of: Compared::Vector, .. } => {
                model.walls().symmetry_planes().odd_directions(model.topology(), self.elements())
            }
            _ => Vec::new(),
        }
    }

    /// Whether the vectors in the region and in its images have no mean at all.
    pub fn has_no_mean(&self, model: &FieldModel) -> bool {
        self.all_odd_directions(model).len() == 3
    }

    /// The directions in which nothing counts for the mean; where that would be all it is the mean over the region.
    fn odd_directions(&self, model: &FieldModel) -> Vec<Point> {
        Some(self.all_odd_directions(model)).filter(|odd| odd.len() < 3).unwrap_or_default()
    }

    /// How homogeneous the field is, where that is what is observed.
    pub(super) fn field_quality(&self, (model, mesh, solution): FieldState<'_>) -> Option<FieldQuality> {
        let Observed::Homogeneity { of, weighting } = self.observed else { return None };
        let samples = self.samples((model, mesh, solution)).ok()?;
        let odd = self.odd_directions(model);
        Some(Spread::new(&weighted(&samples, weighting), of, &odd).quality())
    }

    /// What a flux density [T] misses of what is asked for [T], where a quality of the field is.
    pub(super) fn deviation_of(
        &self,
        (model, mesh, solution): FieldState<'_>,
    ) -> Option<impl Fn(Complex3) -> f64 + use<>> {
        let (compared, ideal) = match self.observed {
            Observed::Deviation { target, .. } if target != [0.0; 3] => {
                (Compared::Vector, target.map(c64::from))
            }
            Observed::Homogeneity { of, weighting } => {
                let samples = weighted(&self.samples((model, mesh, solution)).ok()?, weighting);
                (of, Spread::new(&samples, of, &self.odd_directions(model)).mean())
            }
            Observed::Deviation { .. } | Observed::Component { .. } => return None,
        };
        let has_sign = compared.has_sign(model.angular_frequency() == 0.0);
        Some(move |b: Complex3| {
            let own = compared.of(&b);
            let missed: Complex3 = std::array::from_fn(|d| own[d] - ideal[d]);
            if has_sign { missed[0].re } else { amplitude(&missed) }
        })
    }

    /// The term of a cell with the mean `b` [T] and its volume [m³], and its derivative `q`: `d term = 2 Re(q·db)`.
    fn term(&self, b: Complex3, volume: f64, angular_frequency: f64) -> (f64, Complex3) {
        match self.observed {
            Observed::Deviation { target, weighting } => {
                let weight = match weighting {
                    Weighting::Point => 1.0,
                    Weighting::Volume => volume,
                };
                let difference: Complex3 = std::array::from_fn(|d| b[d] - target[d]);
                let square: f64 = difference.iter().map(|c| c.norm_sqr()).sum();
                (weight * square, difference.map(|c| weight * c.conj()))
            }
            // Its terms depend on each other.
            Observed::Homogeneity { .. } => (0.0, [c64::default(); 3]),
            Observed::Component { direction } => {
                let along: c64 = (0..3).map(|d| b[d] * direction[d]).sum();
                let magnitude = along.norm();
                // Where the magnitude vanishes it has a kink, and zero is the one derivative that prefers no side.
                let (value, phase) = if angular_frequency == 0.0 {
                    (along.re, c64::new(1.0, 0.0))
                } else if magnitude > 0.0 {
                    (magnitude, along.conj() / magnitude)
                } else {
                    (0.0, c64::default())
                };
                (value, direction.map(|d| 0.5 * d * phase))
            }
        }
    }
}

impl FixedCells {
    /// The places of cells at the start: the points of a rule in each element.
    fn new(mesh: &Mesh, cells: &[Vec<ElementId>], observed: Observed) -> Self {
        let is_by_cell = matches!(
            observed,
            Observed::Deviation { weighting: Weighting::Point, .. }
                | Observed::Homogeneity { weighting: Weighting::Point, .. }
        );
        // The field that is recovered is linear where the elements are of first order: its square wants the degree 2.
        let rule = if is_by_cell { &[([0.25; 4], 1.0)][..] } else { quadrature::degree_2() };
        let is_one = is_by_cell || matches!(observed, Observed::Component { .. });
        let (mut places, mut samples) = (Vec::new(), Vec::new());
        for cell in cells {
            let mut parts: Vec<(usize, f64)> = Vec::new();
            for &e in cell {
                let (vertices, volume) = (mesh.vertices(e), volume_of(mesh.vertices(e)));
                for (lambda, share) in rule {
                    parts.push((places.len(), share * volume));
                    places.push((point_at(&vertices, lambda), e));
                }
            }
            let groups =
                if is_one { vec![parts] } else { parts.into_iter().map(|part| vec![part]).collect() };
            samples.extend(groups.into_iter().map(|mut parts| {
                let volume: f64 = parts.iter().map(|(_, own)| own).sum();
                parts.iter_mut().for_each(|(_, own)| *own /= volume);
                (parts, volume)
            }));
        }
        Self { places: FixedPlaces::new(mesh, places), samples }
    }

    /// Of the fields [T] at the places.
    fn means(&self, fields: &[Complex3]) -> Vec<Sample> {
        let mean = |(parts, volume): &(Vec<(usize, f64)>, f64)| {
            let b = |d| parts.iter().map(|&(place, share)| share * fields[place][d]).sum();
            (std::array::from_fn(b), *volume)
        };
        self.samples.iter().map(mean).collect()
    }
}

/// The samples with their weights instead of their volumes.
fn weighted(samples: &[(Complex3, f64)], weighting: Weighting) -> Vec<(Complex3, f64)> {
    let weight = |volume: f64| match weighting {
        Weighting::Point => 1.0,
        Weighting::Volume => volume,
    };
    samples.iter().map(|&(b, volume)| (b, weight(volume))).collect()
}

/// Mean of B [T] over a cell, taken at one point of each element with the share `share` of its volume, and the volume
/// [m³] of these shares.
fn mean(
    cell: &[ElementId],
    lambda: &[f64; 4],
    share: f64,
    (model, mesh, solution): FieldState<'_>,
) -> (Complex3, f64) {
    let mut sum = [c64::default(); 3];
    let mut volume = 0.0;
    for &e in cell {
        let b = solution.at(model, mesh, e, lambda).flux_density;
        let v = share * volume_of(mesh.vertices(e));
        volume += v;
        for d in 0..3 {
            sum[d] += v * b[d];
        }
    }
    (sum.map(|s| s / volume), volume)
}
