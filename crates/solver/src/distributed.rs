//! A field problem distributed over ranks: what each does when rank 0 asks for a matrix, a solution or a gradient.
//!
//! A rank assembles the rows of its own nodes, solves with all others, and differentiates on its own elements. Loads,
//! functionals and recovery stay with rank 0, which has the whole solution: they are a small part of the work. Does not
//! live here: how commands are sent ([`fluxmorph_geometry::parallel`]), and what solves ([`crate::linear::distributed`]).

use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, PoisonError};

use fluxmorph_geometry::fem::CsrMatrix;
use fluxmorph_geometry::parallel::{
    Command, CommandChannel, CommandHandler, Communicator, DistributedMatrix, Ownership, RowLayout, Rows,
    complex_of, numbers_of,
};
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{CarrierId, ElementId, Mesh};

use crate::adjoint::{self, Extent};
use crate::error::SolverError;
use crate::linear::distributed::SOLVE;
use crate::linear::{DistributedSettings, DistributedSystem, LinearSolverReport, LinearSolverSettings};
use crate::model::FieldModel;
use crate::solution::FieldSolution;

/// The command to assemble and factor with nodes at the given places.
const ASSEMBLE: u32 = 2;
/// The command to take the given elements as those that may move.
const MOVING: u32 = 3;
/// The command to differentiate, for the given state and adjoint.
const DIFFERENTIATE: u32 = 4;

/// First number of [`DIFFERENTIATE`]: sources and prescribed values act in the state.
const STATE: f64 = 0.0;
/// First number of [`DIFFERENTIATE`]: it is the response to 1 A.
const RESPONSE: f64 = 1.0;

/// Iterations after which an iteration gives up: ten times what thin elements were seen to take (docs/scale.md).
const MAX_ITERATIONS: usize = 3000;

/// A distributed field problem, as rank 0 holds it.
#[derive(Debug)]
pub(crate) struct Distributed {
    channel: Arc<CommandChannel>,
    /// The elements that all ranks know may move.
    moving: Mutex<Option<Vec<ElementId>>>,
    /// How many matrices the ranks have taken.
    taken: Arc<AtomicU64>,
}

impl Distributed {
    /// Distributes a problem; every rank does.
    pub(crate) fn new(model: &FieldModel, ownership: &Ownership, settings: &DistributedSettings) -> Self {
        let handler = FieldHandler::new(model.clone(), ownership.clone(), settings);
        Self {
            channel: Arc::new(ownership.group.register(Box::new(handler))),
            moving: Mutex::default(),
            taken: Arc::default(),
        }
    }

    /// Has all ranks assemble and factor with nodes at `points` [m], shape `(n_nodes, 3)`.
    ///
    /// # Errors
    /// [`SolverError::Rank`].
    pub(crate) fn prepare(
        &self,
        points: &[Point],
        settings: &LinearSolverSettings,
    ) -> Result<DistributedSystem, SolverError> {
        self.channel.execute(ASSEMBLE, points.as_flattened().to_vec())?;
        Ok(DistributedSystem::new(Arc::clone(&self.channel), settings, &self.taken))
    }

    /// [`adjoint::node_gradient`] on the mesh of the last [`Distributed::prepare`], every rank on its elements.
    ///
    /// # Errors
    /// [`SolverError::Rank`].
    pub(crate) fn node_gradient(
        &self,
        state: &FieldSolution,
        adjoint: &FieldSolution,
        moving: &[ElementId],
    ) -> Result<Vec<Point>, SolverError> {
        let mut known = self.moving.lock().unwrap_or_else(PoisonError::into_inner);
        if known.as_deref() != Some(moving) {
            self.channel.execute(MOVING, moving.iter().map(|e| f64::from(e.0)).collect())?;
            *known = Some(moving.to_vec());
        }
        let role = if state.is_state() { STATE } else { RESPONSE };
        let fields = numbers_of(state.values()).chain(numbers_of(adjoint.values()));
        let numbers = std::iter::once(role).chain(fields).collect();
        let sum = self.channel.execute(DIFFERENTIATE, numbers)?;
        Ok(sum.as_chunks::<3>().0.to_vec())
    }
}

/// What a rank holds of a field problem.
struct FieldHandler {
    model: FieldModel,
    ownership: Ownership,
    matrix: DistributedMatrix,
    mesh: Option<Mesh>,
    /// Those of the elements that may move which the rank owns, ascending.
    moving: Vec<ElementId>,
}

impl FieldHandler {
    fn new(model: FieldModel, ownership: Ownership, settings: &DistributedSettings) -> Self {
        let discretisation = model.discretisation();
        let (space, dofs) = (&discretisation.space, &discretisation.unknowns.dofs);
        let owner = |carrier: CarrierId| ownership.partition.owner_of(space.vertices_of(carrier)[0]);
        let layout = Arc::new(RowLayout::new(dofs, ownership.group.size(), ownership.group.rank(), owner));
        let rows = Rows { structure: Arc::clone(discretisation.pattern.structure()), layout };
        let tolerance = model.setup().linear_solver.tolerance;
        let limit = model.setup().linear_solver.max_iterations.unwrap_or(MAX_ITERATIONS);
        let options = settings.options("", dofs.count(), (tolerance, limit));
        let matrix = DistributedMatrix::new(rows, options);
        Self { model, ownership, matrix, mesh: None, moving: Vec::new() }
    }

    fn differentiate(&self, numbers: &[f64], ranks: &dyn Communicator) -> Result<Vec<f64>, String> {
        let mesh = self.mesh.as_ref().ok_or("there is no mesh yet")?;
        let report = LinearSolverReport { iterations: 0, residual: 0.0 };
        let (role, numbers) = numbers.split_first().ok_or("there is no state")?;
        let (state, lambda) = numbers.split_at(numbers.len() / 2);
        let state = match *role {
            STATE => FieldSolution::state(complex_of(state), report),
            _ => FieldSolution::adjoint(complex_of(state), report),
        };
        let lambda = FieldSolution::adjoint(complex_of(lambda), report);
        let local = self.model.discretisation().local.as_ref();
        let triangles = local.map(|local| local.owned_triangles.as_slice());
        let extent = Extent { moving: &self.moving, triangles };
        let mut gradient = adjoint::gradient_of(&self.model, mesh, &state, &lambda, &extent);
        ranks.sum(gradient.as_flattened_mut());
        Ok(if ranks.rank() == 0 { gradient.into_flattened() } else { Vec::new() })
    }
}

impl CommandHandler for FieldHandler {
    fn handle(&mut self, command: &Command, ranks: &dyn Communicator) -> Result<Vec<f64>, String> {
        match command.kind {
            ASSEMBLE => {
                let points = command.numbers.as_chunks::<3>().0.to_vec();
                let mesh = Mesh::new(Arc::clone(self.model.topology()), points);
                let mesh = self.mesh.insert(mesh.map_err(|error| error.to_string())?);
                let matrix: CsrMatrix<_> = self.model.assemble(mesh);
                self.matrix.set(&matrix.values, ranks)?;
            }
            SOLVE => return self.matrix.solve(&command.numbers, ranks),
            MOVING => {
                let moving: Vec<ElementId> = command.numbers.iter().map(|&e| ElementId(e as u32)).collect();
                self.moving = self.ownership.owned_among(&moving);
            }
            DIFFERENTIATE => return self.differentiate(&command.numbers, ranks),
            other => return Err(format!("a field problem has no command {other}")),
        }
        Ok(Vec::new())
    }
}
