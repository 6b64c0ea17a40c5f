//! A given motion of the design nodes, taken in as many rounds as the mesh asks for.
//!
//! The motion is a path `t → Δx_b(t)`, `0 ≤ t ≤ 1`. Each round goes as far along it as [`Limits`] let a single linear
//! step go: not too near to the first inversion, and not below a quality. Then the mesh reached is the next reference, its
//! interior smoothed if elements are worn. Where even a short step is refused, the remedies of [`crate::rescue`] are
//! tried. Nothing here is chosen by a field or an objective.

use fluxmorph_geometry::tet4::Point;

use crate::error::RemeshError;
use crate::motion::{Motion, Moved};
use crate::rescue::{Rescued, Rung};

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
        /// Worst quality of the elastic body.
        quality: f64,
    },
    /// A remedy was taken.
    Rescued(Rescued),
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
    fn go_on(&mut self, motion: Motion) -> Result<(), RemeshError> {
        self.moved = motion.moved(motion.anchor())?;
        self.motion = motion;
        self.rescues += 1;
        Ok(())
    }
}

impl Motion {
    /// Moves the mesh along a path of design displacements from the original mesh [m], which begins at the anchor.
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
        tell: &mut dyn FnMut(&Event),
    ) -> Result<Travelled, RemeshError> {
        let mut travelled =
            Travelled { moved: self.moved(self.anchor())?, motion: self, reached: 0.0, steps: 0, rescues: 0 };
        let mut rung = Rung::Ground;
        while travelled.reached < 1.0 && travelled.steps < limits.rounds {
            let motion = &travelled.motion;
            match motion.stride(path, travelled.reached, limits)? {
                Ok((reached, moved)) => {
                    let share = 1.0 / moved.inversion.step;
                    let quality = motion.quality(&moved.mesh).worst;
                    tell(&Event::Stepped { round: motion.round(), reached, share, quality });
                    let anchor = path(reached);
                    let refreshed = motion.refreshed(&moved, &anchor, &path(1.0), limits)?;
                    (travelled.reached, travelled.moved) = (reached, moved);
                    travelled.steps += 1;
                    rung = Rung::Ground;
                    if let Some((motion, rescued)) = refreshed {
                        tell(&Event::Rescued(rescued));
                        travelled.go_on(motion)?;
                    } else if reached < 1.0 && travelled.steps < limits.rounds {
                        let Moved { mesh, displacement, .. } = travelled.moved.clone();
                        let policy = travelled.motion.policy();
                        travelled.motion = travelled.motion.rebased(mesh, displacement, anchor, policy)?;
                    }
                }
                Err(refused) => {
                    let Some((motion, rescued, next)) = motion.rescued(&refused, rung, limits)? else {
                        break;
                    };
                    tell(&Event::Rescued(rescued));
                    travelled.go_on(motion)?;
                    rung = next;
                }
            }
        }
        Ok(travelled)
    }

    /// The longest step along the path that keeps the limits, or the displacements that even the shortest was refused for.
    fn stride(
        &self,
        path: &dyn Fn(f64) -> Vec<Point>,
        from: f64,
        limits: &Limits,
    ) -> Result<Result<(f64, Moved), Vec<Point>>, RemeshError> {
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
                        return Ok(Ok((to, moved)));
                    }
                    // Inverted, though the exact root lies further: elements so flat that rounding decides.
                    Ok(_) | Err(RemeshError::Inverted { .. }) => 0.5,
                    Err(error) => return Err(error),
                }
            };
            if stride * shorter < SHORTEST_STRIDE {
                return Ok(Err(design));
            }
            stride *= shorter;
        }
    }
}
