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
    action: Action,
}

#[derive(Debug)]
enum Action {
    Factor(Box<dyn Precondition>),
    TwoLevel(Box<TwoLevel>),
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
        let action = match method {
            Method::TwoLevel => {
                let levels = analysis.two_level().ok_or_else(|| missing(matrix, method))?;
                Action::TwoLevel(Box::new(TwoLevel::new(levels, matrix)?))
            }
            _ => Action::Factor(factor(analysis, matrix, method, kept)?),
        };
        Ok(Self { method, costs: analysis.costs(method)?, action })
    }

    /// `z = M⁻¹ r`.
    pub(super) fn apply(&self, r: &[c64], z: &mut [c64]) {
        match &self.action {
            Action::Factor(factor) => factor.apply(r, z),
            Action::TwoLevel(levels) => levels.apply(r, z),
        }
    }

    /// Moves an initial guess to where the iteration may start.
    pub(super) fn start(&self, fine: &CsrMatrix<c64>, b: &[c64], x: &mut [c64]) {
        if let Action::TwoLevel(levels) = &self.action {
            levels.start(fine, b, x);
        }
    }

    /// What the factor of another matrix may begin with.
    pub(super) fn kept(&self) -> Option<KeptPart> {
        match &self.action {
            Action::Factor(factor) => factor.kept(),
            Action::TwoLevel(_) => None,
        }
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        match &self.action {
            Action::Factor(factor) => factor.bytes(),
            Action::TwoLevel(levels) => levels.bytes(),
        }
    }
}

/// The factor of a method on one level.
fn factor(
    analysis: &SystemAnalysis,
    fine: &CsrMatrix<c64>,
    method: Method,
    kept: Option<&KeptPart>,
) -> Result<Box<dyn Precondition>, MeshError> {
    Ok(match method {
        Method::Direct => Box::new(Scaled::<c64>::complete(&analysis.complete()?, fine, kept)?),
        Method::DirectSingle => Box::new(Scaled::<c32>::complete(&analysis.complete()?, fine, kept)?),
        Method::RealFactor => Box::new(Scaled::<f64>::complete(&analysis.complete()?, fine, kept)?),
        Method::RealFactorSingle => Box::new(Scaled::<f32>::complete(&analysis.complete()?, fine, kept)?),
        Method::Incomplete | Method::TwoLevel => {
            let parts = analysis.incomplete().ok_or_else(|| missing(fine, method))?;
            Box::new(Unscaled::new(parts, fine, DIAGONAL_FACTOR)?)
        }
    })
}

/// What a method lacks that was not analysed.
fn missing(matrix: &CsrMatrix<c64>, method: Method) -> MeshError {
    let cause = format!("the pattern was not analysed for `{}`", method.name());
    MeshError::Factorisation { unknowns: matrix.structure.row_count(), cause }
}
