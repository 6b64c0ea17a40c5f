//! NLopt's gradient methods behind one function.
//!
//! NLopt knows bounds, inequality constraints, values and gradients. It asks for objective and constraints of one design
//! one after the other, in an order of its own: the first question evaluates the design, the others are answered from
//! memory. It never sees a value that is not the design's: a closure that cannot evaluate returns an error, NLopt is
//! stopped by a feasible value below its stop value (which all its methods check at once), and what it then believes is
//! thrown away. The worst of several terms is minimised as a bound `t` on all of them, a further variable that only NLopt knows:
//! `t` is the objective, and `f_i − t ≤ 0` are constraints (epigraph form; Boyd and Vandenberghe, Convex Optimization, 4.1.3).
//! A sample that is not finite, is beyond every range or has other lengths than were announced, and a design of
//! NLopt's that is not finite, are such errors too. A panic inside the closure would abort the process at the C boundary: it is
//! caught here and resumed after NLopt has returned.

use std::cell::RefCell;

use ::nlopt::{FailState, SuccessState, Target};

use super::level::Level;
use super::scaling::{Factors, Scaling};
use super::{PanicGuard, STOP_VALUE};
use crate::error::Error;

/// Largest magnitude of a number that NLopt is shown: its methods square and multiply what is of order one at the start.
const LARGEST: f64 = 1e100;

/// Largest value of a constraint, relative to its bound, that counts as satisfied: far below the error of a mesh, and
/// above what the conservative methods leave of rounding.
pub const CONSTRAINT_TOLERANCE: f64 = 1e-6;

/// Constraints beyond which their dual problem takes longer than a field.
const MANY_CONSTRAINTS: usize = 20;

/// Relative tolerance of the dual problem of so many.
const DUAL_TOLERANCE: f64 = 1e-10;

/// Evaluations of the dual problem at most, in products of a derivative: some seconds; and their bounds.
const DUAL_WORK: usize = 1_000_000_000;
const LEAST_DUAL: usize = 500;
const MOST_DUAL: usize = 100_000;

/// Objective and constraints of one design.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sample {
    /// What is made small.
    pub value: f64,
    /// Its gradient, one entry a variable.
    pub gradient: Vec<f64>,
    /// Values of the constraints, satisfied where ≤ 0 and of order one, with their gradients.
    pub constraints: Vec<(f64, Vec<f64>)>,
    /// Of a worst case: the terms of which `value` is the largest, with their gradients.
    pub members: Vec<(f64, Vec<f64>)>,
    /// Linear limits in place of constraints that a method is not shown, like these.
    pub limits: Vec<(f64, Vec<f64>)>,
}

impl Sample {
    /// What a method is shown: the limits in place of the constraints with these numbers, ascending, behind the first `count`.
    #[must_use]
    pub fn with_limits(mut self, replaced: &[usize], count: usize) -> Self {
        let behind = self.constraints.split_off(count);
        replaced.iter().rev().for_each(|&k| drop(self.constraints.remove(k)));
        self.constraints.append(&mut self.limits);
        self.constraints.extend(behind);
        self
    }

    /// Largest excess of a constraint; zero where all are kept but for rounding.
    pub fn violation(&self) -> f64 {
        let worst = self.constraints.iter().map(|(c, _)| *c).fold(0.0, f64::max);
        if worst <= CONSTRAINT_TOLERANCE { 0.0 } else { worst }
    }

    /// Whether an optimiser may see it.
    ///
    /// # Errors
    /// [`Error::NotFinite`] names the first number that is none, or is beyond every range; [`Error::Optimisation`] where
    /// there is not one derivative a variable, or another number of constraints, which have names, or terms of a worst case.
    pub fn check(
        &self,
        variables: usize,
        (constraints, name): (usize, &dyn Fn(usize) -> String),
        members: usize,
    ) -> Result<(), Error> {
        let refuse = |what: String, value: f64| {
            let expected = "expected a finite number below 1e100 after division by the initial design's value; check weights, \
                            bounds of constraints and units";
            Err(Error::NotFinite { what, value, expected })
        };
        let is_sound = |value: f64| value.abs() <= LARGEST;
        let derivatives = |of: &str, gradient: &[f64]| {
            if gradient.len() != variables {
                return Err(Error::Optimisation {
                    cause: "an evaluation gives another number of derivatives than there are design variables",
                });
            }
            match gradient.iter().enumerate().find(|(_, g)| !is_sound(**g)) {
                Some((k, &value)) => refuse(format!("the derivative of {of} by design variable {k}"), value),
                None => Ok(()),
            }
        };
        if !is_sound(self.value) {
            return refuse("the relative objective".to_owned(), self.value);
        }
        derivatives("the relative objective", &self.gradient)?;
        if self.constraints.len() != constraints || self.members.len() != members {
            return Err(Error::Optimisation {
                cause: "an evaluation gives another number of constraints or terms than was announced to the method",
            });
        }
        for (number, (value, gradient)) in self.members.iter().enumerate() {
            let name = format!("term {number} of the relative objective");
            derivatives(&name, gradient)?;
            if !is_sound(*value) {
                return refuse(name, *value);
            }
        }
        for (number, (value, gradient)) in self.constraints.iter().enumerate() {
            let name = format!("{}, relative to its bound,", name(number));
            derivatives(&name, gradient)?;
            if !is_sound(*value) {
                return refuse(name, *value);
            }
        }
        Ok(())
    }
}

/// What to minimise within, and when to stop.
#[derive(Clone, Debug)]
pub struct Minimisation {
    /// The method.
    pub algorithm: Algorithm,
    /// Lower bounds.
    pub lower: Vec<f64>,
    /// Upper bounds, above the lower ones.
    pub upper: Vec<f64>,
    /// Inequality constraints; only where the method takes them.
    pub constraints: usize,
    /// Terms of a worst case; 0 for an objective without kinks.
    pub members: usize,
    /// Relative change of the objective below which the method stops; 0 is off.
    pub ftol_rel: f64,
    /// Relative change of the variables below which the method stops; 0 is off.
    pub xtol_rel: f64,
    /// Largest change of a variable in the first step, as a share of the range between its bounds.
    pub first_step: f64,
}

/// Why NLopt ended by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The objective changes by less than its tolerance.
    Objective,
    /// From a start that violates constraints it has come to designs that keep them: it is to begin anew from the best one.
    ///
    /// MMA and CCSAQ weight what is violated by up to 10⁴⁰, and keep the weight once nothing is: they walk away from the bound, or
    /// stop moving.
    Entered,
    /// Rounding allows no further step.
    Roundoff,
    /// The variables change by less than their tolerance.
    Step,
}

/// How a minimisation ended.
#[derive(Debug)]
pub enum Outcome<E> {
    /// By itself.
    Ended(Ending),
    /// The closure stopped it.
    Interrupted(E),
    /// NLopt refused or failed.
    Failed(&'static str),
}

/// Gradient methods of NLopt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Algorithm {
    /// Method of moving asymptotes.
    Mma,
    /// Conservative convex separable approximation with quadratic terms.
    Ccsaq,
    /// Sequential least-squares quadratic programming.
    Slsqp,
    /// Limited-memory BFGS.
    Lbfgs,
    /// Truncated Newton with restarts and preconditioning.
    Tnewton,
    /// Limited-memory variable metric of rank 2.
    Var2,
}

impl Algorithm {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Mma, Self::Ccsaq, Self::Slsqp, Self::Lbfgs, Self::Tnewton, Self::Var2];

    /// What the method is called in short.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mma => "mma",
            Self::Ccsaq => "ccsaq",
            Self::Slsqp => "slsqp",
            Self::Lbfgs => "lbfgs",
            Self::Tnewton => "tnewton",
            Self::Var2 => "var2",
        }
    }

    /// Whether the method keeps inequality constraints.
    pub fn takes_constraints(self) -> bool {
        matches!(self, Self::Mma | Self::Ccsaq | Self::Slsqp)
    }

    fn library(self) -> ::nlopt::Algorithm {
        match self {
            Self::Mma => ::nlopt::Algorithm::Mma,
            Self::Ccsaq => ::nlopt::Algorithm::Ccsaq,
            Self::Slsqp => ::nlopt::Algorithm::Slsqp,
            Self::Lbfgs => ::nlopt::Algorithm::Lbfgs,
            Self::Tnewton => ::nlopt::Algorithm::TNewtonPrecondRestart,
            Self::Var2 => ::nlopt::Algorithm::LdVar2,
        }
    }
}

/// Minimises from `start`: `evaluate` gives objective and constraints of a design, and is asked once for each.
///
/// The closure's error ends the minimisation as [`Outcome::Interrupted`], and so does a sample that
/// [`Sample::check`] refuses.
///
/// # Panics
/// When `evaluate` does.
pub fn minimise<E: From<Error>>(
    settings: &Minimisation,
    start: &[f64],
    evaluate: impl FnMut(&[f64]) -> Result<Sample, E>,
) -> Outcome<E> {
    let Some(scaling) = Scaling::new(settings, start) else {
        return Outcome::Failed(
            "a bound, the first design or the first step is not finite, the bounds cross, or the first step is not positive",
        );
    };
    let [mut lower, mut upper] = [&settings.lower, &settings.upper].map(|bounds| scaling.scale(bounds));
    let mut x = scaling.scale(start);
    for (k, x) in x.iter_mut().enumerate() {
        *x = x.clamp(lower[k], upper[k]);
    }
    let mut bridge = Bridge::new(evaluate, settings, &scaling, start);
    if !bridge.begin(&x) {
        return bridge.outcome(None);
    }
    if let Some(level) = bridge.level {
        lower.push(level.lower());
        upper.push(level.upper());
        x.push(level.start());
    }
    let tolerances: Vec<f64> = bridge.factors.constraints.iter().map(|f| f * CONSTRAINT_TOLERANCE).collect();
    let bridge = RefCell::new(bridge);
    let objective = |x: &[f64], gradient: Option<&mut [f64]>, (): &mut ()| -> f64 {
        bridge.borrow_mut().objective(x, gradient)
    };
    let constraints = |values: &mut [f64], x: &[f64], gradients: Option<&mut [f64]>, (): &mut ()| {
        bridge.borrow_mut().constraints(values, x, gradients);
    };
    let mut library =
        ::nlopt::Nlopt::new(settings.algorithm.library(), x.len(), &objective, Target::Minimize, ());
    let mut accepted = library
        .set_lower_bounds(&lower)
        .and_then(|_| library.set_upper_bounds(&upper))
        .and_then(|_| library.set_stopval(STOP_VALUE))
        .and_then(|_| library.set_ftol_rel(settings.ftol_rel))
        .and_then(|_| library.set_xtol_rel(settings.xtol_rel));
    if !tolerances.is_empty() {
        accepted = accepted
            .and_then(|_| library.add_inequality_mconstraint(tolerances.len(), constraints, (), &tolerances));
    }
    if tolerances.len() > MANY_CONSTRAINTS && settings.algorithm != Algorithm::Slsqp {
        accepted =
            accepted.and_then(|_| library.set_local_optimizer(dual_solver(x.len(), tolerances.len())?));
    }
    if accepted.is_err() {
        return Outcome::Failed("NLopt refuses the bounds, constraints or tolerances");
    }
    let ended = library.optimize(&mut x);
    drop(library);
    bridge.into_inner().outcome(Some(ended))
}

/// What solves the dual problems of MMA and CCSAQ, with a variable for each constraint, where there are many: less exactly than the
/// 10⁻¹⁴ of NLopt, and with a limit of its work.
fn dual_solver(
    variables: usize,
    constraints: usize,
) -> Result<::nlopt::Nlopt<impl ::nlopt::ObjFn<()>, ()>, FailState> {
    let unasked = |_: &[f64], _: Option<&mut [f64]>, (): &mut ()| 0.0;
    let mut solver = ::nlopt::Nlopt::new(::nlopt::Algorithm::Mma, variables, unasked, Target::Minimize, ());
    let most = (DUAL_WORK / (variables * constraints)).clamp(LEAST_DUAL, MOST_DUAL);
    solver.set_ftol_rel(DUAL_TOLERANCE)?;
    solver.set_maxeval(most as u32)?;
    Ok(solver)
}

/// What NLopt's own word on its end means.
fn outcome<E>(ended: Result<(SuccessState, f64), (FailState, f64)>) -> Outcome<E> {
    match ended {
        Ok((SuccessState::XtolReached, _)) => Outcome::Ended(Ending::Step),
        Ok(_) => Outcome::Ended(Ending::Objective),
        Err((FailState::RoundoffLimited, _)) => Outcome::Ended(Ending::Roundoff),
        Err((FailState::InvalidArgs, _)) => Outcome::Failed("NLopt refuses its arguments"),
        Err((FailState::OutOfMemory, _)) => Outcome::Failed("NLopt is out of memory"),
        Err((FailState::Failure | FailState::ForcedStop, _)) => Outcome::Failed("NLopt failed"),
    }
}

/// Questions for one design after which the method counts as settled there: MMA and CCSAQ, without a tolerance, ask for
/// ever at a solution on its bounds. No method needs more than a few.
const SETTLED: usize = 100;

/// What ended the calls of the closure, but for a panic.
enum Interruption<E> {
    /// The method asks for the same design again and again.
    Settled,
    /// It has come to a worse design after one that kept all constraints that its start violates.
    Entered,
    Error(E),
}

/// Between NLopt's questions and the closure.
struct Bridge<'a, F, E> {
    evaluate: F,
    settings: &'a Minimisation,
    scaling: &'a Scaling,
    /// Known with the first answer.
    factors: Factors,
    /// The bound on the terms of a worst case.
    level: Option<Level>,
    /// The start, in metres and as NLopt sees it.
    start: (&'a [f64], Vec<f64>),
    /// The design asked for last, as NLopt sees it, and its answer.
    last: Option<(Vec<f64>, Sample)>,
    /// How often it has been asked for in a row.
    asked: usize,
    /// Whether the start violates constraints.
    began_outside: Option<bool>,
    /// From such a start, the least value of a design that kept all.
    entered: Option<f64>,
    guard: PanicGuard,
    interruption: Option<Interruption<E>>,
}

impl<'a, F: FnMut(&[f64]) -> Result<Sample, E>, E: From<Error>> Bridge<'a, F, E> {
    fn new(evaluate: F, settings: &'a Minimisation, scaling: &'a Scaling, start: &'a [f64]) -> Self {
        Self {
            evaluate,
            settings,
            scaling,
            factors: Factors::default(),
            level: None,
            start: (start, scaling.scale(start)),
            last: None,
            asked: 0,
            began_outside: None,
            entered: None,
            guard: PanicGuard::default(),
            interruption: None,
        }
    }

    /// Evaluates the start, which fixes the factors and the bound on a worst case; whether the closure has not been interrupted.
    fn begin(&mut self, x: &[f64]) -> bool {
        let Self { scaling, settings, .. } = *self;
        let Some(sample) = self.at(x) else { return false };
        let (factors, value) = (scaling.factors(settings, x, sample), sample.value);
        self.factors = factors;
        self.level = (settings.members > 0).then(|| Level::around(value));
        true
    }

    /// How a minimisation ended, of which NLopt says `ended`.
    fn outcome(self, ended: Option<Result<(SuccessState, f64), (FailState, f64)>>) -> Outcome<E> {
        self.guard.resume();
        match (self.interruption, ended) {
            (Some(Interruption::Settled), _) => Outcome::Ended(Ending::Step),
            (Some(Interruption::Entered), _) => Outcome::Ended(Ending::Entered),
            (Some(Interruption::Error(error)), _) => Outcome::Interrupted(error),
            (None, Some(Ok(_))) if self.entered.is_some() => Outcome::Ended(Ending::Entered),
            (None, Some(ended)) => outcome(ended),
            (None, None) => Outcome::Failed("the first design was not evaluated"),
        }
    }

    /// The objective and its gradient at a design of NLopt's; below the stop value once the closure has been interrupted.
    fn objective(&mut self, x: &[f64], gradient: Option<&mut [f64]>) -> f64 {
        let (level, scaling, variables) = (self.level, self.scaling, self.start.0.len());
        let factor = self.factors.objective;
        let Some(sample) = self.at(&x[..variables]) else { return 2.0 * STOP_VALUE };
        match level {
            None => {
                if let Some(gradient) = gradient {
                    scaling.fill(gradient, factor, &sample.gradient);
                }
                factor * sample.value
            }
            Some(level) => {
                if let Some(gradient) = gradient {
                    gradient.fill(0.0);
                    gradient[variables] = factor * level.unit;
                }
                factor * level.unit * x[variables]
            }
        }
    }

    /// The constraints and their gradients.
    fn constraints(&mut self, values: &mut [f64], x: &[f64], gradients: Option<&mut [f64]>) {
        let (scaling, variables) = (self.scaling, self.start.0.len());
        let is_known = self.at(&x[..variables]).is_some();
        let Some((_, sample)) = self.last.as_ref().filter(|_| is_known) else {
            // Feasible: NLopt heeds its stop value at feasible designs alone.
            values.fill(-1.0);
            if let Some(gradients) = gradients {
                gradients.fill(0.0);
            }
            return;
        };
        let (level, unit) = (x[variables..].iter().sum::<f64>(), self.level.map_or(0.0, |level| level.unit));
        let own = sample.constraints.iter().map(|of| (scaling.shown(of), &of.1, 0.0));
        let members = sample.members.iter().map(|(value, own)| (*value, own, unit));
        let all = own.chain(members).zip(&self.factors.constraints);
        for (value, ((own, _, unit), factor)) in values.iter_mut().zip(all.clone()) {
            *value = factor * (own - unit * level);
        }
        let Some(gradients) = gradients else { return };
        for (row, ((_, own, unit), factor)) in gradients.chunks_exact_mut(x.len()).zip(all) {
            scaling.fill(row, *factor, own);
            row[variables..].fill(-factor * unit);
        }
    }

    /// The sample at a design of NLopt's; `None` once the closure has been interrupted.
    fn at(&mut self, x: &[f64]) -> Option<&Sample> {
        if self.interruption.is_some() || self.guard.has_caught() {
            return None;
        }
        self.asked += 1;
        if self.last.as_ref().is_none_or(|(design, _)| design != x) {
            self.asked = 1;
            match self.ask(x)? {
                Ok(sample) => {
                    let keeps_all = sample.violation() == 0.0;
                    let began_outside = *self.began_outside.get_or_insert(!keeps_all);
                    if began_outside && keeps_all {
                        let keeps_its_weight =
                            matches!(self.settings.algorithm, Algorithm::Mma | Algorithm::Ccsaq);
                        if keeps_its_weight && self.entered.is_some_and(|least| sample.value >= least) {
                            self.interruption = Some(Interruption::Entered);
                        }
                        self.entered =
                            Some(self.entered.map_or(sample.value, |least| least.min(sample.value)));
                    }
                    self.last = Some((x.to_vec(), sample));
                }
                Err(error) => self.interruption = Some(Interruption::Error(error)),
            }
        }
        if self.asked > SETTLED {
            self.interruption = Some(Interruption::Settled);
        }
        if self.interruption.is_some() {
            return None;
        }
        self.last.as_ref().map(|(_, sample)| sample)
    }

    /// Asks the closure; `None` where it panics.
    fn ask(&mut self, x: &[f64]) -> Option<Result<Sample, E>> {
        if let Some(k) = x.iter().position(|x| !x.is_finite()) {
            let what = format!("variable {k} of a design that the method asks for");
            let expected = "the method broke down; take another algorithm, or other bounds";
            return Some(Err(Error::NotFinite { what, value: x[k], expected }.into()));
        }
        // Scaling back may leave start and bounds by a rounding: what is evaluated must not, since a search starts at a
        // mesh that is known.
        let (start, scaled_start) = &self.start;
        let unit = &self.scaling.unit;
        let back = |k: usize| if x[k] == scaled_start[k] { start[k] } else { x[k] * unit[k] };
        let physical: Vec<f64> =
            (0..x.len()).map(|k| back(k).clamp(self.settings.lower[k], self.settings.upper[k])).collect();
        let answer = self.guard.call(|| (self.evaluate)(&physical))?;
        Some(answer.and_then(|sample| {
            let name = |k: usize| format!("constraint {k}");
            sample.check(x.len(), (self.settings.constraints, &name), self.settings.members)?;
            Ok(sample)
        }))
    }
}

#[cfg(test)]
mod tests;
