//! One evaluation after another: limits, the mesh, objective and constraints, the row of the history, the best design.

mod replay;

use std::collections::BTreeMap;
use std::time::Instant;

use fluxmorph_geometry::ElementId;
use fluxmorph_remesh::{Moved, RemeshError};

use super::{Optimised, Record, Recorder, Stop, reference_hash};
use crate::algorithm::{CONSTRAINT_TOLERANCE, Sample};
use crate::config::Optimizer;
use crate::constraint::Bound;
use crate::error::Error;
use crate::memory::Memory;
use crate::objective::Goal;
use crate::observer::{Evaluation, Observer, column};
use crate::output::{RunStatus, StopReason};
use crate::problem::{Analysis, Measured, Problem, Shape, Timings, Want};
use crate::rounds::RoundEvent;
use crate::stage::Stage;
use replay::Setting;

/// What the first evaluation fixes for the rest of the run.
#[derive(Clone, Debug)]
struct Initial {
    objective: f64,
    quality: f64,
    bounds: Vec<Bound>,
}

/// How a design stands beside the best before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Standing {
    First,
    Better,
    /// In the place of the best one, whose mesh has changed.
    Renewed,
    Worse,
}

impl Standing {
    fn is_improved(self) -> bool {
        self != Self::Worse
    }
}

/// What is known of the field of the best design.
#[derive(Debug)]
enum Field {
    Computed(Box<Analysis>),
    /// It was computed before the run was broken off.
    Replayed(Box<Setting>),
}

/// The best design so far.
#[derive(Debug)]
pub(super) struct BestSoFar {
    pub(super) evaluation: usize,
    values: Vec<f64>,
    pub(super) objective: f64,
    pub(super) violation: f64,
    /// What the method was told of it.
    sample: Sample,
    /// The round it was evaluated in: there, and only there, the gradient is that of the mesh motion.
    round: usize,
    field: Field,
}

/// The state of one optimisation.
pub(super) struct Run<'a> {
    pub(super) problem: &'a mut Problem,
    goal: Goal,
    settings: &'a Optimizer,
    /// What the linear solvers remember of the designs before: which methods work.
    memory: Memory,
    pub(super) observer: &'a mut dyn Observer,
    recorder: &'a mut dyn Recorder,
    interrupted: &'a dyn Fn() -> bool,
    clock: Instant,
    pub(super) evaluations: usize,
    iterations: usize,
    initial: Option<Initial>,
    last: Vec<f64>,
    /// The record that the next design should be answered with.
    next: Option<Record>,
    pub(super) best: Option<BestSoFar>,
    /// The best design has another mesh now: the next evaluation takes its place.
    pub(super) best_is_stale: bool,
    worst_residual: f64,
    timings: Timings,
    pub(super) rounds: Vec<RoundEvent>,
    /// Rounds begun at a best design.
    begun: usize,
    /// Whether ranks have a share in what is computed, or had one in what is replayed.
    is_shared_out: bool,
}

impl<'a> Run<'a> {
    pub(super) fn new(
        problem: &'a mut Problem,
        settings: &'a Optimizer,
        observer: &'a mut dyn Observer,
        recorder: &'a mut dyn Recorder,
        interrupted: &'a dyn Fn() -> bool,
    ) -> Self {
        let goal = problem.objective.as_ref().expect("an optimisation has an objective").goal;
        let is_shared_out = problem.share.is_some() || !recorder.is_bitwise_reproducible();
        let last = problem.shape.as_ref().expect("an optimisation has a shape").initial.clone();
        Self {
            problem,
            goal,
            settings,
            memory: Memory::default(),
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
        self.problem.shape.as_ref().expect("an optimisation has a shape")
    }

    pub(super) fn shape_mut(&mut self) -> &mut Shape {
        self.problem.shape.as_mut().expect("an optimisation has a shape")
    }

    /// Takes the mesh near the first design.
    pub(super) fn approach(&mut self) -> Result<Vec<RoundEvent>, Error> {
        let first = self.shape().initial.clone();
        self.problem.approach(&first, self.interrupted)
    }

    /// Whether another round may begin.
    pub(super) fn has_rounds_left(&self) -> bool {
        self.begun < self.shape().limits.rounds
    }

    /// Makes the mesh of the best design the reference, and counts the round.
    pub(super) fn begin_round(&mut self) -> Result<(), RemeshError> {
        self.begun += 1;
        self.stand_at_best()
    }

    /// Makes the mesh of the best design the reference.
    pub(super) fn stand_at_best(&mut self) -> Result<(), RemeshError> {
        let Some(best) = self.best.as_ref().filter(|_| !self.best_is_stale) else { return Ok(()) };
        let shape = self.shape();
        let motion = match &best.field {
            Field::Computed(analysis) => {
                let Analysis { mesh, displacement, .. } = &**analysis;
                shape.next_round(&best.values, mesh.clone(), displacement.clone())?
            }
            Field::Replayed(setting) => {
                let moved = setting.motion.moved(&shape.displacement(&best.values))?;
                shape.next_round(&best.values, moved.mesh, moved.displacement)?
            }
        };
        self.shape_mut().motion = motion;
        Ok(())
    }

    /// Keeps what happened to the mesh, and tells it.
    pub(super) fn tell(&mut self, event: RoundEvent) {
        self.observer.round(&event);
        self.rounds.push(event);
    }

    /// Where the next search starts: the best design so far.
    pub(super) fn centre(&self) -> Vec<f64> {
        self.best.as_ref().map_or_else(|| self.shape().initial.clone(), |best| best.values.clone())
    }

    /// ±F/|F0| and the constraints of a design, with their gradients.
    ///
    /// What is known of the best design in this round is not computed again, nor what was computed before the run was
    /// broken off.
    pub(super) fn evaluate(&mut self, p: &[f64]) -> Result<Sample, Stop> {
        let round = self.shape().motion.round();
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
        let Self { problem, memory, observer, .. } = self;
        let told = &mut |stage| observer.stage(stage);
        let mut analysis = problem.analyse_watched(memory, p, moved, Want::Gradient, told)?;
        analysis.timings.remesh += remesh;
        let values: Vec<f64> = analysis.constraints.iter().map(|measured| measured.value).collect();
        let objective = analysis.objective.expect("an optimisation has an objective");
        let initial = self.initial(objective, analysis.quality.worst, &values)?;
        let mut record = self.record(p, &initial, &analysis);
        let sample = self.sample(&initial, &record);
        // Before anything of it is kept.
        sample.check(p.len(), self.problem.constraints.len())?;
        let standing = self.standing(objective, &sample);
        record.improved = standing.is_improved();
        record.row.iteration = self.iterations_after(standing);
        let names = self.problem.constraints.iter().map(|constraint| column(&constraint.name));
        record.row.constraints = names.zip(sample.constraints.iter().map(|(c, _)| *c)).collect();
        record.row.seconds = clock.elapsed().as_secs_f64();
        for event in &analysis.solver_events {
            self.observer.notice(&event.to_string());
        }
        self.observer.stage(Stage::Writing);
        self.recorder.record(&record, &analysis, self.problem)?;
        self.observer.evaluation(&record.row);
        self.keep(record, sample.clone(), standing, |_| Field::Computed(Box::new(analysis)));
        Ok(sample)
    }

    /// The mesh of a design, unless it goes beyond what the round's reference can carry.
    fn mesh(&self, p: &[f64]) -> Result<Moved, Stop> {
        let refused = |cause: String| Stop::Mesh { cause, wanted: p.to_vec() };
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
                "a design would go {:.0} % of the way to inverting element {element}, beyond remesh.inversion_share = {}",
                100.0 * share,
                limits.inversion_share
            )));
        }
        if limits.least_quality > 0.0 {
            let quality = self.problem.quality(&moved.mesh);
            if quality.worst < limits.least_quality {
                return Err(refused(format!(
                    "element {} would have the quality {:.4e}, below the least of {:.4e} (optimizer.minimum_quality)",
                    quality.worst_element, quality.worst, limits.least_quality
                )));
            }
        }
        Ok(moved)
    }

    /// Scale of the objective and bounds of the constraints, which the first design fixes.
    fn initial(&mut self, objective: f64, quality: f64, measured: &[f64]) -> Result<Initial, Error> {
        if let Some(initial) = &self.initial {
            return Ok(initial.clone());
        }
        if objective == 0.0 {
            return Err(Error::Optimisation {
                cause: "the objective of the initial design is zero: there is no field to change, or its terms cancel; \
                        check coils, regions, frequencies and weights",
            });
        }
        let constraints = self.problem.constraints.iter().zip(measured);
        let bounds = constraints.map(|(constraint, &value)| constraint.bound(value));
        let initial = Initial { objective, quality, bounds: bounds.collect::<Result<_, _>>()? };
        Ok(self.initial.insert(initial).clone())
    }

    /// What the method is told of a design.
    fn sample(&self, initial: &Initial, record: &Record) -> Sample {
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

    /// How a design stands beside the best so far.
    fn standing(&self, objective: f64, sample: &Sample) -> Standing {
        let Some(best) = &self.best else { return Standing::First };
        let sign = self.goal.sign();
        let order = violation(sample).total_cmp(&best.violation);
        match order.then((sign * objective).total_cmp(&(sign * best.objective))) {
            _ if self.best_is_stale => Standing::Renewed,
            std::cmp::Ordering::Less => Standing::Better,
            _ => Standing::Worse,
        }
    }

    fn iterations_after(&self, standing: Standing) -> usize {
        self.iterations + usize::from(standing == Standing::Better)
    }

    /// The record of a design but for its standing.
    fn record(&self, p: &[f64], initial: &Initial, analysis: &Analysis) -> Record {
        let shape = self.shape();
        let thickness = shape.thickness.as_ref().map(|thickness| thickness.range(&shape.surface.heights(p)));
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
            round: shape.motion.round(),
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
            reference: reference_hash(shape.motion.reference()),
            methods: self.memory.methods(),
            worst_residual: analysis.worst_residual,
            timings: analysis.timings,
        }
    }

    /// A signal or the time, where they end the run now.
    pub(super) fn told_to_end(&mut self) -> Option<StopReason> {
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
        let reason = match self.told_to_end() {
            Some(StopReason::Interrupted) => Some(StopReason::Interrupted),
            _ if self.evaluations >= self.settings.max_evaluations => Some(StopReason::MaxEvaluations),
            reason => reason,
        };
        reason.map_or(Ok(()), |reason| Err(Stop::Limit(reason)))
    }

    /// Counts an evaluation, and remembers the best with its `field`, which is asked for only then.
    fn keep(
        &mut self,
        record: Record,
        sample: Sample,
        standing: Standing,
        field: impl FnOnce(&Self) -> Field,
    ) {
        self.iterations = self.iterations_after(standing);
        self.evaluations += 1;
        self.worst_residual = self.worst_residual.max(record.worst_residual);
        self.timings += record.timings;
        self.best_is_stale = false;
        self.last.clone_from(&record.design);
        if standing.is_improved() {
            let field = field(self);
            self.best = Some(BestSoFar {
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
        let best = self.analysed(best)?;
        if best.violation > 0.0 {
            self.observer.warning(&format!(
                "no design keeps all constraints: the best one is beyond a bound by {:.1e} of it; loosen the constraint, \
                 widen the design's bounds, or allow more evaluations",
                best.violation
            ));
        }
        let stop_reason = match stop_reason.status() {
            RunStatus::Converged if best.violation > 0.0 => StopReason::Infeasible,
            _ => stop_reason,
        };
        Ok(Optimised {
            stop_reason,
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

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Error(Box::new(error))
    }
}

/// Largest excess of a constraint; zero where all are kept but for rounding.
fn violation(sample: &Sample) -> f64 {
    let worst = sample.constraints.iter().map(|(c, _)| *c).fold(0.0, f64::max);
    if worst <= CONSTRAINT_TOLERANCE { 0.0 } else { worst }
}

fn euclidean(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}
