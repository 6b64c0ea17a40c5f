//! One call of `morph` with its run directory.
//!
//! Every case is set up before anything is written, so that a fault in the last does not cost the first. The files of a
//! case are written when it is done, the report at the end, whatever became of the cases.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use fluxmorph_geometry::io::{ArrayData, Field, vtu_bytes_at};
use fluxmorph_geometry::quality::quality;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_remesh::{ElasticMap, RemeshSetup, SolverChoice};
use serde::Serialize;

use super::tune::{Found, nothing_to_search, tune};
use super::{CaseReport, MorphReport, MovedMesh, Parameters, csv, move_mesh};
use crate::build::{MotionSetup, set_up_motion};
use crate::config::{Config, Morph, MotionLaw, Paper, SourceMap, resolved_toml};
use crate::error::Error;
use crate::files::{Manifest, RunDirectory, RunStatus, StopReason, peak_memory_bytes, to_json};
use crate::run::{Options, mesh_hash};
use crate::show::RunObserver;

/// One motion to run.
struct Job<'a> {
    name: &'a str,
    config: &'a Config,
    source: &'a SourceMap,
    morph: &'a Morph,
    paper: Option<Paper>,
    setup: MotionSetup,
}

/// Runs the motions of a configuration, or tunes its elastic parameters, and writes the run directory.
///
/// Whether the user wants to stop is asked before each motion and each evaluation of the tuner but the first: what is done
/// by then is written. A case of a sweep that cannot be computed is a row with its error.
///
/// # Errors
/// Faults of the configuration and of the elastic bodies before anything is written; afterwards what a single motion
/// refuses, and files that cannot be written, with the manifest completed.
pub fn morph(
    config: &Config,
    source: &SourceMap,
    parameters: Parameters,
    options: Options<'_>,
    observer: &mut dyn RunObserver,
) -> Result<MorphReport, Error> {
    let clock = Instant::now();
    observer.phase("setting up the motion");
    let jobs = jobs(config, source, parameters)?;
    // An earlier run is replaced only by one that can begin.
    jobs.iter().try_for_each(|job| check_body(&job.setup))?;
    warn(config, parameters, &jobs, observer);
    let mut manifest = Manifest::new("morph", options.threads).reading(source)?;
    let directory =
        RunDirectory::create_flat(options.disk, &config.output.directory, options.overwrite_policy)?;
    manifest.mesh = jobs.first().map(|job| mesh_hash(job.config, &job.setup.mesh));
    manifest.write(&directory)?;
    let session = Session { config, source, parameters, jobs, directory, options, clock };
    let outcome = session.work(observer);
    let status = outcome.as_ref().map_or(RunStatus::Failed, |report| report.status);
    manifest.complete(status, clock.elapsed().as_secs_f64());
    let completed = manifest.write(&session.directory);
    let outcome = outcome?;
    completed?;
    Ok(outcome)
}

/// Whether the elastic body can be set up, found by its cheapest solver and without its force: factors by component take a
/// tenth of the work of one factor. What only the whole matrix shows comes later.
fn check_body(setup: &MotionSetup) -> Result<(), Error> {
    let mut remesh = RemeshSetup { solver: SolverChoice::ComponentBlocks, ..setup.remesh.clone() };
    remesh.subregions.iter_mut().for_each(|subregion| subregion.force = [0.0; 3]);
    ElasticMap::new(&setup.mesh, remesh)?;
    Ok(())
}

/// Says what the user should know before the work, each thing once.
fn warn(config: &Config, parameters: Parameters, jobs: &[Job<'_>], observer: &mut dyn RunObserver) {
    let warnings: BTreeSet<&String> = jobs.iter().flat_map(|job| &job.setup.warnings).collect();
    warnings.into_iter().for_each(|warning| observer.warning(warning));
    if parameters == Parameters::Given {
        return;
    }
    if config.morph.as_ref().is_some_and(|morph| !morph.cases.is_empty()) {
        observer.warning("the tuner takes the motion outside of the cases; the cases are left out");
    }
    jobs.iter()
        .filter_map(|job| nothing_to_search(&job.morph.tune, &job.setup))
        .for_each(|warning| observer.warning(warning));
}

/// A motion that was set up and not run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MotionSummary {
    /// Name of the case, or the title of the configuration.
    pub name: String,
    /// Nodes whose motion is prescribed.
    pub moved_nodes: usize,
    /// Largest displacement [m].
    pub largest_displacement_m: f64,
    /// Elements of the elastic body.
    pub elements: usize,
    /// Number of equations of the elastic body.
    pub equations: usize,
}

/// The motions of a configuration, none without [morph].
///
/// # Errors
/// Faults of the configuration, and whatever the elastic map refuses.
pub fn inspect(config: &Config, source: &SourceMap) -> Result<Vec<MotionSummary>, Error> {
    if config.morph.is_none() {
        return Ok(Vec::new());
    }
    let summary = |job: Job<'_>| {
        let map = ElasticMap::new(&job.setup.mesh, job.setup.remesh)?;
        Ok(MotionSummary {
            name: job.name.to_owned(),
            moved_nodes: job.setup.path.nodes().len(),
            largest_displacement_m: job.setup.path.largest(),
            elements: map.elements().len(),
            equations: map.equation_count(),
        })
    };
    jobs(config, source, Parameters::Given)?.into_iter().map(summary).collect()
}

/// Every case, set up; the tuner has one: the configuration itself.
fn jobs<'a>(
    config: &'a Config,
    source: &'a SourceMap,
    parameters: Parameters,
) -> Result<Vec<Job<'a>>, Error> {
    let own = config.morphing(source)?.morph;
    if parameters == Parameters::Tuned && own.motion.is_empty() {
        let fault = source
            .diagnostic(
                "morph",
                "there is no [[morph.motion]] outside of the cases: what to tune for is not clear",
            )
            .help("move the motion of one case to [[morph.motion]]");
        return Err(source.error(vec![fault]).into());
    }
    let law = config.remesh.as_ref().and_then(|remesh| remesh.law);
    if parameters == Parameters::Tuned && law.is_some_and(|law| law != MotionLaw::Linear) {
        let message = "`remesh.law` is another than the tuner searches the parameters of";
        let fault =
            source.diagnostic("remesh.law", message).expected("\"linear\", or `morph` without --tune");
        return Err(source.error(vec![fault]).into());
    }
    if own.cases.is_empty() || parameters == Parameters::Tuned {
        let setup = set_up_motion(config, source)?;
        let name = if own.cases.is_empty() { config.title.as_str() } else { "without cases" };
        return Ok(vec![Job { name, config, source, morph: own, paper: None, setup }]);
    }
    let job = |(index, case): (usize, &'a crate::config::Case)| {
        let source = source.case(index);
        let config = case.config.as_deref().unwrap_or(config);
        let morph = config.morphing(source)?.morph;
        let setup = set_up_motion(config, source)?;
        Ok(Job { name: &case.name, config, source, morph, paper: case.paper, setup })
    };
    own.cases.iter().enumerate().map(job).collect()
}

/// A run directory that is open, and the motions to run.
struct Session<'a> {
    config: &'a Config,
    source: &'a SourceMap,
    parameters: Parameters,
    jobs: Vec<Job<'a>>,
    directory: RunDirectory,
    options: Options<'a>,
    clock: Instant,
}

impl Session<'_> {
    fn work(&self, observer: &mut dyn RunObserver) -> Result<MorphReport, Error> {
        let directory = &self.directory;
        directory.write(&directory.config(), self.source.text().as_bytes())?;
        directory.write(&directory.resolved(), resolved_toml(self.config).as_bytes())?;
        let tuned = self.tune(observer)?;
        let mut cases = Vec::new();
        for (index, job) in self.jobs.iter().enumerate() {
            let first = index == 0 && tuned.is_none();
            let left_out = tuned.as_ref().is_some_and(|found| !found.left_out.is_empty());
            if left_out || (!first && (self.options.interrupted)()) {
                break;
            }
            observer.phase(&format!("{} ({} of {})", job.name, index + 1, self.jobs.len()));
            let (setup, morph) = match &tuned {
                Some(found) => (&found.setup, found.config.morph.as_ref().unwrap_or(job.morph)),
                None => (&job.setup, job.morph),
            };
            let moved = self.run_motion(index, setup);
            let case = match moved {
                Ok(motion) => CaseReport::with_result(job.name, setup, &motion, morph.least_quality),
                // The others of a sweep are worth having; without files there is no place for them.
                Err(error) if self.jobs.len() > 1 && !matches!(error, Error::Output(_)) => {
                    observer.warning(&format!("{}: {error}; the other cases are not affected", job.name));
                    CaseReport::failed(job.name, setup, &error)
                }
                Err(error) => return Err(error),
            };
            cases.push(case.with_paper(job.paper));
        }
        let left_out = self.left_out(&cases, tuned.as_ref());
        let mut report = MorphReport {
            tuned: tuned.map(|found| found.report),
            timings_s: BTreeMap::from([("total".to_owned(), self.clock.elapsed().as_secs_f64())]),
            peak_memory_bytes: peak_memory_bytes(),
            ..MorphReport::of(cases)
        };
        if left_out.is_some() {
            (report.status, report.stop_reason) = (RunStatus::Interrupted, StopReason::Interrupted);
        }
        directory.write(&directory.morph_csv(), csv(&report).as_bytes())?;
        directory.write(&directory.result(), &to_json(&report))?;
        if let Some(left_out) = left_out {
            observer.warning(&format!("interrupted, and left out: {left_out}"));
        }
        Ok(report)
    }

    /// Runs the tuner, if it is asked for, and writes what it finds.
    fn tune(&self, observer: &mut dyn RunObserver) -> Result<Option<Found>, Error> {
        let (Parameters::Tuned, [job]) = (self.parameters, self.jobs.as_slice()) else { return Ok(None) };
        let found = tune(job.config, job.source, &job.setup, self.options.interrupted, observer)?;
        self.directory.write(&self.directory.tuned(), resolved_toml(&found.config).as_bytes())?;
        Ok(Some(found))
    }

    /// Runs one motion and writes both meshes.
    fn run_motion(&self, index: usize, setup: &MotionSetup) -> Result<MovedMesh, Error> {
        let number = (self.jobs.len() > 1).then_some(index);
        let moved = move_mesh(setup)?;
        self.directory.write(&self.directory.before(number), &vtu(&moved, &moved.before)?)?;
        self.directory.write(&self.directory.after(number), &vtu(&moved, &moved.after)?)?;
        Ok(moved)
    }

    /// What a signal left out, in words.
    fn left_out(&self, cases: &[CaseReport], tuned: Option<&Found>) -> Option<String> {
        let mut parts = Vec::new();
        if let Some(found) = tuned.filter(|found| !found.left_out.is_empty()) {
            parts.push(format!("the search with the stiffness {}", found.left_out.join(", ")));
        }
        let jobs = &self.jobs[cases.len()..];
        if tuned.is_some() && !jobs.is_empty() {
            parts.push("the motion with what was found".to_owned());
        } else if !jobs.is_empty() {
            let names: Vec<&str> = jobs.iter().map(|job| job.name).collect();
            parts.push(format!("{} of {} cases: {}", names.len(), self.jobs.len(), names.join("; ")));
        }
        (!parts.is_empty()).then(|| parts.join("; "))
    }
}

/// The mesh with its nodes at `points`, with the displacement of the whole motion, region and quality.
fn vtu(motion: &MovedMesh, points: &[Point]) -> Result<Vec<u8>, Error> {
    let topology = &motion.topology;
    let region: Vec<i32> = topology.region_of().iter().map(|r| r.0 as i32).collect();
    let qualities: Vec<f64> =
        topology.tets().iter().map(|tet| quality(tet.map(|n| points[n.index()]))).collect();
    let mut in_body = vec![0; topology.tets().len()];
    motion.body.iter().for_each(|e| in_body[e.index()] = 1);
    Ok(vtu_bytes_at(
        topology,
        points,
        &[Field { name: "displacement", data: ArrayData::Vector(&motion.displacement) }],
        &[
            Field { name: "region", data: ArrayData::Integer(&region) },
            Field { name: "quality", data: ArrayData::Scalar(&qualities) },
            Field { name: "elastic_body", data: ArrayData::Integer(&in_body) },
        ],
    )?)
}
