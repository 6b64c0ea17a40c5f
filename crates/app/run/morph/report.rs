//! What a motion did to the elements: the content of `result.json` and of the table.

use std::collections::BTreeMap;

use fluxmorph_geometry::quality::QualityReport;
use fluxmorph_geometry::tet4::{Point, centroid};
use fluxmorph_optimizer::driver::StopReason;
use serde::Serialize;

use super::{MovedMesh, TuneReport};
use crate::build::MotionSetup;
use crate::config::Paper;
use crate::error::Error;
use crate::exit_code::ExitCode;
use crate::files::RunStatus;

/// The result of `fluxmorph morph`. Keys carry their unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MorphReport {
    /// Version of this form: 1.
    pub schema_version: u32,
    /// `morph`.
    pub command: &'static str,
    /// `done` where all cases end on a valid mesh; `failed` where that of a single motion is inverted; else `stopped`, or
    /// `interrupted`.
    pub status: RunStatus,
    /// `done`, `mesh_limited` or `interrupted`.
    pub stop_reason: StopReason,
    /// Which elements qualities are of.
    pub quality_of: &'static str,
    /// The cases; one without a name where the configuration has none.
    pub cases: Vec<CaseReport>,
    /// What the tuner found, if it was run; the cases are then computed with it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tuned: Option<TuneReport>,
    /// Wall time [s].
    pub timings_s: BTreeMap<String, f64>,
    /// Most memory held [bytes].
    pub peak_memory_bytes: u64,
}

/// One motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseReport {
    /// Name of the case, or the title of the configuration.
    pub name: String,
    /// Whether the whole motion was reached, without an inverted element and not below the least quality.
    pub valid: bool,
    /// Why the motion could not be computed; without it there is a result.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// Nodes of the mesh.
    pub nodes: usize,
    /// Tetrahedra of the mesh.
    pub tets: usize,
    /// Nodes whose motion is prescribed.
    pub moved_nodes: usize,
    /// The result; its keys are among those of the case.
    #[serde(flatten)]
    pub result: Option<CaseResult>,
    /// Published values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paper: Option<Paper>,
}

/// What came out of one motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseResult {
    /// Number of equations of the elastic body.
    pub equations: usize,
    /// Quality before.
    pub before: QualityShares,
    /// Quality after.
    pub after: QualityShares,
    /// Elements without a positive volume after, of the whole mesh.
    pub inverted: usize,
    /// The worst element after.
    pub worst_element: WorstElement,
    /// First inversion along the whole motion in one straight step.
    pub inversion: Inversion,
    /// Share of the motion that was reached.
    pub reached: f64,
    /// Newton steps taken; none by the linear law.
    pub newton_steps: usize,
}

/// How the quality of the body's elements is distributed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct QualityShares {
    /// Elements of the body.
    pub elements: usize,
    /// Worst quality, negative for an inverted element.
    pub worst: f64,
    /// Elements with q ≤ 0.3.
    pub poor: usize,
    /// Elements with 0.3 < q < 0.6.
    pub fair: usize,
    /// Elements with q ≥ 0.6.
    pub good: usize,
    /// The same as shares of the body's elements [%].
    pub shares_percent: [f64; 3],
}

/// The worst element.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WorstElement {
    /// Its number.
    pub element: u32,
    /// Its region.
    pub region: String,
    /// Its centroid after the motion [m].
    pub at_m: Point,
}

/// The first inversion along a motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Inversion {
    /// Multiple of the motion; `null` if nothing ever inverts.
    pub step: Option<f64>,
    /// The element.
    pub element: Option<u32>,
    /// Its region.
    pub region: Option<String>,
    /// Its centroid before the motion [m].
    pub at_m: Option<Point>,
}

/// Status and reason of motions that were all tried.
///
/// A single motion that leaves inverted elements has failed; a sweep has stopped at a limit, since its other rows are worth
/// having, and so has a motion that goes no further and leaves a valid mesh.
fn verdict(cases: &[CaseReport]) -> (RunStatus, StopReason) {
    let inverted = |case: &CaseReport| case.result.as_ref().is_some_and(|result| result.inverted > 0);
    match cases {
        cases if cases.iter().all(|case| case.valid) => (RunStatus::Done, StopReason::Done),
        [case] if inverted(case) => (RunStatus::Failed, StopReason::MeshLimited),
        _ => (RunStatus::Stopped, StopReason::MeshLimited),
    }
}

impl MorphReport {
    /// Of the cases, none of them left out; without the tuner, and with no time and memory.
    pub(super) fn of(cases: Vec<CaseReport>) -> Self {
        let (status, stop_reason) = verdict(&cases);
        Self {
            schema_version: 1,
            command: "morph",
            status,
            stop_reason,
            quality_of: "elastic body",
            cases,
            tuned: None,
            timings_s: BTreeMap::new(),
            peak_memory_bytes: 0,
        }
    }

    /// 0 where every mesh is valid, 4 where that of a single motion is inverted, that of a signal where one came; else 1.
    pub fn exit_code(&self) -> ExitCode {
        match self.status {
            RunStatus::Failed => ExitCode::Numerical,
            _ => self.stop_reason.into(),
        }
    }
}

impl CaseReport {
    /// A motion with its result.
    pub fn with_result(name: &str, setup: &MotionSetup, motion: &MovedMesh, least_quality: f64) -> Self {
        let result = CaseResult::new(motion);
        let valid = motion.reached >= 1.0 && motion.inverted == 0 && result.after.worst >= least_quality;
        Self { valid, result: Some(result), ..Self::of(name, setup) }
    }

    /// A motion that could not be computed.
    pub fn failed(name: &str, setup: &MotionSetup, error: &Error) -> Self {
        Self { error: Some(error.to_string()), ..Self::of(name, setup) }
    }

    fn of(name: &str, setup: &MotionSetup) -> Self {
        let topology = setup.mesh.topology();
        Self {
            name: name.to_owned(),
            valid: false,
            error: None,
            nodes: topology.node_count(),
            tets: topology.tets().len(),
            moved_nodes: setup.path.nodes().len(),
            result: None,
            paper: None,
        }
    }

    /// The same with published values.
    #[must_use]
    pub fn with_paper(self, paper: Option<Paper>) -> Self {
        Self { paper, ..self }
    }
}

impl CaseResult {
    /// Measures a motion.
    fn new(motion: &MovedMesh) -> Self {
        let topology = &motion.topology;
        let quality = |points: &[Point]| {
            QualityReport::of_points(topology, points, &motion.body).expect("an elastic body has elements")
        };
        let (before, after) = (quality(&motion.before), quality(&motion.after));
        let step = motion.inversion.step;
        let first = motion.inversion.element.map(|e| (e, topology.tet(e)));
        Self {
            equations: motion.equations,
            inverted: motion.inverted,
            worst_element: WorstElement {
                element: after.worst_element.0,
                region: topology.region_name_at(after.worst_element).to_owned(),
                at_m: after.worst_centroid,
            },
            inversion: Inversion {
                step: step.is_finite().then_some(step),
                element: first.map(|(e, _)| e.0),
                region: first.map(|(e, _)| topology.region_name_at(e).to_owned()),
                at_m: first.map(|(_, tet)| centroid(tet.map(|n| motion.before[n.index()]))),
            },
            before: QualityShares::new(&before),
            after: QualityShares::new(&after),
            reached: motion.reached,
            newton_steps: motion.newton_steps,
        }
    }
}

impl QualityShares {
    fn new(report: &QualityReport) -> Self {
        Self {
            elements: report.elements,
            worst: report.worst,
            poor: report.poor,
            fair: report.fair,
            good: report.good,
            shares_percent: report.shares().map(|share| 100.0 * share),
        }
    }
}
