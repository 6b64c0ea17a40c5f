//! A table of points `(H_i, B_i)` as a law: a monotone cubic in `b` with a continuous derivative.
//!
//! Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980) 238: slopes of parabolas through three points, reduced into the circle of
//! radius 3. At zero the slope is that of the odd continuation, so that the initial permeability is the table's. Beyond the last
//! point the material is saturated: `h = H_N + (b − B_N)/μ0`; the slope is continuous there where the table ends at less than
//! twice the permeability of vacuum ([`Table::ends_saturated`]).

use super::{BEYOND_KNEE, BhPoint};
use crate::material::VACUUM_PERMEABILITY;

/// A monotone table of `H` over `B`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Table {
    /// `B_i` [T], from zero.
    flux_density: Vec<f64>,
    /// `H_i` [A/m].
    field_strength: Vec<f64>,
    /// `h'(B_i)` [m/H].
    slope: Vec<f64>,
    /// `w(B_i)` [J/m³].
    energy: Vec<f64>,
}

/// Why a table is no B–H law.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BhFault {
    /// A table of one point or none.
    #[error("the table has too few points: a curve takes two beside the origin")]
    TooFew,
    /// Infinite, or no number.
    #[error("the point H = {h} A/m, B = {b} T is not finite")]
    NotFinite {
        /// `H` [A/m].
        h: f64,
        /// `B` [T].
        b: f64,
    },
    /// Only the first quadrant is given.
    #[error("the point H = {h} A/m, B = {b} T has a negative number: a table starts at the origin")]
    Negative {
        /// `H` [A/m].
        h: f64,
        /// `B` [T].
        b: f64,
    },
    /// `H` repeats or falls.
    #[error("the field strength {h} A/m does not increase: the point before has {before} A/m")]
    FieldStrength {
        /// `H` [A/m].
        h: f64,
        /// That of the point before, or of the origin.
        before: f64,
    },
    /// `B` repeats or falls.
    #[error("the flux density {b} T does not increase: the point before has {before} T")]
    FluxDensity {
        /// `B` [T].
        b: f64,
        /// That of the point before, or of the origin.
        before: f64,
    },
    /// Less than in vacuum.
    #[error(
        "the flux density {b} T at {h} A/m is less than in vacuum ({vacuum:.3e} T): a point is H [A/m], then B [T]"
    )]
    BelowVacuum {
        /// `H` [A/m].
        h: f64,
        /// `B` [T].
        b: f64,
        /// `μ0 H` [T].
        vacuum: f64,
    },
    /// More than any material has.
    #[error(
        "the flux density {b} T at {h} A/m is beyond any material: a relative permeability of {relative:.1e}, or \
         B − μ0 H above 10 T"
    )]
    BeyondIron {
        /// `H` [A/m].
        h: f64,
        /// `B` [T].
        b: f64,
        /// `B/(μ0 H)`.
        relative: f64,
    },
}

/// Largest relative permeability `B/(μ0 H)` of a table: ten times that of the softest alloys.
const LARGEST_PERMEABILITY: f64 = 1e7;

/// Largest polarisation `B − μ0 H` of a table [T]: four times that of iron and cobalt. More is another unit.
const LARGEST_POLARISATION: f64 = 10.0;

/// Share of the largest polarisation below which a table's falls: the digits of measured ones leave less.
const FALLING: f64 = 0.99;

/// Polarisation [T] of which nothing is said: that of a vacuum with its digits.
const LEAST_POLARISATION: f64 = 0.01;

impl Table {
    /// From points `[H, B]` [A/m, T]; the origin may be among them.
    ///
    /// # Errors
    /// The number of the point at fault, from zero, and what is wrong with it.
    pub(super) fn new(points: &[[f64; 2]]) -> Result<Self, (usize, BhFault)> {
        let skipped = usize::from(points.first() == Some(&[0.0, 0.0]));
        let (mut flux_density, mut field_strength) = (vec![0.0], vec![0.0]);
        for (row, &[h, b]) in points.iter().enumerate().skip(skipped) {
            let before = [field_strength[field_strength.len() - 1], flux_density[flux_density.len() - 1]];
            check([h, b], before).map_err(|fault| (row, fault))?;
            flux_density.push(b);
            field_strength.push(h);
        }
        if flux_density.len() < 3 {
            return Err((points.len().saturating_sub(1), BhFault::TooFew));
        }
        let slope = slopes(&flux_density, &field_strength);
        let mut curve = Self { energy: vec![0.0], flux_density, field_strength, slope };
        for i in 1..curve.flux_density.len() {
            let energy = curve.within(i - 1, curve.flux_density[i]).energy;
            curve.energy.push(energy);
        }
        Ok(curve)
    }

    /// The law at `b = |B|` [T], not negative.
    #[inline]
    pub(super) fn at(&self, b: f64) -> BhPoint {
        let last = self.flux_density.len() - 1;
        let beyond = b - self.flux_density[last];
        if beyond >= 0.0 {
            let (h, reluctivity) = (self.field_strength[last], 1.0 / VACUUM_PERMEABILITY);
            return BhPoint {
                field_strength: h + beyond * reluctivity,
                slope: reluctivity,
                energy: self.energy[last] + beyond * (h + 0.5 * beyond * reluctivity),
            };
        }
        self.within(self.flux_density.partition_point(|&start| start <= b).saturating_sub(1), b)
    }

    /// Length of interval `i` [T], and the coefficients of `s²` and `s³` of its cubic over that length, `s` from 0 to 1.
    #[inline]
    fn cubic(&self, i: usize) -> (f64, [f64; 2]) {
        let length = self.flux_density[i + 1] - self.flux_density[i];
        let secant = (self.field_strength[i + 1] - self.field_strength[i]) / length;
        let (m, n) = (self.slope[i], self.slope[i + 1]);
        (length, [3.0 * secant - 2.0 * m - n, m + n - 2.0 * secant])
    }

    /// The cubic of interval `i`.
    #[inline]
    fn within(&self, i: usize, b: f64) -> BhPoint {
        let (length, [square, cube]) = self.cubic(i);
        let (start, m) = (self.field_strength[i], self.slope[i]);
        let s = (b - self.flux_density[i]) / length;
        BhPoint {
            field_strength: start + length * s * (m + s * (square + s * cube)),
            slope: m + s * (2.0 * square + 3.0 * s * cube),
            energy: self.energy[i]
                + length * s * (start + length * s * (m / 2.0 + s * (square / 3.0 + s * cube / 4.0))),
        }
    }

    /// `h'` at zero [m/H].
    pub(super) fn initial_slope(&self) -> f64 {
        self.slope[0]
    }

    /// The largest `B/(μ0 H)` of the table's points.
    pub(super) fn largest_permeability(&self) -> f64 {
        let points = self.flux_density.iter().zip(&self.field_strength).skip(1);
        points.map(|(b, h)| b / (VACUUM_PERMEABILITY * h)).fold(0.0, f64::max)
    }

    /// The last point `[H, B]` [A/m, T].
    pub(super) fn end(&self) -> [f64; 2] {
        let last = self.flux_density.len() - 1;
        [self.field_strength[last], self.flux_density[last]]
    }

    /// The least slope `dH/dB` [m/H] at a point, and the `B` [T] of the last place where it is no more than [`BEYOND_KNEE`] of that, and of
    /// one behind, of the points and of those between two where the slope is least.
    pub(super) fn around_knee(&self) -> (f64, [f64; 2]) {
        let least = self.slope.iter().copied().fold(f64::INFINITY, f64::min);
        let between = |i: usize| {
            let (length, [square, cube]) = self.cubic(i);
            let s = -square / (3.0 * cube);
            (cube > 0.0 && s > 0.0 && s < 1.0).then_some(self.flux_density[i] + s * length)
        };
        let last = self.flux_density.len() - 1;
        let places = |i: usize| [Some(self.flux_density[i]), between(i)].into_iter().flatten();
        let mut places: Vec<f64> = (0..last).flat_map(places).collect();
        places.push(self.flux_density[last]);
        let is_soft = |&b: &f64| self.at(b).slope <= BEYOND_KNEE * least;
        let low = places.iter().rposition(is_soft).expect("the least is no more than ten times itself");
        (least, [places[low], places[(low + 1).min(places.len() - 1)]])
    }

    /// The first point `[H, B]` where the polarisation is [`FALLING`] of the most before it, or less.
    pub(super) fn falling_polarisation(&self) -> Option<[f64; 2]> {
        let mut most = 0.0;
        let mut points = self.field_strength.iter().zip(&self.flux_density);
        let found = points.find(|&(h, b)| {
            let polarisation = b - VACUUM_PERMEABILITY * h;
            most = f64::max(most, polarisation);
            most > LEAST_POLARISATION && polarisation < FALLING * most
        });
        found.map(|(&h, &b)| [h, b])
    }

    /// Whether the table ends at less than twice the permeability of vacuum, `ΔB/ΔH < 2 μ0`.
    pub(super) fn ends_saturated(&self) -> bool {
        let last = self.flux_density.len() - 1;
        ends_saturated(
            (self.field_strength[last] - self.field_strength[last - 1])
                / (self.flux_density[last] - self.flux_density[last - 1]),
        )
    }
}

/// By the last secant `ΔH/ΔB` [m/H].
fn ends_saturated(secant: f64) -> bool {
    secant * 2.0 * VACUUM_PERMEABILITY > 1.0
}

fn check([h, b]: [f64; 2], before: [f64; 2]) -> Result<(), BhFault> {
    let vacuum = VACUUM_PERMEABILITY * h;
    if !(h.is_finite() && b.is_finite()) {
        return Err(BhFault::NotFinite { h, b });
    }
    if h < 0.0 || b < 0.0 {
        return Err(BhFault::Negative { h, b });
    }
    if h <= before[0] {
        return Err(BhFault::FieldStrength { h, before: before[0] });
    }
    if b <= before[1] {
        return Err(BhFault::FluxDensity { b, before: before[1] });
    }
    if b < vacuum {
        return Err(BhFault::BelowVacuum { h, b, vacuum });
    }
    let relative = b / vacuum;
    if relative > LARGEST_PERMEABILITY || b - vacuum > LARGEST_POLARISATION {
        return Err(BhFault::BeyondIron { h, b, relative });
    }
    Ok(())
}

/// Slopes of a monotone cubic at its points.
fn slopes(b: &[f64], h: &[f64]) -> Vec<f64> {
    let last = b.len() - 1;
    let length = |i: usize| b[i + 1] - b[i];
    let secants: Vec<f64> = (0..last).map(|i| (h[i + 1] - h[i]) / length(i)).collect();
    let inner = |i: usize| {
        let (left, right) = (length(i - 1), length(i));
        (right * secants[i - 1] + left * secants[i]) / (left + right)
    };
    // The odd continuation has the first secant on both sides of zero.
    let mut slopes: Vec<f64> = vec![secants[0]];
    slopes.extend((1..last).map(inner));
    let is_joined = ends_saturated(secants[last - 1]);
    slopes.push(if is_joined { 1.0 / VACUUM_PERMEABILITY } else { secants[last - 1] });
    for (i, secant) in secants.into_iter().enumerate() {
        let (alpha, beta) = (slopes[i] / secant, slopes[i + 1] / secant);
        let radius = alpha.hypot(beta);
        if is_joined && i + 1 == last {
            // The slope at the end stays: β ≤ 2 by `ends_saturated`.
            slopes[i] = secant * alpha.min((9.0 - beta * beta).sqrt());
        } else if radius > 3.0 {
            slopes[i] = 3.0 * alpha / radius * secant;
            slopes[i + 1] = 3.0 * beta / radius * secant;
        }
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bh::BhCurve;

    /// Points of `B = μ0 H + 1.8 (1 − exp(−H/900))`.
    fn saturating(points: usize) -> Vec<[f64; 2]> {
        let h = |i: usize| 20.0 * (1.35_f64.powi(i as i32) - 1.0);
        (0..points)
            .map(|i| [h(i), VACUUM_PERMEABILITY * h(i) + 1.8 * (1.0 - (-h(i) / 900.0).exp())])
            .collect()
    }

    fn central(f: impl Fn(f64) -> f64, at: f64, step: f64) -> f64 {
        (f(at + step) - f(at - step)) / (2.0 * step)
    }

    #[test]
    fn the_curve_passes_through_its_points_and_rises_with_a_continuous_slope() {
        let points = saturating(32);
        let curve = Table::new(&points).expect("a sound table");
        assert!(curve.ends_saturated());
        for &[h, b] in &points {
            assert!((curve.at(b).field_strength - h).abs() <= 1e-12 * h);
        }
        let end = curve.end()[1];
        for i in 1..20_000 {
            let b = 1.5 * end * f64::from(i) / 20_000.0;
            let at = curve.at(b);
            assert!(at.slope > 0.0, "{b}");
            // Over a ten-thousandth of a nanotesla a continuous slope does not change by a thousandth.
            let next = curve.at(b + 1e-13);
            assert!((next.slope / at.slope - 1.0).abs() < 1e-3, "{b}");
        }
    }

    #[test]
    fn the_knee_lies_between_points_where_the_differential_permeability_is_a_tenth() {
        for points in [
            &[[100.0, 1.0], [1000.0, 1.5], [1e5, 1.7]][..],
            &[[50.0, 0.5], [90.0, 1.0], [3e3, 1.6], [4e4, 1.9]],
        ] {
            let curve = BhCurve::new(points).expect("it rises");
            let knee = curve.knee().expect("it saturates");
            assert!(points.iter().all(|[_, b]| (knee - b).abs() > 1e-3), "{knee}");
            let slope_at = |b: f64| curve.at(b).slope;
            let largest = points.iter().map(|[_, b]| slope_at(*b)).fold(slope_at(0.0), f64::min);
            assert!((slope_at(knee) / (10.0 * largest) - 1.0).abs() < 1e-6, "{knee}");
            assert!([0.01, 0.1, 0.5].iter().all(|more| slope_at(knee + more) > 10.0 * largest), "{knee}");
        }
        // One that does not saturate within its table has its end.
        let straight = BhCurve::new(&[[100.0, 1.0], [200.0, 2.0]]).expect("it rises");
        assert_eq!(straight.knee(), Some(2.0));
    }

    #[test]
    fn slope_and_energy_are_derivative_and_integral_of_the_field_strength() {
        let curve = Table::new(&saturating(24)).expect("a sound table");
        for i in 1..400 {
            let b = 0.011 * f64::from(i);
            let at = curve.at(b);
            // Truncation and rounding of central differences of smooth functions at 1e-6 T.
            let slope = central(|b| curve.at(b).field_strength, b, 1e-6);
            assert!((slope / at.slope - 1.0).abs() < 1e-4, "{b}: {slope} {}", at.slope);
            let field = central(|b| curve.at(b).energy, b, 1e-6);
            assert!((field / at.field_strength - 1.0).abs() < 1e-5, "{b}");
        }
    }

    #[test]
    fn a_straight_table_is_a_linear_material() {
        let reluctivity = 1.0 / (800.0 * VACUUM_PERMEABILITY);
        let curve = Table::new(&[0.1, 0.5, 0.7, 2.0].map(|b| [reluctivity * b, b])).expect("a sound table");
        for i in 0..200 {
            let b = 0.01 * f64::from(i);
            let at = curve.at(b);
            // Rounding.
            assert!((at.field_strength - reluctivity * b).abs() <= 1e-13 * reluctivity);
            assert!((at.slope / reluctivity - 1.0).abs() < 1e-12);
            assert!((at.energy - 0.5 * reluctivity * b * b).abs() <= 1e-13 * reluctivity);
        }
        assert!((curve.largest_permeability() - 800.0).abs() < 1e-9);
        assert!(!curve.ends_saturated());
    }

    #[test]
    fn interpolation_converges_to_the_law_of_the_points() {
        // Halving the distance of the points from a smooth odd law: slopes of second order make the cubic one of third.
        let law = |h: f64| VACUUM_PERMEABILITY * h + 1.8 * (h / 900.0).tanh();
        let worst = |n: usize| {
            let step = 4000.0 / n as f64;
            let points: Vec<[f64; 2]> = (0..=n).map(|i| step * i as f64).map(|h| [h, law(h)]).collect();
            let curve = Table::new(&points).expect("a sound table");
            let off = |i: usize| {
                let h = 3000.0 * i as f64 / 997.0;
                (curve.at(law(h)).field_strength - h).abs()
            };
            (1..997).map(off).fold(0.0, f64::max)
        };
        let order = (worst(20) / worst(40)).log2();
        assert!(order > 2.5, "{order}");
    }

    #[test]
    fn bad_tables_are_refused_at_their_row() {
        let refused = |points: &[[f64; 2]]| Table::new(points).expect_err("it is no law");
        assert_eq!(refused(&[]), (0, BhFault::TooFew));
        assert_eq!(refused(&[[0.0, 0.0], [10.0, 0.1]]), (1, BhFault::TooFew));
        let second = |point: [f64; 2]| refused(&[[100.0, 0.5], point, [1e4, 1.9]]);
        assert!(matches!(second([f64::NAN, 1.0]), (1, BhFault::NotFinite { .. })));
        assert!(matches!(second([200.0, -1.0]), (1, BhFault::Negative { .. })));
        assert!(matches!(second([100.0, 1.0]), (1, BhFault::FieldStrength { .. })));
        assert!(matches!(second([50.0, 1.0]), (1, BhFault::FieldStrength { .. })));
        assert!(matches!(second([200.0, 0.5]), (1, BhFault::FluxDensity { .. })));
        assert!(matches!(second([200.0, 0.4]), (1, BhFault::FluxDensity { .. })));
        assert!(
            matches!(second([1e6, 0.6]), (1, BhFault::BelowVacuum { .. })),
            "swapped columns, or an H in Oe"
        );
        assert!(matches!(second([200.0, 15.0]), (1, BhFault::BeyondIron { .. })), "kilogauss");
        assert!(matches!(refused(&[[0.0, 0.0], [1e-3, 0.5], [2e-3, 1.0]]), (1, BhFault::BeyondIron { .. })));
    }

    #[test]
    fn a_polarisation_falls_where_b_rises_by_less_than_vacuum_has() {
        let falling = |b: f64| {
            let points = [[0.0, 0.0], [100.0, 1.0], [500.0, 1.8], [1e5, b]];
            Table::new(&points).expect("a law").falling_polarisation()
        };
        assert_eq!(falling(1.85), Some([1e5, 1.85]));
        // What a saturated steel has, and less by what digits may leave.
        let saturated = 1.8 + VACUUM_PERMEABILITY * (1e5 - 500.0);
        assert_eq!((falling(saturated), falling(saturated - 0.01)), (None, None));
    }

    #[test]
    fn the_tangent_is_the_derivative_of_the_field_strength() {
        let curve = BhCurve::new(&saturating(24)).expect("a sound table");
        for b in [[0.3, -0.2, 0.5], [1.2, 0.9, -1.1], [2.0, 1.0, 1.5], [1e-4, 0.0, 0.0]] {
            let tangent = curve.tangent(b);
            for j in 0..3 {
                let moved = |s: f64| {
                    let mut b = b;
                    b[j] += s;
                    curve.field_strength(b)
                };
                for i in 0..3 {
                    let difference = central(|s| moved(s)[i], 0.0, 1e-7);
                    assert!((difference - tangent[i][j]).abs() < 1e-4 * tangent[0][0].abs(), "{b:?} {i} {j}");
                }
            }
        }
        // At zero the material is linear, with the slope of the first two points.
        let [h, b] = saturating(24)[1];
        assert_eq!(curve.tangent([0.0; 3])[1], [0.0, h / b, 0.0]);
        assert_eq!(curve.field_strength([0.0; 3]), [0.0; 3]);
    }
}
