//! `[output]`: where results go, which fields are kept, and in which forms the optimum is written.

use std::path::{Path, PathBuf};

use serde::{Serialize, Serializer};

use super::choice::choice;
use super::range::Range;
use super::section::Section;

/// Refinements of the fresh mesh beside 0: coarser than half the cells shows nothing, finer than four times costs more than
/// the run.
const REFINEMENTS: Range = Range::closed(0.5, 4.0);

/// Where results go.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Output {
    /// The run directory. Default `runs/` and the name of the configuration, beside it.
    #[serde(serialize_with = "as_text")]
    pub directory: PathBuf,
    /// Which evaluations leave a VTU file. Default `every`: a run has some tens of evaluations.
    pub fields: FieldsKept,
    /// Whether the mesh of the optimum is written as a Gmsh file. Default `true`: it is what a user goes on with.
    pub mesh: bool,
    /// Surfaces of the optimum that are written as STL files. Default: the design surfaces.
    pub stl: Vec<String>,
    /// Refinement of the fresh mesh, relative to that of the run, on which a run's gain is checked; 0: it is not checked.
    /// Default 1.25: all nodes lie elsewhere, for about twice the elements.
    pub verify_refinement: f64,
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
