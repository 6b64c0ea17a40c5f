//! NLopt's gradient methods behind one function; beside [`crate::bobyqa`] the only file that names the library.
//!
//! NLopt knows bounds, inequality constraints, values and gradients. It asks for objective and constraints of one design
//! one after the other, in an order of its own: the first question evaluates the design, the others are answered from
//! memory. It never sees a value that is not the design's: a closure that cannot evaluate returns an error, NLopt is
//! stopped by a feasible value below its stop value (which all its methods check at once), and what it then believes is
//! thrown away. A panic inside the closure would abort the process at the C boundary: it is caught here and goes on
//! after NLopt has returned.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use nlopt::{FailState, Nlopt, SuccessState, Target};

use crate::config::Algorithm;

/// Span between the bounds that the variables are scaled to: the paper's plate (−5 … 20 mm) in millimetres. The
/// methods that are not invariant under scaling were measured there.
const SCALED_SPAN: f64 = 25.0;

/// Below every objective: returning less makes NLopt stop.
const STOP_VALUE: f64 = -1e300;

/// Largest value of a constraint, relative to its bound, that counts as satisfied: far below the error of a mesh, and
/// above what the conservative methods leave of rounding.
pub const CONSTRAINT_TOLERANCE: f64 = 1e-6;

/// Objective and constraints of one design.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sample {
    /// What is made small.
    pub value: f64,
    /// Its gradient, one entry a variable.
    pub gradient: Vec<f64>,
    /// Values of the constraints, satisfied where ≤ 0 and of order one, with their gradients.
    pub constraints: Vec<(f64, Vec<f64>)>,
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

/// Minimises from `start`: `evaluate` gives objective and constraints of a design, and is asked once for each.
///
/// The closure's error ends the minimisation as [`Outcome::Interrupted`].
pub fn minimise<E>(
    settings: &Minimisation,
    start: &[f64],
    evaluate: impl FnMut(&[f64]) -> Result<Sample, E>,
) -> Outcome<E> {
    let unit: Vec<f64> =
        settings.lower.iter().zip(&settings.upper).map(|(low, high)| (high - low) / SCALED_SPAN).collect();
    let factor = settings.algorithm.objective_scale();
    let scaled =
        |values: &[f64]| -> Vec<f64> { values.iter().zip(&unit).map(|(v, unit)| v / unit).collect() };
    let bridge = RefCell::new(Bridge {
        evaluate,
        settings,
        unit: &unit,
        start: (start, scaled(start)),
        last: None,
        asked: 0,
        interruption: None,
    });
    let fill = |target: &mut [f64], factor: f64, derivative: &[f64]| {
        for ((g, d), unit) in target.iter_mut().zip(derivative).zip(&unit) {
            *g = factor * d * unit;
        }
    };
    let objective = |x: &[f64], gradient: Option<&mut [f64]>, (): &mut ()| -> f64 {
        let mut bridge = bridge.borrow_mut();
        let Some(sample) = bridge.at(x) else { return 2.0 * STOP_VALUE };
        if let Some(gradient) = gradient {
            fill(gradient, factor, &sample.gradient);
        }
        factor * sample.value
    };
    let constraints = |values: &mut [f64], x: &[f64], gradients: Option<&mut [f64]>, (): &mut ()| {
        let mut bridge = bridge.borrow_mut();
        let Some(sample) = bridge.at(x) else {
            // Feasible: NLopt heeds its stop value at feasible designs alone.
            values.fill(-1.0);
            if let Some(gradients) = gradients {
                gradients.fill(0.0);
            }
            return;
        };
        for (value, (own, _)) in values.iter_mut().zip(&sample.constraints) {
            *value = *own;
        }
        if let Some(gradients) = gradients {
            for (row, (_, own)) in gradients.chunks_exact_mut(x.len()).zip(&sample.constraints) {
                fill(row, 1.0, own);
            }
        }
    };
    let mut library = Nlopt::new(settings.algorithm.library(), start.len(), &objective, Target::Minimize, ());
    let mut accepted = library
        .set_lower_bounds(&scaled(&settings.lower))
        .and_then(|_| library.set_upper_bounds(&scaled(&settings.upper)))
        .and_then(|_| library.set_stopval(STOP_VALUE))
        .and_then(|_| library.set_ftol_rel(settings.ftol_rel))
        .and_then(|_| library.set_xtol_rel(settings.xtol_rel));
    if settings.constraints > 0 {
        let tolerance = vec![CONSTRAINT_TOLERANCE; settings.constraints];
        accepted = accepted.and_then(|_| {
            library.add_inequality_mconstraint(settings.constraints, constraints, (), &tolerance)
        });
    }
    if accepted.is_err() {
        return Outcome::Failed("NLopt refuses the bounds, constraints or tolerances");
    }
    let mut x = scaled(start);
    for (k, x) in x.iter_mut().enumerate() {
        *x = x.clamp(settings.lower[k] / unit[k], settings.upper[k] / unit[k]);
    }
    let ended = library.optimize(&mut x);
    drop(library);
    match bridge.into_inner().interruption {
        Some(Interruption::Settled) => return Outcome::Ended(Ending::Step),
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

/// Questions for one design after which the method counts as settled there: MMA and CCSAQ, without a tolerance, ask for
/// ever at a solution on its bounds. No method needs more than a few.
const SETTLED: usize = 100;

/// What ended the calls of the closure.
enum Interruption<E> {
    /// The method asks for the same design again and again.
    Settled,
    Error(E),
    Panic(Box<dyn std::any::Any + Send>),
}

/// Between NLopt's questions and the closure.
struct Bridge<'a, F, E> {
    evaluate: F,
    settings: &'a Minimisation,
    /// Length of a scaled unit of every variable.
    unit: &'a [f64],
    /// The start, in metres and as NLopt sees it.
    start: (&'a [f64], Vec<f64>),
    /// The design asked for last, as NLopt sees it, and its answer.
    last: Option<(Vec<f64>, Sample)>,
    /// How often it has been asked for in a row.
    asked: usize,
    interruption: Option<Interruption<E>>,
}

impl<F: FnMut(&[f64]) -> Result<Sample, E>, E> Bridge<'_, F, E> {
    /// The sample at a design of NLopt's; `None` once the closure has been interrupted.
    fn at(&mut self, x: &[f64]) -> Option<&Sample> {
        if self.interruption.is_some() {
            return None;
        }
        self.asked += 1;
        if self.last.as_ref().is_none_or(|(design, _)| design != x) {
            self.asked = 1;
            // Scaling back may leave start and bounds by a rounding: what is evaluated must not, since a round starts at a
            // mesh that is known.
            let (start, scaled_start) = &self.start;
            let back = |k: usize| if x[k] == scaled_start[k] { start[k] } else { x[k] * self.unit[k] };
            let physical: Vec<f64> =
                (0..x.len()).map(|k| back(k).clamp(self.settings.lower[k], self.settings.upper[k])).collect();
            match catch_unwind(AssertUnwindSafe(|| (self.evaluate)(&physical))) {
                Ok(Ok(sample)) => self.last = Some((x.to_vec(), sample)),
                Ok(Err(error)) => {
                    self.interruption = Some(Interruption::Error(error));
                    return None;
                }
                Err(panic) => {
                    self.interruption = Some(Interruption::Panic(panic));
                    return None;
                }
            }
        }
        if self.asked > SETTLED {
            self.interruption = Some(Interruption::Settled);
            return None;
        }
        self.last.as_ref().map(|(_, sample)| sample)
    }
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
            constraints: 0,
            ftol_rel: 1e-8,
            xtol_rel: 0.0,
        }
    }

    /// Where a variable is best: inside the bounds, or beyond the upper one.
    fn centre(k: usize) -> f64 {
        if k.is_multiple_of(3) { 0.03 } else { 0.004 }
    }

    /// `1 + Σ w_k ((p_k − c_k)/25 mm)²` with minima inside the bounds, and beyond the upper one.
    fn quadratic(p: &[f64]) -> Sample {
        let mut sample = Sample { value: 1.0, ..Sample::default() };
        for (k, p) in p.iter().enumerate() {
            let (weight, centre) = (1.0 + k as f64, centre(k));
            sample.value += weight * ((p - centre) / 0.025).powi(2);
            sample.gradient.push(2.0 * weight * (p - centre) / 0.025_f64.powi(2));
        }
        sample
    }

    /// The quadratic with the mean of all variables at most 2 mm, and the seventh at most 10 mm.
    fn constrained(p: &[f64]) -> Sample {
        let n = p.len() as f64;
        let mean = p.iter().sum::<f64>() / n / 0.002 - 1.0;
        let seventh = (0..p.len()).map(|k| if k == 6 { 100.0 } else { 0.0 }).collect();
        Sample {
            constraints: vec![(mean, vec![1.0 / n / 0.002; p.len()]), (100.0 * p[6] - 1.0, seventh)],
            ..quadratic(p)
        }
    }

    #[test]
    fn every_algorithm_finds_a_bounded_quadratic_minimum() {
        for algorithm in ALL {
            let mut best = (f64::INFINITY, vec![]);
            let outcome = minimise::<()>(&settings(algorithm), &[0.0; 8], |p| {
                let sample = quadratic(p);
                if sample.value < best.0 {
                    best = (sample.value, p.to_vec());
                }
                Ok(sample)
            });
            assert!(matches!(outcome, Outcome::Ended(_)), "{algorithm:?}: {outcome:?}");
            for (k, p) in best.1.iter().enumerate() {
                let exact = if k % 3 == 0 { 0.020 } else { 0.004 };
                assert!((p - exact).abs() < 1e-4, "{algorithm:?}: variable {k} is {p}");
            }
        }
    }

    #[test]
    fn without_a_tolerance_a_method_ends_where_it_settles() {
        for algorithm in [Algorithm::Mma, Algorithm::Ccsaq] {
            // A linear function: the minimum is the corner of the upper bounds.
            let settings = Minimisation { ftol_rel: 0.0, ..settings(algorithm) };
            let outcome = minimise::<()>(&settings, &[0.0; 8], |p| {
                Ok(Sample {
                    value: 1.0 - p.iter().sum::<f64>(),
                    gradient: vec![-1.0; p.len()],
                    ..Sample::default()
                })
            });
            assert!(matches!(outcome, Outcome::Ended(_)), "{algorithm:?}: {outcome:?}");
        }
    }

    #[test]
    fn every_algorithm_stops_at_once_when_the_closure_does() {
        for algorithm in ALL {
            for last in [1, 2, 4] {
                let mut calls = 0;
                let outcome = minimise(&settings(algorithm), &[0.0; 8], |p| {
                    calls += 1;
                    if calls == last { Err("enough") } else { Ok(quadratic(p)) }
                });
                assert!(matches!(outcome, Outcome::Interrupted("enough")), "{algorithm:?}: {outcome:?}");
                assert_eq!(calls, last, "{algorithm:?}");
            }
        }
    }

    #[test]
    fn the_first_design_asked_for_is_the_start_to_the_last_bit() {
        let start: Vec<f64> = (0..8).map(|k| 1e-3 * (f64::from(k)).sqrt()).collect();
        for algorithm in ALL {
            let mut first = None;
            minimise::<()>(&settings(algorithm), &start, |p| {
                first.get_or_insert_with(|| p.to_vec());
                Ok(quadratic(p))
            });
            assert_eq!(first.as_ref(), Some(&start), "{algorithm:?}");
        }
    }

    #[test]
    fn a_panic_in_the_closure_comes_out_on_this_side() {
        let caught = catch_unwind(|| {
            minimise::<()>(&settings(Algorithm::Mma), &[0.0; 8], |_| panic!("inside the callback"))
        });
        assert!(caught.is_err());
    }

    #[test]
    fn constraints_are_kept_from_inside_and_from_outside() {
        for algorithm in [Algorithm::Mma, Algorithm::Ccsaq, Algorithm::Slsqp] {
            for start in [0.0, 0.015] {
                let settings = Minimisation { constraints: 2, ..settings(algorithm) };
                let (mut best, mut seen) = ((f64::INFINITY, vec![]), Vec::new());
                let outcome = minimise::<()>(&settings, &[start; 8], |p| {
                    assert!(!seen.contains(&p.to_vec()), "{algorithm:?}: a design is evaluated once");
                    seen.push(p.to_vec());
                    let sample = constrained(p);
                    let feasible = sample.constraints.iter().all(|c| c.0 <= CONSTRAINT_TOLERANCE);
                    if feasible && sample.value < best.0 {
                        best = (sample.value, p.to_vec());
                    }
                    Ok(sample)
                });
                assert!(matches!(outcome, Outcome::Ended(_)), "{algorithm:?}: {outcome:?}");
                let p = &best.1;
                // From far outside CCSAQ reaches a feasible design and ends there, short of the optimum.
                if (algorithm, start) == (Algorithm::Ccsaq, 0.015) {
                    assert!(!p.is_empty(), "no feasible design");
                    continue;
                }
                // Lagrange's conditions: both bounds are active, and all free variables have w_k (p_k − c_k) = −μ.
                assert!((p[6] - 0.010).abs() < 1e-5, "{algorithm:?} from {start}: {p:?}");
                assert!((p.iter().sum::<f64>() - 0.016).abs() < 1e-5, "{algorithm:?} from {start}: {p:?}");
                let multiplier = |k: usize| (1.0 + k as f64) * (centre(k) - p[k]);
                let free: Vec<f64> = (0..8)
                    .filter(|&k| k != 6 && p[k] > -0.004999 && p[k] < 0.019999)
                    .map(multiplier)
                    .collect();
                let spread = free.iter().fold(0.0_f64, |m, x| m.max((x - free[0]).abs()));
                assert!(spread < 0.02 * free[0].abs(), "{algorithm:?} from {start}: {free:?}");
            }
        }
    }

    #[test]
    fn constrained_methods_stop_at_once_too() {
        for algorithm in [Algorithm::Mma, Algorithm::Ccsaq, Algorithm::Slsqp] {
            for (start, last) in [(0.0, 1), (0.0, 3), (0.015, 1), (0.015, 2), (0.015, 4)] {
                let mut calls = 0;
                let settings = Minimisation { constraints: 2, ..settings(algorithm) };
                let outcome = minimise(&settings, &[start; 8], |p| {
                    calls += 1;
                    if calls == last { Err("enough") } else { Ok(constrained(p)) }
                });
                assert!(matches!(outcome, Outcome::Interrupted("enough")), "{algorithm:?}: {outcome:?}");
                assert_eq!(calls, last, "{algorithm:?}");
            }
        }
    }
}
