//! `[mesh]`: a built-in generator with its parameters, or a file.

use std::path::PathBuf;

use fluxmorph_geometry::generate::BlockParameters;
use serde::Serialize;
use serde_json::json;

mod boxes;
mod grading;
mod shield;
mod sphere;

pub use boxes::{BoxOfRegion, BoxesMesh, Patch, SizeAlong};
pub use shield::ShieldMesh;
pub use sphere::SphereMesh;

use crate::config::section::Section;
use crate::config::table::rules::{Rules, is};
use crate::config::table::{Group, table};
use crate::config::value::Placeholder;
use crate::config::value::choice::{Choice, choice};

/// Where the mesh comes from.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(into = "MeshKeys")]
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

table! {
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
    pub struct BlockMesh: Default {
        /// Edge lengths of the block [m].
        size: [f64; 3] = length(POSITIVE) => BlockParameters::default().size;
        /// Cells along x, y and z, six tetrahedra each.
        cells: [usize; 3] = integer(1, 1000) => BlockParameters::default().cells;
    }
}

table! {
    /// Where the mesh comes from: a built-in generator with its parameters, or a file. Either `generator` or `file`.
    ///
    /// ```toml
    /// [mesh]
    /// file = "device.msh"
    /// unit = "mm"
    /// ```
    #[derive(Default)]
    pub(in crate::config) struct MeshKeys as "Mesh" {
        /// A built-in mesh, with its parameters in the table of its name, such as `[mesh.shield]`. Either this or `file`.
        generator: Option<Generator> = WORD;
        /// Path of a Gmsh file, relative to the folder of the configuration. The section on mesh files in
        /// `docs/configuration.md` says what it may hold. Instead of `generator`.
        file: Option<String> = TEXT;
        /// Unit of the coordinates in the file, which does not say it itself. Required with `file`.
        unit: Option<LengthUnit> = WORD;
        /// Parameters of the generator `shield`.
        shield: Option<ShieldMesh> = TABLE;
        /// Parameters of the generator `block`.
        block: Option<BlockMesh> = TABLE;
        /// Regions and sizes for the generator `boxes`; required with it.
        boxes: Option<BoxesMesh> = TABLE;
        /// Parameters of the generator `sphere`.
        sphere: Option<SphereMesh> = TABLE;
    }
    check = MeshKeys::check;
    rules = keys_of_the_mesh;
}

/// A generator has its own table, a file its unit.
fn keys_of_the_mesh(rules: Rules) -> Rules {
    let mut rules =
        rules.exactly_one(&["generator", "file"]).needs("file", &["unit"]).needs("unit", &["file"]).add(
            json!({ "if": is("generator", &[Generator::Boxes.name()]), "then": { "required": ["boxes"] } }),
        );
    for (table, ..) in Generator::choices() {
        let own = json!({ "properties": { "generator": { "enum": [table] } }, "required": ["generator"] });
        rules = rules.add(json!({ "dependentSchemas": { (table): own } }));
    }
    rules
}

impl MeshKeys {
    fn check(&mut self, section: &Section<'_>) {
        match (section.has("generator"), section.has("file")) {
            (true, true) => section.clash(
                ["generator", "file"],
                "`mesh.file` and `mesh.generator` are both given",
                "one of them: a mesh is read or generated",
            ),
            (false, false) => {
                section.missing(&["generator", "file"], "generator = \"shield\", or file = \"device.msh\"")
            }
            (false, true) if !section.has("unit") => section.missing(&["unit"], "unit = \"mm\""),
            (true, false) if section.has("unit") => section.clash(
                ["generator", "unit"],
                "`mesh.unit` belongs to `mesh.file`, and a generator is given",
                "no unit: the generator's parameters carry their own",
            ),
            _ => {}
        }
        if self.generator == Some(Generator::Boxes) && !section.has("boxes") {
            section.missing(&["boxes"], "[mesh.boxes] with the box of the whole and its regions");
        }
        for (key, owner, _) in Generator::choices() {
            let other_mesh = match self.generator {
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
    }
}

impl Group for MeshConfig {
    type Written = MeshKeys;

    fn of(written: MeshKeys, _: &Section<'_>) -> Self {
        written.into()
    }
}

impl Placeholder for MeshConfig {
    fn placeholder() -> Self {
        MeshKeys::default().into()
    }
}

impl From<MeshKeys> for MeshConfig {
    fn from(keys: MeshKeys) -> Self {
        match (keys.file, keys.generator) {
            (Some(file), _) => {
                Self::File { path: PathBuf::from(file), unit: keys.unit.unwrap_or(LengthUnit::Metre) }
            }
            (None, Some(Generator::Block)) => Self::Block(keys.block.unwrap_or_default()),
            (None, Some(Generator::Boxes)) => Self::Boxes(Box::new(keys.boxes.unwrap_or_default())),
            (None, Some(Generator::Sphere)) => Self::Sphere(keys.sphere.unwrap_or_default()),
            (None, _) => Self::Shield(Box::new(keys.shield.unwrap_or_default())),
        }
    }
}

impl From<MeshConfig> for MeshKeys {
    fn from(mesh: MeshConfig) -> Self {
        let of = |generator| Self { generator: Some(generator), ..Self::default() };
        match mesh {
            MeshConfig::Shield(shield) => Self { shield: Some(*shield), ..of(Generator::Shield) },
            MeshConfig::Block(block) => Self { block: Some(block), ..of(Generator::Block) },
            MeshConfig::Boxes(boxes) => Self { boxes: Some(*boxes), ..of(Generator::Boxes) },
            MeshConfig::Sphere(sphere) => Self { sphere: Some(sphere), ..of(Generator::Sphere) },
            MeshConfig::File { path, unit } => {
                let file = Some(path.to_string_lossy().into_owned());
                Self { file, unit: Some(unit), ..Self::default() }
            }
        }
    }
}

impl MeshConfig {
    /// The generator; `None` for a file.
    pub fn generator(&self) -> Option<Generator> {
        match self {
            Self::Shield(_) => Some(Generator::Shield),
            Self::Block(_) => Some(Generator::Block),
            Self::Boxes(_) => Some(Generator::Boxes),
            Self::Sphere(_) => Some(Generator::Sphere),
            Self::File { .. } => None,
        }
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

impl BlockMesh {
    /// The same for the generator.
    pub fn parameters(&self) -> BlockParameters {
        BlockParameters { size: self.size, cells: self.cells }
    }
}
