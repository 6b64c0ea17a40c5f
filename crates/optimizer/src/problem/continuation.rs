//! Continuation: the mesh of a problem taken to a design, in one step where that keeps the limits, else in rounds.

use std::ops::ControlFlow;

use fluxmorph_geometry::tet4::Point;
use fluxmorph_remesh::{Motion, Moved, RemeshError, StepEvent, StepLimits, SteppingOutcome};

use super::{Problem, RoundEvent, Shape};
use crate::error::Error;

impl Problem {
    /// Makes the mesh of a design the reference of the present round; nothing where it is already, or where the problem
    /// allows no rounds. What happened on the way, if one step was not enough.
    ///
    /// `interrupted` is asked after each step.
    ///
    /// # Errors
    /// [`Error::DesignUnreached`] says how far the mesh can be taken; [`Error::Interrupted`].
    ///
    /// # Panics
    /// If `p` has another length than there are variables.
    pub fn continue_to(
        &mut self,
        p: &[f64],
        interrupted: &dyn Fn() -> bool,
    ) -> Result<Vec<RoundEvent>, Error> {
        let Some(shape) = &self.shape else { return Ok(Vec::new()) };
        let displacement = shape.displacement(p);
        self.continue_to_displacement(displacement, interrupted)
    }

    /// As [`Problem::continue_to`] for displacements of the design nodes from the undeformed mesh [m], shape `(n_design, 3)`,
    /// whether or not any variables give them.
    ///
    /// # Errors
    /// As [`Problem::continue_to`].
    ///
    /// # Panics
    /// If there is not one displacement per design node.
    pub fn continue_to_displacement(
        &mut self,
        goal: Vec<Point>,
        interrupted: &dyn Fn() -> bool,
    ) -> Result<Vec<RoundEvent>, Error> {
        let Some(shape) = self.shape.as_mut().filter(|shape| shape.limits.rounds > 0) else {
            return Ok(Vec::new());
        };
        let Some((motion, events)) = shape.continued_to(shape.motion(), goal, interrupted)? else {
            return Ok(Vec::new());
        };
        shape.set_motion(motion);
        Ok(events)
    }
}

impl Shape {
    /// The mesh of a design from the undeformed one, whatever the present round.
    ///
    /// # Errors
    /// As [`Problem::continue_to`], and [`RemeshError::Inverted`] where there are no rounds.
    pub fn from_undeformed(&self, p: &[f64]) -> Result<Moved, Error> {
        let (motion, goal) = (self.motion().restarted()?, self.displacement(p));
        let continued =
            if self.limits.rounds > 0 { self.continued_to(&motion, goal.clone(), &|| false)? } else { None };
        let motion = continued.map_or(motion, |(motion, _)| motion);
        Ok(motion.moved(&goal)?)
    }

    /// The round whose reference has these displacements of the design nodes, and what happened on the way there; `None`
    /// if the reference of `motion` has them already.
    fn continued_to(
        &self,
        motion: &Motion,
        goal: Vec<Point>,
        interrupted: &dyn Fn() -> bool,
    ) -> Result<Option<(Motion, Vec<RoundEvent>)>, Error> {
        let start = motion.reference_design();
        if start == goal {
            return Ok(None);
        }
        // The rounds of the limits are the optimisation's.
        let limits = StepLimits { rounds: StepLimits::default().rounds, ..self.limits };
        match motion.moved(&goal) {
            Ok(moved)
                if 1.0 / moved.inversion.step <= limits.inversion_share
                    && motion.quality(&moved.mesh).worst >= limits.least_quality =>
            {
                let motion = motion.rebased(moved.mesh, moved.displacement, goal, motion.policy())?;
                return Ok(Some((motion, Vec::new())));
            }
            Ok(_) | Err(RemeshError::Inverted { .. }) => {}
            Err(other) => return Err(other.into()),
        }
        let path = |t: f64| -> Vec<Point> {
            let between =
                |(from, to): (&Point, &Point)| std::array::from_fn(|d| from[d] + t * (to[d] - from[d]));
            if t == 1.0 { goal.clone() } else { start.iter().zip(&goal).map(between).collect() }
        };
        let mut events = Vec::new();
        let outcome = motion.clone().step_along(&path, &limits, &mut |event: &StepEvent| {
            events.push(RoundEvent::of_continuation(event));
            if interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        let SteppingOutcome { motion, moved, reached, .. } = outcome;
        if reached < 1.0 {
            Error::check_interrupted(interrupted)?;
            return Err(Error::DesignUnreached { reached });
        }
        let policy = motion.policy();
        let motion = motion.rebased(moved.mesh, moved.displacement, goal.clone(), policy)?;
        Ok(Some((motion, events)))
    }
}
