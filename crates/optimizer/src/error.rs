//! What can go wrong in an optimisation.

use fluxmorph_geometry::MeshError;
use fluxmorph_remesh::RemeshError;
use fluxmorph_solver::SolverError;

use crate::design::SurfaceMismatch;

/// Errors of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of a variant says what its fields are")]
pub enum Error {
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
        cause: Box<SolverError>,
    },
    /// A computed quantity is not finite, or not what the computation needs.
    #[error("{what} is {value:e}: {expected}")]
    NotFinite {
        /// What, of which state, region, term or variable.
        what: String,
        value: f64,
        expected: &'static str,
    },
    /// The mesh cannot follow the design.
    #[error(transparent)]
    Remesh(#[from] RemeshError),
    /// A shape cannot be transferred to another mesh.
    #[error(transparent)]
    SurfaceMismatch(#[from] SurfaceMismatch),
    /// The optimisation method refuses or fails.
    #[error("the optimisation failed: {cause}")]
    Optimisation { cause: &'static str },
    /// The mesh of the first design is refused.
    #[error(
        "the first design has no mesh to compute on: {cause}; start from another design, or loosen the limit named"
    )]
    FirstDesign { cause: String },
    /// A constraint that cannot be what the configuration says.
    #[error("the constraint `{name}` has the value {value:e} at the initial design: expected {expected}")]
    Constraint {
        name: String,
        /// Its value, in SI.
        value: f64,
        expected: &'static str,
    },
    /// The run does not repeat what its journal says.
    #[error(
        "evaluation {evaluation} of the journal does not answer what the optimisation asks for: {cause}; resume with \
         the program and on the processor that started the run, or start it again"
    )]
    Replay { evaluation: usize, cause: String },
    /// A signal came before there was anything to keep.
    #[error("interrupted before there was anything to keep")]
    Interrupted,
    /// A signal ended a run before an evaluation that its journal does not have.
    #[error("interrupted before another design was evaluated")]
    InterruptedRun,
    /// A recorder could not keep an evaluation, or give one back: the error of its own.
    #[error(transparent)]
    Recorder(Box<dyn std::error::Error + Send + Sync>),
}

impl Error {
    /// Fails once `interrupted` says that a signal came.
    ///
    /// # Errors
    /// [`Error::Interrupted`].
    pub fn check_interrupted(interrupted: &dyn Fn() -> bool) -> Result<(), Self> {
        if interrupted() { Err(Self::Interrupted) } else { Ok(()) }
    }

    /// Whether the mesh is what a design is out of reach of.
    pub fn is_unreached(&self) -> bool {
        matches!(self, Self::Remesh(_))
    }

    /// Whether a computation failed on sound input: a best design found before is still worth keeping.
    pub fn is_numerical(&self) -> bool {
        match self {
            // A mesh that breaks under motion; a file's or a generator's is wrong input.
            Self::Remesh(RemeshError::Mesh(MeshError::NotFinite { .. } | MeshError::Inverted { .. })) => true,
            Self::Mesh(mesh)
            | Self::Solver(SolverError::Mesh(mesh))
            | Self::Remesh(RemeshError::Mesh(mesh)) => {
                matches!(mesh, MeshError::Factorisation { .. } | MeshError::NotFiniteArray { .. })
            }
            Self::Solver(error) => matches!(
                error,
                SolverError::NotConverged { .. }
                    | SolverError::NotFinite { .. }
                    | SolverError::OutOfRange { .. }
                    | SolverError::Rank(_)
            ),
            Self::Remesh(error) => matches!(
                error,
                RemeshError::NotConverged { .. } | RemeshError::NotFinite { .. } | RemeshError::Rank(_)
            ),
            Self::Field { .. } | Self::NotFinite { .. } | Self::Optimisation { .. } => true,
            _ => false,
        }
    }
}
