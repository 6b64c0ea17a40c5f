//! What can go wrong in a command, and its exit code.

use std::path::PathBuf;

use fluxmorph_geometry::MeshError;
use fluxmorph_geometry::ranks::RankError;
use fluxmorph_remesh::RemeshError;
use fluxmorph_solver::SolverError;

use crate::cli::{ExitCode, InitError};
use crate::config::ConfigError;
use crate::design::Apart;
use crate::geometric::GeometricError;
use crate::output::{DesignFileError, OutputError};
use crate::sweep::SweepError;

/// Errors of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The configuration is wrong.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The mesh is wrong.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The field problem is wrong, or cannot be solved.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// One linear system of the field problem cannot be solved.
    #[error("{problem}: {cause}")]
    Field {
        /// Which one: of the state or an adjoint, at which frequency.
        problem: String,
        /// Why.
        cause: Box<SolverError>,
    },
    /// Something computed that is no number to go on with.
    #[error("{what} is {value:e}: {expected}")]
    NotFinite {
        /// What, of which state, region, term or variable.
        what: String,
        /// Its value.
        value: f64,
        /// What is needed, and what to do.
        expected: &'static str,
    },
    /// The mesh cannot follow the design.
    #[error(transparent)]
    Remesh(#[from] RemeshError),
    /// A geometric constraint has no meaning for the shape.
    #[error(transparent)]
    Geometric(#[from] GeometricError),
    /// A shape cannot be taken over by another mesh.
    #[error(transparent)]
    Apart(#[from] Apart),
    /// A file with a design is wrong.
    #[error(transparent)]
    Design(#[from] DesignFileError),
    /// A file cannot be written or read.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A starting configuration cannot be written.
    #[error(transparent)]
    Init(#[from] InitError),
    /// A sweep cannot be begun.
    #[error(transparent)]
    Sweep(#[from] SweepError),
    /// The optimisation method refuses or fails.
    #[error("the optimisation failed: {cause}")]
    Optimisation {
        /// What it said.
        cause: &'static str,
    },
    /// The mesh of the first design is refused.
    #[error(
        "the first design has no mesh to compute on: {cause}; begin elsewhere, or loosen the limit named"
    )]
    FirstDesign {
        /// Why.
        cause: String,
    },
    /// The mesh cannot be taken to a design.
    #[error(
        "the mesh can be taken {:.1} % of the way to the design only; take one nearer to the undeformed shape, enlarge the \
         remesh region or change its stiffness",
        100.0 * reached
    )]
    DesignUnreached {
        /// Share of the way that can be taken.
        reached: f64,
    },
    /// A constraint that cannot be what the configuration says.
    #[error("the constraint `{name}` has the value {value:e} at the initial design: expected {expected}")]
    Constraint {
        /// Its name.
        name: String,
        /// Its value, in SI.
        value: f64,
        /// What is needed, and what to do.
        expected: &'static str,
    },
    /// The gradient does not match the objective.
    #[error("the gradient certificate does not hold: {cause}")]
    Certificate {
        /// Which of its tests fails.
        cause: String,
    },
    /// A journal belongs to another run.
    #[error("the journal `{}` is not that of this run: {cause}", path.display())]
    OtherRun {
        /// The journal.
        path: PathBuf,
        /// The first difference.
        cause: String,
    },
    /// The run takes another way than its journal says.
    #[error(
        "evaluation {evaluation} of the journal does not answer what the optimisation asks for: {cause}; go on with the \
         program and on the processor that the run was started with, or start it again"
    )]
    Replay {
        /// The evaluation.
        evaluation: usize,
        /// What differs.
        cause: String,
    },
    /// A run directory that there is nothing to go on with in.
    #[error("`{}` cannot be resumed: {cause}", path.display())]
    NotResumable {
        /// The directory.
        path: PathBuf,
        /// Why, and what to do.
        cause: String,
    },
    /// A run directory that there is nothing to report of.
    #[error("there is no report of `{}`: {cause}", path.display())]
    NoReport {
        /// The directory.
        path: PathBuf,
        /// Why, and what to do.
        cause: String,
    },
    /// A signal came before there was anything to keep.
    #[error("interrupted before there was anything to keep")]
    Interrupted,
    /// A signal ended a run before an evaluation that its journal does not have.
    #[error("interrupted before anything new was computed")]
    InterruptedRun,
    /// A rank could not write its piece of a field.
    #[error("the fields cannot be written: {cause}")]
    Pieces {
        /// Which rank, and why.
        cause: RankError,
    },
    /// The ranks of a parallel program cannot work together.
    #[error("several ranks: {cause}")]
    Ranks {
        /// Why, and what to do.
        cause: String,
    },
    /// A pool of threads cannot be made.
    #[error("cannot start {threads} threads: {cause}; give a smaller --threads")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// What the system said.
        cause: String,
    },
}

impl Error {
    /// Nothing, unless `interrupted` says that a signal came.
    ///
    /// # Errors
    /// [`Error::Interrupted`].
    pub(crate) fn unless(interrupted: &dyn Fn() -> bool) -> Result<(), Self> {
        if interrupted() { Err(Self::Interrupted) } else { Ok(()) }
    }

    /// Whether a run that ends with this error can be gone on with once its cause is mended.
    pub fn leaves_a_run(&self) -> bool {
        match self {
            Self::Output(error) => matches!(error, OutputError::Io { .. }),
            Self::InterruptedRun | Self::Pieces { .. } => true,
            other => other.exit_code() == ExitCode::Numerical,
        }
    }

    /// The exit code of a command that fails with this error.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Self::Config(ConfigError::Read { .. }) | Self::Design(DesignFileError::Read { .. }) => {
                ExitCode::Files
            }
            Self::Output(OutputError::OlderJournal { .. }) => ExitCode::Configuration,
            Self::Output(_)
            | Self::Pieces { .. }
            | Self::Replay { .. }
            | Self::Init(InitError::Exists { .. }) => ExitCode::Files,
            // Of a motion; a file's or a generator's is a wrong mesh.
            Self::Remesh(RemeshError::Mesh(MeshError::NotFinite { .. } | MeshError::Inverted { .. })) => {
                ExitCode::Numerical
            }
            Self::Mesh(mesh)
            | Self::Solver(SolverError::Mesh(mesh))
            | Self::Remesh(RemeshError::Mesh(mesh)) => match mesh {
                MeshError::Factorisation { .. } | MeshError::NotFiniteArray { .. } => ExitCode::Numerical,
                MeshError::File { .. } => ExitCode::Files,
                _ => ExitCode::Configuration,
            },
            Self::Solver(
                SolverError::NotConverged { .. }
                | SolverError::NotFinite { .. }
                | SolverError::OutOfRange { .. }
                | SolverError::Rank(_),
            )
            | Self::Field { .. }
            | Self::NotFinite { .. }
            | Self::Remesh(
                RemeshError::NotConverged { .. } | RemeshError::NotFinite { .. } | RemeshError::Rank(_),
            )
            | Self::Optimisation { .. }
            | Self::Certificate { .. } => ExitCode::Numerical,
            Self::Constraint { .. }
            | Self::OtherRun { .. }
            | Self::NotResumable { .. }
            | Self::NoReport { .. }
            | Self::DesignUnreached { .. }
            | Self::FirstDesign { .. }
            | Self::Apart(_)
            | Self::Config(_)
            | Self::Solver(_)
            | Self::Remesh(_)
            | Self::Geometric(_)
            | Self::Design(_) => ExitCode::Configuration,
            Self::Sweep(error) => error.exit_code(),
            Self::Threads { .. } | Self::Ranks { .. } | Self::Init(_) => ExitCode::Usage,
            Self::Interrupted | Self::InterruptedRun => ExitCode::Interrupted,
        }
    }
}
