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

/// Halvings of the factor's exponent: to the last digits that matter to a length.
const HALVINGS: usize = 60;

/// A search that begins, in the units that NLopt sees.
pub(super) struct Start<'a> {
    pub(super) value: f64,
    /// One entry a variable.
    pub(super) gradient: &'a [f64],
    /// How far every variable may go against its derivative.
    pub(super) room: &'a [f64],
    /// Distance between the bounds of every variable.
    pub(super) span: f64,
}

impl Start<'_> {
    /// The factor on the objective with which the largest first move of a variable is `share` of its span, or less where the
    /// gradient promises too much; 1 where no variable can move.
    pub(super) fn objective_factor(&self, algorithm: Algorithm, share: f64) -> f64 {
        let movable = self.gradient.iter().zip(self.room).filter(|(_, room)| **room > 0.0);
        let steepest = movable.fold(0.0_f64, |steepest, (g, _)| steepest.max(g.abs()));
        if steepest == 0.0 {
            return 1.0;
        }
        let within = |share: f64, promise: f64| {
            // Twelve orders of magnitude around a factor that makes the steepest term of the order of one.
            let [mut low, mut high] = [1e-12, 1e12].map(|f| f / (steepest * self.span));
            for _ in 0..HALVINGS {
                let middle = (low * high).sqrt();
                let [largest, promised] = self.moves(algorithm, middle);
                let fits = largest <= share * self.span && promised <= promise;
                *(if fits { &mut low } else { &mut high }) = middle;
            }
            low
        };
        let cautious = within(share, PROMISE * self.value.abs());
        cautious.max(within(LEAST * share, f64::INFINITY))
    }

    /// The factor on a constraint of this value and gradient, where the objective has `objective_factor`.
    pub(super) fn constraint_factor(
        &self,
        algorithm: Algorithm,
        objective_factor: f64,
        (value, gradient): (f64, &[f64]),
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
        if assumed > ASSUMED * known { (assumed / (ASSUMED * known)).min(LARGEST_FACTOR) } else { 1.0 }
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
        self.gradient.iter().zip(self.room).map(move |(g, room)| free(factor * g.abs()).min(*room))
    }
}
