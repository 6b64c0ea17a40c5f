//! The gradient certificate: is dF/dp the derivative of F through the whole chain p → mesh → field → F?
//!
//! In random directions `d` of unit maximum norm, scaled by the bounds' span `s`:
//! * the Taylor remainder `|F(p + h s d) − F(p) − h s g·d|` falls with order 2 as `h` is halved. Of `d` and `−d` the one
//!   with the larger remainder at the first step is taken: there the terms of second and third order add. On the other
//!   side they may cancel at some `h`, and the slope between two steps says nothing. With a wrong gradient the larger
//!   remainder is the one in which first and second order add, and its slope is 1. Of a function that is linear, such as
//!   the volume of a plate with one moving face, nothing remains but rounding, and there is no slope to ask for;
//! * the central difference `(F(p + h s d) − F(p − h s d)) / (2 h s)` equals `g·d`.

use std::cell::RefCell;
use std::collections::BTreeMap;

use fluxmorph_remesh::RemeshError;

use crate::constraint::Quantity;
use crate::error::Error;
use crate::problem::{Analysis, Derivatives, NoProgress, Problem, SolverCache};

/// Remainders over F(p) that count as rounding: above the solver's tolerance, and a thousand times below what a first
/// step of 2 % of the span leaves of any function that bends.
const ROUNDING: f64 = 1e-9;

/// Fewest remainders above the residual of the states that a slope is fitted to.
const FEWEST: usize = 3;

/// The most that F(p) may lie off what its neighbours say of it, over the residual of the states.
const MOST_OFF: f64 = 1e3;

/// Change over the span, as a share of F(p), below which a difference is related to this and not to the change itself: there the
/// parts of a derivative cancel.
const LEAST_SLOPE: f64 = 1e-3;

/// Steps for the bound on a thickness, a smooth maximum over many places: it bends within hundredths of a millimetre, and
/// is computed without a field, so that small steps cost no digits.
const FINE: [f64; 2] = [8e-5, 4e-7];

/// How often the first step may be halved for a mesh that does not carry it: to a sixteenth, a little more than what a
/// central difference takes.
const MOST_HALVINGS: usize = 4;

/// Steps of the certificate, and what it asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Random directions. Default 5.
    pub directions: usize,
    /// Halvings of the Taylor step. Default 5.
    pub halvings: usize,
    /// First Taylor step, as a share of the bounds' span. Default 0.02: half a millimetre for the paper's plate.
    pub first_step: f64,
    /// Step of the central difference of fourth order, as a share of the span. Default 5e-4: its truncation error, about the
    /// fourth power, and the solver's residual over it are both far below what is required.
    pub difference_step: f64,
    /// Least fitted slope of the remainders. Default 1.95.
    pub least_slope: f64,
    /// Largest relative error of the central difference. Default 1e-6.
    pub largest_error: f64,
    /// Seed of the directions. Default 1.
    pub seed: u64,
    /// What the residual of the states may move F by, over F. Default 1e-11; of a problem their tolerance, of what has no field zero.
    pub residual: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            directions: 5,
            halvings: 5,
            first_step: 0.02,
            difference_step: 5e-4,
            least_slope: 1.95,
            largest_error: 1e-6,
            seed: 1,
            residual: 1e-11,
        }
    }
}

impl Settings {
    /// The change over the span, as a share of F(p), that differences are related to at least: half the residual over a step of
    /// the difference is as much of it as is allowed.
    fn least_change(&self) -> f64 {
        LEAST_SLOPE.max(0.5 * self.residual / (self.difference_step * self.largest_error))
    }
}

/// What was measured in one direction.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Direction {
    /// Steps, as shares of the bounds' span.
    pub steps: Vec<f64>,
    /// Taylor remainders over F(p).
    pub remainders: Vec<f64>,
    /// Least-squares slope of log remainder over log step, without what F(p) itself lies off its neighbours by and as far as the
    /// remainders are no residual of the solver; 2 where all are rounding alone.
    pub slope: f64,
    /// `g·d` times the span, over F(p).
    pub adjoint: f64,
    /// The same by central difference.
    pub difference: f64,
    /// `|difference − adjoint| / |adjoint|`, with a hundredth of F(p) for an adjoint that is smaller, for states solved to 1e-11.
    pub error: f64,
}

/// The outcome of a certificate.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Certificate {
    /// F(p).
    pub objective: f64,
    /// One entry a direction.
    pub directions: Vec<Direction>,
    /// The smallest slope.
    pub least_slope: f64,
    /// The largest error.
    pub largest_error: f64,
    /// Whether every requirement holds.
    pub holds: bool,
}

/// The outcome for objective and constraints of a problem.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Certificates {
    /// Of the objective.
    #[serde(flatten)]
    pub objective: Certificate,
    /// Of every constraint, in the order of the problem.
    pub constraints: Vec<Named>,
}

/// The certificate of a constraint.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Named {
    /// Name of the constraint.
    pub name: String,
    /// What was measured, of the value itself and not of its distance from the bound.
    #[serde(flatten)]
    pub certificate: Certificate,
}

/// Measures the certificates of a problem's objective and constraints at the design `p`; `progress` gets the name of the
/// constraint, if it is one, after each direction. `interrupted` is asked before each evaluation.
///
/// Of a worst case it is the term that is the worst at `p`: where two are equal the worst of them has no gradient. The directions are
/// the same for all, and each design is evaluated once. Where the mesh does not carry the first step, all begins
/// anew with half of it, down to a sixteenth.
///
/// # Errors
/// [`Error::Interrupted`], or when an evaluation fails.
///
/// # Panics
/// If the problem has no shape or no objective.
pub fn certify(
    problem: &Problem,
    p: &[f64],
    settings: &Settings,
    interrupted: &dyn Fn() -> bool,
    mut progress: impl FnMut(Option<&str>, usize, &Direction),
) -> Result<Certificates, Error> {
    Error::check_interrupted(interrupted)?;
    let mut cache = SolverCache::default();
    let base = problem.evaluate(p, Derivatives::First, &mut cache, &mut NoProgress)?;
    let at = (p, &base, &cache);
    let tolerance = problem.states().iter().map(|state| state.setup().linear_solver.tolerance);
    let mut settings = Settings { residual: tolerance.fold(0.0, f64::max), ..*settings };
    for _ in 0..MOST_HALVINGS {
        match certify_at(problem, at, &settings, interrupted, &mut progress) {
            Err(Error::Remesh(RemeshError::Inverted { .. })) => {
                // The last step stays.
                (settings.first_step, settings.halvings) =
                    (0.5 * settings.first_step, settings.halvings.saturating_sub(1).max(1));
            }
            certified => return certified,
        }
    }
    certify_at(problem, at, &settings, interrupted, &mut progress)
}

/// The same with these steps at an analysed design; the cache is what its analysis has left.
fn certify_at(
    problem: &Problem,
    (p, base, cache): (&[f64], &Analysis, &SolverCache),
    settings: &Settings,
    interrupted: &dyn Fn() -> bool,
    progress: &mut dyn FnMut(Option<&str>, usize, &Direction),
) -> Result<Certificates, Error> {
    let span = span(problem);
    let objective = base.objective.expect("a certificate needs an objective");
    // The gradient is that of the term which is the worst here; where two of them are, the worst one has none.
    let values = base.member_values();
    let active = problem.objective().filter(|_| !values.is_empty()).map(|own| own.worst(&values));
    let known: RefCell<BTreeMap<Vec<u64>, Vec<f64>>> = RefCell::default();
    let value = |p: &[f64], index: usize| -> Result<f64, Error> {
        let key: Vec<u64> = p.iter().map(|x| x.to_bits()).collect();
        if let Some(values) = known.borrow().get(&key) {
            return Ok(values[index]);
        }
        Error::check_interrupted(interrupted)?;
        let cache = &mut cache.without_initial_guess();
        let values = numbers(&problem.evaluate(p, Derivatives::None, cache, &mut NoProgress)?, active);
        let value = values[index];
        known.borrow_mut().insert(key, values);
        Ok(value)
    };
    let gradient = base.gradient.as_ref().expect("the gradient was asked for");
    let function = |p: &[f64]| value(p, 0);
    let report = |index: usize, direction: &Direction| progress(None, index, direction);
    let objective = measure(&function, p, objective, gradient, &span, settings, report)?;
    let mut constraints = Vec::with_capacity(problem.constraints().len());
    for (k, (constraint, measured)) in problem.constraints().iter().zip(&base.constraints).enumerate() {
        // What no field has a say in is computed without one.
        let function = |p: &[f64]| match (&constraint.quantity, problem.shape()) {
            (Quantity::Field(_), _) | (_, None) => value(p, k + 1),
            (_, Some(shape)) => {
                Ok(constraint.of_shape(&problem.moved(p)?, shape)?.map_or(f64::NAN, |(value, _)| value))
            }
        };
        let gradient = measured.gradient.as_ref().expect("the gradient was asked for");
        let report = |index: usize, direction: &Direction| progress(Some(&constraint.name), index, direction);
        let [first_step, difference_step] = match constraint.quantity {
            Quantity::Thickness { .. } => FINE,
            _ => [settings.first_step, settings.difference_step],
        };
        let residual =
            if matches!(constraint.quantity, Quantity::Field(_)) { settings.residual } else { 0.0 };
        let settings = Settings { first_step, difference_step, residual, ..*settings };
        let certificate = measure(&function, p, measured.value, gradient, &span, &settings, report)?;
        constraints.push(Named { name: constraint.name.clone(), certificate });
    }
    Ok(Certificates { objective, constraints })
}

impl Certificates {
    /// Whether all hold.
    pub fn hold(&self) -> bool {
        self.objective.holds && self.constraints.iter().all(|named| named.certificate.holds)
    }
}

/// Objective, of a worst case the `active` term, and constraints of a design.
fn numbers(analysis: &Analysis, active: Option<usize>) -> Vec<f64> {
    let objective = match active {
        Some(term) => analysis.members[term].value,
        None => analysis.objective.expect("a certificate needs an objective"),
    };
    std::iter::once(objective).chain(analysis.constraints.iter().map(|c| c.value)).collect()
}

/// Distance of the bounds of every variable.
fn span(problem: &Problem) -> Vec<f64> {
    let shape = problem.shape().expect("a certificate needs a shape");
    shape.upper().iter().zip(shape.lower()).map(|(high, low)| high - low).collect()
}

/// Measures the certificate of any function with the value `objective` and what is said to be its gradient at `p`; `span` scales
/// the directions.
///
/// # Errors
/// When an evaluation fails.
pub fn measure(
    function: &impl Fn(&[f64]) -> Result<f64, Error>,
    p: &[f64],
    objective: f64,
    gradient: &[f64],
    span: &[f64],
    settings: &Settings,
    mut progress: impl FnMut(usize, &Direction),
) -> Result<Certificate, Error> {
    if objective == 0.0 {
        let cause = "the objective or a constraint is zero: there is no field to differentiate; check coils and regions";
        return Err(Error::Optimisation { cause });
    }
    let value = |direction: &[f64], h: f64| -> Result<f64, Error> {
        let at: Vec<f64> = p.iter().zip(direction).map(|(p, d)| p + h * d).collect();
        Ok(function(&at)? / objective)
    };
    let slope_along = |direction: &[f64]| -> f64 {
        gradient.iter().zip(direction).map(|(g, d)| g * d).sum::<f64>() / objective
    };
    let mut random = fastrand::Rng::with_seed(settings.seed);
    let mut directions = Vec::with_capacity(settings.directions);
    for index in 0..settings.directions {
        let direction: Vec<f64> = span.iter().map(|span| span * (2.0 * random.f64() - 1.0)).collect();
        let measured = measure_along(&|h| value(&direction, h), slope_along(&direction), settings)?;
        progress(index, &measured);
        directions.push(measured);
    }
    let least_slope = directions.iter().map(|d| d.slope).fold(f64::INFINITY, f64::min);
    let largest_error = directions.iter().map(|d| d.error).fold(0.0, f64::max);
    // Where nothing was measured nothing holds. A comparison with NaN is false: nor does what cannot be measured.
    let is_measured = !directions.is_empty() && span.iter().any(|span| *span > 0.0);
    let holds = is_measured
        && directions.iter().all(|d| d.slope >= settings.least_slope && d.error <= settings.largest_error);
    Ok(Certificate { objective, directions, least_slope, largest_error, holds })
}

/// Along one direction, of the function relative to its value at the design and its slope by the gradient. Of the two ways along
/// it that in which the function bends more.
fn measure_along(
    value: &impl Fn(f64) -> Result<f64, Error>,
    slope: f64,
    settings: &Settings,
) -> Result<Direction, Error> {
    let remainder = |h: f64| -> Result<f64, Error> { Ok(value(h)? - 1.0 - h * slope) };
    let [back, ahead] = [-1.0, 1.0].map(|side| remainder(side * settings.first_step));
    let way = if back?.abs() > ahead?.abs() { -1.0 } else { 1.0 };
    let steps: Vec<f64> =
        (0..=settings.halvings).map(|k| settings.first_step * 0.5_f64.powi(k as i32)).collect();
    let remainders = steps.iter().map(|&h| remainder(way * h)).collect::<Result<Vec<f64>, Error>>()?;
    let adjoint = way * slope;
    let h = settings.difference_step;
    let [far_back, back, ahead, far_ahead] = [-2.0 * h, -h, h, 2.0 * h].map(|h| value(way * h));
    let ([far_back, back], [ahead, far_ahead]) = ([far_back?, back?], [ahead?, far_ahead?]);
    let difference = (8.0 * (ahead - back) - (far_ahead - far_back)) / (12.0 * h);
    let linear = remainders.iter().all(|&r| r.abs() <= ROUNDING);
    // F(p) is solved by a factor of its own, all others by an iteration: a force may see the difference tenfold. It is
    // what is left at h = 0 of the even part, whose curvature cancels.
    let left = (2.0 * (ahead + back) - 0.5 * (far_ahead + far_back)) / 3.0 - 1.0;
    let known = 2.0 * settings.residual..=MOST_OFF * settings.residual;
    let off = if known.contains(&left.abs()) { left } else { 0.0 };
    let bent: Vec<f64> = remainders.iter().map(|r| (r - off).abs()).collect();
    let clear = bent.iter().take_while(|&&r| r > settings.residual).count();
    let fitted = if clear < FEWEST { steps.len() } else { clear };
    Ok(Direction {
        slope: if linear { 2.0 } else { fitted_slope(&steps[..fitted], &bent[..fitted]) },
        steps,
        remainders: remainders.into_iter().map(f64::abs).collect(),
        adjoint,
        difference,
        error: (difference - adjoint).abs() / adjoint.abs().max(settings.least_change()),
    })
}

/// Least-squares slope of `log y` over `log x`.
pub fn fitted_slope(x: &[f64], y: &[f64]) -> f64 {
    let n = x.len() as f64;
    let (lx, ly): (Vec<f64>, Vec<f64>) =
        (x.iter().map(|x| x.ln()).collect(), y.iter().map(|y| y.ln()).collect());
    let (mx, my) = (lx.iter().sum::<f64>() / n, ly.iter().sum::<f64>() / n);
    let covariance: f64 = lx.iter().zip(&ly).map(|(x, y)| (x - mx) * (y - my)).sum();
    let variance: f64 = lx.iter().map(|x| (x - mx).powi(2)).sum();
    covariance / variance
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `1 + Σ sin(p_k) + p_k²` and its gradient.
    fn smooth(p: &[f64]) -> Result<f64, Error> {
        Ok(1.0 + p.iter().map(|p| p.sin() + p * p).sum::<f64>())
    }

    #[test]
    fn a_right_gradient_is_certified_and_a_slightly_wrong_one_is_not() {
        let p = [0.3, -0.2, 0.7];
        let right = p.map(|p: f64| p.cos() + 2.0 * p);
        let value = smooth(&p).expect("a number");
        let certify = |gradient: &[f64]| {
            measure(&smooth, &p, value, gradient, &[1.0; 3], &Settings::default(), |_, _| {})
                .expect("a certificate")
        };
        assert!(certify(&right).holds);
        let mut wrong = right;
        wrong[1] *= 1.0 + 1e-4;
        assert!(!certify(&wrong).holds, "one component off by 1e-4 is seen");
        let mut missing = right;
        missing[2] = f64::NAN;
        assert!(!certify(&missing).holds);
        // Nothing is measured without a direction, or between equal bounds.
        let none = Settings { directions: 0, ..Settings::default() };
        for (span, settings) in [([1.0; 3], none), ([0.0; 3], Settings::default())] {
            let measured = measure(&smooth, &p, value, &wrong, &span, &settings, |_, _| {});
            assert!(!measured.expect("a certificate").holds, "{span:?}");
        }
    }

    #[test]
    fn a_linear_function_is_certified_and_its_wrong_gradient_is_not() {
        let linear = |p: &[f64]| Ok(2.0 + 3.0 * p[0] - p[1]);
        let certify = |gradient: &[f64]| {
            measure(&linear, &[0.1, 0.2], 2.1, gradient, &[1.0; 2], &Settings::default(), |_, _| {})
                .expect("a certificate")
        };
        assert!(certify(&[3.0, -1.0]).holds);
        assert!(!certify(&[3.001, -1.0]).holds);
        assert!(!certify(&[f64::NAN, -1.0]).holds);
    }

    #[test]
    fn what_the_residual_of_a_state_leaves_spoils_no_certificate_and_covers_no_wrong_gradient() {
        // A thousandth over the whole span, hardly bent, and known to 1e-12 alone.
        let noisy = |p: &[f64]| Ok(1.0 + 1e-3 * p[0] + 1e-5 * p[0] * p[0] + 1e-12 * (1e7 * p[0]).sin());
        let certify = |gradient: f64| {
            measure(&noisy, &[0.0], 1.0, &[gradient], &[1.0], &Settings::default(), |_, _| {})
                .expect("a certificate")
        };
        assert!(certify(1e-3).holds, "{:?}", certify(1e-3));
        assert!(!certify(1.001e-3).holds);
        // Hardly bent along a direction, and at p solved by another path: a force, whose layer holds little of the field.
        let apart =
            |p: &[f64]| Ok(1.0 + 0.35 * p[0] + 2e-4 * p[0] * p[0] - if p[0] == 0.0 { 0.0 } else { 1e-10 });
        let certify = |gradient: f64| {
            measure(&apart, &[0.0], 1.0, &[gradient], &[1.0], &Settings::default(), |_, _| {})
                .expect("a certificate")
        };
        assert!(certify(0.35).holds, "{:?}", certify(0.35));
        assert!(!certify(0.35 * (1.0 + 1e-5)).holds);
    }

    #[test]
    fn the_slope_of_a_power_law_is_its_exponent() {
        let x = [0.1, 0.05, 0.025, 0.0125];
        assert!((fitted_slope(&x, &x.map(|x| 3.0 * x.powf(1.7))) - 1.7).abs() < 1e-12);
    }
}
