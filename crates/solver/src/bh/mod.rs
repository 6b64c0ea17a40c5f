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
