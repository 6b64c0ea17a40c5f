//! What the linear solvers of all states keep from one design to the next.

use fluxmorph_solver::linear::{LinearSolverCache, Method, PreparedSystem};

/// Factors and solutions of the design before, by state.
///
/// What an evaluation computes depends on its cache only within the tolerance of the linear solver.
#[derive(Debug, Default)]
pub struct SolverCache {
    states: Vec<LinearSolverCache>,
}

impl SolverCache {
    /// The cache of a state; of one without any, what another frequency of the same design offers.
    pub(super) fn of_state(&mut self, index: usize) -> &mut LinearSolverCache {
        while self.states.len() <= index {
            let other = self.states.last().map(LinearSolverCache::without_initial_guess);
            self.states.push(other.unwrap_or_default());
        }
        &mut self.states[index]
    }

    /// What may serve other designs as well: the factors, without solutions to start from.
    ///
    /// With it an evaluation is a smooth function of the design, as differences need.
    pub fn without_initial_guess(&self) -> Self {
        Self { states: self.states.iter().map(LinearSolverCache::without_initial_guess).collect() }
    }

    /// The methods that worked last, by state; `None` where it is the first one tried.
    pub fn methods(&self) -> Vec<Option<Method>> {
        self.states.iter().map(LinearSolverCache::method).collect()
    }

    /// A cache of nothing but methods, by state.
    pub fn with_methods(methods: &[Option<Method>]) -> Self {
        Self { states: methods.iter().map(|&method| LinearSolverCache::with_method(method)).collect() }
    }

    /// Keeps what a solved system leaves.
    pub(super) fn keep(&mut self, index: usize, system: PreparedSystem) {
        *self.of_state(index) = system.into_cache();
    }
}
