//! The files of a run but for its fields: each is declared once, and so has a path, and goes when another run takes its place.

use std::path::PathBuf;

use super::names::morph_name;
use super::run_directory::RunDirectory;

/// The journal of earlier versions.
pub(super) const OLDER_JOURNAL: &str = "journal.bin";

/// Declares the files: a method with the path of each, and the list of their names.
macro_rules! files {
    ($(#[doc = $meaning:literal] $file:ident = $name:literal;)+) => {
        /// The files of a run beside its manifest, at last those of earlier versions. The journal goes first: it must not be
        /// taken for that of a new run.
        pub(super) const FILES: &[&str] =
            &[$($name,)+ "before.vtu", "after.vtu", OLDER_JOURNAL, "journal.damaged.bin", "history.jsonl"];

        impl RunDirectory {
            $(
                #[doc = $meaning]
                pub fn $file(&self) -> PathBuf {
                    self.path().join($name)
                }
            )+
        }
    };
}

files! {
    /// `journal.jsonl`, all evaluations to the last bit.
    journal = "journal.jsonl";
    /// `journal.damaged.jsonl`, what a damaged journal is kept as.
    damaged_journal = "journal.damaged.jsonl";
    /// `refinements.json`, how the mesh was refined to keep a tolerance.
    refinements = "refinements.json";
    /// `config.toml`, the configuration as given.
    config = "config.toml";
    /// `resolved.toml`, with its defaults.
    resolved = "resolved.toml";
    /// `history.csv`.
    history_csv = "history.csv";
    /// `fields.pvd`, the collection of the field files.
    collection = "fields.pvd";
    /// `error.vtu`, where the estimated error of the best design is made.
    error_map = "error.vtu";
    /// `result.json`.
    result = "result.json";
    /// `morph.csv`, one row for each case of a prescribed motion.
    morph_csv = "morph.csv";
    /// `tuned.toml`, the configuration that the tuner found.
    tuned = "tuned.toml";
    /// `optimum.msh`, the mesh of the best design.
    optimum = "optimum.msh";
    /// `optimum_refined.msh`, the same with finer elements.
    optimum_refined = "optimum_refined.msh";
    /// `report.html`, one page about the run.
    report = "report.html";
}

impl RunDirectory {
    /// `manifest.json`.
    pub fn manifest(&self) -> PathBuf {
        self.path().join("manifest.json")
    }

    /// The undeformed mesh of a prescribed motion; `case` is the number of a case of a sweep, from 0.
    pub fn before(&self, case: Option<usize>) -> PathBuf {
        self.path().join(morph_name(case, "before"))
    }

    /// The mesh after a prescribed motion.
    pub fn after(&self, case: Option<usize>) -> PathBuf {
        self.path().join(morph_name(case, "after"))
    }

    /// A surface of the best design, by the name that [`surface_files`](super::surface_files) gives its file.
    pub fn surface(&self, file: &str) -> PathBuf {
        self.path().join(file)
    }
}
