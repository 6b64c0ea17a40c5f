//! What happens to the mesh between evaluations: new rounds, smaller trust regions and fallbacks of the mesh motion.

use fluxmorph_remesh::{Fallback, FallbackReport, StepEvent};
use serde::{Deserialize, Serialize};

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RoundKind {
    /// A continuation step towards the first design, which is too far away for a single one.
    #[serde(rename = "approach")]
    Continuation,
    /// The best mesh became the reference of a new round.
    Round,
    /// The trust region shrank.
    SmallerSteps,
    /// Stiffness follows element size in another way.
    Policy,
    /// The interior nodes were smoothed.
    Smoothing,
    /// The mesh was moved again from the undeformed one, with all nodes constrained to the design's axis.
    Guided,
}

/// One such event; an entry of `rounds` in `result.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RoundEvent {
    /// The round after it.
    pub round: usize,
    /// What happened.
    pub kind: RoundKind,
    /// The evaluation whose mesh is the reference of the round; `None` before the first one.
    pub evaluation: Option<usize>,
    /// Worst quality of the reference mesh (Eq. 4) before and after.
    pub worst_quality: [f64; 2],
    /// Share of the refused step that keeps the limits, before and after; `None` where no step was refused.
    pub admitted: Option<[f64; 2]>,
    /// How stiffness follows element size from now on.
    pub stiffness: String,
    /// The trust region: how far the variables may go down and up from there, as shares of the largest distance of a
    /// variable to its lower and to its upper bound.
    pub reach: [f64; 2],
    /// Why.
    pub cause: String,
}

impl RoundEvent {
    /// A continuation step towards the first design.
    pub fn of_continuation(event: &StepEvent) -> Self {
        let (round, policy, quality) = match *event {
            StepEvent::Stepped { round, policy, quality, .. } => (round + 1, policy, [quality; 2]),
            StepEvent::FellBack { round, policy, report } => (round, policy, report.quality),
        };
        let event_of_step = Self {
            round,
            kind: RoundKind::Continuation,
            evaluation: None,
            worst_quality: quality,
            admitted: None,
            stiffness: policy.name().to_owned(),
            reach: [1.0; 2],
            cause: "the design lies too far from the undeformed mesh for a single step".to_owned(),
        };
        match event {
            StepEvent::Stepped { .. } => event_of_step,
            StepEvent::FellBack { report, .. } => event_of_step.with(report),
        }
    }

    /// The same with what a fallback of the mesh motion did.
    #[must_use]
    pub fn with(self, report: &FallbackReport) -> Self {
        let kind = match report.fallback {
            Fallback::Policy { .. } => RoundKind::Policy,
            Fallback::Smoothing { .. } => RoundKind::Smoothing,
            Fallback::AxisConstraint { .. } => RoundKind::Guided,
        };
        let stiffness = match report.fallback {
            Fallback::Policy { to, .. } => to.name().to_owned(),
            _ => self.stiffness,
        };
        Self { kind, stiffness, worst_quality: report.quality, admitted: Some(report.admissible), ..self }
    }

    /// One line for a reader.
    pub fn describe(&self) -> String {
        let Self { round, worst_quality: [before, after], reach: [down, up], cause, .. } = self;
        let reference = match self.evaluation {
            Some(evaluation) => format!("reference mesh of evaluation {evaluation}"),
            None => "before the first evaluation".to_owned(),
        };
        let percent = |share: &f64| 100.0 * share;
        match self.kind {
            RoundKind::Continuation => {
                format!("round {round} of the continuation to the design: worst quality {after:.4}")
            }
            RoundKind::Round => format!(
                "round {round}: {cause}; {reference}, worst quality {after:.4}, trust region: {:.1} % of the bound range \
                 downwards, {:.1} % upwards",
                percent(down),
                percent(up)
            ),
            RoundKind::SmallerSteps => format!(
                "{cause}; gained less than the relative tolerance since the search was restarted; smaller trust region: \
                 {:.2} % of the bound range downwards, {:.2} % upwards",
                percent(down),
                percent(up)
            ),
            RoundKind::Policy => {
                let [from, to] = self.admitted.unwrap_or([f64::NAN; 2]);
                format!(
                    "{cause}; round {round} with stiffness `{}`: {to:.3} of the refused step can be taken, was {from:.3}",
                    self.stiffness
                )
            }
            RoundKind::Guided => format!(
                "{cause}; round {round} with all nodes moving along the design's axis: worst quality {after:.4}, was \
                 {before:.4}; its field is computed anew"
            ),
            RoundKind::Smoothing => format!(
                "{cause}; round {round} with smoothed interior nodes: worst quality {after:.4}, was {before:.4}; its field is \
                 computed anew"
            ),
        }
    }
}
