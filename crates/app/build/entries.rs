//! What the entries of a configuration mean to a field problem: the material of a region.

use fluxmorph_solver::Material;

use crate::config::Config;

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
