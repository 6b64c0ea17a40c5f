//! What a rank does of a distributed field problem.

use std::sync::Arc;

use fluxmorph_geometry::fem::CsrMatrix;
use fluxmorph_geometry::parallel::{
    Command, CommandHandler, Communicator, DistributedMatrix, Ownership, RowLayout, Rows, complex_of,
};
use fluxmorph_geometry::{CarrierId, ElementId, Mesh};

use super::leader::{ASSEMBLE, DIFFERENTIATE, MOVING, STATE};
use crate::adjoint::{self, Extent};
use crate::linear::distributed::SOLVE;
use crate::linear::{DistributedMethod, DistributedSettings, LinearSolverReport};
use crate::model::FieldModel;
use crate::solution::FieldSolution;

/// Iterations after which an iteration gives up: twice what Schwarz's method without a coarse level took on thin elements (docs/scale.md).
const MAX_ITERATIONS: usize = 3000;

/// What a rank holds of a field problem.
pub(crate) struct Follower {
    model: FieldModel,
    ownership: Ownership,
    matrix: DistributedMatrix,
    mesh: Option<Mesh>,
    /// Those of the elements that may move which the rank owns, ascending.
    moving: Vec<ElementId>,
}

impl Follower {
    /// Of a problem that every rank has set up on a reference mesh.
    pub(crate) fn new(
        model: FieldModel,
        reference: &Mesh,
        ownership: Ownership,
        settings: &DistributedSettings,
    ) -> Self {
        let discretisation = model.discretisation();
        let (space, dofs) = (&discretisation.space, &discretisation.unknowns.dofs);
        let owner = |carrier: CarrierId| ownership.partition.owner_of(space.vertices_of(carrier)[0]);
        let layout = Arc::new(RowLayout::new(dofs, ownership.group.size(), ownership.group.rank(), owner));
        let coarse = match settings.method_for(dofs.count()) {
            DistributedMethod::Direct => None,
            DistributedMethod::Schwarz => discretisation.coarse_space_of(&layout, model.form(), reference),
        };
        let structure = Arc::clone(discretisation.pattern.structure());
        let rows = Rows { structure, layout, coarse: coarse.map(Arc::new) };
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
        let mut gradient = adjoint::gradient_of((&self.model, mesh, &state), &lambda, &extent);
        ranks.sum(gradient.as_flattened_mut());
        Ok(if ranks.rank() == 0 { gradient.into_flattened() } else { Vec::new() })
    }
}

impl CommandHandler for Follower {
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
