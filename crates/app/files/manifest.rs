//! `manifest.json`: what was run, on what, and how it ended. Written first, completed last.

use std::path::PathBuf;
use std::time::SystemTime;

use fluxmorph_optimizer::driver::StopReason;
use serde::{Deserialize, Serialize};

use super::host::{hostname, utc_timestamp};
use super::json::{read_json, to_json};
use super::names::check_text;
use super::{OutputError, RunDirectory};
use crate::config::{Optimizer, SourceMap};

/// The mark by which a run directory is known as ours.
const PROGRAM: &str = "fluxmorph";

/// Largest manifest that is read [bytes]: a file of this name in a foreign folder may be anything.
const LARGEST: u64 = 1024 * 1024;

/// The manifest of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Always `fluxmorph`.
    pub program: String,
    /// Version of this file's form.
    pub schema_version: u32,
    /// Version of the program.
    pub version: String,
    /// Command of the command line.
    pub command: String,
    /// How far the run is.
    pub status: RunStatus,
    /// The configuration.
    pub config: Option<FileHash>,
    /// Folder that paths in the configuration are relative to, absolute.
    pub folder: Option<PathBuf>,
    /// Overrides of the command line, as TOML lines.
    pub overrides: Vec<String>,
    /// Limits in force, of the configuration or the command line; `None` where nothing is optimised.
    pub limits: Option<LimitsInForce>,
    /// When the run was resumed.
    #[serde(default)]
    pub resumed: Vec<Resumption>,
    /// The mesh.
    pub mesh: Option<MeshHash>,
    /// The B–H tables that were read from files.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tables: Vec<FileHash>,
    /// Names of the STL files in the directory.
    #[serde(default)]
    pub surfaces: Vec<String>,
    /// The machine.
    pub host: Host,
    /// Threads used, of every rank.
    pub threads: usize,
    /// The most ranks that the work was shared out among; absent for one process.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ranks: Option<usize>,
    /// Start, UTC.
    pub started: String,
    /// End, UTC.
    pub finished: Option<String>,
    /// Time from start to end [s].
    pub seconds: Option<f64>,
}

/// How far a run is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunStatus {
    /// Started, and not ended in order yet.
    Running,
    /// Reached what it was for.
    Converged,
    /// A single analysis is complete.
    Done,
    /// Stopped at a limit; the results are valid.
    Stopped,
    /// Stopped by a signal.
    Interrupted,
    /// Broken off by an error.
    Failed,
}

impl From<StopReason> for RunStatus {
    fn from(reason: StopReason) -> Self {
        match reason {
            StopReason::ObjectiveConverged | StopReason::StepConverged => Self::Converged,
            StopReason::NumericalFailure => Self::Failed,
            StopReason::Interrupted => Self::Interrupted,
            StopReason::Done => Self::Done,
            _ => Self::Stopped,
        }
    }
}

/// A file and its content.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileHash {
    /// The path as given.
    pub path: String,
    /// BLAKE3 of the bytes, hexadecimal.
    pub blake3: String,
}

/// The mesh of a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct MeshHash {
    /// The path of its file, or the name of its generator.
    pub origin: String,
    /// BLAKE3 of the file, or of the generated points and tetrahedra; hexadecimal.
    pub blake3: String,
    /// Nodes.
    pub nodes: usize,
    /// Tetrahedra.
    pub tets: usize,
}

/// When an optimisation stops at the latest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LimitsInForce {
    /// Most evaluations.
    pub max_evaluations: usize,
    /// Longest time [s], from the start or the last resumption.
    pub max_time_s: Option<f64>,
}

impl LimitsInForce {
    /// Those of a configuration, with what the command line put in their place.
    pub fn of(optimizer: &Optimizer) -> Self {
        Self { max_evaluations: optimizer.max_evaluations, max_time_s: optimizer.max_time }
    }
}

/// How a run was resumed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Resumption {
    /// When, UTC.
    pub at: String,
    /// Evaluations in the journal then.
    pub evaluations: usize,
    /// Limits in force since then.
    pub limits: LimitsInForce,
    /// Threads used since then.
    pub threads: usize,
    /// The machine.
    pub host: Host,
}

impl Resumption {
    /// A resumption now, on this machine.
    pub fn now(evaluations: usize, limits: LimitsInForce, threads: usize) -> Self {
        Self { at: utc_timestamp(SystemTime::now()), evaluations, limits, threads, host: Host::this() }
    }
}

/// The machine of a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Host {
    /// Its name.
    pub name: String,
    /// Operating system.
    pub system: String,
    /// Processor architecture.
    pub architecture: String,
    /// Threads it can run at once.
    pub parallelism: usize,
}

impl Host {
    /// This machine.
    pub fn this() -> Self {
        Self {
            name: hostname(),
            system: std::env::consts::OS.to_owned(),
            architecture: std::env::consts::ARCH.to_owned(),
            parallelism: std::thread::available_parallelism().map_or(1, usize::from),
        }
    }
}

impl Manifest {
    /// The manifest of a run that starts now, without what it reads.
    pub fn new(command: &str, threads: usize) -> Self {
        Self {
            program: PROGRAM.to_owned(),
            schema_version: 1,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            command: command.to_owned(),
            status: RunStatus::Running,
            config: None,
            folder: None,
            overrides: Vec::new(),
            limits: None,
            resumed: Vec::new(),
            mesh: None,
            tables: Vec::new(),
            surfaces: Vec::new(),
            host: Host::this(),
            threads,
            ranks: None,
            started: utc_timestamp(SystemTime::now()),
            finished: None,
            seconds: None,
        }
    }

    /// The same with the configuration and the overrides of the command line.
    ///
    /// # Errors
    /// [`OutputError::NoText`] for a folder whose name is none.
    pub fn reading(mut self, source: &SourceMap) -> Result<Self, OutputError> {
        check_text(source.directory())?;
        self.config = source.documents().first().map(|document| FileHash {
            path: document.name.clone(),
            blake3: blake3_hex(document.text.as_bytes()),
        });
        self.folder = Some(source.directory().to_owned());
        self.overrides = source.overrides().map(str::to_owned).collect();
        Ok(self)
    }

    /// Adds a resumption; the run is running again.
    pub fn add_resumption(&mut self, resumption: Resumption) {
        (self.status, self.finished, self.seconds) = (RunStatus::Running, None, None);
        self.limits = Some(resumption.limits);
        self.resumed.push(resumption);
    }

    /// Fill in how the run ended, now; `seconds` is its duration [s].
    pub fn complete(&mut self, status: RunStatus, seconds: f64) {
        self.status = status;
        self.finished = Some(utc_timestamp(SystemTime::now()));
        self.seconds = Some(seconds);
    }

    /// Whether the file was written by this program.
    pub fn is_ours(&self) -> bool {
        self.program == PROGRAM
    }

    /// Whether the manifest in a folder names another program.
    pub(super) fn is_of_another(directory: &RunDirectory) -> bool {
        let bytes = directory.disk().read(&directory.manifest(), LARGEST).unwrap_or_default();
        let value: Option<serde_json::Value> = serde_json::from_slice(&bytes).ok();
        value.is_some_and(|value| value.get("program").and_then(|name| name.as_str()) != Some(PROGRAM))
    }

    /// Whether this still is the manifest of a directory.
    ///
    /// # Errors
    /// [`OutputError::InUse`] where another process has been at work since it was read.
    pub fn check_current(&self, directory: &RunDirectory) -> Result<(), OutputError> {
        match Self::read(directory)? == *self {
            true => Ok(()),
            false => Err(OutputError::InUse { path: directory.path().to_owned() }),
        }
    }

    /// Write the manifest into a run directory, replacing an older one.
    pub fn write(&self, directory: &RunDirectory) -> Result<(), OutputError> {
        directory.write(&directory.manifest(), &to_json(self))
    }

    /// Read the manifest of a run directory.
    ///
    /// # Errors
    /// When there is none, or it is none of ours.
    pub fn read(directory: &RunDirectory) -> Result<Self, OutputError> {
        read_json(directory.disk(), &directory.manifest(), LARGEST)
    }
}

/// BLAKE3 of some bytes, hexadecimal.
pub fn blake3_hex(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::{OverwritePolicy, system_disk};

    #[test]
    fn a_manifest_is_written_first_and_completed_last() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let run = RunDirectory::create(&system_disk(), folder.path(), OverwritePolicy::Keep)
            .expect("a run directory");
        let mut manifest = Manifest::new("run", 2);
        manifest.config = Some(FileHash { path: "a.toml".into(), blake3: blake3_hex(b"") });
        manifest.write(&run).expect("written");
        let read = Manifest::read(&run).expect("read");
        assert_eq!((read.status, read.finished.as_deref()), (RunStatus::Running, None));

        manifest.complete(RunStatus::Converged, 1.5);
        manifest.write(&run).expect("written");
        assert_eq!(Manifest::read(&run).expect("read"), manifest);
        let text = std::fs::read_to_string(run.manifest()).expect("read");
        assert!(
            text.contains("\"program\": \"fluxmorph\"") && text.contains("\"status\": \"converged\""),
            "{text}"
        );
        // The published BLAKE3 of nothing.
        assert!(text.contains("af1349b9f5f9a1a6a0404dea36dcc9499bcb25c9adc112b7cc9a93cae41f3262"), "{text}");
    }
}
