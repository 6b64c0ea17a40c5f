//! `[mesh.sphere]`: an octant of a solid or hollow ball in a larger one.

use fluxmorph_geometry::generate::SphereParameters;
use serde::Serialize;

use super::layers;
use crate::config::Dimension;
use crate::config::range::Range;
use crate::config::section::Section;

/// Radii and layers of the sphere, as in [`SphereParameters`], whose defaults they take.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SphereMesh {
    /// Outer radius of the sphere [m].
    pub radius: f64,
    /// Radius of the cavity of a hollow sphere [m]; solid without.
    pub inner_radius: Option<f64>,
    /// Radius of the whole mesh [m]. Default: five radii of the sphere.
    pub outer_radius: f64,
    /// Cells along an eighth of a great circle, and along the radius of the core.
    pub divisions: usize,
    /// Depths of layers under the surface, or under both surfaces of a hollow sphere [m].
    pub skin: Vec<f64>,
    /// Equal layers of the wall of a hollow sphere without skin; nothing for any other sphere, for which the key is refused.
    pub wall_layers: Option<usize>,
    /// Thickness of the first layer outside [m]. Default: the length of the surface's cells.
    pub air_layer: Option<f64>,
    /// Ratio of neighbouring layers outside.
    pub growth: f64,
    /// Divisions are multiplied and layers divided by it.
    pub refinement: f64,
}

impl Default for SphereMesh {
    fn default() -> Self {
        let SphereParameters {
            radius,
            inner_radius,
            outer_radius,
            divisions,
            skin,
            wall_layers,
            air_layer,
            growth,
            refinement,
        } = SphereParameters::default();
        Self {
            radius,
            inner_radius,
            outer_radius,
            divisions,
            skin,
            wall_layers: inner_radius.map(|_| wall_layers),
            air_layer,
            growth,
            refinement,
        }
    }
}

impl SphereMesh {
    /// The same for the generator.
    pub fn parameters(&self) -> SphereParameters {
        SphereParameters {
            radius: self.radius,
            inner_radius: self.inner_radius,
            outer_radius: self.outer_radius,
            divisions: self.divisions,
            skin: self.skin.clone(),
            wall_layers: self.wall_layers.unwrap_or(SphereParameters::default().wall_layers),
            air_layer: self.air_layer,
            growth: self.growth,
            refinement: self.refinement,
        }
    }

    pub(super) fn read(section: Section<'_>) -> Self {
        let default = Self::default();
        let length = |key| section.quantity(key, Dimension::Length, Range::POSITIVE);
        let radius = length("radius").unwrap_or(default.radius);
        let inner_radius = length("inner_radius");
        let skin = layers(&section, "skin").unwrap_or_default();
        let wall_layers = section.integer("wall_layers", 1, 1000);
        if section.has("wall_layers") && (inner_radius.is_none() || !skin.is_empty()) {
            section.wrong(
                "wall_layers",
                "`mesh.sphere.wall_layers` divides the wall of a hollow sphere without `skin`",
                "`inner_radius` and no `skin` beside it, or no `wall_layers`",
            );
        }
        let has_plain_wall = inner_radius.is_some() && skin.is_empty();
        let default_layers = has_plain_wall.then_some(SphereParameters::default().wall_layers);
        let sphere = Self {
            radius,
            inner_radius,
            outer_radius: length("outer_radius").unwrap_or(5.0 * radius),
            divisions: section.integer("divisions", 1, 1000).unwrap_or(default.divisions),
            skin,
            wall_layers: wall_layers.or(default_layers),
            air_layer: length("air_layer"),
            growth: section.number("growth", Range::closed(1.0, 100.0)).unwrap_or(default.growth),
            refinement: section.number("refinement", Range::closed(0.25, 20.0)).unwrap_or(default.refinement),
        };
        section.finish();
        sphere
    }
}
