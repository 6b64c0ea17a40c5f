//! Least and greatest thickness along the design's direction, as one smooth constraint.
//!
//! A limit on the thickness at every design node is as many constraints as the surface has nodes. MMA and SLSQP carry dense arrays of that number times the number of
//! variables and solve a dual problem in it; only where the body is as thick everywhere does it come down to bounds on
//! the variables. So the limits are gathered in the Kreisselmeier–Steinhauser function (G. Kreisselmeier, R. Steinhauser,
//! IFAC Proceedings 12 (1979) 113–117): of `g_i = t_min − t_i`, or `t_i − t_max`,
//!
//! `KS = (1/ρ) ln Σ exp(ρ g_i)`, `max g_i ≤ KS ≤ max g_i + ln n / ρ`.
//!
//! It is smooth and never below the largest `g_i`: what satisfies it satisfies every limit. `ρ` is chosen so that at most
//! one per cent of the limit is given away.

use fluxmorph_remesh::{Moved, RemeshError};

use super::NoThickness;
use super::wall_thickness::{Wall, WallThickness};
use crate::problem::Shape;

/// What the smooth bound gives away at most, as a share of the limit: below what a workshop holds, and still smooth over
/// the change of thickness of one optimisation step.
pub const MARGIN: f64 = 0.01;

/// A limit of the thickness [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ThicknessLimit {
    /// At least this thick.
    Minimum(f64),
    /// At most this thick.
    Maximum(f64),
}

/// A limit of the thickness at every design node as one function of the variables.
#[derive(Clone, Debug)]
pub struct ThicknessBound {
    bound: ThicknessLimit,
    /// `ρ` [1/m].
    sharpness: f64,
}

impl ThicknessBound {
    /// # Errors
    /// [`NoThickness`] where the shape has none.
    pub fn new(shape: &Shape, bound: ThicknessLimit) -> Result<Self, NoThickness> {
        let thickness = shape.thickness().ok_or(NoThickness)?;
        let (ThicknessLimit::Minimum(limit) | ThicknessLimit::Maximum(limit)) = bound;
        // Two at least, as ln 1 = 0; a limit of zero is held as one of a micrometre.
        let count = thickness.at_nodes().count().max(2) as f64;
        Ok(Self { bound, sharpness: count.ln() / (MARGIN * limit.abs().max(1e-6)) })
    }

    /// The limit.
    pub fn bound(&self) -> ThicknessLimit {
        self.bound
    }

    /// How far the limit is exceeded on a moved mesh [m], at most 0 where it is satisfied, and the derivative with respect to
    /// every variable, shape `(n_variables)`: one elastic solve where the opposite face may move, else none.
    ///
    /// # Errors
    /// [`RemeshError::NotConverged`].
    ///
    /// # Panics
    /// If the shape is not the one that the bound was made for.
    pub fn evaluate(&self, shape: &Shape, moved: &Moved) -> Result<(f64, Vec<f64>), RemeshError> {
        let thickness = shape.thickness().expect("a bound is made for a shape with a thickness");
        let (sign, limit) = match self.bound {
            ThicknessLimit::Minimum(limit) => (-1.0, limit),
            ThicknessLimit::Maximum(limit) => (1.0, limit),
        };
        let mesh = &moved.mesh;
        let excess: Vec<(Wall, f64)> = thickness
            .walls(shape.surface(), |n| mesh.point(n))
            .map(|(_, wall)| (wall, sign * (wall.thickness - limit)))
            .collect();
        let greatest = excess.iter().fold(f64::NEG_INFINITY, |most, &(_, g)| most.max(g));
        // Relative to the greatest: no exponential overflows.
        let terms: Vec<f64> = excess.iter().map(|&(_, g)| (self.sharpness * (g - greatest)).exp()).collect();
        let sum: f64 = terms.iter().sum();
        let mut nodal = vec![[0.0; 3]; mesh.points().len()];
        for ((wall, _), term) in excess.iter().zip(&terms) {
            for (node, derivative) in wall.derivatives {
                for (total, d) in nodal[node.index()].iter_mut().zip(derivative) {
                    *total += sign * term / sum * d;
                }
            }
        }
        let at_design = if opposite_moves(shape, thickness) {
            moved.pull_back(&nodal)?
        } else {
            shape.surface().nodes().iter().map(|n| nodal[n.index()]).collect()
        };
        Ok((greatest + sum.ln() / self.sharpness, shape.surface().gradient(&at_design)))
    }
}

/// Whether a node opposite is a design node, or one that the elastic map decides.
fn opposite_moves(shape: &Shape, thickness: &WallThickness) -> bool {
    let (map, designed) = (shape.motion().map(), shape.surface().nodes());
    thickness.opposite_faces().flatten().any(|n| designed.binary_search(&n).is_ok() || map.is_unknown(n))
}
