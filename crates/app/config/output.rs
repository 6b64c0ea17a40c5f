//! `[output]`: where results go, which fields are kept, and in which forms the optimum is written.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::choice::choice;
use super::range::Range;
use super::section::Section;
use crate::schema::form::{names, no_default, zero_or};

/// Refinements of the fresh mesh beside 0: coarser than half the cells shows nothing, finer than four times costs more than
/// the run.
const REFINEMENTS: Range = Range::closed(0.5, 4.0);

/// Where results go, and which.
///
/// The fresh mesh of `verify_refinement` keeps what the configuration fixes: faces of regions, lines of a `pitch` or a
/// `skin`; a factor that is not large enough to halve a cell between two such lines leaves its size. It is brought to the
/// shapes in as many rounds as that takes, at least 20 if need be. Variables of a control grid are the same there; without
/// a grid the displacement of the design surface is interpolated on its triangles. A run that is interrupted or ends with
/// `max_time` is not checked; a signal during the check ends with 130 or 143 and the `status` `interrupted`, beside the
/// `stop_reason` of the search, and `fluxmorph resume` makes up for it; a check that fails is a warning, and changes
/// neither the status nor the rest of the result, which is on the disk before.
///
/// ```toml
/// [output]
/// directory = "runs/shield"
/// fields = "first_last"
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default)]
pub struct Output {
    /// The run directory, relative to the folder of the configuration. Default: `runs/` and the name of the file.
    #[serde(serialize_with = "as_text")]
    #[schemars(with = "Option<String>", transform = no_default)]
    pub directory: PathBuf,
    /// Which evaluations leave a VTU file. A run has some tens of them.
    pub fields: FieldsKept,
    /// Whether the mesh of the optimum is written as a Gmsh file, `optimum.msh`: it is what a user goes on with.
    pub mesh: bool,
    /// Surfaces of the best design that are written as STL files; `[]`: none. Default: the surfaces of `[design]`.
    #[schemars(with = "Option<Vec<String>>", transform = names, transform = no_default)]
    pub stl: Vec<String>,
    /// `run`: after the optimisation the mesh is generated anew with a `refinement` so many times as large, and the initial
    /// and the best shape are analysed on it. What an optimiser gained from the errors of one mesh is lost on another. 0: no
    /// check. With the default all nodes lie elsewhere, and the check costs two analyses without gradients on about twice
    /// the elements. A mesh from a file or of the generator `block` has no check.
    #[schemars(transform = zero_or(REFINEMENTS))]
    pub verify_refinement: f64,
    /// Whether a run ends with `report.html`. Default `true`: it is what one looks at first.
    pub report: bool,
}

choice! {
    /// Which evaluations leave a VTU file.
    pub enum FieldsKept {
        /// All.
        Every = "every",
        /// Those better than all before.
        Improved = "improved",
        /// The first and the best.
        FirstLast = "first_last",
        /// None.
        Nothing = "none",
    }
}

impl Default for Output {
    fn default() -> Self {
        Self::new(Path::new(""), "", &[])
    }
}

impl Output {
    /// The defaults for a configuration called `stem` in a folder, with its design surfaces.
    pub(super) fn new(directory: &Path, stem: &str, surfaces: &[String]) -> Self {
        Self {
            directory: directory.join("runs").join(stem),
            fields: FieldsKept::Every,
            mesh: true,
            stl: surfaces.iter().filter(|name| !name.is_empty()).cloned().collect(),
            verify_refinement: 1.25,
            report: true,
        }
    }

    pub(super) fn read(section: Section<'_>, folder: &Path, stem: &str, surfaces: &[String]) -> Self {
        let default = Self::new(folder, stem, surfaces);
        let output = Self {
            directory: section.text("directory").map_or(default.directory, |path| folder.join(path)),
            fields: section.choice("fields").unwrap_or(default.fields),
            mesh: section.boolean("mesh").unwrap_or(default.mesh),
            stl: section.names("stl").unwrap_or(default.stl),
            verify_refinement: section
                .number("verify_refinement", Range::FINITE)
                .unwrap_or(default.verify_refinement),
            report: section.boolean("report").unwrap_or(default.report),
        };
        let factor = output.verify_refinement;
        if factor != 0.0 && !REFINEMENTS.contains(factor) {
            section.wrong(
                "verify_refinement",
                format!("`output.verify_refinement` is {factor}"),
                format!("0 for no check, or a number {}", REFINEMENTS.describe("")),
            );
        }
        section.finish();
        output
    }
}

/// A path that is not UTF-8 is written with replacement characters: the file is for reading.
fn as_text<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}
