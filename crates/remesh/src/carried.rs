//! How far the mesh follows a design, and how much room is left there.
//!
//! Where a design is not carried, the way there from one that is is cut short. The designs that motion along one axis can carry
//! form a convex set, since stretches are linear in all displacements: on rails everything up to the cut is carried. The
//! *room* of a design is a smooth lower bound of the least stretch of an element (Kreisselmeier and Steinhauser),
//! `r = −1/β ln Σ_e exp(−β J_e)`: defined for every design, carried or not, with an exact gradient by the tangent.

use fluxmorph_geometry::ElementId;
use fluxmorph_geometry::fem::scalar::ordered_sum;
use fluxmorph_geometry::tet4::{Point, dot, sub};

use crate::deform::ElasticMap;
use crate::equilibrium::{EnergyLaw, Equilibrium};
use crate::error::RemeshError;
use crate::motion::{Motion, Moved};

/// Least room of a design that is carried: flatter elements are valid, and next to useless.
pub const LEAST_ROOM: f64 = 0.03;

/// `β`: a thousand elements at the least stretch make the room 0.03 smaller than that.
const SHARPNESS: f64 = 200.0;

/// `J_t`: so far above the least room that a thousand elements at it are carried.
const INTENDED_STRETCH: f64 = 0.08;

/// Halvings in the search for the share of a path that is carried.
const SHARE_BITS: usize = 7;

/// Part of a path below which none is carried.
const SHORTEST_PART: f64 = 1.0 / (1 << SHARE_BITS) as f64;

/// How far a path of designs is carried.
#[derive(Clone, Debug)]
pub struct Carried {
    /// Share of the path: 1 for all of it.
    pub share: f64,
    /// The mesh there.
    pub moved: Moved,
    /// Room at the end of the path, whether or not it is reached.
    pub room: Room,
    /// Where the nodes come to rest at the end of the path, if they do.
    asked: Option<Equilibrium>,
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
    /// Where it was found; `None` for a design that is carried.
    equilibrium: Option<Equilibrium>,
}

impl Motion {
    /// How much is missing for design displacements [m] to be carried; `None` where the nodes do not come to rest. `near` is that
    /// of a design near it.
    ///
    /// # Errors
    /// [`RemeshError::NotFinite`].
    pub fn shortfall(
        &self,
        design: &[Point],
        near: Option<&Shortfall>,
    ) -> Result<Option<Shortfall>, RemeshError> {
        let law = self.energy_law();
        let own = match near.and_then(|near| near.equilibrium.as_ref()) {
            Some(near) => law.near(near, design),
            None => law.equilibrium(design),
        };
        settled(own)?.map(|own| self.shortfall_at(own)).transpose()
    }

    /// As [`Motion::shortfall`], of the end of a path.
    ///
    /// # Errors
    /// [`RemeshError::NotFinite`].
    pub fn shortfall_at_end(&self, carried: &Carried) -> Result<Option<Shortfall>, RemeshError> {
        carried.asked.clone().map(|own| self.shortfall_at(own)).transpose()
    }

    fn shortfall_at(&self, equilibrium: Equilibrium) -> Result<Shortfall, RemeshError> {
        let law = self.energy_law();
        let stretches = law.stretches(&equilibrium.displacement);
        if soft_minimum(&stretches).0 >= LEAST_ROOM {
            let gradient = vec![[0.0; 3]; law.rest().design_nodes().len()];
            return Ok(Shortfall { value: 0.0, gradient, equilibrium: None });
        }
        let missing: Vec<f64> = stretches.iter().map(|j| (INTENDED_STRETCH - j).max(0.0)).collect();
        let value = ordered_sum(missing.len(), |i| 0.5 * missing[i] * missing[i]);
        let shares: Vec<f64> = missing.iter().map(|m| -m).collect();
        let nodal = law.stretch_derivative(&equilibrium.displacement, &shares);
        let gradient = equilibrium.tangent.gradient(&nodal)?;
        Ok(Shortfall { value, gradient, equilibrium: Some(equilibrium) })
    }

    /// How far the mesh follows a path `t → Δx_b(t)` of design displacements [m], `0 ≤ t ≤ 1`, whose beginning it carries.
    ///
    /// # Errors
    /// [`RemeshError::NotFinite`]; [`RemeshError::Inverted`] and [`RemeshError::NotSettled`] where not even the beginning is
    /// carried.
    pub fn carried_along(&self, path: &dyn Fn(f64) -> Vec<Point>) -> Result<Carried, RemeshError> {
        let law = self.energy_law();
        let goal = path(1.0);
        let asked = settled(law.equilibrium(&goal))?;
        let room = asked.as_ref().map(|own| room_of(law, &own.displacement, &own.tangent)).transpose()?;
        if let (Some(asked), Some(room)) = (&asked, &room)
            && room.value >= LEAST_ROOM
            && let Ok(moved) = self.at(asked.clone())
        {
            return Ok(Carried { share: 1.0, moved, room: room.clone(), asked: Some(asked.clone()) });
        }
        let (share, moved) = self.longest_part(law, path)?;
        let room = match (room, &moved.tangent) {
            (None, Some(tangent)) => {
                let near = room_of(law, &moved.displacement, tangent)?;
                near.continued(&path(share), &goal)
            }
            (room, _) => room.expect("an equilibrium has a tangent"),
        };
        Ok(Carried { share, moved, room, asked })
    }

    /// The longest part of a path that is carried, and the mesh there.
    fn longest_part(
        &self,
        law: &dyn EnergyLaw,
        path: &dyn Fn(f64) -> Vec<Point>,
    ) -> Result<(f64, Moved), RemeshError> {
        let is_final = law.has_one_equilibrium();
        // Of a law with several equilibria those near a tangled one are tangled too: what is carried leads to what is.
        let mut near = if is_final { None } else { Some(law.equilibrium(&path(0.0))?) };
        let (mut low, mut high, mut best) = (0.0, 1.0, None);
        for _ in 0..SHARE_BITS {
            let middle = 0.5 * (low + high);
            let design = path(middle);
            let nearby = near.as_ref().map(|near| settled(law.near(near, &design))).transpose()?.flatten();
            let own = match nearby {
                None => settled(law.equilibrium(&design))?,
                nearby => nearby,
            };
            match self.roomy(law, own.clone())? {
                Some(moved) => {
                    (low, best) = (middle, Some(moved));
                    near = if is_final { None } else { own };
                }
                None => high = middle,
            }
        }
        // The mesh of a design is that which is found from nothing else.
        while low > 0.0 {
            let own =
                if is_final { best.take() } else { self.roomy(law, settled(law.equilibrium(&path(low)))?)? };
            if let Some(moved) = own {
                return Ok((low, moved));
            }
            low = if low > SHORTEST_PART { 0.5 * low } else { 0.0 };
        }
        Ok((0.0, self.at(law.equilibrium(&path(0.0))?)?))
    }

    /// The mesh of an equilibrium, where there is one and it has the least room.
    fn roomy(&self, law: &dyn EnergyLaw, own: Option<Equilibrium>) -> Result<Option<Moved>, RemeshError> {
        let has_room = |own: &Equilibrium| soft_minimum(&law.stretches(&own.displacement)).0 >= LEAST_ROOM;
        match own.filter(has_room).map(|own| self.at(own)) {
            None | Some(Err(RemeshError::Inverted { .. })) => Ok(None),
            Some(moved) => moved.map(Some),
        }
    }
}

impl Room {
    /// What the room at one design promises of another one that has no equilibrium: no more than none.
    fn continued(self, from: &[Point], to: &[Point]) -> Self {
        let along = |((from, to), slope): ((&Point, &Point), &Point)| dot(sub(*to, *from), *slope);
        let change: f64 = from.iter().zip(to).zip(&self.gradient).map(along).sum();
        Self { value: (self.value + change).min(0.0), ..self }
    }
}

/// An equilibrium; `None` where the nodes do not come to rest.
fn settled(own: Result<Equilibrium, RemeshError>) -> Result<Option<Equilibrium>, RemeshError> {
    match own {
        Err(RemeshError::NotSettled { .. }) => Ok(None),
        own => own.map(Some),
    }
}

/// The room of displacements of all nodes, with their derivative by those of the design nodes.
///
/// # Errors
/// [`RemeshError::NotFinite`].
fn room_of(law: &dyn EnergyLaw, displacement: &[Point], tangent: &ElasticMap) -> Result<Room, RemeshError> {
    let stretches = law.stretches(displacement);
    let (value, shares) = soft_minimum(&stretches);
    let gradient = tangent.gradient(&law.stretch_derivative(displacement, &shares))?;
    let least = (0..stretches.len()).min_by(|&a, &b| stretches[a].total_cmp(&stretches[b]));
    let element = law.rest().elements()[least.expect("a body has elements")];
    Ok(Room { value, gradient, element })
}

/// `−1/β ln Σ_e exp(−β J_e)`, and its derivative by each `J_e`.
fn soft_minimum(stretches: &[f64]) -> (f64, Vec<f64>) {
    let least = stretches.iter().copied().fold(f64::INFINITY, f64::min);
    let terms: Vec<f64> = stretches.iter().map(|j| (-SHARPNESS * (j - least)).exp()).collect();
    let sum = ordered_sum(terms.len(), |i| terms[i]);
    (least - sum.ln() / SHARPNESS, terms.iter().map(|term| term / sum).collect())
}
