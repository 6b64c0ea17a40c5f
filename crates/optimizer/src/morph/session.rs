//! One call of `morph` with its run directory.
//!
//! Every case is set up before anything is written, so that a fault in the last does not cost the first. The files of a
//! case are written when it is done, the report at the end.

use std::collections::BTreeMap;
use std::time::Instant;

use fluxmorph_geometry::io::{ArrayData, Field, vtu_bytes_at};
use fluxmorph_geometry::quality::quality;
use fluxmorph_geometry::tet4::Point;

use fluxmorph_remesh::ElasticMap;
use serde::Serialize;

use super::tune::tune;
use super::{CaseReport, MorphReport, Parameters, Walk, csv, walk};
use crate::config::{Config, Morph, Paper, Source, resolved_toml};
use crate::error::Error;
use crate::observer::Observer;
use crate::output::{
    FileHash, Manifest, OlderRun, RunDirectory, RunStatus, StopReason, blake3_hex, peak_memory_bytes,
    to_json, write_atomic,
};
use crate::session::mesh_hash;
use crate::setup::{MotionSetup, set_up_motion};

/// One motion to be made.
struct Job<'a> {
    name: &'a str,
    config: &'a Config,
    source: &'a Source,
    morph: &'a Morph,
    paper: Option<Paper>,
    setup: MotionSetup,
}

/// Makes the motions of a configuration, or tunes its elastic parameters, and writes the run directory.
///
/// # Errors
/// Faults of the configuration before anything is written; afterwards whatever fails, with the manifest completed.
pub fn morph(
    config: &Config,
    source: &Source,
    parameters: Parameters,
    (older_run, threads): (OlderRun, usize),
    observer: &mut dyn Observer,
) -> Result<MorphReport, Error> {
    let clock = Instant::now();
    observer.phase("setting up the motion");
    let jobs = jobs(config, source, parameters)?;
    for warning in jobs.iter().flat_map(|job| &job.setup.warnings).collect::<std::collections::BTreeSet<_>>()
    {
        observer.warning(warning);
    }
    if parameters == Parameters::Tuned && config.morph.as_ref().is_some_and(|morph| !morph.cases.is_empty()) {
        observer.warning("the tuner takes the motion outside of the cases; the cases are left out");
    }
    let directory = RunDirectory::create_flat(&config.output.directory, older_run)?;
    let mut manifest = Manifest::started("morph", threads);
    manifest.config = source.documents().first().map(|document| FileHash {
        path: document.name.clone(),
        blake3: blake3_hex(document.text.as_bytes()),
    });
    manifest.overrides = source.overrides().map(str::to_owned).collect();
    manifest.mesh = jobs.first().map(|job| mesh_hash(job.config, &job.setup.mesh));
    manifest.write(&directory)?;
    let outcome = write_all(config, source, parameters, &jobs, &directory, (clock, observer));
    let status = outcome.as_ref().map_or(RunStatus::Failed, |report| report.status);
    manifest.complete(status, clock.elapsed().as_secs_f64());
    let completed = manifest.write(&directory);
    let outcome = outcome?;
    completed?;
    Ok(outcome)
}

/// A motion that was set up and not made.
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
pub fn inspected(config: &Config, source: &Source) -> Result<Vec<MotionSummary>, Error> {
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
fn jobs<'a>(config: &'a Config, source: &'a Source, parameters: Parameters) -> Result<Vec<Job<'a>>, Error> {
    let own = config.morphing(source)?.morph;
    if parameters == Parameters::Tuned && own.motion.is_empty() {
        let fault = source
            .fault(
                "morph",
                "there is no [[morph.motion]] outside of the cases: what to tune for is not clear",
            )
            .help("move the motion of one case to [[morph.motion]]");
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

fn write_all(
    config: &Config,
    source: &Source,
    parameters: Parameters,
    jobs: &[Job<'_>],
    directory: &RunDirectory,
    (clock, observer): (Instant, &mut dyn Observer),
) -> Result<MorphReport, Error> {
    write_atomic(&directory.config(), source.text().as_bytes())?;
    write_atomic(&directory.resolved(), resolved_toml(config).as_bytes())?;
    let tuned = match (parameters, jobs) {
        (Parameters::Tuned, [job]) => {
            let found = tune(job.config, job.source, &job.setup, observer)?;
            write_atomic(&directory.tuned(), resolved_toml(&found.config).as_bytes())?;
            Some(found)
        }
        _ => None,
    };
    let mut cases = Vec::new();
    for (index, job) in jobs.iter().enumerate() {
        observer.phase(&format!("{} ({} of {})", job.name, index + 1, jobs.len()));
        let number = (jobs.len() > 1).then_some(index);
        let (setup, morph) = match &tuned {
            Some(found) => (&found.setup, found.config.morph.as_ref().unwrap_or(job.morph)),
            None => (&job.setup, job.morph),
        };
        let walked = walk(setup, morph.increments, morph.least_quality, &mut |line| observer.phase(line))?;
        write_atomic(&directory.before(number), &vtu(&walked, &walked.before)?)?;
        write_atomic(&directory.after(number), &vtu(&walked, &walked.after)?)?;
        let moved = setup.path.nodes().len();
        cases.push(CaseReport::new(job.name, &walked, moved, morph.least_quality, job.paper));
    }
    let valid = cases.iter().all(|case| case.valid);
    let stop_reason = if valid { StopReason::Done } else { StopReason::MeshLimit };
    let report = MorphReport {
        schema_version: 1,
        command: "morph",
        status: stop_reason.status(),
        stop_reason,
        quality_of: "elastic body",
        cases,
        tuned: tuned.map(|found| found.report),
        timings_s: BTreeMap::from([("total".to_owned(), clock.elapsed().as_secs_f64())]),
        peak_memory_bytes: peak_memory_bytes(),
    };
    write_atomic(&directory.morph_csv(), csv(&report).as_bytes())?;
    write_atomic(&directory.result(), &to_json(&report))?;
    Ok(report)
}

/// The mesh at some places of its nodes, with the displacement of the whole motion, region and quality.
fn vtu(walk: &Walk, points: &[Point]) -> Result<Vec<u8>, Error> {
    let topology = &walk.topology;
    let region: Vec<i32> = topology.region_of().iter().map(|r| r.0 as i32).collect();
    let qualities: Vec<f64> =
        topology.tets().iter().map(|tet| quality(tet.map(|n| points[n.index()]))).collect();
    let mut in_body = vec![0; topology.tets().len()];
    walk.body.iter().for_each(|e| in_body[e.index()] = 1);
    Ok(vtu_bytes_at(
        topology,
        points,
        &[Field { name: "displacement", data: ArrayData::Vector(&walk.displacement) }],
        &[
            Field { name: "region", data: ArrayData::Integer(&region) },
            Field { name: "quality", data: ArrayData::Scalar(&qualities) },
            Field { name: "elastic_body", data: ArrayData::Integer(&in_body) },
        ],
    )?)
}
