//! What the entries of a configuration mean to a field problem: the material of a region, the phasor of a coil.

use fluxmorph_geometry::fem::c64;
use fluxmorph_solver::Material;

use crate::config::{Coil, Config};

/// What stands for the permeability of steel with a B–H curve where all that counts is that it is iron.
const OF_A_CURVE: f64 = 1000.0;

/// The material of a region; air where the configuration says nothing.
pub(crate) fn material(config: &Config, region: &str) -> Material {
    let entry = config.regions.get(region).and_then(|region| config.materials.get(&region.material));
    entry.map_or(Material::AIR, |m| Material {
        relative_permeability: if m.saturates() { OF_A_CURVE } else { m.relative_permeability },
        conductivity: m.conductivity,
    })
}

/// The peak phasor of a coil [A].
pub(super) fn phasor(coil: &Coil) -> c64 {
    c64::from_polar(coil.ampere_turns.unwrap_or_default(), coil.phase)
}
