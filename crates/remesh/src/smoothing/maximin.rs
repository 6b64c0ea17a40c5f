//! The largest least value of a few affine functions in space, at a price for the distance.
//!
//! `maximise min_i (a_i + g_i · d) − |d|² / (2 ρ)` over `d`. The dual is a quadratic programme over the weights of a
//! convex combination, `minimise ρ/2 |Σ λ_i g_i|² + Σ λ_i a_i`, with `d = ρ Σ λ_i g_i`: for large ρ the steepest
//! ascent along the active functions, and no more than four of them carry weight. It is solved by growing and
//! shrinking the active set as in Wolfe's method for the nearest point of a polytope (Math. Programming 11, 1976).

use fluxmorph_geometry::tet4::{Point, dot};

/// Functions that may carry weight while the set is searched: four at a vertex, one coming in, one to spare.
const CAPACITY: usize = 6;

/// Changes of the active set after which the step found so far is taken; a dozen is usual.
const CHANGES: usize = 100;

/// Relative size of what keeps the equations of an active set regular.
///
/// Five functions have dependent gradients: the solution then is huge, and the search along it drops one of them.
const REGULARISATION: f64 = 1e-11;

/// A step and what it promises.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    /// The step `d`.
    pub step: Point,
    /// Rise of the least value of the affine functions, not negative up to rounding.
    pub gain: f64,
}

/// The best step of `min_i (values_i + gradients_i · d)` that is no longer than `radius`.
///
/// The price `ρ = radius / max |g_i|` keeps to the radius, as `d` is ρ times a mean of the gradients.
pub(super) fn step(values: &[f64], gradients: &[Point], radius: f64) -> Step {
    let none = Step { step: [0.0; 3], gain: 0.0 };
    let steepest = gradients.iter().map(|&g| dot(g, g)).fold(0.0, f64::max).sqrt();
    let Some(first) = (0..values.len()).min_by(|&i, &j| values[i].total_cmp(&values[j])) else { return none };
    if !(steepest > 0.0 && steepest.is_finite()) {
        return none;
    }
    let reach = radius / steepest;
    let along = |active: &Active| {
        active.iter().fold([0.0; 3], |d, (i, w)| [0, 1, 2].map(|c| d[c] + reach * w * gradients[i][c]))
    };
    let value = |i: usize, d: Point| values[i] + dot(gradients[i], d);

    let mut active = Active { count: 1, members: [first; CAPACITY], weights: [1.0; CAPACITY] };
    for _ in 0..CHANGES {
        let d = along(&active);
        let level: f64 = active.iter().map(|(i, w)| w * value(i, d)).sum();
        let lowest = (0..values.len()).min_by(|&i, &j| value(i, d).total_cmp(&value(j, d))).unwrap_or(first);
        let tolerance = 1e-12 * (level.abs() + radius * steepest);
        if value(lowest, d) >= level - tolerance || active.iter().any(|(i, _)| i == lowest) {
            break;
        }
        if active.count == CAPACITY {
            break;
        }
        active.push(lowest);
        let product = |i: usize, j: usize| {
            let regular = if i == j { REGULARISATION * steepest * steepest } else { 0.0 };
            reach * (dot(gradients[i], gradients[j]) + regular)
        };
        if !active.balance(values, product) {
            break;
        }
    }
    let d = along(&active);
    let least = (0..values.len()).map(|i| value(i, d)).fold(f64::INFINITY, f64::min);
    Step { step: d, gain: least - values[first] }
}

/// The functions that carry weight.
struct Active {
    count: usize,
    members: [usize; CAPACITY],
    weights: [f64; CAPACITY],
}

impl Active {
    fn iter(&self) -> impl Iterator<Item = (usize, f64)> {
        (0..self.count).map(|s| (self.members[s], self.weights[s]))
    }

    fn push(&mut self, member: usize) {
        (self.members[self.count], self.weights[self.count]) = (member, 0.0);
        self.count += 1;
    }

    fn remove(&mut self, slot: usize) {
        self.members.copy_within(slot + 1..self.count, slot);
        self.weights.copy_within(slot + 1..self.count, slot);
        self.count -= 1;
    }

    /// Goes to the weights at which all members have one value, dropping those whose weight ends on the way there.
    ///
    /// Returns whether the equations could be solved; if not, the weights stay a convex combination.
    fn balance(&mut self, values: &[f64], product: impl Fn(usize, usize) -> f64) -> bool {
        while self.count > 1 {
            let Some(wanted) = self.balanced_weights(values, &product) else { return false };
            let share = |s: usize| self.weights[s] / (self.weights[s] - wanted[s]);
            let ends = (0..self.count).filter(|&s| wanted[s] <= 0.0);
            let Some(slot) = ends.min_by(|&s, &t| share(s).total_cmp(&share(t))) else {
                self.weights[..self.count].copy_from_slice(&wanted[..self.count]);
                return true;
            };
            let taken = share(slot);
            // A member that comes in with weight 0 and would go below has no place: 0 / 0 ends the search.
            if !taken.is_finite() {
                return false;
            }
            for s in 0..self.count {
                self.weights[s] += taken * (wanted[s] - self.weights[s]);
            }
            self.remove(slot);
        }
        self.weights[0] = 1.0;
        true
    }

    /// Weights with `Σ_j product(i, j) λ_j + a_i` equal for all members and `Σ λ = 1`: elimination with pivoting.
    fn balanced_weights(
        &self,
        values: &[f64],
        product: impl Fn(usize, usize) -> f64,
    ) -> Option<[f64; CAPACITY]> {
        const SIZE: usize = CAPACITY + 1;
        let n = self.count;
        let mut rows = [[0.0; SIZE + 1]; SIZE];
        // The border is scaled to the products, so that pivots compare alike.
        let border = (0..n).map(|s| product(self.members[s], self.members[s])).fold(0.0, f64::max);
        for s in 0..n {
            for t in 0..n {
                rows[s][t] = product(self.members[s], self.members[t]);
            }
            (rows[s][n], rows[n][s]) = (border, border);
            rows[s][SIZE] = -values[self.members[s]];
        }
        rows[n][SIZE] = border;
        for column in 0..=n {
            let pivot =
                (column..=n).max_by(|&a, &b| rows[a][column].abs().total_cmp(&rows[b][column].abs()))?;
            rows.swap(column, pivot);
            if rows[column][column] == 0.0 {
                return None;
            }
            for row in column + 1..=n {
                let factor = rows[row][column] / rows[column][column];
                for c in column..=SIZE {
                    rows[row][c] -= factor * rows[column][c];
                }
            }
        }
        let mut solution = [0.0; SIZE];
        for row in (0..=n).rev() {
            let known: f64 = (row + 1..=n).map(|c| rows[row][c] * solution[c]).sum();
            solution[row] = (rows[row][SIZE] - known) / rows[row][row];
        }
        let weights = std::array::from_fn(|s| solution[s]);
        solution[..=n].iter().all(|x| x.is_finite()).then_some(weights)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn price(values: &[f64], gradients: &[Point], radius: f64, d: Point) -> f64 {
        let steepest = gradients.iter().map(|&g| dot(g, g)).fold(0.0, f64::max).sqrt();
        let least = values.iter().zip(gradients).map(|(a, &g)| a + dot(g, d)).fold(f64::INFINITY, f64::min);
        least - dot(d, d) * steepest / (2.0 * radius)
    }

    #[test]
    fn one_function_is_climbed_to_the_radius_and_two_to_their_ridge() {
        let one = step(&[0.5], &[[0.0, 2.0, 0.0]], 0.25);
        assert_eq!(one, Step { step: [0.0, 0.25, 0.0], gain: 0.5 });
        // 0 + x + 0.2 y and 0.5 − x + 0.2 y meet at x = 0.25; along the ridge y = ρ · 0.2.
        let two = step(&[0.0, 0.5], &[[1.0, 0.2, 0.0], [-1.0, 0.2, 0.0]], 1.0);
        let reach = 1.0 / 1.04f64.sqrt();
        for (found, expected) in two.step.into_iter().zip([0.25, 0.2 * reach, 0.0]) {
            assert!((found - expected).abs() < 1e-9, "{two:?}");
        }
        assert!((two.gain - 0.25 - 0.04 * reach).abs() < 1e-9);
    }

    #[test]
    fn functions_without_slope_or_at_their_common_peak_give_no_step() {
        let none = Step { step: [0.0; 3], gain: 0.0 };
        assert_eq!(step(&[], &[], 1.0), none);
        assert_eq!(step(&[1.0, 2.0], &[[0.0; 3]; 2], 1.0), none);
        let peak = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]];
        let found = step(&[0.3; 4], &peak, 1.0);
        assert!(found.gain.abs() < 1e-12 && dot(found.step, found.step) < 1e-20, "{found:?}");
    }

    proptest! {
        #[test]
        fn no_other_step_is_better(
            values in prop::collection::vec(-1.0..1.0f64, 24),
            gradients in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 24),
            others in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 200),
            radius in 1e-3..10.0f64,
        ) {
            let found = step(&values, &gradients, radius);
            prop_assert!(dot(found.step, found.step).sqrt() <= radius * (1.0 + 1e-9));
            let best = price(&values, &gradients, radius, found.step);
            // The function is concave: neighbours of the step, at any scale, suffice.
            for other in &others {
                for size in [1.0, 0.1, 1e-3] {
                    let d = [0, 1, 2].map(|c| found.step[c] + size * radius * other[c]);
                    prop_assert!(price(&values, &gradients, radius, d) <= best + 1e-8);
                }
            }
        }
    }
}
