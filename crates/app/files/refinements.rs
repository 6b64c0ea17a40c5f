//! `refinements.json`: how the mesh of a run with a tolerance was refined, so that it can be made again.

use fluxmorph_geometry::ElementId;
use serde::{Deserialize, Serialize};

use super::json::to_json;
use super::{OutputError, RunDirectory};

/// Largest file that is read [bytes]: ten times a hundred million numbers.
const LARGEST: u64 = 1 << 34;

/// The content of `refinements.json`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Refinements {
    /// In their order.
    pub refinements: Vec<RefinementStep>,
}

/// One refinement.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RefinementStep {
    /// Evaluations of the run before it: 0 where it came before the search.
    pub evaluations: usize,
    /// Tetrahedra before it.
    pub tets: usize,
    /// The objective before it: at the initial design before the search, at the best one after.
    pub objective: f64,
    /// Its estimated error, with sign.
    pub error_estimate: f64,
    /// Hash of the mesh after it.
    pub blake3: String,
    /// Numbers of the elements whose edges were halved, in the mesh with all regions.
    pub marked: Vec<usize>,
}

impl Refinements {
    /// Those of a run directory; none where there is no such file.
    ///
    /// # Errors
    /// [`OutputError::Damaged`], or when the operating system refuses.
    pub fn read(directory: &RunDirectory) -> Result<Self, OutputError> {
        let path = directory.refinements();
        let read = directory.disk().read(&path, LARGEST);
        let Some(bytes) = OutputError::unless_missing(&path, read)? else { return Ok(Self::default()) };
        let advised = |error| format!("{error} (without the file `resume` estimates the errors anew)");
        serde_json::from_slice(&bytes).map_err(advised).map_err(OutputError::damaged(path))
    }

    /// The elements that were marked in the first refinements.
    pub fn marks(&self, count: usize) -> Vec<Vec<ElementId>> {
        let of = |step: &RefinementStep| step.marked.iter().copied().map(ElementId::new).collect();
        self.refinements.iter().take(count).map(of).collect()
    }

    /// Writes the file.
    pub fn write(&self, directory: &RunDirectory) -> Result<(), OutputError> {
        directory.write(&directory.refinements(), &to_json(self))
    }
}
