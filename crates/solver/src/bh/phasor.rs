//! A B–H law in a field that alternates, by the two axes of the ellipse that `B` runs through.
//!
//! A phasor is `B = e^{iθ}(p + iq)` with real `p` and `q` at right angles to each other, `a = |p| ≥ |q| = c`: in a period `B` passes `p`,
//! where it is largest, and `q`, where it is least. The law is held at both: `H = e^{iθ}(ν(a) p + iν(c) q)`, of which the fundamental
//! alone is kept. In a field of one direction that is the curve at the peak, `H = ν(|B|)B`; in one that turns, of constant size, it is
//! exact.
//!
//! `a` and `c` are the singular values of the matrix `[Re B, Im B]`, and `H` is the gradient of `W = w(a) + w(c)`, which is convex as `w`
//! is and even (Lewis, J. Convex Anal. 2 (1995) 173): the derivative is symmetric over the real numbers, and positive.

use fluxmorph_geometry::directions::tangents;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, cross, dot, norm};

use super::{BhCurve, Tangent};
use crate::element::Complex3;

/// `|B·B|` over `BᴴB` below which the field turns in a circle, whose axes may be any.
const ROUND: f64 = 1e-13;

/// `(a − c)/a` below which a difference of the law is its slope.
const CLOSE: f64 = 1e-5;

/// `c/a` below which the lesser axis has any direction across the larger one.
const LINEAR: f64 = 1e-12;

/// The law at one phasor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PhasorLaw {
    /// `e^{iθ}`.
    phase: c64,
    /// Unit vectors along `p` and `q`.
    axes: [Point; 2],
    /// `p` and `q` [T].
    flux_densities: [Point; 2],
    /// `ν(a)` and `ν(c)` [m/H].
    reluctivities: [f64; 2],
    /// `h'(a)` and `h'(c)` [m/H].
    slopes: [f64; 2],
    /// `(h(a) − h(c))/(a − c)` and `(h(a) + h(c))/(a + c)` [m/H].
    across: [f64; 2],
    /// `w(a) + w(c)` [J/m³].
    energy: f64,
}

/// Real and imaginary parts.
fn parts(b: Complex3) -> [Point; 2] {
    [b.map(|c| c.re), b.map(|c| c.im)]
}

/// `B·B`, without a conjugate.
fn square(b: Complex3) -> c64 {
    b.iter().map(|c| c * c).sum()
}

/// The largest `|B|` in a period [T].
pub fn peak(b: Complex3) -> f64 {
    let all = b.iter().map(|c| c.norm_sqr()).sum::<f64>();
    (0.5 * (all + square(b).norm())).sqrt()
}

impl PhasorLaw {
    pub(super) fn new(curve: &BhCurve, b: Complex3) -> Self {
        let (square, all) = (square(b), b.iter().map(|c| c.norm_sqr()).sum::<f64>());
        let phase =
            if square.norm() > ROUND * all { (square / square.norm()).sqrt() } else { c64::from(1.0) };
        let [p, q] = parts(b.map(|c| phase.conj() * c));
        let a = norm(p);
        let first = if a > 0.0 { p.map(|x| x / a) } else { [1.0, 0.0, 0.0] };
        // At right angles but for rounding.
        let rest: Point = std::array::from_fn(|d| q[d] - dot(q, first) * first[d]);
        let c = norm(rest).min(a);
        let second = if c > LINEAR * a { rest.map(|x| x / norm(rest)) } else { tangents(first).0 };
        let [at_a, at_c] = [a, c].map(|size| curve.at(size));
        let reluctivities = [curve.reluctivity(a, at_a), curve.reluctivity(c, at_c)];
        let difference = if a - c > CLOSE * a {
            (at_a.field_strength - at_c.field_strength) / (a - c)
        } else {
            0.5 * (at_a.slope + at_c.slope)
        };
        let sum =
            if a > 0.0 { (at_a.field_strength + at_c.field_strength) / (a + c) } else { reluctivities[0] };
        Self {
            phase,
            axes: [first, second],
            flux_densities: [p, q],
            reluctivities,
            slopes: [at_a.slope, at_c.slope],
            across: [difference, sum],
            energy: at_a.energy + at_c.energy,
        }
    }

    /// `W` [J/m³]: twice its mean over a period.
    pub(crate) fn energy(&self) -> f64 {
        self.energy
    }

    /// `H` [A/m].
    pub(crate) fn field_strength(&self) -> Complex3 {
        let [(nu_a, p), (nu_c, q)] = [0, 1].map(|k| (self.reluctivities[k], self.flux_densities[k]));
        std::array::from_fn(|d| self.phase * c64::new(nu_a * p[d], nu_c * q[d]))
    }

    /// `dH` of a `dB`.
    pub(crate) fn derivative(&self, of: Complex3) -> Complex3 {
        let [first, second] = self.axes;
        let third = cross(first, second);
        let changes = parts(of.map(|c| self.phase.conj() * c));
        // By axis, for the real and the imaginary part.
        let [x, y, z] = [first, second, third].map(|axis| changes.map(|change| dot(axis, change)));
        let ([along, across], [nu_a, nu_c]) = (self.slopes, self.reluctivities);
        let (even, odd) = (0.5 * self.across[0] * (x[1] + y[0]), 0.5 * self.across[1] * (x[1] - y[0]));
        let x = [along * x[0], even + odd];
        let y = [even - odd, across * y[1]];
        let z = [nu_a * z[0], nu_c * z[1]];
        std::array::from_fn(|d| {
            let part = |k: usize| x[k] * first[d] + y[k] * second[d] + z[k] * third[d];
            self.phase * c64::new(part(0), part(1))
        })
    }

    /// The `L` with `Re(L·dB) = Re(of·dH)` for every `dB`: the derivative is symmetric over the real numbers.
    pub(crate) fn adjoint(&self, of: Complex3) -> Complex3 {
        self.derivative(of.map(|c| c.conj())).map(|c| c.conj())
    }

    /// The real tensor that is nearest to the derivative [m/H]: the real part of its mean over the phases of `dB`.
    pub(crate) fn mean(&self) -> Tangent {
        let [first, second] = self.axes;
        let third = cross(first, second);
        let mixed = 0.5 * (self.across[0] + self.across[1]);
        let along = [
            0.5 * (self.slopes[0] + mixed),
            0.5 * (mixed + self.slopes[1]),
            0.5 * (self.reluctivities[0] + self.reluctivities[1]),
        ];
        let axes = [first, second, third];
        std::array::from_fn(|i| {
            std::array::from_fn(|j| (0..3).map(|k| along[k] * axes[k][i] * axes[k][j]).sum())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bh::{Analytic, Knee};
    use crate::material::VACUUM_PERMEABILITY;

    fn curve() -> BhCurve {
        let point = |i: i32| {
            let h = 20.0 * (1.3_f64.powi(i) - 1.0);
            [h, VACUUM_PERMEABILITY * h + 1.8 * (1.0 - (-h / 700.0).exp())]
        };
        BhCurve::new(&(0..32).map(point).collect::<Vec<_>>()).expect("a sound table")
    }

    const I: c64 = c64::new(0.0, 1.0);

    fn fields() -> Vec<Complex3> {
        let (re, im) = (c64::from, |x: f64| I * x);
        vec![
            [c64::new(0.8, 0.1), c64::new(-0.3, 0.9), c64::new(0.2, -0.7)],
            [c64::new(1.4, -0.6), c64::new(0.5, 0.3), c64::new(-1.1, 0.2)],
            [re(1e-5), im(1e-5), re(0.0)],
            // In one direction, in a circle, nearly so, and none.
            [c64::new(0.9, 1.1), c64::new(0.45, 0.55), re(0.0)],
            [re(1.6), im(1.6), re(0.0)],
            [re(1.6), im(1.6 - 1e-6), re(0.0)],
            [re(1.6), im(1e-9), re(0.2)],
            [re(0.0); 3],
        ]
    }

    /// What a field of one direction loses by the law where `H` is given: the fundamental of `B`, and the mean of its square.
    #[test]
    fn beyond_the_knee_an_alternating_field_has_a_larger_fundamental_and_mean_square_than_the_law() {
        let curve = BhCurve::analytic(Analytic::new(1000.0, 2.0, Knee::Sharp).expect("a law"));
        let at_knee = 2.0 / (999.0 * VACUUM_PERMEABILITY);
        let inverse = |h: f64| {
            let (mut low, mut high) = (0.0, 10.0);
            for _ in 0..60 {
                let b = 0.5 * (low + high);
                if curve.at(b).field_strength < h { low = b } else { high = b }
            }
            low
        };
        let ratios = |times: f64| {
            const PHASES: usize = 2000;
            let peak = inverse(times * at_knee);
            let phases = (0..PHASES).map(|k| std::f64::consts::PI * (k as f64 + 0.5) / PHASES as f64);
            let wave = phases.map(|t| (t.sin(), inverse(times * at_knee * t.sin())));
            let [fundamental, square] = wave.fold([0.0, 0.0], |[f, s], (sine, b)| [f + b * sine, s + b * b]);
            [2.0 * fundamental / peak, 2.0 * square / (peak * peak)].map(|sum| sum / PHASES as f64)
        };
        for (times, [fundamental, square]) in [0.1, 3.0, 30.0].map(|times| (times, ratios(times))) {
            println!(
                "{times} times the field at the knee: fundamental {fundamental:.3}, mean square {square:.3}"
            );
        }
        assert!(ratios(0.1).iter().all(|ratio| (ratio - 1.0).abs() < 0.01), "{:?}", ratios(0.1));
        let [fundamental, square] = ratios(30.0);
        assert!((1.2..4.0 / std::f64::consts::PI).contains(&fundamental) && (1.8..2.0).contains(&square));
    }

    #[test]
    fn one_direction_has_the_curve_at_its_peak_and_a_circle_the_curve_at_its_radius() {
        let curve = curve();
        let turned = c64::from_polar(1.0, 0.7);
        let of = |b: Complex3| PhasorLaw::new(&curve, b);
        for (b, size) in [
            ([turned * 1.2, turned * 0.9, c64::default()], 1.5),
            ([turned * 1.5, turned * I * 1.5, c64::default()], 1.5),
        ] {
            let law = of(b);
            let h = law.field_strength();
            let expected = curve.at(size).field_strength / size;
            for (h, b) in h.iter().zip(b) {
                assert!((h - expected * b).norm() < 1e-9 * expected, "{h} {}", expected * b);
            }
            assert!((peak(b) - size).abs() < 1e-12, "{}", peak(b));
        }
        // In a circle |B| is the radius all the time, in one direction its square half the time.
        let circle = of([c64::from(1.5), I * 1.5, c64::default()]).energy();
        assert!((circle - 2.0 * curve.at(1.5).energy).abs() < 1e-12 * circle);
    }

    #[test]
    fn the_law_is_the_gradient_of_its_energy_and_the_derivative_that_of_the_law() {
        let curve = curve();
        let changes = [
            [c64::new(0.3, -0.8), c64::new(0.6, 0.2), c64::new(-0.5, 0.4)],
            [c64::new(-0.2, 0.5), c64::new(0.9, -0.1), c64::new(0.3, 0.7)],
        ];
        let work = |l: Complex3, h: Complex3| (0..3).map(|d| (l[d].conj() * h[d]).re).sum::<f64>();
        for b in fields() {
            let law = PhasorLaw::new(&curve, b);
            let moved = |s: f64, change: Complex3| {
                PhasorLaw::new(&curve, std::array::from_fn(|d| b[d] + s * change[d]))
            };
            let derivatives = changes.map(|change| law.derivative(change));
            for (change, found) in changes.into_iter().zip(derivatives) {
                let (plus, minus) = (moved(1e-7, change), moved(-1e-7, change));
                let size = found.iter().map(|c| c.norm()).fold(0.0, f64::max);
                for d in 0..3 {
                    let difference = (plus.field_strength()[d] - minus.field_strength()[d]) / 2e-7;
                    // Truncation and rounding of central differences.
                    assert!(
                        (difference - found[d]).norm() < 1e-5 * size,
                        "{b:?} {d}: {difference} {}",
                        found[d]
                    );
                }
                let (plus, minus) = (moved(1e-4, change), moved(-1e-4, change));
                let difference = (plus.energy() - minus.energy()) / 2e-4;
                let slope = work(law.field_strength(), change);
                // Of second order, and of a curve with kinks in its second derivative.
                assert!((difference - slope).abs() < 1e-4 * size, "{b:?}: {difference} {slope}");
                assert!(work(change, found) > 0.0, "{b:?}");
            }
            let [ahead, back] = [work(changes[1], derivatives[0]), work(changes[0], derivatives[1])];
            assert!((ahead - back).abs() < 1e-12 * work(changes[0], derivatives[0]), "{b:?}: {ahead} {back}");
        }
    }

    #[test]
    fn the_mean_of_the_derivative_is_that_over_the_phases_of_the_change() {
        let law = PhasorLaw::new(&curve(), fields()[1]);
        let mean = law.mean();
        for j in 0..3 {
            let unit: Complex3 = std::array::from_fn(|d| c64::from(f64::from(u8::from(d == j))));
            let (real, imaginary) = (law.derivative(unit), law.derivative(unit.map(|c| I * c)));
            for i in 0..3 {
                let expected = 0.5 * (real[i].re + imaginary[i].im);
                assert!((mean[i][j] - expected).abs() < 1e-12 * mean[j][j].abs(), "{i} {j}");
            }
        }
    }
}
