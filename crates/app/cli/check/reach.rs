//! Whether the mesh follows the design to its bounds, and what is in the way.

use fluxmorph_geometry::tet4::{norm, sub};
use fluxmorph_geometry::{Mesh, millimetres};
use fluxmorph_optimizer::problem::{Cut, Problem, Shape};
use fluxmorph_remesh::MotionLaw;
use serde::Serialize;

/// Distance that is rounding, by the diagonal of the mesh.
const ROUNDING: f64 = 1e-9;

/// How far the mesh follows when all variables go to one of their bounds together.
#[derive(Debug, Serialize)]
pub(super) struct Reach {
    /// `lower` or `upper`.
    pub(super) bound: &'static str,
    /// Share of the way from the initial design: 1 for all of it.
    pub(super) share: f64,
    /// What is in the way, and what would help.
    pub(super) cause: Option<String>,
}

impl Reach {
    /// Of both bounds; none where nothing is designed. The hyperelastic law takes long over what it cannot carry: of that it is said
    /// alone where the design surface would leave the mesh.
    pub(super) fn of(problem: &Problem) -> Vec<Self> {
        let Some(shape) = problem.shape() else { return Vec::new() };
        let is_slow = shape.motion().law() == MotionLaw::Hyperelastic;
        let reach = |(bound, to): (&'static str, &[f64])| {
            if is_slow {
                return Self::before_the_outside(problem.original(), shape, (bound, to));
            }
            let carried = shape.carried(shape.initial(), to).ok()?;
            let cut = || Cut::of(shape, problem.original(), to, carried.room.element).to_string();
            let cause = (carried.share < 1.0).then(cut);
            Some(Self { bound, share: carried.share, cause })
        };
        [("lower", shape.lower()), ("upper", shape.upper())].into_iter().filter_map(reach).collect()
    }

    /// The share of the way to a bound on which the design surface stays in the box around the mesh; `None` where it is all.
    fn before_the_outside(mesh: &Mesh, shape: &Shape, (bound, to): (&'static str, &[f64])) -> Option<Self> {
        let [lower, upper] = mesh.bounding_box();
        let rounding = ROUNDING * norm(sub(upper, lower));
        let [from, to] = [shape.initial(), to].map(|p| shape.displacement(p));
        let nodes = shape.surface().nodes().iter().zip(from.iter().zip(&to));
        let shares = nodes.flat_map(|(&node, (from, to))| {
            let point = mesh.point(node);
            (0..3).filter_map(move |d| {
                let side = if to[d] > from[d] { upper[d] } else { lower[d] };
                let (way, room) = ((to[d] - from[d]).abs(), (side - point[d] - from[d]).abs());
                // What lies there already is the outside itself, and moves it.
                (way > room + rounding && room > rounding).then_some((room / way, node))
            })
        });
        let (share, node) = shares.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let cause = format!(
            "at most, for the node at {} of the design surface leaves the mesh there; take a bound nearer to zero",
            millimetres(mesh.point(node))
        );
        Some(Self { bound, share, cause: Some(cause) })
    }
}
