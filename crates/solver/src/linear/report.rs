//! What every solution of a linear system comes with.

/// How a solution was reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearSolverReport {
    /// Iterations done.
    pub iterations: usize,
    /// True relative residual `|b − K x| / |b|`.
    pub residual: f64,
}
