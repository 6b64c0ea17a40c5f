//! A run with a tolerance: its mesh is refined before the search, for the best design on the way of a search and at its end, until
//! the error bars of the objective are small enough.
//!
//! Every mesh is a *level*. The journal has the evaluations of all levels one after the other, `refinements.json` the elements
//! that were marked: a resumed run makes the same meshes again, and what was cut short before its marks were written is
//! estimated again, with the same bits. Variables mean the same on every level ([`RefinedMesh`]). After how many evaluations a
//! search is looked at does not depend on the limits of the run.
//!
//! Does not live here: the searches on these meshes (`search`), the estimate and the marks (`fluxmorph_optimizer::problem::ErrorEstimate`), the way of a search from the
//! best design of the one before (`fluxmorph_optimizer::driver::Start`), and when a search can be looked at
//! (`fluxmorph_optimizer::driver::Supervisor`).

use std::time::Instant;

use fluxmorph_geometry::{ElementId, NodeId};
use fluxmorph_optimizer::Error as OptimizerError;
use fluxmorph_optimizer::driver::{Observer, Standing, StopReason, Supervisor};
use fluxmorph_optimizer::memory_estimate::Sizes;
use fluxmorph_optimizer::problem::{Analysis, ErrorEstimate, Problem};

use super::estimate::Estimator;
use super::journal::mesh_hash;
use super::{Session, timed};
use crate::build::{Mode, RefinedMesh, Setup, memory_limit, remaining_elements, set_up_on};
use crate::config::{Config, SourceMap};
use crate::error::Error;
use crate::files::{OutputError, RefinementStep, Refinements, RunDirectory, relative_bar};

/// What came of the wish for a finer mesh.
pub(super) enum Refined {
    /// The problem on the finer mesh.
    Yes(Box<Setup>),
    /// The mesh stays as it is: it is fine enough, or cannot be refined, for a reason that was reported.
    No,
    /// There is nothing left to use a finer mesh with: what ends the run.
    OutOf(StopReason),
}

/// A design with its field, whose error bar is compared with the tolerance.
pub(super) struct Looked<'a> {
    pub(super) problem: &'a Problem,
    pub(super) analysis: &'a Analysis,
    pub(super) estimate: &'a ErrorEstimate,
    /// What the error is relative to.
    pub(super) scale: f64,
    /// Evaluations of the run so far: 0 before its first search.
    pub(super) evaluations: usize,
    /// Whether the time of the run is over.
    pub(super) is_out_of_time: bool,
}

/// Evaluations with which a search on a finer mesh begins: of the initial design, and of the best one before it.
const TAKEN_UP: usize = 2;

/// Evaluations on a mesh after which a search is looked at the first time; the next times are after twice as many each. Searches
/// take ten to fifteen to converge.
const FIRST_LOOK: usize = 10;

/// The mesh of a run with a tolerance.
pub(super) struct Levels<'a> {
    config: &'a Config,
    source: &'a SourceMap,
    directory: RunDirectory,
    interrupted: &'a dyn Fn() -> bool,
    mesh: RefinedMesh,
    /// The refinements so far; behind them, while a run is resumed, those that are still to be made again.
    kept: Refinements,
    pub(super) made: usize,
    tolerance: f64,
    most: usize,
    /// Evaluations before the search on this mesh.
    begun: usize,
    /// After how many evaluations the search was looked at last, and the evaluation of its best design then.
    looked: Option<[usize; 2]>,
    /// Why the run ends on this mesh though it is too coarse; reported already.
    pub(super) warnings: Vec<String>,
    /// The problem on the mesh that was refined during a search, until that has ended.
    pub(super) finer: Option<Box<Setup>>,
    /// Time that error estimates and finer meshes took [s].
    pub(super) seconds: f64,
}

impl<'a> Levels<'a> {
    /// Those of a run that is begun or resumed; `None` without a tolerance.
    pub(super) fn of(session: &Session<'a>) -> Result<Option<Self>, Error> {
        let Session { config, source, interrupted, .. } = *session;
        let Some(tolerance) = config.accuracy.tolerance else { return Ok(None) };
        let directory = session.directory.clone();
        let kept = Refinements::read(&directory)?;
        Ok(Some(Self {
            mesh: RefinedMesh::new(config, source, &session.setup.full_mesh)?,
            config,
            source,
            directory,
            interrupted,
            kept,
            made: 0,
            tolerance,
            most: config.accuracy.max_refinements,
            begun: 0,
            looked: None,
            warnings: Vec::new(),
            finer: None,
            seconds: 0.0,
        }))
    }

    /// Of every node that the mesh of the configuration does not have, the two in whose middle it lies.
    pub(super) fn parents(&self) -> &[[NodeId; 2]] {
        self.mesh.parents()
    }

    /// How the mesh was refined.
    pub(super) fn into_refinements(self) -> Refinements {
        Refinements { refinements: self.kept.refinements.into_iter().take(self.made).collect() }
    }

    /// Begins a search after so many evaluations.
    pub(super) fn begin(&mut self, evaluations: usize) {
        (self.begun, self.looked) = (evaluations, None);
        self.warnings.clear();
    }

    /// The refinement that the run before its interruption made after so many evaluations.
    fn next_kept(&self, evaluations: usize) -> Option<&RefinementStep> {
        self.kept.refinements.get(self.made).filter(|step| step.evaluations == evaluations)
    }

    /// An error bar beside the tolerance, in words.
    fn compared(&self, design: &str, bar: f64) -> String {
        let percent = |share: f64| match 100.0 * share {
            small if small < 0.01 => format!("{small:.1e} %"),
            percent => format!("{percent:.2} %"),
        };
        let (bar, tolerance) = (percent(bar), percent(self.tolerance));
        format!(
            "the error bar of the {design} design is {bar} of the larger of the initial and the best objective, \
             accuracy.tolerance {tolerance}"
        )
    }

    /// What estimates the errors of designs on the mesh as it is.
    pub(super) fn estimator<'b>(&'b self, problem: &'b Problem) -> Estimator<'b> {
        Estimator::new((self.config, self.source), (problem, self.mesh.mesh()))
    }

    /// Refines the mesh where a design needs it; whether it was refined. Why not is reported.
    pub(super) fn refine(
        &mut self,
        looked: &Looked<'_>,
        observer: &mut dyn Observer,
    ) -> Result<Refined, Error> {
        let &Looked { problem, analysis, estimate, scale, evaluations, is_out_of_time } = looked;
        let objective = analysis.objective.unwrap_or(f64::NAN);
        let what = if evaluations == 0 { "initial" } else { "best" };
        let Some(bar) = relative_bar(estimate.of_objective().size, scale) else {
            observer.warning(&format!(
                "the objective of the {what} design is zero: accuracy.tolerance means nothing"
            ));
            return Ok(Refined::No);
        };
        let said = self.compared(what, bar);
        if bar <= self.tolerance {
            observer.note(&format!("{said}: the mesh is fine enough"));
            return Ok(Refined::No);
        }
        if self.made >= self.most {
            observer.warning(&format!(
                "{said}, and all {} refinements are used: the tolerance is not kept; allow more accuracy.max_refinements, or \
                 begin with a finer mesh",
                self.most
            ));
            return Ok(Refined::No);
        }
        let is_used_up = evaluations > 0 && evaluations + TAKEN_UP > self.config.optimizer.max_evaluations;
        let over = [(is_used_up, StopReason::MaxEvaluations), (is_out_of_time, StopReason::MaxTime)];
        if let Some((_, reason)) = over.into_iter().find(|(is_over, _)| *is_over) {
            let left =
                if reason == StopReason::MaxTime { "there is no time" } else { "too few evaluations are" };
            let warning = format!("{said}, and {left} left for a finer mesh: the tolerance is not kept");
            observer.warning(&warning);
            self.warnings.push(warning);
            return Ok(Refined::OutOf(reason));
        }
        if (self.interrupted)() {
            return Ok(Refined::OutOf(StopReason::Interrupted));
        }
        observer.phase("refining the mesh");
        let full = self.mesh.mesh().topology();
        let in_full = remaining_elements(self.config, full);
        let marked: Vec<ElementId> =
            estimate.marked(1.0 - self.tolerance / bar).into_iter().map(|e| in_full[e.index()]).collect();
        if marked.is_empty() {
            observer.warning(&format!("{said}, and no element has a share in it: the tolerance is not kept"));
            return Ok(Refined::No);
        }
        let tets = full.tets().len();
        let setup = match self.refined(problem, &marked) {
            Ok((mesh, setup)) => {
                self.mesh = mesh;
                setup
            }
            Err(cause) => {
                observer.warning(&format!(
                    "{said}, and the mesh cannot be refined further: {cause}; the tolerance is not kept"
                ));
                return Ok(Refined::No);
            }
        };
        self.kept.refinements.truncate(self.made);
        self.made += 1;
        self.kept.refinements.push(RefinementStep {
            evaluations,
            tets,
            objective,
            error_estimate: estimate.objective,
            blake3: mesh_hash(self.mesh.mesh()),
            marked: marked.into_iter().map(ElementId::index).collect(),
        });
        self.kept.write(&self.directory)?;
        observer.note(&format!(
            "{said}: refinement {}, {tets} → {} tetrahedra",
            self.made,
            self.mesh.mesh().topology().tets().len()
        ));
        Ok(Refined::Yes(Box::new(setup)))
    }

    /// Makes the next refinement of before the interruption again, if it was made after so many evaluations.
    pub(super) fn refine_again(&mut self, evaluations: usize) -> Result<Option<Box<Setup>>, Error> {
        let Some(step) = self.next_kept(evaluations) else { return Ok(None) };
        let damaged = |message: &str| {
            let message = format!("{message} (without the file `resume` estimates the errors anew)");
            Error::from(OutputError::Damaged { path: self.directory.refinements(), message })
        };
        let tets = self.mesh.mesh().topology().tets().len();
        if step.marked.iter().any(|&e| e >= tets) {
            return Err(damaged("it names an element that the mesh does not have"));
        }
        let marked: Vec<ElementId> = step.marked.iter().copied().map(ElementId::new).collect();
        let mut mesh = self.mesh.clone();
        mesh.halve(&marked)?;
        if mesh_hash(mesh.mesh()) != step.blake3 {
            return Err(damaged("it makes another mesh than it says"));
        }
        let setup = self.set_up(&mesh)?;
        (self.mesh, self.made) = (mesh, self.made + 1);
        Ok(Some(Box::new(setup)))
    }

    /// A finer mesh, and the problem on it; else why there is none.
    fn refined(&self, problem: &Problem, marked: &[ElementId]) -> Result<(RefinedMesh, Setup), String> {
        let mut finer = self.mesh.clone();
        finer.halve(marked).map_err(|error| error.to_string())?;
        let count = |mesh: &RefinedMesh| mesh.mesh().topology().tets().len() as f64;
        let growth = count(&finer) / count(&self.mesh);
        let too_large =
            |shortage: String| Err(format!("the problem on {} tetrahedra takes {shortage}", count(&finer)));
        let [least, _] = Sizes::of(problem).on_other_mesh(growth);
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

impl Supervisor for Levels<'_> {
    fn had_ended(&self, evaluations: usize) -> bool {
        self.next_kept(evaluations).is_some()
    }

    fn is_due(&self, evaluations: usize) -> bool {
        let looks = std::iter::successors(Some(FIRST_LOOK), |look| look.checked_mul(2));
        let mut looks = looks.map(|look| self.begun + look).take_while(|look| *look <= evaluations);
        let was_looked_at = self.looked.is_some_and(|[after, _]| after == evaluations);
        self.made < self.most && !was_looked_at && looks.any(|look| look == evaluations)
    }

    fn look(
        &mut self,
        standing: &Standing<'_>,
        observer: &mut dyn Observer,
    ) -> Result<Option<StopReason>, OptimizerError> {
        let &Standing { evaluations, best_evaluation, .. } = standing;
        let before = self.looked.replace([evaluations, best_evaluation]);
        if before.is_some_and(|[_, best]| best == best_evaluation) {
            return Ok(None);
        }
        self.timed(|levels| levels.refine_during_search(standing, observer))
    }
}

impl Levels<'_> {
    /// Does a part of the work of refining, and adds its time.
    pub(super) fn timed<T>(&mut self, work: impl FnOnce(&mut Self) -> T) -> T {
        let mut seconds = 0.0;
        let done = timed(&mut seconds, || work(self));
        self.seconds += seconds;
        done
    }

    /// Estimates the error of the best design so far, and refines the mesh for it: why the search on this one is to end.
    fn refine_during_search(
        &mut self,
        &Standing { problem, evaluations, initial, best, deadline, .. }: &Standing<'_>,
        observer: &mut dyn Observer,
    ) -> Result<Option<StopReason>, OptimizerError> {
        let Some(errors) = self.estimator(problem).errors(best, observer) else { return Ok(None) };
        let refined = self.refine(
            &Looked {
                problem,
                analysis: best,
                estimate: &errors,
                scale: initial.abs().max(best.objective.map_or(0.0, f64::abs)),
                evaluations,
                is_out_of_time: deadline.is_some_and(|deadline| Instant::now() >= deadline),
            },
            observer,
        );
        Ok(match refined? {
            Refined::Yes(setup) => {
                self.finer = Some(setup);
                Some(StopReason::Superseded)
            }
            Refined::No => None,
            Refined::OutOf(reason) => Some(reason),
        })
    }
}
