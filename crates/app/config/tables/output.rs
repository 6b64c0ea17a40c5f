//! `[output]`: where results go, which fields are kept, and in which forms the optimum is written.

use std::path::{Path, PathBuf};

use serde::Serializer;

use crate::config::section::Section;
use crate::config::table::table;
use crate::config::value::choice::choice;
use crate::config::value::range::Range;

/// Evaluations above which a run keeps the fields of those that improve, if nothing else is asked for: a field file of a
/// small mesh has some megabytes.
const LONG_RUN: usize = 20;

/// Most parts of a cell of the fresh mesh along each axis: finer ones cost more than the run.
const MOST_PARTS: f64 = 4.0;

table! {
    /// Where results go, and which.
    ///
    /// The fresh mesh of `verify_refinement` has every line of the run's, and new ones between them over the box around all that
    /// moves and all that the objective is taken over; with the generator `sphere` all of it is finer. It shares with the run
    /// the size of the box, the far cells, materials, conditions, elements and their order, and the model of every region: an
    /// error of these is in both ratios. It shares the cells of what is observed, too: where a region has none given, these are the
    /// elements of the run's mesh.
    /// Variables of a control grid are the same there; without a grid the displacement of the design surface is interpolated on
    /// its triangles. Constraints are measured anew at both shapes; where the elements of the run are cut instead, only those
    /// on the field are: cutting changes no volume and no thickness. A run that is interrupted or ends with `max_time` is not
    /// checked; a signal during the check ends with 130 or 143 and the `status` `interrupted`, beside the `stop_reason` of the search, and `fluxmorph resume` makes up for it; a check
    /// that fails is a warning, and changes neither the status nor the rest of the result, which is on the disk before.
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
        /// Which evaluations leave a VTU file. Default: `"every"`, and `"improved"` where `optimizer.max_evaluations` is above 20,
        /// which the log says; `--max-evaluations` leaves it as it is, so that a run that goes on keeps what it has.
        fields: FieldsKept = WORD, else FieldsKept::Every;
        /// Whether the mesh of the optimum is written as a Gmsh file, `optimum.msh`: it is what a user goes on with. Regions whose
        /// surface alone is modelled are not in it.
        mesh: bool = FLAG => true;
        /// Surfaces of the best design that are written as STL files; `[]`: none. Default: the surfaces of `[design]`.
        stl: Vec<String> = NAMES, else Vec::new();
        /// `run`: after the optimisation the mesh is generated anew with every cell that moves or is observed divided in so many
        /// parts along each axis (a fraction is rounded up), and the initial and the best shape are analysed on it, their
        /// constraints too. What an optimiser gained from the errors of one mesh is lost on another. 0: no check. 1: what the
        /// estimates and other elements say, without a finer mesh. With the
        /// default the check costs two analyses without gradients on three to five times the elements. A mesh from a file or of the
        /// generator `block` is cut instead, at both shapes, into at least so many times the elements; so is one whose fresh mesh
        /// cannot be moved as far or costs too much, which the run says.
        verify_refinement: f64 = zero_or(Range::closed(1.0, MOST_PARTS)) => 2.0;
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
    /// Whether the best shape of a run is looked at on finer cells than those of the run.
    pub fn is_verified_on_finer_cells(&self) -> bool {
        self.verify_refinement > 1.0
    }

    /// Completes what follows from the folder and the name of the configuration, from its design surfaces and from the length
    /// of its run.
    pub(super) fn complete(
        &mut self,
        root: &Section<'_>,
        folder: &Path,
        stem: &str,
        surfaces: &[String],
        most_evaluations: usize,
    ) {
        if !root.has("output.fields") && most_evaluations > LONG_RUN {
            self.fields = FieldsKept::Improved;
        }
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
