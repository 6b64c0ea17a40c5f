//! `[analysis.linear_solver]`: how the linear systems are solved.

use serde::Serialize;

use super::choice::choice;
use super::range::Range;
use super::section::Section;

choice! {
    /// The preconditioner of the iteration, or who chooses it.
    pub enum SolverMethod {
        /// The program, by size and element order.
        Automatic = "automatic",
        /// The factor of the matrix in double precision.
        Direct = "direct",
        /// The same in single precision.
        DirectSingle = "direct_single",
        /// The factor of the sum of real and imaginary part.
        RealFactor = "real_factor",
        /// The same in single precision.
        RealFactorSingle = "real_factor_single",
        /// An incomplete factor: little memory, many iterations.
        Incomplete = "incomplete",
        /// Quadratic elements: linear ones on the same mesh, and an incomplete factor.
        TwoLevel = "two_level",
    }
}

choice! {
    /// Whether a factor serves several designs.
    pub enum FactorReuse {
        /// Every design has its own.
        Never = "never",
        /// As long as it costs less than a new one; a resumed run then agrees to the tolerance of the solver only.
        WhileItPays = "while_it_pays",
    }
}

/// Options of the linear solver.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LinearSolver {
    /// Where the ladder of methods begins. Default automatic.
    pub method: SolverMethod,
    /// Largest relative residual of a solution. Default 1e-11: a hundred times below the 1e-9 that every solution is
    /// audited against, so that the gradient is limited by the mesh and not by the solver.
    pub tolerance: f64,
    /// Largest factor that the program takes by itself [GiB]. Default 4: a laptop with 8 GiB holds it beside the rest.
    pub factor_gib: f64,
    /// Whether a factor serves several designs of a run. Default never: an evaluation is then a function of its design, and
    /// a resumed run has the bits of one without a break. Measured gains of the other choice are small.
    pub reuse: FactorReuse,
}

impl Default for LinearSolver {
    fn default() -> Self {
        Self { method: SolverMethod::Automatic, tolerance: 1e-11, factor_gib: 4.0, reuse: FactorReuse::Never }
    }
}

impl LinearSolver {
    pub(super) fn read(section: Section<'_>) -> Self {
        let default = Self::default();
        let method = section.choice("method").unwrap_or(default.method);
        // Below 1e-14 rounding alone is larger; above 1e-9 a solution would fail its audit.
        let tolerance = section.number("tolerance", Range::closed(1e-14, 1e-9)).unwrap_or(default.tolerance);
        let factor_gib = section.number("factor_gib", Range::closed(0.0, 1e6)).unwrap_or(default.factor_gib);
        let reuse = section.choice("reuse").unwrap_or(default.reuse);
        section.finish();
        Self { method, tolerance, factor_gib, reuse }
    }
}
