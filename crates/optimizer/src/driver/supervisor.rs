//! Who looks at a search on its way, and may end it.

use std::time::{Duration, Instant};

use super::incumbent::BestField;
use super::observer::Observer;
use super::run::Run;
use super::stop::Stop;
use super::stop_reason::StopReason;
use crate::error::Error;
use crate::problem::{Analysis, Problem};

/// What a search has come to.
#[derive(Clone, Copy, Debug)]
pub struct Standing<'a> {
    /// The problem, on whose mesh it searches.
    pub problem: &'a Problem,
    /// Evaluations so far, those on coarser meshes included.
    pub evaluations: usize,
    /// The objective at the initial design.
    pub initial: f64,
    /// The evaluation of the best design.
    pub best_evaluation: usize,
    /// The field of the best design.
    pub best: &'a Analysis,
    /// When the time of the run is over; `None` without a limit, and before anything was computed that was not replayed.
    pub deadline: Option<Instant>,
}

/// Looks at a search between two evaluations, and may end it. Nothing is asked while evaluations are replayed, so that answers must
/// depend on what was evaluated alone.
pub trait Supervisor {
    /// Whether it ended the search after so many evaluations before the run was interrupted.
    fn had_ended(&self, evaluations: usize) -> bool {
        let _ = evaluations;
        false
    }

    /// Whether it wants to look at the search after so many evaluations.
    fn is_due(&self, evaluations: usize) -> bool {
        let _ = evaluations;
        false
    }

    /// Why the search ends here; `None` where it goes on.
    ///
    /// # Errors
    /// What the run fails with.
    fn look(
        &mut self,
        standing: &Standing<'_>,
        observer: &mut dyn Observer,
    ) -> Result<Option<StopReason>, Error> {
        let _ = (standing, observer);
        Ok(None)
    }
}

/// Never looks.
#[derive(Clone, Copy, Debug)]
pub struct Unsupervised;

impl Supervisor for Unsupervised {}

impl Run<'_> {
    fn deadline(&self) -> Option<Instant> {
        let seconds = self.settings.max_time.filter(|_| self.computed > 0)?;
        self.clock.checked_add(Duration::try_from_secs_f64(seconds).ok()?)
    }

    /// Lets the supervisor look at the search, where it wants to.
    pub(super) fn supervise(&mut self) -> Result<(), Stop> {
        if !self.supervisor.is_due(self.evaluations) {
            return Ok(());
        }
        let deadline = self.deadline();
        let (Some(best), Some(initial)) = (&mut self.best, &self.initial) else { return Ok(()) };
        best.compute_field(self.problem, self.observer)?;
        let BestField::Computed(analysis) = &best.field else { return Ok(()) };
        let standing = Standing {
            problem: self.problem,
            evaluations: self.evaluations,
            initial: initial.objective,
            best_evaluation: best.evaluation,
            best: analysis,
            deadline,
        };
        let reason = self.supervisor.look(&standing, self.observer)?;
        // That may have taken long.
        reason.or_else(|| self.limit_reached()).map_or(Ok(()), |reason| Err(Stop::Limit(reason)))
    }
}
