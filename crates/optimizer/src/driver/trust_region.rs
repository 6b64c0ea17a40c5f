//! The trust region of a round: a box around its first design in which the method may search.
//!
//! The mesh carries a motion of all variables towards their upper bounds up to some share, within
//! [`fluxmorph_remesh::StepLimits::inversion_share`] of the first inversion. That share of the largest distance of a
//! variable to its upper bound is how far every variable may go up, though never beyond its bound; down likewise. A
//! variable on its bound asks nothing of the mesh, and one near it may go there. Without rounds the trust region is the box
//! of the bounds, since there can be no other reference mesh. Designs inside it may still be refused one by one; then
//! `scale` shrinks it.

use fluxmorph_remesh::RemeshError;

use crate::problem::Shape;

/// A variable nearer to a bound than this share of its span is on it: far below any step, and above rounding.
const ON_BOUND: f64 = 1e-9;

/// Least share of the distance to the bounds: methods need room, and designs may still be refused one by one.
const LEAST_REACH: f64 = 1e-3;

/// The trust region of a round.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TrustRegion {
    /// The design at its centre [m].
    centre: Vec<f64>,
    /// Largest distance of a variable to its lower and to its upper bound [m].
    distances: [f64; 2],
    /// Shares of these distances that the mesh carries.
    reach: [f64; 2],
    /// Both are multiplied by it.
    pub(super) scale: f64,
}

impl TrustRegion {
    /// The trust region of the present round around a design.
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
        let largest = |change: &Vec<f64>| change.iter().fold(0.0_f64, |largest, d| largest.max(d.abs()));
        Ok(Self {
            centre: centre.to_vec(),
            distances: changes.each_ref().map(largest),
            reach: [reach(&changes[0])?, reach(&changes[1])?],
            scale,
        })
    }

    /// How far the variables may go down and up, as shares of the largest distance to a bound.
    pub(super) fn reach(&self) -> [f64; 2] {
        self.reach.map(|reach| self.scale * reach)
    }

    /// Lower and upper bounds of the variables in the trust region [m].
    pub(super) fn bounds(&self, shape: &Shape) -> [Vec<f64>; 2] {
        let ([down, up], [lowest, highest]) = (self.reach(), self.distances);
        // The whole distance is the bound itself, to the last bit.
        let to = |centre: f64, distance: f64, share: f64, bound: f64| {
            if share < 1.0 && distance < (bound - centre).abs() {
                centre + distance.copysign(bound - centre)
            } else {
                bound
            }
        };
        let variables = || self.centre.iter().enumerate();
        let lower = variables().map(|(k, &centre)| to(centre, down * lowest, down, shape.lower()[k]));
        let upper = variables().map(|(k, &centre)| to(centre, up * highest, up, shape.upper()[k]));
        [lower.collect(), upper.collect()]
    }

    /// Whether a variable is on the boundary of the trust region that is no bound of the design.
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
