//! How far the mesh follows a design on rails, and how much room is left there.
//!
//! The designs that motion along one axis can carry form a convex set, since stretches are linear in all displacements: where a
//! design is beyond it, the way there from a design inside it is cut short, and everything up to the cut is carried. The
//! *room* of a design is a smooth lower bound of the least stretch of an element (Kreisselmeier and Steinhauser),
//! `r = −1/β ln Σ_e exp(−β J_e)`: defined for every design, carried or not, with an exact gradient by the tangent.

use fluxmorph_geometry::ElementId;
use fluxmorph_geometry::fem::scalar::ordered_sum;
use fluxmorph_geometry::tet4::Point;

use crate::error::RemeshError;
use crate::guard::{StepToInversion, check_step};
use crate::motion::{Motion, Moved};
use crate::rails::{Equilibrium, Rails};

/// Least room of a design that is carried: flatter elements are valid, and next to useless.
pub const LEAST_ROOM: f64 = 0.03;

/// `β`: a thousand elements at the least stretch make the room 0.03 smaller than that.
const SHARPNESS: f64 = 200.0;

/// `J_t`: so far above the least room that a thousand elements at it are carried.
const INTENDED_STRETCH: f64 = 0.08;

/// Halvings in the search for the share of a path that is carried.
const SHARE_BITS: usize = 7;

/// How far a path of designs is carried.
#[derive(Clone, Debug)]
pub struct Carried {
    /// Share of the path: 1 for all of it.
    pub share: f64,
    /// The mesh there.
    pub moved: Moved,
    /// Room at the end of the path, whether or not it is reached.
    pub room: Room,
}

/// A smooth lower bound of the least stretch.
#[derive(Clone, Debug)]
pub struct Room {
    /// Its value: at most 1; negative where elements invert.
    pub value: f64,
    /// Its derivative by the displacements of the design nodes [1/m], shape `(n_design, 3)`.
    pub gradient: Vec<Point>,
    /// The element of the least stretch.
    pub element: ElementId,
}

/// How much is missing for a design to be carried.
#[derive(Clone, Debug)]
pub struct Shortfall {
    /// `½ Σ_e max(0, J_t − J_e)²` over the elements, with the stretch `J_t` that they should have; zero for a design that is
    /// carried.
    pub value: f64,
    /// Its derivative by the displacements of the design nodes [1/m], shape `(n_design, 3)`.
    pub gradient: Vec<Point>,
}

impl Motion {
    /// How much is missing for design displacements [m] to be carried; `None` where the law is not that of rails.
    ///
    /// # Errors
    /// [`RemeshError::NotSettled`], [`RemeshError::NotFinite`].
    pub fn shortfall(&self, design: &[Point]) -> Result<Option<Shortfall>, RemeshError> {
        let Some(rails) = self.rails() else { return Ok(None) };
        let equilibrium = rails.equilibrium(design)?;
        if rails.soft_minimum(&equilibrium).0 >= LEAST_ROOM {
            return Ok(Some(Shortfall { value: 0.0, gradient: vec![[0.0; 3]; design.len()] }));
        }
        let stretches = rails.stretches_of(&equilibrium.displacement);
        let missing: Vec<f64> = stretches.iter().map(|j| (INTENDED_STRETCH - j).max(0.0)).collect();
        let value = ordered_sum(missing.len(), |i| 0.5 * missing[i] * missing[i]);
        let shares: Vec<f64> = missing.iter().map(|m| -m).collect();
        let nodal = rails.stretch_derivative(&shares, equilibrium.displacement.len());
        Ok(Some(Shortfall { value, gradient: equilibrium.tangent.gradient(&nodal)? }))
    }

    /// How far the mesh follows a path `t → Δx_b(t)` of design displacements [m], `0 ≤ t ≤ 1`, whose beginning it carries;
    /// `None` where the law is not that of rails.
    ///
    /// # Errors
    /// [`RemeshError::NotSettled`], [`RemeshError::NotFinite`], and [`RemeshError::Inverted`] where not even the beginning is
    /// carried.
    pub fn carried_along(&self, path: &dyn Fn(f64) -> Vec<Point>) -> Result<Option<Carried>, RemeshError> {
        let Some(rails) = self.rails() else { return Ok(None) };
        let asked = rails.equilibrium(&path(1.0))?;
        let room = rails.room(&asked)?;
        if room.value >= LEAST_ROOM
            && let Ok(moved) = self.at(asked)
        {
            return Ok(Some(Carried { share: 1.0, moved, room }));
        }
        let (mut low, mut high, mut best) = (0.0, 1.0, None);
        for _ in 0..SHARE_BITS {
            let middle = 0.5 * (low + high);
            let equilibrium = rails.equilibrium(&path(middle))?;
            let is_roomy = rails.soft_minimum(&equilibrium).0 >= LEAST_ROOM;
            match self.at(equilibrium) {
                Ok(moved) if is_roomy => (low, best) = (middle, Some(moved)),
                Ok(_) | Err(RemeshError::Inverted { .. }) => high = middle,
                Err(other) => return Err(other),
            }
        }
        let moved = match best {
            Some(moved) => moved,
            None => self.at(rails.equilibrium(&path(0.0))?)?,
        };
        Ok(Some(Carried { share: low, moved, room }))
    }

    /// The mesh of an equilibrium.
    ///
    /// # Errors
    /// [`RemeshError::Inverted`].
    pub(crate) fn at(&self, equilibrium: Equilibrium) -> Result<Moved, RemeshError> {
        let Equilibrium { displacement, least: (stretch, element), tangent, .. } = equilibrium;
        let mesh = check_step(self.original(), &displacement)?;
        // Stretches are linear along the straight motion.
        let inversion = match stretch {
            stretch if stretch < 1.0 => {
                StepToInversion { step: 1.0 / (1.0 - stretch), element: Some(element) }
            }
            _ => StepToInversion::NEVER,
        };
        Ok(Moved { mesh, displacement, inversion, tangent: Some(tangent) })
    }
}

impl Rails {
    /// The room of an equilibrium.
    ///
    /// # Errors
    /// [`RemeshError::NotFinite`].
    fn room(&self, equilibrium: &Equilibrium) -> Result<Room, RemeshError> {
        let (value, shares) = self.soft_minimum(equilibrium);
        let nodal = self.stretch_derivative(&shares, equilibrium.displacement.len());
        let gradient = equilibrium.tangent.gradient(&nodal)?;
        Ok(Room { value, gradient, element: equilibrium.least.1 })
    }

    /// `−1/β ln Σ_e exp(−β J_e)`, and its derivative by each `J_e`.
    fn soft_minimum(&self, equilibrium: &Equilibrium) -> (f64, Vec<f64>) {
        let least = equilibrium.least.0;
        let stretches = self.stretches_of(&equilibrium.displacement);
        let terms: Vec<f64> = stretches.iter().map(|j| (-SHARPNESS * (j - least)).exp()).collect();
        let sum = ordered_sum(terms.len(), |i| terms[i]);
        (least - sum.ln() / SHARPNESS, terms.iter().map(|term| term / sum).collect())
    }
}
