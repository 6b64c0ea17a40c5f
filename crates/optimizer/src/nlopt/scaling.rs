//! Units in which NLopt sees variables, objective and constraints.

use super::first_step::Start;
use super::gradient::{Minimisation, Sample};

/// Span between the bounds that the variables are scaled to: the paper's plate (−5 … 20 mm) in millimetres.
pub(super) const SCALED_SPAN: f64 = 25.0;

/// What rounding makes of a constraint that no motion changes, as a share of its bound: sums over a million elements round to 1e-13.
const UNCHANGED: f64 = 1e-12;

/// Units in which NLopt sees the variables.
pub(super) struct Scaling {
    /// Length of a scaled unit of every variable.
    pub(super) unit: Vec<f64>,
}

impl Scaling {
    /// Of the bounds; `None` where they, the start or the first step are not finite, the bounds cross, or the first step is none.
    pub(super) fn new(settings: &Minimisation, start: &[f64]) -> Option<Self> {
        let [lower, upper] = [&settings.lower, &settings.upper];
        let are_sound = settings.first_step > 0.0
            && settings.first_step.is_finite()
            && start.len() == lower.len()
            && start.len() == upper.len()
            && start.iter().all(|p| p.is_finite())
            // Of infinite bounds the span is no length either.
            && lower.iter().zip(upper).all(|(low, high)| low <= high && (high - low).is_finite());
        // A variable between equal bounds keeps its value in any unit.
        let unit_of = |span: f64| if span > 0.0 { span / SCALED_SPAN } else { 1.0 };
        are_sound
            .then(|| Self { unit: lower.iter().zip(upper).map(|(low, high)| unit_of(high - low)).collect() })
    }

    pub(super) fn scale(&self, values: &[f64]) -> Vec<f64> {
        values.iter().zip(&self.unit).map(|(v, unit)| v / unit).collect()
    }

    /// The factors with which the first step from a scaled design is as long as asked for.
    pub(super) fn factors(&self, settings: &Minimisation, x: &[f64], sample: &Sample) -> Factors {
        let scaled = |derivative: &[f64], factor: f64| {
            let mut gradient = vec![0.0; x.len()];
            self.fill(&mut gradient, factor, derivative);
            gradient
        };
        let [lower, upper] = [&settings.lower, &settings.upper].map(|bounds| self.scale(bounds));
        let between =
            |low: &[f64], high: &[f64]| low.iter().zip(high).map(|(low, high)| high - low).collect();
        let mut start = Start {
            value: sample.value,
            gradient: scaled(&sample.gradient, 1.0),
            room: [between(&lower, x), between(x, &upper)],
            span: SCALED_SPAN,
        };
        let own: Vec<_> = sample.constraints.iter().map(|of| (self.shown(of), scaled(&of.1, 1.0))).collect();
        let (objective, multipliers) = start.meet(settings.algorithm, settings.first_step, &own);
        let factor_on = |value: f64, gradient: &[f64], multiplier: f64| {
            start.constraint_factor(settings.algorithm, objective, (value, gradient), multiplier)
        };
        let met = own.iter().zip(multipliers);
        let mut constraints: Vec<f64> = met.map(|((value, own), m)| factor_on(*value, own, m)).collect();
        // One factor on all terms of a worst case, which are compared with each other.
        let terms = sample.members.iter().map(|(value, own)| {
            objective * factor_on(objective * (value - sample.value), &scaled(own, objective), 0.0)
        });
        let largest = terms.fold(0.0, f64::max);
        constraints.resize(constraints.len() + sample.members.len(), largest);
        Factors { objective, constraints }
    }

    /// The value of a constraint that NLopt is shown. One that is at its bound and that no motion changes, both but for rounding, as the
    /// volume of a body that is shifted, is far within: no step would ever mend what rounding breaks, and none be taken.
    pub(super) fn shown(&self, (value, gradient): &(f64, Vec<f64>)) -> f64 {
        let change: f64 = gradient.iter().zip(&self.unit).map(|(g, unit)| g.abs() * unit * SCALED_SPAN).sum();
        if value.abs().max(change) <= UNCHANGED { -1.0 } else { *value }
    }

    /// Derivatives by the scaled variables.
    pub(super) fn fill(&self, target: &mut [f64], factor: f64, derivative: &[f64]) {
        for ((g, d), unit) in target.iter_mut().zip(derivative).zip(&self.unit) {
            *g = factor * d * unit;
        }
    }
}

/// Factors on what NLopt is shown.
#[derive(Default)]
pub(super) struct Factors {
    pub(super) objective: f64,
    /// On the constraints, and behind them on the terms of a worst case.
    pub(super) constraints: Vec<f64>,
}

#[cfg(test)]
mod tests {
    use super::super::Algorithm;
    use super::super::Outcome;
    use super::super::gradient::minimise;
    use crate::error::Error;

    use super::*;

    #[test]
    fn a_first_step_that_is_none_is_refused() {
        for first_step in [0.0, -0.1, f64::NAN, f64::INFINITY] {
            let settings = Minimisation {
                algorithm: Algorithm::Mma,
                lower: vec![0.0],
                upper: vec![1.0],
                constraints: 0,
                members: 0,
                ftol_rel: 1e-3,
                xtol_rel: 0.0,
                first_step,
            };
            let ended = minimise::<Error>(&settings, &[0.5], |_| unreachable!("nothing is asked for"));
            assert!(matches!(ended, Outcome::Failed(why) if why.contains("first step")), "{first_step}");
        }
    }

    /// As the volume of a body that is shifted: its value and its derivatives are rounding.
    #[test]
    fn a_constraint_at_its_bound_that_nothing_changes_stops_no_method() {
        for algorithm in [Algorithm::Mma, Algorithm::Ccsaq, Algorithm::Slsqp] {
            let settings = Minimisation {
                algorithm,
                lower: vec![-0.005; 4],
                upper: vec![0.010; 4],
                constraints: 1,
                members: 0,
                ftol_rel: 1e-6,
                xtol_rel: 0.0,
                first_step: 0.1,
            };
            let (mut best, mut count, mut second) = (f64::INFINITY, 0, Vec::new());
            let ended = minimise::<Error>(&settings, &[0.0; 4], |p| {
                count += 1;
                if count == 2 {
                    second = p.to_vec();
                }
                let value = 1.0 - 10.0 * p.iter().sum::<f64>();
                best = value.min(best);
                let rounding = if count % 2 == 1 { 8e-16 } else { -3e-16 };
                Ok(Sample {
                    value,
                    gradient: vec![-10.0; 4],
                    constraints: vec![(rounding, vec![1e-14, -1e-14, 3e-15, 2e-14])],
                    ..Sample::default()
                })
            });
            println!("{algorithm:?}: {best} after {count} evaluations, {ended:?}");
            assert!((best - 0.6).abs() < 1e-3, "{algorithm:?}: {best}");
            // The variables are alike but for the constraint.
            assert!(second[0] > 1e-5, "{algorithm:?}: {second:?}");
            assert!(second.iter().all(|p| (p / second[0] - 1.0).abs() < 1e-3), "{algorithm:?}: {second:?}");
        }
    }
}
