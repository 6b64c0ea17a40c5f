//! Whether the mesh follows the design to its bounds, and what is in the way.

use fluxmorph_optimizer::problem::{Cut, Problem, Shape};
use fluxmorph_remesh::MotionLaw;
use serde::Serialize;

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
    /// Of both bounds; none where nothing is designed, and by the hyperelastic law, which takes long over what it cannot carry.
    pub(super) fn of(problem: &Problem) -> Vec<Self> {
        let is_quick = |shape: &&Shape| shape.motion().law() != MotionLaw::Hyperelastic;
        let Some(shape) = problem.shape().filter(is_quick) else { return Vec::new() };
        let reach = |(bound, to): (&'static str, &[f64])| {
            let carried = shape.carried(shape.initial(), to).ok()?;
            let cut = || Cut::of(shape, problem.original(), to, carried.room.element).to_string();
            let cause = (carried.share < 1.0).then(cut);
            Some(Self { bound, share: carried.share, cause })
        };
        [("lower", shape.lower()), ("upper", shape.upper())].into_iter().filter_map(reach).collect()
    }
}
