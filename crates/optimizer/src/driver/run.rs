//! The state of one optimisation: counts and limits, rounds of the mesh motion, the best design, the outcome.

use std::collections::BTreeSet;
use std::time::Instant;

use fluxmorph_remesh::{FallbackLevel, FallbackReport, RemeshError};

use super::incumbent::{BestField, Comparison, Incumbent, Initial};
use super::promised_gain::promised_gain;
use super::stop::Stop;
use super::{Observer, Optimised, Record, Recorder, Settings, Start, StopReason};
use crate::error::Error;
use crate::nlopt::Sample;
use crate::objective::{Combination, Goal};
use crate::problem::{Analysis, Problem, RoundEvent, RoundStart, Shape, SolverCache, Timings};

/// The state of one optimisation.
pub(super) struct Run<'a> {
    pub(super) problem: &'a mut Problem,
    pub(super) goal: Goal,
    pub(super) settings: &'a Settings,
    /// What the linear solvers keep of the designs before: which methods work.
    pub(super) cache: SolverCache,
    pub(super) observer: &'a mut dyn Observer,
    pub(super) recorder: &'a mut dyn Recorder,
    pub(super) interrupted: &'a dyn Fn() -> bool,
    pub(super) clock: Instant,
    pub(super) evaluations: usize,
    pub(super) iterations: usize,
    pub(super) initial: Option<Initial>,
    pub(super) last: Vec<f64>,
    /// The record that the next design should be answered with.
    pub(super) next: Option<Record>,
    pub(super) best: Option<Incumbent>,
    /// The mesh of the best design has changed: the next evaluation replaces it.
    pub(super) best_is_stale: bool,
    /// Without rounds: whether the mesh holds the best design back.
    pub(super) is_held_back: bool,
    /// Without rounds: what would help the mesh, each of which is said once.
    pub(super) cures: BTreeSet<&'static str>,
    worst_residual: f64,
    timings: Timings,
    rounds: Vec<RoundEvent>,
    /// Rounds begun at a best design.
    begun: usize,
    /// What the gradient promised at the first design.
    promised: Option<f64>,
    /// Times the mesh has been refined.
    pub(super) level: usize,
    /// Evaluations on coarser meshes.
    pub(super) first_evaluation: usize,
    /// How every round began.
    pub(super) starts: Vec<RoundStart>,
    /// Whether several ranks compute, or computed what is replayed.
    pub(super) is_shared_out: bool,
}

impl<'a> Run<'a> {
    pub(super) fn new(
        problem: &'a mut Problem,
        settings: &'a Settings,
        observer: &'a mut dyn Observer,
        recorder: &'a mut dyn Recorder,
        interrupted: &'a dyn Fn() -> bool,
    ) -> Self {
        let goal = problem.objective().expect("an optimisation has an objective").goal;
        let is_shared_out = problem.share().is_some() || !recorder.is_bitwise_reproducible();
        let last = problem.shape().expect("an optimisation has a shape").initial().to_vec();
        Self {
            problem,
            goal,
            settings,
            cache: SolverCache::default(),
            observer,
            recorder,
            interrupted,
            clock: Instant::now(),
            evaluations: 0,
            iterations: 0,
            initial: None,
            last,
            next: None,
            best: None,
            best_is_stale: false,
            is_held_back: false,
            cures: BTreeSet::new(),
            worst_residual: 0.0,
            timings: Timings::default(),
            rounds: Vec::new(),
            begun: 0,
            promised: None,
            level: 0,
            first_evaluation: 0,
            starts: Vec::new(),
            is_shared_out,
        }
    }

    /// Goes on counting where a search on a coarser mesh ended.
    pub(super) fn taking_over(self, start: &Start) -> Self {
        let Start { level, evaluations, iterations, .. } = *start;
        Self { level, evaluations, first_evaluation: evaluations, iterations, ..self }
    }

    pub(super) fn shape(&self) -> &Shape {
        self.problem.shape().expect("an optimisation has a shape")
    }

    pub(super) fn shape_mut(&mut self) -> &mut Shape {
        self.problem.shape_mut().expect("an optimisation has a shape")
    }

    pub(super) fn constraint_count(&self) -> usize {
        self.problem.constraints().len()
    }

    /// Terms of a worst case; none of a sum.
    pub(super) fn member_count(&self) -> usize {
        let worst = self.problem.objective().filter(|own| own.combination == Combination::WorstCase);
        worst.map_or(0, |objective| objective.terms.len())
    }

    /// Constraints that the method sees: those of the problem, and the room of a mesh without rounds.
    pub(super) fn method_constraint_count(&self) -> usize {
        let room = self.takes_constraints() && self.shape().motion().is_one_function();
        self.constraint_count() + usize::from(room)
    }

    pub(super) fn takes_constraints(&self) -> bool {
        self.settings.algorithm.takes_constraints()
    }

    pub(super) fn evaluations(&self) -> usize {
        self.evaluations
    }

    pub(super) fn has_best(&self) -> bool {
        self.best.is_some()
    }

    pub(super) fn best_evaluation(&self) -> Option<usize> {
        self.best.as_ref().map(|best| best.evaluation)
    }

    /// Violation and objective of the best design, unless its mesh has changed since it was evaluated.
    pub(super) fn incumbent_values(&self) -> Option<(f64, f64)> {
        let best = self.best.as_ref().filter(|_| !self.best_is_stale)?;
        Some((best.violation, best.objective))
    }

    /// Whether the best design is better than it was `before`, after so many evaluations and with those
    /// [`Run::incumbent_values`], by more than the share `least`.
    pub(super) fn has_gained(&self, before: (usize, Option<(f64, f64)>), least: f64) -> bool {
        self.best.as_ref().is_some_and(|best| match before {
            (evaluations, None) => best.evaluation > evaluations,
            (_, Some(values)) => best.has_gained(values, least),
        })
    }

    pub(super) fn warn(&mut self, message: &str) {
        self.observer.warning(message);
    }

    /// Keeps what happened to the mesh, and reports it.
    pub(super) fn report(&mut self, event: RoundEvent) {
        self.observer.round(&event);
        self.rounds.push(event);
    }

    /// Takes the mesh near the first design.
    ///
    /// # Errors
    /// As [`Problem::continue_to`]; [`Error::InterruptedRun`] where a signal comes.
    pub(super) fn continue_to_start(&mut self) -> Result<(), Error> {
        let first = self.shape().initial().to_vec();
        let events = self.problem.continue_to(&first, self.interrupted).map_err(|error| match error {
            Error::Interrupted => Error::InterruptedRun,
            other => other,
        })?;
        events.into_iter().for_each(|event| self.report(event));
        Ok(())
    }

    /// Whether another round may begin.
    pub(super) fn has_rounds_left(&self) -> bool {
        self.begun < self.shape().limits.rounds
    }

    /// Makes the mesh of the best design the reference, and counts the round.
    pub(super) fn begin_round(&mut self) -> Result<(), RemeshError> {
        self.begun += 1;
        self.rebase_at_best()
    }

    /// Makes the mesh of the best design the reference.
    fn rebase_at_best(&mut self) -> Result<(), RemeshError> {
        let Some(best) = self.best.as_ref().filter(|_| !self.best_is_stale) else { return Ok(()) };
        let shape = self.shape();
        let motion = match &best.field {
            BestField::Computed(analysis) => {
                let Analysis { mesh, displacement, .. } = &**analysis;
                shape.next_round(&best.values, mesh.clone(), displacement.clone())?
            }
            BestField::Replayed(state) => {
                let moved = state.motion.moved(&shape.displacement(&best.values))?;
                shape.next_round(&best.values, moved.mesh, moved.displacement)?
            }
        };
        let design_m = best.values.clone();
        self.shape_mut().set_motion(motion);
        self.starts.push(RoundStart::Reference { design_m });
        Ok(())
    }

    /// Lets the mesh motion fall back beyond `level` on the mesh of the best design, towards a design that was refused;
    /// `None` where no fallback is left.
    pub(super) fn fall_back(
        &mut self,
        wanted: &[f64],
        level: FallbackLevel,
    ) -> Result<Option<(FallbackReport, FallbackLevel)>, RemeshError> {
        if !self.has_rounds_left() {
            return Ok(None);
        }
        self.rebase_at_best()?;
        let shape = self.shape();
        let start = RoundStart::fallback(level, wanted);
        let escalated = shape.motion().escalate(&shape.displacement(wanted), level, &shape.limits)?;
        Ok(escalated.map(|(motion, report, level)| {
            self.best_is_stale = report.fallback.changes_mesh();
            self.shape_mut().set_motion(motion);
            self.starts.push(start);
            (report, level)
        }))
    }

    /// Why there is no fallback left, for a message.
    pub(super) fn why_no_fallback(&self) -> String {
        match self.shape().limits.rounds {
            _ if self.shape().motion().is_one_function() => {
                "and there is one mesh for every design".to_owned()
            }
            0 => "and no other reference mesh is allowed (rounds = 0)".to_owned(),
            rounds if !self.has_rounds_left() => format!("and all {rounds} rounds are used"),
            _ => "and no fallback of the mesh motion is left".to_owned(),
        }
    }

    /// Where the next search starts: the best design so far.
    pub(super) fn centre(&self) -> Vec<f64> {
        self.best.as_ref().map_or_else(|| self.shape().initial().to_vec(), |best| best.values.clone())
    }

    /// A signal or the time, where they end the run now.
    pub(super) fn limit_reached(&mut self) -> Option<StopReason> {
        if (self.interrupted)() {
            return Some(StopReason::Interrupted);
        }
        let over = |limit: f64| self.clock.elapsed().as_secs_f64() >= limit;
        // Without a first evaluation there would be nothing to keep, and what was computed before is replayed to its end.
        let is_over =
            self.initial.is_some() && self.settings.max_time.is_some_and(over) && !self.is_replaying();
        is_over.then_some(StopReason::MaxTime)
    }

    pub(super) fn check_limits(&mut self) -> Result<(), Stop> {
        let reason = match self.limit_reached() {
            Some(StopReason::Interrupted) => Some(StopReason::Interrupted),
            _ if self.evaluations >= self.settings.max_evaluations => Some(StopReason::MaxEvaluations),
            reason => reason,
        };
        reason.map_or(Ok(()), |reason| Err(Stop::Limit(reason)))
    }

    /// Whether there are evaluations of before that are still to be replayed.
    pub(super) fn is_replaying(&mut self) -> bool {
        if self.next.is_none() {
            self.next = self.recorder.replay(self.level);
        }
        self.next.is_some()
    }

    /// Counts an evaluation, and remembers the best with its `field`, which is asked for only then.
    pub(super) fn keep(
        &mut self,
        record: Record,
        sample: Sample,
        comparison: Comparison,
        field: impl FnOnce(&Self) -> BestField,
    ) {
        self.iterations = self.iterations_after(comparison);
        self.evaluations += 1;
        self.worst_residual = self.worst_residual.max(record.worst_residual);
        self.timings += record.timings;
        self.best_is_stale = false;
        self.last.clone_from(&record.design);
        if self.promised.is_none() {
            self.promised = Some(self.promised_gain(&sample, &record.design));
        }
        if comparison.is_improved() {
            let field = field(self);
            self.best = Some(Incumbent {
                evaluation: record.row.evaluation,
                values: record.design,
                objective: record.row.objective,
                violation: sample.violation(),
                sample,
                round: record.row.round,
                starts: self.starts.len(),
                field,
            });
        }
    }

    fn promised_gain(&self, sample: &Sample, design: &[f64]) -> f64 {
        let shape = self.shape();
        promised_gain(sample, design, shape.lower(), shape.upper())
    }

    /// What the gradient promised at the first design, and promises at the best one.
    pub(super) fn promised_gains(&self) -> Option<[f64; 2]> {
        let best = self.best.as_ref()?;
        Some([self.promised?, self.promised_gain(&best.sample, &best.values)])
    }

    /// Why a run ends whose mesh motion or field fails between two searches: what was reached is saved.
    ///
    /// # Errors
    /// The error itself, where there is no best design or it is another one.
    pub(super) fn salvage(&mut self, error: Error) -> Result<StopReason, Error> {
        let reason = match &error {
            Error::Remesh(_) => StopReason::MeshLimited,
            other if other.is_numerical() => StopReason::NumericalFailure,
            _ => return Err(error),
        };
        if !self.has_best() {
            return Err(error);
        }
        self.warn(&error.to_string());
        Ok(reason)
    }

    /// The outcome, with the field of the best design.
    pub(super) fn finish(mut self, stop_reason: StopReason) -> Result<Optimised, Error> {
        let is_cut = stop_reason == StopReason::Interrupted && (self.is_replaying() || self.best.is_none());
        if is_cut {
            return Err(Error::InterruptedRun);
        }
        if let Some(record) = self.next.take().or_else(|| self.recorder.replay(self.level)) {
            let (evaluation, cause) = (record.row.evaluation, "the run now ends before it".to_owned());
            return Err(Error::Replay { evaluation, cause });
        }
        let (Some(best), Some(initial)) = (self.best.take(), self.initial.take()) else {
            return Err(Error::Optimisation { cause: "it ended before the first evaluation" });
        };
        let best = self.with_field(best)?;
        if best.violation > 0.0 {
            self.warn(&format!(
                "no design keeps all constraints: the best one is beyond a bound by {:.1e} of it; loosen the constraint, \
                 widen the design's bounds, or allow more evaluations",
                best.violation
            ));
        }
        let is_infeasible = stop_reason.is_converged() && best.violation > 0.0;
        Ok(Optimised {
            stop_reason: if is_infeasible { StopReason::Infeasible } else { stop_reason },
            evaluations: self.evaluations,
            iterations: self.iterations,
            initial: initial.objective,
            bounds: initial.bounds,
            best,
            initial_quality: initial.quality,
            worst_residual: self.worst_residual,
            timings: self.timings,
            rounds: self.rounds,
        })
    }
}
