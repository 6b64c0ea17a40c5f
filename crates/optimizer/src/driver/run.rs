//! One evaluation after another: limits, the mesh, objective and constraints, the row of the history, the best design.

use std::time::Instant;

use fluxmorph_geometry::ElementId;
use fluxmorph_remesh::{Moved, RemeshError};

use super::{Best, Optimised, Recorder, Stop};
use crate::algorithm::{CONSTRAINT_TOLERANCE, Sample};
use crate::config::Optimizer;
use crate::constraint::Bound;
use crate::error::Error;
use crate::memory::Memory;
use crate::objective::Goal;
use crate::observer::{Evaluation, Observer, column};
use crate::output::{RunStatus, StopReason};
use crate::problem::{Analysis, Problem, Shape, Timings, Want};
use crate::rounds::RoundEvent;

/// What the first evaluation fixes for the rest of the run.
#[derive(Clone, Debug)]
struct Initial {
    objective: f64,
    quality: f64,
    bounds: Vec<Bound>,
}

/// The state of one optimisation.
pub(super) struct Run<'a> {
    pub(super) problem: &'a mut Problem,
    goal: Goal,
    settings: &'a Optimizer,
    /// What the linear solvers remember of the design before.
    memory: Memory,
    pub(super) observer: &'a mut dyn Observer,
    recorder: &'a mut dyn Recorder,
    interrupted: &'a dyn Fn() -> bool,
    clock: Instant,
    pub(super) evaluations: usize,
    iterations: usize,
    initial: Option<Initial>,
    last: Vec<f64>,
    pub(super) best: Option<Best>,
    /// The best design has another mesh now: the next evaluation takes its place.
    pub(super) best_is_stale: bool,
    worst_residual: f64,
    timings: Timings,
    pub(super) rounds: Vec<RoundEvent>,
    /// Rounds begun at a best design.
    begun: usize,
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
            best: None,
            best_is_stale: false,
            worst_residual: 0.0,
            timings: Timings::default(),
            rounds: Vec::new(),
            begun: 0,
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
        self.problem.approach(&first)
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
        let motion = self.shape().next_round(&best.values, &best.analysis)?;
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
    /// What is known of the best design in this round is not computed again.
    pub(super) fn evaluate(&mut self, p: &[f64]) -> Result<Sample, Stop> {
        let round = self.shape().motion.round();
        if let Some(best) = &self.best
            && best.round == round
            && best.values == p
        {
            return Ok(best.sample.clone());
        }
        self.check_limits()?;
        let clock = Instant::now();
        let moved = self.mesh(p)?;
        let remesh = clock.elapsed().as_secs_f64();
        let mut analysis = self.problem.analyse_with(&mut self.memory, p, moved, Want::Gradient)?;
        analysis.timings.remesh += remesh;
        let value = analysis.objective.expect("an optimisation has an objective");
        let initial = match &self.initial {
            Some(initial) => initial.clone(),
            None => self.initial.insert(self.first(value, &analysis)?).clone(),
        };
        let scale = self.goal.sign() / initial.objective.abs();
        let derivative = analysis.gradient.as_ref().expect("a gradient was asked for");
        let constraints = initial.bounds.iter().zip(&analysis.constraints).map(|(bound, measured)| {
            let gradient = measured.gradient.as_ref().expect("a gradient was asked for");
            (bound.excess(measured.value), bound.gradient(gradient))
        });
        let sample = Sample {
            value: scale * value,
            gradient: derivative.iter().map(|d| scale * d).collect(),
            constraints: constraints.collect(),
        };
        self.keep(p, &initial, &sample, analysis, clock.elapsed().as_secs_f64())?;
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

    /// Scale of the objective and bounds of the constraints, from the initial design.
    fn first(&self, objective: f64, analysis: &Analysis) -> Result<Initial, Error> {
        if objective == 0.0 {
            return Err(Error::Optimisation {
                cause: "the objective of the initial design is zero: there is no field to change, or its terms cancel; \
                        check coils, regions, frequencies and weights",
            });
        }
        let measured = self.problem.constraints.iter().zip(&analysis.constraints);
        let bounds = measured.map(|(constraint, initial)| constraint.bound(initial.value));
        Ok(Initial { objective, quality: analysis.quality.worst, bounds: bounds.collect::<Result<_, _>>()? })
    }

    fn check_limits(&self) -> Result<(), Stop> {
        // Without a first evaluation there would be nothing to keep.
        if self.evaluations > 0 && (self.interrupted)() {
            return Err(Stop::Limit(StopReason::Interrupted));
        }
        if self.evaluations == self.settings.max_evaluations {
            return Err(Stop::Limit(StopReason::MaxEvaluations));
        }
        let over = |limit: f64| self.clock.elapsed().as_secs_f64() >= limit;
        if self.evaluations > 0 && self.settings.max_time.is_some_and(over) {
            return Err(Stop::Limit(StopReason::MaxTime));
        }
        Ok(())
    }

    /// Counts an evaluation, tells observer and recorder, and remembers the best.
    fn keep(
        &mut self,
        p: &[f64],
        initial: &Initial,
        sample: &Sample,
        analysis: Analysis,
        seconds: f64,
    ) -> Result<(), Error> {
        let value = analysis.objective.expect("an optimisation has an objective");
        let violation = violation(sample);
        let stale = std::mem::take(&mut self.best_is_stale);
        let improved = stale
            || self.best.as_ref().is_none_or(|best| {
                let sign = self.goal.sign();
                let order = violation.total_cmp(&best.violation);
                order.then((sign * value).total_cmp(&(sign * best.objective))).is_lt()
            });
        if improved && !stale && self.best.is_some() {
            self.iterations += 1;
        }
        let thickness = self
            .shape()
            .thickness
            .as_ref()
            .map(|thickness| thickness.range(&self.shape().surface.heights(p)));
        let difference: Vec<f64> = p.iter().zip(&self.last).map(|(p, last)| p - last).collect();
        let excess = self.problem.constraints.iter().zip(&sample.constraints);
        let row = Evaluation {
            evaluation: self.evaluations,
            iteration: self.iterations,
            objective: value,
            ratio: value / initial.objective,
            gradient_norm: euclidean(analysis.gradient.as_deref().unwrap_or_default()),
            step_norm: euclidean(&difference),
            worst_quality: analysis.quality.worst,
            min_thickness_m: thickness.map(|t| t.0),
            max_thickness_m: thickness.map(|t| t.1),
            linear_iterations: analysis.linear_iterations,
            seconds,
            step_to_inversion: analysis.inversion.element.map(|_| analysis.inversion.step),
            inversion_element: analysis.inversion.element.map(ElementId::index),
            inversion_region: analysis
                .inversion
                .element
                .map(|e| analysis.mesh.topology().region_name_at(e).to_owned()),
            round: self.shape().motion.round(),
            constraints: excess.map(|(constraint, (c, _))| (column(&constraint.name), *c)).collect(),
        };
        self.evaluations += 1;
        self.last = p.to_vec();
        self.worst_residual = self.worst_residual.max(analysis.worst_residual);
        self.timings += analysis.timings;
        for event in &analysis.solver_events {
            self.observer.notice(&event.to_string());
        }
        self.recorder.record(&row, &analysis, self.problem, improved)?;
        self.observer.evaluation(&row);
        if improved {
            let (evaluation, values) = (row.evaluation, p.to_vec());
            let (sample, round) = (sample.clone(), row.round);
            self.best =
                Some(Best { evaluation, values, objective: value, violation, analysis, sample, round });
        }
        Ok(())
    }

    pub(super) fn finish(self, stop_reason: StopReason) -> Result<Optimised, Error> {
        let (Some(best), Some(initial)) = (self.best, self.initial) else {
            return Err(Error::Optimisation { cause: "it ended before the first evaluation" });
        };
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
