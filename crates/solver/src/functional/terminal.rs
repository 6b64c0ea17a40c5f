//! Functions of the current `I` and the flux linkage `λ` of one coil with a winding.
//!
//! `λ = Fᵀu` is linear in the field; `I` is given, or an unknown of its own where a voltage drives the coil
//! ([`crate::circuit`]). With `V = Z I + jωλ` across the coil and what is in series, a function `g(I, λ)` has
//! `∂F/∂u = ∂g/∂λ F` and `∂F/∂I`, which stands behind the field's unknowns.

use fluxmorph_geometry::fem::c64;

use super::FunctionalValue;
use crate::error::SolverError;
use crate::model::FieldModel;
use crate::solution::FieldState;

/// What is made of current and flux linkage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AtTerminals {
    /// `λ` [Wb] in statics, `|λ|` in harmonics.
    FluxLinkage,
    /// `|I|` [A] of a voltage-driven coil in harmonics.
    Current,
    /// `|R I + jωλ|` [V] in harmonics: across the coil with its resistance.
    Voltage,
    /// `½Re(V I*)` [W] in harmonics: the power that goes in.
    Power,
    /// `Re(V I*)/|V I|` [1] in harmonics, of the coil with what is in series.
    PowerFactor,
}

/// A function of what the terminals of a coil see.
#[derive(Clone, Debug)]
pub struct TerminalFunctional {
    /// Place of the winding.
    winding: usize,
    of: AtTerminals,
}

impl TerminalFunctional {
    pub(super) fn new(model: &FieldModel, coil: &str, of: AtTerminals) -> Result<Self, SolverError> {
        let winding = super::windings_of(model, &[coil])?[0];
        let refuse = |value: &str, expected: &str| {
            Err(SolverError::parameter(format!("{of:?} of the coil `{coil}`"), value, expected))
        };
        if model.angular_frequency() == 0.0 && of != AtTerminals::FluxLinkage {
            return refuse("at 0 Hz", "a frequency above 0 Hz: no shape changes it in statics");
        }
        if of == AtTerminals::Current && model.windings().winding(winding).voltage.is_none() {
            return refuse("given", "a coil that a voltage drives");
        }
        Ok(Self { winding, of })
    }

    pub(super) fn evaluate(&self, (model, mesh, state): FieldState<'_>) -> FunctionalValue {
        let (windings, omega) = (model.windings(), model.angular_frequency());
        let winding = windings.winding(self.winding);
        let current = windings.current(self.winding, model, state);
        let linkage = windings.linkage(self.winding, (model, mesh, state));
        let (value, by_current, by_linkage) = if omega == 0.0 {
            (linkage.re, c64::default(), c64::new(0.5, 0.0))
        } else {
            function(self.of, omega, [winding.impedance(omega), winding.resistance.into()], current, linkage)
        };
        let mut derivative: Vec<c64> =
            windings.load(self.winding).iter().map(|load| by_linkage * load).collect();
        if let Some(source) = windings.source_position(self.winding).filter(|_| omega > 0.0) {
            let of_field = model.unknown_count() + model.solids().count();
            derivative.resize(of_field + windings.source_count(), c64::default());
            derivative[of_field + source] = by_current;
        }
        FunctionalValue { value, derivative, ..Default::default() }
    }
}

/// Value and derivatives by current and linkage, `dF = 2 Re(∂F/∂I dI + ∂F/∂λ dλ)`, for the impedance in series and its part
/// inside the coil.
fn function(
    of: AtTerminals,
    omega: f64,
    [series, wire]: [c64; 2],
    current: c64,
    linkage: c64,
) -> (f64, c64, c64) {
    let jw = c64::new(0.0, omega);
    // Of |aI + bλ|; where it vanishes it has a kink, and zero prefers no side.
    let modulus = |a: c64, b: c64| {
        let z = a * current + b * linkage;
        let phase = if z == c64::default() { z } else { 0.5 * z.conj() / z.norm() };
        (z.norm(), a * phase, b * phase)
    };
    let (one, zero) = (c64::new(1.0, 0.0), c64::default());
    let voltage = series * current + jw * linkage;
    // P = ½ Re(V I*): dP = 2 Re(¼ I* dV + ¼ V* dI).
    let power = 0.5 * (voltage * current.conj()).re;
    let (by_voltage, by_current) = (0.25 * current.conj(), 0.25 * voltage.conj());
    match of {
        AtTerminals::FluxLinkage => modulus(zero, one),
        AtTerminals::Current => modulus(one, zero),
        AtTerminals::Voltage => modulus(wire, jw),
        AtTerminals::Power => (power, by_voltage * series + by_current, by_voltage * jw),
        AtTerminals::PowerFactor => {
            let apparent = 0.5 * voltage.norm() * current.norm();
            if apparent == 0.0 {
                return (0.0, zero, zero);
            }
            let factor = power / apparent;
            // d|z|/|z| = 2 Re(z*/(2|z|²) dz).
            let relative = |z: c64| 0.5 * z.conj() / z.norm_sqr();
            let by_voltage = by_voltage / apparent - factor * relative(voltage);
            let by_current = by_current / apparent - factor * relative(current);
            (factor, by_voltage * series + by_current, by_voltage * jw)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_derivatives_match_central_differences() {
        // Truncation and rounding of a central difference of values of order one balance near 1e-5.
        let h = 1e-5;
        let at = [c64::new(0.7, -0.4), c64::new(1.1, 0.3)];
        let impedances = [c64::new(0.5, -0.9), c64::new(0.3, 0.0)];
        for of in [
            AtTerminals::FluxLinkage,
            AtTerminals::Current,
            AtTerminals::Voltage,
            AtTerminals::Power,
            AtTerminals::PowerFactor,
        ] {
            let value = |[i, l]: [c64; 2]| function(of, 2.0, impedances, i, l);
            let (_, by_current, by_linkage) = value(at);
            for (k, slope) in [by_current, by_linkage].into_iter().enumerate() {
                for direction in [c64::new(1.0, 0.0), c64::new(0.0, 1.0)] {
                    let moved = |s: f64| {
                        let mut moved = at;
                        moved[k] += s * direction;
                        value(moved).0
                    };
                    let difference = (moved(h) - moved(-h)) / (2.0 * h);
                    let exact = 2.0 * (slope * direction).re;
                    assert!((difference - exact).abs() < 1e-9, "{of:?} {k}: {difference} {exact}");
                }
            }
        }
    }
}
