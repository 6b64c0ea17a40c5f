//! `[mesh]`: a built-in generator with its parameters, or a file.

use std::path::{Path, PathBuf};

use fluxmorph_geometry::generate::BlockParameters;
use schemars::{JsonSchema, Schema};
use serde::{Serialize, Serializer};
use serde_json::json;

mod boxes;
mod shield;
mod sphere;

pub use boxes::{BoxOfRegion, BoxesMesh, Patch, SizeAlong};
pub use shield::ShieldMesh;
pub use sphere::SphereMesh;

use super::choice::{Choice, choice};
use super::range::Range;
use super::section::Section;
use crate::schema::form::{integer, length};
use crate::schema::rules::{Rules, is};

/// Ratios of neighbouring cells.
const GROWTHS: Range = Range::closed(1.0, 100.0);
/// Factors that all sizes of a mesh are divided by.
const REFINEMENTS: Range = Range::closed(0.25, 20.0);

/// Where the mesh comes from: a built-in generator with its parameters, or a file. Either `generator` or `file`.
///
/// ```toml
/// [mesh]
/// file = "device.msh"
/// unit = "mm"
/// ```
#[derive(Debug, Clone, PartialEq, JsonSchema)]
#[schemars(rename = "Mesh", with = "WrittenMesh")]
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
        /// The paper's plate under a coil, with its parameters in `[mesh.shield]`.
        Shield = "shield",
        /// A box of equal cells, with its parameters in `[mesh.block]`.
        Block = "block",
        /// Regions with faces along the axes, which `[mesh.boxes]` describes.
        Boxes = "boxes",
        /// A solid or hollow sphere, with its parameters in `[mesh.sphere]`.
        Sphere = "sphere",
    }
}

/// A box of equal cells with one corner in the origin, as in the paper's first example. Region `block`; surfaces `x_min`,
/// `x_max`, `y_min`, `y_max`, `z_min` and `z_max`.
///
/// ```toml
/// [mesh]
/// generator = "block"
///
/// [mesh.block]
/// size = ["80 mm", "80 mm", "80 mm"]
/// cells = [8, 8, 8]
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default)]
pub struct BlockMesh {
    /// Edge lengths of the block [m].
    #[schemars(transform = length(Range::POSITIVE))]
    pub size: [f64; 3],
    /// Cells along x, y and z, six tetrahedra each.
    #[schemars(transform = integer(1, 1000))]
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
            (true, true) => section.clash(
                ["generator", "file"],
                "`mesh.file` and `mesh.generator` are both given",
                "one of them: a mesh is read or generated",
            ),
            (false, false) => {
                section.missing("generator", "generator = \"shield\", or file = \"device.msh\"")
            }
            (false, true) if !section.has("unit") => section.missing("unit", "unit = \"mm\""),
            (true, false) if section.has("unit") => section.clash(
                ["generator", "unit"],
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

/// Depths of layers, each below the one before.
fn layers(section: &Section<'_>, key: &'static str) -> Option<Vec<f64>> {
    let depths = section.length_list(key, Range::POSITIVE)?;
    if let Some(k) = (1..depths.len()).find(|&k| depths[k - 1] >= depths[k]) {
        section.wrong(
            &format!("{key}[{k}]"),
            format!("`{}.{key}` goes from {} m to {} m", section.path(), depths[k - 1], depths[k]),
            "depths that grow from one to the next",
        );
        return None;
    }
    Some(depths)
}

/// The keys of `[mesh]` in the schema.
#[derive(JsonSchema)]
#[schemars(transform = keys_of_the_mesh)]
#[allow(dead_code, reason = "stands for the keys of `MeshConfig` in the schema")]
struct WrittenMesh {
    /// A built-in mesh, with its parameters in the table of its name, such as `[mesh.shield]`. Either this or `file`.
    generator: Option<Generator>,
    /// Path of a Gmsh file, relative to the folder of the configuration. The section on mesh files in
    /// `docs/configuration.md` says what it may hold. Instead of `generator`.
    file: Option<String>,
    /// Unit of the coordinates in the file, which does not say it itself. Required with `file`.
    unit: Option<LengthUnit>,
    /// Parameters of the generator `shield`.
    shield: Option<ShieldMesh>,
    /// Parameters of the generator `block`.
    block: Option<BlockMesh>,
    /// Regions and sizes for the generator `boxes`; required with it.
    boxes: Option<BoxesMesh>,
    /// Parameters of the generator `sphere`.
    sphere: Option<SphereMesh>,
}

/// A generator has its own table, a file its unit.
fn keys_of_the_mesh(schema: &mut Schema) {
    let mut rules = Rules::of(schema)
        .exactly_one(&["generator", "file"])
        .needs("file", &["unit"])
        .needs("unit", &["file"])
        .add(json!({ "if": is("generator", &[Generator::Boxes.name()]), "then": { "required": ["boxes"] } }));
    for (table, _) in Generator::CHOICES {
        rules = rules.add(json!({ "dependentSchemas": { (*table): is("generator", &[table]) } }));
    }
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
