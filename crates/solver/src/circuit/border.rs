//! The elimination of the field for the voltages of solid conductors and the currents that voltages drive.
//!
//! With `F = −c` of a solid conductor and `y` for `U` and `I` the system is `K u − F y = f`, `Fᵀu + D y = r`: see the modules
//! above for its entries. `W = K⁻¹F`, and `(FᵀW + D) y = r − FᵀK⁻¹f`.

use std::collections::BTreeMap;
use std::sync::Arc;

use fluxmorph_geometry::fem::c64;

use super::solids::SolidRows;
use super::{Windings, product};
use crate::error::SolverError;
use crate::linear::LinearSolverReport;

/// Solves the field's system for a right side.
type Solve<'a> = dyn FnMut(&[c64]) -> Result<(Vec<c64>, LinearSolverReport), SolverError> + 'a;

/// The elimination of the field on one mesh: solid conductors first, then voltage-driven coils.
#[derive(Debug)]
pub(crate) struct Border {
    windings: Arc<Windings>,
    solids: SolidRows,
    /// `W`; empty where `F` is zero, of a solid conductor's current.
    responses: Vec<Vec<c64>>,
    /// `FᵀW + D` [H], by rows.
    schur: Vec<Vec<c64>>,
    angular_frequency: f64,
    /// Iterations of all responses that it solved for, and the largest of their residuals.
    report: LinearSolverReport,
}

impl Border {
    /// Solves for 1 Wb and 1 A in each, but for those that `earlier`, of the same matrix, has; `None` where there is neither solid
    /// conductor nor driven current.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve`].
    pub(crate) fn new(
        windings: &Arc<Windings>,
        solids: SolidRows,
        angular_frequency: f64,
        earlier: Option<Self>,
        solve: &mut Solve<'_>,
    ) -> Result<Option<Self>, SolverError> {
        let is_driven = windings.with_source().next().is_some();
        if angular_frequency == 0.0 || solids.count() == 0 && !is_driven {
            return Ok(None);
        }
        // The iterations of those taken over have been counted.
        let residual = earlier.as_ref().map_or(0.0, |earlier| earlier.report.residual);
        let mut report = LinearSolverReport { iterations: 0, residual };
        let (mut of_solids, mut of_coils) = earlier.map(Self::into_responses).unwrap_or_default();
        let mut respond = |load: &[c64]| {
            let (response, own) = solve(load)?;
            report.iterations += own.iterations;
            report.residual = report.residual.max(own.residual);
            Ok::<_, SolverError>(response)
        };
        of_solids.truncate(solids.count());
        for load in solids.loads.iter().skip(of_solids.len()) {
            of_solids.push(respond(load)?);
        }
        let mut responses = of_solids;
        for (driven, _) in windings.with_source() {
            responses.push(match (&driven.solid, of_coils.remove(&driven.coil)) {
                (Some(_), _) => Vec::new(),
                (None, Some(response)) => response,
                (None, None) => respond(&driven.load)?,
            });
        }
        let (windings, schur) = (Arc::clone(windings), Vec::new());
        let border = Self { windings, solids, responses, schur, angular_frequency, report };
        let schur = border.eliminated();
        Ok(Some(Self { schur, ..border }))
    }

    /// `FᵀW + D`.
    fn eliminated(&self) -> Vec<Vec<c64>> {
        let row = |load: &[c64]| self.responses.iter().map(|w| product(load, w)).collect();
        let mut schur: Vec<Vec<c64>> = self.loads().map(row).collect();
        let solids = self.solids.count();
        for (k, diagonal) in self.solids.diagonal.iter().enumerate() {
            schur[k][k] -= diagonal;
        }
        for (k, (driven, _)) in self.windings.with_source().enumerate() {
            let own = solids + k;
            schur[own][own] +=
                driven.winding.impedance(self.angular_frequency) / c64::new(0.0, self.angular_frequency);
            for segment in driven.solid.clone().into_iter().flatten() {
                schur[own][segment] += 1.0;
                schur[segment][own] += 1.0;
            }
        }
        schur
    }

    /// The responses of solid conductors, and those of coils by their places.
    fn into_responses(self) -> (Vec<Vec<c64>>, BTreeMap<usize, Vec<c64>>) {
        let Self { windings, solids, responses: mut of_solids, .. } = self;
        let of_coils = of_solids.split_off(solids.count());
        (of_solids, windings.with_source().map(|(driven, _)| driven.coil).zip(of_coils).collect())
    }

    /// `F` of every unknown, as far as it is in the field's equations.
    fn loads(&self) -> impl Iterator<Item = &[c64]> {
        let of_coils = self.windings.with_source().map(|(driven, _)| driven.field_load());
        self.solids.loads.iter().map(Vec::as_slice).chain(of_coils)
    }

    /// Iterations of the responses, and the largest of their residuals.
    pub(crate) fn report(&self) -> LinearSolverReport {
        self.report
    }

    /// What solid conductors add to the field's matrix.
    pub(crate) fn solids(&self) -> &SolidRows {
        &self.solids
    }

    /// Number of the field's unknowns, without and with those of solid conductors.
    pub(crate) fn field_unknowns(&self) -> [usize; 2] {
        let count = self.responses.first().map_or(0, Vec::len);
        [count, count + self.solids.count()]
    }

    /// Completes `K⁻¹f` to the solution of the whole system, with the `U` of solid conductors behind it; the currents [A].
    /// `of_solids` are the right sides of their rows, zero where they end.
    pub(crate) fn complete(
        &self,
        values: &mut Vec<c64>,
        of_solids: &[c64],
        right_side: Excitation<'_>,
    ) -> Vec<c64> {
        let solids = self.solids.count();
        let entry = |entries: &[c64], k: usize| entries.get(k).map_or(c64::default(), |entry| -entry);
        let sources = self.windings.with_source().enumerate().map(|(d, (_, voltage))| match right_side {
            Excitation::Voltages => voltage / c64::new(0.0, self.angular_frequency),
            Excitation::Given(entries) => entry(entries, d),
            Excitation::Open => c64::default(),
        });
        let size = if right_side == Excitation::Open { solids } else { self.schur.len() };
        let right = (0..solids).map(|k| entry(of_solids, k)).chain(sources).zip(self.loads());
        let right: Vec<c64> = right.map(|(r, load)| r - product(load, values)).take(size).collect();
        let matrix = self.schur.iter().take(size).map(|row| row[..size].to_vec()).collect();
        let mut unknowns = solve_dense(matrix, right);
        for (unknown, response) in unknowns.iter().zip(&self.responses) {
            for (value, w) in values.iter_mut().zip(response) {
                *value += unknown * w;
            }
        }
        let currents = unknowns.split_off(solids);
        values.extend(unknowns);
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
    /// No current flows in them, as of the response to 1 A.
    Open,
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
