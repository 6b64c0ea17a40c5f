//! `[mesh.shield]`: a quarter of a plate under a coil.

use fluxmorph_geometry::generate::{ObservationBox, ShieldParameters};
use schemars::JsonSchema;
use serde::Serialize;

use super::{GROWTHS, REFINEMENTS, layers};
use crate::config::Dimension;
use crate::config::range::Range;
use crate::config::section::Section;
use crate::schema::form::{integer, length, number};

/// The paper's second example: a plate under a coil, a quarter of it. `x = 0` and `y = 0` are the symmetry planes; the
/// plate's upper face is `z = 0`. Every key has a default, together the reconstructed example.
///
/// Regions: `plate`, `remesh` (the air around the plate that moves), `observation`, `air`. Surfaces: `x_min`, `x_max`,
/// `y_min`, `y_max`, `z_min`, `z_max`, and of the plate `plate_bottom`, `plate_top` and `plate_side`.
///
/// ```toml
/// [mesh]
/// generator = "shield"
///
/// [mesh.shield]
/// plate = ["120 mm", "240 mm", "10 mm"]
/// skin = ["0.3 mm", "0.8 mm", "1.6 mm", "3 mm", "5 mm"]
/// growth = 1.8
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default)]
pub struct ShieldMesh {
    /// Half length in x, half length in y, and thickness of the plate [m].
    #[schemars(transform = length(Range::POSITIVE))]
    pub plate: [f64; 3],
    /// Distance of the design nodes [m], which divides both half lengths of the plate; the mesh has lines at its multiples.
    #[schemars(transform = length(Range::POSITIVE))]
    pub pitch: f64,
    /// Depths of mesh lines below both large faces of the plate [m], growing, at most half the thickness; `[]`: none. The
    /// default ends where the middle of the plate is reached, so that another thickness needs no other lines.
    #[schemars(transform = length(Range::POSITIVE))]
    pub skin: Vec<f64>,
    /// Depths of mesh lines behind the free sides of the plate [m], growing, less than the half lengths; `[]`: none.
    #[schemars(transform = length(Range::POSITIVE))]
    pub side_skin: Vec<f64>,
    /// Inner half sizes of the coil, along which the mesh has lines [m]. The source itself is `[[coils]]`.
    #[schemars(transform = length(Range::POSITIVE))]
    pub coil_half_window: [f64; 2],
    /// Radial width of the coil, for the lines of the mesh [m].
    #[schemars(transform = length(Range::POSITIVE))]
    pub coil_width: f64,
    /// Lower and upper end of the coil [m], above the plate.
    #[schemars(transform = length(Range::FINITE))]
    pub coil_z: [f64; 2],
    /// Observation region along x [m], the lower end first.
    #[schemars(transform = length(Range::FINITE))]
    pub observation_x: [f64; 2],
    /// Observation region along y [m], the lower end first.
    #[schemars(transform = length(Range::FINITE))]
    pub observation_y: [f64; 2],
    /// Observation region along z [m], the lower end first, outside the part that moves.
    #[schemars(transform = length(Range::FINITE))]
    pub observation_z: [f64; 2],
    /// Observation cells along x and y; there is one along z.
    #[schemars(transform = integer(1, 10_000))]
    pub observation_cells: [usize; 2],
    /// Upper end of the region `remesh` along x and y [m], beyond the plate.
    #[schemars(transform = length(Range::POSITIVE))]
    pub remesh_upper: [f64; 2],
    /// Lower and upper end of the region `remesh` along z [m], around the plate.
    #[schemars(transform = length(Range::FINITE))]
    pub remesh_z: [f64; 2],
    /// Upper end of the whole box along x and y [m], beyond all else.
    #[schemars(transform = length(Range::POSITIVE))]
    pub outer: [f64; 2],
    /// Lower and upper end of the whole box along z [m], beyond all else.
    #[schemars(transform = length(Range::FINITE))]
    pub outer_z: [f64; 2],
    /// Size of the cells over the plate, the coil and the observation region [m].
    #[schemars(transform = length(Range::POSITIVE))]
    pub in_plane_size: f64,
    /// Height of the air layers of the region `remesh` [m].
    #[schemars(transform = length(Range::POSITIVE))]
    pub air_layer: f64,
    /// First air cell beside the free sides of the plate, where they have a skin [m].
    #[schemars(transform = length(Range::POSITIVE))]
    pub side_air: f64,
    /// Ratio of neighbouring cells of growing air.
    #[schemars(transform = number(GROWTHS))]
    pub growth: f64,
    /// All sizes are divided by it, and the layers of a skin into as many.
    #[schemars(transform = number(REFINEMENTS))]
    pub refinement: f64,
}

impl Default for ShieldMesh {
    fn default() -> Self {
        let ShieldParameters {
            plate,
            pitch,
            skin,
            side_skin,
            coil_half_window,
            coil_width,
            coil_z,
            observation,
            remesh_upper,
            remesh_z,
            outer,
            outer_z,
            in_plane_size,
            air_layer,
            side_air,
            growth,
            refinement,
        } = ShieldParameters::default();
        Self {
            plate,
            pitch,
            skin,
            side_skin,
            coil_half_window,
            coil_width,
            coil_z,
            observation_x: observation.x,
            observation_y: observation.y,
            observation_z: observation.z,
            observation_cells: observation.cells,
            remesh_upper,
            remesh_z,
            outer,
            outer_z,
            in_plane_size,
            air_layer,
            side_air,
            growth,
            refinement,
        }
    }
}

impl ShieldMesh {
    /// The same for the generator.
    pub fn parameters(&self) -> ShieldParameters {
        ShieldParameters {
            plate: self.plate,
            pitch: self.pitch,
            skin: self.skin.clone(),
            side_skin: self.side_skin.clone(),
            coil_half_window: self.coil_half_window,
            coil_width: self.coil_width,
            coil_z: self.coil_z,
            observation: ObservationBox {
                x: self.observation_x,
                y: self.observation_y,
                z: self.observation_z,
                cells: self.observation_cells,
            },
            remesh_upper: self.remesh_upper,
            remesh_z: self.remesh_z,
            outer: self.outer,
            outer_z: self.outer_z,
            in_plane_size: self.in_plane_size,
            air_layer: self.air_layer,
            side_air: self.side_air,
            growth: self.growth,
            refinement: self.refinement,
        }
    }

    pub(super) fn read(section: Section<'_>) -> Self {
        let default = Self::default();
        let length = |key| section.quantity(key, Dimension::Length, Range::POSITIVE);
        let plate = section.lengths("plate", Range::POSITIVE).unwrap_or(default.plate);
        let shield = Self {
            plate,
            pitch: length("pitch").unwrap_or(default.pitch),
            skin: layers(&section, "skin").unwrap_or_else(|| down_to_the_middle(default.skin, plate[2])),
            side_skin: layers(&section, "side_skin").unwrap_or(default.side_skin),
            coil_half_window: section
                .lengths("coil_half_window", Range::POSITIVE)
                .unwrap_or(default.coil_half_window),
            coil_width: length("coil_width").unwrap_or(default.coil_width),
            coil_z: section.interval("coil_z").unwrap_or(default.coil_z),
            observation_x: section.interval("observation_x").unwrap_or(default.observation_x),
            observation_y: section.interval("observation_y").unwrap_or(default.observation_y),
            observation_z: section.interval("observation_z").unwrap_or(default.observation_z),
            observation_cells: section
                .integers("observation_cells", 1, 10_000)
                .unwrap_or(default.observation_cells),
            remesh_upper: section.lengths("remesh_upper", Range::POSITIVE).unwrap_or(default.remesh_upper),
            remesh_z: section.interval("remesh_z").unwrap_or(default.remesh_z),
            outer: section.lengths("outer", Range::POSITIVE).unwrap_or(default.outer),
            outer_z: section.interval("outer_z").unwrap_or(default.outer_z),
            in_plane_size: length("in_plane_size").unwrap_or(default.in_plane_size),
            air_layer: length("air_layer").unwrap_or(default.air_layer),
            side_air: length("side_air").unwrap_or(default.side_air),
            growth: section.number("growth", GROWTHS).unwrap_or(default.growth),
            refinement: section.number("refinement", REFINEMENTS).unwrap_or(default.refinement),
        };
        section.finish();
        shield
    }
}

/// The depths of default skin lines that fit into both halves of a plate of this thickness [m].
///
/// A line in the very middle stays: it is the one where both skins meet.
fn down_to_the_middle(depths: Vec<f64>, thickness: f64) -> Vec<f64> {
    // Room for rounding: 5 mm is half of 10 mm, whatever the binary form of both.
    let deepest = 0.5 * thickness * (1.0 + 1e-9);
    depths.into_iter().filter(|depth| *depth <= deepest).collect()
}
