//! What the gradient at a design still promises: how much the objective would fall, to first order, if every variable went to
//! the bound that its derivative points at.
//!
//! At an optimum it is zero: derivatives are zero, or point out of a bound, or are held by a constraint (multipliers). It is
//! far above the gain that is to be had, for an objective is not linear over the bounds; how it falls over a run tells whether
//! a search has converged or was only held in a small trust region.

use crate::nlopt::Sample;

/// Constraints nearer to their bound than this share of it hold a design.
const ACTIVE: f64 = 1e-3;

/// Sweeps over the multipliers: few constraints hold a design at a time.
const SWEEPS: usize = 50;

/// Relative gain below which a search has gained nothing, where `ftol_rel` is finer.
pub(super) const LEAST_GAIN: f64 = 1e-6;

/// Multiple of the tolerance that the gradient may promise where a search that has gained nothing is believed. A method that begins
/// anew knows no curvature, and its first steps gain little: quasi-Newton methods and SQP ended so where the objective was to fall to a
/// third and to a seventh, and the gradient promised three to five thousand times the tolerance.
pub(super) const BELIEVED_TOLERANCES: f64 = 100.0;

/// The gain between the bounds, relative to the value of the sample.
pub(super) fn promised_gain(sample: &Sample, design: &[f64], lower: &[f64], upper: &[f64]) -> f64 {
    let mut gradient = sample.gradient.clone();
    remove_held(&mut gradient, &holding(sample));
    let gain = |k: usize| {
        let room = if gradient[k] > 0.0 { design[k] - lower[k] } else { upper[k] - design[k] };
        gradient[k].abs() * room.max(0.0)
    };
    (0..design.len()).map(gain).sum::<f64>() / sample.value.abs().max(f64::MIN_POSITIVE)
}

/// The same by the multipliers that leave the least of several: each leaves a bound on what the linear problem has, and these look at
/// the variables alone that have room against the gradient. At an optimum that constraints and bounds hold together it is zero, where
/// [`promised_gain`] is not.
pub(super) fn least_promised_gain(sample: &Sample, design: &[f64], lower: &[f64], upper: &[f64]) -> f64 {
    let room = |k: usize, slope: f64| {
        if slope > 0.0 { (design[k] - lower[k]).max(0.0) } else { (upper[k] - design[k]).max(0.0) }
    };
    let gain =
        |gradient: &[f64]| gradient.iter().enumerate().map(|(k, g)| g.abs() * room(k, *g)).sum::<f64>();
    let mut gradient = sample.gradient.clone();
    let mut held = holding(sample);
    held.retain(|(value, _)| *value > -ACTIVE);
    let mut multipliers = vec![0.0_f64; held.len()];
    let mut least = gain(&gradient);
    for _ in 0..SWEEPS {
        for ((_, of), multiplier) in held.iter().zip(&mut multipliers) {
            let movable: Vec<usize> = (0..of.len()).filter(|&k| room(k, gradient[k]) > 0.0).collect();
            let along: f64 = movable.iter().map(|&k| gradient[k] * of[k]).sum();
            let square: f64 = movable.iter().map(|&k| of[k] * of[k]).sum();
            let next = if square > 0.0 { (*multiplier - along / square).max(0.0) } else { *multiplier };
            let step = next - *multiplier;
            gradient.iter_mut().zip(of).for_each(|(g, c)| *g += step * c);
            *multiplier = next;
        }
        least = least.min(gain(&gradient));
    }
    least / sample.value.abs().max(f64::MIN_POSITIVE)
}

/// What may hold a design: its constraints, and, as a worst case may fall only as far as the other terms stay below it, these.
fn holding(sample: &Sample) -> Vec<(f64, Vec<f64>)> {
    let difference = |of: &[f64]| of.iter().zip(&sample.gradient).map(|(own, worst)| own - worst).collect();
    let others = sample.members.iter().map(|(value, of)| (value - sample.value, difference(of)));
    sample.constraints.iter().cloned().chain(others).collect()
}

/// Adds to a gradient what the constraints that are active hold of it: `g + Σ μ ∇c` of least norm, `μ ≥ 0`.
fn remove_held(gradient: &mut [f64], constraints: &[(f64, Vec<f64>)]) {
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let active: Vec<(&[f64], f64)> = constraints
        .iter()
        .filter(|(value, _)| *value > -ACTIVE)
        .map(|(_, of)| (of.as_slice(), product(of, of)))
        .filter(|(_, square)| *square > 0.0)
        .collect();
    let mut multipliers = vec![0.0; active.len()];
    for _ in 0..SWEEPS {
        for ((of, square), multiplier) in active.iter().zip(&mut multipliers) {
            let next = (*multiplier - product(gradient, of) / square).max(0.0);
            let step = next - *multiplier;
            gradient.iter_mut().zip(*of).for_each(|(g, c)| *g += step * c);
            *multiplier = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(gradient: &[f64], constraints: &[(f64, Vec<f64>)]) -> Sample {
        let (gradient, constraints) = (gradient.to_vec(), constraints.to_vec());
        Sample { value: -0.5, gradient, constraints, members: Vec::new() }
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
        // Two that hold it together.
        let two = [(0.0, vec![1.0, 0.0]), (0.0, vec![1.0, 1.0])];
        assert!(gain(&sample(&[-0.3, -0.2], &two), [0.0, 0.0]) < 1e-9);
    }
}
