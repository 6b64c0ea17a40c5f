//! The paths that a configuration names, before they are made absolute.

use super::tree::{Node, Table, join};

/// The keys that hold paths.
const MESH: [&str; 2] = ["mesh", "file"];
const DIRECTORY: [&str; 2] = ["output", "directory"];
/// In every table of `materials`.
const CURVE: &str = "bh_file";

/// The paths of a configuration as they are written; `None` for a key that is absent.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(in crate::config) struct WrittenPaths {
    pub(in crate::config) mesh: Option<String>,
    pub(in crate::config) directory: Option<String>,
    /// B–H tables by the path of their key.
    pub(in crate::config) curves: Vec<(String, String)>,
}

impl WrittenPaths {
    /// Those of a tree.
    pub(in crate::config) fn of(root: &Table) -> Self {
        let materials = root.get("materials").and_then(|node| node.content.table());
        let curve = |(name, material): (&String, &Node)| {
            let path = material.content.table()?.get(CURVE)?.content.text()?;
            Some((join(&join("materials", name), CURVE), path.to_owned()))
        };
        let curves = materials.into_iter().flatten().filter_map(curve).collect();
        Self { mesh: text_at(root, MESH), directory: text_at(root, DIRECTORY), curves }
    }
}

fn text_at(root: &Table, [table, key]: [&str; 2]) -> Option<String> {
    root.get(table)?.content.table()?.get(key)?.content.text().map(str::to_owned)
}
