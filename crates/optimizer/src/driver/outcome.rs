//! How an optimisation went.

use super::StopReason;
use crate::constraint::Bound;
use crate::problem::{Analysis, Timings};

/// The best design of a run.
#[derive(Debug)]
pub struct Best {
    /// Its evaluation.
    pub evaluation: usize,
    /// Its variables [m].
    pub values: Vec<f64>,
    /// Its objective.
    pub objective: f64,
    /// Largest excess of a constraint over its bound, relative to it; zero where all are kept.
    pub violation: f64,
    /// Its field.
    pub analysis: Analysis,
}

/// How an optimisation went.
#[derive(Debug)]
pub struct Optimised {
    /// Why it ended.
    pub stop_reason: StopReason,
    /// Number of evaluations.
    pub evaluations: usize,
    /// Of these, the ones that were computed, and not replayed.
    pub computed: usize,
    /// Evaluations that improved on the best before them.
    pub iterations: usize,
    /// The objective at the start.
    pub initial: f64,
    /// The terms of a worst case there, with their weights; empty otherwise.
    pub initial_members: Vec<f64>,
    /// Bounds of the constraints, in their order.
    pub bounds: Vec<Bound>,
    /// The best design.
    pub best: Best,
    /// Worst quality of the initial mesh.
    pub initial_quality: f64,
    /// Largest relative residual of all states.
    pub worst_residual: f64,
    /// Where the time went, all evaluations together.
    pub timings: Timings,
    /// What is to be said of the best design: bounds that it violates, and better designs that nearly keep them. Reported already.
    pub warnings: Vec<String>,
}
