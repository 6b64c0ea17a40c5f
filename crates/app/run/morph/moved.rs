//! A mesh moved along the path of a set-up: by the linear law as far as the path goes, whatever becomes of the elements; by the
//! others as far as they carry it.

use std::sync::Arc;

use fluxmorph_geometry::tet4::{Point, add, volume};
use fluxmorph_geometry::{ElementId, Topology};
use fluxmorph_remesh::{Carried, Motion, MotionLaw, RemeshError, StepToInversion, step_to_inversion};

use crate::build::MotionSetup;
use crate::error::Error;

/// The result of a motion. By the linear law the mesh may have inverted elements.
#[derive(Debug)]
pub struct MovedMesh {
    /// Connectivity and regions.
    pub topology: Arc<Topology>,
    /// The undeformed mesh [m].
    pub before: Vec<Point>,
    /// The mesh reached [m].
    pub after: Vec<Point>,
    /// Displacement between the two [m].
    pub displacement: Vec<Point>,
    /// Elements of the elastic body, ascending.
    pub body: Vec<ElementId>,
    /// Number of equations of the elastic body.
    pub equations: usize,
    /// First inversion along the straight motion of the whole path, as a multiple of it.
    pub inversion: StepToInversion,
    /// Share of the path that was reached: 1 for all.
    pub reached: f64,
    /// Newton steps taken.
    pub newton_steps: usize,
    /// Elements without a positive volume, of the whole mesh.
    pub inverted: usize,
}

/// Moves the mesh along the path of a set-up.
///
/// # Errors
/// Whatever the law of motion refuses.
pub fn move_mesh(setup: &MotionSetup) -> Result<MovedMesh, Error> {
    let motion = Motion::new(setup.mesh.clone(), setup.remesh.clone())?;
    let (displacement, reached, newton_steps) = match motion.law() {
        MotionLaw::Linear => (motion.displacement(&setup.path.at(1.0))?, 1.0, 0),
        MotionLaw::Rails(_) | MotionLaw::Hyperelastic => {
            let (reached, moved) = match motion.moved(&setup.path.at(1.0)) {
                Err(RemeshError::Inverted { .. } | RemeshError::NotSettled { .. }) => {
                    let Carried { share, moved, .. } = motion.carried_along(&|t| setup.path.at(t))?;
                    (share, moved)
                }
                moved => (1.0, moved?),
            };
            (moved.displacement, reached, moved.newton_steps)
        }
    };
    let inversion = step_to_inversion(&setup.mesh, &displacement);
    let topology = Arc::clone(setup.mesh.topology());
    let before = setup.mesh.points().to_vec();
    let after: Vec<Point> = before.iter().zip(&displacement).map(|(x, u)| add(*x, *u)).collect();
    let inverted = topology.tets().iter().filter(|tet| volume(tet.map(|n| after[n.index()])) <= 0.0).count();
    Ok(MovedMesh {
        topology,
        before,
        after,
        displacement,
        body: motion.map().elements().to_vec(),
        equations: motion.map().equation_count(),
        inversion: StepToInversion { step: reached * inversion.step, ..inversion },
        reached,
        newton_steps,
        inverted,
    })
}
