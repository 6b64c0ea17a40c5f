//! What a motion did to the elements: the content of `result.json` and of the table.

use std::collections::BTreeMap;

use fluxmorph_geometry::quality::QualityReport;
use fluxmorph_geometry::tet4::{Point, centroid};
use fluxmorph_geometry::{ElementId, Topology};
use serde::Serialize;

use super::{TuneReport, Walk};
use crate::cli::ExitCode;
use crate::config::Paper;
use crate::output::{RunStatus, StopReason};

/// The result of `fluxmorph morph`. Keys carry their unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MorphReport {
    /// Version of this form: 1.
    pub schema_version: u32,
    /// `morph`.
    pub command: &'static str,
    /// `done` where all cases end on a valid mesh.
    pub status: RunStatus,
    /// `done` or `mesh_limit`.
    pub stop_reason: StopReason,
    /// Which elements qualities are of.
    pub quality_of: &'static str,
    /// The cases; one without a name where the configuration has none.
    pub cases: Vec<CaseReport>,
    /// What the tuner found, if it was asked; the cases are then made with it.
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
    /// Whether the whole motion was made, without an inverted element and not below the least quality.
    pub valid: bool,
    /// Nodes of the mesh.
    pub nodes: usize,
    /// Tetrahedra of the mesh.
    pub tets: usize,
    /// Nodes whose motion is prescribed.
    pub moved_nodes: usize,
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
    /// Share of the motion that was made.
    pub reached: f64,
    /// Increments taken.
    pub increments: usize,
    /// Remedies taken.
    pub rescues: usize,
    /// Published values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paper: Option<Paper>,
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

impl MorphReport {
    /// 0 where every mesh is valid; else 1 for a sweep, whose other rows are worth having, and 4 for a single motion.
    pub fn exit_code(&self) -> ExitCode {
        match self.cases.as_slice() {
            cases if cases.iter().all(|case| case.valid) => ExitCode::Success,
            [_] => ExitCode::Numerical,
            _ => ExitCode::Stopped,
        }
    }
}

impl CaseReport {
    /// Measures a motion.
    pub fn new(
        name: &str,
        walk: &Walk,
        moved_nodes: usize,
        least_quality: f64,
        paper: Option<Paper>,
    ) -> Self {
        let quality = |points: &[Point]| {
            QualityReport::of_points(&walk.topology, points, &walk.body)
                .expect("an elastic body has elements")
        };
        let (before, after) = (quality(&walk.before), quality(&walk.after));
        let step = walk.inversion.step;
        let first = walk.inversion.element.map(|e| (e, walk.topology.tet(e)));
        Self {
            name: name.to_owned(),
            valid: walk.reached >= 1.0 && walk.inverted == 0 && after.worst >= least_quality,
            nodes: walk.topology.node_count(),
            tets: walk.topology.tets().len(),
            moved_nodes,
            equations: walk.equations,
            inverted: walk.inverted,
            worst_element: WorstElement {
                element: after.worst_element.0,
                region: region(&walk.topology, after.worst_element),
                at_m: after.worst_centroid,
            },
            inversion: Inversion {
                step: step.is_finite().then_some(step),
                element: first.map(|(e, _)| e.0),
                region: first.map(|(e, _)| region(&walk.topology, e)),
                at_m: first.map(|(_, tet)| centroid(tet.map(|n| walk.before[n.index()]))),
            },
            before: QualityShares::new(&before),
            after: QualityShares::new(&after),
            reached: walk.reached,
            increments: walk.increments,
            rescues: walk.rescues,
            paper,
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

fn region(topology: &Topology, element: ElementId) -> String {
    topology.region_names()[topology.region_of()[element.index()].index()].clone()
}
