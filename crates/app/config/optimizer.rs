//! `[optimizer]`: the algorithm and when it stops.

use fluxmorph_optimizer::driver::Settings;
use fluxmorph_optimizer::nlopt;
use schemars::JsonSchema;
use serde::Serialize;

use super::Dimension;
use super::choice::choice;
use super::range::Range;
use super::section::Section;
use crate::schema::form::{integer, number, quantity};

/// Most evaluations that a run may be given.
pub const MOST_EVALUATIONS: usize = 1_000_000;

/// Fractions of a whole.
const FRACTIONS: Range = Range::half_open(0.0, 1.0);

/// The algorithm and when it stops.
///
/// ```toml
/// [optimizer]
/// algorithm = "mma"
/// max_evaluations = 20
/// max_time = "2 h"
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default)]
pub struct Optimizer {
    /// Method of NLopt. The default keeps to the bounds, needs no line search and suits many variables. With
    /// `[[constraints]]`: `mma`, `ccsaq` or `slsqp`.
    pub algorithm: Algorithm,
    /// Most evaluations of the objective with its gradient.
    #[schemars(transform = integer(1, MOST_EVALUATIONS))]
    pub max_evaluations: usize,
    /// No evaluation is started after this time [s]. Default: no limit.
    #[schemars(transform = quantity(Dimension::Duration, Range::POSITIVE))]
    pub max_time: Option<f64>,
    /// Stop when the objective changes by less than this fraction between iterations; 0: off. The default is well below the
    /// error of the mesh.
    #[schemars(transform = number(FRACTIONS))]
    pub ftol_rel: f64,
    /// Stop when all variables change by less than this fraction; 0: off. It is off by default, since the variables of a
    /// design at its bounds get there long before the rest has settled.
    #[schemars(transform = number(FRACTIONS))]
    pub xtol_rel: f64,
    /// Least quality (Eq. 4) of an element that a design may have, and so of the reference mesh that a round starts from. A
    /// design below it is not evaluated: a round ends. Default: a twentieth of the worst quality of the undeformed mesh,
    /// since layered meshes start with a low one.
    #[schemars(transform = number(FRACTIONS))]
    pub minimum_quality: Option<f64>,
}

choice! {
    /// Algorithms of NLopt.
    pub enum Algorithm {
        /// Method of moving asymptotes.
        Mma = "mma",
        /// Conservative convex separable approximation with quadratic terms.
        Ccsaq = "ccsaq",
        /// Sequential least-squares quadratic programming.
        Slsqp = "slsqp",
        /// Limited-memory BFGS.
        Lbfgs = "lbfgs",
        /// Truncated Newton with restarts and preconditioning.
        Tnewton = "tnewton",
        /// Limited-memory variable metric of rank 2.
        Var2 = "var2",
    }
}

impl Default for Optimizer {
    fn default() -> Self {
        Self {
            algorithm: Algorithm::Mma,
            max_evaluations: 30,
            max_time: None,
            ftol_rel: 1e-3,
            xtol_rel: 0.0,
            minimum_quality: None,
        }
    }
}

impl From<Algorithm> for nlopt::Algorithm {
    fn from(algorithm: Algorithm) -> Self {
        match algorithm {
            Algorithm::Mma => Self::Mma,
            Algorithm::Ccsaq => Self::Ccsaq,
            Algorithm::Slsqp => Self::Slsqp,
            Algorithm::Lbfgs => Self::Lbfgs,
            Algorithm::Tnewton => Self::Tnewton,
            Algorithm::Var2 => Self::Var2,
        }
    }
}

impl Algorithm {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Mma, Self::Ccsaq, Self::Slsqp, Self::Lbfgs, Self::Tnewton, Self::Var2];

    /// Whether the method keeps inequality constraints.
    pub fn takes_constraints(self) -> bool {
        matches!(self, Self::Mma | Self::Ccsaq | Self::Slsqp)
    }
}

impl Optimizer {
    /// Method and limits for the driver.
    pub fn settings(&self) -> Settings {
        Settings {
            algorithm: self.algorithm.into(),
            max_evaluations: self.max_evaluations,
            max_time: self.max_time,
            ftol_rel: self.ftol_rel,
            xtol_rel: self.xtol_rel,
        }
    }

    /// Reads the table of a configuration with so many constraints.
    pub(super) fn read(section: Section<'_>, constraints: usize) -> Self {
        let default = Self::default();
        let tolerance = |key| section.number(key, FRACTIONS);
        let optimizer = Self {
            algorithm: section.choice("algorithm").unwrap_or(default.algorithm),
            max_evaluations: section
                .integer("max_evaluations", 1, MOST_EVALUATIONS)
                .unwrap_or(default.max_evaluations),
            max_time: section.quantity("max_time", Dimension::Duration, Range::POSITIVE),
            ftol_rel: tolerance("ftol_rel").unwrap_or(default.ftol_rel),
            xtol_rel: tolerance("xtol_rel").unwrap_or(default.xtol_rel),
            minimum_quality: tolerance("minimum_quality"),
        };
        if constraints > 0 && !optimizer.algorithm.takes_constraints() {
            let message = format!("`{}` cannot keep constraints", optimizer.algorithm.name());
            section.wrong("algorithm", message, "mma, ccsaq or slsqp, or no [[constraints]]");
        }
        section.finish();
        optimizer
    }
}
