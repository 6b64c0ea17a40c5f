//! The cases of a sweep: each the whole configuration with the case's own tables laid over it, read by the same readers, so
//! that a fault in it points at its own line.

use super::diagnostic::Diagnostic;
use super::tree::{self, Content, Node, Table};

/// The tables of the configuration that a case may change.
const OVERLAID: [&str; 3] = ["mesh", "remesh", "design"];
/// The keys of `[morph]` that a case may change.
const OWN: [&str; 2] = ["motion", "least_quality"];

/// The number of cases as written.
pub(in crate::config) fn case_count(root: &Table) -> usize {
    let cases = root.get("morph").and_then(|node| node.content.table()?.get("case")?.content.list());
    cases.map_or(0, <[Node]>::len)
}

/// The trees of the cases, made one at a time: each the root with the tables of the case laid over it and without cases,
/// with what was laid; the fault of a case that goes past the end of a list.
pub(in crate::config) fn case_trees(
    mut root: Table,
) -> impl Iterator<Item = Result<(Table, toml::Table), Box<Diagnostic>>> {
    let cases = match root.get_mut("morph").map(|node| &mut node.content) {
        Some(Content::Table(morph)) => morph.remove("case"),
        _ => None,
    };
    let cases = match cases.map(|node| node.content) {
        Some(Content::Array(cases)) => cases,
        _ => Vec::new(),
    };
    let laid = move |case: Node| {
        let Content::Table(case) = case.content else { return Ok((root.clone(), toml::Table::new())) };
        let own = |keys: &[&str]| -> Table {
            let own = case.iter().filter(|(key, _)| keys.contains(&key.as_str()));
            own.map(|(key, node)| (key.clone(), node.clone())).collect()
        };
        let (tables, motion) = (own(&OVERLAID), own(&OWN));
        let mut tree = root.clone();
        let mut written = tree::to_toml(&tables);
        written.extend(tree::to_toml(&motion));
        if let Some(Content::Table(morph)) = tree.get_mut("morph").map(|node| &mut node.content) {
            morph.extend(motion);
        }
        tree::overlay(&mut tree, tables, "")?;
        Ok((tree, written))
    };
    cases.into_iter().map(laid)
}
