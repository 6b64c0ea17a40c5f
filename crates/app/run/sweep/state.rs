//! What a run directory of a sweep holds, and so what is left to do.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{Planned, Sweep};
use crate::build::{LARGEST_TABLE, surface_names};
use crate::config::{Config, MeshConfig, Optimizer, SourceMap, resolved_toml};
use crate::files::{
    Disk, FileHash, Manifest, MeshHash, OutputError, RunDirectory, RunResult, RunStatus, StopReason,
    UNFINISHED, blake3_hex,
};
use crate::run;

/// How far a combination is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum State {
    /// Nothing is there.
    Missing,
    /// It was interrupted before there was anything to keep.
    Unstarted,
    /// It was interrupted, or its limits are wider now: it can be resumed.
    Resumable,
    /// It has ended, for this reason.
    Finished(StopReason),
    /// Another process is working on it.
    InUse,
    /// It is something else, and this is the difference.
    Other(String),
}

/// Looks into the run directories of a sweep.
#[derive(Debug)]
pub struct States<'a> {
    disk: &'a Arc<dyn Disk>,
    sweep: &'a Sweep,
    /// Whether a file still has the mesh or the table of a hash: looked at once for all runs that share both.
    files: BTreeMap<(PathBuf, String), bool>,
}

impl<'a> States<'a> {
    /// Nothing is read yet.
    pub fn new(disk: &'a Arc<dyn Disk>, sweep: &'a Sweep) -> Self {
        Self { disk, sweep, files: BTreeMap::new() }
    }

    /// How far the run in the directory of a combination is.
    ///
    /// # Errors
    /// When a file that is there cannot be read.
    pub fn of(&mut self, planned: &Planned) -> Result<State, OutputError> {
        let (disk, path) = (self.disk, self.sweep.run_directory(planned));
        let names = match disk.names(&path) {
            // A file in its place, or in that of the sweep, is found by whoever makes the folder.
            Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
                return Ok(State::Missing);
            }
            other => other.map_err(OutputError::io("read", &path))?,
        };
        let run = match RunDirectory::open(disk, &path) {
            Ok(run) => run,
            Err(OutputError::NoRun { .. }) if hold_nothing(&names, disk, &path) => return Ok(State::Missing),
            Err(OutputError::NoRun { .. }) => {
                return Ok(State::Other("it is no run of fluxmorph".to_owned()));
            }
            Err(error) => return Err(error),
        };
        if let Err(error) = run.refuse_older_journal() {
            return Ok(State::Other(error.to_string()));
        }
        if run.is_in_use() {
            return Ok(State::InUse);
        }
        let manifest = Manifest::read(&run)?;
        if let Some(difference) = other_command(&manifest) {
            return Ok(State::Other(difference));
        }
        if !run.holds_configuration() && !names.iter().any(|name| run.journal().ends_with(name)) {
            return Ok(State::Unstarted);
        }
        let (config, source) = match configured(&run, &manifest, planned) {
            Ok(read) => read,
            Err(difference) => return Ok(State::Other(difference)),
        };
        let other_mesh = || State::Other("its mesh file is another, or has changed since".to_owned());
        let is_here = mesh_file(&config) == planned.mesh.as_deref();
        Ok(match result(&run, &manifest).filter(|_| has_ended(&manifest)) {
            Some(result) if !may_continue(&result, self.sweep, planned) => {
                if !self.has_mesh(planned, config, &source, &manifest) {
                    other_mesh()
                } else if let Some(table) = manifest.tables.iter().find(|table| !self.has_table(table)) {
                    State::Other(format!("the B–H table `{}` has changed since", table.path))
                } else {
                    State::Finished(result.stop_reason)
                }
            }
            // Whether the file has changed is checked by the run that is resumed.
            _ if is_here => State::Resumable,
            _ => other_mesh(),
        })
    }

    /// Whether the mesh of a run that has ended is that of now.
    fn has_mesh(
        &mut self,
        planned: &Planned,
        mut config: Config,
        source: &SourceMap,
        manifest: &Manifest,
    ) -> bool {
        let (MeshConfig::File { path, .. }, Some(now), Some(MeshHash { blake3, .. })) =
            (&mut config.mesh, &planned.mesh, &manifest.mesh)
        else {
            return true;
        };
        path.clone_from(now);
        let is_that = || run::current_mesh_hash(&config, source).is_ok_and(|own| own.blake3 == *blake3);
        *self.files.entry((now.clone(), blake3.clone())).or_insert_with(is_that)
    }

    /// Whether a file still has the content that a run read.
    fn has_table(&mut self, FileHash { path, blake3 }: &FileHash) -> bool {
        let is_that = || {
            self.disk.read(Path::new(path), LARGEST_TABLE).is_ok_and(|bytes| blake3_hex(&bytes) == *blake3)
        };
        *self.files.entry((PathBuf::from(path), blake3.clone())).or_insert_with(is_that)
    }
}

/// What a directory holds that is no run.
pub(super) fn other_command(manifest: &Manifest) -> Option<String> {
    (manifest.command != "run").then(|| format!("it holds a `{}`", manifest.command))
}

/// The configuration of the run of a combination, or why it is no such run.
pub(super) fn configured(
    run: &RunDirectory,
    manifest: &Manifest,
    planned: &Planned,
) -> Result<(Config, SourceMap), String> {
    let (config, source) = run::configuration(run, manifest).map_err(|error| error.to_string())?;
    if fingerprint(&config, source.directory()) != planned.fingerprint {
        return Err("its configuration is another".to_owned());
    }
    Ok((config, source))
}

/// The content of a file that a run has read.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Input {
    /// The file, and all else that its hash depends on.
    pub(super) key: (String, String),
    /// BLAKE3, hexadecimal.
    pub(super) blake3: String,
}

/// What a run has read from files: B–H tables, and a mesh, which its manifest has with the surfaces and the shell that are made of it.
pub(super) fn inputs(config: &Config, manifest: &Manifest) -> Vec<Input> {
    let input = |file: &str, more: String, blake3: &str| Input {
        key: (file.to_owned(), more),
        blake3: blake3.to_owned(),
    };
    let mesh = manifest.mesh.as_ref().filter(|_| mesh_file(config).is_some()).map(|mesh| {
        let more = format!("{:?} {:?} {:?}", config.mesh, config.open, surface_names(config));
        input(&mesh.origin, more, &mesh.blake3)
    });
    let tables = manifest.tables.iter().map(|table| input(&table.path, String::new(), &table.blake3));
    mesh.into_iter().chain(tables).collect()
}

/// The file of a mesh that is read.
pub(super) fn mesh_file(config: &Config) -> Option<&Path> {
    match &config.mesh {
        MeshConfig::File { path, .. } => Some(path),
        _ => None,
    }
}

/// BLAKE3 of a configuration in a folder without its title, its limits, and where its files are: with others of these a run that has
/// ended is what it was.
pub(super) fn fingerprint(config: &Config, folder: &Path) -> [u8; 32] {
    let mut bare = config.clone();
    for table in bare.materials.values_mut().filter_map(|material| material.bh_file.as_mut()) {
        if let Ok(inside) = table.strip_prefix(folder) {
            *table = inside.to_owned();
        }
    }
    let Optimizer { max_evaluations, max_time, .. } = Optimizer::default();
    (bare.optimizer.max_evaluations, bare.optimizer.max_time) = (max_evaluations, max_time);
    bare.title.clear();
    bare.output.directory.clear();
    if let MeshConfig::File { path, .. } = &mut bare.mesh {
        path.clear();
    }
    *blake3::hash(resolved_toml(&bare).as_bytes()).as_bytes()
}

/// The result of a run, where it is that of the run's last end.
pub(super) fn result(run: &RunDirectory, manifest: &Manifest) -> Option<RunResult> {
    RunResult::read(run).ok().filter(|result| result.status == manifest.status)
}

fn has_ended(manifest: &Manifest) -> bool {
    matches!(manifest.status, RunStatus::Converged | RunStatus::Stopped)
}

/// Whether the limits of now are wider than those that ended a run.
fn may_continue(result: &RunResult, sweep: &Sweep, planned: &Planned) -> bool {
    match result.stop_reason {
        StopReason::MaxEvaluations => planned.limits.max_evaluations > result.evaluations,
        // More time is what the user gives, and not what the configuration says every time.
        StopReason::MaxTime => sweep.limits.max_time.is_some(),
        _ => false,
    }
}

/// Whether these names in a folder are only what the very start of a run leaves.
fn hold_nothing(names: &[String], disk: &Arc<dyn Disk>, path: &Path) -> bool {
    let is_empty = |name: &str| disk.names(&path.join(name)).is_ok_and(|names| names.is_empty());
    names.iter().all(|name| name.starts_with(UNFINISHED) || (name == "fields" && is_empty(name)))
}
