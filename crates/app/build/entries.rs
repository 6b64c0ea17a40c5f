//! What the entries of a configuration mean to a field problem: the material of a region, and whether it is a magnet, a coil or air.

use fluxmorph_solver::Material;

use crate::config::{self, Coil, CoilShape, Config};

/// What stands for the permeability of steel with a B–H curve where all that counts is that it is iron, but for less at its origin; the
/// skin audit and the field have that of the curve.
const OF_A_CURVE: f64 = 1000.0;

/// What the configuration says of the material of a region.
fn entry<'a>(config: &'a Config, region: &str) -> Option<&'a config::Material> {
    config.regions.get(region).and_then(|region| config.materials.get(&region.material))
}

/// Whether [`OF_A_CURVE`] stands for the permeability of a material.
fn is_of_curve(own: &config::Material) -> bool {
    own.saturates() && (own.saturation.is_none() || own.relative_permeability > OF_A_CURVE)
}

/// The material of a region; air where the configuration says nothing.
pub(crate) fn material(config: &Config, region: &str) -> Material {
    entry(config, region).map_or(Material::AIR, |m| Material {
        relative_permeability: if is_of_curve(m) { OF_A_CURVE } else { m.relative_permeability },
        conductivity: m.conductivity,
    })
}

/// Whether a region is iron with a B–H curve, whose permeability here stands for that of the curve.
pub(crate) fn has_curve(config: &Config, region: &str) -> bool {
    entry(config, region).is_some_and(is_of_curve)
}

/// Whether a region is a permanent magnet.
pub(crate) fn is_magnet(config: &Config, region: &str) -> bool {
    config.regions.get(region).is_some_and(|own| own.remanence.is_some())
}

/// The coils whose winding or conductor a region is.
fn coils_of<'a>(config: &'a Config, region: &str) -> impl Iterator<Item = &'a Coil> {
    config
        .coils
        .iter()
        .filter(move |coil| matches!(&coil.shape, CoilShape::Region(own) if own.region == region))
}

/// Whether a region is a coil.
pub(crate) fn is_wound(config: &Config, region: &str) -> bool {
    coils_of(config, region).next().is_some()
}

/// Whether a region is a part of a body of which the force is computed.
pub(crate) fn is_pushed(config: &Config, region: &str) -> bool {
    config.forces.iter().any(|body| body.regions.iter().any(|own| own == region))
}

/// The coil whose solid conductor a region is.
pub(super) fn solid_coil<'a>(config: &'a Config, region: &str) -> Option<&'a Coil> {
    coils_of(config, region).find(|coil| coil.is_solid())
}

/// Mass density [kg/m³] of a region's material, if it is given.
pub(super) fn density(config: &Config, region: &str) -> Option<f64> {
    config.materials.get(&config.regions.get(region)?.material)?.density
}

/// Whether a region is air to the field: of no other material, no magnet, and none that a surface stands for.
pub(crate) fn is_air(config: &Config, region: &str) -> bool {
    material(config, region) == Material::AIR && !is_magnet(config, region) && config.is_meshed(region)
}
