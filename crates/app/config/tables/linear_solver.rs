//! `[analysis.linear_solver]`: how the linear systems are solved.

use crate::config::table::table;
use crate::config::value::choice::choice;
use crate::config::value::range::Range;

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
        /// Nodal elements: a factor of a coarse space, and for the whole an incomplete one, or block Gauss–Seidel where they are of
        /// second order.
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

table! {
    /// How the linear systems are solved. The program begins with the cheapest method that fits; one that fails is followed by
    /// a more robust one, with a notice. `docs/performance.md` tells more.
    ///
    /// ```toml
    /// [analysis.linear_solver]
    /// method = "direct"
    /// factor_gib = 12
    /// ```
    pub struct LinearSolver: Default {
        /// Where the ladder of methods begins.
        method: SolverMethod = WORD => SolverMethod::Automatic;
        /// Largest relative residual of a solution. The default is a hundred times below the 1e-9 that every state is
        /// audited against, so that values are limited by the mesh and not by the solver. Adjoint problems of a search and the
        /// fields of checks at its end, on finer meshes and by other elements, go to 1e-7, with an incomplete factor to 1e-9.
        tolerance: f64 = number(TOLERANCES) => 1e-11;
        /// Largest factor of a matrix that the program takes by itself, in GiB; where none fits, it takes the incomplete one. A
        /// laptop with 8 GiB holds the default beside the rest.
        factor_gib: f64 = number(Range::closed(0.0, 1e6)) => 4.0;
        /// Whether the factor of a matrix serves several designs of a run. `fluxmorph gradient` always works as with
        /// `"while_it_pays"`.
        reuse: FactorReuse = WORD => FactorReuse::Never;
    }
}
