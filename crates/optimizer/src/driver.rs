//! The optimisation loop: NLopt asks, the problem answers, observer and recorder are told.
//!
//! * An *evaluation* is one computation of objective, constraints and gradients; an *iteration* is an evaluation that
//!   improves on the best so far (the first counts as none). Of two designs that keep all constraints the one with the
//!   better objective is better; otherwise the one that violates them less.
//! * The method sees `±F/|F0|`, which it makes small; everything told or kept is `F` itself.
//! * **A mesh that would break is never shown to the method** as NaN, infinity or a penalty: the method is stopped and
//!   started afresh at the best design, in a box shrunk by [`SHRINK`] towards it. After [`MAX_RESTARTS`] such restarts
//!   the run ends with [`StopReason::MeshLimit`] and the best design.
//!   Such an attempt has no objective: it is no evaluation and leaves no row in the history, but a warning.
//! * Limits of evaluations and time are checked before each evaluation but the first, and a signal too: what was
//!   computed is kept, and there always is a best design.

use std::time::Instant;

use fluxmorph_geometry::Mesh;
use fluxmorph_remesh::RemeshError;

use crate::algorithm::{self, CONSTRAINT_TOLERANCE, Ending, Minimisation, Sample};
use crate::cli::ExitCode;
use crate::config::Optimizer;
use crate::constraint::Bound;
use crate::error::Error;
use crate::objective::Goal;
use crate::observer::{Evaluation, Observer, column};
use crate::output::{RunStatus, StopReason};
use crate::problem::{Analysis, Problem, Shape, Timings, Want};

/// Share of the distance to the best design that the bounds keep after a broken mesh.
pub const SHRINK: f64 = 0.5;

/// Restarts in a smaller box before the run ends at the mesh's limit.
pub const MAX_RESTARTS: usize = 5;

/// Factor on `ftol_rel` after a restart, and where a method ends after its first steps: it begins with a cautious step,
/// whose small gain is no convergence.
const RESTART_TOLERANCE: f64 = 0.1;

/// Evaluations within which a method has done no more than its cautious first step.
const CAUTIOUS: usize = 3;

/// How often an end after the cautious first step is not believed.
const MAX_RENEWALS: usize = 3;

/// Keeps what is computed.
pub trait Recorder {
    /// An evaluation is complete; `improved` where it is the best so far.
    ///
    /// # Errors
    /// When it cannot be kept: the run ends.
    fn record(
        &mut self,
        row: &Evaluation,
        analysis: &Analysis,
        problem: &Problem,
        improved: bool,
    ) -> Result<(), Error>;
}

/// Keeps nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unrecorded;

impl Recorder for Unrecorded {
    fn record(&mut self, _: &Evaluation, _: &Analysis, _: &Problem, _: bool) -> Result<(), Error> {
        Ok(())
    }
}

/// The best design of a run.
#[derive(Debug)]
pub struct Best {
    /// Its evaluation.
    pub evaluation: usize,
    /// Its variables [m].
    pub values: Vec<f64>,
    /// Its objective.
    pub objective: f64,
    /// Largest excess of a constraint over its bound, relative to it; zero where all are kept.
    pub violation: f64,
    /// Its field.
    pub analysis: Analysis,
}

/// How an optimisation went.
#[derive(Debug)]
pub struct Optimised {
    /// Why it ended.
    pub stop_reason: StopReason,
    /// Evaluations done.
    pub evaluations: usize,
    /// Evaluations that improved on the best before them.
    pub iterations: usize,
    /// The objective at the start.
    pub initial: f64,
    /// Bounds of the constraints, in their order.
    pub bounds: Vec<Bound>,
    /// The best design.
    pub best: Best,
    /// Worst quality of the initial mesh.
    pub initial_quality: f64,
    /// Largest relative residual of all linear solves.
    pub worst_residual: f64,
    /// Where the time went, all evaluations together.
    pub timings: Timings,
}

/// What ends the method from inside an evaluation.
#[derive(Debug)]
enum Stop {
    Limit(StopReason),
    BrokenMesh(String),
    Error(Box<Error>),
}

/// Runs the optimisation of a problem with a shape and an objective.
///
/// `interrupted` is asked before each evaluation but the first.
///
/// # Errors
/// [`Error`] of an evaluation that fails for another reason than its mesh, unless there is a best design to save: then
/// the run ends with [`StopReason::NumericalFailure`]. What the recorder kept is whole.
///
/// # Panics
/// If the problem has no shape or no objective.
pub fn optimise(
    problem: &Problem,
    settings: &Optimizer,
    observer: &mut dyn Observer,
    recorder: &mut dyn Recorder,
    interrupted: &dyn Fn() -> bool,
) -> Result<Optimised, Error> {
    let shape = problem.shape.as_ref().expect("an optimisation has a shape");
    let goal = problem.objective.as_ref().expect("an optimisation has an objective").goal;
    let mut run = Run {
        problem,
        shape,
        goal,
        settings,
        observer,
        recorder,
        interrupted,
        clock: Instant::now(),
        round: 0,
        evaluations: 0,
        iterations: 0,
        initial: None,
        last: shape.initial.clone(),
        best: None,
        worst_residual: 0.0,
        timings: Timings::default(),
    };
    let mut minimisation = Minimisation {
        algorithm: settings.algorithm,
        lower: shape.lower.clone(),
        upper: shape.upper.clone(),
        constraints: problem.constraints.len(),
        ftol_rel: settings.ftol_rel,
        xtol_rel: settings.xtol_rel,
    };
    let mut renewals = 0;
    let stop_reason = loop {
        let before = run.evaluations;
        let start = run.best.as_ref().map_or_else(|| shape.initial.clone(), |best| best.values.clone());
        let outcome = algorithm::minimise(&minimisation, &start, |p| run.evaluate(p));
        match outcome {
            algorithm::Outcome::Ended(Ending::Objective)
                if run.evaluations - before <= CAUTIOUS
                    && minimisation.ftol_rel > 0.0
                    && renewals < MAX_RENEWALS =>
            {
                renewals += 1;
                minimisation.ftol_rel *= RESTART_TOLERANCE;
                run.observer.warning(&format!(
                    "the method's first step changed the objective by less than optimizer.ftol_rel: it goes on with {:.0e}",
                    minimisation.ftol_rel
                ));
            }
            algorithm::Outcome::Ended(Ending::Objective) => break StopReason::ObjectiveConverged,
            algorithm::Outcome::Ended(Ending::Step) => break StopReason::StepConverged,
            algorithm::Outcome::Failed(cause) if run.best.is_some() => {
                run.observer.warning(cause);
                break StopReason::MethodStalled;
            }
            algorithm::Outcome::Failed(cause) => return Err(Error::Optimisation { cause }),
            algorithm::Outcome::Interrupted(Stop::Limit(reason)) => break reason,
            algorithm::Outcome::Interrupted(Stop::Error(error))
                if run.best.is_some() && error.exit_code() == ExitCode::Numerical =>
            {
                run.observer.warning(&error.to_string());
                break StopReason::NumericalFailure;
            }
            algorithm::Outcome::Interrupted(Stop::Error(error)) => return Err(*error),
            algorithm::Outcome::Interrupted(Stop::BrokenMesh(cause)) => {
                let Some(best) = &run.best else {
                    // The initial design itself has no valid mesh: nothing to go back to.
                    return Err(problem.mesh_of(&shape.initial).err().map_or(
                        Error::Optimisation { cause: "the initial mesh is below optimizer.minimum_quality" },
                        Error::from,
                    ));
                };
                if run.round == MAX_RESTARTS {
                    run.observer.warning(&format!("{cause}; stopped after {MAX_RESTARTS} restarts"));
                    break StopReason::MeshLimit;
                }
                run.round += 1;
                minimisation.ftol_rel = RESTART_TOLERANCE * settings.ftol_rel;
                for (k, best) in best.values.iter().enumerate() {
                    minimisation.lower[k] = best + SHRINK * (minimisation.lower[k] - best);
                    minimisation.upper[k] = best + SHRINK * (minimisation.upper[k] - best);
                }
                run.observer.warning(&format!(
                    "{cause}; restart {} of {MAX_RESTARTS} from evaluation {} with bounds half as far",
                    run.round, best.evaluation
                ));
            }
        }
    };
    run.finish(stop_reason)
}

/// What the first evaluation fixes for the rest of the run.
#[derive(Clone, Debug)]
struct Initial {
    objective: f64,
    quality: f64,
    bounds: Vec<Bound>,
}

/// The state of one optimisation.
struct Run<'a> {
    problem: &'a Problem,
    shape: &'a Shape,
    goal: Goal,
    settings: &'a Optimizer,
    observer: &'a mut dyn Observer,
    recorder: &'a mut dyn Recorder,
    interrupted: &'a dyn Fn() -> bool,
    clock: Instant,
    round: usize,
    evaluations: usize,
    iterations: usize,
    initial: Option<Initial>,
    last: Vec<f64>,
    best: Option<Best>,
    worst_residual: f64,
    timings: Timings,
}

impl Run<'_> {
    /// ±F/|F0| and the constraints of a design, with their gradients.
    fn evaluate(&mut self, p: &[f64]) -> Result<Sample, Stop> {
        self.check_limits()?;
        let clock = Instant::now();
        let (mesh, displacement) = self.problem.mesh_of(p).map_err(|error| match error {
            RemeshError::Inverted { .. } => Stop::BrokenMesh(error.to_string()),
            other => Stop::Error(Box::new(other.into())),
        })?;
        self.check_quality(&mesh)?;
        let remesh = clock.elapsed().as_secs_f64();
        let mut analysis = self.problem.analyse(p, mesh, displacement, Want::Gradient)?;
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

    /// Refuses a mesh below the quality asked for; without such a limit there is nothing to compute.
    fn check_quality(&self, mesh: &Mesh) -> Result<(), Stop> {
        let minimum = self.settings.minimum_quality;
        if minimum <= 0.0 {
            return Ok(());
        }
        let quality = self.problem.quality(mesh);
        if quality.worst >= minimum {
            return Ok(());
        }
        Err(Stop::BrokenMesh(format!(
            "element {} would have the quality {:.4}, below optimizer.minimum_quality = {minimum}",
            quality.worst_element, quality.worst
        )))
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
        let improved = self.best.as_ref().is_none_or(|best| {
            let sign = self.goal.sign();
            let order = violation.total_cmp(&best.violation);
            order.then((sign * value).total_cmp(&(sign * best.objective))).is_lt()
        });
        if improved && self.best.is_some() {
            self.iterations += 1;
        }
        let thickness =
            self.shape.thickness.as_ref().map(|thickness| thickness.range(&self.shape.surface.heights(p)));
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
            round: self.round,
            constraints: excess.map(|(constraint, (c, _))| (column(&constraint.name), *c)).collect(),
        };
        self.evaluations += 1;
        self.last = p.to_vec();
        self.worst_residual = self.worst_residual.max(analysis.worst_residual);
        self.timings += analysis.timings;
        self.recorder.record(&row, &analysis, self.problem, improved)?;
        self.observer.evaluation(&row);
        if improved {
            let (evaluation, values) = (row.evaluation, p.to_vec());
            self.best = Some(Best { evaluation, values, objective: value, violation, analysis });
        }
        Ok(())
    }

    fn finish(self, stop_reason: StopReason) -> Result<Optimised, Error> {
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
