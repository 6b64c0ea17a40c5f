//! The optimisation loop: NLopt asks, the problem answers, observer and recorder are informed.
//!
//! * An *evaluation* is one computation of objective, constraints and gradients; an *iteration* is an evaluation that
//!   improves on the best so far (the first counts as none). Of two designs that keep all constraints the one with the
//!   better objective is better; otherwise the one that violates them less.
//! * The method sees `±F/|F0|`, which it makes small; everything shown or kept is `F` itself.
//! * Every design has one mesh, so that `F(p)` is one function. Where the mesh does not carry a design, a part of the step to it is
//!   evaluated (`carry`). A design that falls below the minimum quality is never shown to the method as NaN, infinity or a
//!   penalty: the method is stopped. It has no objective: it is no evaluation and leaves no row in the history.
//! * What follows from one search is decided in `search`: the next one begins at the best design, or in a smaller trust region
//!   around it (`trust_region`). Where nothing is left the run ends with [`StopReason::MeshLimited`]; so does one whose method came
//!   to its tolerance in a small trust region while the gradient promises as much as before (`promised_gain`): that is no
//!   convergence. Where bounds and constraints leave less of the gradient than the tolerance it is, whatever the mesh has left.
//! * Where the method ends and no design keeps all constraints, the worst of them is minimised until one does; then the method goes
//!   on from there. Where none does the run ends with the least violation.
//! * Where a search asks for the best design once more, to rounding, it has come to its end.
//! * Where the method ends, one evaluation is left, or the supervisor looks after the next one, and a far better design than the
//!   best one is beyond a bound by little, it is evaluated a step back within its bounds (`near_miss`).
//! * An interrupted run is resumed by replay: the recorder gives its evaluations back, and as long as the method asks for
//!   the same designs to the last bit they are the answers (`replay`). The method
//!   is then in the state that it was in. Anything else is an error.
//! * On a finer mesh a search goes on from the best design of the one before, also where it is beyond a bound there; where nothing
//!   better than the initial design comes of that, it begins anew (`start`). A supervisor looks at
//!   a search between two evaluations, and may end it for that (`supervisor`).
//! * Limits of evaluations and time are checked before the mesh of each evaluation but the first: what was
//!   computed is kept, and there is a best design. A signal may come before the first evaluation, or during the replay:
//!   then there is nothing new to keep.

mod carry;
mod compute;
mod evaluation;
mod incumbent;
mod near_miss;
mod observer;
mod outcome;
mod promised_gain;
mod record;
mod recorder;
mod replay;
mod run;
mod search;
mod settings;
mod start;
mod stop;
mod stop_reason;
mod supervisor;
mod trust_region;

use crate::error::Error;
use crate::problem::Problem;

pub use evaluation::{Evaluation, column};
pub use observer::{Observer, Silent, Watching};
pub use outcome::{Best, Optimised};
pub use record::Record;
pub use recorder::{Recorder, Unrecorded};
pub use settings::Settings;
pub use start::Start;
pub use stop_reason::StopReason;
pub use supervisor::{Standing, Supervisor, Unsupervised};

use run::Run;
use search::{NextStep, Search};

/// Runs the optimisation of a problem with a shape and an objective.
///
/// `interrupted` is asked before each evaluation.
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
    settings: &Settings,
    observer: &mut dyn Observer,
    recorder: &mut dyn Recorder,
    interrupted: &dyn Fn() -> bool,
) -> Result<Optimised, Error> {
    let start = &Start::default();
    optimise_from(start, problem, settings, observer, (recorder, &mut Unsupervised), interrupted)
}

/// As [`optimise`], with what a search on a coarser mesh has left, under a supervisor.
///
/// # Errors
/// As [`optimise`].
///
/// # Panics
/// As [`optimise`], and if the design to go on from has another length than there are variables.
pub fn optimise_from(
    start: &Start,
    problem: &mut Problem,
    settings: &Settings,
    observer: &mut dyn Observer,
    (recorder, supervisor): (&mut dyn Recorder, &mut dyn Supervisor),
    interrupted: &dyn Fn() -> bool,
) -> Result<Optimised, Error> {
    let run = Run::new(problem, settings, observer, (recorder, supervisor), interrupted);
    let mut run = run.taking_over(start);
    let reason = match run.take_up(start.design.as_deref()) {
        Ok(None) => search(&mut run, settings)?,
        Ok(Some(reason)) => reason,
        Err(error) => run.salvage(error)?,
    };
    run.finish(reason)
}

/// One search after the other, until there is a reason to stop.
fn search(run: &mut Run<'_>, settings: &Settings) -> Result<StopReason, Error> {
    let mut search = Search::new(run, settings);
    loop {
        match advance(&mut search, run) {
            Ok(None) => {}
            Ok(Some(reason)) => return Ok(reason),
            Err(error) => return run.salvage(error),
        }
    }
}

/// One search of the method, and what follows from it; a reason where nothing does.
fn advance(search: &mut Search<'_>, run: &mut Run<'_>) -> Result<Option<StopReason>, Error> {
    let ended = search.minimise(run);
    match search.decide(run, ended)? {
        NextStep::Stop(reason) => {
            let reason = run.step_back(reason)?;
            if reason.is_some_and(StopReason::is_of_method) && run.take_back() {
                search.begin_anew(run);
                return Ok(None);
            }
            search.move_trust_region(run);
            return Ok(reason);
        }
        NextStep::SearchOn => {}
        NextStep::Restore => search.restore(run),
        NextStep::TightenTolerance { promised } => search.tighten_tolerance(run, promised),
        NextStep::MoveTrustRegion => search.move_trust_region(run),
        NextStep::ShrinkTrustRegion { refused, gained } => search.shrink_trust_region(run, &refused, gained),
    }
    Ok(None)
}
