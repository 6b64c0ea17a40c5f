//! A run directory read back without the program's own types.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use fluxmorph_geometry::io::{VtuArray, VtuContents, read_vtu};
use serde_json::Value;

/// The file that a process locks while it works in a directory; it stays there.
pub(crate) const LOCK: &str = ".fluxmorph-lock";

/// All files but locks below a folder with their content, by their paths in it.
pub(crate) fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if !path.ends_with(LOCK) {
                let name = path.strip_prefix(folder).expect("below it").to_owned();
                found.insert(name, fs::read(&path).expect("a file"));
            }
        }
    }
    found
}

/// The names of all files below a folder.
pub(crate) fn files_below(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        files(folder).into_keys().map(|path| path.to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// A text file.
#[track_caller]
pub(crate) fn read_text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A JSON file.
#[track_caller]
pub(crate) fn read_json(path: &Path) -> Value {
    serde_json::from_str(&read_text(path)).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Rows that the history of a run has by now.
pub(crate) fn rows(directory: &Path) -> usize {
    let text = fs::read_to_string(directory.join("history.csv")).unwrap_or_default();
    text.lines().count().saturating_sub(1)
}

/// A run directory.
pub(crate) struct RunFolder(pub(crate) PathBuf);

impl RunFolder {
    /// One JSON file of it.
    #[track_caller]
    pub(crate) fn json(&self, name: &str) -> Value {
        read_json(&self.0.join(name))
    }

    /// `result.json`.
    #[track_caller]
    pub(crate) fn result(&self) -> Value {
        self.json("result.json")
    }

    /// A text file of it.
    #[track_caller]
    pub(crate) fn text(&self, name: &str) -> String {
        read_text(&self.0.join(name))
    }

    /// The field file of one evaluation.
    #[track_caller]
    pub(crate) fn field(&self, evaluation: u64) -> VtuContents {
        let path = self.0.join(format!("fields/eval_{evaluation:04}.vtu"));
        read_vtu(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    /// `history.csv`: header and rows.
    #[track_caller]
    pub(crate) fn history(&self) -> (Vec<String>, Vec<Vec<String>>) {
        let text = self.text("history.csv");
        let mut rows = text.lines().map(|line| line.split(',').map(str::to_owned).collect());
        (rows.next().expect("a header"), rows.collect())
    }
}

/// A number of a JSON value.
#[track_caller]
pub(crate) fn number(value: &Value, pointer: &str) -> f64 {
    value.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("no number at {pointer}"))
}

/// A whole number of a JSON value.
#[track_caller]
pub(crate) fn count(value: &Value, pointer: &str) -> u64 {
    value.pointer(pointer).and_then(Value::as_u64).unwrap_or_else(|| panic!("no count at {pointer}"))
}

/// A list of a JSON value.
#[track_caller]
pub(crate) fn list<'a>(value: &'a Value, pointer: &str) -> &'a [Value] {
    value.pointer(pointer).and_then(Value::as_array).unwrap_or_else(|| panic!("no list at {pointer}"))
}

/// A list of numbers of a JSON value.
#[track_caller]
pub(crate) fn numbers(value: &Value, pointer: &str) -> Vec<f64> {
    list(value, pointer).iter().map(|item| item.as_f64().expect("a number")).collect()
}

/// The entry of a list with a name.
#[track_caller]
pub(crate) fn named<'a>(list: &'a Value, name: &str) -> &'a Value {
    let mut entries = list.as_array().expect("a list").iter();
    entries.find(|entry| entry["name"] == name).unwrap_or_else(|| panic!("no entry `{name}`"))
}

/// A scalar array, shape `(n,)`.
#[track_caller]
pub(crate) fn scalars(array: &VtuArray) -> &[f64] {
    match array {
        VtuArray::Scalar(values) => values,
        other => panic!("a scalar array was expected, not {} items of another kind", other.len()),
    }
}

/// A vector array, shape `(n, 3)`.
#[track_caller]
pub(crate) fn vectors(array: &VtuArray) -> &[[f64; 3]] {
    match array {
        VtuArray::Vector(values) => values,
        other => panic!("a vector array was expected, not {} items of another kind", other.len()),
    }
}
