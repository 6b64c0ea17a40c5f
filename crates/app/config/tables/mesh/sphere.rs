//! `[mesh.sphere]`: an octant of a solid or hollow ball in a larger one.

use fluxmorph_geometry::generate::SphereParameters;
use serde_json::json;

use super::grading::{GROWTHS, REFINEMENTS};
use crate::config::section::Section;
use crate::config::table::table;
use crate::config::tables::order::check_layers;
use crate::config::value::LONGEST_LENGTH;

table! {
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
    pub struct SphereMesh: Default {
        /// Outer radius of the sphere [m].
        radius: f64 = length(POSITIVE) => SphereParameters::default().radius;
        /// Radius of the cavity of a hollow sphere [m], less than `radius`. Default: the sphere is solid.
        inner_radius: Option<f64> = length(POSITIVE);
        /// Radius of the whole mesh [m], more than `radius`. Default: five times `radius`.
        outer_radius: f64 = length(POSITIVE), else (5.0 * radius).min(LONGEST_LENGTH);
        /// Cells along an eighth of a great circle, and along the radius inside the layers.
        divisions: usize = integer(1, 1000) => SphereParameters::default().divisions;
        /// Depths of layers under the surface, or under both surfaces of a hollow sphere [m]: growing, less than the radius, or
        /// at most half the wall.
        skin: Vec<f64> = length(POSITIVE) => SphereParameters::default().skin;
        /// Equal layers of the wall of a hollow sphere without `skin`, and of no other. Default there: 4.
        wall_layers: Option<usize> = integer(1, 1000);
        /// Thickness of the first layer outside [m]. Default: the length of the cells of the surface.
        air_layer: Option<f64> = length(POSITIVE);
        /// Ratio of neighbouring layers outside; none is thicker than 3.5 times the length of its cells.
        growth: f64 = number(GROWTHS) => SphereParameters::default().growth;
        /// Divisions are multiplied by it, layers divided into as many, and the growth becomes its root.
        refinement: f64 = number(REFINEMENTS) => SphereParameters::default().refinement;
    }
    check = SphereMesh::check;
    rules = |rules| rules.add(json!({ "dependentSchemas": { "wall_layers": {
        "required": ["inner_radius"], "properties": { "skin": { "maxItems": 0 } },
    } } }));
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

    fn check(&mut self, section: &Section<'_>) {
        check_layers(section, "skin", &self.skin);
        if section.has("wall_layers") && (self.inner_radius.is_none() || !self.skin.is_empty()) {
            section.wrong(
                "wall_layers",
                "`mesh.sphere.wall_layers` divides the wall of a hollow sphere without `skin`",
                "`inner_radius` and no `skin` beside it, or no `wall_layers`",
            );
        }
        if self.inner_radius.is_some() && self.skin.is_empty() {
            self.wall_layers.get_or_insert(SphereParameters::default().wall_layers);
        }
    }
}
