//! What is optimised: a weighted sum of functionals over the states of a problem, or the worst of several.

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
    /// Indices of the states it is measured on, ascending; of a volume or mass one.
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
    /// The one load case; `None` for the sum over all, and where there are none.
    pub load: Option<String>,
}

/// What the terms make together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Combination {
    /// Their sum.
    #[default]
    Sum,
    /// The worst of them: the largest where it is minimised, the least where it is maximised. It has kinks, so that a method sees
    /// a bound on all of them instead, which it moves ([`crate::nlopt`]).
    WorstCase,
}

/// `F = Σ_t w_t Σ_s F_t(state s)`, or the worst of the weighted terms.
#[derive(Clone, Debug)]
pub struct WeightedSum {
    /// Which way is better.
    pub goal: Goal,
    /// Sum or worst case.
    pub combination: Combination,
    /// The terms, at least one.
    pub terms: Vec<Term>,
}

impl WeightedSum {
    /// The place of the worst of some weighted values; of equal ones the first. At least one.
    pub fn worst(&self, values: &[f64]) -> usize {
        let sign = self.goal.sign();
        (1..values.len()).fold(0, |worst, k| if sign * values[k] > sign * values[worst] { k } else { worst })
    }

    /// The place of the term that is the worst of some weighted values without their errors, and the error of the worst value: what
    /// that term's true value has more than the worst of these.
    pub fn error_of_worst(&self, values: &[f64], errors: &[f64]) -> (usize, f64) {
        let corrected: Vec<f64> = values.iter().zip(errors).map(|(value, error)| value + error).collect();
        let worst = self.worst(&corrected);
        (worst, corrected[worst] - values[self.worst(values)])
    }
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
