//! A distributed field problem as rank 0 has it: the commands that all ranks carry out.

use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, PoisonError};

use fluxmorph_geometry::ElementId;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::parallel::{CommandChannel, CommandHandler, RankGroup, numbers_of};
use fluxmorph_geometry::tet4::Point;

use crate::error::SolverError;
use crate::linear::{DistributedSystem, LinearSolverSettings};

/// The command to assemble and factor with nodes at the given places.
pub(super) const ASSEMBLE: u32 = 2;
/// The command to take the given elements as those that may move.
pub(super) const MOVING: u32 = 3;
/// The command to differentiate, for the given state and adjoint.
pub(super) const DIFFERENTIATE: u32 = 4;

/// First number of [`DIFFERENTIATE`]: sources and prescribed values act in the state.
pub(super) const STATE: f64 = 0.0;
/// First number of [`DIFFERENTIATE`]: it is the response to 1 A.
pub(super) const RESPONSE: f64 = 1.0;

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
    /// Distributes a problem, whose commands are carried out by `follower`; every rank does.
    pub(crate) fn new(group: &RankGroup, follower: Box<dyn CommandHandler>) -> Self {
        Self { channel: Arc::new(group.register(follower)), moving: Mutex::default(), taken: Arc::default() }
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

    /// The gradient at every node ([`crate::adjoint::node_gradient`]) on the mesh of the last [`Distributed::prepare`], every rank on
    /// its elements. Sources act in a `state`; otherwise it is the response to 1 A.
    ///
    /// # Errors
    /// [`SolverError::Rank`].
    pub(crate) fn node_gradient(
        &self,
        is_state: bool,
        [state, adjoint]: [&[c64]; 2],
        moving: &[ElementId],
    ) -> Result<Vec<Point>, SolverError> {
        let mut known = self.moving.lock().unwrap_or_else(PoisonError::into_inner);
        if known.as_deref() != Some(moving) {
            self.channel.execute(MOVING, moving.iter().map(|e| f64::from(e.0)).collect())?;
            *known = Some(moving.to_vec());
        }
        let role = if is_state { STATE } else { RESPONSE };
        let fields = numbers_of(state).chain(numbers_of(adjoint));
        let numbers = std::iter::once(role).chain(fields).collect();
        let sum = self.channel.execute(DIFFERENTIATE, numbers)?;
        Ok(sum.as_chunks::<3>().0.to_vec())
    }
}
