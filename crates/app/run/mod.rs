//! One run or one analysis with its directory: what the commands `run`, `resume` and `solve` do, without a terminal; beside
//! them `morph` (mesh motion alone) and `sweep` (many runs).
//!
//! The manifest is written first and completed last; journal, history and fields are written as evaluations come
//! (`recorder`); `result.json` when all is done. A run that fails leaves a manifest that says so, every file under its
//! final name is whole, and it can be resumed.

pub mod confirmation;
pub(crate) mod estimate;
mod excess;
mod facets;
pub mod finer;
pub mod journal;
pub(crate) mod launcher;
mod levels;
pub(crate) mod memory;
pub mod mesh_independence;
pub mod morph;
mod pieces;
mod prepared;
mod recorder;
mod reported;
mod reservations;
mod resume;
mod search;
pub mod shape_pair;
mod solve;
mod summary;
pub mod sweep;
mod transmission;

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use confirmation::{Known, ShapeMeshes};
use estimate::Estimate;
use facets::FirstFacets;
use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::parallel::{RankGroup, Role};
use fluxmorph_optimizer::Error as OptimizerError;
use fluxmorph_optimizer::driver::Optimised;
use fluxmorph_optimizer::memory_estimate::Sizes;
use fluxmorph_optimizer::problem::ErrorEstimate;
use journal::{Identity, Journal};
use mesh_independence::{Check, FreshMesh, MeshIndependence};
use pieces::SharedPieces;
use prepared::Prepared;
use recorder::DirectoryRecorder;
use search::Searched;
use shape_pair::ShapePair;

use crate::build::locate_error::attribute_error;
use crate::build::{Mode, Setup, build_mesh, motion_in_words, set_up_watched};
use crate::config::{Config, FieldsKept, MeshConfig, SourceMap, resolved_toml};
use crate::error::Error;
use crate::exit_code::ExitCode;
use crate::files::{
    CurvedFacets, Disk, FileHash, Manifest, MeshHash, ObjectiveResult, OverwritePolicy, RunDirectory,
    RunResult, RunStatus, check_finite, exports, peak_memory_bytes, resume_command, surface_files,
};
use crate::show::{RunObserver, Started};
pub(crate) use resume::configuration;
pub(crate) use resume::resume_held;
pub use resume::{RunLimits, SavedRun, resume};
pub use solve::solve;
use summary::{constraints, enter_errors, homogeneity, linear_solver, terms};

/// What a session needs besides the configuration.
#[derive(Clone, Copy)]
pub struct Options<'a> {
    /// Where run directories are.
    pub disk: &'a Arc<dyn Disk>,
    /// What happens to an earlier run in the output directory.
    pub overwrite_policy: OverwritePolicy,
    /// Threads in use, for the manifest.
    pub threads: usize,
    /// The ranks among which the work is shared out; `None` for one process.
    pub ranks: Option<&'a RankGroup>,
    /// Whether the user wants to stop; asked after the set-up and before each evaluation.
    pub interrupted: &'a dyn Fn() -> bool,
    /// Shows what a search has found, which is safe then, before it is checked; where, if anywhere.
    pub searched: &'a dyn Fn(&RunDirectory) -> Option<PathBuf>,
}

/// Optimises and writes everything into the run directory.
///
/// # Errors
/// Faults of the configuration before anything is written; afterwards whatever fails, with the manifest completed.
pub fn run(
    config: &Config,
    source: &SourceMap,
    options: Options<'_>,
    observer: &mut dyn RunObserver,
) -> Result<RunResult, Error> {
    run_held(config, source, options, observer).map(|concluded| concluded.result)
}

/// What a run has come to, in a directory that is still held against other processes.
pub(crate) struct Concluded {
    pub(crate) result: RunResult,
    pub(crate) directory: RunDirectory,
    /// Whether the journal has every evaluation.
    pub(crate) is_saved: bool,
}

/// [`run`], with the directory still held.
pub(crate) fn run_held(
    config: &Config,
    source: &SourceMap,
    options: Options<'_>,
    observer: &mut dyn RunObserver,
) -> Result<Concluded, Error> {
    let prepared = Prepared::new(config, source, Mode::Optimisation, options, observer)?;
    let mesh = prepared.mesh_hash();
    let session = prepared.begin("run", mesh, observer)?;
    session.conclude(observer, |session, observer| {
        let journal = Journal::create(&session.directory, session.identity())?;
        let recorder = DirectoryRecorder::new(session, journal, Vec::new())?;
        session.optimise(recorder, observer)
    })
}

/// The work of a rank that is not the first: it sets the same problem up, and executes commands until the first one ends.
/// A set-up that fails here and not there is reported to the first one with its first command.
///
/// # Panics
/// At the first rank.
pub fn serve(group: &RankGroup, config: &Config, source: &SourceMap, mode: Mode) {
    assert_eq!(group.role(), Role::Worker, "the first rank leads");
    let setup = set_up_watched(config, source, mode, Some(group), &mut |_| ());
    let directory = config.output.directory.clone();
    let _pieces = setup.as_ref().ok().and_then(|setup| SharedPieces::of(&setup.problem, directory));
    group.serve(setup.as_ref().map(|_| ()).map_err(ToString::to_string));
}

/// A run directory with its manifest, and the problem.
struct Session<'a> {
    command: &'static str,
    config: &'a Config,
    source: &'a SourceMap,
    setup: Setup,
    /// What the set-up of the mesh of the configuration has warned of.
    warnings: Vec<String>,
    facets: FirstFacets,
    /// What no estimate has of a wall that is near, in words.
    near_wall: Option<String>,
    directory: RunDirectory,
    manifest: Manifest,
    clock: Instant,
    /// What the evaluations took that a resumed run has from its journal [s].
    replayed_seconds: f64,
    setup_seconds: f64,
    interrupted: &'a dyn Fn() -> bool,
    searched: &'a dyn Fn(&RunDirectory) -> Option<PathBuf>,
}

impl Session<'_> {
    /// Time of the run until now, with the evaluations of earlier sessions [s].
    fn seconds(&self) -> f64 {
        self.replayed_seconds + self.clock.elapsed().as_secs_f64()
    }

    /// Reports what is set up.
    fn announce(&self, observer: &mut dyn RunObserver) {
        let Self { command, config, setup, directory, .. } = self;
        let (mesh, shape) = (setup.problem.original().topology(), setup.problem.shape());
        let moves = config.remesh.as_ref().zip(shape);
        observer.started(&Started {
            title: &config.title,
            optimizer: (*command == "run").then_some(&config.optimizer),
            objective: config.objective.as_ref(),
            constraints: &config.constraints,
            variables: shape.map_or(0, |shape| shape.surface().variable_count()),
            filter_radius: shape.and_then(|shape| shape.surface().filter_radius()),
            motion: moves.map(|(remesh, shape)| motion_in_words(remesh, shape.motion())),
            nodes: mesh.node_count(),
            tets: mesh.tets().len(),
            unknowns: setup.problem.states().iter().map(|model| model.unknown_count()).sum(),
            directory: Some(directory.path()),
            fields: config.output.fields,
        });
        for warning in &self.warnings {
            observer.warning(warning);
        }
    }

    /// What all ranks write fields with; `None` for one process.
    fn pieces(&self) -> Option<SharedPieces> {
        SharedPieces::of(&self.setup.problem, self.directory.path().to_owned())
    }

    /// What the journal of this run belongs to.
    fn identity(&self) -> Identity {
        let problem = &self.setup.problem;
        let (shape, constraints) = (problem.shape(), problem.constraints());
        let variables = shape.map_or(0, |shape| shape.surface().variable_count());
        let read = (&self.setup.full_mesh, &self.setup.tables);
        Identity::new(self.config, read, variables, constraints.len())
    }

    /// Optimises, and writes what the best design leaves.
    fn optimise(
        &mut self,
        mut recorder: DirectoryRecorder,
        observer: &mut dyn RunObserver,
    ) -> Result<RunResult, Error> {
        let config = self.config;
        let Searched { optimised, first, at_best, refinements, refinement_seconds, parents } =
            self.search(&mut recorder, observer)?;
        self.facets.refine(parents);
        let best = &optimised.best;
        if config.output.fields == FieldsKept::FirstLast {
            recorder.write(best.evaluation, &self.setup.problem, &best.analysis)?;
        }
        self.export_optimum(&best.analysis.mesh, Self::is_refined(refinements.as_ref()), observer)?;
        let solved = [first.mesh.clone(), best.analysis.mesh.clone()];
        let reason = optimised.stop_reason;
        let (initial, first) = self.initial_states(first, (best, reason), observer)?;
        let problem = &self.setup.problem;
        let mut result = RunResult {
            evaluations: optimised.evaluations,
            iterations: optimised.iterations,
            objective: Some(ObjectiveResult {
                initial: optimised.initial,
                best: best.objective,
                ratio: best.objective / optimised.initial,
                best_evaluation: best.evaluation,
                verified_ratio: None,
                verification: None,
                homogeneity: homogeneity(problem, &best.analysis, optimised.initial),
                terms: terms(problem, &best.analysis),
            }),
            accuracy: None,
            initial,
            constraints: constraints(problem, &best.analysis, &optimised.bounds),
            linear_solver: linear_solver(problem, &best.analysis, optimised.worst_residual),
            ..self.result(
                reason,
                &best.analysis,
                Some(&best.values),
                optimised.initial_quality,
                &optimised.timings,
                observer,
            )?
        };
        result.warnings.splice(0..0, optimised.warnings.clone());
        let of_best = (&best.analysis, &optimised.bounds[..]);
        let excess = self.excess_of_run(first.known(), of_best, &mut result.warnings, observer);
        self.keep_search(&mut result, observer)?;
        let mut seconds = 0.0;
        let errors = timed(&mut seconds, || self.estimate_errors(first, (best, reason), at_best, observer));
        let is_cut_short = errors.is_none() && self.has_errors_estimated() && (self.interrupted)();
        result.timings_s.insert("estimate".to_owned(), seconds);
        result.timings_s.extend(refinement_seconds.map(|seconds| ("refinement".to_owned(), seconds)));
        if let Some((at_initial, at_best)) = &errors {
            let errors = (at_initial, at_best);
            self.enter_estimates(&mut result, (&optimised, errors), &mut recorder, observer)?;
        }
        let errors =
            errors.map(|(at_initial, at_best)| [at_initial.of_objective(), at_best.errors.of_objective()]);
        let shapes = ShapePair::of(config, &self.setup, &best.values)?;
        let members = [optimised.initial_members.clone(), best.analysis.member_values()];
        let meshes = ShapeMeshes { full: self.setup.full_mesh.clone(), solved, members };
        drop(optimised);
        // The ranks' part of the problem goes with it.
        drop(recorder);
        let known = Known { errors, excess, is_cut_short, refinements: refinements.as_ref() };
        self.confirm(result, (&shapes, &meshes), &known, observer)
    }

    /// Writes the mesh of the best design; that of a refined one under a name of its own.
    fn export_optimum(
        &self,
        mesh: &Mesh,
        is_refined: bool,
        observer: &mut dyn RunObserver,
    ) -> Result<(), Error> {
        let directory = &self.directory;
        let optimum = if is_refined { directory.optimum_refined() } else { directory.optimum() };
        exports::write(self.config, directory, &optimum, mesh, observer)?;
        // Of an end before, where the run was resumed and is not asked for them any more.
        if !self.config.output.mesh {
            directory.remove(&optimum)?;
        }
        directory.remove_surfaces(&self.manifest.surfaces, &surface_files(&self.config.output.stl))?;
        if is_refined {
            // Of a mesh before, where the run had ended on it and was resumed.
            directory.remove(&directory.optimum())?;
        }
        Ok(())
    }

    /// Enters the estimated errors at the initial and the best design, and writes where those of the best one are made.
    fn enter_estimates(
        &self,
        result: &mut RunResult,
        (optimised, (at_initial, at_best)): (&Optimised, (&ErrorEstimate, &Estimate)),
        recorder: &mut DirectoryRecorder,
        observer: &mut dyn RunObserver,
    ) -> Result<(), Error> {
        let of_run = (&self.setup.problem, &optimised.bounds[..]);
        let of_both = (Some(at_initial), &at_best.errors);
        enter_errors(&mut result.constraints, of_run, of_both, observer);
        result.enter_errors(&at_best.of_states);
        let by_element = &at_best.errors.by_element;
        if by_element.iter().any(|error| *error != 0.0) {
            recorder.write_error(&self.setup.problem, &optimised.best.analysis, by_element)?;
        }
        Ok(())
    }

    /// Does the work, writes the result, and completes the manifest whatever happens, be it a panic.
    fn conclude(
        mut self,
        observer: &mut dyn RunObserver,
        work: impl FnOnce(&mut Self, &mut dyn RunObserver) -> Result<RunResult, Error>,
    ) -> Result<Concluded, Error> {
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            self.write_configuration()?;
            let result = work(&mut self, observer).map_err(|error| match error {
                Error::Optimizer(OptimizerError::Constraint { .. } | OptimizerError::FirstDesign { .. }) => {
                    attribute_error(error, self.config, self.source)
                }
                other => other,
            })?;
            check_finite(&result)?;
            result.write(&self.directory)?;
            Ok::<RunResult, Error>(result)
        }));
        let status = match &outcome {
            Ok(Ok(result)) => result.status,
            Ok(Err(Error::Optimizer(OptimizerError::InterruptedRun))) => RunStatus::Interrupted,
            _ => RunStatus::Failed,
        };
        self.manifest.complete(status, self.seconds());
        let completed = self.manifest.write(&self.directory);
        let outcome = outcome.unwrap_or_else(|panic| resume_unwind(panic));
        if let Err(error) = &outcome
            && self.command == "run"
            && let Some(evaluations) = self.worth_resuming(error)
        {
            let command = resume_command(self.directory.path());
            let kept = match evaluations {
                0 => "no evaluation was kept".to_owned(),
                1 => "one evaluation is kept".to_owned(),
                _ => format!("{evaluations} evaluations are kept"),
            };
            observer.warning(&format!("{kept}: resume with `{command}`"));
        }
        let result = outcome?;
        completed?;
        observer.finished(&result);
        let has_journal = self.command == "run";
        let loss = has_journal.then(|| Journal::loss(&self.directory, result.evaluations)).flatten();
        if let Some(loss) = &loss {
            observer.warning(loss);
        }
        Ok(Concluded { result, directory: self.directory, is_saved: loss.is_none() })
    }

    /// How many evaluations of a run that ended with an error are there to be resumed; `None` where it cannot be: what fails in the
    /// first evaluation fails in it again.
    fn worth_resuming(&self, error: &Error) -> Option<usize> {
        if !error.is_resumable() || self.directory.check_place().is_err() {
            return None;
        }
        let evaluations = Journal::read_records(&self.directory).map_or(0, |records| records.len());
        let is_worth = error.exit_code() != ExitCode::Numerical || evaluations > 0;
        (is_worth && self.directory.holds_configuration()).then_some(evaluations)
    }

    fn write_configuration(&self) -> Result<(), Error> {
        self.directory.write(&self.directory.config(), self.source.text().as_bytes())?;
        Ok(self.directory.write(&self.directory.resolved(), resolved_toml(self.config).as_bytes())?)
    }

    /// The design that a run begins with; empty without a design.
    fn initial_design(&self) -> &[f64] {
        self.setup.problem.shape().map(|shape| shape.initial()).unwrap_or_default()
    }

    /// Writes what the search has found, and its page: estimates and checks may need more memory or patience than there is.
    fn keep_search(&self, result: &mut RunResult, observer: &mut dyn RunObserver) -> Result<(), Error> {
        if let Some(warning) =
            result.objective.as_ref().and_then(|own| reservations::wrong_sign(self.config, own))
        {
            observer.warning(&warning);
            result.warnings.push(warning);
        }
        check_finite(result)?;
        result.write(&self.directory)?;
        if self.is_checked(result.stop_reason)
            && let Some(page) = (self.searched)(&self.directory)
        {
            observer.note(&format!("report of the search, to be checked: {}", page.display()));
        }
        Ok(())
    }

    /// The result with the gain checked on a finer mesh, by other elements and by its estimated errors; the run's own problem
    /// is gone then.
    fn confirm(
        &mut self,
        mut result: RunResult,
        (shapes, meshes): (&ShapePair, &ShapeMeshes),
        known: &Known<'_>,
        observer: &mut dyn RunObserver,
    ) -> Result<RunResult, Error> {
        // A mesh that is refined where it counts may be finer there than one that is generated anew.
        let fresh = if Self::is_refined(known.refinements) {
            None
        } else {
            FreshMesh::of(self.config, &self.setup.problem)
        };
        let sizes = Sizes::of(&self.setup.problem);
        self.setup.problem.release();
        let clock = Instant::now();
        let (config, source) = (self.config, self.source);
        let stop_reason = result.stop_reason;
        let check = MeshIndependence {
            config,
            source,
            stop_reason,
            shapes,
            fresh: fresh.as_ref(),
            meshes: Some(meshes),
            sizes,
            constraints: &result.constraints,
        };
        let keeps_all = result.violated().is_empty();
        if let Some(objective) = &mut result.objective {
            if check.verify(objective, self.interrupted, observer) == Check::CutShort {
                // `resume` can do it later: the search is complete, the run is not.
                result.status = RunStatus::Interrupted;
            }
            result.accuracy = self.accuracy((objective, stop_reason, keeps_all), meshes, known, observer);
            let is_measured = |own: &CurvedFacets| own.change.is_some();
            let facets = result.accuracy.as_ref().and_then(|accuracy| accuracy.facets.as_ref());
            if (known.is_cut_short || !facets.is_none_or(is_measured)) && (self.interrupted)() {
                result.status = RunStatus::Interrupted;
            }
        }
        let seconds = clock.elapsed().as_secs_f64();
        result.timings_s.insert("verification".to_owned(), seconds);
        result.timings_s.insert("total".to_owned(), self.seconds());
        result.peak_memory_bytes = peak_memory_bytes();
        Ok(result)
    }
}

/// The B–H tables that were read, with the hashes of their content.
fn table_hashes(tables: &BTreeMap<PathBuf, String>) -> Vec<FileHash> {
    let of = |(path, blake3): (&PathBuf, &String)| FileHash {
        path: path.display().to_string(),
        blake3: blake3.clone(),
    };
    tables.iter().map(of).collect()
}

/// Origin and content hash of the mesh with all its regions.
pub(crate) fn mesh_hash(config: &Config, mesh: &Mesh) -> MeshHash {
    let origin = match &config.mesh {
        MeshConfig::File { path, .. } => path.display().to_string(),
        generated => generated.generator().map_or_else(String::new, |own| own.name().to_owned()),
    };
    let topology = mesh.topology();
    MeshHash {
        origin,
        blake3: journal::mesh_hash(mesh),
        nodes: topology.node_count(),
        tets: topology.tets().len(),
    }
}

/// That of the mesh that a configuration has now.
pub(crate) fn current_mesh_hash(config: &Config, source: &SourceMap) -> Result<MeshHash, Error> {
    Ok(mesh_hash(config, &build_mesh(config, source)?))
}

/// Does the work, and adds its wall time to `seconds` [s].
fn timed<T>(seconds: &mut f64, work: impl FnOnce() -> T) -> T {
    let clock = Instant::now();
    let found = work();
    *seconds += clock.elapsed().as_secs_f64();
    found
}
