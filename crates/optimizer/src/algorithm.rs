//! NLopt's gradient methods behind one function; the only file that names the library.
//!
//! NLopt knows bounds, a value and a gradient. It never sees a value that is not the objective's: a closure that cannot
//! evaluate returns an error, NLopt is stopped by a value below its stop value (which all its methods check at once), and
//! what it then believes is thrown away. A panic inside the closure would abort the process at the C boundary: it is caught
//! here and goes on after NLopt has returned.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use nlopt::{FailState, Nlopt, SuccessState, Target};

use crate::config::Algorithm;

/// Span between the bounds that the variables are scaled to: the paper's plate (−5 … 20 mm) in millimetres. The
/// methods that are not invariant under scaling were measured there.
const SCALED_SPAN: f64 = 25.0;

/// Below every objective: returning less makes NLopt stop.
const STOP_VALUE: f64 = -1e300;

/// What to minimise within, and when to stop.
#[derive(Clone, Debug)]
pub struct Minimisation {
    /// The method.
    pub algorithm: Algorithm,
    /// Lower bounds.
    pub lower: Vec<f64>,
    /// Upper bounds, above the lower ones.
    pub upper: Vec<f64>,
    /// Relative change of the objective below which the method stops; 0 is off.
    pub ftol_rel: f64,
    /// Relative change of the variables below which the method stops; 0 is off.
    pub xtol_rel: f64,
}

/// Why NLopt ended by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The objective changes by less than its tolerance, or rounding allows no more.
    Objective,
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

impl Algorithm {
    fn library(self) -> nlopt::Algorithm {
        match self {
            Self::Mma => nlopt::Algorithm::Mma,
            Self::Ccsaq => nlopt::Algorithm::Ccsaq,
            Self::Slsqp => nlopt::Algorithm::Slsqp,
            Self::Lbfgs => nlopt::Algorithm::Lbfgs,
            Self::Tnewton => nlopt::Algorithm::TNewtonPrecondRestart,
            Self::Var2 => nlopt::Algorithm::LdVar2,
        }
    }

    /// Factor on the objective (about 1 at the start): the conservative approximations of MMA and CCSAQ are made for
    /// values of order one; the quasi-Newton methods take their first step from the gradient's size and would stop at
    /// once.
    fn objective_scale(self) -> f64 {
        match self {
            Self::Mma | Self::Ccsaq => 1.0,
            Self::Slsqp | Self::Lbfgs | Self::Tnewton | Self::Var2 => 1000.0,
        }
    }
}

/// Minimises `objective(x, gradient)` from `start`; the closure fills the gradient and returns the value.
///
/// The closure's error ends the minimisation as [`Outcome::Interrupted`].
pub fn minimise<E>(
    settings: &Minimisation,
    start: &[f64],
    objective: impl FnMut(&[f64], &mut [f64]) -> Result<f64, E>,
) -> Outcome<E> {
    let n = start.len();
    let unit: Vec<f64> =
        settings.lower.iter().zip(&settings.upper).map(|(low, high)| (high - low) / SCALED_SPAN).collect();
    let factor = settings.algorithm.objective_scale();
    let state = RefCell::new((objective, None::<Interruption<E>>));
    let callback = |x: &[f64], gradient: Option<&mut [f64]>, (): &mut ()| -> f64 {
        let (objective, interruption) = &mut *state.borrow_mut();
        if interruption.is_some() {
            return 2.0 * STOP_VALUE;
        }
        // Scaling back may leave the bounds by a rounding: what is recorded must not.
        let physical: Vec<f64> =
            (0..n).map(|k| (x[k] * unit[k]).clamp(settings.lower[k], settings.upper[k])).collect();
        let mut derivative = vec![0.0; n];
        match catch_unwind(AssertUnwindSafe(|| objective(&physical, &mut derivative))) {
            Ok(Ok(value)) => {
                if let Some(gradient) = gradient {
                    for ((g, d), unit) in gradient.iter_mut().zip(&derivative).zip(&unit) {
                        *g = factor * d * unit;
                    }
                }
                factor * value
            }
            Ok(Err(error)) => {
                *interruption = Some(Interruption::Error(error));
                2.0 * STOP_VALUE
            }
            Err(panic) => {
                *interruption = Some(Interruption::Panic(panic));
                2.0 * STOP_VALUE
            }
        }
    };
    let mut library = Nlopt::new(settings.algorithm.library(), n, &callback, Target::Minimize, ());
    let scaled =
        |values: &[f64]| -> Vec<f64> { values.iter().zip(&unit).map(|(v, unit)| v / unit).collect() };
    let accepted = library
        .set_lower_bounds(&scaled(&settings.lower))
        .and_then(|_| library.set_upper_bounds(&scaled(&settings.upper)))
        .and_then(|_| library.set_stopval(STOP_VALUE))
        .and_then(|_| library.set_ftol_rel(settings.ftol_rel))
        .and_then(|_| library.set_xtol_rel(settings.xtol_rel));
    if accepted.is_err() {
        return Outcome::Failed("NLopt refuses the bounds or tolerances");
    }
    let mut x = scaled(start);
    for (k, x) in x.iter_mut().enumerate() {
        *x = x.clamp(settings.lower[k] / unit[k], settings.upper[k] / unit[k]);
    }
    let ended = library.optimize(&mut x);
    drop(library);
    match state.into_inner().1 {
        Some(Interruption::Error(error)) => return Outcome::Interrupted(error),
        Some(Interruption::Panic(panic)) => resume_unwind(panic),
        None => {}
    }
    match ended {
        Ok((SuccessState::XtolReached, _)) => Outcome::Ended(Ending::Step),
        Ok(_) | Err((FailState::RoundoffLimited, _)) => Outcome::Ended(Ending::Objective),
        Err((FailState::InvalidArgs, _)) => Outcome::Failed("NLopt refuses its arguments"),
        Err((FailState::OutOfMemory, _)) => Outcome::Failed("NLopt is out of memory"),
        Err((FailState::Failure | FailState::ForcedStop, _)) => Outcome::Failed("NLopt failed"),
    }
}

/// What ended the calls of the closure.
enum Interruption<E> {
    Error(E),
    Panic(Box<dyn std::any::Any + Send>),
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Algorithm; 6] = [
        Algorithm::Mma,
        Algorithm::Ccsaq,
        Algorithm::Slsqp,
        Algorithm::Lbfgs,
        Algorithm::Tnewton,
        Algorithm::Var2,
    ];

    fn settings(algorithm: Algorithm) -> Minimisation {
        Minimisation {
            algorithm,
            lower: vec![-0.005; 8],
            upper: vec![0.020; 8],
            ftol_rel: 1e-8,
            xtol_rel: 0.0,
        }
    }

    /// `1 + Σ w_k ((p_k − c_k)/25 mm)²` with minima inside the bounds, and beyond the upper one.
    fn quadratic(p: &[f64], g: &mut [f64]) -> f64 {
        let mut value = 1.0;
        for (k, p) in p.iter().enumerate() {
            let (weight, centre) = (1.0 + k as f64, if k % 3 == 0 { 0.03 } else { 0.004 });
            value += weight * ((p - centre) / 0.025).powi(2);
            g[k] = 2.0 * weight * (p - centre) / 0.025_f64.powi(2);
        }
        value
    }

    #[test]
    fn every_algorithm_finds_a_bounded_quadratic_minimum() {
        for algorithm in ALL {
            let mut best = (f64::INFINITY, vec![]);
            let outcome = minimise::<()>(&settings(algorithm), &[0.0; 8], |p, g| {
                let value = quadratic(p, g);
                if value < best.0 {
                    best = (value, p.to_vec());
                }
                Ok(value)
            });
            assert!(matches!(outcome, Outcome::Ended(_)), "{algorithm:?}: {outcome:?}");
            for (k, p) in best.1.iter().enumerate() {
                let exact = if k % 3 == 0 { 0.020 } else { 0.004 };
                assert!((p - exact).abs() < 1e-4, "{algorithm:?}: variable {k} is {p}");
            }
        }
    }

    #[test]
    fn every_algorithm_stops_at_once_when_the_closure_does() {
        for algorithm in ALL {
            for last in [1, 2, 4] {
                let mut calls = 0;
                let outcome = minimise(&settings(algorithm), &[0.0; 8], |p, g| {
                    calls += 1;
                    if calls == last { Err("enough") } else { Ok(quadratic(p, g)) }
                });
                assert!(matches!(outcome, Outcome::Interrupted("enough")), "{algorithm:?}: {outcome:?}");
                assert_eq!(calls, last, "{algorithm:?}");
            }
        }
    }

    #[test]
    fn a_panic_in_the_closure_comes_out_on_this_side() {
        let caught = catch_unwind(|| {
            minimise::<()>(&settings(Algorithm::Mma), &[0.0; 8], |_, _| panic!("inside the callback"))
        });
        assert!(caught.is_err());
    }
}
