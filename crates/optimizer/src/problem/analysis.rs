//! What an evaluation gives.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::quality::QualityReport;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_remesh::StepToInversion;
use fluxmorph_solver::FieldSolution;
use fluxmorph_solver::linear::{Method, SolverEvent};

use crate::body::BodyForce;

/// Wall time of the parts of an evaluation [s].
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Timings {
    /// Elastic solves, forward and transposed, and the mesh check.
    pub remesh: f64,
    /// Assembly of matrix and load.
    pub assembly: f64,
    /// Factorisation.
    pub factor: f64,
    /// State iterations.
    pub state: f64,
    /// Adjoint iterations.
    pub adjoint: f64,
    /// Objective, element derivatives and their sums.
    pub gradient: f64,
}

impl std::ops::AddAssign for Timings {
    fn add_assign(&mut self, other: Self) {
        self.remesh += other.remesh;
        self.assembly += other.assembly;
        self.factor += other.factor;
        self.state += other.state;
        self.adjoint += other.adjoint;
        self.gradient += other.gradient;
    }
}

/// The field of one design.
#[derive(Debug)]
pub struct Analysis {
    /// The moved mesh.
    pub mesh: Mesh,
    /// Displacement of every node from the undeformed mesh [m], shape `(n_nodes, 3)`.
    pub displacement: Vec<Point>,
    /// First inversion along the motion from the undeformed mesh, as a multiple of it.
    pub inversion: StepToInversion,
    /// One solution per state.
    pub solutions: Vec<FieldSolution>,
    /// The objective, if the problem has one.
    pub objective: Option<f64>,
    /// The terms of the objective without their weights, each summed over its states.
    pub terms: Vec<f64>,
    /// Of a worst case: its terms with their weights, of which the objective is one; otherwise empty.
    pub members: Vec<Measured>,
    /// What the constraints measure, in their order.
    pub constraints: Vec<Measured>,
    /// Force and torque on every body, in the first state.
    pub forces: Vec<BodyForce>,
    /// dF/dp [unit of F per m], if asked for.
    pub gradient: Option<Vec<f64>>,
    /// dF/dx at the nodes that may move [unit of F per m], if asked for; shape `(n_nodes, 3)`.
    pub sensitivity: Option<Vec<Point>>,
    /// Quality of the elements that may move; of all elements where nothing moves.
    pub quality: QualityReport,
    /// Iterations of the linear solver, state and adjoint.
    pub linear_iterations: usize,
    /// Largest true relative residual of the states, and of adjoint problems but for those of a search.
    pub worst_residual: f64,
    /// The method of the linear solver that solved each state; `None` on several ranks.
    pub methods: Vec<Option<Method>>,
    /// Methods of the linear solver that failed, and what took their place.
    pub solver_events: Vec<SolverEvent>,
    /// Where the time went.
    pub timings: Timings,
}

impl Analysis {
    /// Values of the terms of a worst case, with their weights; empty otherwise.
    pub fn member_values(&self) -> Vec<f64> {
        self.members.iter().map(|member| member.value).collect()
    }
}

/// The value of what a constraint or a term measures.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The value, in SI.
    pub value: f64,
    /// Its derivative by the design variables [unit per m], if asked for.
    pub gradient: Option<Vec<f64>>,
}
