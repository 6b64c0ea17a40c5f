//! A design that the mesh does not carry: the step to it is cut short, and the method sees one smooth problem.
//!
//! The mesh is one function of the design, and the *room* of a design ([`fluxmorph_remesh::Room`]) is smooth on both sides of the
//! boundary of the carried ones, which are a convex set on rails. Where a design that is asked for is not carried, a carried one
//! near it is evaluated in its place, and counts: squeezed elements push the variables around them back, and what is missing then
//! is cut off the way from the best design. Where that is a gain, the method searches on from there. Else it is given the linear
//! continuation of objective and constraints, and
//! one more constraint on the room, which is violated: it knows that it has gone too far, and in which direction there is room.
//! Its model goes on. Away from the boundary that constraint is flat, and has no say.
//!
//! Methods without constraints are stopped after such an evaluation, and search on around the best design.

use std::time::Instant;

use fluxmorph_remesh::{Carried, LEAST_ROOM, Moved};

use super::run::Run;
use super::stop::{Refusal, Stop};
use crate::error::Error;
use crate::nlopt::Sample;
use crate::problem::{Cut, Stage, between};

/// Room over the least one within which the constraint is felt.
const NEAR: f64 = 0.03;

/// Scale of the constraint: its value where there is all the room. Large, as what the conservative methods first assume of its
/// curvature is of order one, and would hold back a first step far away from the boundary.
const SCALE: f64 = 1000.0;

/// A design whose room is nearer than this to the least one is held back by the mesh.
const HELD_BACK: f64 = 0.02;

/// The mesh of a design that was asked for, or of one that is evaluated in its place.
pub(super) struct Carriage {
    /// The design that is evaluated.
    pub(super) design: Vec<f64>,
    /// Its mesh.
    pub(super) moved: Moved,
    /// What holds the mesh back, and what would help, where it does not carry what was asked for.
    cut: Option<Cut>,
    /// Room of the design asked for.
    room: f64,
    /// Derivatives of the room by the variables [1/m].
    room_gradient: Vec<f64>,
    /// Wall time of all meshes that were tried [s].
    pub(super) seconds: f64,
}

impl Carriage {
    /// Whether another design is evaluated in place of the one that was asked for.
    pub(super) fn is_cut(&self) -> bool {
        self.cut.is_some()
    }

    /// Whether the mesh holds the evaluated design back.
    pub(super) fn is_held_back(&self) -> bool {
        self.is_cut() || self.room < LEAST_ROOM + HELD_BACK
    }
}

/// Where a run stands before an evaluation.
pub(super) struct Standing {
    /// The evaluation of the best design.
    pub(super) best: Option<usize>,
    /// Evaluations, with violation and objective of the best design.
    pub(super) values: (usize, Option<(f64, f64)>),
}

impl Run<'_> {
    /// The mesh of a design, or of the one that is evaluated in its place.
    pub(super) fn carry(&mut self, p: &[f64]) -> Result<Carriage, Stop> {
        let clock = Instant::now();
        self.observer.stage(Stage::Moving);
        // Before a first design, from no displacement at all.
        let from = self.best.as_ref().map_or_else(|| vec![0.0; p.len()], |best| best.values.clone());
        let shape = self.shape();
        let carried_to = |p: &[f64]| shape.carried(&from, p).map_err(Error::from);
        let asked = carried_to(p)?;
        let room_gradient = shape.surface().gradient(&asked.room.gradient);
        let pushed =
            if asked.share < 1.0 { shape.pushed_back(p, &asked).map_err(Error::from)? } else { p.to_vec() };
        let Carried { mut share, mut moved, room, .. } = asked;
        let cut = (share < 1.0).then(|| Cut::of(shape, self.problem.original(), p, room.element));
        let mut goal = p.to_vec();
        if pushed != p {
            let nearer = carried_to(&pushed)?;
            let distance = |other: &[f64]| p.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            if distance(&between(&from, &pushed, nearer.share)) < distance(&between(&from, p, share)) {
                (goal, share, moved) = (pushed, nearer.share, nearer.moved);
            }
        }
        if let Some(cause) = self.refusal(&moved) {
            return Err(Stop::Mesh(Refusal { cause }));
        }
        let design = between(&from, &goal, share);
        let seconds = clock.elapsed().as_secs_f64();
        Ok(Carriage { design, moved, cut, room: room.value, room_gradient, seconds })
    }

    /// What the method is given for the design `p` that it asked for, from the sample of the one that was evaluated; `before`
    /// are the evaluations and the best design before it.
    pub(super) fn answer(
        &mut self,
        p: &[f64],
        (carried, before): (&Carriage, Standing),
        mut sample: Sample,
    ) -> Result<Sample, Stop> {
        if self.best_evaluation() != before.best {
            self.is_held_back = carried.is_held_back();
        }
        // With less, a search creeps along the boundary in ever smaller steps.
        let least = self.settings.least_gain();
        let has_gained = before.best.is_none() || self.has_gained(before.values, least);
        if let Some(cut) = &carried.cut {
            let cause = format!("the mesh carries a part of the step: {cut}");
            if self.cures.insert(cut.cure) {
                self.observer.note(&cause);
            }
            if !self.takes_constraints() {
                return Err(Stop::Mesh(Refusal { cause }));
            }
            if has_gained {
                return Err(Stop::CutShort);
            }
        }
        if !self.takes_constraints() {
            return Ok(sample);
        }
        let step: Vec<f64> = p.iter().zip(&carried.design).map(|(p, own)| p - own).collect();
        let along = |gradient: &[f64]| gradient.iter().zip(&step).map(|(g, s)| g * s).sum::<f64>();
        sample.value += along(&sample.gradient);
        for (value, gradient) in sample.constraints.iter_mut().chain(&mut sample.limits) {
            *value += along(gradient);
        }
        let (c, slope) = excess(carried.room);
        sample.constraints.push((c, carried.room_gradient.iter().map(|g| slope * g).collect()));
        Ok(sample)
    }
}

/// `c` of a room and its derivative: `s (e^(−x/s) − 1)` of the room left, `x`, and linear where there is none; times a scale.
fn excess(room: f64) -> (f64, f64) {
    let left = room - LEAST_ROOM;
    if left < 0.0 {
        return (-SCALE / NEAR * left, -SCALE / NEAR);
    }
    let near = (-left / NEAR).exp();
    (SCALE * (near - 1.0), -SCALE / NEAR * near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_constraint_binds_at_the_least_room_and_is_flat_far_away() {
        assert_eq!(excess(LEAST_ROOM).0, 0.0);
        assert!(excess(LEAST_ROOM - 0.1).0 > 0.0 && excess(0.9).0 < 0.0);
        // Far away a change of the room by one changes the constraint by less than a thousandth of its value.
        assert!(excess(0.9).1.abs() < 1e-3 * SCALE);
        for room in [-0.4, 0.0, 0.05, 0.3] {
            let h = 1e-6;
            let difference = (excess(room + h).0 - excess(room - h).0) / (2.0 * h);
            // Of second order in h / NEAR, and rounding of values of a thousand over h.
            assert!((difference / excess(room).1 - 1.0).abs() < 1e-6, "{room}");
        }
    }
}
