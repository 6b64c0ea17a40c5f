//! Two laws in closed form, of an initial permeability `μ` and a saturation polarisation `J`: at all fields
//! `B = μ0 H + J y(H)` with `y` from 0 to 1.
//!
//! * Sharp knee: `y` is the smaller root of `(1 − a) y² − (1 + u) y + u = 0`, `u = μ0 (μ − 1) H/J`: `min(u, 1)`, a straight line up
//!   to saturation, with its corner rounded over a part `a` of it (the "analytic saturation with knee adjustment" of Altair Flux,
//!   user's guide, chapter on materials). Its inverse is the root of a quadratic equation as well.
//! * Arctangent: `y = (2/π) atan(π u/2)` (Brauer, IEEE Trans. Magn. 11 (1975) 81, has the like); inverted by Newton's method, which
//!   comes from below and never overshoots as `B` is concave in `H`.

use std::f64::consts::PI;

use super::BhPoint;
use crate::material::VACUUM_PERMEABILITY;

/// The part of a straight line that its rounded corner takes.
const CORNER: f64 = 0.05;

/// Newton steps of an inversion: a dozen are usual.
const MOST_STEPS: usize = 100;

/// How a law comes to saturation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Knee {
    /// Straight up to it.
    Sharp,
    /// Along an arctangent.
    Arctangent,
}

/// A law in closed form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Analytic {
    permeability: f64,
    polarisation: f64,
    knee: Knee,
}

impl Analytic {
    /// From the initial relative permeability, above 1, and the saturation polarisation [T], above 0; `None` for others.
    pub fn new(permeability: f64, polarisation: f64, knee: Knee) -> Option<Self> {
        let is_sound =
            permeability > 1.0 && polarisation > 0.0 && permeability.is_finite() && polarisation.is_finite();
        is_sound.then_some(Self { permeability, polarisation, knee })
    }

    /// The initial relative permeability, the largest one.
    pub(super) fn permeability(&self) -> f64 {
        self.permeability
    }

    /// The law at `b = |B|` [T].
    pub(super) fn at(&self, b: f64) -> BhPoint {
        match self.knee {
            Knee::Sharp => self.sharp(b),
            Knee::Arctangent => self.arctangent(b),
        }
    }

    /// `u/H` [m/A].
    fn scale(&self) -> f64 {
        VACUUM_PERMEABILITY * (self.permeability - 1.0) / self.polarisation
    }

    fn sharp(&self, b: f64) -> BhPoint {
        let (c, j, k, mu) = (self.scale(), self.polarisation, 1.0 - CORNER, VACUUM_PERMEABILITY);
        // (c J + k μ0) y² − (c b + c J + μ0) y + c b = 0.
        let (square, linear) = (c * j + k * mu, c * b + c * j + mu);
        let root = (linear * linear - 4.0 * square * c * b).sqrt();
        let y = 2.0 * c * b / (linear + root);
        // Each where it does not cancel.
        let h = if y < 0.5 { y * (1.0 - k * y) / (c * (1.0 - y)) } else { (b - j * y) / mu };
        let slope = (1.0 - j * c * (1.0 - y) / root) / mu;
        // ∫H dy.
        let area = (0.5 * k * y * y - CORNER * y - CORNER * (-y).ln_1p()) / c;
        let energy = h * b - 0.5 * mu * h * h - j * (y * h - area);
        BhPoint { field_strength: h, slope, energy }
    }

    fn arctangent(&self, b: f64) -> BhPoint {
        let (j, mu) = (self.polarisation, VACUUM_PERMEABILITY);
        let half = 2.0 / (PI * self.scale());
        let of = |h: f64| mu * h + 2.0 * j / PI * (h / half).atan();
        let slope = |h: f64| mu + mu * (self.permeability - 1.0) / (1.0 + (h / half).powi(2));
        let mut h = (b / (mu * self.permeability)).max((b - j) / mu);
        for _ in 0..MOST_STEPS {
            let step = (b - of(h)) / slope(h);
            h += step;
            if step.abs() <= 1e-15 * h {
                break;
            }
        }
        let coenergy = 0.5 * mu * h * h
            + 2.0 * j / PI * (h * (h / half).atan() - 0.5 * half * (h / half).powi(2).ln_1p());
        BhPoint { field_strength: h, slope: 1.0 / slope(h), energy: h * b - coenergy }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bh::BhCurve;

    fn laws() -> [Analytic; 3] {
        [(1000.0, 2.1, Knee::Sharp), (1000.0, 2.1, Knee::Arctangent), (5.0, 0.4, Knee::Sharp)]
            .map(|(permeability, j, knee)| Analytic::new(permeability, j, knee).expect("a sound law"))
    }

    #[test]
    fn the_inverse_is_that_of_the_law_from_the_foot_to_far_beyond_saturation() {
        for law in laws() {
            let (j, mu) = (law.polarisation, VACUUM_PERMEABILITY);
            for i in 1..400 {
                let b = 0.01 * f64::from(i);
                let BhPoint { field_strength: h, .. } = law.at(b);
                let u = law.scale() * h;
                let y = match law.knee {
                    Knee::Arctangent => 2.0 / PI * (0.5 * PI * u).atan(),
                    Knee::Sharp => {
                        let k = 1.0 - CORNER;
                        2.0 * u / (1.0 + u + ((1.0 + u).powi(2) - 4.0 * k * u).sqrt())
                    }
                };
                assert!(((mu * h + j * y) / b - 1.0).abs() < 1e-10, "{law:?} {b}: {h}");
            }
        }
    }

    #[test]
    fn slope_and_energy_are_derivative_and_integral_and_the_slope_grows() {
        for law in laws() {
            let mut before = 0.0;
            for i in 1..300 {
                let (b, step) = (0.01 * f64::from(i), 1e-5);
                let [low, at, high] = [b - step, b, b + step].map(|b| law.at(b));
                // Truncation of central differences at the corner, rounding elsewhere.
                let slope = (high.field_strength - low.field_strength) / (2.0 * step);
                assert!((slope / at.slope - 1.0).abs() < 2e-3, "{law:?} {b}: {slope} {}", at.slope);
                let field = (high.energy - low.energy) / (2.0 * step);
                assert!((field / at.field_strength - 1.0).abs() < 1e-4, "{law:?} {b}: {field}");
                assert!(at.slope >= before * (1.0 - 1e-9), "convex");
                before = at.slope;
            }
        }
    }

    #[test]
    fn the_ends_are_the_permeability_and_that_of_vacuum_and_the_knee_lies_between() {
        for law in laws() {
            let initial = 1.0 / (VACUUM_PERMEABILITY * law.permeability);
            assert!((law.at(0.0).slope / initial - 1.0).abs() < 1e-9, "{law:?}");
            assert!((law.at(200.0).slope * VACUUM_PERMEABILITY - 1.0).abs() < 1e-3, "{law:?}");
            let curve = BhCurve::analytic(law);
            assert_eq!((curve.end(), curve.ends_saturated()), (None, true));
            match curve.knee() {
                // Its differential permeability falls from five to one.
                None => assert_eq!(law.permeability, 5.0),
                Some(knee) => {
                    assert!(knee > 0.4 * law.polarisation && knee < 1.1 * law.polarisation, "{knee}")
                }
            }
        }
        assert_eq!(Analytic::new(1.0, 2.0, Knee::Sharp), None);
        assert_eq!(Analytic::new(100.0, 0.0, Knee::Sharp), None);
    }
}
