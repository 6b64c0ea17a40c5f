//! Designs that are beyond a bound by little, and the step back within it.
//!
//! Methods end on a bound from either side. The little by which one is beyond it may be more than counts as kept, and all that
//! the method has found would count for nothing: where a method ends so, or one evaluation is left, the best of these designs is
//! evaluated once more, a step back within its bounds.

use super::run::Run;
use super::{Record, StopReason};
use crate::error::Error;
use crate::nlopt::{CONSTRAINT_TOLERANCE, Sample};
use crate::objective::Goal;

/// Relative excess over a bound up to which a design is one of these: few bounds are meant more exactly, and few meshes are that
/// exact.
const NEAR: f64 = 1e-3;

/// How far within the bounds the step aims, as a share of the excess: bounds are curved, by far less than this over such a step.
const MARGIN: f64 = 0.01;

/// Projections onto the bounds in turn, most: few hold a design at a time.
const SWEEPS: usize = 50;

/// A design that is beyond a bound by little.
#[derive(Clone, Debug)]
pub(super) struct NearMiss {
    pub(super) evaluation: usize,
    pub(super) objective: f64,
    design: Vec<f64>,
    /// Values of the constraints, with their gradients.
    constraints: Vec<(f64, Vec<f64>)>,
    /// The worst of them, and its excess relative to its bound.
    pub(super) worst: (usize, f64),
    has_been_tried: bool,
}

impl NearMiss {
    /// A design, where it is one.
    pub(super) fn of(record: &Record, sample: &Sample) -> Option<Self> {
        let excesses = sample.constraints.iter().map(|(excess, _)| *excess).enumerate();
        let worst = excesses.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let is_near = worst.1 > CONSTRAINT_TOLERANCE && worst.1 <= NEAR;
        is_near.then(|| Self {
            evaluation: record.row.evaluation,
            objective: record.row.objective,
            design: record.design.clone(),
            constraints: sample.constraints.clone(),
            worst,
            has_been_tried: false,
        })
    }

    /// What it gains on a best design within the bounds, where that is far more than its excess.
    fn gain(&self, goal: Goal, best: f64) -> Option<f64> {
        let gain = goal.sign() * (best - self.objective) / best.abs();
        (gain > NEAR.max(100.0 * self.worst.1)).then_some(gain)
    }

    /// The nearest design, to first order, that keeps all constraints and the bounds of the variables.
    fn stepped_back(&self, lower: &[f64], upper: &[f64]) -> Vec<f64> {
        let margin = CONSTRAINT_TOLERANCE.max(MARGIN * self.worst.1);
        let mut p = self.design.clone();
        for _ in 0..SWEEPS {
            let mut is_within = true;
            for (value, gradient) in &self.constraints {
                let moved = p.iter().zip(&self.design).map(|(p, from)| p - from);
                let excess = value + gradient.iter().zip(moved).map(|(g, d)| g * d).sum::<f64>();
                if excess <= CONSTRAINT_TOLERANCE - margin {
                    continue;
                }
                is_within = false;
                // Variables at a bound that the step points out of do not move.
                let is_free = |k: usize| if gradient[k] > 0.0 { p[k] > lower[k] } else { p[k] < upper[k] };
                let free: Vec<usize> = (0..p.len()).filter(|&k| is_free(k)).collect();
                let square: f64 = free.iter().map(|&k| gradient[k].powi(2)).sum();
                if square > 0.0 {
                    let step = (excess + margin) / square;
                    free.iter().for_each(|&k| p[k] = (p[k] - step * gradient[k]).clamp(lower[k], upper[k]));
                }
            }
            if is_within {
                break;
            }
        }
        p
    }
}

impl Run<'_> {
    /// Of the designs beyond their bounds by little, the one that gains most on a best one within them.
    pub(super) fn missed(&self) -> Option<&NearMiss> {
        self.missed_at().map(|k| &self.near_misses[k])
    }

    fn missed_at(&self) -> Option<usize> {
        let (_, best) = self.incumbent_values().filter(|(violation, _)| *violation == 0.0)?;
        let gains = self
            .near_misses
            .iter()
            .enumerate()
            .filter_map(|(k, miss)| Some((k, miss.gain(self.goal, best)?)));
        gains.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
    }

    /// Whether a step back within the bounds is worth an evaluation.
    pub(super) fn has_missed(&self) -> bool {
        self.missed().is_some_and(|miss| !miss.has_been_tried)
    }

    /// Where a search ends and a design beyond its bounds by little is far better than the best one within them: evaluates it a
    /// step back within them. The search goes on from there where that is a gain; else the reason why it ends.
    ///
    /// # Errors
    /// As an evaluation.
    pub(super) fn step_back(&mut self, reason: StopReason) -> Result<Option<StopReason>, Error> {
        let is_of_method =
            !matches!(reason, StopReason::Interrupted | StopReason::MaxTime | StopReason::NumericalFailure);
        let Some(k) = self.missed_at().filter(|_| is_of_method && self.has_missed()) else {
            return Ok(Some(reason));
        };
        let (lower, upper) = (self.shape().lower(), self.shape().upper());
        let design = self.near_misses[k].stepped_back(lower, upper);
        let before = self.best_evaluation();
        self.is_stepping_back = true;
        let limit = self.evaluated(&design);
        self.is_stepping_back = false;
        if let Some(limit) = limit? {
            return Ok(Some(limit));
        }
        let missed = &mut self.near_misses[k];
        missed.has_been_tried = true;
        let (evaluation, excess) = (missed.evaluation, missed.worst.1);
        let has_gained = self.best_evaluation() != before;
        let outcome = if has_gained { "is the best design" } else { "is no gain" };
        self.observer.note(&format!(
            "evaluation {evaluation} was beyond a bound by {excess:.1e} of it: what is a step back within its bounds {outcome}"
        ));
        let is_over = !has_gained || self.evaluations >= self.settings.max_evaluations;
        Ok(is_over.then_some(reason))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn missed(design: &[f64], constraints: &[(f64, Vec<f64>)]) -> NearMiss {
        let record = Record { design: design.to_vec(), ..Record::default() };
        let sample = Sample { constraints: constraints.to_vec(), ..Sample::default() };
        NearMiss::of(&record, &sample).expect("one")
    }

    #[test]
    fn a_step_back_keeps_every_bound_to_first_order_and_moves_no_further() {
        // x + 2y <= 1 by 1e-4 too much, and 3x <= 1 with no room.
        let miss = missed(&[0.333, 0.3335], &[(1e-4, vec![1.0, 2.0]), (0.0, vec![3.0, 0.0])]);
        assert_eq!(miss.worst, (0, 1e-4));
        let p = miss.stepped_back(&[0.0; 2], &[1.0; 2]);
        let [dx, dy] = [p[0] - 0.333, p[1] - 0.3335];
        assert!(1e-4 + dx + 2.0 * dy <= 0.0 && 3.0 * dx <= 1e-6, "{dx} {dy}");
        assert!(dx.hypot(dy) < 1.1e-4 / 5.0_f64.sqrt(), "{dx} {dy}");
        // Where one variable is at its bound, the other goes all the way.
        let p = miss.stepped_back(&[0.0, 0.3335], &[1.0; 2]);
        assert!(p[1] == 0.3335 && (0.333 - p[0] - 1e-4).abs() < 2e-6, "{p:?}");
        // Where none can go, the design stays.
        assert_eq!(miss.stepped_back(&[0.333, 0.3335], &[1.0; 2]), [0.333, 0.3335]);
    }

    #[test]
    fn only_what_is_beyond_by_little_and_gains_much_counts() {
        let of = |excess: f64| {
            let sample = Sample { constraints: vec![(excess, vec![1.0])], ..Sample::default() };
            NearMiss::of(&Record { design: vec![0.0], ..Record::default() }, &sample)
        };
        assert!(of(1e-7).is_none() && of(2e-3).is_none());
        let miss = NearMiss { objective: 0.9, ..of(1e-4).expect("near") };
        assert_eq!(miss.gain(Goal::Maximise, 1.0), None);
        assert!((miss.gain(Goal::Minimise, 1.0).expect("a gain") - 0.1).abs() < 1e-15);
        // Less than a hundred times the excess.
        assert_eq!(miss.gain(Goal::Minimise, 0.905), None);
    }
}
