//! Functionals of the field: real numbers with their derivatives, to be made small, large, or kept below a bound.
//!
//! `dF/dx = explicit − 2 Re( λᵀ (∂K/∂x u − ∂f/∂x) )` with `K λ = ∂F/∂u`: [`FunctionalValue::derivative`] is the right
//! side of the adjoint problem, [`FunctionalValue::explicit`] the first term, and [`crate::adjoint`] the second.
//! `observation` holds what is a function of B in cells that do not move, `homogeneity` its deviation from its own mean,
//! `integral` the integrals of densities over regions that may move, `force` the virtual work around a body. Weighted sums,
//! bounds and several frequencies are the optimiser's business.

mod force;
mod homogeneity;
mod integral;
mod observation;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, Mesh, RegionId};

use crate::element::Complex3;
use crate::error::SolverError;
use crate::model::FieldModel;
use crate::solution::FieldSolution;
pub use force::{Force, RigidMotion};
pub use homogeneity::{Compared, FieldQuality};
pub use integral::Integral;
pub use observation::{Observation, Observed, Weighting};

/// A real quantity of one field solution.
#[derive(Clone, Debug)]
pub enum Functional {
    /// A function of B in cells that do not move.
    Observation(Observation),
    /// An integral over elements or an impedance surface, which may move.
    Integral(Integral),
    /// A force or torque on a body, which may move.
    Force(Force),
}

/// Value of a functional, and what its gradient needs.
#[derive(Clone, Debug)]
pub struct FunctionalValue {
    /// `F`.
    pub value: f64,
    /// `∂F/∂u`, one entry per unknown: `dF = 2 Re Σ derivative · du`.
    pub derivative: Vec<c64>,
    /// `∂F/∂x` at fixed potentials [unit of F per m], shape `(n_nodes, 3)`; `None` where the region stays in place.
    pub explicit: Option<Vec<Point>>,
}

impl Functional {
    /// A function of B on the cells of a region.
    ///
    /// # Errors
    /// [`SolverError::EmptyRegion`].
    pub fn observation(mesh: &Mesh, region: RegionId, observed: Observed) -> Result<Self, SolverError> {
        Ok(Self::Observation(Observation::new(mesh, region, observed)?))
    }

    /// The eddy-current loss [W] of a conductor, by the name of its region: meshed, or replaced by its surface.
    ///
    /// # Errors
    /// [`SolverError::EmptyRegion`] when no conductor of the model has this name.
    pub fn loss(model: &FieldModel, region: &str) -> Result<Self, SolverError> {
        Ok(Self::Integral(Integral::loss(model, region)?))
    }

    /// The energy of the magnetic field [J] in a region, or in all that is meshed: `½∫ν|B − B_r|²` in statics (`B_r` in
    /// magnets, zero elsewhere), its time average `¼∫ν|B|²` in harmonics.
    ///
    /// # Errors
    /// [`SolverError::EmptyRegion`].
    pub fn energy(model: &FieldModel, region: Option<RegionId>) -> Result<Self, SolverError> {
        Ok(Self::Integral(Integral::energy(model, region)?))
    }

    /// A force [N] or torque [N m] on the body that some regions make up, of the meshed part; in harmonics the time average.
    ///
    /// # Errors
    /// As [`Force::new`].
    pub fn force(
        model: &FieldModel,
        mesh: &Mesh,
        name: &str,
        regions: &[RegionId],
        motion: RigidMotion,
    ) -> Result<Self, SolverError> {
        Ok(Self::Force(Force::new(model, mesh, name, regions, motion)?))
    }

    /// Elements that must stay where they are: those of an observation.
    pub fn fixed_elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        let observation = match self {
            Self::Observation(observation) => Some(observation),
            Self::Integral(_) | Self::Force(_) => None,
        };
        observation.into_iter().flat_map(Observation::elements)
    }

    /// Mean flux density [T] of every observation cell, shape `(n_cells, 3)`; empty for an integral.
    pub fn cell_flux_densities(
        &self,
        model: &FieldModel,
        mesh: &Mesh,
        solution: &FieldSolution,
    ) -> Vec<Complex3> {
        match self {
            Self::Observation(observation) => observation.cell_flux_densities(model, mesh, solution),
            Self::Integral(_) | Self::Force(_) => Vec::new(),
        }
    }

    /// How homogeneous the field is, where that is what is observed.
    pub fn field_quality(
        &self,
        model: &FieldModel,
        mesh: &Mesh,
        solution: &FieldSolution,
    ) -> Option<FieldQuality> {
        match self {
            Self::Observation(observation) => observation.field_quality(model, mesh, solution),
            Self::Integral(_) | Self::Force(_) => None,
        }
    }

    /// `F` and its derivatives on a solution of `model` on `mesh`.
    ///
    /// # Errors
    /// [`SolverError::NotFinite`].
    pub fn evaluate(
        &self,
        model: &FieldModel,
        mesh: &Mesh,
        solution: &FieldSolution,
    ) -> Result<FunctionalValue, SolverError> {
        let result = match self {
            Self::Observation(observation) => observation.evaluate(model, mesh, solution),
            Self::Integral(integral) => integral.evaluate(model, mesh, solution),
            Self::Force(force) => force.evaluate(model, mesh, solution),
        };
        if !result.value.is_finite() {
            return Err(SolverError::NotFinite { what: "objective", value: result.value });
        }
        Ok(result)
    }
}

/// Whether the field does not alternate.
fn is_static(model: &FieldModel) -> bool {
    model.angular_frequency() == 0.0
}
