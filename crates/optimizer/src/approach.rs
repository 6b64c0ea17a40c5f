//! Taking the mesh of a problem to a design that a single step from the undeformed mesh does not reach.

use fluxmorph_remesh::{Event, RemeshError, Travelled};

use crate::error::Error;
use crate::problem::Problem;
use crate::rounds::RoundEvent;

impl Problem {
    /// Makes a mesh near a design the reference of the present round, in as many rounds as the way there takes; nothing
    /// where a single step does, or where the problem allows no rounds.
    ///
    /// # Errors
    /// [`Error::DesignUnreached`] says how far the mesh can be taken.
    ///
    /// # Panics
    /// If `p` has another length than there are variables.
    pub fn approach(&mut self, p: &[f64]) -> Result<Vec<RoundEvent>, Error> {
        let Some(shape) = self.shape.as_mut().filter(|shape| shape.limits.rounds > 0) else {
            return Ok(Vec::new());
        };
        let last = shape.displacement(p);
        match shape.motion.moved(&last) {
            Ok(moved) if 1.0 / moved.inversion.step <= shape.limits.inversion_share => return Ok(Vec::new()),
            Ok(_) | Err(RemeshError::Inverted { .. }) => {}
            Err(other) => return Err(other.into()),
        }
        let first = shape.motion.anchor().to_vec();
        let path = |t: f64| -> Vec<[f64; 3]> {
            let between =
                |(from, to): (&[f64; 3], &[f64; 3])| std::array::from_fn(|d| from[d] + t * (to[d] - from[d]));
            if t == 1.0 { last.clone() } else { first.iter().zip(&last).map(between).collect() }
        };
        let mut events = Vec::new();
        let mut tell = |event: &Event| events.push(*event);
        let Travelled { motion, moved, reached, .. } =
            shape.motion.clone().travel(&path, &shape.limits, &mut tell)?;
        if reached < 1.0 {
            return Err(Error::DesignUnreached { reached });
        }
        shape.motion = motion.rebased(moved.mesh, moved.displacement, last.clone(), motion.policy())?;
        Ok(events.iter().map(|event| RoundEvent::approach(event, &shape.motion)).collect())
    }
}
