//! Functions of the flux density in observation cells that do not move with the design.
//!
//! The driver refuses an observation region inside the remesh region, so these depend on the node positions through
//! the field alone.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, volume as volume_of};
use fluxmorph_geometry::{ElementId, Mesh, RegionId};

use super::FunctionalValue;
use super::deviation::length;
use super::homogeneity::{Compared, FieldQuality, Spread};
use crate::element::Complex3;
use crate::element::quadrature::{self, Node};
use crate::elements::Order;
use crate::error::SolverError;
use crate::model::FieldModel;
use crate::solution::FieldSolution;

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

/// A function of the mean flux densities `B_k` of cells.
#[derive(Clone, Debug)]
pub struct Observation {
    cells: Vec<Vec<ElementId>>,
    observed: Observed,
}

impl Observation {
    /// On the cells of a region: those that the mesh defines (point), each element (volume), or the region as one.
    ///
    /// # Errors
    /// [`SolverError::EmptyRegion`].
    pub fn new(mesh: &Mesh, region: RegionId, observed: Observed) -> Result<Self, SolverError> {
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
        Ok(Self { cells, observed })
    }

    /// Elements that take part.
    pub fn elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        self.cells.iter().flatten().copied()
    }

    /// Mean flux density of every cell [T], shape `(n_cells, 3)`.
    pub fn cell_flux_densities(
        &self,
        model: &FieldModel,
        mesh: &Mesh,
        solution: &FieldSolution,
    ) -> Vec<Complex3> {
        self.cells.iter().map(|cell| mean(cell, &[0.25; 4], 1.0, model, mesh, solution).0).collect()
    }

    pub(super) fn evaluate(
        &self,
        model: &FieldModel,
        mesh: &Mesh,
        solution: &FieldSolution,
    ) -> FunctionalValue {
        let mut derivative = vec![c64::default(); model.unknown_count()];
        let samples = self.samples(model, mesh, solution);
        let (value, by_b) = match self.observed {
            Observed::Homogeneity { of, weighting } => {
                Spread::new(&weighted(&samples, weighting), of).variance_with_derivatives()
            }
            _ => self.sum(&samples, model.angular_frequency()),
        };
        let places =
            self.cells.iter().flat_map(|c| self.rule(model.space().order()).iter().map(move |q| (c, q)));
        for (((cell, (lambda, share)), (_, volume)), by_b) in places.zip(&samples).zip(by_b) {
            let by_b = by_b.map(|c| c / *volume);
            for &e in cell {
                let cell = model.space().cell(mesh, e);
                let carriers = model.space().carriers_of(e);
                model.space().functions(&cell, lambda, &mut |carrier, component, _, curl| {
                    let mut local = [c64::default(); 4];
                    local[component] = (0..3).map(|d| by_b[d] * (share * cell.tet.volume * curl[d])).sum();
                    model.unknowns().scatter_add(&mut derivative, carriers[carrier], local);
                });
            }
        }
        FunctionalValue { value, derivative, ..Default::default() }
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

    /// `B` [T] and the volume [m³] that it stands for, of every cell at every point of the rule.
    fn samples(&self, model: &FieldModel, mesh: &Mesh, solution: &FieldSolution) -> Vec<(Complex3, f64)> {
        let rule = self.rule(model.space().order());
        let at =
            |cell| rule.iter().map(move |(lambda, share)| mean(cell, lambda, *share, model, mesh, solution));
        self.cells.iter().flat_map(|cell| at(cell)).collect()
    }

    /// The sum of the terms of all samples, and the derivative of each.
    fn sum(&self, samples: &[(Complex3, f64)], angular_frequency: f64) -> (f64, Vec<Complex3>) {
        let terms = samples.iter().map(|&(b, volume)| self.term(b, volume, angular_frequency));
        terms.fold((0.0, Vec::new()), |(sum, mut all), (term, by_b)| {
            all.push(by_b);
            (sum + term, all)
        })
    }

    /// How homogeneous the field is, where that is what is observed.
    pub(super) fn field_quality(
        &self,
        model: &FieldModel,
        mesh: &Mesh,
        solution: &FieldSolution,
    ) -> Option<FieldQuality> {
        let Observed::Homogeneity { of, weighting } = self.observed else { return None };
        Some(Spread::new(&weighted(&self.samples(model, mesh, solution), weighting), of).quality())
    }

    /// What a flux density [T] misses of what is asked for [T], where a quality of the field is.
    pub(super) fn deviation_of(
        &self,
        model: &FieldModel,
        mesh: &Mesh,
        solution: &FieldSolution,
    ) -> Option<impl Fn(Complex3) -> f64 + use<>> {
        let (compared, ideal) = match self.observed {
            Observed::Deviation { target, .. } if target != [0.0; 3] => {
                (Compared::Vector, target.map(c64::from))
            }
            Observed::Homogeneity { of, weighting } => {
                let samples = weighted(&self.samples(model, mesh, solution), weighting);
                (of, Spread::new(&samples, of).mean())
            }
            Observed::Deviation { .. } | Observed::Component { .. } => return None,
        };
        let has_sign = compared.has_sign(model.angular_frequency() == 0.0);
        Some(move |b: Complex3| {
            let own = compared.of(&b);
            let missed: Complex3 = std::array::from_fn(|d| own[d] - ideal[d]);
            if has_sign { missed[0].re } else { length(missed) }
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
    model: &FieldModel,
    mesh: &Mesh,
    solution: &FieldSolution,
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
