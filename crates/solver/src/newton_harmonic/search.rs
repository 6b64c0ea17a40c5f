//! How far a step of Newton's method goes.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::fem::scalar::{axpy, norm, ordered_sum};

use super::{HarmonicTangent, Iterate, LOOSEST, Problem, Side};
use crate::circuit::Equations;
use crate::error::SolverError;
use crate::line_search;
use crate::linear::PreparedSystem;

/// Halvings of one step: Newton's direction lowers the residual, so that one of them is short enough.
const MOST_HALVINGS: usize = 12;

/// The part of the promised decrease of the residual that is asked for (Nocedal and Wright: 1e-4).
const ARMIJO: f64 = 1e-4;

/// The same where the residual is measured by the step that it asks for.
const NATURAL: f64 = 0.25;

impl Problem<'_> {
    /// A length of a step that lowers the residual, first the one at which it has next to no part along the step: a new iterate with
    /// it. The residual is measured by `Re rᴴS⁻¹r` with the matrix `S` that is nearest to the derivative, as an error of the field:
    /// unlike its plain norm that does not ask saturated iron, whose reluctivity is a thousand times that of the rest, to come first.
    pub(super) fn search(
        &self,
        from: &Iterate,
        step: &[c64],
        nearest: &mut PreparedSystem,
    ) -> Result<Option<(Iterate, f64)>, SolverError> {
        // Over the rows of the field, the first.
        let product = |a: &[c64], b: &[c64]| ordered_sum(a.len(), |i| a[i].re * b[i].re + a[i].im * b[i].im);
        let mut measure = |residual: &[c64]| -> Result<f64, SolverError> {
            Ok(product(residual, &nearest.solve_once(residual)?.0))
        };
        let place = |length: f64| self.along(from, step, length);
        let along = line_search::longest_useful(product(&from.residual, step), |length| {
            let trial = place(length);
            (product(&trial.residual, step), trial)
        });
        if along.is_level {
            return Ok(Some((along.state, along.length)));
        }
        let before = measure(&from.residual)?;
        let (mut length, mut trial) = (along.length, along.state);
        for _ in 0..MOST_HALVINGS {
            if measure(&trial.residual)? <= (1.0 - ARMIJO * length.min(1.0)) * before {
                return Ok(Some((trial, length)));
            }
            length *= 0.5;
            trial = place(length);
        }
        Ok(None)
    }

    /// A length of Newton's own step. Where a capacitance is in series the residual is no error of a field: what the derivative at the
    /// start makes of the residual has to become shorter (the natural monotonicity of P. Deuflhard, Newton Methods for Nonlinear
    /// Problems, chapter 3), or, as it may at turning points, does not, and the residual decides.
    pub(super) fn search_from(
        &self,
        from: &Iterate,
        step: &[c64],
        (tangent, nearest): (&HarmonicTangent, &mut PreparedSystem),
    ) -> Result<Option<(Iterate, f64)>, SolverError> {
        if !self.circuits.as_ref().is_some_and(Equations::have_capacitance) {
            return self.search(from, step, nearest);
        }
        let before = norm(step);
        let mut length = 1.0;
        for _ in 0..MOST_HALVINGS {
            let trial = self.along(from, step, length);
            let mut left = trial.residual.clone();
            left.resize(step.len(), c64::default());
            let (asked, _) = tangent.invert(Side::State, &left, nearest, LOOSEST)?;
            if norm(&asked) <= (1.0 - NATURAL * length) * before {
                return Ok(Some((trial, length)));
            }
            length *= 0.5;
        }
        self.search(from, step, nearest)
    }

    /// Some length of a step.
    fn along(&self, from: &Iterate, step: &[c64], length: f64) -> Iterate {
        let mut values = from.values.clone();
        axpy(c64::from(length), step, &mut values);
        self.at(values)
    }
}
