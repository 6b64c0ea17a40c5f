//! Resuming an interrupted run: its directory holds all that is needed.

use std::path::Path;
use std::sync::Arc;

use fluxmorph_geometry::parallel::RankGroup;
use fluxmorph_optimizer::Error as OptimizerError;

use super::prepared::Prepared;
use super::recorder::DirectoryRecorder;
use super::{Concluded, Options, Session, current_mesh_hash, mesh_hash, table_hashes};
use crate::build::Mode;
use crate::config::{Config, MeshConfig, SourceMap};
use crate::error::Error;
use crate::files::{
    Disk, LimitsInForce, Manifest, OutputError, Resumption, RunDirectory, RunResult, RunStatus, StopReason,
    surface_files,
};
use crate::run::journal::{Contents, Identity, Journal, Rest, changed_key, describe_meshes};
use crate::show::RunObserver;

/// Largest configuration that is read [bytes].
const LARGEST: u64 = 1 << 20;

/// Limits in place of those that the run was started with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RunLimits {
    /// Most evaluations, including those before.
    pub max_evaluations: Option<usize>,
    /// Longest time from now [s].
    pub max_time: Option<f64>,
}

/// A run as its directory holds it.
#[derive(Clone, Debug)]
pub struct SavedRun {
    directory: RunDirectory,
    manifest: Manifest,
    config: Config,
    source: SourceMap,
}

impl SavedRun {
    /// Reads manifest and configuration; nothing is written.
    ///
    /// # Errors
    /// [`Error::NotResumable`] where there is no run to resume, [`OutputError::OlderJournal`], faults of the configuration, files that cannot be read.
    pub fn open(disk: &Arc<dyn Disk>, path: &Path) -> Result<Self, Error> {
        let directory = RunDirectory::open(disk, path)?;
        let manifest = Manifest::read(&directory)?;
        if manifest.command != "run" {
            let cause = format!("it holds a `{}`, which is done in one go: start it again", manifest.command);
            return Err(not_resumable(&directory, cause));
        }
        directory.refuse_older_journal()?;
        let (mut config, source) = configuration(&directory, &manifest)?;
        config.output.directory = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        Ok(Self { directory, manifest, config, source })
    }

    /// The configuration that the run was started with.
    pub fn config(&self) -> (&Config, &SourceMap) {
        (&self.config, &self.source)
    }
}

/// Resumes an interrupted run: history, fields, journal and result are those of a run without a break, but for times.
///
/// A run that has ended by itself is left as it is, and its result returned; so is one that used up its evaluations, unless
/// `limits` allows more.
///
/// # Errors
/// [`Error::OtherRun`] where configuration, mesh or program are others, [`Error::Replay`]; before anything is written.
/// Afterwards as [`super::run`].
pub fn resume(
    saved: &SavedRun,
    limits: RunLimits,
    options: Options<'_>,
    observer: &mut dyn RunObserver,
) -> Result<RunResult, Error> {
    resume_held(saved, limits, options, observer).map(|concluded| concluded.result)
}

/// [`resume`], with the directory still held against other processes.
pub(crate) fn resume_held(
    saved: &SavedRun,
    limits: RunLimits,
    options: Options<'_>,
    observer: &mut dyn RunObserver,
) -> Result<Concluded, Error> {
    let SavedRun { directory, manifest, mut config, source } = saved.clone();
    let directory = directory.locked()?;
    manifest.check_current(&directory)?;
    let in_force = manifest.limits.unwrap_or(LimitsInForce::of(&config.optimizer));
    config.optimizer.max_evaluations = limits.max_evaluations.unwrap_or(in_force.max_evaluations);
    config.optimizer.max_time = limits.max_time.or(in_force.max_time_s);
    if let Some(result) = finished_result(&directory, &manifest, config.optimizer.max_evaluations) {
        observer.note(&format!("nothing to resume: {}", advice(&result)));
        return Ok(Concluded { result, directory, is_saved: true });
    }
    let prepared = match Prepared::new(&config, &source, Mode::Optimisation, options, observer) {
        Ok(prepared) => prepared,
        Err(Error::Optimizer(OptimizerError::Interrupted)) => {
            return Err(OptimizerError::InterruptedRun.into());
        }
        Err(error) => {
            let path = directory.journal();
            let other = describe_other_mesh(&manifest, &config, &source);
            return Err(other.map_or(error, |cause| Error::OtherRun { path, cause }));
        }
    };
    let mut session = prepared.session("run", directory.clone(), manifest);
    session.check_levels()?;
    let contents = journal(&directory, (&session.identity(), &config), observer)?;
    session.note_resumption(contents.as_ref().map_or(0, |contents| contents.records.len()), options);
    session.announce(observer);
    directory.make_fields()?;
    let (journal, records) = match contents {
        Some(contents) => (Journal::reopen(&directory, &contents)?, contents.records),
        None => {
            observer.warning("there is no journal.jsonl: all evaluations are computed anew");
            session.manifest.mesh = Some(mesh_hash(session.config, &session.setup.full_mesh));
            session.manifest.tables = table_hashes(&session.setup.tables);
            (Journal::create(&directory, session.identity())?, Vec::new())
        }
    };
    session.replayed_seconds = records.iter().map(|record| record.row.seconds).sum();
    let recorder = DirectoryRecorder::new(&session, journal, records)?;
    session.manifest.write(&directory)?;
    session.conclude(observer, |session, observer| session.optimise(recorder, observer))
}

impl Session<'_> {
    /// Adds a resumption after so many evaluations to the manifest, which is not written yet.
    fn note_resumption(&mut self, evaluations: usize, options: Options<'_>) {
        let Self { manifest, config, .. } = self;
        manifest.ranks = manifest.ranks.max(options.ranks.map(RankGroup::size));
        manifest.add_resumption(Resumption::now(
            evaluations,
            LimitsInForce::of(&config.optimizer),
            options.threads,
        ));
        for file in surface_files(&config.output.stl) {
            if !manifest.surfaces.contains(&file) {
                manifest.surfaces.push(file);
            }
        }
    }
}

/// That the mesh file is not the one that a run was started with, where it is not: what it lacks is no error of the configuration.
fn describe_other_mesh(manifest: &Manifest, config: &Config, source: &SourceMap) -> Option<String> {
    let was = manifest.mesh.as_ref().filter(|_| matches!(config.mesh, MeshConfig::File { .. }))?;
    let is = current_mesh_hash(config, source).ok()?;
    (is.blake3 != was.blake3).then(|| describe_meshes(&was.blake3, &is.blake3))
}

fn not_resumable(directory: &RunDirectory, cause: String) -> Error {
    Error::NotResumable { path: directory.path().to_owned(), cause }
}

/// The configuration that the run was started with, read again.
///
/// # Errors
/// [`Error::NotResumable`] where it is gone, faults of its text, or when it cannot be read.
pub(crate) fn configuration(
    directory: &RunDirectory,
    manifest: &Manifest,
) -> Result<(Config, SourceMap), Error> {
    let path = directory.config();
    let Some(bytes) = OutputError::unless_missing(&path, directory.disk().read(&path, LARGEST))? else {
        let cause = match Journal::read(directory) {
            Ok(None) => {
                "it was interrupted before its configuration was saved, and nothing is lost: start it again with --force"
            }
            _ => {
                "its config.toml is gone: restore it from the file that manifest.json names, and its evaluations are kept"
            }
        };
        return Err(not_resumable(directory, cause.to_owned()));
    };
    let text = String::from_utf8(bytes).map_err(OutputError::damaged(&path))?;
    let given = manifest.config.as_ref().map_or("", |config| config.path.as_str());
    let stem = Path::new(given).file_stem().map_or_else(|| "run".into(), |stem| stem.to_string_lossy());
    let folder = manifest.folder.clone().unwrap_or_default();
    Ok(Config::again(path.display().to_string(), text, folder, &stem, &manifest.overrides)?)
}

/// The result of a run that has ended and would end in the same way again.
fn finished_result(
    directory: &RunDirectory,
    manifest: &Manifest,
    max_evaluations: usize,
) -> Option<RunResult> {
    let result = RunResult::read(directory).ok()?;
    let may_continue = match result.stop_reason {
        StopReason::MaxEvaluations => max_evaluations > result.evaluations,
        StopReason::MaxTime => true,
        _ => false,
    };
    let has_ended = matches!(manifest.status, RunStatus::Converged | RunStatus::Stopped);
    (has_ended && !may_continue).then_some(result)
}

/// Why there is nothing to resume, and what can be done.
fn advice(result: &RunResult) -> String {
    let reason = result.stop_reason.describe();
    match result.stop_reason {
        StopReason::MaxEvaluations => {
            format!("{reason}; resume with --max-evaluations above {}", result.evaluations)
        }
        _ => reason.to_owned(),
    }
}

/// The journal, if it is that of this run.
fn journal(
    directory: &RunDirectory,
    (now, config): (&Identity, &Config),
    observer: &mut dyn RunObserver,
) -> Result<Option<Contents>, Error> {
    let Some(contents) = Journal::read(directory)? else { return Ok(None) };
    let path = directory.journal();
    if let Err(mut cause) = contents.identity.check(now) {
        let is_other = contents.identity.configuration != now.configuration;
        if let Some(key) = is_other.then(|| changed_key(directory, config)).flatten() {
            cause += &format!("; `{key}` is not what it was");
        }
        return Err(Error::OtherRun { path, cause });
    }
    let (count, file) = (contents.records.len(), path.display());
    let position = match count.checked_sub(1) {
        Some(last) => format!("after evaluation {last}"),
        None => "before the first evaluation".to_owned(),
    };
    match contents.rest {
        Rest::Nothing => {}
        Rest::Torn(bytes) => observer.warning(&format!(
            "`{file}`: {bytes} bytes {position} are an incomplete record, as after a loss of power; they are dropped"
        )),
        Rest::Damaged(bytes) => {
            Journal::keep_damaged(directory)?;
            observer.warning(&format!(
                "`{file}` is damaged {position}: what follows, {bytes} bytes, cannot be trusted and is computed again; the \
                 file is kept as `{}`",
                directory.damaged_journal().display()
            ));
        }
    }
    observer.note(&format!("resuming after {} evaluations of the journal", contents.records.len()));
    Ok(Some(contents))
}
