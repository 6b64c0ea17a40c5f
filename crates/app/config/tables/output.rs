//! `[output]`: where results go, which fields are kept, and in which forms the optimum is written.

use std::path::{Path, PathBuf};

use serde::Serializer;

use crate::config::section::Section;
use crate::config::table::table;
use crate::config::value::choice::choice;
use crate::config::value::range::Range;

/// Refinements of the fresh mesh beside 0: coarser than half the cells shows nothing, finer than four times costs more than
/// the run.
const REFINEMENTS: Range = Range::closed(0.5, 4.0);

table! {
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
    pub struct Output: Default {
        /// The run directory, relative to the folder of the configuration. Default: `runs/` and the name of the file.
        #[serde(serialize_with = "as_text")]
        directory: PathBuf = TEXT, else PathBuf::from("runs");
        /// Which evaluations leave a VTU file. A run has some tens of them.
        fields: FieldsKept = WORD => FieldsKept::Every;
        /// Whether the mesh of the optimum is written as a Gmsh file, `optimum.msh`: it is what a user goes on with.
        mesh: bool = FLAG => true;
        /// Surfaces of the best design that are written as STL files; `[]`: none. Default: the surfaces of `[design]`.
        stl: Vec<String> = NAMES, else Vec::new();
        /// `run`: after the optimisation the mesh is generated anew with a `refinement` so many times as large, and the initial
        /// and the best shape are analysed on it. What an optimiser gained from the errors of one mesh is lost on another. 0: no
        /// check. Mesh lines that the factor is too small to divide stay where they are. With the default the check costs two
        /// analyses without gradients on about twice the elements. A mesh from a file or of the generator `block` has no check.
        verify_refinement: f64 = zero_or(REFINEMENTS) => 1.25;
        /// Whether a run ends with `report.html`. Default `true`: it is what one looks at first.
        report: bool = FLAG => true;
    }
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

impl Output {
    /// Completes what follows from the folder and the name of the configuration, and from its design surfaces.
    pub(super) fn complete(&mut self, root: &Section<'_>, folder: &Path, stem: &str, surfaces: &[String]) {
        if !root.has("output.directory") {
            self.directory = Path::new("runs").join(stem);
        }
        self.directory = folder.join(&self.directory);
        if !root.has("output.stl") {
            self.stl = surfaces.iter().filter(|name| !name.is_empty()).cloned().collect();
        }
    }
}

/// A path that is not UTF-8 is written with replacement characters: the file is for reading.
fn as_text<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}
