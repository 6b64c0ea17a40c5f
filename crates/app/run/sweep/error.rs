//! Why a sweep is not begun.

use std::path::PathBuf;

use super::MOST_COMBINATIONS;
use crate::config::ConfigError;
use crate::exit_code::ExitCode;

/// Why a sweep is not begun. Nothing has been run or replaced then.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of a variant says what its fields are")]
pub enum SweepError {
    /// A list of values has a gap.
    #[error(
        "--set {key}: the value number {number} is empty; take the comma away, or write \"\" for an empty text"
    )]
    EmptyValue {
        key: String,
        /// Which value, from 1.
        number: usize,
    },
    /// A key has two lists of values.
    #[error("--set {key} is given twice; write all its values into one, separated by commas")]
    KeyTwice { key: String },
    /// The directories of the runs are not the configuration's business.
    #[error(
        "--set output.directory has {values} values, but the sweep names the directories of its runs itself; give one \
         directory for all with --out"
    )]
    Directories { values: usize },
    /// The product is too large.
    #[error(
        "the values make {count} combinations: expected at most {MOST_COMBINATIONS}; give fewer values, or several sweeps"
    )]
    TooMany {
        /// How many, or the largest number that can be counted.
        count: usize,
    },
    /// Two combinations mean the same.
    #[error(
        "the combinations `{first}` and `{second}` are the same configuration; give every value once, and only keys that \
         change something"
    )]
    Same { first: String, second: String },
    /// Some configurations are wrong.
    #[error(
        "{faulty} of {of} combinations cannot be read, and nothing was run: correct the configuration or the values of --set"
    )]
    Faults {
        faulty: usize,
        of: usize,
        /// Combinations with faults that none before them has, by name; not more than are worth reading.
        reports: Vec<(String, ConfigError)>,
    },
    /// The directory holds something else.
    #[error(
        "`{}` is not empty and holds no sweep; nothing in it was touched: choose an empty or new directory with --out",
        path.display()
    )]
    NotASweep { path: PathBuf },
    /// The directory holds a sweep over other keys or values.
    #[error(
        "`{}` holds another sweep: {cause}; give the same keys with at least the same values, choose another directory with \
         --out, or describe the directory anew with --force",
        path.display()
    )]
    OtherSweep { path: PathBuf, cause: String },
    /// A run directory holds something that the combination is not.
    #[error(
        "`{}` holds another run: {cause}; choose another directory with --out, or replace such runs with --force",
        path.display()
    )]
    OtherRun { path: PathBuf, cause: String },
    /// `--only` names no combination.
    #[error("--only {index}: the sweep has {count} combinations, counted from 0")]
    NoSuch { index: usize, count: usize },
    /// `--only` or `--compare` without a sweep that was laid out, or after a change.
    #[error(
        "`{}` is not the directory of this sweep: {cause}; give the same command without --only and --compare to run it here, \
         with --script to lay it out",
        path.display()
    )]
    NotLaidOut { path: PathBuf, cause: String },
    /// A file exists in the place of the script.
    #[error(
        "`{}` exists and is no script of a sweep; choose another name, or replace it with --force",
        path.display()
    )]
    ScriptExists { path: PathBuf },
    /// The program does not know where it is.
    #[error("cannot find the program itself: {source}; call it by its whole path")]
    Program { source: std::io::Error },
}

impl SweepError {
    /// The exit code of a command that fails with this error.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Self::EmptyValue { .. }
            | Self::KeyTwice { .. }
            | Self::Directories { .. }
            | Self::TooMany { .. }
            | Self::Same { .. }
            | Self::NoSuch { .. } => ExitCode::Usage,
            Self::Faults { .. } => ExitCode::Configuration,
            Self::NotASweep { .. }
            | Self::OtherSweep { .. }
            | Self::OtherRun { .. }
            | Self::NotLaidOut { .. }
            | Self::ScriptExists { .. }
            | Self::Program { .. } => ExitCode::Files,
        }
    }
}
