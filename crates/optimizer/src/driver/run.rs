//! The state of one optimisation: counts and limits, the best design, the outcome.

use std::collections::BTreeSet;
use std::time::Instant;

use super::incumbent::{BestField, Comparison, Incumbent, Initial};
use super::near_miss::NearMiss;
use super::promised_gain::{BELIEVED_TOLERANCES, HELD_TOLERANCES, least_promised_gain, promised_gain};
use super::stop::Stop;
use super::{Observer, Optimised, Record, Recorder, Settings, Start, StopReason, Supervisor};
use crate::error::Error;
use crate::nlopt::{CONSTRAINT_TOLERANCE, Sample};
use crate::objective::{Combination, Goal};
use crate::problem::{Problem, Shape, SolverCache, Timings};

/// Share of the initial objective below which what is left is taken for rounding: a millionth of a field, squared.
const VANISHED: f64 = 1e-12;

/// Share of the range of every variable, and of `ftol_rel` for the value, within which an evaluation has led nowhere from the best design.
/// At an optimum on its bounds rounding keeps `mma` and `ccsaq` from believing their models, which they make steeper and steeper, and
/// `ftol_rel` is not asked meanwhile: up to sixteen evaluations went to one design.
const STAGNANT: [f64; 2] = [1e-6, 0.01];

/// Share of what a search has gained above which what the gradient promises to first order is said: as much again may be there.
const MUCH: f64 = 0.5;

/// The state of one optimisation.
pub(super) struct Run<'a> {
    pub(super) problem: &'a mut Problem,
    pub(super) goal: Goal,
    pub(super) settings: &'a Settings,
    /// What the linear solvers keep of the designs before: which methods work.
    pub(super) cache: SolverCache,
    pub(super) observer: &'a mut dyn Observer,
    pub(super) recorder: &'a mut dyn Recorder,
    pub(super) supervisor: &'a mut dyn Supervisor,
    pub(super) interrupted: &'a dyn Fn() -> bool,
    pub(super) clock: Instant,
    pub(super) evaluations: usize,
    pub(super) iterations: usize,
    pub(super) initial: Option<Initial>,
    /// Bounds of the constraints on a coarser mesh, in SI.
    pub(super) known_bounds: Vec<f64>,
    /// Whether the design of a coarser mesh is evaluated.
    pub(super) is_taking_up: bool,
    /// The initial design, where that of a coarser mesh counts as the best one although it is beyond a bound on this mesh.
    pub(super) set_aside: Option<Incumbent>,
    /// Evaluations that were not replayed.
    pub(super) computed: usize,
    pub(super) last: Vec<f64>,
    /// What the method has seen of the design before.
    pub(super) latest: Option<Sample>,
    /// Designs in a row that were answered from another one's sample.
    pub(super) repeated: usize,
    /// The record that the next design should be answered with.
    pub(super) next: Option<Record>,
    pub(super) best: Option<Incumbent>,
    /// Whether the mesh holds the best design back.
    pub(super) is_held_back: bool,
    /// What would help the mesh, each of which is said once.
    pub(super) cures: BTreeSet<&'static str>,
    worst_residual: f64,
    timings: Timings,
    /// What the gradient promised at the first design.
    promised: Option<f64>,
    /// Designs beyond a bound by little, in the order of their evaluations.
    pub(super) near_misses: Vec<NearMiss>,
    /// While one of them is evaluated a step back: why the search before it ended.
    pub(super) stepping_back: Option<StopReason>,
    /// Times the mesh has been refined.
    pub(super) level: usize,
    /// Evaluations on coarser meshes.
    pub(super) first_evaluation: usize,
    /// Whether several ranks compute, or computed what is replayed.
    pub(super) is_shared_out: bool,
}

impl<'a> Run<'a> {
    pub(super) fn new(
        problem: &'a mut Problem,
        settings: &'a Settings,
        observer: &'a mut dyn Observer,
        (recorder, supervisor): (&'a mut dyn Recorder, &'a mut dyn Supervisor),
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
            supervisor,
            interrupted,
            clock: Instant::now(),
            evaluations: 0,
            iterations: 0,
            initial: None,
            known_bounds: Vec::new(),
            is_taking_up: false,
            set_aside: None,
            computed: 0,
            last,
            latest: None,
            repeated: 0,
            next: None,
            best: None,
            is_held_back: false,
            cures: BTreeSet::new(),
            worst_residual: 0.0,
            timings: Timings::default(),
            promised: None,
            near_misses: Vec::new(),
            stepping_back: None,
            level: 0,
            first_evaluation: 0,
            is_shared_out,
        }
    }

    /// Goes on counting where a search on a coarser mesh ended.
    pub(super) fn taking_over(self, start: &Start) -> Self {
        let Start { level, evaluations, iterations, .. } = *start;
        let known_bounds = start.bounds.clone();
        Self { level, evaluations, first_evaluation: evaluations, iterations, known_bounds, ..self }
    }

    pub(super) fn shape(&self) -> &Shape {
        self.problem.shape().expect("an optimisation has a shape")
    }

    pub(super) fn constraint_count(&self) -> usize {
        self.problem.constraints().len()
    }

    /// The constraints that the method is not shown, ascending, and the number of limits in their place.
    pub(super) fn replaced(&self) -> (Vec<usize>, usize) {
        let constraints = self.problem.constraints().iter().enumerate();
        let replaced = constraints.filter_map(|(k, own)| Some((k, own.limit_count()?)));
        let (replaced, counts): (Vec<_>, Vec<usize>) = replaced.unzip();
        (replaced, counts.iter().sum())
    }

    /// How far the best design, which counts by the constraints themselves, is beyond the limits in their place: a search from it begins
    /// within.
    pub(super) fn leeway(&self) -> Vec<f64> {
        let best = self.best.as_ref().filter(|best| best.violation == 0.0);
        best.map_or_else(Vec::new, |best| best.sample.limits.iter().map(|(c, _)| c.max(0.0)).collect())
    }

    /// Terms of a worst case; none of a sum.
    pub(super) fn member_count(&self) -> usize {
        let worst = self.problem.objective().filter(|own| own.combination == Combination::WorstCase);
        worst.map_or(0, |objective| objective.terms.len())
    }

    /// Constraints that the method sees beside those of the problem: the room of the mesh.
    pub(super) fn mesh_constraint_count(&self) -> usize {
        usize::from(self.takes_constraints())
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

    /// Violation and objective of the best design.
    pub(super) fn incumbent_values(&self) -> Option<(f64, f64)> {
        self.best.as_ref().map(|best| (best.violation, best.objective))
    }

    /// Violation of the best design, and its value as the method sees it.
    pub(super) fn incumbent_sample(&self) -> Option<(f64, f64)> {
        self.best.as_ref().map(|best| (best.violation, best.sample.value))
    }

    /// The best design, and its value as the method sees it.
    pub(super) fn incumbent_design(&self) -> Option<(Vec<f64>, f64)> {
        self.best.as_ref().map(|best| (best.values.clone(), best.sample.value))
    }

    /// Whether there are designs, and none keeps all constraints.
    pub(super) fn violates(&self) -> bool {
        self.best.as_ref().is_some_and(|best| best.violation > 0.0)
    }

    /// Whether the best design is better than it was `before`, after so many evaluations and with those
    /// [`Run::incumbent_values`], by more than the share `least`.
    pub(super) fn has_gained(&self, before: (usize, Option<(f64, f64)>), least: f64) -> bool {
        self.best.as_ref().is_some_and(|best| match before {
            (evaluations, None) => best.evaluation > evaluations,
            (_, Some(values)) => best.has_gained(values, least),
        })
    }

    /// Whether an evaluation has led nowhere from what was the best design with its value before, after so many evaluations.
    pub(super) fn is_stagnant(
        &self,
        (evaluations, best): (usize, Option<(Vec<f64>, f64)>),
        sample: &Sample,
        ([lower, upper], ftol_rel): (&[Vec<f64>; 2], f64),
    ) -> bool {
        let Some((design, value)) = best.filter(|_| self.evaluations() > evaluations) else { return false };
        let [range_share, value_share] = STAGNANT;
        (sample.value - value).abs() <= value_share * ftol_rel * value.abs()
            && (0..design.len())
                .all(|k| (self.last[k] - design[k]).abs() <= range_share * (upper[k] - lower[k]))
    }

    pub(super) fn warn(&mut self, message: &str) {
        self.observer.warning(message);
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
        // Without a first evaluation there would be nothing to keep; a run that is resumed gets one evaluation further at least,
        // however short its time.
        let must_go_on = self.computed == 0 || self.is_taking_up;
        let is_over = !must_go_on && self.settings.max_time.is_some_and(over) && !self.is_replaying();
        is_over.then_some(StopReason::MaxTime)
    }

    fn evaluations_left(&self) -> usize {
        self.settings.max_evaluations.saturating_sub(self.evaluations)
    }

    /// Reports what has happened, and how the search goes on where no limit keeps it from that.
    pub(super) fn note_going_on(&mut self, what: &str, plan: &str) {
        let goes_on = self.evaluations_left() > 0 && self.limit_reached().is_none();
        self.observer.note(&if goes_on { format!("{what}{plan}") } else { what.to_owned() });
    }

    pub(super) fn check_limits(&mut self) -> Result<(), Stop> {
        let left = self.evaluations_left();
        let reason = match self.limit_reached() {
            Some(StopReason::Interrupted) => Some(StopReason::Interrupted),
            _ if self.supervisor.had_ended(self.evaluations) => Some(StopReason::Superseded),
            _ if left == 0 => Some(StopReason::MaxEvaluations),
            // The last one is for a step back within the bounds, and so is the last before the search is looked at.
            None if (left == 1 || self.supervisor.is_due(self.evaluations + 1))
                && self.next_step_back()?.is_some() =>
            {
                Some(StopReason::MaxEvaluations)
            }
            reason => reason,
        };
        reason.map_or_else(|| self.supervise(), |reason| Err(Stop::Limit(reason)))
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
        field: impl FnOnce() -> BestField,
    ) {
        self.iterations = self.iterations_after(comparison);
        self.evaluations += 1;
        self.worst_residual = self.worst_residual.max(record.worst_residual);
        self.timings += record.timings;
        self.last.clone_from(&record.design);
        if self.promised.is_none() {
            self.promised = Some(self.promised_gain(&sample, &record.design));
            self.note_violations(&sample);
            self.note_far_bounds(&record.constraints);
        }
        self.latest = Some(sample.clone());
        self.repeated = 0;
        let bounds = [self.shape().lower(), self.shape().upper()];
        let miss = NearMiss::of(&record, &sample, bounds);
        self.near_misses.extend(miss);
        if comparison.is_improved() {
            let before = self.best.replace(Incumbent {
                evaluation: record.row.evaluation,
                values: record.design,
                objective: record.row.objective,
                violation: sample.violation(),
                sample,
                field: field(),
            });
            if self.is_taking_up && self.violates() {
                self.set_aside = before;
            }
        }
        let values = self.incumbent_sample();
        self.near_misses.retain(|miss| values.is_none_or(|best| miss.gain(best).is_some()));
    }

    /// Says which bounds the initial design does not keep.
    fn note_violations(&mut self, initial: &Sample) {
        let named = self.problem.constraints().iter().zip(&initial.constraints);
        let broken =
            named.filter(|(_, (excess, _))| *excess > CONSTRAINT_TOLERANCE && self.first_evaluation == 0);
        let broken: Vec<String> = broken.map(|(own, _)| format!("`{}`", own.name)).collect();
        if !broken.is_empty() {
            self.observer.note(&format!(
                "the initial design violates {}: designs that keep it come first, whatever their objective",
                broken.join(", ")
            ));
        }
    }

    /// Says which bounds are given in a unit that is hardly meant.
    fn note_far_bounds(&mut self, initial: &[(f64, Vec<f64>)]) {
        if self.first_evaluation > 0 {
            return;
        }
        let found = self.problem.constraints().iter().zip(initial);
        let found: Vec<String> = found.filter_map(|(own, (value, _))| own.far_bound(*value)).collect();
        found.iter().for_each(|text| self.observer.note(text));
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

    /// What the gradient promises at the best design at least, where a search that has gained nothing is not to be believed for it.
    pub(super) fn surely_promised(&self) -> Option<f64> {
        self.promised(BELIEVED_TOLERANCES)?;
        self.least_promised().filter(|least| *least > BELIEVED_TOLERANCES * self.settings.least_gain())
    }

    /// What the gradient promises at the best design at least, where something was gained and this is more than the tolerance and than much
    /// of that gain.
    fn promised_beside(&self, gain: f64) -> Option<f64> {
        let tolerance = self.settings.least_gain();
        self.promised(1.0).filter(|_| gain > tolerance)?;
        self.least_promised().filter(|least| *least > (MUCH * gain).max(tolerance))
    }

    /// Whether bounds and constraints together leave nothing of what the gradient promises at the best design.
    pub(super) fn is_held(&self) -> bool {
        self.leaves_less_than(HELD_TOLERANCES)
    }

    /// Whether bounds and constraints leave less of what the gradient promises at the best design than so many times the tolerance.
    pub(super) fn leaves_less_than(&self, tolerances: f64) -> bool {
        self.least_promised().is_some_and(|least| least < tolerances * self.settings.least_gain())
    }

    fn least_promised(&self) -> Option<f64> {
        let (best, shape) = (self.best.as_ref()?, self.shape());
        Some(least_promised_gain(&best.sample, &best.values, shape.lower(), shape.upper()))
    }

    /// What the gradient promises at the best design, where that is more than so many times the tolerance of the objective and more
    /// than rounding, and neither the mesh nor a constraint is in the way.
    pub(super) fn promised(&self, tolerances: f64) -> Option<f64> {
        let has_vanished = self.best.as_ref().is_none_or(|best| best.sample.value.abs() < VANISHED);
        let [_, now] =
            self.promised_gains().filter(|_| !self.violates() && !self.is_held_back && !has_vanished)?;
        (now > tolerances * self.settings.least_gain()).then_some(now)
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
        let goes_on = stop_reason == StopReason::Superseded;
        if !goes_on {
            self.take_back();
        }
        let warnings = if goes_on { Vec::new() } else { self.reservations(stop_reason) };
        warnings.iter().for_each(|warning| self.warn(warning));
        let (Some(best), Some(initial)) = (self.best.take(), self.initial.take()) else {
            return Err(Error::Optimisation { cause: "it ended before the first evaluation" });
        };
        let best = self.with_field(best)?;
        let is_infeasible = stop_reason.is_converged() && best.violation > 0.0;
        Ok(Optimised {
            stop_reason: if is_infeasible { StopReason::Infeasible } else { stop_reason },
            evaluations: self.evaluations,
            computed: self.computed,
            iterations: self.iterations,
            initial: initial.objective,
            initial_members: initial.members,
            bounds: initial.bounds,
            best,
            initial_quality: initial.quality,
            worst_residual: self.worst_residual,
            timings: self.timings,
            warnings,
        })
    }

    /// The constraints that the best design does not keep, each with its excess, in words.
    pub(super) fn violations(&self) -> Vec<String> {
        let (Some(best), Some(initial)) = (&self.best, &self.initial) else { return Vec::new() };
        let limits = self.problem.constraints().iter().zip(&initial.bounds);
        let violated = best.sample.constraints.iter().zip(limits);
        let violated = violated.filter(|((excess, _), _)| *excess > CONSTRAINT_TOLERANCE);
        let words = violated.map(|((excess, _), (own, bound))| {
            let margin =
                if own.has_margin() { " (the search keeps a hundredth of it as a margin)" } else { "" };
            format!("`{}` by {excess:.1e} {}{margin}", own.name, bound.excess_is())
        });
        words.collect()
    }

    /// What is to be said at the end of the best design and its constraints.
    fn reservations(&self, stop_reason: StopReason) -> Vec<String> {
        let (Some(best), Some(initial)) = (&self.best, &self.initial) else { return Vec::new() };
        let mut warnings = Vec::new();
        let gain = (best.objective / initial.objective - 1.0).abs();
        let promised = self.surely_promised().or_else(|| self.promised_beside(gain));
        if let Some(promised) = promised.filter(|_| stop_reason == StopReason::ObjectiveConverged) {
            warnings.push(format!(
                "the search came to its tolerance while the gradient still promises {:.1} % of the objective, if all designs within \
                 the bounds had its slope: a run by another method or with a smaller tolerance, or one that begins with this design, \
                 shows how much of that is to be had",
                100.0 * promised
            ));
        }
        if best.violation > 0.0 {
            warnings.push(format!(
                "no design keeps all constraints: the best one is beyond the bound of {}; loosen what is violated, widen the \
                 design's bounds, or allow more evaluations",
                self.violations().join(", of ")
            ));
        }
        if let Some(miss) = self.missed().filter(|_| best.violation == 0.0) {
            let (evaluation, objective, (k, excess)) = (miss.evaluation, miss.objective, miss.worst);
            let (constraint, bound) = (&self.problem.constraints()[k], &initial.bounds[k]);
            warnings.push(format!(
                "evaluation {evaluation} has an objective of {objective:.6e}, against {:.6e} of the best design, and does not count: it is \
                 beyond the bound of `{}` by {excess:.1e} {}, where {CONSTRAINT_TOLERANCE:e} is kept; allow more evaluations, or another \
                 method of those that take constraints",
                best.objective,
                constraint.name,
                bound.excess_is()
            ));
        }
        warnings
    }
}
