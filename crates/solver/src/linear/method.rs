//! The methods of solution, and what may be chosen about them.

use super::system::Goal;

/// How to precondition the iteration, from the most exact factor to the smallest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The factor `K = L D Lᵀ` (plain transpose) in double precision: one or two iterations.
    Direct,
    /// The same in single precision, at half of time and memory: three or four iterations.
    DirectSingle,
    /// The factor of `Re K + Im K` in double precision.
    ///
    /// `Re K` and `Im K` are positive semidefinite and their sum positive definite, so the preconditioned spectrum lies
    /// on the segment from j to 1, whatever the mesh, frequency or material: 20 to 30 iterations. In statics
    /// (`Im K = 0`) it is the matrix's own factor.
    RealFactor,
    /// The same in single precision: an eighth of the work and a quarter of the memory of [`Method::Direct`].
    RealFactorSingle,
    /// Incomplete `L D Lᵀ` without fill, in single precision: the memory of the matrix, iterations that grow with the cube
    /// root of the number of unknowns.
    Incomplete,
    /// A factor in single precision for a coarse space, and a smoother of the whole: linear elements on the same mesh for
    /// quadratic ones, smoothed by block Gauss–Seidel; for linear ones the scalar potential in full and aggregates of the
    /// unknowns of `A`, smoothed by an incomplete factor.
    TwoLevel,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Direct,
        Self::DirectSingle,
        Self::RealFactor,
        Self::RealFactorSingle,
        Self::Incomplete,
        Self::TwoLevel,
    ];

    /// Its name in messages and records.
    pub fn name(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::DirectSingle => "direct_single",
            Self::RealFactor => "real_factor",
            Self::RealFactorSingle => "real_factor_single",
            Self::Incomplete => "incomplete",
            Self::TwoLevel => "two_level",
        }
    }

    /// Whether it has a factor of the whole system.
    pub(crate) fn is_complete(self) -> bool {
        !matches!(self, Self::Incomplete | Self::TwoLevel)
    }

    /// What to take where a method fails, more robust and more expensive.
    pub(crate) fn more_robust(self) -> Option<Self> {
        match self {
            Self::TwoLevel | Self::Incomplete => Some(Self::RealFactorSingle),
            Self::RealFactorSingle | Self::DirectSingle => Some(Self::RealFactor),
            Self::RealFactor => Some(Self::Direct),
            Self::Direct => None,
        }
    }
}

/// Who chooses the method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinearSolver {
    /// The program: the cheapest one that fits ([`LinearSolverSettings::factor_bytes`]).
    #[default]
    Automatic,
    /// The user. Where it fails, a more robust one follows as with [`LinearSolver::Automatic`].
    Fixed(Method),
}

/// Whether a factor may serve several designs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reuse {
    /// As long as it costs less than a new one.
    #[default]
    WhileItPays,
    /// Every design has its own, and every solution starts from zero.
    Never,
}

impl LinearSolverSettings {
    /// How far solutions go.
    pub(super) fn goal(&self) -> Goal {
        Goal { tolerance: self.tolerance, required: self.required }
    }
}

/// Whether the matrix is real.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldKind {
    /// Magnetostatics: the matrix is real.
    Static,
    /// Eddy currents: it is complex symmetric.
    Harmonic,
}

/// What to solve with, and how far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearSolverSettings {
    /// The method.
    pub method: LinearSolver,
    /// Relative residual at which the iteration stops [1]. Default 1e-11: two digits below what is required, so that
    /// differences of objectives in a gradient check are not noise.
    pub tolerance: f64,
    /// Relative true residual above which a solution is refused [1], unless it is rounding (`rounding`). Default 1e-9.
    pub required: f64,
    /// Iterations after which the method gives up. Default: ten times what a sound system needs.
    pub max_iterations: Option<usize>,
    /// Counted work of a solution after which the method gives up [ns]. Default: no limit.
    pub most_work: f64,
    /// Bytes of the largest factor that is chosen or fallen back to by the program. Default 4 GiB: a laptop with 8 GiB
    /// holds it beside matrix, mesh and fields.
    pub factor_bytes: usize,
    /// Whether a factor may serve several designs.
    pub reuse: Reuse,
    /// Solutions with the matrix of a design, states and adjoints: what the work of a factor is divided by. Default 2.
    pub solutions: usize,
}

impl Default for LinearSolverSettings {
    fn default() -> Self {
        Self {
            method: LinearSolver::default(),
            tolerance: 1e-11,
            required: 1e-9,
            max_iterations: None,
            most_work: f64::INFINITY,
            factor_bytes: 4 << 30,
            reuse: Reuse::default(),
            solutions: 2,
        }
    }
}
