//! What one design leaves for the next: a preconditioner with the book of what it costs, and solutions to start from.

use std::sync::Arc;

use fluxmorph_geometry::fem::c64;

use super::analysis::SystemAnalysis;
use super::cost::Ledger;
use super::method::Method;
use super::preconditioner::Preconditioner;

/// Memory of a field model's linear solver from one mesh to the next.
///
/// A run's bits depend on it, hence on the sequence of its designs, but not on threads or clocks.
#[derive(Debug, Default)]
pub struct SolverMemory {
    pub(super) held: Option<Held>,
    /// The method that worked last, where it is not the first of the ladder.
    pub(super) method: Option<Method>,
    /// The solutions of the last design, in the order in which they were asked for.
    pub(super) solutions: Vec<Vec<c64>>,
}

/// A preconditioner that was made for another matrix of the same pattern.
#[derive(Clone, Debug)]
pub(super) struct Held {
    pub(super) analysis: Arc<SystemAnalysis>,
    pub(super) preconditioner: Arc<Preconditioner>,
    pub(super) ledger: Ledger,
}

impl SolverMemory {
    /// A memory of nothing but the method to begin with; `None` is the first one of the ladder.
    pub fn with_method(method: Option<Method>) -> Self {
        Self { method, ..Self::default() }
    }

    /// The method that worked last, where it is not the first of the ladder.
    pub fn method(&self) -> Option<Method> {
        self.method
    }

    /// What may serve the same design at another frequency: the preconditioner, as far as the patterns are the same.
    pub fn lent(&self) -> Self {
        Self { held: self.held.clone(), method: self.method, solutions: Vec::new() }
    }
}
