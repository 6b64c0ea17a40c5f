//! What the gradient at a design still promises: how much the objective would fall, to first order, if every variable went to
//! the bound that its derivative points at.
//!
//! At an optimum it is zero: derivatives are zero, or point out of a bound, or are held by a constraint (multipliers). It is
//! far above the gain that is to be had, for an objective is not linear over the bounds; how it falls over a run tells whether
//! a search has converged or was only held in a small trust region.

use crate::nlopt::{ROUNDING, Sample};

/// Constraints nearer to their bound than this share of it hold a design.
const ACTIVE: f64 = 1e-3;

/// Sweeps over the multipliers: few constraints hold a design at a time.
const SWEEPS: usize = 50;

/// Multiple of the tolerance that the gradient may promise where a search that has gained nothing is believed. A method that begins
/// anew knows no curvature, and its first steps gain little: quasi-Newton methods and SQP ended so where the objective was to fall to a
/// third and to a seventh, and the gradient promised three to five thousand times the tolerance.
pub(super) const BELIEVED_TOLERANCES: f64 = 100.0;

/// Multiple of the tolerance below which nothing is promised: a search from there finds rounding.
pub(super) const HELD_TOLERANCES: f64 = 0.01;

/// The gain between the bounds, relative to the value of the sample, by the multipliers of least norm.
pub(super) fn promised_gain(sample: &Sample, design: &[f64], lower: &[f64], upper: &[f64]) -> f64 {
    let room = Room { design, lower, upper };
    let mut reduced = Reduced::of(sample);
    (0..SWEEPS).for_each(|_| reduced.sweep(|_, _| true));
    room.gain(&reduced.gradient) / size(sample)
}

/// The same by the multipliers that leave the least of several, with what the slack of the constraints allows: each leaves a bound on
/// what the linear problem has, and these look at the variables alone that have room against the gradient. At an optimum that
/// constraints and bounds hold together it is zero, where [`promised_gain`] is not.
pub(super) fn least_promised_gain(sample: &Sample, design: &[f64], lower: &[f64], upper: &[f64]) -> f64 {
    let room = Room { design, lower, upper };
    let mut reduced = Reduced::of(sample);
    let mut least = room.gain(&reduced.gradient);
    for _ in 0..SWEEPS {
        reduced.sweep(|k, slope| room.against(k, slope) > 0.0);
        least = least.min(room.gain(&reduced.gradient) + reduced.by_slack());
    }
    least / size(sample)
}

fn size(sample: &Sample) -> f64 {
    sample.value.abs().max(f64::MIN_POSITIVE)
}

/// How far the variables of a design may go.
struct Room<'a> {
    design: &'a [f64],
    lower: &'a [f64],
    upper: &'a [f64],
}

impl Room<'_> {
    /// Of a variable against its derivative; none where only rounding is between it and its bound.
    fn against(&self, k: usize, slope: f64) -> f64 {
        let room = if slope > 0.0 { self.design[k] - self.lower[k] } else { self.upper[k] - self.design[k] };
        if room > ROUNDING * (self.upper[k] - self.lower[k]) { room } else { 0.0 }
    }

    /// What a gradient promises of all.
    fn gain(&self, gradient: &[f64]) -> f64 {
        gradient.iter().enumerate().map(|(k, slope)| slope.abs() * self.against(k, *slope)).sum()
    }
}

/// What the constraints that are active leave of a gradient: `g + Σ μ ∇c`, `μ ≥ 0`.
struct Reduced {
    gradient: Vec<f64>,
    /// The active ones.
    held: Vec<Held>,
}

/// A constraint that is active.
struct Held {
    gradient: Vec<f64>,
    /// How far it is from its bound.
    slack: f64,
    multiplier: f64,
}

impl Reduced {
    /// With multipliers of zero.
    fn of(sample: &Sample) -> Self {
        let gradient = sample.gradient.clone();
        // The worst case may fall only as far as the other terms stay below it.
        let difference = |of: &[f64]| of.iter().zip(&gradient).map(|(own, worst)| own - worst).collect();
        let others = sample.members.iter().map(|(value, of)| (value - sample.value, difference(of)));
        let holding = sample.constraints.iter().chain(&sample.limits).cloned().chain(others);
        let held =
            |(value, gradient): (f64, Vec<f64>)| Held { gradient, slack: (-value).max(0.0), multiplier: 0.0 };
        let held = holding.filter(|(value, _)| *value > -ACTIVE).map(held).collect();
        Self { gradient, held }
    }

    /// What the linear problem gains by going up to the bounds of the constraints.
    fn by_slack(&self) -> f64 {
        self.held.iter().map(|own| own.multiplier * own.slack).sum()
    }

    /// One multiplier after the other for the least norm over the variables that have a say, by number and derivative.
    fn sweep(&mut self, has_say: impl Fn(usize, f64) -> bool) {
        let Self { gradient, held } = self;
        for Held { gradient: of, multiplier, .. } in held {
            let counted = || gradient.iter().zip(&*of).enumerate().filter(|(k, (g, _))| has_say(*k, **g));
            let along: f64 = counted().map(|(_, (g, c))| g * c).sum();
            let square: f64 = counted().map(|(_, (_, c))| c * c).sum();
            if square > 0.0 {
                let next = (*multiplier - along / square).max(0.0);
                let step = next - *multiplier;
                gradient.iter_mut().zip(&*of).for_each(|(g, c)| *g += step * c);
                *multiplier = next;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(gradient: &[f64], constraints: &[(f64, Vec<f64>)]) -> Sample {
        let (gradient, constraints) = (gradient.to_vec(), constraints.to_vec());
        Sample { value: -0.5, gradient, constraints, ..Sample::default() }
    }

    #[test]
    fn a_bound_or_a_constraint_holds_what_points_at_it() {
        let (lower, upper) = ([-1.0; 2], [1.0; 2]);
        let gain = |sample: &Sample, design: [f64; 2]| promised_gain(sample, &design, &lower, &upper);
        // Down by 1 in the first, up by 0.5 in the second; both over the value of 0.5.
        let free = sample(&[0.1, -0.2], &[]);
        assert!((gain(&free, [0.0, 0.5]) - 0.4).abs() < 1e-15);
        assert_eq!(gain(&free, [-1.0, 1.0]), 0.0);
        // The optimum of a linear objective under x + 2y <= 1, at its bound and away from it.
        let held = sample(&[-0.1, -0.2], &[(0.0, vec![1.0, 2.0])]);
        assert!(gain(&held, [0.0, 0.5]) < 1e-15);
        assert!(gain(&sample(&[-0.1, -0.2], &[(-0.5, vec![1.0, 2.0])]), [0.0, 0.0]) > 0.5);
        // A constraint does not hold what leads away from it.
        assert!((gain(&sample(&[0.1, 0.2], &[(0.0, vec![1.0, 2.0])]), [0.0, 0.0]) - 0.6).abs() < 1e-15);
        // Of two terms of a worst case whose gradients oppose each other, neither can fall.
        let mut kink = sample(&[-0.3, 0.0], &[]);
        kink.members = vec![(-0.5, vec![-0.3, 0.0]), (-0.5, vec![0.1, 0.0])];
        assert!(gain(&kink, [0.0, 0.0]) < 1e-9);
        kink.members[1].0 = -0.6;
        assert!(gain(&kink, [0.0, 0.0]) > 0.5);
        // A bound and a constraint that hold it together, by another multiplier than that of least norm over both variables.
        let both = sample(&[-0.1, -0.9], &[(0.0, vec![1.0, 2.0])]);
        let least = |design: [f64; 2]| least_promised_gain(&both, &design, &lower, &upper);
        assert!(gain(&both, [0.0, 1.0]) > 0.5 && least([0.0, 1.0]) < 1e-9);
        assert!(least([0.0, 0.5]) > 0.1, "the second has room");
        assert!(least([0.0, 1.0 - 1e-15]) < 1e-9, "rounding is no room");
        // The slack of a constraint is there to be gained: a slope of 1 up to 9e-4, over the value of ½.
        let nearly = sample(&[-1.0, -0.5], &[(-9e-4, vec![1.0, 0.0])]);
        let by_slack = least_promised_gain(&nearly, &[0.0, 1.0], &lower, &upper);
        assert!((by_slack / 1.8e-3 - 1.0).abs() < 1e-9, "{by_slack}");
        // Two that hold it together.
        let two = [(0.0, vec![1.0, 0.0]), (0.0, vec![1.0, 1.0])];
        assert!(gain(&sample(&[-0.3, -0.2], &two), [0.0, 0.0]) < 1e-9);
    }
}
