//! Bodies on which force and torque are reported with every evaluation.

use std::collections::BTreeMap;

use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{Mesh, NodeId, RegionId};
use fluxmorph_solver::functional::{Force, resultant};
use fluxmorph_solver::{FieldModel, FieldState, RigidMotion, SolverError};
use serde::{Deserialize, Serialize};

/// A body with the layer of elements in which its force is taken.
#[derive(Clone, Debug)]
pub struct Body {
    name: String,
    /// The point that the torque is taken about [m].
    about: Point,
    /// What it is made of.
    regions: Vec<RegionId>,
    force: Force,
}

/// Force and torque on a body, of the meshed part; in harmonics the time average.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyForce {
    /// The body.
    pub name: String,
    /// The load case, [`FieldModel::label`]; `None` in the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<String>,
    /// [N].
    pub force_n: Point,
    /// About the body's point [N m].
    pub torque_nm: Point,
}

impl Body {
    /// The body that some regions make up.
    ///
    /// # Errors
    /// As [`Force::new`].
    pub fn new(
        model: &FieldModel,
        mesh: &Mesh,
        name: &str,
        regions: &[RegionId],
        about: Point,
    ) -> Result<Self, SolverError> {
        // Which motion does not matter: the forces at the nodes hold all of them.
        let force = Force::new(model, mesh, name, regions, RigidMotion::Translation([0.0, 0.0, 1.0]))?;
        Ok(Self { name: name.to_owned(), about, regions: regions.to_vec(), force })
    }

    /// Whether a region is a part of both.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.regions.iter().any(|own| other.regions.contains(own))
    }

    /// What acts on its nodes [N].
    pub fn nodal(&self, state: FieldState<'_>) -> BTreeMap<NodeId, Point> {
        self.force.nodal(state)
    }

    /// No force, under its name.
    pub(crate) fn at_rest(&self) -> BodyForce {
        BodyForce { name: self.name.clone(), state: None, force_n: [0.0; 3], torque_nm: [0.0; 3] }
    }

    /// Its force and torque.
    pub fn force(&self, (model, mesh, solution): FieldState<'_>) -> BodyForce {
        let [force_n, torque_nm] = resultant(&self.nodal((model, mesh, solution)), mesh, self.about);
        BodyForce { name: self.name.clone(), state: None, force_n, torque_nm }
    }
}

impl BodyForce {
    /// The columns of the history: `force_NAME_x_n` …, `torque_NAME_x_nm` …, with their values; of further load cases with their
    /// label behind.
    pub fn columns(&self) -> impl Iterator<Item = (String, f64)> + '_ {
        let behind = self.state.as_ref().map_or(String::new(), |state| format!("_{state}"));
        let of = |what: &'static str, unit: &'static str, values: Point| {
            ["x", "y", "z"]
                .into_iter()
                .zip(values)
                .map(|(axis, v)| (format!("{what}_{}_{axis}_{unit}{behind}", self.name), v))
                .collect::<Vec<_>>()
        };
        [of("force", "n", self.force_n), of("torque", "nm", self.torque_nm)].into_iter().flatten()
    }
}
