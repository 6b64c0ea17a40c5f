//! Why an optimisation ended.

use serde::{Deserialize, Serialize};

/// Why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum StopReason {
    /// The objective changed by less than `ftol_rel`.
    ObjectiveConverged,
    /// The design changed by less than `xtol_rel`.
    StepConverged,
    /// `max_evaluations` was reached.
    MaxEvaluations,
    /// `max_time` was reached.
    MaxTime,
    /// A signal arrived.
    Interrupted,
    /// A [`Supervisor`](super::Supervisor) has ended this search for another one: the run has not ended.
    #[serde(skip)]
    Superseded,
    /// The mesh or the trust region held the search back.
    #[serde(rename = "mesh_limited", alias = "mesh_limit")]
    MeshLimited,
    /// Rounding allows the method no further step.
    RoundoffLimited,
    /// The method can make no further step.
    MethodStalled,
    /// The method has converged, but no design keeps all constraints.
    Infeasible,
    /// A field could not be computed; the best design before it is saved.
    NumericalFailure,
    /// A single analysis is complete.
    Done,
}

impl StopReason {
    /// Whether the method ended because there was nothing more to gain.
    pub fn is_converged(self) -> bool {
        matches!(self, Self::ObjectiveConverged | Self::StepConverged)
    }

    /// Whether the search has come to its end, before any limit.
    pub(super) fn is_of_method(self) -> bool {
        matches!(
            self,
            Self::ObjectiveConverged
                | Self::StepConverged
                | Self::RoundoffLimited
                | Self::MethodStalled
                | Self::MeshLimited
        )
    }

    /// In words, for the summary.
    pub fn describe(self) -> &'static str {
        match self {
            Self::ObjectiveConverged => "the objective has converged",
            Self::StepConverged => "the design has converged",
            Self::MaxEvaluations => "all evaluations are used",
            Self::MaxTime => "the time is over",
            Self::Interrupted => "interrupted",
            Self::Superseded => "another search follows",
            Self::MeshLimited => "the mesh held the search back: not converged",
            Self::RoundoffLimited => "rounding allows the method no further step: not converged",
            Self::MethodStalled => "the method can make no further step",
            Self::Infeasible => "no design keeps all constraints",
            Self::NumericalFailure => "a field could not be computed",
            Self::Done => "done",
        }
    }
}
