//! The paths that a configuration names, before they are made absolute.

use super::tree::Table;

/// The keys that hold paths.
const MESH: [&str; 2] = ["mesh", "file"];
const DIRECTORY: [&str; 2] = ["output", "directory"];

/// The paths of a configuration as they are written; `None` for a key that is absent.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(in crate::config) struct WrittenPaths {
    pub(in crate::config) mesh: Option<String>,
    pub(in crate::config) directory: Option<String>,
}

impl WrittenPaths {
    /// Those of a tree.
    pub(in crate::config) fn of(root: &Table) -> Self {
        Self { mesh: text_at(root, MESH), directory: text_at(root, DIRECTORY) }
    }
}

fn text_at(root: &Table, [table, key]: [&str; 2]) -> Option<String> {
    root.get(table)?.content.table()?.get(key)?.content.text().map(str::to_owned)
}
