//! Coils as `J = curl T`: the source of the A–ψ system is `∫T·curl w`.
//!
//! Writing `T` and not `J` on the right makes the discrete current exactly free of divergence, whether or not the mesh
//! follows the coil. Lives here: the coil's shape, its `T` ([`racetrack`]) and the exact integral of `T` over a
//! tetrahedron that the coil's edges cut ([`cut`]). `T` is fixed in space: elements that meet it must not move.

pub mod cut;
pub mod racetrack;

pub use racetrack::{Corner, Racetrack};

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
    pub shape: Racetrack,
}

/// `∫_e T λ_b dV` of the elements that meet a coil's `T` [A m²] for one ampere-turn, ascending by element.
pub fn moments(coil: &Racetrack, mesh: &Mesh) -> Vec<(ElementId, [Point; 4])> {
    let elements: Vec<ElementId> = mesh.topology().elements().collect();
    elements
        .into_par_iter()
        .filter_map(|e| {
            let moment = coil.moment(mesh.vertices(e));
            (moment != [0.0; 3]).then_some((e, [moment.map(|m| 0.25 * m); 4]))
        })
        .collect()
}
