//! What one design leaves for the next: a preconditioner with the ledger of its costs, and initial guesses.

use std::sync::Arc;

use fluxmorph_geometry::fem::c64;

use super::analysis::SystemAnalysis;
use super::cost::Ledger;
use super::factor::KeptPart;
use super::method::{Method, Reuse};
use super::preconditioner::Preconditioner;

/// What the linear solver of a field model keeps from one mesh to the next.
///
/// A run's bits depend on it, hence on the sequence of its designs, but not on threads or clocks.
#[derive(Debug, Default)]
pub struct LinearSolverCache {
    pub(super) preconditioner: Option<CachedPreconditioner>,
    /// What a factor begins with whatever the settings say: its bits do not depend on it.
    pub(super) kept: Option<KeptPart>,
    /// The method that worked last, where it is not the first choice.
    pub(super) method: Option<Method>,
    /// The solutions of the last design, in the order in which they were asked for.
    pub(super) solutions: Vec<Vec<c64>>,
    /// Whether it is between the steps of one state, where a factor serves as long as it pays whatever the settings say.
    pub(super) is_within_a_state: bool,
}

/// The preconditioner of another matrix of the same pattern.
#[derive(Clone, Debug)]
pub(super) struct CachedPreconditioner {
    pub(super) analysis: Arc<SystemAnalysis>,
    pub(super) preconditioner: Arc<Preconditioner>,
    pub(super) ledger: Ledger,
}

impl LinearSolverCache {
    /// A cache of nothing but the method to begin with; `None` is the first choice.
    pub fn with_method(method: Option<Method>) -> Self {
        Self { method, ..Self::default() }
    }

    /// A cache of the method to begin with, and of what is kept of factors, alone.
    pub(crate) fn method_and_kept(&self) -> Self {
        Self { method: self.method, kept: self.kept.clone(), ..Self::default() }
    }

    /// The same between the steps of one state.
    pub(crate) fn within_a_state(self) -> Self {
        Self { is_within_a_state: true, ..self }
    }

    /// What is left of it when the state is found: what the settings keep between designs.
    pub(super) fn between_designs(self, reuse: Reuse) -> Self {
        match reuse {
            Reuse::Never => self.method_and_kept(),
            Reuse::WhileItPays => Self { is_within_a_state: false, ..self },
        }
    }

    /// The method that worked last, where it is not the first choice.
    pub fn method(&self) -> Option<Method> {
        self.method
    }

    /// What may serve the same design at another frequency: the preconditioner, as far as the patterns are the same.
    pub fn without_initial_guess(&self) -> Self {
        let Self { preconditioner, is_within_a_state, .. } = self;
        Self {
            preconditioner: preconditioner.clone(),
            is_within_a_state: *is_within_a_state,
            ..self.method_and_kept()
        }
    }
}
