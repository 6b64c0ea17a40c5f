//! How the reference meshes of a run came about, so that another one can come to the same mesh.

use fluxmorph_remesh::FallbackLevel;
use serde::{Deserialize, Serialize};

use super::Problem;
use crate::error::Error;

/// How a round began; an entry of `design.rounds` in `result.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum RoundStart {
    /// The mesh of a design became the reference.
    Reference {
        /// Its variables [m].
        design_m: Vec<f64>,
    },
    /// The mesh motion fell back on the same reference.
    Fallback {
        /// How many of the levels of [`FallbackLevel`] had been tried.
        level: u8,
        /// The variables of the design that was refused [m].
        refused_m: Vec<f64>,
    },
}

/// The levels in their order.
const LEVELS: [FallbackLevel; 4] =
    [FallbackLevel::None, FallbackLevel::Policies, FallbackLevel::Smoothing, FallbackLevel::AxisConstraint];

impl RoundStart {
    /// A fallback beyond a level, after a design was refused.
    pub(crate) fn fallback(level: FallbackLevel, refused: &[f64]) -> Self {
        let level = LEVELS.iter().position(|known| *known == level).unwrap_or_default() as u8;
        Self::Fallback { level, refused_m: refused.to_vec() }
    }

    /// The variables in it [m].
    pub fn design(&self) -> &[f64] {
        let (Self::Reference { design_m: design } | Self::Fallback { refused_m: design, .. }) = self;
        design
    }
}

impl Problem {
    /// Takes the mesh through the rounds of a run, from the initial design on: the present round is then that of the run, to
    /// the last bit where the problem is the same. Without rounds nothing is done.
    ///
    /// # Errors
    /// As [`Problem::continue_to`] and [`fluxmorph_remesh::Motion::escalate`].
    ///
    /// # Panics
    /// If an entry has not one value a variable.
    pub fn follow(&mut self, rounds: &[RoundStart], interrupted: &dyn Fn() -> bool) -> Result<(), Error> {
        for start in rounds {
            match start {
                RoundStart::Reference { design_m } => drop(self.continue_to(design_m, interrupted)?),
                RoundStart::Fallback { level, refused_m } => {
                    let level = LEVELS[usize::from(*level).min(LEVELS.len() - 1)];
                    let Some(shape) = self.shape_mut() else { return Ok(()) };
                    let refused = shape.displacement(refused_m);
                    if let Some((motion, ..)) = shape.motion().escalate(&refused, level, &shape.limits)? {
                        shape.set_motion(motion);
                    }
                }
            }
        }
        Ok(())
    }

    /// Makes the undeformed mesh the reference again.
    ///
    /// # Errors
    /// As [`fluxmorph_remesh::Motion::restarted`].
    pub fn restart(&mut self) -> Result<(), Error> {
        if let Some(shape) = self.shape_mut() {
            let motion = shape.motion().restarted()?;
            shape.set_motion(motion);
        }
        Ok(())
    }
}
