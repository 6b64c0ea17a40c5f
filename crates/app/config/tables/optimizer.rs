//! `[optimizer]`: the algorithm and when it stops.

use fluxmorph_optimizer::driver::Settings;

use crate::config::table::table;
use crate::config::value::choice::choice;
use crate::config::value::range::Range;

/// Most evaluations that a run may be given.
pub const MOST_EVALUATIONS: usize = 1_000_000;

/// Shares of the range for a first step: no method takes more than half of it.
const FIRST_STEPS: Range = Range::open(0.0, 0.5);

/// Fractions of a whole.
const FRACTIONS: Range = Range::half_open(0.0, 1.0);

table! {
    /// The algorithm and when it stops.
    ///
    /// ```toml
    /// [optimizer]
    /// algorithm = "mma"
    /// max_evaluations = 20
    /// max_time = "2 h"
    /// ```
    pub struct Optimizer: Default {
        /// Method of NLopt. The default keeps to the bounds, needs no line search and suits many variables of which most end at
        /// their bounds. Where a deviation is made small that can nearly vanish (`target_field`, `homogeneity`, `multipole_content`)
        /// and nothing is constrained, `lbfgs` finds a fraction of what the default does. With `[[constraints]]`: `mma`, `ccsaq` or
        /// `slsqp`, of which the last is the one for such deviations.
        algorithm: Algorithm = WORD => Settings::DEFAULT.algorithm;
        /// Most evaluations of the objective with its gradient.
        max_evaluations: usize = integer(1, MOST_EVALUATIONS) => Settings::DEFAULT.max_evaluations;
        /// No evaluation is started after this time [s]. Default: no limit.
        max_time: Option<f64> = quantity(Duration, POSITIVE);
        /// Stop when the objective changes by less than this fraction between iterations, and the gradient, less what bounds and
        /// constraints hold of it, promises no more than ten times that: while it does, the search goes on from its best design, and
        /// where it promises more than a hundred times that with a tenth of the tolerance, three times at most. 0: off. The default
        /// is well below the error of the mesh.
        ftol_rel: f64 = number(FRACTIONS) => Settings::DEFAULT.ftol_rel;
        /// Stop when all variables change by less than this fraction; 0: off. It is off by default, since the variables of a
        /// design at its bounds get there long before the rest has settled.
        xtol_rel: f64 = number(FRACTIONS) => Settings::DEFAULT.xtol_rel;
        /// How far a variable may move in the first step of a search, as a share of the range that it may search; less where
        /// the gradient promises more than half of the objective, and half of it with `ccsaq`, whose second step is long. Under
        /// constraints without room `mma` steps less far. The steps after it are the method's own.
        first_step: f64 = number(FIRST_STEPS) => Settings::DEFAULT.first_step;
        /// Least quality (Eq. 4) of an element that a design may have. A design below it is not evaluated: the search goes on
        /// nearer to the best one. Without it the room that elements keep is what limits a design:
        /// a flat element of a thin layer may then have a quality of 1e-4.
        minimum_quality: Option<f64> = number(FRACTIONS);
    }
}

choice! {
    /// Algorithms of NLopt.
    pub use fluxmorph_optimizer::nlopt as Algorithm {
        /// Method of moving asymptotes.
        Mma = "mma",
        /// Conservative convex separable approximation with quadratic terms.
        Ccsaq = "ccsaq",
        /// Sequential least-squares quadratic programming.
        Slsqp = "slsqp",
        /// Limited-memory BFGS.
        Lbfgs = "lbfgs",
        /// Truncated Newton with restarts and preconditioning. Most of its evaluations are differences of the gradient over a hair's
        /// breadth, products with the Hessian that leave the design where it is.
        Tnewton = "tnewton",
        /// Limited-memory variable metric of rank 2.
        Var2 = "var2",
    }
}

impl Optimizer {
    /// Method and limits for the driver.
    pub fn settings(&self) -> Settings {
        Settings {
            algorithm: self.algorithm,
            max_evaluations: self.max_evaluations,
            max_time: self.max_time,
            ftol_rel: self.ftol_rel,
            xtol_rel: self.xtol_rel,
            first_step: self.first_step,
        }
    }
}
