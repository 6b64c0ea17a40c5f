//! How long a step of Newton's method is: where the residual has next to no part along it.
//!
//! With a law whose `H` grows with `B` the part `s(t) = Re r(u + t d)·d` of the residual along a step grows with its length `t`,
//! also where eddy currents flow, which add nothing to it that changes (their form is skew). Of an energy `s` is the slope, and its
//! root the minimum. Far from the solution Newton's own length is a poor one: too short at the foot of a B–H curve, where the
//! permeability has yet to rise, too long at its knee. A slope costs an integral over the elements with a law, a step a factor.
//!
//! Bracketing and regula falsi with the Illinois modification (Dowell and Jarratt, BIT 11 (1971) 168), held off the ends.

/// A slope of at most this part of that at the start is none: a better one saves no step.
const ENOUGH: f64 = 0.1;

/// The longest step, over Newton's own: where the permeability rises the next tangent knows better.
const LONGEST: f64 = 4.0;

/// Evaluations after the first.
const MOST_TRIALS: usize = 8;

/// Least share of a bracket that is cut off.
const LEAST_CUT: f64 = 0.1;

/// A place along a step.
#[derive(Clone, Debug)]
pub(crate) struct Along<T> {
    /// Over Newton's own step.
    pub(crate) length: f64,
    /// `s`.
    slope: f64,
    /// Whether next to nothing of the slope at the start is left.
    pub(crate) is_level: bool,
    /// What was computed there.
    pub(crate) state: T,
}

/// A place with a small slope, beginning at Newton's own step; `at` computes the slope at a length, and what else is wanted of it.
/// The slope at the start is negative.
pub(crate) fn longest_useful<T>(start: f64, mut at: impl FnMut(f64) -> (f64, T)) -> Along<T> {
    let mut place = |length: f64| {
        let (slope, state) = at(length);
        Along { length, slope, is_level: slope.abs() <= ENOUGH * start.abs(), state }
    };
    let mut found = place(1.0);
    let (mut low, mut high) = ([0.0, start], [0.0; 2]);
    let mut was_before = None;
    for _ in 0..MOST_TRIALS {
        if found.is_level || !found.slope.is_finite() {
            return found;
        }
        let is_before = found.slope < 0.0;
        if is_before && high[0] == 0.0 {
            if found.length >= LONGEST {
                return found;
            }
            low = [found.length, found.slope];
            found = place(2.0 * found.length);
            continue;
        }
        // An end that stays twice counts for half, so that both ends close in.
        let stays = if was_before == Some(is_before) { 0.5 } else { 1.0 };
        was_before = Some(is_before);
        if is_before {
            (low, high[1]) = ([found.length, found.slope], stays * high[1]);
        } else {
            (high, low[1]) = ([found.length, found.slope], stays * low[1]);
        }
        let width = high[0] - low[0];
        let share = (low[1] / (low[1] - high[1])).clamp(LEAST_CUT, 1.0 - LEAST_CUT);
        found = place(low[0] + share * width);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(slope: impl Fn(f64) -> f64) -> (Along<()>, usize) {
        let mut count = 0;
        let along = longest_useful(slope(0.0), |t| {
            count += 1;
            (slope(t), ())
        });
        (along, count)
    }

    #[test]
    fn newtons_own_step_is_taken_where_it_is_nearly_right() {
        let (along, count) = found(|t| t - 1.1);
        assert_eq!((along.length, count), (1.0, 1));
    }

    #[test]
    fn a_step_is_cut_short_before_a_wall_and_stretched_on_a_flat() {
        for (root, hardness) in [(0.03, 40.0_f64), (0.4, 8.0), (1.7, 3.0), (3.1, 1.0)] {
            let slope = |t: f64| (hardness * (t - root)).exp() - 1.0 + 0.1 * (t - root);
            let (along, count) = found(slope);
            assert!(along.slope.abs() <= ENOUGH * slope(0.0).abs(), "{root}: {along:?}");
            assert!(count <= 1 + MOST_TRIALS, "{root}: {count}");
        }
    }

    #[test]
    fn no_step_is_longer_than_four_times_newtons_own() {
        let (along, _) = found(|t| -1.0 + 0.01 * t);
        assert_eq!(along.length, LONGEST);
    }
}
