//! `[mesh.sphere]`: an octant of a solid or hollow ball in a larger one.

use fluxmorph_geometry::generate::SphereParameters;
use schemars::{JsonSchema, Schema};
use serde::Serialize;
use serde_json::json;

use super::{GROWTHS, REFINEMENTS, layers};
use crate::config::Dimension;
use crate::config::range::Range;
use crate::config::section::Section;
use crate::schema::form::{integer, length, no_default, number};
use crate::schema::rules::Rules;

/// A solid or hollow sphere in a larger ball: the octant x, y, z ≥ 0, whose symmetry planes are the coordinate planes. All
/// nodes lie on spheres about the origin; faces are flat, so that volumes and areas err with the square of the cell size.
/// Every key has a default.
///
/// Regions: `sphere`, `air`, and `cavity` of a hollow sphere. Surfaces: `x_min`, `y_min`, `z_min` (the symmetry planes),
/// `outer`, `sphere` and, of a hollow sphere, `cavity`.
///
/// ```toml
/// [mesh]
/// generator = "sphere"
///
/// [mesh.sphere]
/// radius = "50 mm"
/// inner_radius = "45 mm"
/// wall_layers = 6
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default, transform = layers_of_a_wall)]
pub struct SphereMesh {
    /// Outer radius of the sphere [m].
    #[schemars(transform = length(Range::POSITIVE))]
    pub radius: f64,
    /// Radius of the cavity of a hollow sphere [m], less than `radius`. Default: the sphere is solid.
    #[schemars(transform = length(Range::POSITIVE))]
    pub inner_radius: Option<f64>,
    /// Radius of the whole mesh [m], more than `radius`. Default: five times `radius`.
    #[schemars(with = "Option<f64>", transform = length(Range::POSITIVE), transform = no_default)]
    pub outer_radius: f64,
    /// Cells along an eighth of a great circle, and along the radius inside the layers.
    #[schemars(transform = integer(1, 1000))]
    pub divisions: usize,
    /// Depths of layers under the surface, or under both surfaces of a hollow sphere [m]: growing, less than the radius, or
    /// at most half the wall.
    #[schemars(transform = length(Range::POSITIVE))]
    pub skin: Vec<f64>,
    /// Equal layers of the wall of a hollow sphere without `skin`, and of no other. Default there: 4.
    #[schemars(transform = integer(1, 1000))]
    pub wall_layers: Option<usize>,
    /// Thickness of the first layer outside [m]. Default: the length of the cells of the surface.
    #[schemars(transform = length(Range::POSITIVE))]
    pub air_layer: Option<f64>,
    /// Ratio of neighbouring layers outside; none is thicker than 3.5 times the length of its cells.
    #[schemars(transform = number(GROWTHS))]
    pub growth: f64,
    /// Divisions are multiplied by it, layers divided into as many, and the growth becomes its root.
    #[schemars(transform = number(REFINEMENTS))]
    pub refinement: f64,
}

fn layers_of_a_wall(schema: &mut Schema) {
    let hollow = json!({ "required": ["inner_radius"], "properties": { "skin": { "maxItems": 0 } } });
    Rules::of(schema).add(json!({ "dependentSchemas": { "wall_layers": hollow } }));
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
            growth: section.number("growth", GROWTHS).unwrap_or(default.growth),
            refinement: section.number("refinement", REFINEMENTS).unwrap_or(default.refinement),
        };
        section.finish();
        sphere
    }
}
