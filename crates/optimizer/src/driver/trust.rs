//! The box a method may search in during a round: how far the mesh of the round can be trusted.
//!
//! From the round's first design every variable may go as far up as the mesh carries a motion of all variables by that
//! much, within [`fluxmorph_remesh::Limits::inversion_share`] of the first inversion, and as far down likewise; and never
//! beyond the design's own bounds. Without rounds the box is that of the bounds, since no other reference can be had. Designs inside the box may still be refused one by one; then `scale` makes it smaller.

use fluxmorph_remesh::RemeshError;

use crate::problem::Shape;

/// Of its span, a variable nearer than this to a bound lies on it: far below any step, and above rounding.
const ON_BOUND: f64 = 1e-9;

/// A box reaches at least this share of the bounds' span: methods need room, and designs in it may still be refused.
const LEAST_REACH: f64 = 1e-3;

/// A box around the first design of a round.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TrustRegion {
    /// The design in its middle [m].
    centre: Vec<f64>,
    /// How far it reaches down and up, as shares of every variable's span between its bounds.
    reach: [f64; 2],
    /// Both are multiplied by it.
    pub(super) scale: f64,
}

impl TrustRegion {
    /// The box of the present round around a design.
    ///
    /// # Errors
    /// As [`fluxmorph_remesh::Motion::step`].
    pub(super) fn new(shape: &Shape, centre: &[f64], scale: f64) -> Result<Self, RemeshError> {
        if shape.limits.rounds == 0 {
            return Ok(Self { centre: centre.to_vec(), reach: [1.0; 2], scale });
        }
        let reach = |sign: f64| -> Result<f64, RemeshError> {
            let change: Vec<f64> = (0..centre.len()).map(|k| sign * span(shape, k)).collect();
            let step = shape.motion.map().linear(&shape.displacement(&change))?;
            let share = shape.limits.inversion_share * shape.motion.inversion(&step).step;
            Ok(share.clamp(LEAST_REACH, 1.0))
        };
        let reach = [reach(-1.0)?, reach(1.0)?];
        Ok(Self { centre: centre.to_vec(), reach, scale })
    }

    /// How far the search may go down and up, as shares of the span between the bounds.
    pub(super) fn reach(&self) -> [f64; 2] {
        self.reach.map(|reach| self.scale * reach)
    }

    /// Lower and upper bounds of the variables in the box [m].
    pub(super) fn bounds(&self, shape: &Shape) -> [Vec<f64>; 2] {
        let [down, up] = self.reach();
        let variables = || self.centre.iter().enumerate();
        let lower = variables().map(|(k, centre)| (centre - down * span(shape, k)).max(shape.lower[k]));
        let upper = variables().map(|(k, centre)| (centre + up * span(shape, k)).min(shape.upper[k]));
        [lower.collect(), upper.collect()]
    }

    /// Whether the box, and not the design's own bounds, keeps a variable from going on.
    pub(super) fn holds_back(&self, shape: &Shape, p: &[f64]) -> bool {
        let [lower, upper] = self.bounds(shape);
        (0..p.len()).any(|k| {
            let near = ON_BOUND * span(shape, k);
            let on = |bound: f64, own: f64| (p[k] - bound).abs() <= near && (bound - own).abs() > near;
            on(lower[k], shape.lower[k]) || on(upper[k], shape.upper[k])
        })
    }
}

/// Distance between the bounds of a variable [m].
fn span(shape: &Shape, k: usize) -> f64 {
    shape.upper[k] - shape.lower[k]
}
