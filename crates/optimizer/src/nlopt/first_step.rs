//! How long the first step of a method is.
//!
//! NLopt's methods are told no length: MMA and CCSAQ start from a penalty `ρ = 1` on the step, the quasi-Newton methods from
//! a Hessian of one. What decides is how large the objective's derivatives are beside that: a factor `s` on the objective
//! is the same as `ρ/s`. From the first gradient `g` the move of every variable is known for every `s`, so that `s` is chosen
//! here such that
//!
//! * no variable moves by more than a given share of its range (a bounded first move, as trust-region methods make it:
//!   Conn, Gould, Toint, *Trust-Region Methods*, SIAM 2000, section 17.2), and
//! * the gradient promises no more than [`PROMISE`] of the objective's own size: a sum of squares that is promised to fall
//!   below zero is about to rise instead.
//!
//! Where the move would break constraints, `g` is what is left of the gradient beside them: `g + Σ λ ∂c/∂p` with the `λ ≥ 0` that
//! make it smallest. A force asks for steel everywhere; of a step made for the whole of that, a full volume leaves the tenth that
//! shifts steel from here to there. MMA is the exception: its approximation is as convex as the whole gradient is steep, whatever
//! the factor.
//!
//! The moves without constraints, with `σ` half the range, of MMA (Svanberg, *SIAM J. Optim.* 12, 555 (2002), as NLopt's
//! `mma.c` has it) and of CCSAQ (`ccsa_quadratic.c`): with `r = s |g| σ / ρ`
//!
//! ```text
//! MMA     φ = 2r / (2r + 1),   move = σ φ / (1 + √(1 − φ²)) ≤ 0.9 σ
//! CCSAQ   move = σ r ≤ σ
//! others  move = s |g|         (the identity as Hessian, a whole step)
//! ```
//!
//! MMA and CCSAQ begin with the same `ρ` for every constraint. What they assume of its curvature, summed over all variables, is
//!
//! ```text
//! MMA     ρ/2 Σ d²/(σ² − d²)
//! CCSAQ   ρ/2 Σ d²/σ²
//! ```
//!
//! after moves `d`, beside its value `c` and the change `Σ |∂c/∂p| d` that its derivatives speak of. A mass of a hundred
//! variables changes by little with each: unscaled, what is assumed is many times what is known, and a search with little room
//! creeps until its tolerance takes it for converged. A factor on the constraint makes what is assumed after the first moves at
//! most a share [`ASSUMED`] of what is known. It is never below one. A method multiplies its penalty by up to ten where a
//! constraint proves to be more curved, at an evaluation each time.

use super::Algorithm;

/// Largest part of the objective's own size that the first step may promise: half of what reaches zero if the objective is
/// linear, a quarter if it is a sum of squares that can vanish.
const PROMISE: f64 = 0.5;

/// Shortest first step, as a share of that asked for: an objective that passes through zero promises nothing by its size.
const LEAST: f64 = 1e-2;

/// What may be assumed of a constraint's curvature in the first step, beside what is known of it. With a tenth a trade between a
/// hundred variables under a full mass begins as if there were no curvature; less makes the steps no longer, and calls for more
/// evaluations where a constraint is curved.
const ASSUMED: f64 = 0.1;

/// Largest factor on a constraint: one that is active and flat.
const LARGEST_FACTOR: f64 = 1e4;

/// Share of the step asked for that CCSAQ begins with: after a success it makes its penalty ten times smaller, and half of the range
/// is then all that limits its second step.
const CAUTION: f64 = 0.5;

/// Sweeps over the constraints that a first move breaks: with one of them, or several that share no variable, the first sweep ends it.
const SWEEPS: usize = 20;

/// Share of its span within which a method leaves a variable that is at one of its bounds.
pub(crate) const ROUNDING: f64 = 1e-12;

/// Share of the moves to all bounds that counts as these.
const NEARLY_ALL: f64 = 0.99;

/// Halvings of the factor's exponent: to the last digits that matter to a length.
const HALVINGS: usize = 60;

/// The largest factor of a range that is too small, and the smallest that is not, where all above one are not.
fn bisected([mut low, mut high]: [f64; 2], is_enough: impl Fn(f64) -> bool) -> [f64; 2] {
    for _ in 0..HALVINGS {
        let middle = (low * high).sqrt();
        *(if is_enough(middle) { &mut high } else { &mut low }) = middle;
    }
    [low, high]
}

/// A search that begins, in the units that NLopt sees.
pub(super) struct Start {
    pub(super) value: f64,
    /// One entry a variable: of the objective, and, once constraints are met, what they leave of it.
    pub(super) gradient: Vec<f64>,
    /// How far every variable may go down and up.
    pub(super) room: [Vec<f64>; 2],
    /// Distance between the bounds of every variable.
    pub(super) span: f64,
}

impl Start {
    /// The factor on the objective with which the largest first move of a variable is `share` of its span, or less where the
    /// gradient promises too much, and, in the same units, the multiplier of every constraint, of which value and gradient are given.
    pub(super) fn meet(
        &mut self,
        algorithm: Algorithm,
        share: f64,
        constraints: &[(f64, Vec<f64>)],
    ) -> (f64, Vec<f64>) {
        let free = self.objective_factor(algorithm, share);
        let mut multipliers = vec![0.0; constraints.len()];
        if algorithm == Algorithm::Mma {
            return (free, multipliers);
        }
        let after = |(value, own): &(f64, Vec<f64>)| {
            let moves = self.steps(algorithm, free).zip(&self.gradient).zip(own);
            value - moves.map(|((step, g), own)| step * g.signum() * own).sum::<f64>()
        };
        let broken: Vec<usize> = (0..constraints.len()).filter(|&c| after(&constraints[c]) > 0.0).collect();
        for _ in 0..SWEEPS {
            for &c in &broken {
                let own = &constraints[c].1;
                let movable = || (0..own.len()).filter(|&k| self.room_against(k) > 0.0);
                let along: f64 = movable().map(|k| own[k] * self.gradient[k]).sum();
                let square: f64 = movable().map(|k| own[k] * own[k]).sum();
                let next =
                    if square > 0.0 { (multipliers[c] - along / square).max(0.0) } else { multipliers[c] };
                let change = next - multipliers[c];
                self.gradient.iter_mut().zip(own).for_each(|(g, own)| *g += change * own);
                multipliers[c] = next;
            }
        }
        // Where constraints take all, what is left has no direction.
        let factor = self.objective_factor(algorithm, share).min(free / LEAST);
        multipliers.iter_mut().for_each(|multiplier| *multiplier *= factor);
        (factor, multipliers)
    }

    /// The factor on the objective for the gradient as it is; 1 where no variable can move.
    fn objective_factor(&self, algorithm: Algorithm, share: f64) -> f64 {
        let movable = (0..self.gradient.len()).filter(|&k| self.room_against(k) > 0.0);
        let steepest = movable.fold(0.0_f64, |steepest, k| steepest.max(self.gradient[k].abs()));
        if steepest == 0.0 {
            return 1.0;
        }
        let share = if algorithm == Algorithm::Ccsaq { CAUTION * share } else { share };
        let within = |share: f64, promise: f64| {
            let fits = |[largest, promised]: [f64; 2]| largest <= share * self.span && promised <= promise;
            // Twelve orders of magnitude around a factor that makes the steepest term of the order of one.
            let range = [1e-12, 1e12].map(|f| f / (steepest * self.span));
            let at_bounds = self.moves(algorithm, range[1]);
            if !fits(at_bounds) {
                return bisected(range, |factor| !fits(self.moves(algorithm, factor)))[0];
            }
            // All may go to their bounds: a factor that is larger than that takes changes no move, and SQP's least squares break down.
            let reaches = |[largest, promised]: [f64; 2]| {
                largest >= NEARLY_ALL * at_bounds[0] && promised >= NEARLY_ALL * at_bounds[1]
            };
            bisected(range, |factor| reaches(self.moves(algorithm, factor)))[1]
        };
        let cautious = within(share, PROMISE * self.value.abs());
        cautious.max(within(LEAST * share, f64::INFINITY))
    }

    /// The factor on a constraint of this value, gradient and multiplier, where the objective has `objective_factor`. A method adds
    /// the constraint's penalty, times its multiplier over this factor, to that of the objective.
    pub(super) fn constraint_factor(
        &self,
        algorithm: Algorithm,
        objective_factor: f64,
        (value, gradient): (f64, &[f64]),
        multiplier: f64,
    ) -> f64 {
        let penalty = |square: f64| match algorithm {
            Algorithm::Mma => square / (1.0 - square),
            Algorithm::Ccsaq => square,
            Algorithm::Slsqp | Algorithm::Lbfgs | Algorithm::Tnewton | Algorithm::Var2 => 0.0,
        };
        let (mut assumed, mut known) = (0.0, (-value).max(0.0));
        for (step, g) in self.steps(algorithm, objective_factor).zip(gradient) {
            assumed += 0.5 * penalty((step / (0.5 * self.span)).powi(2));
            known += g.abs() * step;
        }
        let curved = if assumed > ASSUMED * known { assumed / (ASSUMED * known) } else { 1.0 };
        curved.max(multiplier / ASSUMED).min(LARGEST_FACTOR)
    }

    /// Largest first move of a variable with a factor, and how much the gradient promises of all.
    fn moves(&self, algorithm: Algorithm, factor: f64) -> [f64; 2] {
        self.gradient
            .iter()
            .zip(self.steps(algorithm, factor))
            .fold([0.0, 0.0], |[largest, promised], (g, step)| [largest.max(step), promised + g.abs() * step])
    }

    /// Length of the first move of every variable with a factor on the objective.
    fn steps(&self, algorithm: Algorithm, factor: f64) -> impl Iterator<Item = f64> {
        let half = 0.5 * self.span;
        let free = move |slope: f64| match algorithm {
            Algorithm::Mma => {
                let twice = 2.0 * slope * half;
                let share = twice / (twice + 1.0);
                half * (share / (1.0 + (1.0 - share * share).max(0.0).sqrt())).min(0.9)
            }
            Algorithm::Ccsaq => half * (slope * half).min(1.0),
            Algorithm::Slsqp | Algorithm::Lbfgs | Algorithm::Tnewton | Algorithm::Var2 => slope,
        };
        (0..self.gradient.len()).map(move |k| free(factor * self.gradient[k].abs()).min(self.room_against(k)))
    }

    /// How far a variable may go against its derivative; not at all where only rounding is between it and its bound.
    fn room_against(&self, k: usize) -> f64 {
        let room = self.room[usize::from(self.gradient[k] <= 0.0)][k];
        if room > ROUNDING * self.span { room } else { 0.0 }
    }
}
