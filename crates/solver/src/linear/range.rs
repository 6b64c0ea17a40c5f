//! Right sides that can be solved for.

use fluxmorph_geometry::fem::{c64, norm};

use crate::error::SolverError;

/// Norms of a right side that the iteration can work with: products of a residual, from there to far below the tolerance, with
/// what the preconditioner makes of it are normal numbers, also where the matrix is some tens of digits from one.
const RANGE: std::ops::RangeInclusive<f64> = 1e-130..=1e130;

/// The norm of a right side; zero only where all entries are.
///
/// # Errors
/// [`SolverError::NotFinite`] for an entry that is no number, [`SolverError::OutOfRange`] for a norm beyond [`RANGE`].
pub(super) fn checked_norm(right_side: &[c64]) -> Result<f64, SolverError> {
    let scale = norm(right_side);
    if !RANGE.contains(&scale) {
        if let Some(value) = right_side.iter().flat_map(|b| [b.re, b.im]).find(|b| !b.is_finite()) {
            return Err(SolverError::NotFinite { what: "right side of the field problem", value });
        }
        let largest = right_side.iter().fold(0.0_f64, |largest, b| largest.max(b.re.abs()).max(b.im.abs()));
        if largest != 0.0 {
            return Err(SolverError::OutOfRange { largest });
        }
    }
    Ok(scale)
}
