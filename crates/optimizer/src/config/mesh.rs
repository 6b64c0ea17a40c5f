//! `[mesh]`: a built-in generator with its parameters, or a file.

use std::path::{Path, PathBuf};

use fluxmorph_geometry::generate::{BlockParameters, ObservationBox, ShieldParameters};
use serde::{Serialize, Serializer};

mod boxes;
mod sphere;

pub use boxes::{BoxOfRegion, BoxesMesh, Patch, SizeAlong};
pub use sphere::SphereMesh;

use super::Dimension;
use super::choice::choice;
use super::range::Range;
use super::section::Section;

/// Where the mesh comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum MeshConfig {
    /// The shield plate of the paper's second example.
    Shield(Box<ShieldMesh>),
    /// A box of equal cells, as in the paper's first example.
    Block(BlockMesh),
    /// Regions with faces along the axes.
    Boxes(Box<BoxesMesh>),
    /// An octant of a ball in a larger one.
    Sphere(SphereMesh),
    /// A mesh file.
    File {
        /// Absolute path of the file, or relative to the working directory for a text without a file.
        path: PathBuf,
        /// The unit of its coordinates.
        unit: LengthUnit,
    },
}

choice! {
    /// Unit of the coordinates in a mesh file, which does not say it itself.
    pub enum LengthUnit {
        /// 1 m.
        Metre = "m",
        /// 0.01 m.
        Centimetre = "cm",
        /// 0.001 m.
        Millimetre = "mm",
        /// 0.0254 m.
        Inch = "in",
    }
}

impl LengthUnit {
    /// Metres in one unit [m].
    pub fn metres(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Centimetre => 0.01,
            Self::Millimetre => 0.001,
            Self::Inch => 0.0254,
        }
    }
}

choice! {
    /// The built-in meshes.
    pub enum Generator {
        /// The shield plate.
        Shield = "shield",
        /// The block.
        Block = "block",
        /// Boxes.
        Boxes = "boxes",
        /// The sphere.
        Sphere = "sphere",
    }
}

/// Dimensions of the shield's mesh, as in [`ShieldParameters`], whose defaults they take.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShieldMesh {
    /// Half length in x, half length in y, and thickness of the plate [m].
    pub plate: [f64; 3],
    /// Distance of the design nodes [m].
    pub pitch: f64,
    /// Depths of the mesh lines below both faces of the plate [m]; empty: no lines. Default: those of the generator
    /// down to the middle of the plate, so that another thickness needs no other lines.
    pub skin: Vec<f64>,
    /// Depths of the mesh lines behind the free sides of the plate [m]; empty: no lines.
    pub side_skin: Vec<f64>,
    /// Inner half sizes of the coil, on which mesh lines are laid [m].
    pub coil_half_window: [f64; 2],
    /// Radial width of the coil [m].
    pub coil_width: f64,
    /// Lower and upper end of the coil [m].
    pub coil_z: [f64; 2],
    /// Observation region in x [m].
    pub observation_x: [f64; 2],
    /// Observation region in y [m].
    pub observation_y: [f64; 2],
    /// Observation region in z [m].
    pub observation_z: [f64; 2],
    /// Observation cells along x and y; one along z.
    pub observation_cells: [usize; 2],
    /// Upper end of the remesh region in x and y [m].
    pub remesh_upper: [f64; 2],
    /// Lower and upper end of the remesh region in z [m].
    pub remesh_z: [f64; 2],
    /// Upper end of the outer box in x and y [m].
    pub outer: [f64; 2],
    /// Lower and upper end of the outer box in z [m].
    pub outer_z: [f64; 2],
    /// Size of the cells over the plate, the coil and the observation region [m].
    pub in_plane_size: f64,
    /// Height of the air layers of the remesh region [m].
    pub air_layer: f64,
    /// First air cell beside the free sides of the plate, where they have a skin [m].
    pub side_air: f64,
    /// Ratio of neighbouring cells of growing air.
    pub growth: f64,
    /// All sizes are divided by it.
    pub refinement: f64,
}

/// Dimensions of the block's mesh, as in [`BlockParameters`], whose defaults they take.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BlockMesh {
    /// Edge lengths of the block [m].
    pub size: [f64; 3],
    /// Cells along x, y and z.
    pub cells: [usize; 3],
}

impl MeshConfig {
    pub(super) fn read(section: &Section<'_>, directory: &Path) -> Self {
        let generator = section.choice::<Generator>("generator");
        let file = section.text("file");
        let unit = section.choice::<LengthUnit>("unit");
        let shield = section.table("shield").map(ShieldMesh::read).unwrap_or_default();
        let block = section.table("block").map(BlockMesh::read).unwrap_or_default();
        let boxes = section.table("boxes").map(BoxesMesh::read);
        let sphere = section.table("sphere").map(SphereMesh::read).unwrap_or_default();

        match (section.has("generator"), section.has("file")) {
            (true, true) => section.wrong(
                "file",
                "`mesh.file` and `mesh.generator` are both given",
                "one of them: a mesh is read or generated",
            ),
            (false, false) => {
                section.missing("generator", "generator = \"shield\", or file = \"device.msh\"")
            }
            (false, true) if !section.has("unit") => section.missing("unit", "unit = \"mm\""),
            (true, false) if section.has("unit") => section.wrong(
                "unit",
                "`mesh.unit` belongs to `mesh.file`, and a generator is given",
                "no unit: the generator's parameters carry their own",
            ),
            _ => {}
        }
        if generator == Some(Generator::Boxes) && !section.has("boxes") {
            section.missing("boxes", "[mesh.boxes] with the box of the whole and its regions");
        }
        let owners = [
            ("shield", Generator::Shield),
            ("block", Generator::Block),
            ("boxes", Generator::Boxes),
            ("sphere", Generator::Sphere),
        ];
        for (key, owner) in owners {
            let other_mesh = match generator {
                Some(generator) => generator != owner,
                None => section.has("file") && !section.has("generator"),
            };
            if section.has(key) && other_mesh {
                section.wrong(
                    key,
                    format!("`mesh.{key}` has no use without generator = \"{key}\""),
                    format!("generator = \"{key}\" in `mesh`, or no table `mesh.{key}`"),
                );
            }
        }
        match (file, generator) {
            (Some(file), _) => {
                Self::File { path: directory.join(file), unit: unit.unwrap_or(LengthUnit::Metre) }
            }
            (None, Some(Generator::Block)) => Self::Block(block),
            (None, Some(Generator::Boxes)) => Self::Boxes(Box::new(boxes.unwrap_or_default())),
            (None, Some(Generator::Sphere)) => Self::Sphere(sphere),
            (None, _) => Self::Shield(Box::new(shield)),
        }
    }
}

impl MeshConfig {
    /// The same with a refinement so many times as large; `None` for a mesh without such a parameter.
    pub fn refined(&self, factor: f64) -> Option<Self> {
        let mut refined = self.clone();
        match &mut refined {
            Self::Shield(shield) => shield.refinement *= factor,
            Self::Boxes(boxes) => boxes.refinement *= factor,
            Self::Sphere(sphere) => sphere.refinement *= factor,
            Self::Block(_) | Self::File { .. } => return None,
        }
        Some(refined)
    }

    /// Tetrahedra that a generator makes; `None` for a file, and for parameters that the generator refuses.
    pub fn tet_count(&self) -> Option<u64> {
        let tets = match self {
            Self::Shield(shield) => shield.parameters().tet_count(),
            Self::Block(block) => block.parameters().tet_count(),
            Self::Boxes(boxes) => boxes.parameters().tet_count(),
            Self::Sphere(sphere) => sphere.parameters().tet_count(),
            Self::File { .. } => return None,
        };
        tets.ok().map(|tets| tets as u64)
    }
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

    fn read(section: Section<'_>) -> Self {
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
            growth: section.number("growth", Range::closed(1.0, 100.0)).unwrap_or(default.growth),
            refinement: section.number("refinement", Range::closed(0.25, 20.0)).unwrap_or(default.refinement),
        };
        section.finish();
        shield
    }
}

impl Default for BlockMesh {
    fn default() -> Self {
        let BlockParameters { size, cells } = BlockParameters::default();
        Self { size, cells }
    }
}

impl BlockMesh {
    /// The same for the generator.
    pub fn parameters(&self) -> BlockParameters {
        BlockParameters { size: self.size, cells: self.cells }
    }

    fn read(section: Section<'_>) -> Self {
        let default = Self::default();
        let block = Self {
            size: section.lengths("size", Range::POSITIVE).unwrap_or(default.size),
            cells: section.integers("cells", 1, 1000).unwrap_or(default.cells),
        };
        section.finish();
        block
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

/// Depths of layers, each below the one before.
fn layers(section: &Section<'_>, key: &'static str) -> Option<Vec<f64>> {
    let depths = section.length_list(key, Range::POSITIVE)?;
    if let Some(pair) = depths.windows(2).find(|pair| pair[0] >= pair[1]) {
        section.wrong(
            key,
            format!("`{}.{key}` goes from {} m to {} m", section.path(), pair[0], pair[1]),
            "depths that grow from one to the next",
        );
        return None;
    }
    Some(depths)
}

/// The keys of `[mesh]` as they are written.
#[derive(Serialize)]
struct MeshKeys<'a> {
    generator: Option<Generator>,
    file: Option<std::borrow::Cow<'a, str>>,
    unit: Option<LengthUnit>,
    shield: Option<&'a ShieldMesh>,
    block: Option<&'a BlockMesh>,
    boxes: Option<&'a BoxesMesh>,
    sphere: Option<&'a SphereMesh>,
}

impl Serialize for MeshConfig {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut keys = MeshKeys {
            generator: None,
            file: None,
            unit: None,
            shield: None,
            block: None,
            boxes: None,
            sphere: None,
        };
        match self {
            Self::Shield(shield) => {
                keys.generator = Some(Generator::Shield);
                keys.shield = Some(shield);
            }
            Self::Block(block) => {
                keys.generator = Some(Generator::Block);
                keys.block = Some(block);
            }
            Self::Boxes(boxes) => {
                keys.generator = Some(Generator::Boxes);
                keys.boxes = Some(boxes);
            }
            Self::Sphere(sphere) => {
                keys.generator = Some(Generator::Sphere);
                keys.sphere = Some(sphere);
            }
            Self::File { path, unit } => {
                keys.file = Some(path.to_string_lossy());
                keys.unit = Some(*unit);
            }
        }
        keys.serialize(serializer)
    }
}
