//! What the linear solvers of all states keep from one design to the next.

use fluxmorph_solver::linear::{Method, PreparedSystem, SolverMemory};

/// Factors and solutions of the design before, by state.
///
/// What an evaluation computes depends on its cache only within the tolerance of the linear solver.
#[derive(Debug, Default)]
pub struct SolverCache {
    states: Vec<SolverMemory>,
}

impl SolverCache {
    /// The cache of a state; of one without any, what another frequency of the same design offers.
    pub(crate) fn of_state(&mut self, index: usize) -> &mut SolverMemory {
        while self.states.len() <= index {
            let shared = self.states.last().map(SolverMemory::lent);
            self.states.push(shared.unwrap_or_default());
        }
        &mut self.states[index]
    }

    /// What may serve other designs as well: the factors, without solutions to start from.
    ///
    /// With it an evaluation is a smooth function of the design, as differences need.
    pub fn without_initial_guess(&self) -> Self {
        Self { states: self.states.iter().map(SolverMemory::lent).collect() }
    }

    /// The methods that worked last, by state; `None` where it is the first one tried.
    pub fn methods(&self) -> Vec<Option<Method>> {
        self.states.iter().map(SolverMemory::method).collect()
    }

    /// A cache of nothing but methods, by state.
    pub fn with_methods(methods: &[Option<Method>]) -> Self {
        Self { states: methods.iter().map(|&method| SolverMemory::with_method(method)).collect() }
    }

    /// Keeps what a solved system leaves.
    pub(crate) fn keep(&mut self, index: usize, system: PreparedSystem) {
        *self.of_state(index) = system.into_memory();
    }
}
