//! B–H laws: `H` as a function of `B` for isotropic material that saturates.
//!
//! `H = h(|B|) B/|B|` with `h` increasing, so that the energy density `w(b) = ∫₀ᵇ h` is convex in `B` and its tangent
//! `∂H/∂B = h/b I + (h' − h/b) B Bᵀ/b²` positive definite. Here: what laws have in common. A `table` of points is one, two closed
//! forms (`analytic`) are others; what becomes of them in a field that alternates is in `phasor`.

mod analytic;
mod phasor;
mod table;

use fluxmorph_geometry::tet4::{Point, dot};

pub use analytic::{Analytic, Knee};
pub(crate) use phasor::PhasorLaw;
pub use phasor::peak;
pub use table::BhFault;
use table::Table;

use crate::element::Complex3;

/// A symmetric `∂H/∂B` [m/H].
pub type Tangent = [[f64; 3]; 3];

/// A B–H law.
#[derive(Clone, Debug, PartialEq)]
pub struct BhCurve(Law);

/// What a law is made of.
#[derive(Clone, Debug, PartialEq)]
enum Law {
    Table(Table),
    Analytic(Analytic),
}

/// A law at one `b = |B|`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BhPoint {
    /// `h` [A/m].
    pub field_strength: f64,
    /// `h'` [m/H].
    pub slope: f64,
    /// `w` [J/m³].
    pub energy: f64,
}

/// How many times the least slope `dH/dB` the slope at the knee is.
const BEYOND_KNEE: f64 = 10.0;

/// Where the knee of a closed form is looked for [T]: beyond all magnetic materials.
const HIGHEST: f64 = 20.0;

impl BhCurve {
    /// From points `[H, B]` [A/m, T]; the origin may be among them.
    ///
    /// # Errors
    /// The number of the point at fault, from zero, and what is wrong with it.
    pub fn new(points: &[[f64; 2]]) -> Result<Self, (usize, BhFault)> {
        Ok(Self(Law::Table(Table::new(points)?)))
    }

    /// A closed form.
    pub fn analytic(law: Analytic) -> Self {
        Self(Law::Analytic(law))
    }

    /// The law at `b = |B|` [T], not negative.
    #[inline]
    pub fn at(&self, b: f64) -> BhPoint {
        match &self.0 {
            Law::Table(table) => table.at(b),
            Law::Analytic(law) => law.at(b),
        }
    }

    /// `H` [A/m] of a flux density [T].
    #[inline]
    pub fn field_strength(&self, b: Point) -> Point {
        let size = dot(b, b).sqrt();
        let reluctivity = self.reluctivity(size, self.at(size));
        b.map(|b| reluctivity * b)
    }

    /// `∂H/∂B` [m/H] at a flux density [T].
    #[inline]
    pub fn tangent(&self, b: Point) -> Tangent {
        let size = dot(b, b).sqrt();
        let at = self.at(size);
        let reluctivity = self.reluctivity(size, at);
        let along = if size > 0.0 { (at.slope - reluctivity) / (size * size) } else { 0.0 };
        std::array::from_fn(|i| {
            std::array::from_fn(|j| along * b[i] * b[j] + if i == j { reluctivity } else { 0.0 })
        })
    }

    /// The law at a phasor [T].
    #[inline]
    pub(crate) fn phasor(&self, b: Complex3) -> PhasorLaw {
        PhasorLaw::new(self, b)
    }

    /// `h/b`; at zero its limit.
    #[inline]
    fn reluctivity(&self, size: f64, at: BhPoint) -> f64 {
        if size > 0.0 { at.field_strength / size } else { self.initial_slope() }
    }

    /// `h'` at zero [m/H].
    fn initial_slope(&self) -> f64 {
        match &self.0 {
            Law::Table(table) => table.initial_slope(),
            Law::Analytic(law) => law.at(0.0).slope,
        }
    }

    /// The largest `B/(μ0 H)`; of a table that of its points.
    pub fn largest_permeability(&self) -> f64 {
        match &self.0 {
            Law::Table(table) => table.largest_permeability(),
            Law::Analytic(law) => law.permeability(),
        }
    }

    /// The last point `[H, B]` [A/m, T] of a table; a closed form has no end.
    pub fn end(&self) -> Option<[f64; 2]> {
        match &self.0 {
            Law::Table(table) => Some(table.end()),
            Law::Analytic(_) => None,
        }
    }

    /// The `B` [T] above which the differential permeability is less than a tenth of its largest; of a table of the largest at its
    /// points, and its last point where it is nowhere less. `None` where there is none.
    pub fn knee(&self) -> Option<f64> {
        let (largest, [mut low, mut high]) = match &self.0 {
            Law::Table(table) => table.around_knee(),
            Law::Analytic(law) => (law.at(0.0).slope, [0.0, HIGHEST]),
        };
        let limit = BEYOND_KNEE * largest;
        if low < high && self.at(high).slope <= limit {
            return None;
        }
        while high - low > 1e-9 {
            let middle = 0.5 * (low + high);
            if self.at(middle).slope <= limit { low = middle } else { high = middle }
        }
        Some(high)
    }

    /// The first point `[H, B]` [A/m, T] of a table where the polarisation `B − μ0 H` is more than a hundredth less than before it, which
    /// no magnetic material has; `None` where there is none.
    pub fn falling_polarisation(&self) -> Option<[f64; 2]> {
        match &self.0 {
            Law::Table(table) => table.falling_polarisation(),
            Law::Analytic(_) => None,
        }
    }

    /// Whether it goes on beyond its end as it comes there: a table that ends at less than twice the permeability of vacuum,
    /// `ΔB/ΔH < 2 μ0`.
    pub fn ends_saturated(&self) -> bool {
        match &self.0 {
            Law::Table(table) => table.ends_saturated(),
            Law::Analytic(_) => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::VACUUM_PERMEABILITY;

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
