//! Reads a design: a `result.json`, or a JSON array of lengths in metres.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use fluxmorph_geometry::io::read_at_most;
use fluxmorph_geometry::millimetres;
use fluxmorph_optimizer::design::DesignSurface;
use serde::Deserialize;
use serde_json::Value;

use super::{FileHash, Manifest, MeshHash, json_place};
use crate::config::{Diagnostic, DiagnosticReport, Document, LONGEST_LENGTH, Span, Subject};

/// Largest design file that is read [bytes]: a million variables with their points.
const LARGEST: u64 = 256 * 1024 * 1024;

/// Why a file is not a design.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of a variant says what its fields are")]
pub enum DesignFileError {
    /// The file cannot be read.
    #[error(
        "cannot read the design `{path}`: {source}; give a result.json or a JSON array of lengths in metres"
    )]
    Read { path: PathBuf, source: std::io::Error },
    /// The file holds something else.
    #[error("`{path}` is not a design: {message}; give a result.json or a JSON array of lengths in metres")]
    Content { path: PathBuf, message: String },
    /// The file holds something else at one place.
    #[error("{0}")]
    Fault(Box<DiagnosticReport>),
    /// The design does not fit the problem.
    #[error(
        "the design `{path}` has {found} values, but the problem has {expected} design variables; give one value [m] for \
         each, as `design.values_m` of a result.json of the same design"
    )]
    Count { path: PathBuf, found: usize, expected: usize },
    /// The design is that of another device.
    #[error(
        "the design `{path}` is that of another device: its variable {index} acts at {}, that of this configuration at {} \
         (`design.points_m`); give a result of this device, or the list `design.values_m` alone to take its values all the \
         same",
        millimetres(*.found), millimetres(*.expected)
    )]
    Places {
        path: PathBuf,
        index: usize,
        /// Where it acts by the file [m].
        found: [f64; 3],
        /// Where it acts here [m].
        expected: [f64; 3],
    },
    /// A B–H table is not what the run of the design has read.
    #[error(
        "the B–H table `{}` is another than the one that the run in `{run}` has read; restore it, or analyse the configuration \
         with --design to take the design to another steel", table.display()
    )]
    Table { run: PathBuf, table: PathBuf },
}

/// Largest distance between two places of a variable, relative to the diagonal of the mesh: far above what writing and
/// reading leave, and far below an element.
const SAME_PLACE: f64 = 1e-6;

/// The run whose configuration is analysed at its design, or at another.
#[derive(Debug, Clone, PartialEq)]
pub struct RunOfDesign {
    /// Its folder.
    pub folder: PathBuf,
    /// What its manifest says of it.
    pub manifest: Manifest,
    /// Whether its configuration is still the one that it was run with.
    pub has_its_configuration: bool,
}

/// A design as a file holds it.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignFile {
    path: PathBuf,
    /// The variables [m].
    pub values: Vec<f64>,
    /// Where the variables act [m]; `None` where the file does not say.
    points: Option<Vec<[f64; 3]>>,
    /// How often the run that the file is of refined its mesh.
    refinements: u64,
    /// The run whose configuration is analysed; `None` without one.
    run: Option<RunOfDesign>,
}

impl DesignFile {
    /// The same, for the configuration of a run; `None` for that of no run.
    #[must_use]
    pub fn of_run(self, run: Option<RunOfDesign>) -> Self {
        Self { run, ..self }
    }

    /// What its run had otherwise than its configuration and a mesh are now, in words.
    pub fn changes_since_the_run(&self, mesh: &MeshHash) -> Vec<String> {
        let Some(RunOfDesign { folder, manifest, has_its_configuration }) = &self.run else {
            return Vec::new();
        };
        let is_other_mesh = manifest.mesh.as_ref().is_some_and(|own| own.blake3 != mesh.blake3);
        let changed = [("config.toml", !has_its_configuration), ("mesh", is_other_mesh)];
        let changed = changed.into_iter().filter(|(_, is_other)| *is_other);
        changed
            .map(|(what, _)| {
                format!(
                    "the {what} is another than when `{}` was run: these are not the numbers of that run",
                    folder.display()
                )
            })
            .collect()
    }

    /// How often its run refined the mesh, where the configuration of that run is analysed.
    pub fn refinements_of_run(&self) -> Option<u64> {
        self.run.as_ref().map(|_| self.refinements).filter(|count| *count > 0)
    }

    /// Whether tables with these hashes of their content are those that the run has read; others have other names.
    ///
    /// # Errors
    /// [`DesignFileError::Table`].
    pub fn check_tables(&self, read: &BTreeMap<PathBuf, String>) -> Result<(), DesignFileError> {
        let Some(RunOfDesign { folder, manifest, .. }) = &self.run else { return Ok(()) };
        let is_other =
            |own: &&FileHash| read.get(Path::new(&own.path)).is_some_and(|hash| *hash != own.blake3);
        match manifest.tables.iter().find(is_other) {
            None => Ok(()),
            Some(own) => Err(DesignFileError::Table { run: folder.clone(), table: PathBuf::from(&own.path) }),
        }
    }

    /// Whether its variables act where those of a surface do; a list without places does.
    ///
    /// # Errors
    /// [`DesignFileError::Places`].
    pub fn check_places(
        &self,
        surface: &DesignSurface,
        [lower, upper]: [[f64; 3]; 2],
    ) -> Result<(), DesignFileError> {
        let Some(points) = &self.points else { return Ok(()) };
        let distance =
            |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        let most = SAME_PLACE * distance(&lower, &upper);
        match points.iter().zip(surface.points()).position(|(found, own)| distance(found, own) > most) {
            None => Ok(()),
            Some(index) => Err(DesignFileError::Places {
                path: self.path.clone(),
                index,
                found: points[index],
                expected: surface.points()[index],
            }),
        }
    }
}

/// The design in a file; there must be `expected` variables.
///
/// # Errors
/// When the file cannot be read, is no design, or has another number of values.
pub fn read_design(path: &Path, expected: usize) -> Result<DesignFile, DesignFileError> {
    let content = |message: String| DesignFileError::Content { path: path.to_owned(), message };
    let bytes = read_at_most(path, LARGEST).map_err(|source| match source.kind() {
        ErrorKind::FileTooLarge => content(format!("it has more than {LARGEST} bytes")),
        _ => DesignFileError::Read { path: path.to_owned(), source },
    })?;
    let text = std::str::from_utf8(&bytes)
        .map_err(|error| content(format!("it is not UTF-8 text at byte {}", error.valid_up_to())))?;
    let faulty = |range: std::ops::Range<usize>, message: String| {
        let document = Document::whole(path.display().to_string(), text);
        let fault = Diagnostic::new("", Span { document: 0, range }, message)
            .help("give a result.json or a JSON array of lengths in metres");
        DesignFileError::Fault(Box::new(DiagnosticReport::of_file(Subject::Design, document, fault)))
    };
    let value: Value = serde_json::from_str(text).map_err(|error| {
        let span = json_place::at_line(text, error.line(), error.column());
        faulty(span, format!("not a design: no valid JSON, {error}"))
    })?;
    let list = match &value {
        Value::Object(_) => value.pointer("/design/values_m"),
        other => Some(other),
    };
    let Some(Value::Array(list)) = list else {
        return Err(content("it has no list `design.values_m`".to_owned()));
    };
    let number = |(index, item): (usize, &Value)| {
        item.as_f64().filter(|value| value.abs() <= LONGEST_LENGTH).ok_or_else(|| {
            let from = text.find("\"values_m\"").filter(|_| value.is_object()).unwrap_or(0);
            let span = json_place::item(text, from, index).unwrap_or(0..0);
            let shown: String = item.to_string().chars().take(60).collect();
            let what = if item.is_number() { "no length of a device" } else { "not a number" };
            faulty(span, format!("item {index} is {shown}, {what}"))
        })
    };
    let values = list.iter().enumerate().map(number).collect::<Result<Vec<_>, _>>()?;
    if values.len() != expected {
        return Err(DesignFileError::Count { path: path.to_owned(), found: values.len(), expected });
    }
    let points = match value.pointer("/design/points_m") {
        None | Some(Value::Null) => None,
        Some(points) => {
            let points = Vec::<[f64; 3]>::deserialize(points)
                .map_err(|error| content(format!("`design.points_m` is no list of points: {error}")))?;
            Some(points).filter(|points| points.len() == expected)
        }
    };
    let refinements = value.pointer("/accuracy/refinements").and_then(Value::as_u64).unwrap_or(0);
    Ok(DesignFile { path: path.to_owned(), values, points, refinements, run: None })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_forms_are_read_and_the_rest_refused() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("design.json");
        let read = |text: &str| {
            std::fs::write(&path, text).expect("written");
            read_design(&path, 2).map(|design| design.values).map_err(|error| error.to_string())
        };
        assert_eq!(read("[0.01, -5e-3]"), Ok(vec![0.01, -5e-3]));
        assert_eq!(read(r#"{"design": {"values_m": [1, 2.5]}}"#), Ok(vec![1.0, 2.5]));
        let cases = [
            ("[0.01]", "has 1 values, but the problem has 2"),
            ("[0.01, null]", "item 1 is null"),
            ("[0.01, \"5 mm\"]", "item 1 is \"5 mm\""),
            ("{}", "no list `design.values_m`"),
            ("5", "no list"),
            ("[1e999, 0]", "number out of range"),
            ("[0, 1e308]", "item 1 is 1e+308, no length of a device"),
            ("[1, ", "line 1"),
            (r#"{"design": {"values_m": [1, 2], "points_m": [[1, 2]]}}"#, "no list of points"),
        ];
        for (text, fragment) in cases {
            let message = read(text).expect_err(text);
            assert!(message.contains(fragment), "{text}: {message}");
        }
        assert!(matches!(
            read_design(folder.path().join("none").as_path(), 1),
            Err(DesignFileError::Read { .. })
        ));
    }

    #[test]
    fn a_table_that_its_run_has_not_read_is_named() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("result.json");
        std::fs::write(&path, "[0.01]").expect("written");
        let read = |name: &str, hash: &str| BTreeMap::from([(PathBuf::from(name), hash.to_owned())]);
        let design = read_design(&path, 1).expect("a design");
        design.check_tables(&read("steel.csv", "b")).expect("one of no run");
        let tables = vec![FileHash { path: "steel.csv".to_owned(), blake3: "a".to_owned() }];
        let manifest = Manifest { tables, ..Manifest::new("run", 1) };
        let run = RunOfDesign { folder: "run".into(), manifest, has_its_configuration: true };
        let design = design.of_run(Some(run));
        design.check_tables(&read("steel.csv", "a")).expect("its own");
        design.check_tables(&read("other.csv", "b")).expect("another material");
        let error = design.check_tables(&read("steel.csv", "b")).expect_err("changed").to_string();
        assert!(error.contains("the B–H table `steel.csv` is another"), "{error}");
    }

    #[test]
    fn another_configuration_and_another_mesh_than_those_of_its_run_are_named() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("result.json");
        std::fs::write(&path, "[0.01]").expect("written");
        let mesh =
            |hash: &str| MeshHash { origin: "block".into(), blake3: hash.to_owned(), nodes: 8, tets: 6 };
        let design = read_design(&path, 1).expect("a design");
        assert!(design.changes_since_the_run(&mesh("a")).is_empty(), "of no run");
        let manifest = Manifest { mesh: Some(mesh("a")), ..Manifest::new("run", 1) };
        let run = |has_its_configuration: bool| RunOfDesign {
            folder: "run".into(),
            manifest: manifest.clone(),
            has_its_configuration,
        };
        let design = design.of_run(Some(run(true)));
        assert!(design.changes_since_the_run(&mesh("a")).is_empty());
        let changes = design.of_run(Some(run(false))).changes_since_the_run(&mesh("b"));
        assert!(
            matches!(&changes[..], [config, mesh] if config.contains("the config.toml is") && mesh.contains("the mesh is"))
        );
    }
}
