//! One evaluation after another: limits, the mesh, objective and constraints, the row of the history, the best design.

use std::collections::BTreeMap;
use std::time::Instant;

use fluxmorph_geometry::ElementId;
use fluxmorph_remesh::{FallbackLevel, FallbackReport, Moved, RemeshError};

use super::incumbent::{BestField, Comparison, Incumbent, Initial, violation};
use super::search::{Refusal, Stop};
use super::{Evaluation, Observer, Optimised, Record, Recorder, Settings, StopReason, column, reference_hash};
use crate::error::Error;
use crate::nlopt::Sample;
use crate::objective::Goal;
use crate::problem::{
    Analysis, Derivatives, Measured, Problem, RoundEvent, Shape, SolverCache, Stage, Timings,
};

/// The state of one optimisation.
pub(super) struct Run<'a> {
    pub(super) problem: &'a mut Problem,
    goal: Goal,
    settings: &'a Settings,
    /// What the linear solvers keep of the designs before: which methods work.
    pub(super) cache: SolverCache,
    pub(super) observer: &'a mut dyn Observer,
    recorder: &'a mut dyn Recorder,
    interrupted: &'a dyn Fn() -> bool,
    pub(super) clock: Instant,
    evaluations: usize,
    iterations: usize,
    initial: Option<Initial>,
    last: Vec<f64>,
    /// The record that the next design should be answered with.
    next: Option<Record>,
    best: Option<Incumbent>,
    /// The best design has another mesh now: the next evaluation takes its place.
    best_is_stale: bool,
    worst_residual: f64,
    timings: Timings,
    rounds: Vec<RoundEvent>,
    /// Rounds begun at a best design.
    begun: usize,
    /// Whether ranks have a share in what is computed, or had one in what is replayed.
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
            worst_residual: 0.0,
            timings: Timings::default(),
            rounds: Vec::new(),
            begun: 0,
            is_shared_out,
        }
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

    pub(super) fn evaluations(&self) -> usize {
        self.evaluations
    }

    pub(super) fn has_best(&self) -> bool {
        self.best.is_some()
    }

    pub(super) fn best_evaluation(&self) -> Option<usize> {
        self.best.as_ref().map(|best| best.evaluation)
    }

    /// Violation and objective of the best design, where it stands on its own mesh.
    pub(super) fn standing(&self) -> Option<(f64, f64)> {
        let best = self.best.as_ref().filter(|_| !self.best_is_stale)?;
        Some((best.violation, best.objective))
    }

    /// Whether the best design is better than it was `before`, at so many evaluations and with that standing, by more
    /// than the share `least`.
    pub(super) fn has_gained(&self, before: (usize, Option<(f64, f64)>), least: f64) -> bool {
        self.best.as_ref().is_some_and(|best| match before {
            (evaluations, None) => best.evaluation > evaluations,
            (_, Some(standing)) => best.has_gained(standing, least),
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
        self.shape_mut().set_motion(motion);
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
        let escalated = shape.motion().escalate(&shape.displacement(wanted), level, &shape.limits)?;
        Ok(escalated.map(|(motion, report, level)| {
            self.best_is_stale = report.fallback.changes_mesh();
            self.shape_mut().set_motion(motion);
            (report, level)
        }))
    }

    /// Why there is no fallback left, for a message.
    pub(super) fn why_no_fallback(&self) -> String {
        match self.shape().limits.rounds {
            0 => "and no other reference mesh is allowed (rounds = 0)".to_owned(),
            rounds if !self.has_rounds_left() => format!("and all {rounds} rounds are used"),
            _ => "and no fallback of the mesh motion is left".to_owned(),
        }
    }

    /// Where the next search starts: the best design so far.
    pub(super) fn centre(&self) -> Vec<f64> {
        self.best.as_ref().map_or_else(|| self.shape().initial().to_vec(), |best| best.values.clone())
    }

    /// ±F/|F0| and the constraints of a design, with their gradients.
    ///
    /// What is known of the best design in this round is not computed again, nor what was computed before the run was
    /// interrupted.
    pub(super) fn evaluate(&mut self, p: &[f64]) -> Result<Sample, Stop> {
        let round = self.shape().motion().round();
        if let Some(best) = &self.best
            && best.round == round
            && best.values == p
        {
            return Ok(best.sample.clone());
        }
        if self.is_replaying() && (self.interrupted)() {
            return Err(Stop::Limit(StopReason::Interrupted));
        }
        match self.next.take() {
            Some(record) if self.is_of(&record, p) => self.replay(record),
            Some(record) => {
                // A design that the mesh refused has left no record.
                let difference = self.difference(&record, p);
                self.next = Some(record);
                self.mesh(p)?;
                Err(Stop::Error(Box::new(difference)))
            }
            None => self.compute(p),
        }
    }

    /// Computes a design.
    fn compute(&mut self, p: &[f64]) -> Result<Sample, Stop> {
        self.check_limits()?;
        let clock = Instant::now();
        self.observer.stage(Stage::Moving);
        let moved = self.mesh(p)?;
        let remesh = clock.elapsed().as_secs_f64();
        let Self { problem, cache, observer, .. } = self;
        let progress = &mut |stage| observer.stage(stage);
        let mut analysis = problem.analyse(moved, p, Derivatives::First, cache, progress)?;
        analysis.timings.remesh += remesh;
        let values: Vec<f64> = analysis.constraints.iter().map(|measured| measured.value).collect();
        let objective = analysis.objective.expect("an optimisation has an objective");
        let initial = self.initial(objective, analysis.quality.worst, &values)?;
        let mut record = self.record(p, &initial, &analysis);
        let sample = self.sample(&initial, &record);
        // Before anything of it is kept.
        sample.check(p.len(), self.constraint_count())?;
        let comparison = self.compare(objective, &sample);
        record.improved = comparison.is_improved();
        record.row.iteration = self.iterations_after(comparison);
        let names = self.problem.constraints().iter().map(|constraint| column(&constraint.name));
        record.row.constraints = names.zip(sample.constraints.iter().map(|(c, _)| *c)).collect();
        record.row.seconds = clock.elapsed().as_secs_f64();
        for event in &analysis.solver_events {
            self.observer.notice(&event.to_string());
        }
        self.observer.stage(Stage::Writing);
        self.recorder.record(&record, &analysis, self.problem)?;
        self.observer.evaluation(&record.row);
        self.keep(record, sample.clone(), comparison, |_| BestField::Computed(Box::new(analysis)));
        Ok(sample)
    }

    /// The mesh of a design, unless it goes beyond what the round's reference can carry.
    fn mesh(&self, p: &[f64]) -> Result<Moved, Stop> {
        let refused = |cause: String| Stop::Mesh(Refusal { cause, wanted: p.to_vec() });
        let moved = self.problem.moved(p).map_err(|error| match error {
            RemeshError::Inverted { .. } => refused(error.to_string()),
            other => Stop::Error(Box::new(other.into())),
        })?;
        let limits = &self.shape().limits;
        let share = 1.0 / moved.inversion.step;
        // Without rounds there is no other reference to take.
        if let Some(element) =
            moved.inversion.element.filter(|_| share > limits.inversion_share && limits.rounds > 0)
        {
            return Err(refused(format!(
                "a design would go {:.0} % of the way to inverting element {element}, beyond the allowed share of {}",
                100.0 * share,
                limits.inversion_share
            )));
        }
        if limits.least_quality > 0.0 {
            let quality = self.problem.quality(&moved.mesh);
            if quality.worst < limits.least_quality {
                return Err(refused(format!(
                    "element {} would have the quality {:.4e}, below the minimum of {:.4e}",
                    quality.worst_element, quality.worst, limits.least_quality
                )));
            }
        }
        Ok(moved)
    }

    /// Scale of the objective and bounds of the constraints, which the first design fixes.
    pub(super) fn initial(
        &mut self,
        objective: f64,
        quality: f64,
        measured: &[f64],
    ) -> Result<Initial, Error> {
        if let Some(initial) = &self.initial {
            return Ok(initial.clone());
        }
        if objective == 0.0 {
            return Err(Error::Optimisation {
                cause: "the objective of the initial design is zero: there is no field to change, or its terms cancel; \
                        check coils, regions, frequencies and weights",
            });
        }
        let constraints = self.problem.constraints().iter().zip(measured);
        let bounds = constraints.map(|(constraint, &value)| constraint.bound(value));
        let initial = Initial { objective, quality, bounds: bounds.collect::<Result<_, _>>()? };
        Ok(self.initial.insert(initial).clone())
    }

    /// What the method sees of a design.
    pub(super) fn sample(&self, initial: &Initial, record: &Record) -> Sample {
        let scale = self.goal.sign() / initial.objective.abs();
        let constraints = initial.bounds.iter().zip(&record.constraints);
        Sample {
            value: scale * record.row.objective,
            gradient: record.gradient.iter().map(|d| scale * d).collect(),
            constraints: constraints
                .map(|(bound, (value, gradient))| (bound.excess(*value), bound.gradient(gradient)))
                .collect(),
        }
    }

    /// How a design compares with the best so far.
    pub(super) fn compare(&self, objective: f64, sample: &Sample) -> Comparison {
        match &self.best {
            None => Comparison::First,
            Some(_) if self.best_is_stale => Comparison::Remeshed,
            Some(best) => best.compare(self.goal, objective, sample),
        }
    }

    pub(super) fn iterations_after(&self, comparison: Comparison) -> usize {
        self.iterations + usize::from(comparison == Comparison::Better)
    }

    /// The record of a design, but for how it compares with the best.
    fn record(&self, p: &[f64], initial: &Initial, analysis: &Analysis) -> Record {
        let shape = self.shape();
        let displacements = || shape.surface().normal_displacements(p);
        let thickness = shape.thickness().map(|thickness| thickness.range(&displacements()));
        let difference: Vec<f64> = p.iter().zip(&self.last).map(|(p, last)| p - last).collect();
        let objective = analysis.objective.expect("an optimisation has an objective");
        let gradient = analysis.gradient.clone().expect("a gradient was asked for");
        let region = |e: ElementId| analysis.mesh.topology().region_name_at(e).to_owned();
        let row = Evaluation {
            evaluation: self.evaluations,
            iteration: 0,
            objective,
            ratio: objective / initial.objective,
            gradient_norm: euclidean(&gradient),
            step_norm: euclidean(&difference),
            worst_quality: analysis.quality.worst,
            min_thickness_m: thickness.map(|t| t.0),
            max_thickness_m: thickness.map(|t| t.1),
            linear_iterations: analysis.linear_iterations,
            seconds: 0.0,
            step_to_inversion: analysis.inversion.element.map(|_| analysis.inversion.step),
            inversion_element: analysis.inversion.element.map(ElementId::index),
            inversion_region: analysis.inversion.element.map(region),
            round: shape.motion().round(),
            constraints: BTreeMap::new(),
        };
        let constraint = |measured: &Measured| {
            (measured.value, measured.gradient.clone().expect("a gradient was asked for"))
        };
        Record {
            row,
            improved: false,
            design: p.to_vec(),
            gradient,
            constraints: analysis.constraints.iter().map(constraint).collect(),
            reference: reference_hash(shape.motion().reference()),
            methods: self.cache.methods(),
            worst_residual: analysis.worst_residual,
            timings: analysis.timings,
        }
    }

    /// A signal or the time, where they end the run now.
    pub(super) fn limit_reached(&mut self) -> Option<StopReason> {
        if (self.interrupted)() {
            return Some(StopReason::Interrupted);
        }
        let over = |limit: f64| self.clock.elapsed().as_secs_f64() >= limit;
        // Without a first evaluation there would be nothing to keep, and what was computed before is replayed to its end.
        let is_over =
            self.evaluations > 0 && self.settings.max_time.is_some_and(over) && !self.is_replaying();
        is_over.then_some(StopReason::MaxTime)
    }

    fn check_limits(&mut self) -> Result<(), Stop> {
        let reason = match self.limit_reached() {
            Some(StopReason::Interrupted) => Some(StopReason::Interrupted),
            _ if self.evaluations >= self.settings.max_evaluations => Some(StopReason::MaxEvaluations),
            reason => reason,
        };
        reason.map_or(Ok(()), |reason| Err(Stop::Limit(reason)))
    }

    /// Whether there are evaluations of before that are still to be replayed.
    fn is_replaying(&mut self) -> bool {
        if self.next.is_none() {
            self.next = self.recorder.replay();
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
        if comparison.is_improved() {
            let field = field(self);
            self.best = Some(Incumbent {
                evaluation: record.row.evaluation,
                values: record.design,
                objective: record.row.objective,
                violation: violation(&sample),
                sample,
                round: record.row.round,
                field,
            });
        }
    }

    /// Why a run ends whose mesh motion or field fails between two searches: what was reached is saved.
    ///
    /// # Errors
    /// The error itself, where there is no best design or it is another one.
    pub(super) fn salvage(&mut self, error: Error) -> Result<StopReason, Error> {
        let reason = match &error {
            Error::Remesh(_) => StopReason::MeshLimit,
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
        if let Some(record) = self.next.take().or_else(|| self.recorder.replay()) {
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

fn euclidean(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}
