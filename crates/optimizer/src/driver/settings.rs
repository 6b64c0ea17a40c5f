//! Method and limits of an optimisation.

use crate::nlopt::Algorithm;

/// Method and limits of an optimisation.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Method of NLopt. Default: MMA, which keeps to the bounds, needs no line search and suits many variables.
    pub algorithm: Algorithm,
    /// Most evaluations of the objective with its gradient. Default 30.
    pub max_evaluations: usize,
    /// No evaluation is started after this time [s]. Default: no limit.
    pub max_time: Option<f64>,
    /// Stop when the objective changes by less than this fraction between iterations; 0 is off. Default 1e-3, well below
    /// the error of a mesh.
    pub ftol_rel: f64,
    /// Stop when all variables change by less than this fraction; 0 is off. Default 0: the variables of a design at its
    /// bounds get there long before the rest has settled.
    pub xtol_rel: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { algorithm: Algorithm::Mma, max_evaluations: 30, max_time: None, ftol_rel: 1e-3, xtol_rel: 0.0 }
    }
}
