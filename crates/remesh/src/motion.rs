//! The motion of a mesh over rounds: which mesh is the reference, at which design, and the elastic map
//! that is frozen on it.
//!
//! Within a round every mesh is `x = X_r + Δx(Δx_b − Δx_b,r)`: `X_r` the reference of the round, `Δx_b,r` the design
//! displacement of that reference (the *reference design*), `Δx` the affine map of Eq. 3 frozen on `X_r`. That is what makes an
//! objective a function of the design and its gradient exact. [`Motion::rebased`] starts the next round on a mesh that
//! was reached: stiffness and factor are new, pattern and symbolic factor stay. The fictitious force acts in the first
//! step only, else it would be taken again with every round. When a round ends is not decided here, but by
//! [`crate::load_stepping`] on a given path, and by an optimiser on its own.

use std::sync::Arc;

use fluxmorph_geometry::quality::{QualityReport, quality};
use fluxmorph_geometry::tet4::{Point, add, sub};
use fluxmorph_geometry::{ElementId, Mesh, NodeId};
use rayon::prelude::*;

use crate::deform::{ElasticMap, KinematicConstraint, MotionLaw, RemeshSetup};
use crate::equilibrium::EnergyLaw;
use crate::error::RemeshError;
use crate::guard::{StepToInversion, check_step, step_to_inversion};
use crate::hyperelastic::Hyperelastic;
use crate::load_stepping::StepLimits;
use crate::policy::StiffnessPolicy;
use crate::rails::Rails;
use crate::smoothing::least_shape;

/// Halvings in the search for the share of a step that keeps a quality: to a thousandth of the step.
const SHARE_BITS: usize = 10;

/// Whether the fictitious force is still to be taken: it acts once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Force {
    Due,
    Taken,
}

/// A mesh that follows a design, in its present round. A clone shares the factor.
#[derive(Clone, Debug)]
pub struct Motion {
    /// The mesh of no motion at all: its elements are the shapes to keep.
    original: Mesh,
    reference: Mesh,
    displacement: Vec<Point>,
    reference_design: Vec<Point>,
    map: Arc<ElasticMap>,
    /// The law by which the mesh is one function of the design, where that is the law.
    law: Option<Arc<dyn EnergyLaw>>,
    moving: Arc<[ElementId]>,
    force: Force,
    round: usize,
}

/// The mesh of a design.
#[derive(Clone, Debug)]
pub struct Moved {
    /// The mesh.
    pub mesh: Mesh,
    /// Displacement of every node from the original mesh [m], shape `(n_nodes, 3)`.
    pub displacement: Vec<Point>,
    /// First inversion along the straight motion from the round's reference, as a multiple of it.
    pub inversion: StepToInversion,
    /// The derivative of the displacements by those of the design nodes; `None` where nothing moves.
    pub tangent: Option<Arc<ElasticMap>>,
    /// Newton steps to the mesh; none by the linear law.
    pub newton_steps: usize,
}

impl Moved {
    /// `dF/dΔx_b` at the design nodes, shape `(n_design, 3)`, from `∂F/∂x` at all nodes of this mesh, shape `(n_nodes, 3)`;
    /// empty where nothing moves.
    ///
    /// # Errors
    /// As [`ElasticMap::gradient`].
    pub fn pull_back(&self, nodal: &[Point]) -> Result<Vec<Point>, RemeshError> {
        self.tangent.as_ref().map_or(Ok(Vec::new()), |tangent| tangent.gradient(nodal))
    }
}

impl Motion {
    /// The first round, on the undeformed mesh.
    ///
    /// # Errors
    /// As [`ElasticMap::new`].
    pub fn new(original: Mesh, setup: RemeshSetup) -> Result<Self, RemeshError> {
        let kinematic_constraint = match setup.law {
            MotionLaw::Linear => {
                let map = Arc::new(ElasticMap::new(&original, setup)?);
                return Ok(Self::start(original, map));
            }
            MotionLaw::Rails(axis) => KinematicConstraint::Axis(axis),
            MotionLaw::Hyperelastic => KinematicConstraint::Free,
        };
        let map = ElasticMap::new(&original, RemeshSetup { kinematic_constraint, ownership: None, ..setup })?;
        let law: Arc<dyn EnergyLaw> = match kinematic_constraint {
            KinematicConstraint::Axis(axis) => Arc::new(Rails::new(&original, &map, axis)?),
            KinematicConstraint::Free => Arc::new(Hyperelastic::new(&original, &map)?),
        };
        let motion = Self::start(original, Arc::clone(law.rest()));
        Ok(Self { law: Some(law), ..motion })
    }

    /// The first round with its map.
    fn start(original: Mesh, map: Arc<ElasticMap>) -> Self {
        let moving = Arc::clone(map.moving());
        let reference_design = vec![[0.0; 3]; map.design_nodes().len()];
        let displacement = vec![[0.0; 3]; original.points().len()];
        Self {
            reference: original.clone(),
            original,
            displacement,
            reference_design,
            map,
            law: None,
            moving,
            force: Force::Due,
            round: 0,
        }
    }

    /// The next round, on a mesh that this one reached: `displacement` is that of every node from the original mesh,
    /// `design` that of the design nodes [m].
    ///
    /// # Errors
    /// As [`ElasticMap::rebased`].
    ///
    /// # Panics
    /// If the mesh has another topology, or a displacement another length.
    pub fn rebased(
        &self,
        reference: Mesh,
        displacement: Vec<Point>,
        design: Vec<Point>,
        policy: StiffnessPolicy,
    ) -> Result<Self, RemeshError> {
        assert_eq!(displacement.len(), reference.points().len(), "one displacement per node");
        assert_eq!(design.len(), self.reference_design.len(), "one displacement per design node");
        let map = Arc::new(self.map.rebased(&reference, policy)?);
        let (original, moving) = (self.original.clone(), Arc::clone(&self.moving));
        let (force, round) = (Force::Taken, self.round + 1);
        let (reference_design, law) = (design, None);
        Ok(Self { original, reference, displacement, reference_design, map, law, moving, force, round })
    }

    /// This motion, counted as the round after another.
    pub(crate) fn after(self, other: &Self) -> Self {
        Self { round: other.round + 1, ..self }
    }

    /// The first round again, on the undeformed mesh.
    ///
    /// # Errors
    /// As [`Motion::new`].
    pub fn restarted(&self) -> Result<Self, RemeshError> {
        if self.law.is_some() {
            return Ok(self.clone());
        }
        let map = Arc::new(self.map.restarted(&self.original)?);
        Ok(Self::start(self.original.clone(), map))
    }

    /// The same design with another stiffness: a round of its own.
    ///
    /// # Errors
    /// As [`ElasticMap::rebased`].
    pub fn with_policy(&self, policy: StiffnessPolicy) -> Result<Self, RemeshError> {
        self.with_reference(self.reference.clone(), self.displacement.clone(), policy)
    }

    /// Another mesh, or another stiffness, at the same design.
    pub(crate) fn with_reference(
        &self,
        reference: Mesh,
        displacement: Vec<Point>,
        policy: StiffnessPolicy,
    ) -> Result<Self, RemeshError> {
        let motion = self.rebased(reference, displacement, self.reference_design.clone(), policy)?;
        Ok(Self { force: self.force, ..motion })
    }

    /// Displacement of every node from the round's reference [m], shape `(n_nodes, 3)`, for displacements of the design
    /// nodes from the original mesh [m], shape `(n_design, 3)`; whether or not that leaves a valid mesh.
    ///
    /// # Errors
    /// As [`ElasticMap::linear`].
    ///
    /// # Panics
    /// If there is not one displacement per design node.
    pub fn step(&self, design: &[Point]) -> Result<Vec<Point>, RemeshError> {
        assert_eq!(design.len(), self.reference_design.len(), "one displacement per design node");
        if let Some(law) = &self.law {
            return Ok(law.equilibrium(design)?.displacement);
        }
        let change: Vec<Point> =
            design.iter().zip(&self.reference_design).map(|(u, reference)| sub(*u, *reference)).collect();
        match self.force {
            Force::Due => self.map.displacement(&change),
            Force::Taken => self.map.linear(&change),
        }
    }

    /// The round's reference as a mesh of the round: what no step at all leads to.
    pub(crate) fn at_reference(&self) -> Moved {
        Moved {
            mesh: self.reference.clone(),
            displacement: self.displacement.clone(),
            inversion: StepToInversion::NEVER,
            tangent: Some(Arc::clone(&self.map)),
            newton_steps: 0,
        }
    }

    /// The mesh of a design.
    ///
    /// # Errors
    /// [`RemeshError::Inverted`] names the first element to invert and the share of the step that can be taken.
    ///
    /// # Panics
    /// If there is not one displacement per design node.
    pub fn moved(&self, design: &[Point]) -> Result<Moved, RemeshError> {
        if let Some(law) = &self.law {
            return self.at(law.equilibrium(design)?);
        }
        let step = self.step(design)?;
        self.apply(&step, self.inversion(&step))
    }

    /// The mesh after a step from the round's reference, whose first inversion is known.
    pub(crate) fn apply(&self, step: &[Point], inversion: StepToInversion) -> Result<Moved, RemeshError> {
        let mesh = check_step(&self.reference, step)?;
        let displacement = self.displacement.iter().zip(step).map(|(u, step)| add(*u, *step)).collect();
        Ok(Moved { mesh, displacement, inversion, tangent: Some(Arc::clone(&self.map)), newton_steps: 0 })
    }

    /// First inversion along a step from the round's reference.
    pub fn inversion(&self, step: &[Point]) -> StepToInversion {
        step_to_inversion(&self.reference, step)
    }

    /// Largest share of a step from the round's reference that keeps the limits; 1 for the whole step.
    pub fn admissible_share(&self, step: &[Point], limits: &StepLimits) -> f64 {
        let most = (limits.inversion_share * self.inversion(step).step).min(1.0);
        let keeps = |share: f64| {
            let vertex = |n: NodeId| {
                let (x, u) = (self.reference.point(n), step[n.index()]);
                [0, 1, 2].map(|d| x[d] + share * u[d])
            };
            let topology = self.reference.topology();
            self.moving.par_iter().all(|&e| quality(topology.tet(e).map(vertex)) >= limits.least_quality)
        };
        if limits.least_quality <= 0.0 || keeps(most) {
            return most;
        }
        let (mut low, mut high) = (0.0, most);
        for _ in 0..SHARE_BITS {
            let middle = 0.5 * (low + high);
            if keeps(middle) { low = middle } else { high = middle }
        }
        low
    }

    /// Quality of the elements that may move, on a mesh of this topology.
    pub fn quality(&self, mesh: &Mesh) -> QualityReport {
        self.map.quality(mesh)
    }

    /// Elements of the elastic body, and those beside it that share a node that may move: faces at which the body ends
    /// move too where they are listed as sliding or free. Ascending.
    pub fn moving(&self) -> &[ElementId] {
        &self.moving
    }

    /// Least share of its original shape that an element of the elastic body has on a mesh of this topology: 1 where all
    /// are similar to those of the original mesh.
    pub fn shape(&self, mesh: &Mesh) -> f64 {
        least_shape(mesh, &self.original, self.map.elements())
    }

    /// The undeformed mesh.
    pub fn original(&self) -> &Mesh {
        &self.original
    }

    /// The reference mesh of the round.
    pub fn reference(&self) -> &Mesh {
        &self.reference
    }

    /// Displacement of the reference mesh from the original one [m], shape `(n_nodes, 3)`.
    pub fn reference_displacement(&self) -> &[Point] {
        &self.displacement
    }

    /// Displacement of the design nodes of the reference [m], shape `(n_design, 3)`.
    pub fn reference_design(&self) -> &[Point] {
        &self.reference_design
    }

    /// The law by which the mesh is one function of the design, where that is the law.
    pub(crate) fn energy_law(&self) -> Option<&dyn EnergyLaw> {
        self.law.as_deref()
    }

    /// How the mesh follows the design: in a round after the first by a linear map.
    pub fn law(&self) -> MotionLaw {
        match &self.law {
            Some(_) => self.map.setup().law,
            None => MotionLaw::Linear,
        }
    }

    /// Whether all meshes follow from the undeformed one by one function of the design: there are no rounds.
    pub fn is_one_function(&self) -> bool {
        self.law.is_some()
    }

    /// The elastic map of the round; that of a mesh at rest on rails.
    pub fn map(&self) -> &ElasticMap {
        &self.map
    }

    /// Rounds begun before this one.
    pub fn round(&self) -> usize {
        self.round
    }

    /// How stiffness follows element size in this round.
    pub fn policy(&self) -> StiffnessPolicy {
        self.map.policy()
    }
}
