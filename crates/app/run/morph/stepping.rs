//! Load stepping: a mesh moved along a path in one increment, in a number of equal ones, or in as many as it needs.

use std::ops::ControlFlow;
use std::sync::Arc;

use fluxmorph_geometry::tet4::{Point, add, volume};
use fluxmorph_geometry::{ElementId, Topology};
use fluxmorph_remesh::{
    Fallback, Motion, RemeshError, StepEvent, StepLimits, StepToInversion, SteppingOutcome,
};

use crate::build::MotionSetup;
use crate::config::Increments;
use crate::error::Error;

/// The result of a motion in increments. The mesh may have inverted elements: the last increment is not refused.
#[derive(Debug)]
pub struct LoadStepping {
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
    /// Increments taken, each with a stiffness of its own.
    pub increments: usize,
    /// Fallbacks of the mesh motion on the way.
    pub fallbacks: usize,
    /// Elements without a positive volume, of the whole mesh.
    pub inverted: usize,
}

/// The result of a sequence of increments.
struct Steps {
    /// Displacement of all nodes from the undeformed mesh [m].
    displacement: Vec<Point>,
    /// Share of the path that was reached.
    reached: f64,
    increments: usize,
    fallbacks: usize,
}

/// Moves the mesh along the path of a set-up; no increment but the last of a given number may fall below a quality.
///
/// `report` receives a line for each thing that happens on the way, and may end the motion there.
pub fn step_along(
    setup: &MotionSetup,
    increments: Increments,
    least_quality: f64,
    report: &mut dyn FnMut(&str) -> ControlFlow<()>,
) -> Result<LoadStepping, Error> {
    let path = |t: f64| setup.path.at(t);
    let motion = Motion::new(setup.mesh.clone(), setup.remesh.clone())?;
    let step = motion.step(&path(1.0))?;
    let inversion = motion.inversion(&step);
    let (body, equations) = (motion.map().elements().to_vec(), motion.map().equation_count());
    let taken = match increments {
        Increments::Count(1) => Steps { displacement: step, reached: 1.0, increments: 1, fallbacks: 0 },
        Increments::Count(count) => equal(motion, &path, count, least_quality, report)?,
        Increments::Auto(_) => {
            let limits = StepLimits { least_quality, ..StepLimits::default() };
            let SteppingOutcome { moved, reached, steps, fallbacks, .. } =
                motion.step_along(&path, &limits, &mut |event| report(&line(event)))?;
            Steps { displacement: moved.displacement, reached, increments: steps, fallbacks }
        }
    };
    let Steps { displacement, reached, increments, fallbacks } = taken;
    let topology = Arc::clone(setup.mesh.topology());
    let before = setup.mesh.points().to_vec();
    let after: Vec<Point> = before.iter().zip(&displacement).map(|(x, u)| add(*x, *u)).collect();
    let inverted = topology.tets().iter().filter(|tet| volume(tet.map(|n| after[n.index()])) <= 0.0).count();
    Ok(LoadStepping {
        topology,
        before,
        after,
        displacement,
        body,
        equations,
        inversion,
        reached,
        increments,
        fallbacks,
        inverted,
    })
}

/// Equal parts of the path, each from the mesh that the one before left. An increment before the last that breaks the
/// mesh, or leaves an element of the body below the least quality, is not taken, and ends the way; the last is a result,
/// however it leaves the mesh.
fn equal(
    mut motion: Motion,
    path: &dyn Fn(f64) -> Vec<Point>,
    count: usize,
    least_quality: f64,
    report: &mut dyn FnMut(&str) -> ControlFlow<()>,
) -> Result<Steps, RemeshError> {
    for k in 1..count {
        let t = k as f64 / count as f64;
        let taken = |motion: &Motion, increments: usize| Steps {
            displacement: motion.reference_displacement().to_vec(),
            reached: increments as f64 / count as f64,
            increments,
            fallbacks: 0,
        };
        let moved = match motion.moved(&path(t)) {
            Ok(moved) if motion.quality(&moved.mesh).worst >= least_quality => moved,
            Ok(_) | Err(RemeshError::Inverted { .. }) => return Ok(taken(&motion, k - 1)),
            Err(other) => return Err(other),
        };
        let quality = motion.quality(&moved.mesh).worst;
        motion = motion.rebased(moved.mesh, moved.displacement, path(t), motion.policy())?;
        if report(&format!("increment {k} of {count}: worst quality {quality:.4}")).is_break() {
            return Ok(taken(&motion, k));
        }
    }
    let step = motion.step(&path(1.0))?;
    let displacement =
        motion.reference_displacement().iter().zip(step).map(|(u, step)| add(*u, step)).collect();
    Ok(Steps { displacement, reached: 1.0, increments: count, fallbacks: 0 })
}

fn line(event: &StepEvent) -> String {
    match event {
        StepEvent::Stepped { round, reached, share, quality, .. } => format!(
            "increment {}: {:.1} % of the motion, {:.0} % of the way to an inversion, worst quality {quality:.4}",
            round + 1,
            reached * 100.0,
            share * 100.0
        ),
        StepEvent::FellBack { report, .. } => {
            let what = match report.fallback {
                Fallback::Policy { from, to } => {
                    format!("stiffness {} instead of {}", to.name(), from.name())
                }
                Fallback::Smoothing { nodes } => format!("{nodes} interior nodes smoothed"),
                Fallback::AxisConstraint { axis } => {
                    format!("the whole way anew, along {} only", ["x", "y", "z"][axis])
                }
            };
            let [before, after] = report.quality;
            format!("fallback: {what}, worst quality {before:.4} -> {after:.4}")
        }
    }
}
