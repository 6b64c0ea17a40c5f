//! The optimisation problem as a function: design variables in, objective, constraints and exact gradients out.
//!
//! `p → Δx_b → Δx (Eq. 3) → mesh → state u → F`, and back: `λ → dF/dx → transposed tangent → dF/dp`. The mesh is one
//! function of the design ([`Shape::motion`]), so `F(p)` is one too, and not a path. A problem owns one state a load case; the objective costs one adjoint solve a state whatever the number of its
//! terms, each constraint of the field another.
//!
//! Here: what is moved and solved (`mod`, `shape`), one evaluation (`evaluate`) with its sums (`adjoint_accumulator`) and
//! result (`analysis`), and the check of what is computed (`finite`).
//! Nothing here knows an optimiser, a file or a terminal.

mod adjoint_accumulator;
mod analysis;
mod cut;
mod estimate;
mod evaluate;
pub mod finite;
mod progress;
mod shape;
mod solver_cache;
mod stopwatch;

use fluxmorph_geometry::parallel::Ownership;
use fluxmorph_geometry::quality::QualityReport;
use fluxmorph_geometry::{ElementId, Mesh};
use fluxmorph_remesh::{Moved, RemeshError, StepToInversion};
use fluxmorph_solver::FieldModel;

use crate::body::Body;
use crate::constraint::{Bound, Constraint, Quantity};
use crate::error::Error;
use crate::objective::WeightedSum;

pub use analysis::{Analysis, Measured, Timings};
pub use cut::Cut;
pub use estimate::{EnrichedModels, ErrorEstimate, ObjectiveError};
pub use evaluate::{Derivatives, SEARCH_ADJOINT_TOLERANCE};
pub use progress::{NoProgress, Progress, Stage};
pub use shape::{Shape, between};
pub use solver_cache::SolverCache;

/// Objective, constraints, states and shape on a reference mesh.
#[derive(Debug)]
pub struct Problem {
    original: Mesh,
    states: Vec<FieldModel>,
    objective: Option<WeightedSum>,
    constraints: Vec<Constraint>,
    shape: Option<Shape>,
    share: Option<Ownership>,
    bodies: Vec<Body>,
    responses: Responses,
}

/// To which windings of a linear state the fields of 1 A are solved for, while its factor is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Responses {
    /// Those whose inductances a functional is of.
    OfFunctionals,
    /// All.
    OfEveryWinding,
}

impl Problem {
    /// A field problem on the undeformed mesh `original`, with one state a load case; without a shape nothing moves, and
    /// constraints on the field alone have a meaning. Limits of the thickness that are linear become bounds of the shape
    /// as far as they can ([`crate::geometric::ThicknessBound::restrict`]).
    ///
    /// # Panics
    /// If there is no state, a term is measured on a state that is not there, or a body is constrained without a shape.
    pub fn new(
        original: Mesh,
        states: Vec<FieldModel>,
        objective: Option<WeightedSum>,
        mut constraints: Vec<Constraint>,
        mut shape: Option<Shape>,
    ) -> Self {
        assert!(!states.is_empty(), "a problem has a state");
        let terms = objective.iter().flat_map(|sum| &sum.terms);
        assert!(
            terms.flat_map(|term| &term.states).all(|&state| state < states.len()),
            "a term is measured on states of the problem"
        );
        let mut quantities = constraints.iter().map(|constraint| &constraint.quantity);
        assert!(
            shape.is_some() || quantities.all(Quantity::is_of_field),
            "a body that is constrained can move"
        );
        for constraint in &mut constraints {
            if let (Quantity::Thickness { measure, .. }, Some(shape)) = (&mut constraint.quantity, &mut shape)
            {
                measure.restrict(shape);
            }
        }
        let (share, bodies, responses) = (None, Vec::new(), Responses::OfFunctionals);
        Self { original, states, objective, constraints, shape, share, bodies, responses }
    }

    /// The same with its work shared out among ranks.
    #[must_use]
    pub fn shared_out(self, share: Option<Ownership>) -> Self {
        Self { share, ..self }
    }

    /// The same with bodies on which the first state's force is reported.
    #[must_use]
    pub fn with_bodies(self, bodies: Vec<Body>) -> Self {
        Self { bodies, ..self }
    }

    /// Analyses are to have the responses of every winding from now on.
    pub fn respond_to_every_winding(&mut self) {
        self.responses = Responses::OfEveryWinding;
    }

    /// The same with other states.
    ///
    /// # Panics
    /// As [`Problem::new`].
    #[must_use]
    pub fn with_states(self, states: Vec<FieldModel>) -> Self {
        let Self { original, objective, constraints, shape, share, bodies, responses, .. } = self;
        let other = Self::new(original, states, objective, constraints, shape);
        Self { responses, ..other.shared_out(share).with_bodies(bodies) }
    }

    /// Lets go of states, constraints and shape, which hold nearly all of the memory: the undeformed mesh is left, and
    /// nothing is to be evaluated any more.
    pub fn release(&mut self) {
        (self.states, self.constraints, self.shape) = (Vec::new(), Vec::new(), None);
    }

    /// The undeformed mesh.
    pub fn original(&self) -> &Mesh {
        &self.original
    }

    /// One field problem per state, in the order of the load cases; at least one.
    pub fn states(&self) -> &[FieldModel] {
        &self.states
    }

    /// What is optimised; `None` for a field analysis without objective.
    pub fn objective(&self) -> Option<&WeightedSum> {
        self.objective.as_ref()
    }

    /// What is optimised, to change its goal or weights.
    pub fn objective_mut(&mut self) -> Option<&mut WeightedSum> {
        self.objective.as_mut()
    }

    /// What must keep within bounds; without a shape functionals of the field alone.
    pub fn constraints(&self) -> &[Constraint] {
        &self.constraints
    }

    /// What moves; `None` for a field analysis without design.
    pub fn shape(&self) -> Option<&Shape> {
        self.shape.as_ref()
    }

    /// What moves, to change its bounds and limits.
    pub fn shape_mut(&mut self) -> Option<&mut Shape> {
        self.shape.as_mut()
    }

    /// Bodies on which force and torque are reported.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// The ranks among which the work is shared out; `None` for one process.
    pub fn share(&self) -> Option<&Ownership> {
        self.share.as_ref()
    }

    /// The mesh of a design; the undeformed one where nothing moves.
    ///
    /// # Errors
    /// [`RemeshError::Inverted`] says which element breaks and how far the step may go.
    ///
    /// # Panics
    /// If `p` has another length than there are variables.
    pub fn moved(&self, p: &[f64]) -> Result<Moved, RemeshError> {
        match &self.shape {
            Some(shape) => shape.motion().moved(&shape.displacement(p)),
            None => Ok(Moved {
                newton_steps: 0,
                mesh: self.original.clone(),
                displacement: vec![[0.0; 3]; self.original.points().len()],
                inversion: StepToInversion::NEVER,
                tangent: None,
            }),
        }
    }

    /// Elements of which a node may move, ascending; empty without a shape.
    pub fn moving_elements(&self) -> &[ElementId] {
        self.shape.as_ref().map_or(&[], |shape| shape.motion().moving())
    }

    /// Quality of the elements that may move, or of all where nothing moves.
    pub fn quality(&self, mesh: &Mesh) -> QualityReport {
        match &self.shape {
            Some(shape) => shape.motion().quality(mesh),
            None => QualityReport::of_mesh(mesh).expect("a mesh has elements"),
        }
    }

    /// Whether a bound is a share of the initial design's value.
    pub fn has_shared_bounds(&self) -> bool {
        self.constraints.iter().any(|constraint| constraint.limit.share().is_some())
    }

    /// Bounds of the constraints. Where there are [shares](Problem::has_shared_bounds) of the initial design's values and `analysis`
    /// is of another one, `initial` is the mesh of that, which is analysed.
    ///
    /// # Errors
    /// As [`Problem::analyse`], and [`Error::Constraint`].
    pub fn bounds(&self, initial: Option<Moved>, analysis: &Analysis) -> Result<Vec<Bound>, Error> {
        let analyse = |moved| {
            let cache = &mut self.cache_after(analysis);
            self.analyse(moved, Derivatives::None, cache, &mut NoProgress)
        };
        let initial = initial.map(analyse).transpose()?;
        let measured = &initial.as_ref().unwrap_or(analysis).constraints;
        self.constraints.iter().zip(measured).map(|(constraint, m)| constraint.bound(m.value)).collect()
    }
}
