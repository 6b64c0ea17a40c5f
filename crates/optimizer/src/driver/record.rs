//! What an evaluation leaves: its row in the history, and all that is needed to replay it.

use std::collections::BTreeMap;

use fluxmorph_geometry::Mesh;
use fluxmorph_solver::linear::Method;
use serde::{Deserialize, Serialize};

use crate::problem::Timings;

/// One evaluation.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Its row in the history; objective and round stand there.
    pub row: Evaluation,
    /// Whether it was the best until then.
    pub improved: bool,
    /// The design variables [m].
    pub design: Vec<f64>,
    /// dF/dp [unit of F per m].
    pub gradient: Vec<f64>,
    /// What the constraints measure, in SI, with the derivatives by the variables.
    pub constraints: Vec<(f64, Vec<f64>)>,
    /// [`reference_hash`] of the round's reference mesh.
    pub reference: [u8; 32],
    /// The method of the linear solver that worked last, by state; `None` where it is the first one.
    pub methods: Vec<Option<Method>>,
    /// Largest relative residual of its linear solves.
    pub worst_residual: f64,
    /// Where its time went.
    pub timings: Timings,
}

/// One evaluation of objective, constraints and gradients; a row of the history.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Number of the evaluation, from 0.
    pub evaluation: usize,
    /// Evaluations so far that improved on the best before them; the first counts as 0.
    pub iteration: usize,
    /// The objective itself, whether it is minimised or maximised.
    pub objective: f64,
    /// The objective over that of evaluation 0.
    pub ratio: f64,
    /// Euclidean norm of the gradient with respect to the design variables [objective / m].
    pub gradient_norm: f64,
    /// Euclidean norm of the change of the design variables since the evaluation before [m].
    pub step_norm: f64,
    /// Worst quality of an element (Eq. 4).
    pub worst_quality: f64,
    /// Least thickness of the moved body along the direction of motion [m]; `None` where it has none.
    pub min_thickness_m: Option<f64>,
    /// Greatest thickness [m].
    pub max_thickness_m: Option<f64>,
    /// Iterations of the linear solver, state and adjoint.
    pub linear_iterations: usize,
    /// Wall time of the evaluation [s].
    pub seconds: f64,
    /// Multiple of the motion from the round's reference at which the first element inverts; `None` if none ever does.
    pub step_to_inversion: Option<f64>,
    /// That element.
    pub inversion_element: Option<usize>,
    /// Its region.
    pub inversion_region: Option<String>,
    /// Rounds of the mesh motion begun so far (see [`fluxmorph_optimizer::driver`]).
    pub round: usize,
    /// Relative distance of every constraint from its bound, satisfied where ≤ 0, by column (see [`column`]).
    #[serde(flatten)]
    pub constraints: BTreeMap<String, f64>,
}

/// The column of the history that holds a constraint.
pub fn column(constraint: &str) -> String {
    format!("c_{constraint}")
}

impl Evaluation {
    /// The columns of `history.csv` before those of the constraints.
    pub const COLUMNS: [&'static str; 15] = [
        "evaluation",
        "iteration",
        "objective",
        "ratio",
        "gradient_norm",
        "step_norm",
        "worst_quality",
        "min_thickness_m",
        "max_thickness_m",
        "linear_iterations",
        "seconds",
        "step_to_inversion",
        "inversion_element",
        "inversion_region",
        "round",
    ];
}

/// BLAKE3 of the points of a mesh whose topology is known.
pub fn reference_hash(mesh: &Mesh) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    hash_points(&mut hasher, mesh);
    *hasher.finalize().as_bytes()
}

/// Adds the points of a mesh to a hash, as raw bits.
pub fn hash_points(hasher: &mut blake3::Hasher, mesh: &Mesh) {
    for point in mesh.points() {
        let mut bytes = [0; 24];
        for (slot, c) in bytes.chunks_exact_mut(8).zip(point) {
            slot.copy_from_slice(&c.to_le_bytes());
        }
        hasher.update(&bytes);
    }
}
