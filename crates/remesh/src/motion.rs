//! The mesh of a design: one function of the displacements of the design nodes, by the law of the set-up.

use std::sync::Arc;

use fluxmorph_geometry::quality::QualityReport;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, Mesh};

use crate::deform::{ElasticMap, KinematicConstraint, MotionLaw, RemeshSetup};
use crate::equilibrium::{EnergyLaw, Equilibrium};
use crate::error::RemeshError;
use crate::guard::{StepToInversion, check_step, step_to_inversion};
use crate::hyperelastic::Hyperelastic;
use crate::linear::Linear;
use crate::rails::Rails;

/// A mesh that follows a design. A clone shares the factor.
#[derive(Clone, Debug)]
pub struct Motion {
    original: Mesh,
    law: Arc<dyn EnergyLaw>,
}

/// The mesh of a design.
#[derive(Clone, Debug)]
pub struct Moved {
    /// The mesh.
    pub mesh: Mesh,
    /// Displacement of every node from the undeformed mesh [m], shape `(n_nodes, 3)`.
    pub displacement: Vec<Point>,
    /// First inversion along the straight motion from the undeformed mesh, as a multiple of it.
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
    /// The law of a set-up on the undeformed mesh.
    ///
    /// # Errors
    /// As [`ElasticMap::new`].
    pub fn new(original: Mesh, setup: RemeshSetup) -> Result<Self, RemeshError> {
        let alone = |kinematic_constraint: KinematicConstraint| {
            let setup = RemeshSetup { kinematic_constraint, ownership: None, ..setup.clone() };
            ElasticMap::new(&original, setup)
        };
        let law: Arc<dyn EnergyLaw> = match setup.law {
            MotionLaw::Linear => Arc::new(Linear::new(&original, ElasticMap::new(&original, setup)?)),
            MotionLaw::Rails(axis) => {
                let map = alone(KinematicConstraint::Axis(axis))?;
                Arc::new(Rails::new(&original, &map, axis)?)
            }
            MotionLaw::Hyperelastic => {
                Arc::new(Hyperelastic::new(&original, &alone(KinematicConstraint::Free)?)?)
            }
        };
        Ok(Self { original, law })
    }

    /// Displacement of every node [m], shape `(n_nodes, 3)`, for displacements of the design nodes [m], shape `(n_design, 3)`;
    /// whether or not that leaves a valid mesh.
    ///
    /// # Errors
    /// [`RemeshError::NotSettled`]; as [`ElasticMap::linear`].
    ///
    /// # Panics
    /// If there is not one displacement per design node.
    pub fn displacement(&self, design: &[Point]) -> Result<Vec<Point>, RemeshError> {
        Ok(self.law.equilibrium(design)?.displacement)
    }

    /// The mesh of a design.
    ///
    /// # Errors
    /// [`RemeshError::Inverted`] names the first element to invert and the share of the motion that can be taken;
    /// [`RemeshError::NotSettled`], and as [`ElasticMap::linear`].
    ///
    /// # Panics
    /// If there is not one displacement per design node.
    pub fn moved(&self, design: &[Point]) -> Result<Moved, RemeshError> {
        self.at(self.law.equilibrium(design)?)
    }

    /// The mesh of an equilibrium.
    ///
    /// # Errors
    /// [`RemeshError::Inverted`].
    pub(crate) fn at(&self, equilibrium: Equilibrium) -> Result<Moved, RemeshError> {
        let Equilibrium { displacement, tangent, steps, .. } = equilibrium;
        let mesh = check_step(&self.original, &displacement)?;
        let inversion = step_to_inversion(&self.original, &displacement);
        Ok(Moved { mesh, displacement, inversion, tangent: Some(tangent), newton_steps: steps })
    }

    /// Quality of the elements that may move, on a mesh of this topology.
    pub fn quality(&self, mesh: &Mesh) -> QualityReport {
        self.map().quality(mesh)
    }

    /// Elements of the elastic body, and those beside it that share a node that may move: faces at which the body ends
    /// move too where they are listed as sliding or free. Ascending.
    pub fn moving(&self) -> &[ElementId] {
        self.map().moving()
    }

    /// The undeformed mesh.
    pub fn original(&self) -> &Mesh {
        &self.original
    }

    /// The law on the undeformed mesh.
    pub(crate) fn energy_law(&self) -> &dyn EnergyLaw {
        &*self.law
    }

    /// How the mesh follows the design.
    pub fn law(&self) -> MotionLaw {
        self.map().setup().law
    }

    /// The tangent of the mesh at rest: the elastic map itself by the linear law.
    pub fn map(&self) -> &ElasticMap {
        self.law.rest()
    }
}
