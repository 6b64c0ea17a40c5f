//! Functionals of the field: real numbers with their derivatives, to be made small, large, or kept below a bound.
//!
//! `dF/dx = explicit − 2 Re( λᵀ (∂K/∂x u − ∂f/∂x) )` with `K λ = ∂F/∂u`: [`FunctionalValue::derivative`] is the right
//! side of the adjoint problem, [`FunctionalValue::explicit`] the first term, and [`crate::adjoint`] the second.
//! `observation` holds what is a function of B in cells, `homogeneity` its deviation from its own mean,
//! `integral` the integrals of densities over regions that may move, `force` the virtual work around a body, `terminal` what is a
//! function of current and flux linkage of a coil, `inductance` what is one of the inductances, `multipole` what is one of terms of
//! an expansion, `deviation` where the field misses what a quality asks for, `volume` what is a function of the shape alone. Weighted sums, bounds and several frequencies are the optimiser's business.

mod deviation;
mod force;
mod homogeneity;
mod inductance;
mod integral;
mod multipole;
mod observation;
mod terminal;
mod volume;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, Mesh, RegionId};

use crate::element::Complex3;
use crate::error::SolverError;
use crate::model::FieldModel;
use crate::solution::FieldState;
pub use force::{Force, RigidMotion, resultant};
pub use homogeneity::{Compared, FieldQuality};
pub use inductance::{InductanceFunctional, Inductive};
pub use integral::Integral;
pub use multipole::{MirrorPlane, MultipoleFunctional, Multipoles, OfTerms, rounding_of_main};
pub use observation::{Follow, Observation, Observed, Weighting};
pub use terminal::{AtTerminals, TerminalFunctional};
pub use volume::Volume;

/// A real quantity of one field solution, or of the shape that it is on.
#[derive(Clone, Debug)]
pub enum Functional {
    /// A function of B in cells.
    Observation(Observation),
    /// An integral over elements or an impedance surface, which may move.
    Integral(Integral),
    /// A force or torque on a body, which may move.
    Force(Force),
    /// A function of current and flux linkage of a coil.
    Terminal(TerminalFunctional),
    /// A function of the inductances of coils.
    Inductance(InductanceFunctional),
    /// A function of terms of an expansion of B.
    Multipole(Box<MultipoleFunctional>),
    /// A volume or mass: of the shape, whatever the field.
    Volume(Volume),
}

/// Value of a functional, and what its gradient needs.
#[derive(Clone, Debug, Default)]
pub struct FunctionalValue {
    /// `F`.
    pub value: f64,
    /// `∂F/∂u`, one entry per unknown, then one per current that a voltage drives: `dF = 2 Re Σ derivative · du`. Zero where it
    /// ends.
    pub derivative: Vec<c64>,
    /// `(j, k, ∂F/∂L_jk)` by the places of windings: `dF = 2 Re Σ ∂F/∂L_jk · dL_jk` beside the other parts.
    pub inductances: Vec<(usize, usize, c64)>,
    /// `∂F/∂x` at fixed potentials [unit of F per m], shape `(n_nodes, 3)`; `None` where the region stays in place.
    pub explicit: Option<Vec<Point>>,
}

impl Functional {
    /// A function of B on the cells of a region; the mesh is the one at the start.
    ///
    /// # Errors
    /// [`SolverError::EmptyRegion`].
    pub fn observation(
        mesh: &Mesh,
        region: RegionId,
        observed: Observed,
        follow: Follow,
    ) -> Result<Self, SolverError> {
        Ok(Self::Observation(Observation::new(mesh, region, observed, follow)?))
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

    /// A function of what the terminals of the coil with this name see; a coil that it may be asked of has a winding.
    ///
    /// # Errors
    /// [`SolverError::Parameter`] for a coil without winding, and where the quantity has no meaning or does not change.
    pub fn at_terminals(model: &FieldModel, coil: &str, of: AtTerminals) -> Result<Self, SolverError> {
        Ok(Self::Terminal(TerminalFunctional::new(model, coil, of)?))
    }

    /// A function of the inductances of the coils with these names: of one, or of two.
    ///
    /// # Errors
    /// [`SolverError::Parameter`] for coils without winding, another number of them, and where it has no meaning.
    pub fn of_inductances(model: &FieldModel, coils: &[&str], of: Inductive) -> Result<Self, SolverError> {
        Ok(Self::Inductance(InductanceFunctional::new(model, coils, of)?))
    }

    /// A function of terms of an expansion.
    ///
    /// # Errors
    /// [`SolverError::Parameter`] for a term that the expansion does not have.
    pub fn multipole(multipoles: Multipoles, of: OfTerms) -> Result<Self, SolverError> {
        Ok(Self::Multipole(Box::new(MultipoleFunctional::new(multipoles, of)?)))
    }

    /// Whether the field has a say in it.
    pub fn is_of_field(&self) -> bool {
        !matches!(self, Self::Volume(_))
    }

    /// Places of the windings whose responses to 1 A the state must have ([`FieldModel::respond`]).
    pub fn windings(&self) -> &[usize] {
        match self {
            Self::Inductance(functional) => functional.windings(),
            _ => &[],
        }
    }

    /// Elements that must stay where they are: those of an observation, and around the points of an expansion.
    pub fn fixed_elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        let (observation, multipole) = match self {
            Self::Observation(observation) => (Some(observation), None),
            Self::Multipole(multipole) => (None, Some(multipole.as_ref())),
            _ => (None, None),
        };
        let observed = observation.into_iter().flat_map(Observation::held_elements);
        observed.chain(multipole.into_iter().flat_map(MultipoleFunctional::elements))
    }

    /// Whether what moves has left the observed places as they were; nothing where none stays while the mesh moves.
    ///
    /// # Errors
    /// [`SolverError::Covered`] for a place that is reached.
    pub fn check_places(&self, model: &FieldModel, mesh: &Mesh) -> Result<(), SolverError> {
        match self {
            Self::Observation(observation) => observation.check_places(model, mesh),
            Self::Multipole(multipole) => multipole.check_places(model, mesh),
            _ => Ok(()),
        }
    }

    /// Mean flux density [T] of every observation cell, shape `(n_cells, 3)`; empty for an integral.
    pub fn cell_flux_densities(&self, state: FieldState<'_>) -> Vec<Complex3> {
        match self {
            Self::Observation(observation) => observation.cell_flux_densities(state),
            _ => Vec::new(),
        }
    }

    /// How homogeneous the field is, where that is what is observed.
    pub fn field_quality(&self, state: FieldState<'_>) -> Option<FieldQuality> {
        match self {
            Self::Observation(observation) => observation.field_quality(state),
            _ => None,
        }
    }

    /// `F` and its derivatives on a solution of `model` on `mesh`.
    ///
    /// # Errors
    /// [`SolverError::NotFinite`]; [`SolverError::Covered`]; [`SolverError::Parameter`] where the state lacks a response of [`Functional::windings`].
    pub fn evaluate(&self, state: FieldState<'_>) -> Result<FunctionalValue, SolverError> {
        let (model, mesh, solution) = state;
        let result = match self {
            Self::Observation(observation) => observation.evaluate(state)?,
            Self::Integral(integral) => integral.evaluate(state),
            Self::Force(force) => force.evaluate(state),
            Self::Terminal(terminal) => terminal.evaluate(state),
            Self::Inductance(inductance) => inductance.evaluate(model, solution)?,
            Self::Multipole(multipole) => multipole.evaluate(state)?,
            Self::Volume(volume) => volume.evaluate(mesh),
        };
        if !result.value.is_finite() {
            return Err(SolverError::NotFinite { what: "objective", value: result.value });
        }
        Ok(result)
    }
}

/// Places of the windings of some coils by name.
fn windings_of(model: &FieldModel, coils: &[&str]) -> Result<Vec<usize>, SolverError> {
    let place = |coil: &&str| {
        let expected = "a coil of the model with the turns of its winding";
        let found = model.windings().position(model, coil);
        found.ok_or_else(|| SolverError::parameter("coil", *coil, expected))
    };
    coils.iter().map(place).collect()
}

/// Whether the field does not alternate.
fn is_static(model: &FieldModel) -> bool {
    model.angular_frequency() == 0.0
}
