//! `[analysis]`: which field problem is solved, and how exactly.

use serde::Serialize;

use super::Dimension;
use super::range::Range;
use super::section::Section;

/// The field analysis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Analysis {
    /// Frequency [Hz]; 0: magnetostatic. Required: no value fits most devices.
    pub frequency: f64,
    /// Penalty reluctivity over reluctivity, ν_p / ν. Default 1: the penalised operator then is the Laplacian in
    /// uniform material, which is what iterative solvers like best.
    pub penalty: f64,
    /// How the linear systems are solved.
    pub linear_solver: LinearSolver,
}

/// Options of the linear solver.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LinearSolver {
    /// Largest relative residual of a solution. Default 1e-11: a hundred times below the 1e-9 that every solution is
    /// audited against, so that the gradient is limited by the mesh and not by the solver.
    pub tolerance: f64,
}

impl Default for LinearSolver {
    fn default() -> Self {
        Self { tolerance: 1e-11 }
    }
}

impl Analysis {
    pub(super) fn read(section: &Section<'_>) -> Self {
        let frequency = section.quantity("frequency", Dimension::Frequency, Range::NOT_NEGATIVE);
        let penalty = section.number("penalty", Range::POSITIVE).unwrap_or(1.0);
        let linear_solver = section.table("linear_solver").map(LinearSolver::read).unwrap_or_default();
        Self { frequency: section.need("frequency", frequency, "\"60 Hz\""), penalty, linear_solver }
    }

    /// `2 π f` [rad/s].
    pub fn angular_frequency(&self) -> f64 {
        2.0 * std::f64::consts::PI * self.frequency
    }
}

impl LinearSolver {
    fn read(section: Section<'_>) -> Self {
        let default = Self::default();
        // Below 1e-14 rounding alone is larger; above 1e-9 a solution would fail its audit.
        let tolerance = section.number("tolerance", Range::closed(1e-14, 1e-9)).unwrap_or(default.tolerance);
        section.finish();
        Self { tolerance }
    }
}
