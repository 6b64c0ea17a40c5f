//! One run or one analysis with its directory: what the commands `run`, `resume` and `solve` do, without a terminal.
//!
//! The manifest is written first and completed last; journal, history and fields are written as evaluations come
//! (`recorder`); `result.json` when all is done. A run that fails leaves a manifest that says so, every file under its
//! final name is whole, and `resume` goes on with it.

mod pieces;
mod recorder;
mod resume;
mod summary;

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::time::Instant;

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::ranks::{Member, Team};

use crate::config::{Config, FieldsKept, MeshConfig, SourceMap, resolved_toml};
use crate::driver;
use crate::error::Error;
use crate::exports;
use crate::finite;
use crate::fresh_mesh::{Check, Gain, Shapes};
use crate::journal::{self, Identity};
use crate::memory::Memory;
use crate::memory_estimate::{of_evaluation, of_fresh_mesh};
use crate::memory_limit;
use crate::observer::{Observer, Started};
use crate::output::{
    Disk, LimitsInForce, Manifest, MeshHash, ObjectiveResult, OlderRun, RunDirectory, RunResult, RunStatus,
    StopReason, peak_memory_bytes, resume_command, surface_files,
};
use crate::problem::{Problem, Want};
use crate::rounds::RoundEvent;
use crate::setup::blame::placed;
use crate::setup::{Purpose, Setup, set_up_watched};
use crate::stage::Stage;
use pieces::SharedPieces;
use recorder::{DirectoryRecorder, write_collection, write_field};
pub(crate) use resume::configuration;
pub use resume::{Limits, SavedRun, resume};
use summary::{constraints, linear_solver, terms};

/// What a session is told beside the configuration.
#[derive(Clone, Copy)]
pub struct Options<'a> {
    /// Where run directories are.
    pub disk: &'a Arc<dyn Disk>,
    /// What happens to an earlier run in the output directory.
    pub older_run: OlderRun,
    /// Threads in use, for the manifest.
    pub threads: usize,
    /// The ranks among which the work is shared out; `None` for one process.
    pub team: Option<&'a Team>,
    /// Whether the user wants to stop; asked after the set-up and before each evaluation.
    pub interrupted: &'a dyn Fn() -> bool,
}

/// Optimises and writes everything into the run directory.
///
/// # Errors
/// Faults of the configuration before anything is written; afterwards whatever fails, with the manifest completed.
pub fn run(
    config: &Config,
    source: &SourceMap,
    options: Options<'_>,
    observer: &mut dyn Observer,
) -> Result<RunResult, Error> {
    let clock = Instant::now();
    observer.phase("setting up mesh and matrices");
    let told = &mut |stage| observer.stage(stage);
    let mut setup = set_up_watched(config, source, Purpose::Optimisation, options.team, told)?;
    memory_limit::check_problem(of_evaluation(&setup.problem), source, options.older_run)?;
    Error::unless(options.interrupted)?;
    // A first design that the mesh cannot reach is refused before an earlier run is replaced.
    let initial = setup.problem.shape.as_ref().map(|shape| shape.initial.clone()).unwrap_or_default();
    let approach = setup.problem.approach(&initial, options.interrupted);
    let approach = approach.map_err(|error| unreached(error, config, source))?;
    let session = Session::open("run", config, source, options, (setup, clock), observer)?;
    session.conclude(observer, |session, observer| {
        let directory = session.directory.clone();
        let names = constraint_names(&session.setup.problem);
        let pieces = session.pieces();
        let recorder =
            DirectoryRecorder::create(&directory, session.identity(), &names, config.output.fields)?
                .written_by(pieces);
        session.optimise(&approach, recorder, options.interrupted, observer)
    })
}

/// What a rank does that is not the first, whatever the first one is told: it sets the same problem up, and follows orders
/// until the first one ends. A set-up that fails here and not there is told the first one with its first order.
///
/// # Panics
/// At the first rank.
pub fn follow(team: &Team, config: &Config, source: &SourceMap, purpose: Purpose) {
    assert_eq!(team.member(), Member::Follower, "the first rank leads");
    let setup = set_up_watched(config, source, purpose, Some(team), &mut |_| ());
    let directory = config.output.directory.clone();
    let _pieces = setup.as_ref().ok().and_then(|setup| SharedPieces::of(&setup.problem, directory));
    team.follow(setup.as_ref().map(|_| ()).map_err(ToString::to_string));
}

/// Analyses one design and writes its field and result.
///
/// # Errors
/// As [`run`].
pub fn solve(
    config: &Config,
    source: &SourceMap,
    design: Option<Vec<f64>>,
    options: Options<'_>,
    observer: &mut dyn Observer,
) -> Result<RunResult, Error> {
    let clock = Instant::now();
    observer.phase("setting up mesh and matrices");
    let told = &mut |stage| observer.stage(stage);
    let mut setup = set_up_watched(config, source, Purpose::Analysis, options.team, told)?;
    memory_limit::check_problem(of_evaluation(&setup.problem), source, options.older_run)?;
    Error::unless(options.interrupted)?;
    let values = match (&setup.problem.shape, design) {
        (Some(shape), given) => {
            let values = given.unwrap_or_else(|| shape.initial.clone());
            let outside = |k: usize| values[k] < shape.lower[k] || values[k] > shape.upper[k];
            if let Some(k) = (0..values.len()).find(|&k| outside(k)) {
                observer.warning(&format!(
                    "design variable {k} = {} mm lies outside its bounds",
                    values[k] * 1e3
                ));
            }
            Some(values)
        }
        (None, _) => None,
    };
    // A design that breaks the mesh is refused before an earlier run is replaced.
    let p = values.as_deref().unwrap_or_default();
    let approach = setup.problem.approach(p, options.interrupted)?;
    let moved = setup.problem.moved(p)?;
    let session = Session::open("solve", config, source, options, (setup, clock), observer)?;
    session.conclude(observer, |session, observer| {
        let problem = &session.setup.problem;
        approach.iter().for_each(|event| observer.round(event));
        observer.phase("solving the field");
        let p = values.as_deref().unwrap_or_default();
        let told = &mut |stage| observer.stage(stage);
        let analysis = problem.analyse_watched(&mut Memory::default(), p, moved, Want::Gradient, told)?;
        observer.stage(Stage::Writing);
        for event in &analysis.solver_events {
            observer.notice(&event.to_string());
        }
        let bounds = problem.bounds(p, &analysis)?;
        if config.output.fields != FieldsKept::Nothing {
            write_field(&session.directory, session.pieces().as_ref(), 0, problem, &analysis)?;
            write_collection(&session.directory, &[0])?;
        }
        exports::write(config, &session.directory, &analysis.mesh, observer)?;
        let value = analysis.objective;
        let initial_quality = problem.quality(&problem.original).worst;
        Ok(RunResult {
            evaluations: 1,
            objective: value.map(|value| ObjectiveResult {
                initial: value,
                best: value,
                ratio: 1.0,
                best_evaluation: 0,
                verified_ratio: None,
                verification: None,
                terms: terms(problem, &analysis),
            }),
            constraints: constraints(problem, &analysis, &bounds),
            rounds: approach.clone(),
            ..session.result(
                StopReason::Done,
                &analysis,
                values.as_deref(),
                initial_quality,
                &analysis.timings,
                observer,
            )?
        })
    })
}

/// A run directory with its manifest, and the problem.
struct Session<'a> {
    command: &'static str,
    config: &'a Config,
    source: &'a SourceMap,
    setup: Setup,
    directory: RunDirectory,
    manifest: Manifest,
    clock: Instant,
    setup_seconds: f64,
}

impl<'a> Session<'a> {
    /// Takes the output directory, and writes the manifest.
    fn open(
        command: &'static str,
        config: &'a Config,
        source: &'a SourceMap,
        options: Options<'_>,
        (setup, clock): (Setup, Instant),
        observer: &mut dyn Observer,
    ) -> Result<Self, Error> {
        let setup_seconds = clock.elapsed().as_secs_f64();
        let directory = RunDirectory::create(options.disk, &config.output.directory, options.older_run)?;
        let mut manifest = Manifest::started(command, options.threads).reading(source);
        manifest.mesh = Some(mesh_hash(config, &setup.full_mesh));
        manifest.ranks = options.team.map(Team::size);
        manifest.surfaces = surface_files(&config.output.stl);
        manifest.limits = (command == "run").then(|| LimitsInForce::of(&config.optimizer));
        manifest.write(&directory)?;
        let session = Self { command, config, source, setup, directory, manifest, clock, setup_seconds };
        session.announce(observer);
        Ok(session)
    }

    /// Tells what is set up.
    fn announce(&self, observer: &mut dyn Observer) {
        let Self { command, config, setup, directory, .. } = self;
        let mesh = setup.problem.original.topology();
        observer.started(&Started {
            title: &config.title,
            optimizer: (*command == "run").then_some(&config.optimizer),
            objective: config.objective.as_ref(),
            variables: setup.problem.shape.as_ref().map_or(0, |s| s.surface.variable_count()),
            nodes: mesh.node_count(),
            tets: mesh.tets().len(),
            unknowns: setup.problem.states.iter().map(|model| model.unknown_count()).sum(),
            directory: Some(directory.path()),
        });
        for warning in &setup.warnings {
            observer.warning(warning);
        }
    }

    /// What all ranks write fields with; `None` for one process.
    fn pieces(&self) -> Option<SharedPieces> {
        SharedPieces::of(&self.setup.problem, self.directory.path().to_owned())
    }

    /// What the journal of this run belongs to.
    fn identity(&self) -> Identity {
        let Problem { shape, constraints, .. } = &self.setup.problem;
        let variables = shape.as_ref().map_or(0, |shape| shape.surface.variable_count());
        Identity::new(self.config, &self.setup.full_mesh, variables, constraints.len())
    }

    /// Optimises, and writes what the best design leaves.
    fn optimise(
        &mut self,
        approach: &[RoundEvent],
        mut recorder: DirectoryRecorder<'_>,
        interrupted: &dyn Fn() -> bool,
        observer: &mut dyn Observer,
    ) -> Result<RunResult, Error> {
        let config = self.config;
        approach.iter().for_each(|event| observer.round(event));
        let problem = &mut self.setup.problem;
        let optimised = driver::optimise(problem, &config.optimizer, observer, &mut recorder, interrupted)?;
        let best = &optimised.best;
        if config.output.fields == FieldsKept::FirstLast {
            recorder.write(best.evaluation, problem, &best.analysis)?;
        }
        exports::write(config, &self.directory, &best.analysis.mesh, observer)?;
        let problem = &self.setup.problem;
        let result = RunResult {
            evaluations: optimised.evaluations,
            iterations: optimised.iterations,
            objective: Some(ObjectiveResult {
                initial: optimised.initial,
                best: best.objective,
                ratio: best.objective / optimised.initial,
                best_evaluation: best.evaluation,
                verified_ratio: None,
                verification: None,
                terms: terms(problem, &best.analysis),
            }),
            constraints: constraints(problem, &best.analysis, &optimised.bounds),
            rounds: approach.iter().chain(&optimised.rounds).cloned().collect(),
            linear_solver: linear_solver(problem, optimised.worst_residual, best.analysis.linear_iterations),
            ..self.result(
                optimised.stop_reason,
                &best.analysis,
                Some(&best.values),
                optimised.initial_quality,
                &optimised.timings,
                observer,
            )?
        };
        let shapes = Shapes::of(config, &self.setup, &best.values)?;
        drop(optimised);
        // The ranks' part of the problem goes with it.
        drop(recorder);
        self.verified(result, &shapes, interrupted, observer)
    }

    /// Does the work, writes the result, and completes the manifest whatever happens, be it a panic.
    fn conclude(
        mut self,
        observer: &mut dyn Observer,
        work: impl FnOnce(&mut Self, &mut dyn Observer) -> Result<RunResult, Error>,
    ) -> Result<RunResult, Error> {
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            self.write_configuration()?;
            let result = work(&mut self, observer).map_err(|error| match error {
                Error::Constraint { .. } | Error::FirstDesign { .. } => {
                    placed(error, self.config, self.source)
                }
                other => other,
            })?;
            finite::result(&result)?;
            result.write(&self.directory)?;
            Ok::<RunResult, Error>(result)
        }));
        let status = match &outcome {
            Ok(Ok(result)) => result.status,
            Ok(Err(Error::InterruptedRun)) => RunStatus::Interrupted,
            _ => RunStatus::Failed,
        };
        self.manifest.complete(status, self.clock.elapsed().as_secs_f64());
        let completed = self.manifest.write(&self.directory);
        let outcome = outcome.unwrap_or_else(|panic| resume_unwind(panic));
        if let Err(error) = &outcome
            && self.command == "run"
            && error.leaves_a_run()
            && self.directory.holds_configuration()
        {
            let command = resume_command(self.directory.path());
            observer.warning(&format!("what was computed is kept: go on with `{command}`"));
        }
        let result = outcome?;
        completed?;
        observer.finished(&result);
        Ok(result)
    }

    fn write_configuration(&self) -> Result<(), Error> {
        self.directory.write(&self.directory.config(), self.source.text().as_bytes())?;
        Ok(self.directory.write(&self.directory.resolved(), resolved_toml(self.config).as_bytes())?)
    }

    /// The result with the gain checked on a fresh mesh; the run's own problem is gone then.
    ///
    /// # Errors
    /// When the result cannot be written.
    fn verified(
        &mut self,
        mut result: RunResult,
        shapes: &Shapes,
        interrupted: &dyn Fn() -> bool,
        observer: &mut dyn Observer,
    ) -> Result<RunResult, Error> {
        // The check may need more memory or patience than there is: what the run has found is safe before.
        finite::result(&result)?;
        result.write(&self.directory)?;
        let memory = of_fresh_mesh(self.config, &self.setup.problem).unwrap_or(0);
        (self.setup.problem.states, self.setup.problem.shape) = (Vec::new(), None);
        let clock = Instant::now();
        let (config, source) = (self.config, self.source);
        let gain = Gain { config, source, stop_reason: result.stop_reason, shapes, memory };
        if let Some(objective) = &mut result.objective
            && gain.verify(objective, interrupted, observer) == Check::CutShort
        {
            // It can be made up for: the search is whole, the run is not.
            result.status = RunStatus::Interrupted;
        }
        let seconds = clock.elapsed().as_secs_f64();
        result.timings_s.insert("verification".to_owned(), seconds);
        result.timings_s.insert("total".to_owned(), self.clock.elapsed().as_secs_f64());
        result.peak_memory_bytes = peak_memory_bytes();
        Ok(result)
    }
}

/// A first design that the mesh cannot reach is a fault of the configuration.
fn unreached(error: Error, config: &Config, source: &SourceMap) -> Error {
    match error {
        Error::DesignUnreached { .. } => placed(error, config, source),
        other => other,
    }
}

/// Names of the constraints in their order.
fn constraint_names(problem: &Problem) -> Vec<&str> {
    problem.constraints.iter().map(|constraint| constraint.name.as_str()).collect()
}

/// Origin and content hash of the mesh with all its regions.
pub(crate) fn mesh_hash(config: &Config, mesh: &Mesh) -> MeshHash {
    let origin = match &config.mesh {
        MeshConfig::Shield(_) => "shield".to_owned(),
        MeshConfig::Block(_) => "block".to_owned(),
        MeshConfig::Boxes(_) => "boxes".to_owned(),
        MeshConfig::Sphere(_) => "sphere".to_owned(),
        MeshConfig::File { path, .. } => path.display().to_string(),
    };
    let topology = mesh.topology();
    let hash = blake3::Hash::from_bytes(journal::mesh_hash(mesh)).to_hex().to_string();
    MeshHash { origin, blake3: hash, nodes: topology.node_count(), tets: topology.tets().len() }
}
