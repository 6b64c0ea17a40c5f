//! The layer through which everything is written: whole files, the history, and the run directory.

mod accuracy;
mod csv;
mod design_file;
mod disk;
pub(crate) mod exports;
mod field_files;
pub mod fields;
mod finite;
mod history;
mod host;
mod json;
mod json_place;
mod manifest;
mod names;
mod refinements;
mod result;
mod run_directory;
mod run_files;
mod state_result;
mod synced;

use std::path::{Path, PathBuf};

use nix::errno::Errno;

pub use accuracy::{
    Accuracy, CrossCheck, CurvedFacets, ErrorBars, LEAST_LEFT_OUT, Level, SAFETY, Verdict, WHERE_LEFT_OUT,
    relative_bar,
};
pub(crate) use csv::csv_text;
pub use design_file::{DesignFile, DesignFileError, RunOfDesign, read_design};
pub use disk::{Disk, DiskFile, DiskLock, Sharing, system_disk};
pub use field_files::FieldForm;
pub(crate) use finite::check_finite;
pub use fluxmorph_optimizer::driver::StopReason;
pub use history::History;
pub use host::{hostname, peak_memory_bytes, utc_timestamp};
pub(crate) use json::{read_json, to_json};
pub use manifest::{FileHash, Host, LimitsInForce, Manifest, MeshHash, Resumption, RunStatus, blake3_hex};
pub(crate) use names::{check_text, shell_word};
pub use names::{extend_command, resume_command, surface_files};
pub use refinements::{RefinementStep, Refinements};
pub use result::{
    ConstraintResult, DesignResult, HomogeneityResult, LinearSolverResult, MeshResult, ObjectiveResult,
    OpenResult, RunResult, ShapeDeviation, TermResult, Verification, VerificationMesh,
};
pub(crate) use run_directory::check_place;
pub use run_directory::{OverwritePolicy, RunDirectory};
pub use state_result::{
    Amplitude, CoilResult, ForceError, HarmonicResult, MultipoleResult, ProbeResult, SaturatedRegion,
    SaturationResult, StateErrors, StateResult,
};
pub use synced::SyncedLog;
pub(crate) use synced::{LOCK, UNFINISHED, remove_unfinished, write_whole};

/// Why something could not be written or read back.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of a variant says what its fields are")]
pub enum OutputError {
    /// The output directory holds something that is not a run of this program.
    #[error(
        "the output directory `{path}` is not empty and holds no run of fluxmorph; nothing in it was touched: \
         choose an empty or new directory with --out or output.directory"
    )]
    NotOurs { path: PathBuf },
    /// The output directory holds an earlier run, which was not to be replaced.
    #[error(
        "the output directory `{path}` holds an earlier run; replace it with --force, or choose another \
         directory with --out"
    )]
    HoldsRun { path: PathBuf },
    /// The output directory is something else.
    #[error(
        "the output directory `{path}` is a file or lies below one; choose a directory with --out or output.directory"
    )]
    NotADirectory { path: PathBuf },
    /// There is no run in a directory.
    #[error(
        "`{path}` holds no run of fluxmorph: expected a directory that `fluxmorph run` has written into; of a sweep, one of those in it"
    )]
    NoRun { path: PathBuf },
    /// What a run has left is in a directory, but not its mark.
    #[error(
        "`{path}` is missing, the mark of a run, whose other files are beside it: restore it from a copy; without it nothing here is \
         taken for a run, and nothing is replaced"
    )]
    NoManifest { path: PathBuf },
    /// A page would take the place of something else.
    #[error(
        "`{path}` is there and is no page of fluxmorph; it was not touched: name another file with --out"
    )]
    NoPage { path: PathBuf },
    /// Another process writes into the directory.
    #[error(
        "`{path}` is written by another process of fluxmorph: wait for it or stop it; a new run may write elsewhere with \
         --out"
    )]
    InUse {
        /// The directory, or the file in it that is held.
        path: PathBuf,
    },
    /// The folder in which a run began is another one, or gone.
    #[error(
        "`{path}` is no longer the folder in which this run began: it was moved, removed or replaced meanwhile, and nothing is \
         written into what is there now. Where it was moved to, a run goes on with `fluxmorph resume`"
    )]
    Replaced { path: PathBuf },
    /// A folder of a run is a link.
    #[error(
        "`{path}` is a link, and nothing is written through links; remove it; a new run may write elsewhere with --out"
    )]
    Linked { path: PathBuf },
    /// A folder to be made is a link to one that is missing.
    #[error(
        "`{path}` is a link to something that is missing; make that folder, remove the link, or write elsewhere with --out"
    )]
    DeadLink { path: PathBuf },
    /// A path that is to be kept in a file has bytes that are no text.
    #[error(
        "the path `{path}` is no UTF-8 text, and cannot be kept in the files of a run; rename the folder"
    )]
    NoText { path: PathBuf },
    /// A file of a run does not hold what it should.
    #[error("`{path}` is damaged: {message}; it must be a file as fluxmorph wrote it")]
    Damaged { path: PathBuf, message: String },
    /// The run is one of an earlier version.
    #[error(
        "`{path}` is the journal of version {version:?} of fluxmorph in a form that this version does not read: resume with \
         the program that wrote it, or start the run again with --force"
    )]
    OlderJournal { path: PathBuf, version: String },
    /// The operating system refused.
    #[error("cannot {action} `{path}`: {source}; {}", advice(action, path, .source))]
    Io { action: &'static str, path: PathBuf, source: std::io::Error },
}

/// The path of what has none.
pub(crate) const STDOUT: &str = "standard output";

/// What to do about an error of the operating system.
fn advice(action: &str, path: &Path, error: &std::io::Error) -> &'static str {
    use std::io::ErrorKind;
    match error.kind() {
        ErrorKind::PermissionDenied if action == "read" => {
            "whoever runs fluxmorph must be allowed to read it"
        }
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded if path == Path::new(STDOUT) => {
            "free some space where it leads"
        }
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            "choose a directory you may write to, for a new run with --out"
        }
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
            "free some space, or keep fewer files with output.fields and output.mesh"
        }
        ErrorKind::NotFound => "check that the path exists",
        ErrorKind::InvalidFilename => "take a shorter name",
        ErrorKind::FileTooLarge => "the file system, or `ulimit -f`, allows no file of this size",
        _ if error.raw_os_error() == Some(Errno::EMFILE as i32) => {
            "too many files are open: raise `ulimit -n`, or run fewer programs"
        }
        _ => "check the path and the disk",
    }
}

impl OutputError {
    /// Turns what is wrong with a file into [`Self::Damaged`], for `map_err`.
    pub(crate) fn damaged<E: std::fmt::Display>(path: impl Into<PathBuf>) -> impl FnOnce(E) -> Self {
        let path = path.into();
        move |error| Self::Damaged { path, message: error.to_string() }
    }

    /// What was read, or `None` where there is no such file.
    pub(crate) fn unless_missing(
        path: &Path,
        read: std::io::Result<Vec<u8>>,
    ) -> Result<Option<Vec<u8>>, Self> {
        match read {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            other => other.map(Some).map_err(Self::io("read", path)),
        }
    }

    /// Turns an error of the operating system into one that names the path, for `map_err`.
    pub(crate) fn io(action: &'static str, path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source: std::io::Error| match source.kind() {
            std::io::ErrorKind::ResourceBusy => Self::InUse { path },
            _ => Self::Io { action, path, source },
        }
    }
}

#[cfg(test)]
pub(crate) use result::tests::example as example_result;
