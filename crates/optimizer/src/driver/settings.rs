//! Method and limits of an optimisation.

use crate::nlopt::Algorithm;

/// Relative gain below which a search has gained nothing, where `ftol_rel` is finer.
pub(super) const LEAST_GAIN: f64 = 1e-6;

/// Method and limits of an optimisation.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Method of NLopt.
    pub algorithm: Algorithm,
    /// Most evaluations of the objective with its gradient.
    pub max_evaluations: usize,
    /// No evaluation is started after this time [s].
    pub max_time: Option<f64>,
    /// Stop when the objective changes by less than this fraction between iterations; 0 is off.
    pub ftol_rel: f64,
    /// Stop when all variables change by less than this fraction; 0 is off.
    pub xtol_rel: f64,
    /// Largest change of a variable in the first step of a search, as a share of the range that it may search.
    pub first_step: f64,
}

impl Settings {
    /// MMA keeps to the bounds, needs no line search and suits many variables. The objective's tolerance is well below the
    /// error of a mesh; that of the variables is off, since those of a design at its bounds get there long before the rest
    /// has settled. After a first step of a tenth MMA's second one is at most 29 % of the range.
    pub const DEFAULT: Self = Self {
        algorithm: Algorithm::Mma,
        max_evaluations: 30,
        max_time: None,
        ftol_rel: 1e-3,
        xtol_rel: 0.0,
        first_step: 0.1,
    };

    /// Relative gain below which a search has gained nothing.
    pub(super) fn least_gain(&self) -> f64 {
        LEAST_GAIN.max(self.ftol_rel)
    }
}
