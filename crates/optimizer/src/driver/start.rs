//! Where a search begins: at the initial design, or with the best one of a search on a coarser mesh. What is bounded has other values on
//! another mesh, so that this one may be beyond a bound there. It counts as the best one all the same, and the initial one is set aside
//! until the search has come to a better one within the bounds.

use super::incumbent::{Comparison, Incumbent};
use super::run::Run;
use super::stop::{Refusal, Stop};
use super::stop_reason::StopReason;
use crate::error::Error;

/// What a search takes over from one on a coarser mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Start {
    /// Times the mesh has been refined.
    pub level: usize,
    /// Evaluations before.
    pub evaluations: usize,
    /// Of these, the ones that improved on those before them.
    pub iterations: usize,
    /// The design to go on from [m]; `None` for the initial one. The initial one is evaluated before it: it fixes the scale of
    /// the objective and the bounds of the constraints on this mesh.
    pub design: Option<Vec<f64>>,
    /// The bounds of the constraints on that mesh, in SI: of shares of an initial value that has another sign on this one.
    pub bounds: Vec<f64>,
}

impl Run<'_> {
    /// Evaluates the initial design and the one to go on from, which is the best one then where its objective is better on this mesh;
    /// where it is not, or the mesh does not carry it, the search begins at the initial one. A reason where that is not the end of it.
    ///
    /// # Errors
    /// As an evaluation; [`Error::FirstDesign`] where the mesh does not carry the initial design.
    pub(super) fn take_up(&mut self, design: Option<&[f64]>) -> Result<Option<StopReason>, Error> {
        let Some(design) = design else { return Ok(None) };
        let initial = self.shape().initial().to_vec();
        if let Some(reason) = self.evaluated(&initial)? {
            return Ok(Some(reason));
        }
        // On this mesh the best design is known only then: no time ends the run between the two.
        self.is_taking_up = true;
        let reason = self.evaluated(design)?;
        self.is_taking_up = false;
        if reason.is_some() {
            return Ok(reason);
        }
        let has_gained = self.best_evaluation().is_some_and(|best| best > self.first_evaluation);
        if self.set_aside.is_some() {
            let beyond = self.violations().join(", of ");
            let what =
                format!("on this mesh the best design of the coarser one is beyond the bound of {beyond}");
            self.note_going_on(&what, ": the search begins there");
        } else if !has_gained && design != initial {
            self.warn(
                "the best design of the coarser mesh is no better than the initial one on this mesh, or out of its reach: the \
                 search begins anew",
            );
        }
        Ok(None)
    }

    /// Takes the initial design back that was set aside, where the search has not come to one that is better by more than its tolerance;
    /// whether it has not.
    pub(super) fn take_back(&mut self) -> bool {
        let Some(initial) = self.set_aside.take() else { return false };
        let before = (initial.violation, initial.objective);
        let is_better = |best: &Incumbent| {
            initial.compare(self.goal, best.objective, &best.sample) == Comparison::Better
                && best.has_gained(before, self.settings.least_gain())
        };
        if self.best.as_ref().is_some_and(is_better) {
            return false;
        }
        self.best = Some(initial);
        self.warn(
            "from the best design of the coarser mesh the search has come to none within the bounds that is better than the initial \
             one",
        );
        true
    }

    /// The limit that an evaluation runs into, if it does.
    fn evaluated(&mut self, p: &[f64]) -> Result<Option<StopReason>, Error> {
        match self.evaluate(p) {
            Ok(_) | Err(Stop::CutShort | Stop::Astray | Stop::Stagnant) => Ok(None),
            Err(Stop::Limit(reason)) => Ok(Some(reason)),
            Err(Stop::Mesh(_)) if self.has_best() => Ok(None),
            Err(Stop::Mesh(Refusal { cause })) => Err(Error::FirstDesign { cause }),
            Err(Stop::Error(error)) => Err(*error),
        }
    }
}
