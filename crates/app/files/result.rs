//! `result.json`: what a run or a single analysis found.

use std::collections::BTreeMap;

use fluxmorph_optimizer::body::BodyForce;
use fluxmorph_optimizer::driver::StopReason;
use serde::{Deserialize, Serialize};

use super::accuracy::Accuracy;
use super::json::{read_json, to_json};
use super::manifest::RunStatus;
use super::state_result::{
    CoilResult, MultipoleResult, ProbeResult, SaturationResult, StateErrors, StateResult,
};
use super::{OutputError, RunDirectory};

/// Largest file that is read [bytes].
const LARGEST: u64 = 1 << 30;

/// The content of `result.json`. Keys carry their unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunResult {
    /// Version of this file's form: 1.
    pub schema_version: u32,
    /// `run` or `solve`.
    pub command: String,
    /// How it ended: that of the stop reason, or interrupted where the search ended by itself and the check of its result
    /// did not.
    pub status: RunStatus,
    /// Why it ended.
    pub stop_reason: StopReason,
    /// Evaluations of the objective.
    pub evaluations: usize,
    /// Evaluations that improved on the best so far.
    pub iterations: usize,
    /// The objective; `None` when the configuration has none.
    pub objective: Option<ObjectiveResult>,
    /// How exact it is; `None` without an objective, and where nothing is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<Accuracy>,
    /// The constraints at the best design, in the order of the configuration.
    #[serde(default)]
    pub constraints: Vec<ConstraintResult>,
    /// The best design; `None` when the configuration has none.
    pub design: Option<DesignResult>,
    /// The mesh.
    pub mesh: MeshResult,
    /// The frequencies [Hz] of the field problems, in the order of the configuration.
    #[serde(default)]
    pub frequencies_hz: Vec<f64>,
    /// The loads of the field problems, where there are some.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub loads: Vec<String>,
    /// The field at the probes, at the first frequency or under the first load, as all that follows where nothing else is said.
    pub probes: Vec<ProbeResult>,
    /// Eddy-current loss by region, of the meshed part, at the first frequency [W].
    pub losses_w: BTreeMap<String, f64>,
    /// Force and torque on every body of the configuration, at the first frequency.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub forces: Vec<BodyForce>,
    /// Estimated errors of losses, forces, probes and flux linkages; `None` where there is no estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub errors: Option<StateErrors>,
    /// What the facets of curved surfaces change of the same, about, of an analysis; `None` where none is curved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub facets_change: Option<StateErrors>,
    /// Newton's method and saturation, where there is a B–H curve.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub saturation: Option<SaturationResult>,
    /// What depends on the frequency and on the load, for each; only where there are several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub states: Vec<StateResult>,
    /// Losses and probes of the initial design at every frequency and under every load, of a run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub initial: Vec<StateResult>,
    /// Open space, where the mesh has a shell that stands for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub open: Option<OpenResult>,
    /// What the terminals of the coils with `turns` see, at the first frequency.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coils: Vec<CoilResult>,
    /// Inductances between them [H], in their order; in harmonics the real part.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub inductance_h: Vec<Vec<f64>>,
    /// Their coupling factors, `L_jk / √(L_jj L_kk)`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coupling: Vec<Vec<f64>>,
    /// The field expanded in circles and balls, at the first frequency.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub multipoles: Vec<MultipoleResult>,
    /// The linear systems.
    pub linear_solver: LinearSolverResult,
    /// Wall time by part, with `total` [s].
    pub timings_s: BTreeMap<String, f64>,
    /// Bounds that the best design violates and better designs that nearly keep them, and what the field of this design says against
    /// the model it was computed with; empty where there is nothing to say.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Most memory held [bytes].
    pub peak_memory_bytes: u64,
}

impl RunResult {
    /// Enters the estimated errors of what its states report, in their order.
    pub fn enter_errors(&mut self, of_states: &[Option<StateErrors>]) {
        self.errors = of_states.first().cloned().flatten();
        self.states.iter_mut().zip(of_states).for_each(|(state, errors)| state.errors.clone_from(errors));
    }

    /// Enters what the facets of curved surfaces change of what its states report, in their order.
    pub fn enter_facets(&mut self, of_states: &[Option<StateErrors>]) {
        self.facets_change = of_states.first().cloned().flatten();
        self.states.iter_mut().zip(of_states).for_each(|(state, own)| state.facets_change.clone_from(own));
    }

    /// Names of the constraints that the best design violates.
    pub fn violated(&self) -> Vec<String> {
        violated(&self.constraints).map(|own| own.name.clone()).collect()
    }
}

/// The part of open space in the field.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OpenResult {
    /// Share of the field's energy in the shell, in the order of the frequencies.
    pub energy_share: Vec<f64>,
}

/// The objective of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObjectiveResult {
    /// At the initial design.
    pub initial: f64,
    /// At the best design.
    pub best: f64,
    /// `best / initial`.
    pub ratio: f64,
    /// The evaluation of the best design.
    pub best_evaluation: usize,
    /// `best / initial` of the same two shapes on a freshly generated mesh; `None` where that was not computed.
    pub verified_ratio: Option<f64>,
    /// How the verified ratio came about; `None` without one, and where the initial design is the best.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verification: Option<Verification>,
    /// How homogeneous the field is, where that is a term of the objective; its keys stand beside the others.
    #[serde(flatten)]
    pub homogeneity: Option<HomogeneityResult>,
    /// The terms at the best design.
    #[serde(default)]
    pub terms: Vec<TermResult>,
}

/// How homogeneous the field is at the best design, at the first frequency of the term; of a worst case that of the worst one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HomogeneityResult {
    /// The mean of what is compared: of vectors, the modulus of their mean [T].
    pub mean_b_t: f64,
    /// Relative rms deviation from the mean, in parts per million.
    pub rms_ppm: f64,
    /// The same at the initial design; `None` where the objective has other terms too.
    pub initial_rms_ppm: Option<f64>,
    /// Largest less smallest value over the mean, in parts per million; of vectors, of their part along the mean.
    pub peak_to_peak_ppm: f64,
    /// The frequency or load that it is of; `None` where there is one alone.
    pub state: Option<String>,
}

/// The gain of a run computed again on a mesh that the optimiser never saw.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Verification {
    /// How that mesh came about.
    #[serde(default)]
    pub mesh: VerificationMesh,
    /// Parts of every cell of the run's mesh that moves or is observed, along each axis; of cut elements how many times as many
    /// were asked for at least.
    pub refinement: f64,
    /// Its tetrahedra.
    pub tets: usize,
    /// On a fresh mesh how far the best shape is from that of the run, on cut elements how far its facets are from what the control
    /// grid describes; `None` where nodes are the variables.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deviation: Option<ShapeDeviation>,
    /// The objective at the initial design there.
    pub initial: f64,
    /// The objective at the best design there.
    pub best: f64,
    /// `best / initial`.
    pub ratio: f64,
    /// The constraints at the best design there, with their bounds there.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub constraints: Vec<ConstraintResult>,
}

/// How far the surface that a control grid moves is from the same on another mesh: a grid that is finer than the cells, or bends
/// within them, has another shape on other cells.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ShapeDeviation {
    /// The farthest that a node of the fresh mesh is from the surface of the run's [m].
    pub distance_m: f64,
    /// The farthest that one has moved [m].
    pub motion_m: f64,
}

impl Verification {
    /// The constraints that the best design violates there.
    pub fn violated(&self) -> impl Iterator<Item = &ConstraintResult> {
        violated(&self.constraints)
    }
}

fn violated(constraints: &[ConstraintResult]) -> impl Iterator<Item = &ConstraintResult> {
    constraints.iter().filter(|constraint| !constraint.satisfied)
}

impl ObjectiveResult {
    /// Whether its best design violates a constraint on the mesh of a check.
    pub fn is_violated_on_finer_mesh(&self) -> bool {
        self.verification.as_ref().is_some_and(|found| found.violated().next().is_some())
    }

    /// Whether its ratio was computed again on the elements of the run, cut.
    pub fn is_verified_on_cut_elements(&self) -> bool {
        self.verification.as_ref().is_some_and(|found| found.mesh == VerificationMesh::Cut)
    }
}

/// The mesh of a verification.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VerificationMesh {
    /// Generated anew.
    #[default]
    Fresh,
    /// The elements of the run, cut.
    Cut,
}

/// One term of an objective.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TermResult {
    /// What it measures, in the words of the configuration.
    pub kind: String,
    /// Its region; `null` for everything that is meshed.
    pub region: Option<String>,
    /// Its coils, where it is a quantity of these.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coils: Vec<String>,
    /// Its frequency [Hz]; `null` for the sum over all.
    pub frequency: Option<f64>,
    /// Its load; left out for the sum over all, and where there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load: Option<String>,
    /// Its factor in the objective.
    pub weight: f64,
    /// Its value without the factor, in SI.
    pub value: f64,
}

/// One constraint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConstraintResult {
    /// Its name.
    pub name: String,
    /// Its value, in SI.
    pub value: f64,
    /// Its bound, in SI.
    pub bound: f64,
    /// Whether the value keeps within the bound.
    pub satisfied: bool,
    /// Estimated error of the value, with sign, less that of a bound which is a share of the initial value, in SI; `None` where there
    /// is no estimate, and for quantities of the shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_estimate: Option<f64>,
}

/// The best design.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DesignResult {
    /// The variables [m].
    pub values_m: Vec<f64>,
    /// Their lower bounds [m].
    pub lower_m: Vec<f64>,
    /// Their upper bounds [m].
    pub upper_m: Vec<f64>,
    /// Where they act on the undeformed mesh [m].
    pub points_m: Vec<[f64; 3]>,
}

/// The mesh of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeshResult {
    /// Nodes.
    pub nodes: usize,
    /// Tetrahedra.
    pub tets: usize,
    /// Unknowns of the field problem.
    pub unknowns: usize,
    /// Worst quality (Eq. 4) of the initial mesh.
    pub worst_quality_initial: f64,
    /// Worst quality of the mesh of the best design.
    pub worst_quality_final: f64,
}

/// The linear systems of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LinearSolverResult {
    /// The method that solved each state.
    #[serde(default)]
    pub methods: Vec<String>,
    /// Largest relative residual of the states, and of adjoint problems but for those of a search.
    pub worst_residual: f64,
    /// Iterations for the design of this result: states and adjoints.
    #[serde(default)]
    pub iterations: usize,
}

impl RunResult {
    /// Reads `result.json`.
    ///
    /// # Errors
    /// [`OutputError::Damaged`], or when the operating system refuses.
    pub fn read(directory: &RunDirectory) -> Result<Self, OutputError> {
        read_json(directory.disk(), &directory.result(), LARGEST)
    }

    /// Write `result.json`.
    pub fn write(&self, directory: &RunDirectory) -> Result<(), OutputError> {
        directory.write(&directory.result(), &self.to_json())
    }

    /// The file's content.
    pub fn to_json(&self) -> Vec<u8> {
        to_json(self)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::files::{CrossCheck, Verdict};

    pub(crate) fn example() -> RunResult {
        RunResult {
            schema_version: 1,
            command: "run".into(),
            status: RunStatus::Converged,
            stop_reason: StopReason::ObjectiveConverged,
            evaluations: 8,
            iterations: 7,
            objective: Some(ObjectiveResult {
                initial: 2.0,
                best: 1.0,
                ratio: 0.5,
                best_evaluation: 7,
                verified_ratio: Some(0.5),
                verification: Some(Verification {
                    mesh: VerificationMesh::Fresh,
                    refinement: 2.0,
                    tets: 147_000,
                    deviation: None,
                    initial: 2.2,
                    best: 1.1,
                    ratio: 0.5,
                    constraints: Vec::new(),
                }),
                homogeneity: None,
                terms: vec![TermResult {
                    kind: "loss".to_owned(),
                    region: Some("plate".to_owned()),
                    coils: Vec::new(),
                    frequency: None,
                    load: None,
                    weight: 1.0,
                    value: 1.0,
                }],
            }),
            accuracy: Some(Accuracy {
                near_wall: None,
                error_estimate_relative: Some(0.004),
                error_estimate: Some([0.01, 0.001]),
                refinements: 0,
                levels: Vec::new(),
                within_tolerance: None,
                facets: None,
                excess: None,
                cross_check: Some(CrossCheck {
                    elements: "edge".to_owned(),
                    order: 2,
                    ratio: 0.502,
                    values: [2.2, 1.1],
                    by_estimate: true,
                }),
                verdict: Some(Verdict::Confirmed),
            }),
            constraints: vec![ConstraintResult {
                name: "volume_plate".to_owned(),
                value: 1e-3,
                bound: 1e-3,
                satisfied: true,
                error_estimate: None,
            }],
            design: Some(DesignResult {
                values_m: vec![0.02],
                lower_m: vec![-0.005],
                upper_m: vec![0.02],
                points_m: vec![[0.0, 0.0, -0.01]],
            }),
            mesh: MeshResult {
                nodes: 100,
                tets: 400,
                unknowns: 350,
                worst_quality_initial: 0.48,
                worst_quality_final: 0.1,
            },
            frequencies_hz: vec![60.0],
            loads: Vec::new(),
            probes: vec![],
            losses_w: [("plate".to_owned(), 12.5)].into(),
            forces: Vec::new(),
            errors: None,
            saturation: None,
            states: vec![],
            initial: vec![],
            open: None,
            coils: vec![],
            inductance_h: vec![],
            coupling: vec![],
            multipoles: vec![],
            linear_solver: LinearSolverResult {
                methods: vec!["direct_single".to_owned()],
                worst_residual: 1e-11,
                iterations: 4,
            },
            timings_s: [("total".to_owned(), 12.0)].into(),
            facets_change: None,
            warnings: Vec::new(),
            peak_memory_bytes: 1 << 20,
        }
    }

    #[test]
    fn a_result_reads_back() {
        let read: RunResult = serde_json::from_slice(&example().to_json()).expect("a result");
        assert_eq!(read, example());
    }
}
