//! What is tried when a round cannot move on, from the mildest remedy to the last.
//!
//! The first remedy, a smaller step, is the caller's: only it knows how far it wanted to go. Here are the two that change
//! the mesh motion itself: another stiffness policy, chosen by how far it would carry the refused step, and smoothing of
//! the interior nodes; for designs that move along one axis also the way from the original mesh anew, with all nodes on
//! that axis. The last two make another mesh for the same design. After the last there is no further one, and the motion
//! stays where it is.
//!
//! A motion along a given path has one more, because its meshes need not follow one another: smoothing as a matter of
//! course before each round that would begin on worn elements.

use std::ops::ControlFlow;

use fluxmorph_geometry::tet4::{Point, add};

use crate::deform::{Guidance, RemeshSetup};
use crate::error::RemeshError;
use crate::motion::{Motion, Moved};
use crate::policy::StiffnessPolicy;
use crate::smoothing::{SmoothingSettings, smooth};
use crate::travel::Limits;

/// Another policy is taken if it carries the refused step at least this much further: it costs a factor, and the model
/// that a method has built of the objective.
const WORTHWHILE: f64 = 1.1;

/// Smoothing that leaves elements with less than this part of the share of their shape they should have is no help: the
/// surfaces, which stay, or twisted neighbours hold them there.
const WORN_OUT: f64 = 0.03;

/// A remedy that was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rescue {
    /// Another way in which stiffness follows element size.
    Policy {
        /// Until now.
        from: StiffnessPolicy,
        /// From now on.
        to: StiffnessPolicy,
    },
    /// Interior nodes moved to where the elements around them are best; all surfaces stayed.
    Smoothing {
        /// Nodes that moved.
        nodes: usize,
    },
    /// The way from the original mesh anew, all nodes moving along one axis only.
    Guided {
        /// The axis: 0, 1, 2.
        axis: usize,
    },
}

/// A remedy, with what it changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rescued {
    /// The remedy.
    pub rescue: Rescue,
    /// Worst quality (Eq. 4) of the reference mesh before and after.
    pub quality: [f64; 2],
    /// Largest share of the refused step that keeps the limits, before and after; 1 where none was refused.
    pub admitted: [f64; 2],
}

/// How far the ladder has been climbed since the last progress.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rung {
    /// Not at all.
    #[default]
    Ground,
    /// The policies were tried.
    Policies,
    /// The interior was smoothed.
    Smoothed,
    /// The body was guided.
    Guided,
}

impl Rescue {
    /// Whether the mesh of the design that the motion stands at is another one after it.
    pub fn changes_mesh(&self) -> bool {
        matches!(self, Self::Smoothing { .. } | Self::Guided { .. })
    }
}

impl Motion {
    /// The next remedy above `rung` for a refused step towards the design displacements `wanted` [m]: the motion after it,
    /// what was done, and the rung now stood on. `None` when none is left that helps.
    ///
    /// # Errors
    /// As [`Motion::rebased`] and [`Motion::step`].
    ///
    /// # Panics
    /// If there is not one displacement per design node.
    pub fn rescued(
        &self,
        wanted: &[Point],
        rung: Rung,
        limits: &Limits,
    ) -> Result<Option<(Self, Rescued, Rung)>, RemeshError> {
        let quality = self.quality(self.reference()).worst;
        let before = self.admitted(&self.step(wanted)?, limits);
        if rung < Rung::Policies
            && let Some((motion, after)) = self.with_best_policy(wanted, before, limits)?
        {
            let rescue = Rescue::Policy { from: self.policy(), to: motion.policy() };
            let rescued = Rescued { rescue, quality: [quality; 2], admitted: [before, after] };
            return Ok(Some((motion, rescued, Rung::Policies)));
        }
        if rung < Rung::Smoothed
            && self.map().guidance() == Guidance::Free
            && let Some((motion, nodes)) = self.smoothed()?
        {
            let after = motion.admitted(&motion.step(wanted)?, limits);
            let quality = [quality, motion.quality(motion.reference()).worst];
            let rescued = Rescued { rescue: Rescue::Smoothing { nodes }, quality, admitted: [before, after] };
            return Ok(Some((motion, rescued, Rung::Smoothed)));
        }
        if rung < Rung::Guided
            && let Some((motion, rescued)) = self.guided(self.anchor(), wanted, limits)?
            && rescued.admitted[1] > rescued.admitted[0]
        {
            return Ok(Some((motion, rescued, Rung::Guided)));
        }
        Ok(None)
    }

    /// The motion with the policy that carries a step furthest, if that is worth while, and the share that it carries.
    fn with_best_policy(
        &self,
        wanted: &[Point],
        before: f64,
        limits: &Limits,
    ) -> Result<Option<(Self, f64)>, RemeshError> {
        let mut best: Option<(Self, f64)> = None;
        for policy in StiffnessPolicy::ALL.into_iter().filter(|policy| *policy != self.policy()) {
            let motion = self.with_policy(policy)?;
            let share = motion.admitted(&motion.step(wanted)?, limits);
            if share > best.as_ref().map_or(WORTHWHILE * before, |best| best.1) {
                best = Some((motion, share));
            }
        }
        Ok(best)
    }

    /// The motion on a reference mesh whose interior nodes are smoothed towards the shapes of the original mesh, and how
    /// many nodes moved; `None` where that improves nothing.
    ///
    /// # Errors
    /// As [`Motion::rebased`].
    pub fn smoothed(&self) -> Result<Option<(Self, usize)>, RemeshError> {
        let smoothed = self.smooth_mesh(&self.unmoved(), SmoothingSettings::default())?;
        let on = |(moved, nodes): (Moved, usize)| {
            Ok((self.replaced(moved.mesh, moved.displacement, self.policy())?, nodes))
        };
        smoothed.map(on).transpose()
    }

    /// A mesh of this motion, smoothed, and how many nodes moved; `None` where none did.
    fn smooth_mesh(
        &self,
        moved: &Moved,
        settings: SmoothingSettings,
    ) -> Result<Option<(Moved, usize)>, RemeshError> {
        let smoothed = smooth(&moved.mesh, Some(self.original()), self.map().elements(), &settings)?;
        if smoothed.moved_nodes == 0 {
            return Ok(None);
        }
        let steps = moved.displacement.iter().zip(&smoothed.displacement);
        let displacement = steps.map(|(u, step)| add(*u, *step)).collect();
        let moved = Moved { mesh: smoothed.mesh, displacement, inversion: moved.inversion };
        Ok(Some((moved, smoothed.moved_nodes)))
    }

    /// The next round on the mesh that this one reached at `design` on the way to `goal`, if elements of it have less than
    /// the share `least` of their original shape: smoothed, or guided where smoothing does not help enough. `None` where
    /// nothing is worn, or nothing improves.
    ///
    /// A guided body is left as it is: its columns invert only where they are squeezed to nothing, and smoothing would
    /// take that from them.
    pub(crate) fn refreshed(
        &self,
        moved: &Moved,
        design: &[Point],
        goal: &[Point],
        limits: &Limits,
    ) -> Result<Option<(Self, Rescued)>, RemeshError> {
        let least = limits.smooth_below;
        if self.map().guidance() != Guidance::Free || self.shape(&moved.mesh) >= least {
            return Ok(None);
        }
        let settings = SmoothingSettings { target: least, ..SmoothingSettings::default() };
        let smoothed = self.smooth_mesh(moved, settings)?;
        let shape = smoothed.as_ref().map_or(0.0, |(moved, _)| self.shape(&moved.mesh));
        if shape < WORN_OUT * least
            && let Some(guided) = self.guided(design, goal, limits)?
        {
            return Ok(Some(guided));
        }
        let Some((smooth, nodes)) = smoothed else { return Ok(None) };
        let motion = self.rebased(smooth.mesh, smooth.displacement, design.to_vec(), self.policy())?;
        let quality = [&moved.mesh, motion.reference()].map(|mesh| motion.quality(mesh).worst);
        // Nothing was refused: there is no step to hold against another.
        let rescued = Rescued { rescue: Rescue::Smoothing { nodes }, quality, admitted: [1.0; 2] };
        Ok(Some((motion, rescued)))
    }

    /// For a design on its way along one coordinate axis: its place `design` reached anew from the original mesh, with
    /// every node on that axis; `None` where it leaves the axis, the body is guided already, or that way is closed too.
    fn guided(
        &self,
        design: &[Point],
        wanted: &[Point],
        limits: &Limits,
    ) -> Result<Option<(Self, Rescued)>, RemeshError> {
        let along = |axis: usize| {
            let others = [(axis + 1) % 3, (axis + 2) % 3];
            wanted.iter().chain(design).all(|u| others.iter().all(|&d| u[d] == 0.0))
        };
        let Some(axis) = (0..3).find(|&axis| along(axis)).filter(|_| self.map().guidance() == Guidance::Free)
        else {
            return Ok(None);
        };
        let setup = RemeshSetup {
            guidance: Guidance::Axis(axis),
            policy: self.policy(),
            // A third of the unknowns, in one process.
            share: None,
            ..self.map().setup().clone()
        };
        let path = |t: f64| design.iter().map(|u| u.map(|u| t * u)).collect();
        let way = Limits { least_quality: limits.least_quality, ..Limits::default() };
        let anew = Self::new(self.original().clone(), setup)?
            .travel(&path, &way, &mut |_| ControlFlow::Continue(()))?;
        if anew.reached < 1.0 {
            return Ok(None);
        }
        let Moved { mesh, displacement, .. } = anew.moved;
        let policy = anew.motion.policy();
        let motion = anew.motion.rebased(mesh, displacement, design.to_vec(), policy)?.after(self);
        let quality = [self.reference(), motion.reference()].map(|mesh| motion.quality(mesh).worst);
        let share = |motion: &Self| Ok::<_, RemeshError>(motion.admitted(&motion.step(wanted)?, limits));
        let admitted = [share(self)?, share(&motion)?];
        Ok(Some((motion, Rescued { rescue: Rescue::Guided { axis }, quality, admitted })))
    }
}
