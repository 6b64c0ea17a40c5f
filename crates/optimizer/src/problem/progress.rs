//! Progress of a long piece of work, reported to an observer.
//!
//! Each stage is reported as it begins; how it is shown is decided by the caller.

use fluxmorph_solver::newton::NewtonProgress;

/// What is being computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The mesh is read or generated, and names are looked up in it.
    Mesh,
    /// Unknowns of the field are numbered, and their systems analysed.
    Unknowns,
    /// The elastic system of the mesh motion is assembled and factored.
    Elasticity,
    /// The mesh is moved to a design.
    Moving,
    /// Matrix and load of a field are assembled.
    Assembling,
    /// The matrix is factored.
    Factoring,
    /// The state is solved for.
    State,
    /// The adjoint is solved for.
    Adjoint,
    /// Objective and derivatives are summed.
    Differentiating,
    /// Files are written.
    Writing,
    /// Something without a name of its own; its time is not reported.
    Other,
}

impl Stage {
    /// What is being done, in a few words.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Mesh => "building the mesh",
            Self::Unknowns => "ordering the unknowns",
            Self::Elasticity => "factoring the elastic body",
            Self::Moving => "moving the mesh",
            Self::Assembling => "assembling",
            Self::Factoring => "factoring",
            Self::State => "solving",
            Self::Adjoint => "adjoint",
            Self::Differentiating => "differentiating",
            Self::Writing => "writing",
            Self::Other => "working",
        }
    }
}

/// Watches a long piece of work.
pub trait Progress {
    /// A stage begins.
    fn stage(&mut self, stage: Stage);

    /// Newton's method has done a step of a state with B–H laws.
    fn newton(&mut self, _: NewtonProgress) {}
}

impl<F: FnMut(Stage)> Progress for F {
    fn stage(&mut self, stage: Stage) {
        self(stage);
    }
}

/// Watches nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProgress;

impl Progress for NoProgress {
    fn stage(&mut self, _: Stage) {}
}
