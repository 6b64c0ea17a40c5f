//! Fallbacks of the mesh motion when a step is refused, from the mildest to the last.
//!
//! The first fallback, a smaller step, is the caller's: only it knows how far it wanted to go. Here are those that change the
//! mesh motion itself, one level above the other ([`FallbackLevel`]): another stiffness policy, chosen by how far it would
//! carry the refused step; smoothing of the interior nodes; for designs that move along one axis the motion from the original
//! mesh again, all nodes constrained to that axis. The last two give another mesh for the same design. Above the last level
//! there is none, and the motion stays where it is.
//!
//! Load stepping along a given path has one more, because its meshes need not follow one another: smoothing before each
//! round that would begin on degraded elements.

use std::ops::ControlFlow;

use fluxmorph_geometry::tet4::{Point, add};

use crate::deform::{KinematicConstraint, MotionLaw, RemeshSetup};
use crate::error::RemeshError;
use crate::load_stepping::StepLimits;
use crate::motion::{Motion, Moved};
use crate::policy::StiffnessPolicy;
use crate::smoothing::{SmoothingSettings, smooth};

/// Another policy is taken if it carries the refused step at least this much further: it costs a factor, and the model
/// that a method has built of the objective.
const WORTHWHILE: f64 = 1.1;

/// Smoothing that leaves elements with less than this part of the share of their shape they should have is no help: the
/// surfaces, which stay, or twisted neighbours hold them there.
const BEYOND_SMOOTHING: f64 = 0.03;

/// A fallback that was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fallback {
    /// Another way in which stiffness follows element size.
    Policy {
        /// Until now.
        from: StiffnessPolicy,
        /// From now on.
        to: StiffnessPolicy,
    },
    /// Interior nodes moved to where the elements around them are best; all surfaces stayed.
    Smoothing {
        /// Nodes that moved.
        nodes: usize,
    },
    /// The motion from the original mesh again, all nodes constrained to one axis.
    AxisConstraint {
        /// The axis: 0, 1, 2.
        axis: usize,
    },
}

/// A fallback, with what it changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FallbackReport {
    /// The fallback.
    pub fallback: Fallback,
    /// Worst quality (Eq. 4) of the reference mesh before and after.
    pub quality: [f64; 2],
    /// Largest share of the refused step that keeps the limits, before and after; 1 where none was refused.
    pub admissible: [f64; 2],
}

/// The highest fallback level that was tried since the last progress.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum FallbackLevel {
    /// None.
    #[default]
    None,
    /// Stiffness policies.
    Policies,
    /// Smoothing of the interior.
    Smoothing,
    /// All nodes constrained to the axis of the design.
    AxisConstraint,
}

impl Fallback {
    /// Whether the mesh of the design that the motion stands at is another one after it.
    pub fn changes_mesh(&self) -> bool {
        matches!(self, Self::Smoothing { .. } | Self::AxisConstraint { .. })
    }
}

impl Motion {
    /// The next fallback above `level` for a refused step towards the design displacements `wanted` [m]: the motion after it,
    /// what was done, and the level reached. `None` when none is left that helps.
    ///
    /// # Errors
    /// As [`Motion::rebased`] and [`Motion::step`].
    ///
    /// # Panics
    /// If there is not one displacement per design node.
    pub fn escalate(
        &self,
        wanted: &[Point],
        level: FallbackLevel,
        limits: &StepLimits,
    ) -> Result<Option<(Self, FallbackReport, FallbackLevel)>, RemeshError> {
        let quality = self.quality(self.reference()).worst;
        let before = self.admissible_share(&self.step(wanted)?, limits);
        if level < FallbackLevel::Policies
            && let Some((motion, after)) = self.with_best_policy(wanted, before, limits)?
        {
            let fallback = Fallback::Policy { from: self.policy(), to: motion.policy() };
            let report = FallbackReport { fallback, quality: [quality; 2], admissible: [before, after] };
            return Ok(Some((motion, report, FallbackLevel::Policies)));
        }
        if level < FallbackLevel::Smoothing
            && self.map().kinematic_constraint() == KinematicConstraint::Free
            && let Some((motion, nodes)) = self.smooth_reference()?
        {
            let after = motion.admissible_share(&motion.step(wanted)?, limits);
            let quality = [quality, motion.quality(motion.reference()).worst];
            let fallback = Fallback::Smoothing { nodes };
            let report = FallbackReport { fallback, quality, admissible: [before, after] };
            return Ok(Some((motion, report, FallbackLevel::Smoothing)));
        }
        if level < FallbackLevel::AxisConstraint
            && let Some((motion, report)) = self.constrain_to_axis(self.reference_design(), wanted, limits)?
            && report.admissible[1] > report.admissible[0]
        {
            return Ok(Some((motion, report, FallbackLevel::AxisConstraint)));
        }
        Ok(None)
    }

    /// The motion with the policy that carries a step furthest, if that is worth while, and the share that it carries.
    fn with_best_policy(
        &self,
        wanted: &[Point],
        before: f64,
        limits: &StepLimits,
    ) -> Result<Option<(Self, f64)>, RemeshError> {
        let mut best: Option<(Self, f64)> = None;
        for policy in StiffnessPolicy::ALL.into_iter().filter(|policy| *policy != self.policy()) {
            let motion = self.with_policy(policy)?;
            let share = motion.admissible_share(&motion.step(wanted)?, limits);
            if share > best.as_ref().map_or(WORTHWHILE * before, |best| best.1) {
                best = Some((motion, share));
            }
        }
        Ok(best)
    }

    /// The motion on a reference mesh whose interior nodes are smoothed towards the shapes of the original mesh, and how
    /// many nodes moved; `None` where that improves nothing.
    ///
    /// # Errors
    /// As [`Motion::rebased`].
    fn smooth_reference(&self) -> Result<Option<(Self, usize)>, RemeshError> {
        let smoothed = self.smooth_mesh(&self.at_reference(), SmoothingSettings::default())?;
        let rebase = |(moved, nodes): (Moved, usize)| {
            Ok((self.with_reference(moved.mesh, moved.displacement, self.policy())?, nodes))
        };
        smoothed.map(rebase).transpose()
    }

    /// A mesh of this motion, smoothed, and how many nodes moved; `None` where none did.
    fn smooth_mesh(
        &self,
        moved: &Moved,
        settings: SmoothingSettings,
    ) -> Result<Option<(Moved, usize)>, RemeshError> {
        let smoothed = smooth(&moved.mesh, Some(self.original()), self.map().elements(), &settings)?;
        if smoothed.moved_nodes == 0 {
            return Ok(None);
        }
        let steps = moved.displacement.iter().zip(&smoothed.displacement);
        let displacement = steps.map(|(u, step)| add(*u, *step)).collect();
        let moved = Moved { mesh: smoothed.mesh, displacement, ..moved.clone() };
        Ok(Some((moved, smoothed.moved_nodes)))
    }

    /// The next round on the mesh that this one reached at `design` on the way to `goal`, if elements of it have less than
    /// the share [`StepLimits::smooth_below`] of their original shape: smoothed, or constrained to an axis where smoothing
    /// does not help enough. `None` where nothing is degraded, or nothing improves.
    ///
    /// A body that is constrained to an axis is left as it is: its columns invert only where they are squeezed to nothing, and
    /// smoothing would take that from them.
    pub(crate) fn smooth_degraded(
        &self,
        moved: &Moved,
        design: &[Point],
        goal: &[Point],
        limits: &StepLimits,
    ) -> Result<Option<(Self, FallbackReport)>, RemeshError> {
        let least = limits.smooth_below;
        if self.map().kinematic_constraint() != KinematicConstraint::Free || self.shape(&moved.mesh) >= least
        {
            return Ok(None);
        }
        let settings = SmoothingSettings { target: least, ..SmoothingSettings::default() };
        let smoothed = self.smooth_mesh(moved, settings)?;
        let shape = smoothed.as_ref().map_or(0.0, |(moved, _)| self.shape(&moved.mesh));
        if shape < BEYOND_SMOOTHING * least
            && let Some(constrained) = self.constrain_to_axis(design, goal, limits)?
        {
            return Ok(Some(constrained));
        }
        let Some((smooth, nodes)) = smoothed else { return Ok(None) };
        let motion = self.rebased(smooth.mesh, smooth.displacement, design.to_vec(), self.policy())?;
        let quality = [&moved.mesh, motion.reference()].map(|mesh| motion.quality(mesh).worst);
        // Nothing was refused: there is no step to hold against another.
        let fallback = Fallback::Smoothing { nodes };
        Ok(Some((motion, FallbackReport { fallback, quality, admissible: [1.0; 2] })))
    }

    /// For a design that moves along one coordinate axis: the displacements `design` reached again from the original mesh,
    /// every node constrained to that axis; `None` where the design leaves the axis, the body is constrained already, or that
    /// motion is refused too.
    fn constrain_to_axis(
        &self,
        design: &[Point],
        wanted: &[Point],
        limits: &StepLimits,
    ) -> Result<Option<(Self, FallbackReport)>, RemeshError> {
        let along = |axis: usize| {
            let others = [(axis + 1) % 3, (axis + 2) % 3];
            wanted.iter().chain(design).all(|u| others.iter().all(|&d| u[d] == 0.0))
        };
        let Some(axis) = (0..3)
            .find(|&axis| along(axis))
            .filter(|_| self.map().kinematic_constraint() == KinematicConstraint::Free)
        else {
            return Ok(None);
        };
        let setup = RemeshSetup {
            kinematic_constraint: KinematicConstraint::Axis(axis),
            law: MotionLaw::Linear,
            policy: self.policy(),
            // A third of the unknowns, in one process.
            ownership: None,
            ..self.map().setup().clone()
        };
        let path = |t: f64| design.iter().map(|u| u.map(|u| t * u)).collect();
        let own_limits = StepLimits { least_quality: limits.least_quality, ..StepLimits::default() };
        let outcome =
            Self::new(self.original().clone(), setup)?
                .step_along(&path, &own_limits, &mut |_| ControlFlow::Continue(()))?;
        if outcome.reached < 1.0 {
            return Ok(None);
        }
        let Moved { mesh, displacement, .. } = outcome.moved;
        let policy = outcome.motion.policy();
        let motion = outcome.motion.rebased(mesh, displacement, design.to_vec(), policy)?.after(self);
        let quality = [self.reference(), motion.reference()].map(|mesh| motion.quality(mesh).worst);
        let share =
            |motion: &Self| Ok::<_, RemeshError>(motion.admissible_share(&motion.step(wanted)?, limits));
        let admissible = [share(self)?, share(&motion)?];
        Ok(Some((
            motion,
            FallbackReport { fallback: Fallback::AxisConstraint { axis }, quality, admissible },
        )))
    }
}
