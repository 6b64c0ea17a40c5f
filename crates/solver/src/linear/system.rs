//! One matrix of this process with its preconditioner: solutions, and what is done when one does not come.
//!
//! What fails, and what follows:
//!
//! | cause | what happens |
//! |---|---|
//! | the right side has an entry that is not finite, or the square of its norm is out of range | an error, nothing is solved |
//! | a diagonal entry is zero, negative or not finite; a pivot is zero, lost or not finite; no memory | the next more robust method |
//! | the iteration breaks down, diverges to no number, or stops short of the residual | with an earlier factor: a factor of this matrix; with its own: the next method |
//! | the last method stops short of the residual, at the rounding of `K x` | the solution, where what is left has no share of its energy |
//! | no method is left | an error with the last cause |
//!
//! A solution is given out only with its true residual, computed from matrix and right side in double precision: a residual
//! that is a number has none but finite entries of the solution behind it, since every unknown has a diagonal entry.

use std::sync::Arc;

use fluxmorph_geometry::fem::{CsrMatrix, c64, norm};

use super::analysis::SystemAnalysis;
use super::cache::{CachedPreconditioner, LinearSolverCache};
use super::cocg;
use super::cost::Ledger;
use super::factor::KeptPart;
use super::method::{Method, Reuse};
use super::preconditioner::Preconditioner;
use super::range::checked_norm;
use super::report::LinearSolverReport;
use super::rounding::Left;
use crate::error::{NonConvergence, SolverError};

/// Iterations after which the speed of an iteration can be judged.
const TRIAL: usize = 3;

/// Iterations that a complete factor in single precision is given, tenfold, where one in double precision could follow: that
/// costs as much as some 60 of them.
const LEAST_SINGLE: usize = 6;

/// Solutions of a design of which nothing is known: state and adjoint.
const USUAL_SOLUTIONS: usize = 2;

/// Something that the solver did beside solving.
#[derive(Clone, Debug, PartialEq)]
pub enum SolverEvent {
    /// A method failed and a more robust one took its place.
    FellBack {
        /// The method that failed.
        from: Method,
        /// The one taken.
        to: Method,
        /// What happened.
        cause: String,
    },
}

impl std::fmt::Display for SolverEvent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self::FellBack { from, to, cause } = self;
        write!(f, "linear solver: `{}` failed ({cause}); `{}` is taken", from.name(), to.name())
    }
}

/// Whose factor the preconditioner is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Origin {
    /// This matrix's.
    Own,
    /// That of an earlier mesh or another frequency.
    Earlier,
}

/// A matrix ready to be solved with, for any number of right sides.
#[derive(Debug)]
pub struct LocalSystem {
    analysis: Arc<SystemAnalysis>,
    matrix: CsrMatrix<c64>,
    /// None while another is made (two at a time would take twice the memory), and where none could be.
    preconditioner: Option<Arc<Preconditioner>>,
    /// What factors of other matrices left for one of this, until there is one.
    kept: Option<KeptPart>,
    origin: Origin,
    ledger: Ledger,
    /// Iterations and solutions with this preconditioner alone.
    served: (usize, usize),
    /// Solutions of the design before, and of this one.
    before: Vec<Vec<c64>>,
    solutions: Vec<Vec<c64>>,
    events: Vec<SolverEvent>,
    /// How far to go on, and what is refused.
    goal: Goal,
    /// Whether this is the matrix of a step towards a state, and its factor serves the next one's as long as it pays.
    is_within_a_state: bool,
}

/// Relative true residual [1] that solutions with an incomplete factor go on to at least, whatever is asked for.
const LOOSEST_OF_INCOMPLETE: f64 = 1e-9;

/// Relative true residuals [1]: the one that iterations go on to, and the one above which a solution is refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Goal {
    pub(crate) tolerance: f64,
    pub(crate) required: f64,
}

impl Goal {
    /// The same with iterations that may end earlier.
    pub(super) fn relaxed_to(self, tolerance: f64) -> Self {
        let Self { tolerance: usual, required } = self;
        // The true residual parts from that of the recurrence.
        Self { tolerance: usual.max(tolerance), required: required.max(3.0 * tolerance) }
    }
}

/// How one run of iterations ended.
enum Attempt {
    /// With the true relative residual.
    Ended(f64),
    /// A factor of this matrix is cheaper.
    TooSlow,
}

impl LocalSystem {
    /// Prepares the method for a matrix with the analysed pattern, and takes from `cache` what pays.
    ///
    /// # Errors
    /// [`SolverError::Mesh`] when the factorisation fails: the system is singular (see its message).
    pub(crate) fn new(
        analysis: &Arc<SystemAnalysis>,
        matrix: CsrMatrix<c64>,
        cache: &mut LinearSolverCache,
    ) -> Result<Self, SolverError> {
        let LinearSolverCache {
            preconditioner: cached,
            mut kept,
            method,
            solutions: before,
            is_within_a_state,
        } = std::mem::take(cache);
        let reuse = is_within_a_state || analysis.settings.reuse == Reuse::WhileItPays;
        let pays = |cached: &CachedPreconditioner| {
            let may = reuse && cached.preconditioner.method.is_complete();
            may && Arc::ptr_eq(&cached.analysis, analysis) && cached.ledger.pays()
        };
        let mut events = Vec::new();
        let (preconditioner, origin, ledger) = match cached.filter(pays) {
            Some(CachedPreconditioner { preconditioner, ledger, .. }) => {
                (preconditioner, Origin::Earlier, ledger)
            }
            None => {
                let first = method.unwrap_or(analysis.method());
                let (own, ledger) = factor(analysis, (&matrix, kept.as_ref()), first, &mut events)?;
                // From now on its own factor has what is kept.
                kept = None;
                (own, Origin::Own, ledger)
            }
        };
        Ok(Self {
            analysis: Arc::clone(analysis),
            matrix,
            preconditioner: Some(preconditioner),
            kept,
            origin,
            ledger,
            served: (0, 0),
            before: if reuse { before } else { Vec::new() },
            solutions: Vec::new(),
            events,
            goal: analysis.settings.goal(),
            is_within_a_state,
        })
    }

    /// The matrix.
    pub fn matrix(&self) -> &CsrMatrix<c64> {
        &self.matrix
    }

    /// The method in use.
    pub fn method(&self) -> Method {
        self.preconditioner.as_ref().map_or(self.analysis.method(), |own| own.method)
    }

    /// Bytes of the preconditioner.
    pub fn preconditioner_bytes(&self) -> usize {
        self.preconditioner.as_ref().map_or(0, |own| own.action.bytes())
    }

    /// What the solver did beside solving.
    pub fn events(&self) -> &[SolverEvent] {
        &self.events
    }

    /// How far to go with the solutions to come; `None` is what the settings say.
    pub(super) fn aim(&mut self, goal: Option<Goal>) {
        self.goal = goal.unwrap_or(self.usual_goal());
    }

    /// How far the settings go.
    pub(super) fn usual_goal(&self) -> Goal {
        self.analysis.settings.goal()
    }

    /// Whether factors serve several designs.
    pub(super) fn reuse(&self) -> Reuse {
        self.analysis.settings.reuse
    }

    /// Puts what was done in other systems first.
    pub(super) fn precede_events(&mut self, before: Vec<SolverEvent>) {
        self.events.splice(..0, before);
    }

    /// What the next design may start from.
    pub fn into_cache(mut self) -> LinearSolverCache {
        let method = self.preconditioner.as_ref().map(|p| p.method).filter(|&m| m != self.analysis.method());
        let is_within_a_state = self.is_within_a_state;
        let kept = self.preconditioner.as_ref().and_then(|own| own.action.kept()).or(self.kept.take());
        if self.reuse() == Reuse::Never && !is_within_a_state {
            return LinearSolverCache { kept, ..LinearSolverCache::with_method(method) };
        }
        let (iterations, solutions) = self.served;
        self.ledger.enter(iterations, solutions);
        let cached = |preconditioner| CachedPreconditioner {
            analysis: self.analysis,
            preconditioner,
            ledger: self.ledger,
        };
        // The others are made for one matrix, and cheap beside their iterations.
        let complete = self.preconditioner.filter(|preconditioner| preconditioner.method.is_complete());
        let (preconditioner, solutions) = (complete.map(cached), self.solutions);
        LinearSolverCache { preconditioner, kept, method, solutions, is_within_a_state }
    }

    /// Solves `K x = b`.
    ///
    /// # Errors
    /// [`SolverError::NotConverged`] when the true residual stays above the required one with every method that there is
    /// memory for, [`SolverError::Mesh`] when none of them has a factor, [`SolverError::NotFinite`] and
    /// [`SolverError::OutOfRange`] for a right side that cannot be solved for.
    pub fn solve(&mut self, right_side: &[c64]) -> Result<(Vec<c64>, LinearSolverReport), SolverError> {
        let scale = checked_norm(right_side)?;
        if scale == 0.0 {
            let x = vec![c64::default(); right_side.len()];
            self.solutions.push(x.clone());
            return Ok((x, LinearSolverReport { iterations: 0, residual: 0.0 }));
        }
        let mut x = self.start(right_side, scale);
        let mut report = LinearSolverReport { iterations: 0, residual: f64::INFINITY };
        loop {
            let before = report.iterations;
            let ended = self.attempt(right_side, scale, &mut x, &mut report.iterations);
            if let Attempt::Ended(residual) = ended
                && residual <= self.goal_now().required
            {
                report.residual = residual;
                self.served.0 += report.iterations - before;
                self.served.1 += 1;
                break;
            }
            match ended {
                _ if self.origin == Origin::Earlier => self.refresh(self.method())?,
                Attempt::Ended(residual) => {
                    report.residual = residual;
                    if report.iterations > before && self.is_solved_but_for_rounding(right_side, &x) {
                        break;
                    }
                    self.fall_back(&report)?;
                }
                Attempt::TooSlow => unreachable!("an own factor is never too slow"),
            }
            // What a failed iteration leaves may be farther from the solution than zero, or no number.
            let left = norm(&self.matrix.residual(&x, right_side));
            if left.is_nan() || left >= scale {
                x.fill(c64::default());
            }
        }
        self.solutions.push(x.clone());
        Ok((x, report))
    }

    /// Lets go of the last solution, as the start of no other.
    pub(crate) fn forget_last(&mut self) {
        self.solutions.pop();
    }

    /// How far solutions with the method in use go. The equations of ψ in a weak conductor are hardly any part of the residual, and
    /// an incomplete factor leaves them for last: at a residual of 1e-7 a loss was 2.7 times the right one.
    fn goal_now(&self) -> Goal {
        let Goal { tolerance, required } = self.goal;
        match self.method() {
            Method::Incomplete => Goal {
                tolerance: tolerance.min(LOOSEST_OF_INCOMPLETE),
                required: required.min(LOOSEST_OF_INCOMPLETE),
            },
            _ => self.goal,
        }
    }

    /// The solution of the design before where it is nearer than zero.
    fn start(&mut self, right_side: &[c64], scale: f64) -> Vec<c64> {
        let position = self.solutions.len();
        match self.before.get_mut(position).map(std::mem::take) {
            Some(x) if x.len() == right_side.len() && norm(&self.matrix.residual(&x, right_side)) < scale => {
                x
            }
            _ => vec![c64::default(); right_side.len()],
        }
    }

    /// Iterates until the tolerance, or until there is nothing more to be had.
    fn attempt(&self, right_side: &[c64], scale: f64, x: &mut [c64], iterations: &mut usize) -> Attempt {
        let Some(preconditioner) = self.preconditioner.as_ref() else { return Attempt::Ended(f64::INFINITY) };
        let settings = &self.analysis.settings;
        let method = self.method();
        let most = settings.max_iterations.unwrap_or_else(|| {
            let typical = self.analysis.typical_iterations(method);
            let single = method == Method::DirectSingle && self.analysis.more_robust(method).is_some();
            10 * if single { typical.max(LEAST_SINGLE) } else { typical.max(30) }
        });
        let affordable = (settings.most_work / preconditioner.costs.iteration) as usize;
        let most = most.min(affordable.max(1));
        let goal = self.goal_now();
        let target = goal.tolerance * scale;
        let (mut done, mut residual) = (0, f64::INFINITY);
        let (mut least, mut is_slow) = (f64::INFINITY, false);
        // The residual of the recurrence drifts from the true one: restart from the true one where they part.
        while done < most {
            preconditioner.action.start(&self.matrix, right_side, x);
            let mut start = f64::INFINITY;
            let outcome = cocg::solve(
                &self.matrix,
                right_side,
                x,
                |r, z| preconditioner.action.apply(r, z),
                target,
                most - done,
                |count, now| {
                    if count == 0 {
                        start = now;
                    }
                    // Residuals of this iteration do not fall steadily.
                    least = now.min(least);
                    is_slow = self.is_too_slow(done + count, count, start, least, target);
                    is_slow
                },
            );
            done += outcome.iterations;
            *iterations += outcome.iterations;
            if is_slow {
                return Attempt::TooSlow;
            }
            let before = residual;
            residual = norm(&self.matrix.residual(x, right_side)) / scale;
            let settled = residual <= goal.required || outcome.iterations == 0;
            if settled || !residual.is_finite() || residual > 0.1 * before {
                break;
            }
        }
        Attempt::Ended(residual)
    }

    /// Whether an earlier factor costs more than one of this matrix would, judged by the speed so far.
    fn is_too_slow(&self, done: usize, count: usize, start: f64, now: f64, target: f64) -> bool {
        if self.origin == Origin::Own || count < TRIAL || now <= target {
            return false;
        }
        let digits = (start / now).ln();
        if digits <= 0.0 && count < 3 * TRIAL {
            return false;
        }
        // Without any progress by then the projection is without end.
        let total = if digits > 0.0 { (start / target).ln() / digits * count as f64 } else { f64::INFINITY };
        let of_this = (done - count) as f64 + total;
        let usual = if self.is_within_a_state { 1 } else { USUAL_SOLUTIONS };
        let solutions = self.before.len().max(usual).max(self.solutions.len() + 1);
        let rest = solutions - self.served.1;
        self.ledger.is_exceeded_by(self.served.0 as f64 + of_this * rest as f64, solutions)
    }

    /// Takes a factor of this matrix.
    fn refresh(&mut self, method: Method) -> Result<(), SolverError> {
        self.preconditioner = None;
        let of = (&self.matrix, self.kept.as_ref());
        let (own, ledger) = factor(&self.analysis, of, method, &mut self.events)?;
        self.kept = None;
        self.preconditioner = Some(own);
        self.ledger = ledger;
        self.served = (0, 0);
        self.origin = Origin::Own;
        Ok(())
    }

    /// Takes the next more robust method, if there is one and it fits.
    fn fall_back(&mut self, report: &LinearSolverReport) -> Result<(), SolverError> {
        let LinearSolverReport { residual, iterations } = *report;
        let from = self.method();
        let Some(to) = self.analysis.more_robust(from) else {
            let cause =
                if residual.is_finite() { NonConvergence::IllConditioned } else { NonConvergence::Breakdown };
            let required = self.goal_now().required;
            return Err(SolverError::NotConverged { residual, required, iterations, cause });
        };
        let cause = format!("relative residual {residual:.1e} after {iterations} iterations");
        self.events.push(SolverEvent::FellBack { from, to, cause });
        // Of other numbers: it would only take memory beside the next factor.
        self.kept = None;
        self.refresh(to)
    }

    /// Whether what the last method of all leaves is the rounding of `K x` alone.
    fn is_solved_but_for_rounding(&self, right_side: &[c64], x: &[c64]) -> bool {
        let is_last = |method: Method| method.is_complete() && self.analysis.more_robust(method).is_none();
        let own = self.preconditioner.as_ref().filter(|own| is_last(own.method));
        let Some(factor) = own.filter(|_| self.origin == Origin::Own) else { return false };
        let residual = self.matrix.residual(x, right_side);
        let mut step = vec![c64::default(); x.len()];
        factor.action.apply(&residual, &mut step);
        let left =
            Left { matrix: &self.matrix, load: right_side, solution: x, residual: &residual, step: &step };
        left.is_rounding(self.goal_now().required)
    }
}

/// The preconditioner of a method, or of the first more robust one that can be made.
fn factor(
    analysis: &SystemAnalysis,
    (matrix, kept): (&CsrMatrix<c64>, Option<&KeptPart>),
    method: Method,
    events: &mut Vec<SolverEvent>,
) -> Result<(Arc<Preconditioner>, Ledger), SolverError> {
    let mut method = method;
    loop {
        match Preconditioner::new(analysis, matrix, method, kept) {
            Ok(own) => {
                let ledger = Ledger::new(own.costs, analysis.typical_iterations(method));
                return Ok((Arc::new(own), ledger));
            }
            Err(error) => {
                let Some(to) = analysis.more_robust(method) else { return Err(error.into()) };
                events.push(SolverEvent::FellBack { from: method, to, cause: error.to_string() });
                method = to;
            }
        }
    }
}
