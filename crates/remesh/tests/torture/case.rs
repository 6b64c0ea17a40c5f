//! A prescribed motion of a mesh, and what single step and rounds make of it under one policy.

use std::ops::ControlFlow;

use fluxmorph_geometry::quality::quality;
use fluxmorph_geometry::{Mesh, NodeId};
use fluxmorph_remesh::{Motion, RemeshSetup, StepEvent, StepLimits, SteppingOutcome, StiffnessPolicy};

use crate::support::Point;

/// A mesh, its elastic body, and where the design nodes go.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) mesh: Mesh,
    /// The policy in it is replaced by that of the measurement.
    pub(crate) setup: RemeshSetup,
    /// Displacement of the design nodes [m] over the path `0 ≤ t ≤ 1`.
    pub(crate) path: Path,
}

pub(crate) type Path = Box<dyn Fn(f64) -> Vec<Point> + Sync>;

/// What one policy makes of a case.
pub(crate) struct Outcome {
    pub(crate) policy: StiffnessPolicy,
    /// Worst quality (Eq. 4) of the body before the motion.
    pub(crate) start: f64,
    /// The whole motion in one linear step.
    pub(crate) single: SingleStep,
    /// The motion in rounds.
    pub(crate) travelled: SteppingOutcome,
    /// Worst quality of the body after them.
    pub(crate) worst: f64,
    pub(crate) events: Vec<StepEvent>,
}

/// The whole motion in one linear step, inverted or not.
pub(crate) struct SingleStep {
    pub(crate) worst: f64,
    pub(crate) inverted: usize,
    /// Step to inversion.
    pub(crate) step: f64,
}

impl Case {
    /// A case in which each design node moves as a function of the path's parameter and its own first place.
    pub(crate) fn new(
        name: &str,
        mesh: Mesh,
        setup: RemeshSetup,
        displacement: impl Fn(f64, Point) -> Point + Sync + 'static,
    ) -> Self {
        let places: Vec<Point> = setup.design_nodes.iter().map(|&n| mesh.point(n)).collect();
        let path = Box::new(move |t| places.iter().map(|&p| displacement(t, p)).collect());
        Self { name: name.to_owned(), mesh, setup, path }
    }

    pub(crate) fn motion(&self, policy: StiffnessPolicy) -> Motion {
        Motion::new(self.mesh.clone(), RemeshSetup { policy, ..self.setup.clone() }).expect("a sound case")
    }

    pub(crate) fn single_step(&self, motion: &Motion) -> SingleStep {
        let step = motion.step(&(self.path)(1.0)).expect("a direct solve");
        let moved = |n: NodeId| {
            let (p, u) = (self.mesh.point(n), step[n.index()]);
            [p[0] + u[0], p[1] + u[1], p[2] + u[2]]
        };
        let qualities =
            motion.map().elements().iter().map(|&e| quality(self.mesh.topology().tet(e).map(moved)));
        let (mut worst, mut inverted) = (f64::INFINITY, 0);
        for q in qualities {
            worst = worst.min(q);
            inverted += usize::from(q <= 0.0);
        }
        SingleStep { worst, inverted, step: motion.inversion(&step).step }
    }

    pub(crate) fn outcome(&self, policy: StiffnessPolicy, limits: &StepLimits) -> Outcome {
        let motion = self.motion(policy);
        let single = self.single_step(&motion);
        let start = motion.quality(&self.mesh).worst;
        let mut events = Vec::new();
        let outcome = motion
            .step_along(&self.path, limits, &mut |event| {
                events.push(*event);
                ControlFlow::Continue(())
            })
            .expect("a direct solve");
        let worst = outcome.motion.quality(&outcome.moved.mesh).worst;
        Outcome { policy, start, single, travelled: outcome, worst, events }
    }
}

impl Outcome {
    /// Share of the way to the first inversion that each round used.
    pub(crate) fn shares(&self) -> Vec<f64> {
        let share = |event: &StepEvent| match event {
            StepEvent::Stepped { share, .. } => Some(*share),
            StepEvent::FellBack { .. } => None,
        };
        self.events.iter().filter_map(share).collect()
    }
}
