//! The gradient certificate: is dF/dp the derivative of F through the whole chain p → mesh → field → F?
//!
//! In random directions `d` of unit maximum norm, scaled by the bounds' span `s`:
//! * the Taylor remainder `|F(p + h s d) − F(p) − h s g·d|` falls with order 2 as `h` is halved. Of `d` and `−d` the one
//!   with the larger remainder at the first step is taken: there the terms of second and third order add. On the other
//!   side they may cancel at some `h`, and the slope between two steps says nothing. With a wrong gradient the larger
//!   remainder is the one in which first and second order add, and its slope is 1;
//! * the central difference `(F(p + h s d) − F(p − h s d)) / (2 h s)` equals `g·d`.

use crate::error::Error;
use crate::problem::{Problem, Want};

/// Steps of the certificate, and what it asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Random directions. Default 5.
    pub directions: usize,
    /// Halvings of the Taylor step. Default 5.
    pub halvings: usize,
    /// First Taylor step, as a share of the bounds' span. Default 0.02: half a millimetre for the paper's plate.
    pub first_step: f64,
    /// Step of the central difference, as a share of the span. Default 2e-4: its truncation error, about the square, and
    /// the solver's residual over it are both far below what is required.
    pub difference_step: f64,
    /// Least fitted slope of the remainders. Default 1.95.
    pub least_slope: f64,
    /// Largest relative error of the central difference. Default 1e-6.
    pub largest_error: f64,
    /// Seed of the directions. Default 1.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            directions: 5,
            halvings: 5,
            first_step: 0.02,
            difference_step: 2e-4,
            least_slope: 1.95,
            largest_error: 1e-6,
            seed: 1,
        }
    }
}

/// What was measured in one direction.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Direction {
    /// Steps, as shares of the bounds' span.
    pub steps: Vec<f64>,
    /// Taylor remainders over F(p).
    pub remainders: Vec<f64>,
    /// Least-squares slope of log remainder over log step.
    pub slope: f64,
    /// `g·d` times the span, over F(p).
    pub adjoint: f64,
    /// The same by central difference.
    pub difference: f64,
    /// `|difference − adjoint| / |adjoint|`.
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

/// Measures the certificate of a problem at the design `p`; `progress` is told after each direction.
///
/// # Errors
/// When an evaluation fails.
///
/// # Panics
/// If the problem has no shape or no objective.
pub fn certify(
    problem: &Problem,
    p: &[f64],
    settings: &Settings,
    progress: impl FnMut(usize, &Direction),
) -> Result<Certificate, Error> {
    let shape = problem.shape.as_ref().expect("a certificate needs a shape");
    let base = problem.evaluate(p, Want::Gradient)?;
    let objective = base.objective.expect("a certificate needs an objective");
    let gradient = base.gradient.expect("the gradient was asked for");
    let span: Vec<f64> = shape.upper.iter().zip(&shape.lower).map(|(high, low)| high - low).collect();
    let value = |p: &[f64]| -> Result<f64, Error> {
        Ok(problem.evaluate(p, Want::Value)?.objective.expect("a certificate needs an objective"))
    };
    measure(&value, p, objective, &gradient, &span, settings, progress)
}

/// Measures the certificate of any function with the value `objective` and what is said to be its gradient at `p`; `span` scales the directions.
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
        let cause = "the objective is zero: there is no field to differentiate; check coils and regions";
        return Err(Error::Optimisation { cause });
    }
    let value = |direction: &[f64], h: f64| -> Result<f64, Error> {
        let at: Vec<f64> = p.iter().zip(direction).map(|(p, d)| p + h * d).collect();
        Ok(function(&at)? / objective)
    };
    let slope_along = |direction: &[f64]| -> f64 {
        gradient.iter().zip(direction).map(|(g, d)| g * d).sum::<f64>() / objective
    };
    let remainder = |direction: &[f64], h: f64| -> Result<f64, Error> {
        Ok((value(direction, h)? - 1.0 - h * slope_along(direction)).abs())
    };
    let mut random = fastrand::Rng::with_seed(settings.seed);
    let mut directions = Vec::with_capacity(settings.directions);
    for index in 0..settings.directions {
        let mut direction: Vec<f64> = span.iter().map(|span| span * (2.0 * random.f64() - 1.0)).collect();
        if remainder(&direction, -settings.first_step)? > remainder(&direction, settings.first_step)? {
            direction.iter_mut().for_each(|d| *d = -*d);
        }
        let steps: Vec<f64> =
            (0..=settings.halvings).map(|k| settings.first_step * 0.5_f64.powi(k as i32)).collect();
        let remainders =
            steps.iter().map(|&h| remainder(&direction, h)).collect::<Result<Vec<f64>, Error>>()?;
        let adjoint = slope_along(&direction);
        let h = settings.difference_step;
        let difference = (value(&direction, h)? - value(&direction, -h)?) / (2.0 * h);
        let measured = Direction {
            slope: fitted_slope(&steps, &remainders),
            steps,
            remainders,
            adjoint,
            difference,
            error: ((difference - adjoint) / adjoint).abs(),
        };
        progress(index, &measured);
        directions.push(measured);
    }
    let least_slope = directions.iter().map(|d| d.slope).fold(f64::INFINITY, f64::min);
    let largest_error = directions.iter().map(|d| d.error).fold(0.0, f64::max);
    // A comparison with NaN is false: a certificate that cannot be measured does not hold.
    let holds =
        directions.iter().all(|d| d.slope >= settings.least_slope && d.error <= settings.largest_error);
    Ok(Certificate { objective, directions, least_slope, largest_error, holds })
}

/// Least-squares slope of `log y` over `log x`.
fn fitted_slope(x: &[f64], y: &[f64]) -> f64 {
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
        let certify = |gradient: &[f64]| {
            measure(&smooth, &p, smooth(&p).unwrap(), gradient, &[1.0; 3], &Settings::default(), |_, _| {})
                .unwrap()
        };
        assert!(certify(&right).holds);
        let mut wrong = right;
        wrong[1] *= 1.0 + 1e-4;
        assert!(!certify(&wrong).holds, "one component off by 1e-4 is seen");
        let mut missing = right;
        missing[2] = f64::NAN;
        assert!(!certify(&missing).holds);
    }

    #[test]
    fn the_slope_of_a_power_law_is_its_exponent() {
        let x = [0.1, 0.05, 0.025, 0.0125];
        assert!((fitted_slope(&x, &x.map(|x| 3.0 * x.powf(1.7))) - 1.7).abs() < 1e-12);
    }
}
