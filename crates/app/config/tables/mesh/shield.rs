//! `[mesh.shield]`: a quarter of a plate under a coil.

use fluxmorph_geometry::generate::{ObservationBox, ShieldParameters};

use super::grading::{GROWTHS, REFINEMENTS};
use crate::config::section::Section;
use crate::config::table::table;
use crate::config::tables::order::{check_interval, check_layers};

table! {
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
    pub struct ShieldMesh: Default {
        /// Half length in x, half length in y, and thickness of the plate [m].
        plate: [f64; 3] = length(POSITIVE) => ShieldParameters::default().plate;
        /// Distance of the design nodes [m], which divides both half lengths of the plate; the mesh has lines at its multiples.
        pitch: f64 = length(POSITIVE) => ShieldParameters::default().pitch;
        /// Depths of mesh lines below both large faces of the plate [m], growing, at most half the thickness; `[]`: none. The
        /// default ends where the middle of the plate is reached, so that another thickness needs no other lines.
        skin: Vec<f64> = length(POSITIVE) => ShieldParameters::default().skin;
        /// Depths of mesh lines behind the free sides of the plate [m], growing, less than the half lengths; `[]`: none.
        side_skin: Vec<f64> = length(POSITIVE) => ShieldParameters::default().side_skin;
        /// Inner half sizes of the coil, along which the mesh has lines [m]. The source itself is `[[coils]]`.
        coil_half_window: [f64; 2] = length(POSITIVE) => ShieldParameters::default().coil_half_window;
        /// Radial width of the coil, for the lines of the mesh [m].
        coil_width: f64 = length(POSITIVE) => ShieldParameters::default().coil_width;
        /// Lower and upper end of the coil [m], above the plate.
        coil_z: [f64; 2] = length(FINITE) => ShieldParameters::default().coil_z;
        /// Observation region along x [m], the lower end first.
        observation_x: [f64; 2] = length(FINITE) => ShieldParameters::default().observation.x;
        /// Observation region along y [m], the lower end first.
        observation_y: [f64; 2] = length(FINITE) => ShieldParameters::default().observation.y;
        /// Observation region along z [m], the lower end first, outside the part that moves.
        observation_z: [f64; 2] = length(FINITE) => ShieldParameters::default().observation.z;
        /// Observation cells along x and y; there is one along z.
        observation_cells: [usize; 2] = integer(1, 10_000) => ShieldParameters::default().observation.cells;
        /// Upper end of the region `remesh` along x and y [m], beyond the plate.
        remesh_upper: [f64; 2] = length(POSITIVE) => ShieldParameters::default().remesh_upper;
        /// Lower and upper end of the region `remesh` along z [m], around the plate.
        remesh_z: [f64; 2] = length(FINITE) => ShieldParameters::default().remesh_z;
        /// Upper end of the whole box along x and y [m], beyond all else.
        outer: [f64; 2] = length(POSITIVE) => ShieldParameters::default().outer;
        /// Lower and upper end of the whole box along z [m], beyond all else.
        outer_z: [f64; 2] = length(FINITE) => ShieldParameters::default().outer_z;
        /// Size of the cells over the plate, the coil and the observation region [m].
        in_plane_size: f64 = length(POSITIVE) => ShieldParameters::default().in_plane_size;
        /// Height of the air layers of the region `remesh` [m].
        air_layer: f64 = length(POSITIVE) => ShieldParameters::default().air_layer;
        /// First air cell beside the free sides of the plate, where they have a skin [m].
        side_air: f64 = length(POSITIVE) => ShieldParameters::default().side_air;
        /// Ratio of neighbouring cells of growing air.
        growth: f64 = number(GROWTHS) => ShieldParameters::default().growth;
        /// All sizes are divided by it, and the layers of a skin into as many.
        refinement: f64 = number(REFINEMENTS) => ShieldParameters::default().refinement;
    }
    check = ShieldMesh::check;
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
            division: None,
        }
    }

    fn check(&mut self, section: &Section<'_>) {
        check_layers(section, "skin", &self.skin);
        check_layers(section, "side_skin", &self.side_skin);
        for (key, ends) in [
            ("coil_z", self.coil_z),
            ("observation_x", self.observation_x),
            ("observation_y", self.observation_y),
            ("observation_z", self.observation_z),
            ("remesh_z", self.remesh_z),
            ("outer_z", self.outer_z),
        ] {
            check_interval(section, key, ends);
        }
        if !section.has("skin") {
            // Lines of both halves of the plate; one in the very middle stays, where both skins meet. Room for rounding: 5 mm is
            // half of 10 mm, whatever the binary form of both.
            let deepest = 0.5 * self.plate[2] * (1.0 + 1e-9);
            self.skin.retain(|depth| *depth <= deepest);
        }
    }
}
