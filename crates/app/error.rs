//! What can go wrong in a command, and its exit code: decided here, and nowhere below.

use std::path::PathBuf;

use fluxmorph_geometry::MeshError;
use fluxmorph_geometry::parallel::RankError;
use fluxmorph_remesh::RemeshError;
use fluxmorph_solver::SolverError;

use crate::config::ConfigError;
use crate::exit_code::ExitCode;
use crate::files::{DesignFileError, OutputError};
use crate::run::sweep::SweepError;

/// Errors of the program.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of a variant says what its fields are")]
pub enum Error {
    /// Problem, optimisation, field or mesh.
    #[error(transparent)]
    Optimizer(fluxmorph_optimizer::Error),
    /// The configuration is wrong.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A file with a design is wrong.
    #[error(transparent)]
    Design(#[from] DesignFileError),
    /// A file cannot be written or read.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The file to write exists already.
    #[error("`{}` exists, and nothing was written; choose another NAME or folder, or replace it with --force", path.display())]
    FileExists { path: PathBuf },
    /// The name cannot be that of a file or cannot be used in a configuration.
    #[error(
        "`{}` cannot be the name of a configuration: expected the name of a file in UTF-8 without quotes, backslashes and \
         control characters, such as plate or devices/plate.toml",
        name.display()
    )]
    ConfigurationName { name: PathBuf },
    /// A sweep cannot be begun.
    #[error(transparent)]
    Sweep(#[from] SweepError),
    /// The gradient does not match the objective.
    #[error("the gradient certificate does not hold: {cause}")]
    Certificate { cause: String },
    /// A journal belongs to another run.
    #[error("the journal `{}` is not that of this run: {cause}", path.display())]
    OtherRun { path: PathBuf, cause: String },
    /// A run directory without a run to resume.
    #[error("`{}` cannot be resumed: {cause}", path.display())]
    NotResumable { path: PathBuf, cause: String },
    /// A run directory without anything to report.
    #[error("there is no report of `{}`: {cause}", path.display())]
    NoReport { path: PathBuf, cause: String },
    /// A rank could not write its piece of a field.
    #[error("the fields cannot be written: {cause}")]
    Pieces { cause: RankError },
    /// The ranks of a parallel program cannot work together.
    #[error("several ranks: {cause}")]
    Ranks { cause: String },
    /// A pool of threads cannot be created.
    #[error("cannot start {threads} threads: {cause}; give a smaller --threads")]
    Threads { threads: usize, cause: String },
}

impl Error {
    /// Whether a run that ends with this error can be resumed once its cause is removed.
    pub fn is_resumable(&self) -> bool {
        match self {
            Self::Output(error) => matches!(error, OutputError::Io { .. }),
            Self::Optimizer(fluxmorph_optimizer::Error::InterruptedRun) | Self::Pieces { .. } => true,
            other => other.exit_code() == ExitCode::Numerical,
        }
    }

    /// The exit code of a command that fails with this error.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Self::Optimizer(error) => exit_code_of_optimizer(error),
            Self::Output(OutputError::OlderJournal { .. }) => ExitCode::Configuration,
            Self::Config(ConfigError::Read { .. })
            | Self::Design(DesignFileError::Read { .. })
            | Self::Output(_)
            | Self::Pieces { .. }
            | Self::FileExists { .. } => ExitCode::Files,
            Self::Certificate { .. } => ExitCode::Numerical,
            Self::OtherRun { .. }
            | Self::NotResumable { .. }
            | Self::NoReport { .. }
            | Self::Config(_)
            | Self::Design(_) => ExitCode::Configuration,
            Self::Sweep(error) => error.exit_code(),
            Self::Threads { .. } | Self::Ranks { .. } | Self::ConfigurationName { .. } => ExitCode::Usage,
        }
    }
}

fn exit_code_of_optimizer(error: &fluxmorph_optimizer::Error) -> ExitCode {
    use fluxmorph_optimizer::Error as Of;
    match error {
        Of::Interrupted | Of::InterruptedRun => ExitCode::Interrupted,
        Of::Mesh(MeshError::File { .. })
        | Of::Solver(SolverError::Mesh(MeshError::File { .. }))
        | Of::Remesh(RemeshError::Mesh(MeshError::File { .. }))
        | Of::Replay { .. } => ExitCode::Files,
        numerical if numerical.is_numerical() => ExitCode::Numerical,
        _ => ExitCode::Configuration,
    }
}

/// What a recorder of this program fails with comes back as itself.
impl From<fluxmorph_optimizer::Error> for Error {
    fn from(error: fluxmorph_optimizer::Error) -> Self {
        match error {
            fluxmorph_optimizer::Error::Recorder(cause) => match cause.downcast::<Self>() {
                Ok(own) => *own,
                Err(foreign) => Self::Optimizer(fluxmorph_optimizer::Error::Recorder(foreign)),
            },
            other => Self::Optimizer(other),
        }
    }
}

/// For a recorder, whose errors pass through the optimiser.
impl From<Error> for fluxmorph_optimizer::Error {
    fn from(error: Error) -> Self {
        match error {
            Error::Optimizer(error) => error,
            other => Self::Recorder(Box::new(other)),
        }
    }
}

impl From<MeshError> for Error {
    fn from(error: MeshError) -> Self {
        Self::Optimizer(error.into())
    }
}

impl From<SolverError> for Error {
    fn from(error: SolverError) -> Self {
        Self::Optimizer(error.into())
    }
}

impl From<RemeshError> for Error {
    fn from(error: RemeshError) -> Self {
        Self::Optimizer(error.into())
    }
}
