//! The elimination of the field for the voltages of solid conductors and the currents that voltages drive.
//!
//! With `W = K⁻¹F` the equations `K u − F y = f`, `Fᵀu + D y = r` ([`super::equations`]) become `(FᵀW + D) y = r − FᵀK⁻¹f`.

use std::collections::BTreeMap;

use fluxmorph_geometry::fem::c64;

use super::equations::{Equations, Excitation};
use super::{SolidRows, product};
use crate::error::SolverError;
use crate::linear::LinearSolverReport;

/// Solves the field's system for a right side.
type Solve<'a> = dyn FnMut(&[c64]) -> Result<(Vec<c64>, LinearSolverReport), SolverError> + 'a;

/// The elimination of the field on one mesh: solid conductors first, then voltage-driven coils.
#[derive(Debug)]
pub(crate) struct Border {
    equations: Equations,
    /// `W`; empty where `F` is zero, of a solid conductor's current.
    responses: Vec<Vec<c64>>,
    /// `FᵀW + D` [H], by rows.
    schur: Vec<Vec<c64>>,
    /// Iterations of all responses that it solved for, and the largest of their residuals.
    report: LinearSolverReport,
}

impl Border {
    /// Solves for 1 Wb and 1 A in each, but for those that `earlier`, of the same matrix, has.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve`].
    pub(crate) fn new(
        equations: Equations,
        earlier: Option<Self>,
        solve: &mut Solve<'_>,
    ) -> Result<Self, SolverError> {
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
        let solids = equations.solids();
        of_solids.truncate(solids.count());
        for load in solids.loads.iter().skip(of_solids.len()) {
            of_solids.push(respond(load)?);
        }
        let mut responses = of_solids;
        for (driven, _) in equations.windings().with_source() {
            responses.push(match (&driven.solid, of_coils.remove(&driven.coil)) {
                (Some(_), _) => Vec::new(),
                (None, Some(response)) => response,
                (None, None) => respond(&driven.load)?,
            });
        }
        let mut schur = equations.block();
        for (row, load) in schur.iter_mut().zip(equations.loads()) {
            row.iter_mut().zip(&responses).for_each(|(entry, w)| *entry += product(load, w));
        }
        Ok(Self { equations, responses, schur, report })
    }

    /// The responses of solid conductors, and those of coils by their places.
    fn into_responses(self) -> (Vec<Vec<c64>>, BTreeMap<usize, Vec<c64>>) {
        let Self { equations, responses: mut of_solids, .. } = self;
        let of_coils = of_solids.split_off(equations.solids().count());
        let coils = equations.windings().with_source().map(|(driven, _)| driven.coil);
        (of_solids, coils.zip(of_coils).collect())
    }

    /// Iterations of the responses, and the largest of their residuals.
    pub(crate) fn report(&self) -> LinearSolverReport {
        self.report
    }

    /// The equations that it is made from.
    pub(crate) fn equations(&self) -> &Equations {
        &self.equations
    }

    /// What solid conductors add to the field's matrix.
    pub(crate) fn solids(&self) -> &SolidRows {
        self.equations.solids()
    }

    /// Number of the field's unknowns, without and with those of solid conductors.
    pub(crate) fn field_unknowns(&self) -> [usize; 2] {
        let count = self.responses.first().map_or(0, Vec::len);
        [count, count + self.solids().count()]
    }

    /// Completes `K⁻¹f` to the solution of the whole system, with the `U` of solid conductors behind it; the currents [A].
    /// `of_solids` are the right sides of their rows, zero where they end.
    pub(crate) fn complete(
        &self,
        values: &mut Vec<c64>,
        of_solids: &[c64],
        right_side: Excitation<'_>,
    ) -> Vec<c64> {
        let solids = self.solids().count();
        let size = if right_side == Excitation::Open { solids } else { self.schur.len() };
        let right = self.equations.right_sides(of_solids, right_side).into_iter().zip(self.equations.loads());
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
