//! Initial and best shape of a run, for another mesh of the same device.

use fluxmorph_geometry::tet4::{Point, norm, sub};
use fluxmorph_optimizer::Error as OptimizerError;
use fluxmorph_optimizer::design::Triangulation;

use crate::build::{Setup, design_triangulation};
use crate::config::Config;
use crate::error::Error;
use crate::files::ShapeDeviation;

/// Initial and best shape of a run, in a form that another mesh can take.
#[derive(Clone, Debug, PartialEq)]
pub enum ShapePair {
    /// The initial shape is the best.
    Unchanged,
    /// It is not.
    Changed(Box<Change>),
}

/// Two shapes of a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Variables of a control grid [m], where the design has one.
    variables: Option<[Vec<f64>; 2]>,
    /// The undeformed surface.
    surface: Triangulation,
    /// Displacements of its nodes [m], each of shape `(n_nodes, 3)`.
    displacements: [Vec<Point>; 2],
    /// How far the facets of the best shape are from the surface that a control grid describes.
    facet_deviation: Option<ShapeDeviation>,
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
        let surface = design_triangulation(design, &setup.full_mesh)?;
        let pair = [shape.initial(), best];
        let displacements = pair.map(|p| shape.displacement(p));
        let distance_m = shape.surface().distance_from_facets(&surface, best);
        let facet_deviation = distance_m.map(|distance_m| ShapeDeviation {
            distance_m,
            motion_m: longest(displacements[1].iter().copied()),
        });
        Ok(Self::Changed(Box::new(Change {
            variables: design.grid.is_some().then(|| pair.map(<[f64]>::to_vec)),
            surface,
            displacements,
            facet_deviation,
        })))
    }

    /// How far the facets of the best shape are from the surface that a control grid describes; `None` without one.
    pub(super) fn facet_deviation(&self) -> Option<ShapeDeviation> {
        let Self::Changed(change) = self else { return None };
        change.facet_deviation
    }

    /// Both shapes on another mesh of the same configuration.
    pub(super) fn on(&self, config: &Config, setup: &Setup) -> Result<ShapesOnMesh, Error> {
        let (Some(design), Some(shape)) = (&config.design, setup.problem.shape()) else {
            return Ok(ShapesOnMesh::default());
        };
        let Self::Changed(change) = self else {
            let displacements = [shape.initial(), shape.initial()].map(|p| shape.displacement(p));
            return Ok(ShapesOnMesh { displacements, ..ShapesOnMesh::default() });
        };
        let fresh = design_triangulation(design, &setup.full_mesh)?;
        let [initial, best] = &change.displacements;
        let best = change.surface.transfer(best, &fresh);
        let Some(variables) = &change.variables else {
            let initial = change.surface.transfer(initial, &fresh).map_err(OptimizerError::from)?;
            let displacements = [initial, best.map_err(OptimizerError::from)?];
            return Ok(ShapesOnMesh { displacements, ..ShapesOnMesh::default() });
        };
        let displacements = variables.each_ref().map(|p| shape.displacement(p));
        // A surface that is found on no piece of the old one is brought to its shape by the grid all the same.
        let deviation = best.ok().map(|best| deviation(&best, &displacements[1]));
        Ok(ShapesOnMesh { displacements, deviation })
    }
}

/// Both shapes of a run on another mesh.
#[derive(Default)]
pub(super) struct ShapesOnMesh {
    /// Displacements of its design nodes [m], each of shape `(n_design, 3)`.
    pub(super) displacements: [Vec<Point>; 2],
    /// How far the best shape of a control grid is from that on the run's mesh.
    pub(super) deviation: Option<ShapeDeviation>,
}

/// How far displacements of nodes are from those of a surface that the same control grid moves.
fn deviation(old: &[Point], fresh: &[Point]) -> ShapeDeviation {
    ShapeDeviation {
        distance_m: longest(old.iter().zip(fresh).map(|(&a, &b)| sub(a, b))),
        motion_m: longest(fresh.iter().copied()),
    }
}

/// The length of the longest vector [its unit].
fn longest(vectors: impl Iterator<Item = Point>) -> f64 {
    vectors.map(norm).fold(0.0, f64::max)
}
