//! Load stepping: a given motion of the design nodes, taken in as many steps as the mesh asks for.
//!
//! The motion is a path `t → Δx_b(t)`, `0 ≤ t ≤ 1`. Each round goes as far along it as [`StepLimits`] let a single linear
//! step go: not too near to the first inversion, and not below a quality. Then the mesh reached is the next reference, its
//! interior smoothed if elements are degraded. Where even a short step is refused, the fallbacks of [`crate::fallback`] are
//! tried. Nothing here is chosen by a field or an objective. By a law of least energy there is one mesh a design, and the longest
//! part of the path that is carried is taken at once.

use std::ops::ControlFlow;

use fluxmorph_geometry::tet4::Point;

use crate::carried::Carried;
use crate::error::RemeshError;
use crate::fallback::{FallbackLevel, FallbackReport};
use crate::motion::{Motion, Moved};
use crate::policy::StiffnessPolicy;

/// Is called with every step; a break ends the motion there.
pub type OnStepEvent<'a> = &'a mut dyn FnMut(&StepEvent) -> ControlFlow<()>;

/// Shortest part of the path that is still called progress.
const SHORTEST_STEP: f64 = 1e-3;

/// Aimed at this share of the longest step that the limits should allow: the share of the way to an inversion is not quite
/// proportional to the step.
const AIM: f64 = 0.95;

/// How far a single linear step may go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepLimits {
    /// Largest share of the way to the first inversion, below 1.
    pub inversion_share: f64,
    /// Least quality (Eq. 4) of an element of the elastic body.
    pub least_quality: f64,
    /// A mesh whose worst element has less than this share of its original shape is smoothed before the next round; 0 for
    /// never.
    pub smooth_below: f64,
    /// Most rounds.
    pub rounds: usize,
}

impl Default for StepLimits {
    /// Half of the way to an inversion, any valid quality, elements below 0.3 of their shape smoothed (as the paper's poor
    /// elements are those below a quality of 0.3), a hundred rounds.
    fn default() -> Self {
        Self { inversion_share: 0.5, least_quality: 0.0, smooth_below: 0.3, rounds: 100 }
    }
}

/// What happens along the path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepEvent {
    /// A round has taken its step.
    Stepped {
        /// Rounds begun before it.
        round: usize,
        /// How much of the path is done.
        reached: f64,
        /// Share of the way to the first inversion that the step used.
        share: f64,
        /// Worst quality of the elements that may move.
        quality: f64,
        /// How stiffness follows element size in it.
        policy: StiffnessPolicy,
    },
    /// A fallback was taken.
    FellBack {
        /// Rounds begun, that after the fallback included.
        round: usize,
        /// How stiffness follows element size from now on.
        policy: StiffnessPolicy,
        /// What was done.
        report: FallbackReport,
    },
}

/// What a search for the longest step found.
enum LongestStep {
    /// A step to this part of the path.
    Accepted(f64, Moved),
    /// Even the shortest step was refused, towards these displacements.
    Refused(Vec<Point>),
}

/// Where a motion came to.
#[derive(Debug)]
pub struct SteppingOutcome {
    /// The last round; its reference is where its step began, or the mesh reached itself where that was smoothed.
    pub motion: Motion,
    /// The mesh reached.
    pub moved: Moved,
    /// How much of the path is done: 1 for all.
    pub reached: f64,
    /// Steps taken.
    pub steps: usize,
    /// Fallbacks taken.
    pub fallbacks: usize,
}

impl SteppingOutcome {
    /// Goes on with a fallback's motion: another mesh, or another map, for the design reached.
    fn fall_back(
        &mut self,
        motion: Motion,
        report: FallbackReport,
        on_event: OnStepEvent<'_>,
    ) -> ControlFlow<()> {
        self.moved = motion.at_reference();
        let (round, policy) = (motion.round(), motion.policy());
        self.motion = motion;
        self.fallbacks += 1;
        on_event(&StepEvent::FellBack { round, policy, report })
    }
}

impl Motion {
    /// Moves the mesh along a path of design displacements from the original mesh [m], which begins at the design of
    /// the reference; `on_event` is called with every step and may end the motion there.
    ///
    /// A path that cannot be taken to its end is no error: see [`SteppingOutcome::reached`].
    ///
    /// # Errors
    /// As [`Motion::step`] and [`Motion::rebased`].
    ///
    /// # Panics
    /// If the path has not one displacement per design node.
    pub fn step_along(
        self,
        path: &dyn Fn(f64) -> Vec<Point>,
        limits: &StepLimits,
        on_event: OnStepEvent<'_>,
    ) -> Result<SteppingOutcome, RemeshError> {
        if let Some(Carried { share, moved, .. }) = self.carried_along(path)? {
            let quality = self.quality(&moved.mesh).worst;
            let (policy, inverted) = (self.policy(), 1.0 / moved.inversion.step);
            let event = StepEvent::Stepped { round: 0, reached: share, share: inverted, quality, policy };
            // One mesh, and no step after it to be kept from.
            let _ = on_event(&event);
            return Ok(SteppingOutcome { motion: self, moved, reached: share, steps: 1, fallbacks: 0 });
        }
        let mut outcome = SteppingOutcome {
            moved: self.at_reference(),
            motion: self,
            reached: 0.0,
            steps: 0,
            fallbacks: 0,
        };
        let mut level = FallbackLevel::None;
        while outcome.reached < 1.0 && outcome.steps < limits.rounds {
            let motion = &outcome.motion;
            match motion.longest_step(path, outcome.reached, limits)? {
                LongestStep::Accepted(reached, moved) => {
                    let share = 1.0 / moved.inversion.step;
                    let quality = motion.quality(&moved.mesh).worst;
                    let (round, policy) = (motion.round(), motion.policy());
                    let flow = on_event(&StepEvent::Stepped { round, reached, share, quality, policy });
                    let design = path(reached);
                    let smoothed = motion.smooth_degraded(&moved, &design, &path(1.0), limits)?;
                    (outcome.reached, outcome.moved) = (reached, moved);
                    outcome.steps += 1;
                    level = FallbackLevel::None;
                    if flow.is_break() {
                        break;
                    }
                    if let Some((motion, report)) = smoothed {
                        if outcome.fall_back(motion, report, on_event).is_break() {
                            break;
                        }
                    } else if reached < 1.0 && outcome.steps < limits.rounds {
                        let Moved { mesh, displacement, .. } = outcome.moved.clone();
                        let policy = outcome.motion.policy();
                        outcome.motion = outcome.motion.rebased(mesh, displacement, design, policy)?;
                    }
                }
                LongestStep::Refused(refused) => {
                    let Some((motion, report, next)) = motion.escalate(&refused, level, limits)? else {
                        break;
                    };
                    if outcome.fall_back(motion, report, on_event).is_break() {
                        break;
                    }
                    level = next;
                }
            }
        }
        Ok(outcome)
    }

    /// The longest step along the path that keeps the limits.
    fn longest_step(
        &self,
        path: &dyn Fn(f64) -> Vec<Point>,
        from: f64,
        limits: &StepLimits,
    ) -> Result<LongestStep, RemeshError> {
        let mut length = 1.0 - from;
        loop {
            let to = if length >= 1.0 - from { 1.0 } else { from + length };
            let design = path(to);
            let step = self.step(&design)?;
            let inversion = self.inversion(&step);
            let share = 1.0 / inversion.step;
            let shorter = if share > limits.inversion_share {
                AIM * limits.inversion_share / share
            } else {
                match self.apply(&step, inversion) {
                    Ok(moved) if self.quality(&moved.mesh).worst >= limits.least_quality => {
                        return Ok(LongestStep::Accepted(to, moved));
                    }
                    // Inverted, though the exact root lies further: elements so flat that rounding decides.
                    Ok(_) | Err(RemeshError::Inverted { .. }) => 0.5,
                    Err(error) => return Err(error),
                }
            };
            if length * shorter < SHORTEST_STEP {
                return Ok(LongestStep::Refused(design));
            }
            length *= shorter;
        }
    }
}
