//! A run with a tolerance: its mesh is refined before the search, and after it for the best design, until the error bars of the
//! objective are small enough. A search pauses for an estimate now and then, so that no evaluations are spent on a gain of the mesh.
//!
//! Every mesh is a *level*. The journal has the evaluations of all levels one after the other, `refinements.json` the elements
//! that were marked: a resumed run makes the same meshes again, and what was cut short before its marks were written is
//! estimated again, with the same bits. Variables mean the same on every level ([`RefinedMesh`]).
//!
//! Does not live here: the estimate and the marks (`fluxmorph_optimizer::problem::ErrorEstimate`), the way of a search from the
//! best design of the one before (`fluxmorph_optimizer::driver::Start`).

use std::time::Instant;

use fluxmorph_geometry::ElementId;
use fluxmorph_optimizer::Error as OptimizerError;
use fluxmorph_optimizer::driver::{self, Optimised, Settings, Start, StopReason};
use fluxmorph_optimizer::memory_estimate::Sizes;
use fluxmorph_optimizer::problem::{Analysis, Derivatives, ErrorEstimate, NoProgress, SolverCache};
use fluxmorph_remesh::Moved;

use super::Session;
use super::journal::mesh_hash;
use super::recorder::DirectoryRecorder;
use super::replayed::Behind;
use crate::build::{Mode, RefinedMesh, Setup, memory_limit, remaining_elements, set_up_on};
use crate::config::ElementOrder;
use crate::error::Error;
use crate::files::{OutputError, RefinementStep, Refinements, relative_bar};
use crate::show::RunObserver;

/// What came of the wish for a finer mesh.
enum Refined {
    Yes,
    /// The mesh is fine enough.
    NotNeeded,
    /// It stays as it is, for a reason that was reported.
    No,
    /// There is nothing left to use it with: what ends the run, and a warning of the tolerance; a signal is none.
    OutOf(StopReason, Option<String>),
}

/// Evaluations with which a search on a finer mesh begins: of the initial design, and of the best one before it.
const TAKEN_UP: usize = 2;

/// Evaluations on a mesh after which a search pauses for an estimate the first time; the next times after twice as many each.
/// Searches take ten to fifteen to converge.
const FIRST_PAUSE: usize = 10;

/// The time of a run: that of what it computes, refinements included, and not of what it repeats from its journal.
struct TimeLimit {
    most: Option<f64>,
    since: Instant,
}

impl TimeLimit {
    /// So many seconds from now.
    fn starting_now(most: Option<f64>) -> Self {
        Self { most, since: Instant::now() }
    }

    /// All of it from now.
    fn restart(&mut self) {
        self.since = Instant::now();
    }

    /// What is left [s]; `None` without a limit.
    fn left(&self) -> Option<f64> {
        self.most.map(|most| (most - self.since.elapsed().as_secs_f64()).max(0.0))
    }

    fn is_over(&self) -> bool {
        self.left().is_some_and(|left| left <= 0.0)
    }
}

/// The mesh of a run with a tolerance.
pub(super) struct Levels {
    mesh: RefinedMesh,
    /// The refinements so far; behind them, while a run is resumed, those that are still to be made again.
    kept: Refinements,
    made: usize,
    tolerance: f64,
    most: usize,
}

/// What all searches of a run have come to.
pub(super) struct Searched {
    /// The last search, with the timings of all.
    pub(super) optimised: Optimised,
    /// The initial shape on the mesh of the last search.
    pub(super) first: Moved,
    /// The estimated error of the best design, where it is known already.
    pub(super) at_best: Option<ErrorEstimate>,
    /// How the mesh was refined; `None` without a tolerance.
    pub(super) refinements: Option<Refinements>,
}

impl Levels {
    /// An error bar beside the tolerance, in words.
    fn compared(&self, design: &str, bar: f64) -> String {
        let percent = |share: f64| format!("{:.2} %", 100.0 * share);
        let (bar, tolerance) = (percent(bar), percent(self.tolerance));
        format!("the error bar of the {design} design is {bar}, accuracy.tolerance {tolerance}")
    }

    /// Those of a run that is begun or resumed; `None` without a tolerance.
    fn of(session: &Session<'_>) -> Result<Option<Self>, Error> {
        let accuracy = &session.config.accuracy;
        let Some(tolerance) = accuracy.tolerance else { return Ok(None) };
        let mesh = RefinedMesh::new(session.config, session.source, &session.setup.full_mesh)?;
        let kept = Refinements::read(&session.directory)?;
        Ok(Some(Self { mesh, kept, made: 0, tolerance, most: accuracy.max_refinements }))
    }

    /// After how many evaluations a search that has begun after `before` of them pauses, behind those that are `replayed`: where the
    /// run before its interruption had refined, and else where it would have paused. `None` where nothing would follow.
    fn pause(&self, before: usize, replayed: usize) -> Option<usize> {
        let refined = self.kept.refinements.get(self.made).map(|step| step.evaluations);
        let pauses = std::iter::successors(Some(FIRST_PAUSE), |pause| pause.checked_mul(2));
        let next = || pauses.map(|pause| before + pause).find(|pause| *pause >= before + replayed);
        if self.made < self.most { refined.or_else(next) } else { None }
    }

    /// The refinement that the run before its interruption made after so many evaluations.
    fn next_kept(&self, evaluations: usize) -> Option<RefinementStep> {
        self.kept.refinements.get(self.made).filter(|step| step.evaluations == evaluations).cloned()
    }
}

impl Session<'_> {
    /// Whether its mesh is not that of the configuration any more.
    pub(super) fn is_refined(refinements: Option<&Refinements>) -> bool {
        refinements.is_some_and(|refinements| !refinements.refinements.is_empty())
    }

    /// Searches on one mesh after the other.
    ///
    /// # Errors
    /// As [`driver::optimise`], and what the analysis of a design fails with.
    pub(super) fn search(
        &mut self,
        recorder: &mut DirectoryRecorder,
        observer: &mut dyn RunObserver,
    ) -> Result<Searched, Error> {
        let settings = self.config.optimizer.settings();
        let mut levels = Levels::of(self)?;
        let is_shared_out = self.setup.problem.share().is_some();
        if levels.is_some() && is_shared_out {
            observer.warning("accuracy.tolerance needs one process: the mesh of this run is not refined");
        }
        // Of second order the set-up has said it.
        levels = levels.filter(|_| !is_shared_out && self.config.analysis.order == ElementOrder::Linear);
        let mut limit = TimeLimit::starting_now(settings.max_time);
        if let Some(levels) = &mut levels {
            self.refine_before_search(levels, recorder.is_replaying(), &mut limit, observer)?;
        }
        let mut start = Start { level: levels.as_ref().map_or(0, |levels| levels.made), ..Start::default() };
        start.pause = levels.as_ref().and_then(|own| own.pause(0, recorder.replayed_of(start.level)));
        let mut before: Option<Optimised> = None;
        // Evaluations of a search that goes on after a pause.
        let mut seen = 0;
        loop {
            if recorder.is_replaying() && seen == 0 {
                limit.restart();
            }
            let first = self.setup.problem.moved(self.initial_design())?;
            let settings = Settings { max_time: limit.left(), ..settings.clone() };
            let optimised = driver::optimise_from(
                &start,
                &mut self.setup.problem,
                &settings,
                &mut Behind { observer, seen },
                recorder,
                self.interrupted,
            )?;
            let (refined, at_best) = match &mut levels {
                Some(levels) => self.refine_after_search(levels, &optimised, &limit, observer)?,
                None => (Refined::No, None),
            };
            let is_refined = matches!(refined, Refined::Yes);
            let is_paused = optimised.stop_reason == StopReason::Paused;
            if is_paused && matches!(refined, Refined::NotNeeded | Refined::No) {
                seen = optimised.evaluations - start.evaluations;
                let wants_more = levels.as_ref().filter(|_| matches!(refined, Refined::NotNeeded));
                start.pause = wants_more.and_then(|own| own.pause(start.evaluations, seen + 1));
                recorder.rewind(start.level)?;
                continue;
            }
            let mut optimised = sum(before.take(), optimised);
            if let Refined::OutOf(reason, warning) = refined {
                warning.iter().for_each(|warning| observer.warning(warning));
                optimised.warnings.extend(warning);
                optimised.stop_reason = reason;
            }
            if !is_refined {
                let refinements = levels.map(|levels| levels.kept);
                return Ok(Searched { optimised, first, at_best, refinements });
            }
            start = Start {
                level: start.level + 1,
                evaluations: optimised.evaluations,
                iterations: optimised.iterations,
                design: Some(optimised.best.values.clone()),
                pause: None,
            };
            let replayed = recorder.replayed_of(start.level);
            start.pause = levels.as_ref().and_then(|own| own.pause(start.evaluations, replayed));
            (before, seen) = (Some(optimised), 0);
        }
    }

    /// Ends a run before its next evaluation once a signal came.
    fn check_interrupted(&self) -> Result<(), OptimizerError> {
        OptimizerError::check_interrupted(self.interrupted).map_err(|_| OptimizerError::InterruptedRun)
    }

    /// Refines the mesh until the error bar of the initial design is within the tolerance, or the time is over.
    fn refine_before_search(
        &mut self,
        levels: &mut Levels,
        has_begun: bool,
        limit: &mut TimeLimit,
        observer: &mut dyn RunObserver,
    ) -> Result<(), Error> {
        loop {
            self.check_interrupted()?;
            if let Some(step) = levels.next_kept(0) {
                self.refine_again(levels, &step)?;
                limit.restart();
                continue;
            }
            if has_begun {
                return Ok(());
            }
            if limit.is_over() {
                observer.warning(
                    "optimizer.max_time is over before the mesh is fine enough for accuracy.tolerance: the initial design is \
                     evaluated on the mesh as it is, from which a resumed run goes on",
                );
                return Ok(());
            }
            observer.phase("solving the field of the initial design");
            let problem = &self.setup.problem;
            let (moved, cache) = (problem.moved(self.initial_design())?, &mut SolverCache::default());
            let analysis = problem.analyse(moved, Derivatives::None, cache, &mut NoProgress)?;
            self.check_interrupted()?;
            let Some(estimate) = self.estimator().estimate(&analysis, observer) else {
                observer.warning("without an estimated error the mesh is not refined to accuracy.tolerance");
                return Ok(());
            };
            let scale = analysis.objective.map_or(f64::NAN, f64::abs);
            let of_initial = (&analysis, &estimate, scale);
            match self.refine(levels, (0, limit), of_initial, observer)? {
                Refined::Yes => {}
                Refined::NotNeeded | Refined::No => return Ok(()),
                Refined::OutOf(_, warning) => {
                    warning.iter().for_each(|warning| observer.warning(warning));
                    return Ok(());
                }
            }
        }
    }

    /// Refines the mesh for the best design, where its error bar is beyond the tolerance and there is time to go on: whether it
    /// was, and the estimate where it was made.
    fn refine_after_search(
        &mut self,
        levels: &mut Levels,
        optimised: &Optimised,
        limit: &TimeLimit,
        observer: &mut dyn RunObserver,
    ) -> Result<(Refined, Option<ErrorEstimate>), Error> {
        let reason = optimised.stop_reason;
        let is_over = matches!(
            reason,
            StopReason::MaxEvaluations
                | StopReason::MaxTime
                | StopReason::Interrupted
                | StopReason::NumericalFailure
        );
        if is_over {
            return Ok((Refined::No, None));
        }
        if (self.interrupted)() {
            return Ok((Refined::OutOf(StopReason::Interrupted, None), None));
        }
        if let Some(step) = levels.next_kept(optimised.evaluations) {
            self.refine_again(levels, &step)?;
            return Ok((Refined::Yes, None));
        }
        let analysis = &optimised.best.analysis;
        let Some(estimate) = self.estimator().estimate(analysis, observer) else {
            return Ok((Refined::No, None));
        };
        let scale = optimised.initial.abs().max(optimised.best.objective.abs());
        let of_best = (analysis, &estimate, scale);
        let refined = self.refine(levels, (optimised.evaluations, limit), of_best, observer)?;
        let estimate = Some(estimate).filter(|_| !matches!(refined, Refined::Yes));
        Ok((refined, estimate))
    }

    /// Refines the mesh where a design needs it, for an error relative to `scale`; whether it was refined. Why not is reported.
    fn refine(
        &mut self,
        levels: &mut Levels,
        (evaluations, limit): (usize, &TimeLimit),
        (analysis, estimate, scale): (&Analysis, &ErrorEstimate, f64),
        observer: &mut dyn RunObserver,
    ) -> Result<Refined, Error> {
        let objective = analysis.objective.unwrap_or(f64::NAN);
        let what = if evaluations == 0 { "initial" } else { "best" };
        let Some(bar) = relative_bar(estimate.objective, scale) else {
            observer.warning(&format!(
                "the objective of the {what} design is zero: accuracy.tolerance means nothing"
            ));
            return Ok(Refined::No);
        };
        let said = levels.compared(what, bar);
        if bar <= levels.tolerance {
            observer.note(&format!("{said}: the mesh is fine enough"));
            return Ok(Refined::NotNeeded);
        }
        if levels.made >= levels.most {
            observer.warning(&format!(
                "{said}, and all {} refinements are used: the tolerance is not kept; allow more accuracy.max_refinements, or \
                 begin with a finer mesh",
                levels.most
            ));
            return Ok(Refined::No);
        }
        let is_used_up = evaluations > 0 && evaluations + TAKEN_UP > self.config.optimizer.max_evaluations;
        let over = [(is_used_up, StopReason::MaxEvaluations), (limit.is_over(), StopReason::MaxTime)];
        if let Some((_, reason)) = over.into_iter().find(|(is_over, _)| *is_over) {
            let left =
                if reason == StopReason::MaxTime { "there is no time" } else { "too few evaluations are" };
            let warning = format!("{said}, and {left} left for a finer mesh: the tolerance is not kept");
            return Ok(Refined::OutOf(reason, Some(warning)));
        }
        if (self.interrupted)() {
            return Ok(Refined::OutOf(StopReason::Interrupted, None));
        }
        observer.phase("refining the mesh");
        let full = levels.mesh.mesh().topology();
        let in_full = remaining_elements(self.config, full);
        let marked: Vec<ElementId> =
            estimate.marked(1.0 - levels.tolerance / bar).into_iter().map(|e| in_full[e.index()]).collect();
        if marked.is_empty() {
            observer.warning(&format!("{said}, and no element has a share in it: the tolerance is not kept"));
            return Ok(Refined::No);
        }
        let tets = full.tets().len();
        match self.refined(&levels.mesh, &marked) {
            Ok((mesh, setup)) => {
                (levels.mesh, self.setup) = (mesh, setup);
            }
            Err(cause) => {
                observer.warning(&format!(
                    "{said}, and the mesh cannot be refined further: {cause}; the tolerance is not kept"
                ));
                return Ok(Refined::No);
            }
        }
        levels.made += 1;
        levels.kept.refinements.truncate(levels.made - 1);
        levels.kept.refinements.push(RefinementStep {
            evaluations,
            tets,
            objective,
            error_estimate: estimate.objective,
            blake3: mesh_hash(levels.mesh.mesh()),
            marked: marked.into_iter().map(ElementId::index).collect(),
        });
        levels.kept.write(&self.directory)?;
        observer.note(&format!(
            "{said}: refinement {}, {tets} → {} tetrahedra",
            levels.made,
            levels.mesh.mesh().topology().tets().len()
        ));
        Ok(Refined::Yes)
    }

    /// Makes a refinement of before the interruption again.
    fn refine_again(&mut self, levels: &mut Levels, step: &RefinementStep) -> Result<(), Error> {
        let damaged = |message: &str| {
            let message = format!("{message} (without the file `resume` estimates the errors anew)");
            Error::from(OutputError::Damaged { path: self.directory.refinements(), message })
        };
        let tets = levels.mesh.mesh().topology().tets().len();
        if step.marked.iter().any(|&e| e >= tets) {
            return Err(damaged("it names an element that the mesh does not have"));
        }
        let marked: Vec<ElementId> = step.marked.iter().copied().map(ElementId::new).collect();
        let mut mesh = levels.mesh.clone();
        mesh.halve(&marked)?;
        if mesh_hash(mesh.mesh()) != step.blake3 {
            return Err(damaged("it makes another mesh than it says"));
        }
        self.setup = self.set_up(&mesh)?;
        (levels.mesh, levels.made) = (mesh, levels.made + 1);
        Ok(())
    }

    /// A finer mesh, and the problem on it; else why there is none.
    fn refined(&self, mesh: &RefinedMesh, marked: &[ElementId]) -> Result<(RefinedMesh, Setup), String> {
        let mut finer = mesh.clone();
        finer.halve(marked).map_err(|error| error.to_string())?;
        let count = |mesh: &RefinedMesh| mesh.mesh().topology().tets().len() as f64;
        let growth = count(&finer) / count(mesh);
        let too_large =
            |shortage: String| Err(format!("the problem on {} tetrahedra takes {shortage}", count(&finer)));
        let [least, _] = Sizes::of(&self.setup.problem).on_other_mesh(growth);
        if let Some(shortage) = memory_limit::shortage(least) {
            return too_large(shortage);
        }
        let setup = self.set_up(&finer).map_err(|error| error.to_string())?;
        match memory_limit::shortage_of(&setup.problem) {
            Some(shortage) => too_large(shortage),
            None => Ok((finer, setup)),
        }
    }

    fn set_up(&self, mesh: &RefinedMesh) -> Result<Setup, Error> {
        let finer = (mesh.mesh().clone(), mesh.surface(self.config)?);
        set_up_on(finer, self.config, self.source, Mode::Optimisation)
    }
}

/// The last search, with what those before it took.
fn sum(before: Option<Optimised>, last: Optimised) -> Optimised {
    let Some(before) = before else { return last };
    let mut timings = before.timings;
    timings += last.timings;
    Optimised { timings, worst_residual: before.worst_residual.max(last.worst_residual), ..last }
}
