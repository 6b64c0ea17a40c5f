//! Initial and best shape of a run, for another mesh of the same device.

use fluxmorph_geometry::tet4::Point;
use fluxmorph_optimizer::Error as OptimizerError;
use fluxmorph_optimizer::design::Triangulation;

use crate::build::{Setup, design_triangulation};
use crate::config::Config;
use crate::error::Error;

/// Initial and best shape of a run, in a form that another mesh can take.
#[derive(Clone, Debug, PartialEq)]
pub enum ShapePair {
    /// The initial shape is the best.
    Unchanged,
    /// Variables of a control grid [m].
    Variables([Vec<f64>; 2]),
    /// Displacements of a surface's nodes [m], each of shape `(n_nodes, 3)`.
    Displacements {
        /// The undeformed surface.
        surface: Box<Triangulation>,
        /// One displacement per node.
        pair: [Vec<Point>; 2],
    },
}

impl ShapePair {
    /// The initial shape of a run that has been set up, and its best one.
    ///
    /// # Errors
    /// When the design surface is not one of the mesh's.
    ///
    /// # Panics
    /// If `best` has another length than there are variables.
    pub fn of(config: &Config, setup: &Setup, best: &[f64]) -> Result<Self, Error> {
        let (Some(design), Some(shape)) = (&config.design, setup.problem.shape()) else {
            return Ok(Self::Unchanged);
        };
        if best == shape.initial() {
            return Ok(Self::Unchanged);
        }
        if design.grid.is_some() {
            return Ok(Self::Variables([shape.initial().to_vec(), best.to_vec()]));
        }
        let surface = Box::new(design_triangulation(design, &setup.full_mesh)?);
        Ok(Self::Displacements { surface, pair: [shape.initial(), best].map(|p| shape.displacement(p)) })
    }

    /// Displacements of the design nodes of another mesh of the same configuration [m], each of shape `(n_design, 3)`.
    pub(super) fn displacements(&self, config: &Config, setup: &Setup) -> Result<[Vec<Point>; 2], Error> {
        let (Some(design), Some(shape)) = (&config.design, setup.problem.shape()) else {
            return Ok(Default::default());
        };
        match self {
            Self::Unchanged => Ok([shape.initial(), shape.initial()].map(|p| shape.displacement(p))),
            Self::Variables(pair) => Ok(pair.each_ref().map(|p| shape.displacement(p))),
            Self::Displacements { surface, pair: [initial, best] } => {
                let fresh = design_triangulation(design, &setup.full_mesh)?;
                let transferred = [initial, best].map(|values| surface.transfer(values, &fresh));
                let [initial, best] = transferred.map(|values| values.map_err(OptimizerError::from));
                Ok([initial?, best?])
            }
        }
    }
}
