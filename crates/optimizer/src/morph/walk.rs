//! The way of a mesh along a path: one increment, a number of equal ones, or as many as it asks for.

use std::ops::ControlFlow;
use std::sync::Arc;

use fluxmorph_geometry::tet4::{Point, add, volume};
use fluxmorph_geometry::{ElementId, Topology};
use fluxmorph_remesh::{
    Event, Limits, Motion, RemeshError, Rescue, StepToInversion, StiffnessPolicy, Travelled,
};

use crate::config::Increments;
use crate::error::Error;
use crate::setup::MotionSetup;

/// Where a motion came to. The mesh may have inverted elements: then there was no increment left to refuse them in.
#[derive(Debug)]
pub struct Walk {
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
    /// How much of the path is done: 1 for all.
    pub reached: f64,
    /// Increments taken, each with a stiffness of its own.
    pub increments: usize,
    /// Remedies taken on the way.
    pub rescues: usize,
    /// Elements without a positive volume, of the whole mesh.
    pub inverted: usize,
}

/// Moves the mesh along the path of a set-up.
///
/// `tell` is told what happens on the way, a line each.
///
/// # Errors
/// Whatever the elastic map refuses.
pub fn walk(
    setup: &MotionSetup,
    increments: Increments,
    least_quality: f64,
    tell: &mut dyn FnMut(&str),
) -> Result<Walk, Error> {
    let path = |t: f64| setup.path.at(t);
    let motion = Motion::new(setup.mesh.clone(), setup.remesh.clone())?;
    let step = motion.step(&path(1.0))?;
    let inversion = motion.inversion(&step);
    let (body, equations) = (motion.map().elements().to_vec(), motion.map().equation_count());
    let (displacement, reached, taken, rescues) = match increments {
        Increments::Count(1) => (step, 1.0, 1, 0),
        Increments::Count(count) => equal(motion, &path, count)?,
        Increments::Auto(_) => {
            let limits = Limits { least_quality, ..Limits::default() };
            let Travelled { moved, reached, steps, rescues, .. } =
                motion.travel(&path, &limits, &mut |event| {
                    tell(&line(event));
                    ControlFlow::Continue(())
                })?;
            (moved.displacement, reached, steps, rescues)
        }
    };
    let topology = Arc::clone(setup.mesh.topology());
    let before = setup.mesh.points().to_vec();
    let after: Vec<Point> = before.iter().zip(&displacement).map(|(x, u)| add(*x, *u)).collect();
    let inverted = topology.tets().iter().filter(|tet| volume(tet.map(|n| after[n.index()])) <= 0.0).count();
    Ok(Walk {
        topology,
        before,
        after,
        displacement,
        body,
        equations,
        inversion,
        reached,
        increments: taken,
        rescues,
        inverted,
    })
}

/// Equal parts of the path, each from the mesh that the one before left: displacement of all nodes from the undeformed
/// mesh, share of the path done, increments taken, remedies. An increment before the last that breaks the mesh is not
/// taken, and ends the way.
fn equal(
    mut motion: Motion,
    path: &dyn Fn(f64) -> Vec<Point>,
    count: usize,
) -> Result<(Vec<Point>, f64, usize, usize), RemeshError> {
    for k in 1..count {
        let t = k as f64 / count as f64;
        let moved = match motion.moved(&path(t)) {
            Ok(moved) => moved,
            Err(RemeshError::Inverted { .. }) => {
                let reached = (k - 1) as f64 / count as f64;
                return Ok((motion.reference_displacement().to_vec(), reached, k - 1, 0));
            }
            Err(other) => return Err(other),
        };
        motion = motion.rebased(moved.mesh, moved.displacement, path(t), motion.policy())?;
    }
    let step = motion.step(&path(1.0))?;
    let whole = motion.reference_displacement().iter().zip(step).map(|(u, step)| add(*u, step)).collect();
    Ok((whole, 1.0, count, 0))
}

fn line(event: &Event) -> String {
    match event {
        Event::Stepped { round, reached, share, quality, .. } => format!(
            "increment {}: {:.1} % of the motion, {:.0} % of the way to an inversion, worst quality {quality:.4}",
            round + 1,
            reached * 100.0,
            share * 100.0
        ),
        Event::Rescued { rescued, .. } => {
            let what = match rescued.rescue {
                Rescue::Policy { from, to } => format!("stiffness {} instead of {}", to.name(), from.name()),
                Rescue::Smoothing { nodes } => format!("{nodes} interior nodes smoothed"),
                Rescue::Guided { axis } => {
                    format!("the whole way anew, along {} only", ["x", "y", "z"][axis])
                }
                _ => "smaller steps".to_owned(),
            };
            let [before, after] = rescued.quality;
            format!("rescue: {what}, worst quality {before:.4} -> {after:.4}")
        }
    }
}

/// The policies that a tuner may choose from.
pub(super) const POLICIES: [StiffnessPolicy; 4] = StiffnessPolicy::ALL;
