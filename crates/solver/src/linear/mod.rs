//! The linear systems `K x = b` with complex symmetric `K`: the one place where a solver is chosen.
//!
//! State and adjoint share the matrix, hence everything [`PreparedSystem`] holds. What a method needs of the pattern
//! alone is made once a run in [`SystemAnalysis`]. Every solution is judged by its true residual. A further backend is
//! a variant of [`LinearSolver`] and a file beside [`cocg`].

pub mod cocg;

use std::sync::Arc;

use fluxmorph_geometry::fem::csr::CsrStructure;
use fluxmorph_geometry::fem::{Cholesky, CholeskyAnalysis, CsrMatrix, c64, norm};

use crate::error::SolverError;

/// Methods of solution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinearSolver {
    /// Conjugate orthogonal conjugate gradients, preconditioned with the real Cholesky factor of `Re K + Im K`.
    ///
    /// `Re K` and `Im K` are positive semidefinite and their sum positive definite, so the preconditioned spectrum lies
    /// on the segment from j to 1, whatever the mesh, frequency or material: 20 to 30 iterations. In statics
    /// (`Im K = 0`) the factor is the matrix's own and one iteration suffices.
    #[default]
    CocgCholesky,
}

/// What to solve with, and how far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearSolverSettings {
    /// The method.
    pub method: LinearSolver,
    /// Relative residual at which the iteration stops [1]. Default 1e-11: two digits below what is required, so that
    /// differences of objectives in a gradient check are not noise.
    pub tolerance: f64,
    /// Relative true residual above which a solution is refused [1]. Default 1e-9.
    pub required: f64,
    /// Iterations after which the method gives up. Default 300: ten times what a sound system needs.
    pub max_iterations: usize,
}

impl Default for LinearSolverSettings {
    fn default() -> Self {
        Self { method: LinearSolver::default(), tolerance: 1e-11, required: 1e-9, max_iterations: 300 }
    }
}

/// How a solution was reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearSolverReport {
    /// Iterations done.
    pub iterations: usize,
    /// True relative residual `|b − K x| / |b|`.
    pub residual: f64,
}

/// What the method needs of the pattern alone.
#[derive(Debug)]
pub struct SystemAnalysis {
    settings: LinearSolverSettings,
    cholesky: Arc<CholeskyAnalysis>,
}

impl SystemAnalysis {
    /// Analyses a pattern for the chosen method.
    ///
    /// # Errors
    /// [`SolverError::Mesh`] when the symbolic factorisation does not fit.
    pub fn new(structure: &Arc<CsrStructure>, settings: LinearSolverSettings) -> Result<Self, SolverError> {
        Ok(Self { settings, cholesky: CholeskyAnalysis::new(structure)? })
    }

    /// Bytes of the numeric factor.
    pub fn factor_bytes(&self) -> usize {
        self.cholesky.factor_entries() * size_of::<f64>()
    }
}

/// A matrix ready to be solved with, for any number of right sides.
#[derive(Debug)]
pub struct PreparedSystem {
    matrix: CsrMatrix<c64>,
    preconditioner: Cholesky,
    settings: LinearSolverSettings,
}

impl PreparedSystem {
    /// Prepares the method for a matrix with the analysed pattern.
    ///
    /// # Errors
    /// [`SolverError::Mesh`] when the factorisation fails: the system is singular (see its message).
    pub fn new(analysis: &SystemAnalysis, matrix: CsrMatrix<c64>) -> Result<Self, SolverError> {
        let sum = CsrMatrix {
            structure: Arc::clone(&matrix.structure),
            values: matrix.values.iter().map(|v| v.re + v.im).collect(),
        };
        let preconditioner = Cholesky::new(&analysis.cholesky, &sum)?;
        Ok(Self { matrix, preconditioner, settings: analysis.settings })
    }

    /// The matrix.
    pub fn matrix(&self) -> &CsrMatrix<c64> {
        &self.matrix
    }

    /// Solves `K x = b`.
    ///
    /// # Errors
    /// [`SolverError::NotConverged`] when the true residual stays above the required one,
    /// [`SolverError::NotFinite`] for a right side with a value that is not finite.
    pub fn solve(&self, right_side: &[c64]) -> Result<(Vec<c64>, LinearSolverReport), SolverError> {
        let scale = norm(right_side);
        if !scale.is_finite() {
            return Err(SolverError::NotFinite { what: "norm of the right side", value: scale });
        }
        let mut x = vec![c64::default(); right_side.len()];
        if scale == 0.0 {
            return Ok((x, LinearSolverReport { iterations: 0, residual: 0.0 }));
        }
        let LinearSolverSettings { method, tolerance, required, max_iterations } = self.settings;
        let LinearSolver::CocgCholesky = method;
        let mut iterations = 0;
        let mut residual = 1.0;
        // The residual of the recurrence drifts from the true one: restart from the true one where they part.
        while iterations < max_iterations {
            let outcome = cocg::solve(
                &self.matrix,
                right_side,
                &mut x,
                |r, z| self.precondition(r, z),
                tolerance * scale,
                max_iterations - iterations,
            );
            iterations += outcome.iterations;
            let before = residual;
            residual = self.residual(right_side, &x) / scale;
            let settled = residual <= required || outcome.iterations == 0;
            if settled || !residual.is_finite() || residual > 0.1 * before {
                break;
            }
        }
        if residual <= required {
            return Ok((x, LinearSolverReport { iterations, residual }));
        }
        let cause = if residual.is_finite() {
            "the mesh may hold nearly flat elements, or the material data span too many orders of magnitude"
        } else {
            "the iteration broke down; a coefficient or coordinate is not finite"
        };
        Err(SolverError::NotConverged { residual, required, iterations, cause })
    }

    fn residual(&self, right_side: &[c64], x: &[c64]) -> f64 {
        let mut r = vec![c64::default(); x.len()];
        self.matrix.mul(x, &mut r);
        for (r, b) in r.iter_mut().zip(right_side) {
            *r = b - *r;
        }
        norm(&r)
    }

    /// `z = (Re K + Im K)⁻¹ r`: real and imaginary part are two right sides of one real solve.
    fn precondition(&self, r: &[c64], z: &mut [c64]) {
        let n = r.len();
        let mut parts = Vec::with_capacity(2 * n);
        parts.extend(r.iter().map(|v| v.re));
        parts.extend(r.iter().map(|v| v.im));
        self.preconditioner.solve_in_place(&mut parts);
        let (re, im) = parts.split_at(n);
        for ((z, &re), &im) in z.iter_mut().zip(re).zip(im) {
            *z = c64::new(re, im);
        }
    }
}
