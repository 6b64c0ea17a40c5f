//! The elimination of the field for the currents that voltages drive.

use std::sync::Arc;

use fluxmorph_geometry::fem::c64;

use super::{Windings, product};
use crate::error::SolverError;
use crate::linear::LinearSolverReport;

/// Solves the field's system for a right side.
type Solve<'a> = dyn FnMut(&[c64]) -> Result<(Vec<c64>, LinearSolverReport), SolverError> + 'a;

/// The elimination of the field for the currents of voltage-driven coils, on one mesh.
#[derive(Debug)]
pub(crate) struct Border {
    windings: Arc<Windings>,
    /// `W = K⁻¹ F`.
    responses: Vec<Vec<c64>>,
    /// `FᵀW + Z/(jω)` [H], by rows.
    schur: Vec<Vec<c64>>,
    angular_frequency: f64,
}

impl Border {
    /// Solves for 1 A in each; `None` where no voltage drives a current.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve`].
    pub(crate) fn new(
        windings: &Arc<Windings>,
        angular_frequency: f64,
        solve: &mut Solve<'_>,
    ) -> Result<Option<Self>, SolverError> {
        if angular_frequency == 0.0 || windings.with_source().next().is_none() {
            return Ok(None);
        }
        let responses: Vec<Vec<c64>> = windings
            .with_source()
            .map(|(driven, _)| Ok(solve(&driven.load)?.0))
            .collect::<Result<_, SolverError>>()?;
        let mut schur: Vec<Vec<c64>> = windings
            .with_source()
            .map(|(driven, _)| responses.iter().map(|w| product(&driven.load, w)).collect())
            .collect();
        for (k, (driven, _)) in windings.with_source().enumerate() {
            schur[k][k] += driven.winding.impedance(angular_frequency) / c64::new(0.0, angular_frequency);
        }
        Ok(Some(Self { windings: Arc::clone(windings), responses, schur, angular_frequency }))
    }

    /// Number of the field's unknowns.
    pub(crate) fn field_unknowns(&self) -> usize {
        self.responses.first().map_or(0, Vec::len)
    }

    /// Completes `u_0 = K⁻¹ f` to the solution of the whole system; the currents [A].
    pub(crate) fn complete(&self, values: &mut [c64], right_side: Excitation<'_>) -> Vec<c64> {
        let source = |d: usize, voltage: c64| match right_side {
            Excitation::Voltages => voltage / c64::new(0.0, self.angular_frequency),
            Excitation::Given(entries) => entries.get(d).map_or(c64::default(), |entry| -entry),
        };
        let right: Vec<c64> = self
            .windings
            .with_source()
            .enumerate()
            .map(|(d, (driven, voltage))| source(d, voltage) - product(&driven.load, values))
            .collect();
        let currents = solve_dense(self.schur.clone(), right);
        for (current, response) in currents.iter().zip(&self.responses) {
            for (value, w) in values.iter_mut().zip(response) {
                *value += current * w;
            }
        }
        currents
    }
}

/// What is on the right side of the circuits' equations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Excitation<'a> {
    /// The voltages of the sources, as of a state.
    Voltages,
    /// These entries, as of an adjoint, zero where they end.
    Given(&'a [c64]),
}

/// Gaussian elimination with row pivoting, for the few equations of circuits.
fn solve_dense(mut matrix: Vec<Vec<c64>>, mut right: Vec<c64>) -> Vec<c64> {
    let n = right.len();
    for k in 0..n {
        let pivot = (k..n).fold(k, |p, i| if matrix[i][k].norm() > matrix[p][k].norm() { i } else { p });
        matrix.swap(k, pivot);
        right.swap(k, pivot);
        for i in k + 1..n {
            let factor = matrix[i][k] / matrix[k][k];
            for j in k..n {
                let above = matrix[k][j];
                matrix[i][j] -= factor * above;
            }
            let above = right[k];
            right[i] -= factor * above;
        }
    }
    for k in (0..n).rev() {
        let known: c64 = (k + 1..n).map(|j| matrix[k][j] * right[j]).sum();
        right[k] = (right[k] - known) / matrix[k][k];
    }
    right
}
