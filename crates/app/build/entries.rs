//! What the entries of a configuration mean to a field problem: the material of a region, and whether it is air.

use fluxmorph_solver::Material;

use crate::config::{Config, Region, RegionModel};

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

/// Whether a region is air to the field: of no other material, no magnet, and none that a surface stands for.
pub(crate) fn is_air(config: &Config, region: &str) -> bool {
    let acts = |own: &Region| own.remanence.is_some() || own.model != RegionModel::Volume;
    material(config, region) == Material::AIR && !config.regions.get(region).is_some_and(acts)
}
