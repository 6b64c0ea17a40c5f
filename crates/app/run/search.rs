//! The searches of a run: one, or with a tolerance one on each mesh (`levels`), from the best design of the one before.

use std::path::PathBuf;
use std::time::Instant;

use fluxmorph_geometry::NodeId;
use fluxmorph_optimizer::Error as OptimizerError;
use fluxmorph_optimizer::driver::{self, Optimised, Settings, Start, StopReason, Supervisor, Unsupervised};
use fluxmorph_optimizer::problem::{Derivatives, NoProgress, SolverCache};
use fluxmorph_remesh::Moved;

use super::Session;
use super::estimate::Estimate;
use super::levels::{Levels, Looked, Refined};
use super::recorder::DirectoryRecorder;
use crate::config::ElementOrder;
use crate::error::Error;
use crate::files::Refinements;
use crate::show::RunObserver;

/// What all searches of a run have come to.
pub(super) struct Searched {
    /// The last search, with the timings of all.
    pub(super) optimised: Optimised,
    /// The initial shape on the mesh of the last search.
    pub(super) first: Moved,
    /// The estimated error of the best design, where it is known already.
    pub(super) at_best: Option<Estimate>,
    /// How the mesh was refined; `None` without a tolerance.
    pub(super) refinements: Option<Refinements>,
    /// The time that took, with the estimates for it [s].
    pub(super) refinement_seconds: Option<f64>,
    /// Of every node that the mesh of the configuration does not have, the two in whose middle it lies.
    pub(super) parents: Vec<[NodeId; 2]>,
}

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

impl<'a> Session<'a> {
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
        let mut limit = TimeLimit::starting_now(settings.max_time);
        let mut levels = self.levels(observer)?;
        if let Some(levels) = &mut levels {
            let begun = recorder.next_level();
            levels.timed(|levels| self.refine_before_search(levels, begun, &mut limit, observer))?;
        }
        let mut start = Start { level: levels.as_ref().map_or(0, |levels| levels.made), ..Start::default() };
        let mut before: Option<Optimised> = None;
        loop {
            if recorder.is_replaying() {
                limit.restart();
            }
            let first = self.setup.problem.moved(self.initial_design())?;
            let settings = Settings { max_time: limit.left(), ..settings.clone() };
            let mut unsupervised = Unsupervised;
            let supervisor: &mut dyn Supervisor = match &mut levels {
                Some(levels) => {
                    levels.begin(start.evaluations);
                    levels
                }
                None => &mut unsupervised,
            };
            let problem = &mut self.setup.problem;
            let watched = (recorder as _, supervisor);
            let found =
                driver::optimise_from(&start, problem, &settings, observer, watched, self.interrupted)?;
            if found.computed == 0 {
                // All of it was replayed.
                limit.restart();
            }
            let mut optimised = sum(before.take(), found);
            let (refined, at_best) = match &mut levels {
                Some(levels) => {
                    levels.timed(|levels| self.refine_after_search(levels, &optimised, &limit, observer))?
                }
                None => (Refined::No, None),
            };
            match refined {
                Refined::Yes(setup) => self.setup = *setup,
                Refined::No | Refined::OutOf(..) => {
                    if let Refined::OutOf(reason) = refined {
                        optimised.stop_reason = reason;
                    }
                    if let Some(levels) = &mut levels {
                        optimised.warnings.append(&mut levels.warnings);
                    }
                    let parents = levels.as_ref().map_or_else(Vec::new, |levels| levels.parents().to_vec());
                    let refinement_seconds = levels.as_ref().map(|levels| levels.seconds);
                    let refinements = levels.map(Levels::into_refinements);
                    return Ok(Searched {
                        optimised,
                        first,
                        at_best,
                        refinements,
                        refinement_seconds,
                        parents,
                    });
                }
            }
            start = Start {
                level: start.level + 1,
                evaluations: optimised.evaluations,
                iterations: optimised.iterations,
                design: Some(optimised.best.values.clone()),
                bounds: optimised.bounds.iter().map(|bound| bound.value).collect(),
            };
            before = Some(optimised);
        }
    }

    /// The levels of a run with a tolerance, where its mesh can be refined.
    fn levels(&self, observer: &mut dyn RunObserver) -> Result<Option<Levels<'a>>, Error> {
        let levels = Levels::of(self)?;
        // Of second order the set-up has said it.
        let levels = levels.filter(|_| self.config.analysis.order == ElementOrder::Linear);
        if self.setup.problem.share().is_none() {
            return Ok(levels);
        }
        if self.config.accuracy.tolerance.is_some() {
            observer.warning("accuracy.tolerance needs one process: the mesh of this run is not refined");
        }
        Ok(None)
    }

    /// Refuses to go on with a refined mesh on several ranks.
    pub(super) fn check_levels(&self) -> Result<(), Error> {
        let has_kept = || Refinements::read(&self.directory).map(|own| !own.refinements.is_empty());
        if self.setup.problem.share().is_some() && has_kept()? {
            let path: PathBuf = self.directory.path().to_owned();
            let cause = "its mesh was refined, which takes one process: resume it without ranks".to_owned();
            return Err(Error::NotResumable { path, cause });
        }
        Ok(())
    }

    /// Ends a run before its next evaluation once a signal came.
    fn check_interrupted(&self) -> Result<(), OptimizerError> {
        OptimizerError::check_interrupted(self.interrupted).map_err(|_| OptimizerError::InterruptedRun)
    }

    /// Refines the mesh until the error bar of the initial design is within the tolerance, or the time is over; where a search has
    /// begun, as often as before it.
    fn refine_before_search(
        &mut self,
        levels: &mut Levels<'a>,
        begun: Option<usize>,
        limit: &mut TimeLimit,
        observer: &mut dyn RunObserver,
    ) -> Result<(), Error> {
        loop {
            self.check_interrupted()?;
            if let Some(setup) = levels.refine_again(0)? {
                self.setup = *setup;
                limit.restart();
                continue;
            }
            if begun.is_some_and(|level| levels.made >= level) {
                return Ok(());
            }
            // What was done before takes none of the time, which begins when all is replayed.
            let is_out_of_time = begun.is_none() && limit.is_over();
            if is_out_of_time {
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
            let Some(errors) = levels.estimator(problem).errors(&analysis, observer) else {
                observer.warning("without an estimated error the mesh is not refined to accuracy.tolerance");
                return Ok(());
            };
            let refined = levels.refine(
                &Looked {
                    problem,
                    analysis: &analysis,
                    estimate: &errors,
                    scale: analysis.objective.map_or(f64::NAN, f64::abs),
                    evaluations: 0,
                    is_out_of_time,
                },
                observer,
            );
            match refined? {
                Refined::Yes(setup) => self.setup = *setup,
                Refined::No | Refined::OutOf(_) => return Ok(()),
            }
        }
    }

    /// Refines the mesh for the best design, where its error bar is beyond the tolerance and there is time to go on: whether it
    /// was, and the estimate where it was made.
    fn refine_after_search(
        &self,
        levels: &mut Levels<'a>,
        optimised: &Optimised,
        limit: &TimeLimit,
        observer: &mut dyn RunObserver,
    ) -> Result<(Refined, Option<Estimate>), Error> {
        let reason = optimised.stop_reason;
        if let Some(setup) = levels.finer.take() {
            return Ok((Refined::Yes(setup), None));
        }
        if reason != StopReason::Interrupted
            && let Some(setup) = levels.refine_again(optimised.evaluations)?
        {
            return Ok((Refined::Yes(setup), None));
        }
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
            return Ok((Refined::OutOf(StopReason::Interrupted), None));
        }
        let (problem, analysis) = (&self.setup.problem, &optimised.best.analysis);
        let Some(estimate) = levels.estimator(problem).estimate(analysis, observer) else {
            return Ok((Refined::No, None));
        };
        let refined = levels.refine(
            &Looked {
                problem,
                analysis,
                estimate: &estimate.errors,
                scale: optimised.initial.abs().max(optimised.best.objective.abs()),
                evaluations: optimised.evaluations,
                is_out_of_time: optimised.computed > 0 && limit.is_over(),
            },
            observer,
        )?;
        let estimate = Some(estimate).filter(|_| !matches!(refined, Refined::Yes(_)));
        Ok((refined, estimate))
    }
}

/// The last search, with what those before it took.
fn sum(before: Option<Optimised>, last: Optimised) -> Optimised {
    let Some(before) = before else { return last };
    let mut timings = before.timings;
    timings += last.timings;
    Optimised { timings, worst_residual: before.worst_residual.max(last.worst_residual), ..last }
}
