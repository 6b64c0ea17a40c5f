//! One run or one analysis with its directory: what the commands `run` and `solve` do, without a terminal.
//!
//! The manifest is written first and completed last; history and fields are written as evaluations come; `result.json`
//! when all is done. A run that fails leaves a manifest that says so, and every file under its final name is whole.

use std::collections::BTreeMap;
use std::time::Instant;

use fluxmorph_geometry::io::pvd_text;
use fluxmorph_geometry::locate::{Located, locate};
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{Mesh, RegionId};
use fluxmorph_solver::{SolverError, recovery};

use crate::config::{Config, FieldsKept, MeshConfig, Source, resolved_toml};
use crate::constraint::{Bound, Constraint};
use crate::driver::{self, Recorder};
use crate::error::Error;
use crate::exports;
use crate::fields;
use crate::fresh_mesh::{Gain, Shapes};
use crate::objective::Term;
use crate::observer::{Evaluation, Observer, Started};
use crate::output::{
    ConstraintResult, DesignResult, History, LinearSolverResult, Manifest, MeshHash, MeshResult,
    ObjectiveResult, OlderRun, ProbeResult, RunDirectory, RunResult, RunStatus, StateResult, StopReason,
    TermResult, blake3_hex, peak_memory_bytes, surface_files, write_atomic,
};
use crate::problem::{Analysis, Measured, Problem, Timings, Want};
use crate::setup::{Purpose, Setup, set_up};

/// What a session is told beside the configuration.
#[derive(Clone, Copy)]
pub struct Options<'a> {
    /// What happens to an earlier run in the output directory.
    pub older_run: OlderRun,
    /// Threads in use, for the manifest.
    pub threads: usize,
    /// Whether the user wants to stop; asked before each evaluation but the first.
    pub interrupted: &'a dyn Fn() -> bool,
}

/// Optimises and writes everything into the run directory.
///
/// # Errors
/// Faults of the configuration before anything is written; afterwards whatever fails, with the manifest completed.
pub fn run(
    config: &Config,
    source: &Source,
    options: Options<'_>,
    observer: &mut dyn Observer,
) -> Result<RunResult, Error> {
    let clock = Instant::now();
    observer.phase("setting up mesh and matrices");
    let mut setup = set_up(config, source, Purpose::Optimisation)?;
    // A first design that the mesh cannot reach is refused before an earlier run is replaced.
    let initial = setup.problem.shape.as_ref().map(|shape| shape.initial.clone()).unwrap_or_default();
    let approach = setup.problem.approach(&initial).map_err(|error| unreached(error, source))?;
    let session = Session::open("run", config, source, options, (setup, clock), observer)?;
    session.conclude(observer, |session, observer| {
        approach.iter().for_each(|event| observer.round(event));
        let mut recorder = DirectoryRecorder {
            directory: &session.directory,
            history: History::create(&session.directory, &constraint_names(&session.setup.problem))?,
            kept: config.output.fields,
            written: Vec::new(),
        };
        let problem = &mut session.setup.problem;
        let optimised =
            driver::optimise(problem, &config.optimizer, observer, &mut recorder, options.interrupted)?;
        let best = &optimised.best;
        if config.output.fields == FieldsKept::FirstLast {
            recorder.write(best.evaluation, problem, &best.analysis)?;
        }
        exports::write(config, &session.directory, &best.analysis.mesh, observer)?;
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
            linear_solver: linear_solver(problem, optimised.worst_residual),
            ..session.result(
                optimised.stop_reason,
                &best.analysis,
                Some(&best.values),
                optimised.initial_quality,
                &optimised.timings,
                observer,
            )?
        };
        let shapes = Shapes::of(config, &session.setup, &best.values)?;
        drop(optimised);
        session.verified(result, &shapes, options.interrupted, observer)
    })
}

/// Analyses one design and writes its field and result.
///
/// # Errors
/// As [`run`].
pub fn solve(
    config: &Config,
    source: &Source,
    design: Option<Vec<f64>>,
    options: Options<'_>,
    observer: &mut dyn Observer,
) -> Result<RunResult, Error> {
    let clock = Instant::now();
    observer.phase("setting up mesh and matrices");
    let mut setup = set_up(config, source, Purpose::Analysis)?;
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
    let approach = setup.problem.approach(p)?;
    let moved = setup.problem.moved(p)?;
    let session = Session::open("solve", config, source, options, (setup, clock), observer)?;
    session.conclude(observer, |session, observer| {
        let problem = &session.setup.problem;
        approach.iter().for_each(|event| observer.round(event));
        observer.phase("solving the field");
        let p = values.as_deref().unwrap_or_default();
        let analysis = problem.analyse(p, moved, Want::Gradient)?;
        for event in &analysis.solver_events {
            observer.notice(&event.to_string());
        }
        let bounds = problem.bounds(p, &analysis)?;
        if config.output.fields != FieldsKept::Nothing {
            write_field(&session.directory, 0, problem, &analysis)?;
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
    source: &'a Source,
    setup: Setup,
    directory: RunDirectory,
    manifest: Manifest,
    clock: Instant,
    setup_seconds: f64,
}

impl<'a> Session<'a> {
    fn open(
        command: &'static str,
        config: &'a Config,
        source: &'a Source,
        options: Options<'_>,
        (setup, clock): (Setup, Instant),
        observer: &mut dyn Observer,
    ) -> Result<Self, Error> {
        let setup_seconds = clock.elapsed().as_secs_f64();
        let directory = RunDirectory::create(&config.output.directory, options.older_run)?;
        let mut manifest = Manifest::started(command, options.threads).reading(source);
        manifest.mesh = Some(mesh_hash(config, &setup.full_mesh));
        manifest.surfaces = surface_files(&config.output.stl);
        manifest.write(&directory)?;

        let mesh = setup.problem.original.topology();
        observer.started(&Started {
            title: &config.title,
            algorithm: (command == "run").then(|| config.optimizer.algorithm.name()),
            variables: setup.problem.shape.as_ref().map_or(0, |s| s.surface.variable_count()),
            nodes: mesh.node_count(),
            tets: mesh.tets().len(),
            unknowns: setup.problem.states.iter().map(|model| model.unknown_count()).sum(),
            directory: Some(directory.path()),
        });
        for warning in &setup.warnings {
            observer.warning(warning);
        }
        Ok(Self { command, config, source, setup, directory, manifest, clock, setup_seconds })
    }

    /// Does the work, writes the result, and completes the manifest whatever happens.
    fn conclude(
        mut self,
        observer: &mut dyn Observer,
        work: impl FnOnce(&mut Self, &mut dyn Observer) -> Result<RunResult, Error>,
    ) -> Result<RunResult, Error> {
        let outcome =
            self.write_configuration().and_then(|()| work(&mut self, observer)).and_then(|result| {
                result.write(&self.directory)?;
                Ok(result)
            });
        let status = outcome.as_ref().map_or(RunStatus::Failed, |result| result.status);
        self.manifest.complete(status, self.clock.elapsed().as_secs_f64());
        let completed = self.manifest.write(&self.directory);
        let result = outcome?;
        completed?;
        observer.finished(&result);
        Ok(result)
    }

    fn write_configuration(&self) -> Result<(), Error> {
        write_atomic(&self.directory.config(), self.source.text().as_bytes())?;
        Ok(write_atomic(&self.directory.resolved(), resolved_toml(self.config).as_bytes())?)
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
        result.write(&self.directory)?;
        (self.setup.problem.states, self.setup.problem.shape) = (Vec::new(), None);
        let clock = Instant::now();
        let gain = Gain { config: self.config, source: self.source, stop_reason: result.stop_reason, shapes };
        if let Some(objective) = &mut result.objective {
            gain.verify(objective, interrupted, observer);
        }
        let seconds = clock.elapsed().as_secs_f64();
        result.timings_s.insert("verification".to_owned(), seconds);
        result.timings_s.insert("total".to_owned(), self.clock.elapsed().as_secs_f64());
        result.peak_memory_bytes = peak_memory_bytes();
        Ok(result)
    }

    /// The parts of a result that run and solve share.
    fn result(
        &self,
        stop_reason: StopReason,
        analysis: &Analysis,
        values: Option<&[f64]>,
        initial_quality: f64,
        timings: &Timings,
        observer: &mut dyn Observer,
    ) -> Result<RunResult, Error> {
        let problem = &self.setup.problem;
        let mesh = &analysis.mesh;
        let places: Vec<Point> = self.config.probes.iter().flat_map(|probe| &probe.points).copied().collect();
        let located = locate(mesh, &places);
        let states = (0..problem.states.len())
            .map(|index| self.state_result(index, analysis, &located, observer))
            .collect::<Vec<_>>();
        let StateResult { probes, losses_w, .. } = states[0].clone();
        let design = match (&problem.shape, values) {
            (Some(shape), Some(values)) => Some(DesignResult {
                values_m: values.to_vec(),
                lower_m: shape.lower.clone(),
                upper_m: shape.upper.clone(),
                points_m: shape.surface.points().to_vec(),
            }),
            _ => None,
        };
        let topology = mesh.topology();
        Ok(RunResult {
            schema_version: 1,
            command: self.command.to_owned(),
            status: stop_reason.status(),
            stop_reason,
            evaluations: 0,
            iterations: 0,
            objective: None,
            constraints: Vec::new(),
            rounds: Vec::new(),
            design,
            mesh: MeshResult {
                nodes: topology.node_count(),
                tets: topology.tets().len(),
                unknowns: problem.states.iter().map(|model| model.unknown_count()).sum(),
                worst_quality_initial: initial_quality,
                worst_quality_final: analysis.quality.worst,
            },
            frequencies_hz: self.config.analysis.frequencies().to_vec(),
            probes,
            losses_w,
            states: if states.len() > 1 { states } else { Vec::new() },
            linear_solver: linear_solver(problem, analysis.worst_residual),
            timings_s: BTreeMap::from([
                ("total".to_owned(), self.clock.elapsed().as_secs_f64()),
                ("setup".to_owned(), self.setup_seconds),
                ("remesh".to_owned(), timings.remesh),
                ("assembly".to_owned(), timings.assembly),
                ("factor".to_owned(), timings.factor),
                ("state".to_owned(), timings.state),
                ("adjoint".to_owned(), timings.adjoint),
                ("gradient".to_owned(), timings.gradient),
            ]),
            peak_memory_bytes: peak_memory_bytes(),
        })
    }

    /// Losses and probes of one state; `located` has an entry for every point of every probe.
    fn state_result(
        &self,
        index: usize,
        analysis: &Analysis,
        located: &[Option<Located>],
        observer: &mut dyn Observer,
    ) -> StateResult {
        let (model, solution) = (&self.setup.problem.states[index], &analysis.solutions[index]);
        let mesh = &analysis.mesh;
        let mut located = located.iter();
        let probes = self
            .config
            .probes
            .iter()
            .map(|probe| {
                let mut at = |&point| match located.next().copied().flatten() {
                    Some((e, _)) => Some(recovery::recovered_flux_density(solution, model, mesh, e, point)),
                    // It was inside before the mesh moved: the result of a whole run is worth more than this point.
                    None => {
                        if index == 0 {
                            let ([lower, upper], probe) = (mesh.bounding_box(), probe.name.clone());
                            let error = SolverError::ProbeOutside { probe, point, lower, upper };
                            observer.warning(&format!("{error}: its field is left out"));
                        }
                        None
                    }
                };
                let b: Vec<_> = probe.points.iter().map(&mut at).collect();
                ProbeResult {
                    name: probe.name.clone(),
                    points_m: probe.points.clone(),
                    b_re_t: b.iter().map(|b| b.map(|b| b.map(|c| c.re))).collect(),
                    b_im_t: b.iter().map(|b| b.map(|b| b.map(|c| c.im))).collect(),
                }
            })
            .collect();
        StateResult {
            frequency_hz: self.config.analysis.frequencies()[index],
            losses_w: solution.losses(model, mesh).into_iter().collect(),
            probes,
        }
    }
}

/// A first design that the mesh cannot reach is a fault of the configuration.
fn unreached(error: Error, source: &Source) -> Error {
    match error {
        Error::DesignUnreached { .. } => {
            let fault = source.fault("design.initial", error.to_string());
            source.error(vec![fault]).into()
        }
        other => other,
    }
}

/// Names of the constraints in their order.
fn constraint_names(problem: &Problem) -> Vec<&str> {
    problem.constraints.iter().map(|constraint| constraint.name.as_str()).collect()
}

/// The terms of the objective at a design.
fn terms(problem: &Problem, analysis: &Analysis) -> Vec<TermResult> {
    let terms = problem.objective.iter().flat_map(|objective| &objective.terms);
    let of = |(term, &value): (&Term, &f64)| TermResult {
        kind: term.label.kind.to_owned(),
        region: term.label.region.clone(),
        frequency: term.label.frequency,
        weight: term.weight,
        value,
    };
    terms.zip(&analysis.terms).map(of).collect()
}

/// The constraints at a design.
fn constraints(problem: &Problem, analysis: &Analysis, bounds: &[Bound]) -> Vec<ConstraintResult> {
    let of = |((constraint, measured), bound): ((&Constraint, &Measured), &Bound)| ConstraintResult {
        name: constraint.name.clone(),
        value: measured.value,
        bound: bound.value,
        satisfied: bound.is_satisfied(measured.value),
    };
    problem.constraints.iter().zip(&analysis.constraints).zip(bounds).map(of).collect()
}

/// Writes history and fields into the run directory.
struct DirectoryRecorder<'a> {
    directory: &'a RunDirectory,
    history: History,
    kept: FieldsKept,
    /// Evaluations with a field file, ascending.
    written: Vec<usize>,
}

impl DirectoryRecorder<'_> {
    fn write(&mut self, evaluation: usize, problem: &Problem, analysis: &Analysis) -> Result<(), Error> {
        if self.written.last() == Some(&evaluation) {
            return Ok(());
        }
        write_field(self.directory, evaluation, problem, analysis)?;
        self.written.push(evaluation);
        write_collection(self.directory, &self.written)
    }
}

impl Recorder for DirectoryRecorder<'_> {
    fn record(
        &mut self,
        row: &Evaluation,
        analysis: &Analysis,
        problem: &Problem,
        improved: bool,
    ) -> Result<(), Error> {
        let wanted = match self.kept {
            FieldsKept::Every => true,
            FieldsKept::Improved => improved,
            FieldsKept::FirstLast => row.evaluation == 0,
            FieldsKept::Nothing => false,
        };
        if wanted {
            self.write(row.evaluation, problem, analysis)?;
        }
        Ok(self.history.append(row)?)
    }
}

fn write_field(
    directory: &RunDirectory,
    evaluation: usize,
    problem: &Problem,
    analysis: &Analysis,
) -> Result<(), Error> {
    let bytes = fields::vtu(problem, analysis)?;
    Ok(write_atomic(&directory.field(evaluation), &bytes)?)
}

/// The PVD file over all field files; its time is the evaluation number.
fn write_collection(directory: &RunDirectory, evaluations: &[usize]) -> Result<(), Error> {
    let files: Vec<String> = evaluations.iter().map(|&e| directory.field_in_collection(e)).collect();
    let text = pvd_text(evaluations.iter().zip(&files).map(|(&e, file)| (e as f64, file.as_str())))?;
    Ok(write_atomic(&directory.collection(), text.as_bytes())?)
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
    let mut bytes = Vec::with_capacity(mesh.points().len() * 24 + topology.tets().len() * 20);
    bytes.extend(mesh.points().iter().flatten().flat_map(|c| c.to_le_bytes()));
    bytes.extend(topology.tets().iter().flatten().flat_map(|n| n.0.to_le_bytes()));
    bytes.extend(topology.region_of().iter().flat_map(|RegionId(r)| r.to_le_bytes()));
    MeshHash { origin, blake3: blake3_hex(&bytes), nodes: topology.node_count(), tets: topology.tets().len() }
}

/// How the linear systems were solved.
fn linear_solver(problem: &Problem, worst_residual: f64) -> LinearSolverResult {
    let methods = problem.states.iter().map(|model| model.linear_solver().method().name().to_owned());
    LinearSolverResult { methods: methods.collect(), worst_residual }
}
