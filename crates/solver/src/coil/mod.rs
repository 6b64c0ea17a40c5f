//! Coils: the sources of the A–ψ system, `∫T·curl w` for an analytic coil, `∫J·w` for a coil of the mesh.
//!
//! Writing `J = curl T` and `T` on the right makes the discrete current exactly free of divergence, whether or not the
//! mesh follows the coil. Lives here: the coil's place ([`frame`]), its shape and `T` ([`racetrack`]), the integral of
//! `T` over a tetrahedron that the coil's edges cut ([`moment`], [`cut`]), the current of a coil that is a region of the
//! mesh ([`region`], on the helpers `patch` and `potential`, and [`divergence`]), what drives a solid conductor ([`solid`], its resistance to second order `conduction`), all of it summed over coils
//! ([`terms`]), where a coil may meet the outside of the mesh ([`planes`]), and whether the current of a region goes on there
//! (`continuity`). `T` and `J` are fixed in space: elements
//! that a winding meets must not move. In its window `T` is constant, and the mesh may move there as long as the patch that moves
//! keeps its outline: `∫T·curl w` is `∮(T × w)·n` on that. A solid conductor may move above 0 Hz.

mod conduction;
pub(crate) mod continuity;
pub mod cut;
pub mod divergence;
pub mod fault;
pub mod frame;
pub mod moment;
mod patch;
pub mod planes;
mod potential;
pub mod racetrack;
pub mod region;
pub mod solid;
pub mod terms;

pub use divergence::CurrentReport;
pub use fault::{PlaneFault, RegionFault};
pub use frame::Frame;
pub use planes::{Condition, ConditionedSurface};
pub use racetrack::{Corner, Racetrack};
pub use region::{Path, RegionCurrent, Terminal};
pub use solid::{Connection, SolidConductor};
pub use terms::SourceTerms;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, Mesh};
use rayon::prelude::*;

/// A coil with its current.
#[derive(Clone, Debug, PartialEq)]
pub struct Coil {
    /// Name, for messages.
    pub name: String,
    /// Ampere-turns, peak phasor [A].
    pub ampere_turns: c64,
    /// Where the current flows.
    pub shape: CoilShape,
}

/// Where a coil's current flows.
#[derive(Clone, Debug, PartialEq)]
pub enum CoilShape {
    /// An analytic coil; the mesh need not follow it.
    Racetrack(Racetrack),
    /// A stranded winding that is a region of the mesh.
    Region(RegionCurrent),
    /// A solid conductor that is a region of the mesh.
    Solid(SolidConductor),
}

impl CoilShape {
    /// The current of a coil that is a region of the mesh; of a solid conductor that at 0 Hz.
    pub fn region_current(&self) -> Option<&RegionCurrent> {
        match self {
            Self::Racetrack(_) => None,
            Self::Region(current) => Some(current),
            Self::Solid(conductor) => Some(conductor.direct_current()),
        }
    }

    /// Whether an element is of the region that the coil is; an analytic coil has none.
    pub(crate) fn flows_in(&self, element: ElementId) -> bool {
        let current = self.region_current().map(RegionCurrent::current_density);
        current.is_some_and(|current| current.binary_search_by_key(&element, |(e, _)| *e).is_ok())
    }
}

impl From<Racetrack> for CoilShape {
    fn from(shape: Racetrack) -> Self {
        Self::Racetrack(shape)
    }
}

impl From<RegionCurrent> for CoilShape {
    fn from(current: RegionCurrent) -> Self {
        Self::Region(current)
    }
}

impl From<SolidConductor> for CoilShape {
    fn from(conductor: SolidConductor) -> Self {
        Self::Solid(conductor)
    }
}

/// `∫_e T λ_b dV` of the elements that meet a coil's `T` for the four barycentric coordinates [A m²], for one
/// ampere-turn, ascending by element.
pub fn moments(coil: &Racetrack, mesh: &Mesh) -> Vec<(ElementId, [Point; 4])> {
    let elements: Vec<ElementId> = mesh.topology().elements().collect();
    elements
        .into_par_iter()
        .filter_map(|e| {
            let moment = coil.moment(mesh.vertices(e));
            (moment != [[0.0; 3]; 4]).then_some((e, moment))
        })
        .collect()
}

/// `∫_e T dV` of the four weighted integrals of an element [A m²]: all that a linear element needs.
pub fn total(moment: [Point; 4]) -> Point {
    std::array::from_fn(|d| moment.iter().map(|m| m[d]).sum())
}
