//! The best design so far, and how another one compares with it.

use std::cmp::Ordering;

use crate::constraint::Bound;
use crate::nlopt::Sample;
use crate::objective::Goal;
use crate::problem::{Analysis, SolverCache};

/// What the first evaluation fixes for the rest of the run.
#[derive(Clone, Debug)]
pub(super) struct Initial {
    pub(super) objective: f64,
    /// The terms of a worst case with their weights; empty otherwise.
    pub(super) members: Vec<f64>,
    pub(super) quality: f64,
    pub(super) bounds: Vec<Bound>,
}

/// How a design compares with the best before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Comparison {
    First,
    Better,
    Worse,
}

impl Comparison {
    pub(super) fn is_improved(self) -> bool {
        self != Self::Worse
    }
}

/// What is known of the field of the best design.
#[derive(Debug)]
pub(super) enum BestField {
    Computed(Box<Analysis>),
    /// It was computed before the run was interrupted; with what the linear solvers kept before it, it comes out as it was.
    Replayed(Box<SolverCache>),
}

/// The best design so far.
#[derive(Debug)]
pub(super) struct Incumbent {
    pub(super) evaluation: usize,
    pub(super) values: Vec<f64>,
    pub(super) objective: f64,
    pub(super) violation: f64,
    /// What the method has seen of it.
    pub(super) sample: Sample,
    pub(super) field: BestField,
}

impl Incumbent {
    /// How a design with this objective and sample compares.
    pub(super) fn compare(&self, goal: Goal, objective: f64, sample: &Sample) -> Comparison {
        let sign = goal.sign();
        let order = sample.violation().total_cmp(&self.violation);
        match order.then((sign * objective).total_cmp(&(sign * self.objective))) {
            Ordering::Less => Comparison::Better,
            _ => Comparison::Worse,
        }
    }

    /// Whether it has gained more than the share `least` on the best design before: on its violation, or on its objective where it has
    /// none.
    pub(super) fn has_gained(&self, (violation, objective): (f64, f64), least: f64) -> bool {
        if violation > 0.0 {
            return self.violation < (1.0 - least) * violation;
        }
        (self.objective - objective).abs() > least * objective.abs()
    }
}
