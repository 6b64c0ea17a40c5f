//! The row of an evaluation in the history.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::body::BodyForce;

/// One evaluation of objective, constraints and gradients; a row of the history.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
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
    /// Multiple of the motion from the undeformed mesh at which the first element inverts; `None` if none ever does.
    pub step_to_inversion: Option<f64>,
    /// That element.
    pub inversion_element: Option<usize>,
    /// Its region.
    pub inversion_region: Option<String>,
    /// Times the mesh had been refined.
    #[serde(default)]
    pub level: usize,
    /// Force and torque on every body whose force is reported.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub forces: Vec<BodyForce>,
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
        "level",
    ];
}
