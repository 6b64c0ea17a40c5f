//! A given motion of the design nodes, taken in as many rounds as the mesh asks for.
//!
//! The motion is a path `t → Δx_b(t)`, `0 ≤ t ≤ 1`. Each round goes as far along it as [`Limits`] let a single linear
//! step go: not too near to the first inversion, and not below a quality. Then the mesh reached is the next reference, its
//! interior smoothed if elements are worn. Where even a short step is refused, the remedies of [`crate::rescue`] are
//! tried. Nothing here is chosen by a field or an objective.

use std::ops::ControlFlow;

use fluxmorph_geometry::tet4::Point;

use crate::error::RemeshError;
use crate::motion::{Motion, Moved};
use crate::policy::StiffnessPolicy;
use crate::rescue::{Rescued, Rung};

/// Hears of every step; a break ends the way there.
pub type Tell<'a> = &'a mut dyn FnMut(&Event) -> ControlFlow<()>;

/// Shortest part of the path that is still called progress.
const SHORTEST_STRIDE: f64 = 1e-3;

/// Aimed at this share of the longest stride that the limits should allow: the share of the way to an inversion is not
/// quite proportional to the stride.
const AIM: f64 = 0.95;

/// How far a single linear step may go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
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

impl Default for Limits {
    /// Half of the way to an inversion, any valid quality, elements below 0.3 of their shape smoothed (as the paper's poor
    /// elements are those below a quality of 0.3), a hundred rounds.
    fn default() -> Self {
        Self { inversion_share: 0.5, least_quality: 0.0, smooth_below: 0.3, rounds: 100 }
    }
}

/// What happens on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
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
    /// A remedy was taken.
    Rescued {
        /// Rounds begun, that after the remedy included.
        round: usize,
        /// How stiffness follows element size from now on.
        policy: StiffnessPolicy,
        /// What was done.
        rescued: Rescued,
    },
}

/// What a search for the longest step found.
enum Stride {
    /// A step to this part of the path.
    Taken(f64, Moved),
    /// Even the shortest step was refused, towards these displacements.
    Refused(Vec<Point>),
}

/// Where a motion came to.
#[derive(Debug)]
pub struct Travelled {
    /// The last round; its reference is where its step began, or the mesh reached itself where that was smoothed.
    pub motion: Motion,
    /// The mesh reached.
    pub moved: Moved,
    /// How much of the path is done: 1 for all.
    pub reached: f64,
    /// Steps taken.
    pub steps: usize,
    /// Remedies taken.
    pub rescues: usize,
}

impl Travelled {
    /// A remedy gave another mesh, or another map, for the place reached.
    fn go_on(&mut self, motion: Motion, rescued: Rescued, tell: Tell<'_>) -> ControlFlow<()> {
        self.moved = motion.unmoved();
        let (round, policy) = (motion.round(), motion.policy());
        self.motion = motion;
        self.rescues += 1;
        tell(&Event::Rescued { round, policy, rescued })
    }
}

impl Motion {
    /// Moves the mesh along a path of design displacements from the original mesh [m], which begins at the anchor; `tell`
    /// hears of every step and may end the way there.
    ///
    /// A path that cannot be followed to its end is no error: see [`Travelled::reached`].
    ///
    /// # Errors
    /// As [`Motion::step`] and [`Motion::rebased`].
    ///
    /// # Panics
    /// If the path has not one displacement per design node.
    pub fn travel(
        self,
        path: &dyn Fn(f64) -> Vec<Point>,
        limits: &Limits,
        tell: Tell<'_>,
    ) -> Result<Travelled, RemeshError> {
        let mut travelled =
            Travelled { moved: self.unmoved(), motion: self, reached: 0.0, steps: 0, rescues: 0 };
        let mut rung = Rung::Ground;
        while travelled.reached < 1.0 && travelled.steps < limits.rounds {
            let motion = &travelled.motion;
            match motion.stride(path, travelled.reached, limits)? {
                Stride::Taken(reached, moved) => {
                    let share = 1.0 / moved.inversion.step;
                    let quality = motion.quality(&moved.mesh).worst;
                    let (round, policy) = (motion.round(), motion.policy());
                    let told = tell(&Event::Stepped { round, reached, share, quality, policy });
                    let anchor = path(reached);
                    let refreshed = motion.refreshed(&moved, &anchor, &path(1.0), limits)?;
                    (travelled.reached, travelled.moved) = (reached, moved);
                    travelled.steps += 1;
                    rung = Rung::Ground;
                    if told.is_break() {
                        break;
                    }
                    if let Some((motion, rescued)) = refreshed {
                        if travelled.go_on(motion, rescued, tell).is_break() {
                            break;
                        }
                    } else if reached < 1.0 && travelled.steps < limits.rounds {
                        let Moved { mesh, displacement, .. } = travelled.moved.clone();
                        let policy = travelled.motion.policy();
                        travelled.motion = travelled.motion.rebased(mesh, displacement, anchor, policy)?;
                    }
                }
                Stride::Refused(refused) => {
                    let Some((motion, rescued, next)) = motion.rescued(&refused, rung, limits)? else {
                        break;
                    };
                    if travelled.go_on(motion, rescued, tell).is_break() {
                        break;
                    }
                    rung = next;
                }
            }
        }
        Ok(travelled)
    }

    /// The longest step along the path that keeps the limits.
    fn stride(
        &self,
        path: &dyn Fn(f64) -> Vec<Point>,
        from: f64,
        limits: &Limits,
    ) -> Result<Stride, RemeshError> {
        let mut stride = 1.0 - from;
        loop {
            let to = if stride >= 1.0 - from { 1.0 } else { from + stride };
            let design = path(to);
            let step = self.step(&design)?;
            let inversion = self.inversion(&step);
            let share = 1.0 / inversion.step;
            let shorter = if share > limits.inversion_share {
                AIM * limits.inversion_share / share
            } else {
                match self.taken(&step, inversion) {
                    Ok(moved) if self.quality(&moved.mesh).worst >= limits.least_quality => {
                        return Ok(Stride::Taken(to, moved));
                    }
                    // Inverted, though the exact root lies further: elements so flat that rounding decides.
                    Ok(_) | Err(RemeshError::Inverted { .. }) => 0.5,
                    Err(error) => return Err(error),
                }
            };
            if stride * shorter < SHORTEST_STRIDE {
                return Ok(Stride::Refused(design));
            }
            stride *= shorter;
        }
    }
}
