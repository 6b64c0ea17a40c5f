//! Units in which NLopt sees variables, objective and constraints.

use super::first_step::Start;
use super::gradient::{Minimisation, Sample};

/// Span between the bounds that the variables are scaled to: the paper's plate (−5 … 20 mm) in millimetres.
pub(super) const SCALED_SPAN: f64 = 25.0;

/// Units in which NLopt sees the variables.
pub(super) struct Scaling {
    /// Length of a scaled unit of every variable.
    pub(super) unit: Vec<f64>,
}

impl Scaling {
    /// Of the bounds; `None` where they or the start are not finite, or the bounds cross.
    pub(super) fn new(settings: &Minimisation, start: &[f64]) -> Option<Self> {
        let [lower, upper] = [&settings.lower, &settings.upper];
        let are_sound = start.len() == lower.len()
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
        let own: Vec<_> = sample.constraints.iter().map(|(value, own)| (*value, scaled(own, 1.0))).collect();
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
