//! The optimisation loop: NLopt asks, the problem answers, observer and recorder are told.
//!
//! * An *evaluation* is one computation of objective, constraints and gradients; an *iteration* is an evaluation that
//!   improves on the best so far (the first counts as none). Of two designs that keep all constraints the one with the
//!   better objective is better; otherwise the one that violates them less.
//! * The method sees `±F/|F0|`, which it makes small; everything told or kept is `F` itself.
//! * Within a *round* the elastic map is frozen on the round's reference mesh. The method searches in a box around the
//!   round's first design that the mesh can be trusted in (`trust`). A design that goes too near to an inversion, or below
//!   the least quality, is never shown to the method as NaN, infinity or a penalty: the method is stopped. It has no
//!   objective: it is no evaluation and leaves no row in the history. The same ends a round as the edge of the box does:
//!   where something was gained, the best mesh becomes the reference of the next round, and the method starts afresh from
//!   the best design, towards the same bounds.
//! * Where nothing was gained the ladder of [`rescue`](fluxmorph_remesh::rescue) is climbed: a smaller box, another
//!   stiffness policy, smoothing of the interior. Then the run ends with [`StopReason::MeshLimit`] and the best design.
//! * An interrupted run is resumed by a replay: the recorder gives its evaluations back, and as long as the method asks for
//!   the same designs to the last bit, in the same rounds on the same meshes, they are the answers. The method is then in
//!   the state that it was in. Anything else is an error.
//! * Limits of evaluations and time are checked before each evaluation but the first, and before each remedy: what was
//!   computed is kept, and there is a best design. A signal may come before the first evaluation, or during a
//!   replay: then there is nothing new to keep.

mod record;
mod run;
mod trust;

use fluxmorph_remesh::Rung;

use crate::algorithm::{self, Ending, Minimisation, Outcome};
use crate::cli::ExitCode;
use crate::config::Optimizer;
use crate::constraint::Bound;
use crate::error::Error;
use crate::observer::Observer;
use crate::output::StopReason;
use crate::problem::{Analysis, Problem, Timings};
use crate::rounds::{RoundEvent, RoundKind};
pub use record::{Record, reference_hash};
use run::Run;
use trust::TrustRegion;

/// How much of the box is left after a design in it was refused and nothing was gained.
const SHRINK: f64 = 0.5;

/// How often the box may shrink before other remedies are tried: to an eighth.
const MAX_SHRINKS: usize = 3;

/// Relative gain below which a search has gained nothing, where `ftol_rel` is finer.
const LEAST_GAIN: f64 = 1e-6;

/// Factor on `ftol_rel` after the first search, and where a method ends after its first steps: it begins with a cautious
/// step, whose small gain is no convergence.
const RESTART_TOLERANCE: f64 = 0.1;

/// Evaluations within which a method has done no more than its cautious first step.
const CAUTIOUS: usize = 3;

/// How often an end after the cautious first step is not believed.
const MAX_RENEWALS: usize = 3;

/// Keeps what is computed, and gives back what was kept before the run was broken off.
pub trait Recorder {
    /// The next evaluation kept before, in their order; `None` behind the last one.
    fn replay(&mut self) -> Option<Record> {
        None
    }

    /// Whether the same design gives the bits of what is replayed: not so where several ranks had a share in it.
    fn is_bitwise_reproducible(&self) -> bool {
        true
    }

    /// An evaluation is complete.
    ///
    /// # Errors
    /// When it cannot be kept: the run ends.
    fn record(&mut self, record: &Record, analysis: &Analysis, problem: &Problem) -> Result<(), Error>;
}

/// Keeps nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unrecorded;

impl Recorder for Unrecorded {
    fn record(&mut self, _: &Record, _: &Analysis, _: &Problem) -> Result<(), Error> {
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
    /// What happened to the mesh between evaluations.
    pub rounds: Vec<RoundEvent>,
}

/// What ends the method from inside an evaluation.
#[derive(Debug)]
enum Stop {
    Limit(StopReason),
    /// The round's mesh cannot carry a design.
    Mesh {
        cause: String,
        wanted: Vec<f64>,
    },
    Error(Box<Error>),
}

/// Runs the optimisation of a problem with a shape and an objective; it leaves the problem in its last round.
///
/// `interrupted` is asked before each evaluation and each remedy.
///
/// # Errors
/// [`Error`] of an evaluation that fails for another reason than its mesh, unless there is a best design to save: then
/// the run ends with [`StopReason::NumericalFailure`]; [`Error::InterruptedRun`] where a signal leaves no best design. What
/// the recorder kept is whole.
///
/// # Panics
/// If the problem has no shape or no objective.
pub fn optimise(
    problem: &mut Problem,
    settings: &Optimizer,
    observer: &mut dyn Observer,
    recorder: &mut dyn Recorder,
    interrupted: &dyn Fn() -> bool,
) -> Result<Optimised, Error> {
    let mut run = Run::new(problem, settings, observer, recorder, interrupted);
    match run.approach() {
        Ok(events) => events.into_iter().for_each(|event| run.tell(event)),
        Err(Error::Interrupted) => return Err(Error::InterruptedRun),
        Err(error) => return Err(error),
    }
    let mut search = Search {
        trust: TrustRegion::new(run.shape(), &run.centre(), 1.0)?,
        ftol_rel: settings.ftol_rel,
        shrinks: 0,
        rung: Rung::Ground,
        renewals: 0,
        refused: None,
    };
    let reason = loop {
        match search.once(&mut run, settings) {
            Ok(None) => {}
            Ok(Some(reason)) => break reason,
            // Between evaluations only the mesh motion can fail: what was reached is saved.
            Err(error @ Error::Remesh(_)) if run.best.is_some() => {
                run.observer.warning(&error.to_string());
                break StopReason::MeshLimit;
            }
            Err(error) if run.best.is_some() && error.exit_code() == ExitCode::Numerical => {
                run.observer.warning(&error.to_string());
                break StopReason::NumericalFailure;
            }
            Err(error) => return Err(error),
        }
    };
    run.finish(reason)
}

/// Where the search for the best design stands between two starts of the method.
struct Search {
    trust: TrustRegion,
    ftol_rel: f64,
    /// How often the box shrank since the last gain.
    shrinks: usize,
    /// How far up the ladder since the last gain.
    rung: Rung,
    renewals: usize,
    /// The design refused last, and why.
    refused: Option<(String, Vec<f64>)>,
}

impl Search {
    /// Runs the method once in the box, and decides what follows; a reason where nothing does.
    fn once(&mut self, run: &mut Run<'_>, settings: &Optimizer) -> Result<Option<StopReason>, Error> {
        let [lower, upper] = self.trust.bounds(run.shape());
        let minimisation = Minimisation {
            algorithm: settings.algorithm,
            lower,
            upper,
            constraints: run.problem.constraints.len(),
            ftol_rel: self.ftol_rel,
            xtol_rel: settings.xtol_rel,
        };
        let evaluations = run.evaluations;
        let before =
            run.best.as_ref().filter(|_| !run.best_is_stale).map(|best| (best.violation, best.objective));
        let outcome = algorithm::minimise(&minimisation, &run.centre(), |p| run.evaluate(p));
        let gain = LEAST_GAIN.max(settings.ftol_rel);
        let gained = run.best.as_ref().is_some_and(|best| match before {
            None => best.evaluation > evaluations,
            Some((violation, objective)) => {
                best.violation < (1.0 - gain) * violation
                    || (best.objective - objective).abs() > gain * objective.abs()
            }
        });
        match outcome {
            Outcome::Ended(ending) => {
                let cautious = ending == Ending::Objective && run.evaluations - evaluations <= CAUTIOUS;
                if cautious && self.ftol_rel > 0.0 && self.renewals < MAX_RENEWALS {
                    self.renew(run);
                    return Ok(None);
                }
                let held_back = self.trust.holds_back(run.shape(), &run.centre());
                if gained && held_back {
                    if run.has_rounds_left() {
                        self.next_round(run, settings, "the search reached the edge of its box")?;
                    } else {
                        self.trust = TrustRegion::new(run.shape(), &run.centre(), self.trust.scale)?;
                    }
                    return Ok(None);
                }
                if held_back
                    && self.trust.scale < 1.0
                    && let Some((cause, wanted)) = self.refused.clone()
                {
                    return self.climb(run, settings, gained, &cause, &wanted);
                }
                Ok(Some(match ending {
                    Ending::Objective => StopReason::ObjectiveConverged,
                    Ending::Step => StopReason::StepConverged,
                }))
            }
            Outcome::Failed(cause) if run.best.is_some() => {
                run.observer.warning(cause);
                Ok(Some(StopReason::MethodStalled))
            }
            Outcome::Failed(cause) => Err(Error::Optimisation { cause }),
            Outcome::Interrupted(Stop::Limit(reason)) => Ok(Some(reason)),
            Outcome::Interrupted(Stop::Error(error))
                if run.best.is_some() && error.exit_code() == ExitCode::Numerical =>
            {
                run.observer.warning(&error.to_string());
                Ok(Some(StopReason::NumericalFailure))
            }
            Outcome::Interrupted(Stop::Error(error)) => Err(*error),
            Outcome::Interrupted(Stop::Mesh { cause, wanted }) => {
                if run.best.is_none() {
                    // There is nothing to go back to.
                    return Err(Error::FirstDesign { cause });
                }
                self.ftol_rel = RESTART_TOLERANCE * settings.ftol_rel;
                self.refused = Some((cause.clone(), wanted.clone()));
                if gained && run.has_rounds_left() {
                    self.next_round(run, settings, &cause)?;
                    return Ok(None);
                }
                self.climb(run, settings, gained, &cause, &wanted)
            }
        }
    }

    /// Goes on with a tighter tolerance after a cautious first step.
    fn renew(&mut self, run: &mut Run<'_>) {
        self.renewals += 1;
        self.ftol_rel *= RESTART_TOLERANCE;
        run.observer.warning(&format!(
            "the method's first step changed the objective by less than optimizer.ftol_rel: it goes on with {:.0e}",
            self.ftol_rel
        ));
    }

    /// The best mesh becomes the reference, and the box is laid around the best design.
    fn next_round(&mut self, run: &mut Run<'_>, settings: &Optimizer, cause: &str) -> Result<(), Error> {
        run.begin_round()?;
        // What a box shrank to is doubled with every gain.
        let scale = (self.trust.scale / SHRINK).min(1.0);
        self.trust = TrustRegion::new(run.shape(), &run.centre(), scale)?;
        (self.shrinks, self.rung, self.renewals) = (0, Rung::Ground, 0);
        self.ftol_rel = RESTART_TOLERANCE * settings.ftol_rel;
        let event = self.event(run, cause);
        run.tell(event);
        Ok(())
    }

    /// The next remedy where a round cannot move on.
    fn climb(
        &mut self,
        run: &mut Run<'_>,
        settings: &Optimizer,
        gained: bool,
        cause: &str,
        wanted: &[f64],
    ) -> Result<Option<StopReason>, Error> {
        if let Some(reason) = run.told_to_end() {
            return Ok(Some(reason));
        }
        if gained {
            // Without rounds the reference stays, and so does what the mesh can carry: search nearer to the best.
            (self.shrinks, self.rung) = (0, Rung::Ground);
        }
        if self.shrinks < MAX_SHRINKS {
            self.shrinks += 1;
            let scale = SHRINK * self.trust.scale;
            self.trust = TrustRegion::new(run.shape(), &run.centre(), scale)?;
            let shape = run.shape();
            let step = shape.motion.step(&shape.displacement(wanted))?;
            let admitted = shape.motion.admitted(&step, &shape.limits);
            let event = self.event(run, cause);
            run.tell(RoundEvent { kind: RoundKind::SmallerSteps, admitted: Some([admitted; 2]), ..event });
            return Ok(None);
        }
        let remedy = if run.has_rounds_left() {
            // The remedies are for the mesh of the best design.
            run.stand_at_best()?;
            let shape = run.shape();
            shape.motion.rescued(&shape.displacement(wanted), self.rung, &shape.limits)?
        } else {
            None
        };
        let Some((motion, rescued, rung)) = remedy else {
            let exhausted = match run.shape().limits.rounds {
                0 => "and remesh.rounds = 0 allows no other reference".to_owned(),
                rounds if !run.has_rounds_left() => format!("and all of remesh.rounds = {rounds} are used"),
                _ => "and no remedy is left".to_owned(),
            };
            run.observer.warning(&format!("{cause}, {exhausted}: the mesh carries the design no further"));
            return Ok(Some(StopReason::MeshLimit));
        };
        run.best_is_stale = rescued.rescue.changes_mesh();
        run.shape_mut().motion = motion;
        self.rung = rung;
        (self.shrinks, self.renewals) = (0, 0);
        self.ftol_rel = RESTART_TOLERANCE * settings.ftol_rel;
        self.trust = TrustRegion::new(run.shape(), &run.centre(), 1.0)?;
        let event = self.event(run, cause).with(&rescued);
        run.tell(event);
        Ok(None)
    }

    /// A round that begins now at the best design.
    fn event(&self, run: &Run<'_>, cause: &str) -> RoundEvent {
        let motion = &run.shape().motion;
        let quality = run.problem.quality(motion.reference()).worst;
        RoundEvent {
            round: motion.round(),
            kind: RoundKind::Round,
            evaluation: run.best.as_ref().map(|best| best.evaluation),
            worst_quality: [quality; 2],
            admitted: None,
            stiffness: motion.policy().name().to_owned(),
            reach: self.trust.reach(),
            cause: cause.to_owned(),
        }
    }
}
