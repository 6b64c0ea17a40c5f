//! Making the preconditioner of a method for a matrix.

use fluxmorph_geometry::MeshError;
use fluxmorph_geometry::fem::{CsrMatrix, c32, c64};

use super::analysis::SystemAnalysis;
use super::cost::Costs;
use super::factor::{KeptPart, Precondition, Scaled, Unscaled};
use super::method::Method;
use super::two_level::TwoLevel;

/// What a method makes of a matrix; it may serve other matrices of the same pattern.
#[derive(Debug)]
pub(super) struct Preconditioner {
    /// The method it belongs to.
    pub(super) method: Method,
    /// What it cost, and what an iteration with it costs.
    pub(super) costs: Costs,
    /// `z = M⁻¹ r`.
    pub(super) action: Box<dyn Precondition>,
}

/// What the diagonal is multiplied by before an incomplete factorisation: without it pivots of thin elements vanish.
const DIAGONAL_FACTOR: f64 = 1.05;

impl Preconditioner {
    /// Factors a matrix by a method, with what is kept of another one.
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] when a pivot vanishes or the memory does not suffice.
    pub(super) fn new(
        analysis: &SystemAnalysis,
        matrix: &CsrMatrix<c64>,
        method: Method,
        kept: Option<&KeptPart>,
    ) -> Result<Self, MeshError> {
        let action: Box<dyn Precondition> = match method {
            Method::Direct => Box::new(Scaled::<c64>::complete(&analysis.complete()?, matrix, kept)?),
            Method::DirectSingle => Box::new(Scaled::<c32>::complete(&analysis.complete()?, matrix, kept)?),
            Method::RealFactor => Box::new(Scaled::<f64>::complete(&analysis.complete()?, matrix, kept)?),
            Method::RealFactorSingle => {
                Box::new(Scaled::<f32>::complete(&analysis.complete()?, matrix, kept)?)
            }
            Method::Incomplete => {
                let parts = analysis.incomplete().ok_or_else(|| missing(matrix, method))?;
                Box::new(Unscaled::new(parts, matrix, DIAGONAL_FACTOR)?)
            }
            Method::TwoLevel => {
                let levels = analysis.two_level().ok_or_else(|| missing(matrix, method))?;
                Box::new(TwoLevel::new(levels, matrix)?)
            }
        };
        Ok(Self { method, costs: analysis.costs(method)?, action })
    }
}

/// What a method lacks that was not analysed.
fn missing(matrix: &CsrMatrix<c64>, method: Method) -> MeshError {
    let cause = format!("the pattern was not analysed for `{}`", method.name());
    MeshError::Factorisation { unknowns: matrix.structure.row_count(), cause }
}
