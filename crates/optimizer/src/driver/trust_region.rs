//! The box a method may search in during a round: how far the mesh of the round can be trusted.
//!
//! The mesh carries a motion of all variables towards their upper bounds up to some share, within
//! [`fluxmorph_remesh::StepLimits::inversion_share`] of the first inversion. That share of the longest of these ways is how far
//! every variable may go up, though never beyond its bound; down likewise. A variable that lies on its bound already asks
//! nothing of the mesh, and one that is near it may go there. Without rounds the box is that of the bounds, since no other
//! reference can be had. Designs inside the box may still be refused one by one; then `scale` makes it smaller.

use fluxmorph_remesh::RemeshError;

use crate::problem::Shape;

/// Of its span, a variable nearer than this to a bound lies on it: far below any step, and above rounding.
const ON_BOUND: f64 = 1e-9;

/// A box reaches at least this share of the longest way: methods need room, and designs in it may still be refused.
const LEAST_REACH: f64 = 1e-3;

/// A box around the first design of a round.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TrustRegion {
    /// The design in its middle [m].
    centre: Vec<f64>,
    /// Longest way of a variable to its lower and to its upper bound [m].
    ways: [f64; 2],
    /// Shares of these ways that the mesh carries.
    reach: [f64; 2],
    /// Both are multiplied by it.
    pub(super) scale: f64,
}

impl TrustRegion {
    /// The box of the present round around a design.
    ///
    /// # Errors
    /// As [`fluxmorph_remesh::ElasticMap::linear`].
    pub(super) fn new(shape: &Shape, centre: &[f64], scale: f64) -> Result<Self, RemeshError> {
        let towards =
            |bounds: &[f64]| -> Vec<f64> { bounds.iter().zip(centre).map(|(b, c)| b - c).collect() };
        let changes = [towards(shape.lower()), towards(shape.upper())];
        let reach = |change: &[f64]| -> Result<f64, RemeshError> {
            if shape.limits.rounds == 0 {
                return Ok(1.0);
            }
            let step = shape.motion().map().linear(&shape.displacement(change))?;
            let share = shape.limits.inversion_share * shape.motion().inversion(&step).step;
            Ok(share.clamp(LEAST_REACH, 1.0))
        };
        let longest = |change: &Vec<f64>| change.iter().fold(0.0_f64, |longest, d| longest.max(d.abs()));
        Ok(Self {
            centre: centre.to_vec(),
            ways: changes.each_ref().map(longest),
            reach: [reach(&changes[0])?, reach(&changes[1])?],
            scale,
        })
    }

    /// How far the search may go down and up, as shares of the longest way to a bound.
    pub(super) fn reach(&self) -> [f64; 2] {
        self.reach.map(|reach| self.scale * reach)
    }

    /// Lower and upper bounds of the variables in the box [m].
    pub(super) fn bounds(&self, shape: &Shape) -> [Vec<f64>; 2] {
        let ([down, up], [lowest, highest]) = (self.reach(), self.ways);
        // The whole way is the bound itself, to the last bit.
        let to = |centre: f64, way: f64, share: f64, bound: f64| {
            if share < 1.0 && way < (bound - centre).abs() {
                centre + way.copysign(bound - centre)
            } else {
                bound
            }
        };
        let variables = || self.centre.iter().enumerate();
        let lower = variables().map(|(k, &centre)| to(centre, down * lowest, down, shape.lower()[k]));
        let upper = variables().map(|(k, &centre)| to(centre, up * highest, up, shape.upper()[k]));
        [lower.collect(), upper.collect()]
    }

    /// Whether the box, and not the design's own bounds, keeps a variable from going on.
    pub(super) fn holds_back(&self, shape: &Shape, p: &[f64]) -> bool {
        let [lower, upper] = self.bounds(shape);
        (0..p.len()).any(|k| {
            let near = ON_BOUND * span(shape, k);
            let on = |bound: f64, own: f64| (p[k] - bound).abs() <= near && (bound - own).abs() > near;
            on(lower[k], shape.lower()[k]) || on(upper[k], shape.upper()[k])
        })
    }
}

/// Distance between the bounds of a variable [m].
fn span(shape: &Shape, k: usize) -> f64 {
    shape.upper()[k] - shape.lower()[k]
}
