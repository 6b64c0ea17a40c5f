//! What is optimised: a weighted sum of functionals over the states of a problem.

use fluxmorph_solver::Functional;

/// Which way is better.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Goal {
    /// The smaller value.
    Minimise,
    /// The larger value.
    Maximise,
}

/// One functional on one or several states.
#[derive(Clone, Debug)]
pub struct Term {
    /// What is measured on each state; the values are added.
    pub functional: Functional,
    /// Indices of the states it is measured on, ascending.
    pub states: Vec<usize>,
    /// Its factor in a sum.
    pub weight: f64,
    /// What it is, for the results.
    pub label: Label,
}

/// What a term is called in the results.
#[derive(Clone, Debug, PartialEq)]
pub struct Label {
    /// The word of the configuration, such as `loss`.
    pub kind: &'static str,
    /// The region; `None` for everything that is meshed.
    pub region: Option<String>,
    /// The coils, where it is a quantity of these.
    pub coils: Vec<String>,
    /// The one frequency [Hz]; `None` for the sum over all.
    pub frequency: Option<f64>,
}

/// `F = Σ_t w_t Σ_s F_t(state s)`.
#[derive(Clone, Debug)]
pub struct WeightedSum {
    /// Which way is better.
    pub goal: Goal,
    /// The terms, at least one.
    pub terms: Vec<Term>,
}

impl Goal {
    /// Factor that makes the better value the smaller one.
    pub fn sign(self) -> f64 {
        match self {
            Self::Minimise => 1.0,
            Self::Maximise => -1.0,
        }
    }
}
