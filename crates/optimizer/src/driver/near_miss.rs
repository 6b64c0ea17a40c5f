//! Designs that are beyond a bound by little, and the step back within it.
//!
//! Methods end on a bound from either side. The little by which one is beyond it may be more than counts as kept, and all that
//! the method has found would count for nothing: where a method ends so, one evaluation is left, or the search is looked at after
//! the next one, the best of these designs is evaluated once more, a step back within its bounds. That is an evaluation as others,
//! so that a replay comes to it by itself; where the limit of evaluations asked for it, which a resumed run may have raised, or the
//! look at the search, its record says so.

use super::carry::Carriage;
use super::run::Run;
use super::stop::Stop;
use super::{Record, StopReason};
use crate::error::Error;
use crate::nlopt::{CONSTRAINT_TOLERANCE, Sample};

/// Relative excess over a bound up to which a design is one of these: from farther away a step back to first order loses too much
/// of what was found.
const NEAR: f64 = 1e-2;

/// Relative gain that a step back is worth where the best design keeps the bounds.
const WORTH: f64 = 1e-3;

/// How far within the bounds the step aims, as a share of the excess at least.
const MARGIN: f64 = 0.01;

/// How much farther, by the square of the excess: bounds are curved, by 30 times that for the aggregated thickness of a wall.
const CURVATURE: f64 = 50.0;

/// Projections onto the bounds in turn, most: few hold a design at a time, but two of them may oppose each other nearly, such as volume
/// and loss of one conductor, whose gradients have the cosine −0.99 and take 300.
const SWEEPS: usize = 2000;

/// A design that is beyond a bound by little.
#[derive(Clone, Debug)]
pub(super) struct NearMiss {
    pub(super) evaluation: usize,
    pub(super) objective: f64,
    /// A design near it that keeps all constraints and the bounds of the variables, to first order; `None` where none is found.
    stepped_back: Option<Vec<f64>>,
    /// What the method sees as the value of that design, to first order; without one that of the design itself.
    promised: f64,
    /// The worst of them, and its excess relative to its bound.
    pub(super) worst: (usize, f64),
    has_been_tried: bool,
}

impl NearMiss {
    /// A design, where it is one; the variables have bounds.
    pub(super) fn of(record: &Record, sample: &Sample, bounds: [&[f64]; 2]) -> Option<Self> {
        let excesses = sample.constraints.iter().map(|(excess, _)| *excess).enumerate();
        let worst = excesses.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let is_near = worst.1 > CONSTRAINT_TOLERANCE && worst.1 <= NEAR;
        is_near.then(|| {
            let stepped_back = stepped_back(&record.design, &sample.constraints, worst.1, bounds);
            let promised = stepped_back.as_deref().map(|p| linearised(sample, &record.design, p));
            Self {
                evaluation: record.row.evaluation,
                objective: record.row.objective,
                promised: promised.unwrap_or(sample.value),
                stepped_back,
                worst,
                has_been_tried: false,
            }
        })
    }

    /// What it gains on a best design with this violation and value: where that keeps the bounds, only what is worth an evaluation,
    /// and without a step back what is far more than the excess.
    pub(super) fn gain(&self, (violation, best): (f64, f64)) -> Option<f64> {
        let gain = (best - self.promised) / best.abs();
        let least = if self.stepped_back.is_some() { WORTH } else { WORTH.max(100.0 * self.worst.1) };
        (violation > 0.0 || gain > least).then_some(gain)
    }
}

/// The value of a sample at another design, to first order.
fn linearised(sample: &Sample, from: &[f64], to: &[f64]) -> f64 {
    let at = |(value, gradient): (f64, &[f64])| {
        let moved = to.iter().zip(from).map(|(to, from)| to - from);
        value + gradient.iter().zip(moved).map(|(g, d)| g * d).sum::<f64>()
    };
    let members = sample.members.iter().map(|(value, gradient)| at((*value, gradient)));
    members.reduce(f64::max).unwrap_or_else(|| at((sample.value, &sample.gradient)))
}

/// A design near one that is beyond a bound by a relative excess, within its bounds.
fn stepped_back(
    design: &[f64],
    constraints: &[(f64, Vec<f64>)],
    worst: f64,
    [lower, upper]: [&[f64]; 2],
) -> Option<Vec<f64>> {
    let margin = CONSTRAINT_TOLERANCE.max((MARGIN + CURVATURE * worst) * worst);
    let mut p = design.to_vec();
    for _ in 0..SWEEPS {
        let mut is_within = true;
        for (value, gradient) in constraints {
            let moved = p.iter().zip(design).map(|(p, from)| p - from);
            let excess = value + gradient.iter().zip(moved).map(|(g, d)| g * d).sum::<f64>();
            if excess <= CONSTRAINT_TOLERANCE - margin {
                continue;
            }
            is_within = false;
            // Variables at a bound that the step points out of do not move.
            let is_free = |k: usize| if gradient[k] > 0.0 { p[k] > lower[k] } else { p[k] < upper[k] };
            let free: Vec<usize> = (0..p.len()).filter(|&k| is_free(k)).collect();
            let square: f64 = free.iter().map(|&k| gradient[k].powi(2)).sum();
            if square == 0.0 {
                return None;
            }
            let step = (excess + margin) / square;
            free.iter().for_each(|&k| p[k] = (p[k] - step * gradient[k]).clamp(lower[k], upper[k]));
        }
        if is_within {
            return Some(p);
        }
    }
    None
}

impl Run<'_> {
    /// Of the designs beyond their bounds by little that are `wanted`, the one that gains most on the best one.
    fn greatest_miss(&self, wanted: impl Fn(&NearMiss) -> bool) -> Option<usize> {
        let best = self.incumbent_sample()?;
        let misses = self.near_misses.iter().enumerate().filter(|(_, miss)| wanted(miss));
        let gains = misses.filter_map(|(k, miss)| Some((k, miss.gain(best)?)));
        gains.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
    }

    /// The one that gains most.
    pub(super) fn missed(&self) -> Option<&NearMiss> {
        self.greatest_miss(|_| true).map(|k| &self.near_misses[k])
    }

    /// The one that gains most of those whose step back has not been tried, nor is one of these evaluations.
    fn untried(&self, but: &[usize]) -> Option<usize> {
        self.greatest_miss(|miss| !miss.has_been_tried && !but.contains(&miss.evaluation))
    }

    /// The next step back that the mesh carries, with the number of its miss. To look ahead for one changes nothing, as a replay does
    /// not.
    pub(super) fn next_step_back(&mut self) -> Result<Option<(usize, Carriage)>, Stop> {
        let mut refused = Vec::new();
        while let Some(k) = self.untried(&refused) {
            if let Some(design) = self.near_misses[k].stepped_back.clone() {
                match self.carry(&design) {
                    Ok(carried) if !carried.is_cut() => return Ok(Some((k, carried))),
                    Ok(_) | Err(Stop::Mesh(_)) => {}
                    Err(other) => return Err(other),
                }
            }
            refused.push(self.near_misses[k].evaluation);
        }
        Ok(None)
    }

    /// Where a search ends and a design beyond its bounds by little is far better than the best one within them: evaluates it a
    /// step back within them. The search goes on from there where that is a gain, or where evaluations are left that a limit had
    /// ended; else the reason why it ends.
    ///
    /// # Errors
    /// As an evaluation; one that fails for its numbers leaves the search at its end.
    pub(super) fn step_back(&mut self, reason: StopReason) -> Result<Option<StopReason>, Error> {
        let is_limit = reason == StopReason::MaxEvaluations;
        if !(reason.is_of_method() || is_limit) || self.untried(&[]).is_none() {
            return Ok(Some(reason));
        }
        if !self.is_replaying() {
            match self.limit_reached() {
                Some(StopReason::Interrupted) => return Ok(Some(StopReason::Interrupted)),
                Some(_) => return Ok(Some(reason)),
                None if self.evaluations >= self.settings.max_evaluations => return Ok(Some(reason)),
                None => {}
            }
        }
        self.stepping_back = Some(reason);
        let has_gained = self.evaluated_step_back();
        self.stepping_back = None;
        match has_gained {
            Ok(Some(has_gained)) if has_gained || is_limit => Ok(None),
            Ok(_) => Ok(Some(reason)),
            Err(Stop::Limit(limit)) => Ok(Some(limit)),
            Err(Stop::Error(error)) if error.is_numerical() => {
                self.warn(&error.to_string());
                Ok(Some(reason))
            }
            Err(Stop::Error(error)) => Err(*error),
            Err(Stop::Mesh(_) | Stop::CutShort | Stop::Astray | Stop::Stagnant) => Ok(Some(reason)),
        }
    }

    /// Whether the next step back is a gain; `None` where there is none.
    fn evaluated_step_back(&mut self) -> Result<Option<bool>, Stop> {
        let Some((k, carried)) = self.next_step_back()? else { return Ok(None) };
        let before = self.best_evaluation();
        self.near_misses[k].has_been_tried = true;
        let (evaluation, excess) = (self.near_misses[k].evaluation, self.near_misses[k].worst.1);
        self.sample_of(&carried.design, (&carried.moved, carried.seconds))?;
        let has_gained = self.best_evaluation() != before;
        if has_gained {
            self.is_held_back = carried.is_held_back();
        }
        let outcome = if has_gained { "the best one now" } else { "no gain" };
        self.observer.note(&format!(
            "evaluation {evaluation} was beyond a bound by {excess:.1e} of it; the design a step back within its bounds is {outcome}"
        ));
        Ok(Some(has_gained))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn missed(design: &[f64], constraints: &[(f64, Vec<f64>)], bounds: [&[f64]; 2]) -> NearMiss {
        let record = Record { design: design.to_vec(), ..Record::default() };
        let sample = Sample { constraints: constraints.to_vec(), ..Sample::default() };
        NearMiss::of(&record, &sample, bounds).expect("one")
    }

    #[test]
    fn a_step_back_keeps_every_bound_to_first_order_and_moves_no_further() {
        // x + 2y <= 1 by 1e-4 too much, and 3x <= 1 with no room.
        let beyond = |lower: &[f64]| {
            missed(&[0.333, 0.3335], &[(1e-4, vec![1.0, 2.0]), (0.0, vec![3.0, 0.0])], [lower, &[1.0; 2]])
        };
        let miss = beyond(&[0.0; 2]);
        assert_eq!(miss.worst, (0, 1e-4));
        let p = miss.stepped_back.expect("there is room");
        let [dx, dy] = [p[0] - 0.333, p[1] - 0.3335];
        assert!(1e-4 + dx + 2.0 * dy <= 0.0 && 3.0 * dx <= 1e-6, "{dx} {dy}");
        assert!(dx.hypot(dy) < 1.1e-4 / 5.0_f64.sqrt(), "{dx} {dy}");
        // Where one variable is at its bound, the other goes all the way.
        let p = beyond(&[0.0, 0.3335]).stepped_back.expect("there is room");
        assert!(p[1] == 0.3335 && (0.333 - p[0] - 1e-4).abs() < 2e-6, "{p:?}");
        // Bounds that nearly oppose each other leave a narrow way between them.
        let narrow = [(1e-4, vec![1.0, 0.0]), (1e-4, vec![-0.99, 0.14])];
        let p = missed(&[0.5; 2], &narrow, [&[0.0; 2], &[1.0; 2]]).stepped_back.expect("there is room");
        let [dx, dy] = [p[0] - 0.5, p[1] - 0.5];
        assert!(dx <= -1e-4 && 1e-4 - 0.99 * dx + 0.14 * dy <= 1e-6, "{dx} {dy}");
        // Where none can go, or bounds oppose each other, there is none.
        assert_eq!(beyond(&[0.333, 0.3335]).stepped_back, None);
        let opposed = missed(&[0.5], &[(1e-4, vec![1.0]), (1e-4, vec![-1.0])], [&[0.0], &[1.0]]);
        assert_eq!(opposed.stepped_back, None);
    }

    #[test]
    fn what_is_beyond_by_little_counts_by_what_its_step_back_promises() {
        let of = |excess: f64, gradient: f64, lower: f64| {
            let constraints = vec![(excess, vec![1.0])];
            let sample = Sample { value: 0.9, gradient: vec![gradient], constraints, ..Sample::default() };
            NearMiss::of(&Record { design: vec![0.0], ..Record::default() }, &sample, [&[lower], &[1.0]])
        };
        assert!(of(1e-7, 0.0, -1.0).is_none() && of(2e-2, 0.0, -1.0).is_none());
        let gain = |miss: &Option<NearMiss>, best| miss.as_ref().expect("near").gain(best);
        // By .5 %, and .0063 back.
        let flat = of(5e-3, 0.0, -1.0);
        assert!((gain(&flat, (0.0, 1.0)).expect("a gain") - 0.1).abs() < 1e-15);
        assert_eq!(gain(&flat, (0.0, 0.9005)), None, "less than an evaluation is worth");
        let steep = of(5e-3, -5.0, -1.0);
        let promised = gain(&steep, (0.0, 1.0)).expect("a gain");
        assert!((promised - (0.1 - 5.0 * (5e-3 + 1.3e-3))).abs() < 1e-4, "{promised}");
        assert_eq!(gain(&of(5e-3, -20.0, -1.0), (0.0, 1.0)), None, "the step back loses it");
        // Without one only what is a hundred times the excess; but any that keeps the bounds is better than one that does not.
        let held = of(5e-3, 0.0, 0.0);
        assert_eq!(gain(&held, (0.0, 1.0)), None);
        assert!(gain(&held, (1e-5, 0.8)).is_some());
    }
}
