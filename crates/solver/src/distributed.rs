//! A field problem shared out among ranks: what each does when rank 0 asks for a matrix, a solution or a gradient.
//!
//! A rank assembles the rows of its own nodes, solves with all others, and differentiates on its own elements. Loads,
//! functionals and recovery stay with rank 0, which has the whole solution: they are a small part of the work. Does not
//! live here: how orders travel ([`fluxmorph_geometry::ranks`]), and what solves ([`crate::linear::distributed`]).

use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, PoisonError};

use fluxmorph_geometry::fem::CsrMatrix;
use fluxmorph_geometry::ranks::{
    Communicator, DistributedMatrix, Order, Part, RowLayout, Rows, Share, Shared, complex_of, numbers_of,
};
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, Mesh, NodeId};

use crate::adjoint::{self, Extent};
use crate::error::SolverError;
use crate::linear::distributed::SOLVE;
use crate::linear::{DistributedSettings, DistributedSystem, LinearSolverReport, LinearSolverSettings};
use crate::model::FieldModel;
use crate::solution::FieldSolution;

/// The order to assemble and factor with nodes at the given places.
const ASSEMBLE: u32 = 2;
/// The order to take the given elements as those that may move.
const MOVING: u32 = 3;
/// The order to differentiate, for the given state and adjoint.
const DIFFERENTIATE: u32 = 4;

/// Iterations after which an iteration gives up: ten times what thin elements were seen to take (docs/scale.md).
const MAX_ITERATIONS: usize = 3000;

/// A shared-out field problem, as rank 0 holds it.
#[derive(Debug)]
pub(crate) struct Distributed {
    shared: Arc<Shared>,
    /// The elements that all ranks know may move.
    moving: Mutex<Option<Vec<ElementId>>>,
    /// How many matrices the ranks have taken.
    taken: Arc<AtomicU64>,
}

impl Distributed {
    /// Shares a problem out; every rank does.
    pub(crate) fn new(model: &FieldModel, share: &Share, settings: &DistributedSettings) -> Self {
        let part = FieldPart::new(model.clone(), share.clone(), settings);
        Self {
            shared: Arc::new(share.team.share(Box::new(part))),
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
        self.shared.order(ASSEMBLE, points.as_flattened().to_vec())?;
        Ok(DistributedSystem::new(Arc::clone(&self.shared), settings, &self.taken))
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
            self.shared.order(MOVING, moving.iter().map(|e| f64::from(e.0)).collect())?;
            *known = Some(moving.to_vec());
        }
        let numbers = numbers_of(state.values()).chain(numbers_of(adjoint.values())).collect();
        let sum = self.shared.order(DIFFERENTIATE, numbers)?;
        Ok(sum.as_chunks::<3>().0.to_vec())
    }
}

/// What a rank holds of a field problem.
struct FieldPart {
    model: FieldModel,
    share: Share,
    matrix: DistributedMatrix,
    mesh: Option<Mesh>,
    /// Those of the elements that may move which the rank owns, ascending.
    moving: Vec<ElementId>,
}

impl FieldPart {
    fn new(model: FieldModel, share: Share, settings: &DistributedSettings) -> Self {
        let discretisation = model.discretisation();
        let (space, dofs) = (&discretisation.space, &discretisation.unknowns.dofs);
        let owner = |node: NodeId| share.partition.owner_of(space.vertices_of(node)[0]);
        let layout = Arc::new(RowLayout::new(dofs, share.team.size(), share.team.rank(), owner));
        let rows = Rows { structure: Arc::clone(discretisation.pattern.structure()), layout };
        let tolerance = model.setup().linear_solver.tolerance;
        let limit = model.setup().linear_solver.max_iterations.unwrap_or(MAX_ITERATIONS);
        let options = settings.options("", dofs.count(), (tolerance, limit));
        let matrix = DistributedMatrix::new(rows, options);
        Self { model, share, matrix, mesh: None, moving: Vec::new() }
    }

    fn differentiate(&self, numbers: &[f64], ranks: &dyn Communicator) -> Result<Vec<f64>, String> {
        let mesh = self.mesh.as_ref().ok_or("there is no mesh yet")?;
        let report = LinearSolverReport { iterations: 0, residual: 0.0 };
        let (state, lambda) = numbers.split_at(numbers.len() / 2);
        let state = FieldSolution::state(complex_of(state), report);
        let lambda = FieldSolution::adjoint(complex_of(lambda), report);
        let held = self.model.discretisation().holding.as_ref();
        let extent =
            Extent { moving: &self.moving, triangles: held.map(|held| held.own_triangles.as_slice()) };
        let mut gradient = adjoint::gradient_of(&self.model, mesh, &state, &lambda, &extent);
        ranks.sum(gradient.as_flattened_mut());
        Ok(if ranks.rank() == 0 { gradient.into_flattened() } else { Vec::new() })
    }
}

impl Part for FieldPart {
    fn work(&mut self, order: &Order, ranks: &dyn Communicator) -> Result<Vec<f64>, String> {
        match order.kind {
            ASSEMBLE => {
                let points = order.numbers.as_chunks::<3>().0.to_vec();
                let mesh = Mesh::new(std::sync::Arc::clone(self.model.topology()), points);
                let mesh = self.mesh.insert(mesh.map_err(|error| error.to_string())?);
                let matrix: CsrMatrix<_> = self.model.assemble(mesh);
                self.matrix.set(&matrix.values, ranks)?;
            }
            SOLVE => return self.matrix.solve(&order.numbers, ranks),
            MOVING => {
                let moving: Vec<ElementId> = order.numbers.iter().map(|&e| ElementId(e as u32)).collect();
                self.moving = self.share.own_among(&moving);
            }
            DIFFERENTIATE => return self.differentiate(&order.numbers, ranks),
            other => return Err(format!("a field problem knows no order {other}")),
        }
        Ok(Vec::new())
    }
}
