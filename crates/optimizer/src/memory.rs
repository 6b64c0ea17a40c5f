//! What the linear solvers of all states remember from one design to the next.

use fluxmorph_solver::linear::{LinearSolverCache, Method, PreparedSystem};

/// Factors and solutions of the design before, by state.
///
/// What an evaluation computes depends on its memory only within the tolerance of the linear solver.
#[derive(Debug, Default)]
pub struct Memory {
    states: Vec<LinearSolverCache>,
}

impl Memory {
    /// The memory of a state; of one without any, what another frequency of the same design can lend.
    pub(crate) fn of_state(&mut self, index: usize) -> &mut LinearSolverCache {
        while self.states.len() <= index {
            let lent = self.states.last().map(LinearSolverCache::without_initial_guess);
            self.states.push(lent.unwrap_or_default());
        }
        &mut self.states[index]
    }

    /// What may serve other designs as well: the factors, without solutions to start from.
    ///
    /// With it an evaluation is a smooth function of the design, as differences need.
    pub fn lent(&self) -> Self {
        Self { states: self.states.iter().map(LinearSolverCache::without_initial_guess).collect() }
    }

    /// The methods that worked last, by state; `None` where it is the first one of the ladder.
    pub fn methods(&self) -> Vec<Option<Method>> {
        self.states.iter().map(LinearSolverCache::method).collect()
    }

    /// A memory of nothing but methods, by state.
    pub fn with_methods(methods: &[Option<Method>]) -> Self {
        Self { states: methods.iter().map(|&method| LinearSolverCache::with_method(method)).collect() }
    }

    /// Keeps what a solved system leaves.
    pub(crate) fn keep(&mut self, index: usize, system: PreparedSystem) {
        *self.of_state(index) = system.into_cache();
    }
}
