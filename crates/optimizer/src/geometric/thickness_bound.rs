//! Least and greatest thickness along the design's direction, at edges across their faces, as one smooth constraint.
//!
//! A limit on the thickness at every design node is as many constraints as the surface has nodes. MMA and SLSQP carry dense
//! arrays of that number times the number of variables and solve a dual problem in it. So the limits are gathered in the
//! Kreisselmeier–Steinhauser function (G. Kreisselmeier, R. Steinhauser, IFAC Proceedings 12 (1979) 113–117): of `g_i = t_min − t_i`,
//! or `t_i − t_max`,
//!
//! `KS = (1/ρ) ln Σ exp(ρ g_i)`, `max g_i ≤ KS ≤ max g_i + ln n / ρ`.
//!
//! It is smooth and never below the largest `g_i`: what satisfies it satisfies every limit. `ρ` is chosen so that at most
//! one per cent of the limit is given away. As sharp as that it bends within a hundredth of the thickness, and methods that go
//! along its tangents come forward in steps of that size. Where the elastic map does not decide about the faces opposite every `g_i`
//! is linear in the variables, and the limit is shown to a method as what it is ([`ThicknessBound::restrict`]): bounds on the variables
//! that move one node each, and the linear limits of the others as long as these are not too many for its dual problem.

use std::collections::BTreeMap;

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::tet4::norm;
use fluxmorph_remesh::{Moved, RemeshError};

use super::NoThickness;
use super::wall_thickness::{Wall, WallThickness};
use crate::problem::Shape;

/// What the smooth bound gives away at most, as a share of the limit: below what a workshop holds, and still smooth over
/// the change of thickness of one optimisation step.
pub const MARGIN: f64 = 0.01;

/// Of what the smooth function gives away, for linear limits that a method keeps but for the tolerance of its dual problem.
const SAFETY: f64 = 1.02;

/// Most linear limits that a method is shown: its dual problem has a variable for each.
const MOST_LINEAR_LIMITS: usize = 1000;

/// Share of a derivative along what a node may do that is rounding: it keeps to its plane.
const ROUNDING: f64 = 1e-9;

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
    /// What keeps the limit in its place; `None` where methods are shown the function itself.
    linear: Option<Vec<LinearLimit>>,
}

/// A limit `room + Σ slope_k p_k ≥ 0`.
#[derive(Clone, Debug)]
struct LinearLimit {
    /// Left at `p = 0` [m].
    room: f64,
    /// By variable, ascending [m/m].
    slopes: Vec<(usize, f64)>,
}

impl LinearLimit {
    fn value(&self, p: &[f64]) -> f64 {
        self.room + self.slopes.iter().map(|&(k, slope)| slope * p[k]).sum::<f64>()
    }
}

impl ThicknessBound {
    /// # Errors
    /// [`NoThickness`] where the shape has none.
    pub fn new(shape: &Shape, bound: ThicknessLimit) -> Result<Self, NoThickness> {
        let thickness = shape.measured_thickness()?;
        let (ThicknessLimit::Minimum(limit) | ThicknessLimit::Maximum(limit)) = bound;
        // Two at least, as ln 1 = 0.
        let count = counted(bound, thickness.walls(|_| [0.0; 3])).count().max(2) as f64;
        Ok(Self { bound, sharpness: count.ln() / given_away(limit), linear: None })
    }

    /// The limit.
    pub fn bound(&self) -> ThicknessLimit {
        self.bound
    }

    /// The number of what a method is shown in place of the function.
    pub fn limit_count(&self) -> Option<usize> {
        self.linear.as_ref().map(Vec::len)
    }

    /// What a method is shown at a design in place of the function: `c ≤ 0` as a share of the limit, with its derivatives. Nothing where
    /// bounds on the variables keep the limit; `None` where there is nothing in its place.
    pub fn limits(&self, p: &[f64]) -> Option<Vec<(f64, Vec<f64>)>> {
        let (ThicknessLimit::Minimum(limit) | ThicknessLimit::Maximum(limit)) = self.bound;
        let unit = given_away(limit) / MARGIN;
        let shown = |own: &LinearLimit| {
            let mut gradient = vec![0.0; p.len()];
            own.slopes.iter().for_each(|&(k, slope)| gradient[k] = -slope / unit);
            (-own.value(p) / unit, gradient)
        };
        Some(self.linear.as_ref()?.iter().map(shown).collect())
    }

    /// Gives the shape the bounds that keep the limit at nodes which one variable moves alone, and finds the linear limits of the
    /// others. What keeps all of them satisfies the smooth function.
    pub fn restrict(&mut self, shape: &mut Shape) {
        let Some(limits) = self.linear_limits(shape) else { return };
        let is_kept_at_first = |own: &LinearLimit| own.value(shape.initial()) >= 0.0;
        let is_bound = |own: &LinearLimit| own.slopes.len() == 1 && is_kept_at_first(own);
        let (bounds, others): (Vec<_>, Vec<_>) = limits.into_iter().partition(is_bound);
        if others.len() > MOST_LINEAR_LIMITS {
            return;
        }
        let (mut lower, mut upper) = (shape.lower().to_vec(), shape.upper().to_vec());
        for LinearLimit { room, slopes } in bounds {
            let (k, slope) = slopes[0];
            let bound = -room / slope;
            if slope > 0.0 {
                lower[k] = lower[k].max(bound);
            } else {
                upper[k] = upper[k].min(bound);
            }
        }
        shape.set_bounds([lower, upper]);
        self.linear = Some(others);
    }

    /// The limit at every node that moves, on the safe side by a little more than what the smooth function gives away; `None` where the
    /// elastic map decides how far away a node opposite is, or a node that stands still breaks it.
    fn linear_limits(&self, shape: &Shape) -> Option<Vec<LinearLimit>> {
        let (thickness, surface) = (shape.thickness()?, shape.surface());
        let map = shape.motion().map();
        let mut limits = Vec::new();
        let walls = thickness.initial().zip(thickness.walls(|_| [0.0; 3]));
        for ((_, initial), (_, wall)) in walls.filter(|(_, (_, wall))| counts(self.bound, wall)) {
            let (sign, room) = match self.bound {
                ThicknessLimit::Minimum(limit) => (1.0, initial - limit - kept_back(limit)),
                ThicknessLimit::Maximum(limit) => (-1.0, limit - kept_back(limit) - initial),
            };
            let mut slopes: BTreeMap<usize, f64> = BTreeMap::new();
            for (node, derivative) in wall.derivatives.into_iter().flatten() {
                let Ok(place) = surface.nodes().binary_search(&node) else {
                    // Along its own plane a node may slide.
                    let part = map.unknown_part(node, derivative);
                    if norm(part) > ROUNDING * norm(derivative) {
                        return None;
                    }
                    continue;
                };
                surface.slopes(place, derivative, &mut |variable, slope| {
                    *slopes.entry(variable).or_default() += sign * slope;
                });
            }
            let slopes: Vec<_> = slopes.into_iter().filter(|(_, slope)| *slope != 0.0).collect();
            match slopes.is_empty() {
                // Nothing keeps it there.
                true if room < 0.0 => return None,
                true => {}
                false => limits.push(LinearLimit { room, slopes }),
            }
        }
        Some(limits)
    }

    /// The least thickness [m] on a moved mesh, of a maximum the greatest, without the margin that is kept.
    pub fn extreme(&self, thickness: &WallThickness, mesh: &Mesh) -> f64 {
        let walls = counted(self.bound, thickness.walls(|n| mesh.point(n))).map(|wall| wall.thickness);
        match self.bound {
            ThicknessLimit::Minimum(_) => walls.fold(f64::INFINITY, f64::min),
            ThicknessLimit::Maximum(_) => walls.fold(f64::NEG_INFINITY, f64::max),
        }
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
        let excess: Vec<(Wall, f64)> = counted(self.bound, thickness.walls(|n| mesh.point(n)))
            .map(|wall| (wall, sign * (wall.thickness - limit)))
            .collect();
        let greatest = excess.iter().fold(f64::NEG_INFINITY, |most, &(_, g)| most.max(g));
        // Relative to the greatest: no exponential overflows.
        let terms: Vec<f64> = excess.iter().map(|&(_, g)| (self.sharpness * (g - greatest)).exp()).collect();
        let sum: f64 = terms.iter().sum();
        let mut nodal = vec![[0.0; 3]; mesh.points().len()];
        for ((wall, _), term) in excess.iter().zip(&terms) {
            for (node, derivative) in wall.derivatives.into_iter().flatten() {
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

/// What the smooth function of a limit gives away at most [m]; a limit of zero is held as one of a micrometre.
fn given_away(limit: f64) -> f64 {
    MARGIN * if limit == 0.0 { 1e-6 } else { limit.abs() }
}

/// By how much a limit is held on the safe side where it is shown to a method as bounds or linear limits [m].
pub fn kept_back(limit: f64) -> f64 {
    SAFETY * given_away(limit)
}

/// The walls that have a say in a limit.
fn counted(bound: ThicknessLimit, walls: impl Iterator<Item = (usize, Wall)>) -> impl Iterator<Item = Wall> {
    walls.map(|(_, wall)| wall).filter(move |wall| counts(bound, wall))
}

/// Whether a wall has a say in a limit: behind design nodes all, before nodes opposite those that are beyond what the others say by
/// more than these are held on the safe side.
fn counts(bound: ThicknessLimit, wall: &Wall) -> bool {
    wall.bulge.is_none_or(|bulge| match bound {
        ThicknessLimit::Minimum(limit) => bulge > given_away(limit),
        ThicknessLimit::Maximum(limit) => -bulge > given_away(limit),
    })
}

/// Whether a node opposite is a design node, or one that the elastic map decides.
fn opposite_moves(shape: &Shape, thickness: &WallThickness) -> bool {
    let (map, designed) = (shape.motion().map(), shape.surface().nodes());
    thickness.opposite_nodes().any(|n| designed.binary_search(&n).is_ok() || map.is_unknown(n))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fluxmorph_geometry::NodeId;

    #[test]
    fn a_wall_before_a_node_opposite_counts_where_it_is_beyond_what_is_kept_back() {
        let wall = |bulge| Wall { thickness: 1.0, derivatives: [Some((NodeId(0), [0.0; 3])); 4], bulge };
        let (least, most) = (ThicknessLimit::Minimum(0.5), ThicknessLimit::Maximum(0.5));
        for (bulge, of_least, of_most) in [
            (None, true, true),
            (Some(0.0051), true, false),
            (Some(0.0049), false, false),
            (Some(-0.0049), false, false),
            (Some(-0.0051), false, true),
        ] {
            assert_eq!(
                [least, most].map(|bound| counts(bound, &wall(bulge))),
                [of_least, of_most],
                "{bulge:?}"
            );
        }
    }
}
