//! The trust region of a search: a box around its first design in which the method may look.
//!
//! It is the box of the bounds, until designs in it are refused: then a share of it around the best design.

use crate::problem::Shape;

/// A variable nearer to a bound than this share of its span is on it: far below any step, and above rounding.
const ON_BOUND: f64 = 1e-9;

/// The trust region of a search.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TrustRegion {
    /// The design at its centre [m].
    centre: Vec<f64>,
    /// How far every variable may go, as a share of the largest distance of a variable to its lower or upper bound.
    pub(super) scale: f64,
}

impl TrustRegion {
    /// That share of the bounds around a design.
    pub(super) fn new(centre: Vec<f64>, scale: f64) -> Self {
        Self { centre, scale }
    }

    /// Lower and upper bounds of the variables in it [m].
    pub(super) fn bounds(&self, shape: &Shape) -> [Vec<f64>; 2] {
        [shape.lower(), shape.upper()].map(|bounds| {
            let pairs = || bounds.iter().zip(&self.centre);
            let largest = pairs().fold(0.0_f64, |largest, (b, c)| largest.max((b - c).abs()));
            let distance = self.scale * largest;
            // The whole distance is the bound itself, to the last bit.
            let to = |(bound, centre): (&f64, &f64)| {
                if self.scale < 1.0 && distance < (bound - centre).abs() {
                    centre + distance.copysign(bound - centre)
                } else {
                    *bound
                }
            };
            pairs().map(to).collect()
        })
    }

    /// Whether a variable is on the boundary of the trust region that is no bound of the design.
    pub(super) fn holds_back(&self, shape: &Shape, p: &[f64]) -> bool {
        let [lower, upper] = self.bounds(shape);
        (0..p.len()).any(|k| {
            let near = ON_BOUND * (shape.upper()[k] - shape.lower()[k]);
            let on = |bound: f64, own: f64| (p[k] - bound).abs() <= near && (bound - own).abs() > near;
            on(lower[k], shape.lower()[k]) || on(upper[k], shape.upper()[k])
        })
    }
}
