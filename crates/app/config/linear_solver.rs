//! `[analysis.linear_solver]`: how the linear systems are solved.

use schemars::JsonSchema;
use serde::Serialize;

use super::choice::choice;
use super::range::Range;
use super::section::Section;
use crate::schema::form::number;

/// Below 1e-14 rounding alone is larger; above 1e-9 a solution would fail its audit.
const TOLERANCES: Range = Range::closed(1e-14, 1e-9);

choice! {
    /// The preconditioner of the iteration, or who chooses it.
    pub enum SolverMethod {
        /// The cheapest that fits, by size and element order.
        Automatic = "automatic",
        /// The factor of the matrix in double precision.
        Direct = "direct",
        /// The factor of the matrix in single precision.
        DirectSingle = "direct_single",
        /// The factor of the sum of real and imaginary part, in double precision.
        RealFactor = "real_factor",
        /// The factor of the sum of real and imaginary part, in single precision.
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
        /// Every design has its own factor: an evaluation is a function of its design, and a resumed run has the bits of one
        /// without a break.
        Never = "never",
        /// A factor serves several designs as long as that costs less than a new one. The measured gain is small, and a resumed
        /// run agrees to the tolerance of the solver only.
        WhileItPays = "while_it_pays",
    }
}

/// How the linear systems are solved. The program begins with the cheapest method that fits; one that fails is followed by
/// a more robust one, with a notice. `docs/performance.md` tells more.
///
/// ```toml
/// [analysis.linear_solver]
/// method = "direct"
/// factor_gib = 12
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default)]
pub struct LinearSolver {
    /// Where the ladder of methods begins.
    pub method: SolverMethod,
    /// Largest relative residual of a solution. The default is a hundred times below the 1e-9 that every solution is
    /// audited against, so that the gradient is limited by the mesh and not by the solver.
    #[schemars(transform = number(TOLERANCES))]
    pub tolerance: f64,
    /// Largest factor of a matrix that the program takes by itself, in GiB; where none fits, it takes the incomplete one. A
    /// laptop with 8 GiB holds the default beside the rest.
    #[schemars(transform = number(Range::closed(0.0, 1e6)))]
    pub factor_gib: f64,
    /// Whether the factor of a matrix serves several designs of a run. `fluxmorph gradient` always works as with
    /// `"while_it_pays"`.
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
        let tolerance = section.number("tolerance", TOLERANCES).unwrap_or(default.tolerance);
        let factor_gib = section.number("factor_gib", Range::closed(0.0, 1e6)).unwrap_or(default.factor_gib);
        let reuse = section.choice("reuse").unwrap_or(default.reuse);
        section.finish();
        Self { method, tolerance, factor_gib, reuse }
    }
}
