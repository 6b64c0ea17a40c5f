//! What a reader did to a file that its user should know.

use std::collections::BTreeMap;

/// What was skipped, dropped or changed while reading.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MshNotices {
    /// Elements of other shapes than tetrahedra and triangles, by the name of the shape.
    pub skipped: BTreeMap<&'static str, usize>,
    /// Triangles that belong to no physical surface, and are skipped.
    pub ungrouped_triangles: usize,
    /// Second-order tetrahedra and triangles, whose midside nodes are dropped.
    pub second_order: usize,
    /// Left-handed tetrahedra, two nodes of which were exchanged.
    pub reoriented: usize,
    /// Physical groups without a name, by the name that they are given.
    pub unnamed_groups: Vec<String>,
    /// Volumes of the geometry that belong to no physical group and have no tetrahedra in the file, by tag.
    pub ungrouped_volumes: Vec<i32>,
    /// Nodes that no tetrahedron has as a vertex, and are dropped; midside nodes are among them.
    pub unused_nodes: usize,
    /// Triangles that are faces of no tetrahedron, and are dropped, by surface.
    pub loose_triangles: BTreeMap<String, usize>,
    /// Triangles that come a second time in their surface, and are dropped, by surface.
    pub repeated_triangles: BTreeMap<String, usize>,
}

impl MshNotices {
    /// One sentence for each kind of notice; none for a file that was taken as it is.
    pub fn messages(&self) -> Vec<String> {
        let mut messages = Vec::new();
        if !self.skipped.is_empty() {
            let list: Vec<String> =
                self.skipped.iter().map(|(name, n)| format!("{n} of type {name}")).collect();
            messages.push(format!(
                "elements that are no tetrahedra or triangles are skipped: {}",
                list.join(", ")
            ));
        }
        if self.ungrouped_triangles > 0 {
            messages
                .push(format!("{} triangles of no physical surface are skipped", self.ungrouped_triangles));
        }
        if self.second_order > 0 {
            messages.push(format!(
                "{} second-order elements are read with straight edges: their midside nodes are dropped",
                self.second_order
            ));
        }
        if self.reoriented > 0 {
            messages.push(format!("{} left-handed tetrahedra are turned around", self.reoriented));
        }
        if !self.unnamed_groups.is_empty() {
            messages.push(format!(
                "physical groups without a name are called `{}`: give them names, or use these",
                self.unnamed_groups.join("`, `")
            ));
        }
        if !self.ungrouped_volumes.is_empty() {
            let tags: Vec<String> = self.ungrouped_volumes.iter().map(i32::to_string).collect();
            messages.push(format!(
                "the volumes {} of the geometry belong to no physical group and are left out of the mesh: put them into one \
                 if they are part of the device, air included",
                tags.join(", ")
            ));
        }
        if self.unused_nodes > 0 {
            messages
                .push(format!("{} nodes that are no vertex of a tetrahedron are dropped", self.unused_nodes));
        }
        for (name, n) in &self.loose_triangles {
            messages.push(format!(
                "{n} triangles of the surface `{name}` are faces of no tetrahedron and are dropped: check that the \
                 volumes beside it are meshed, saved, and share its nodes"
            ));
        }
        for (name, n) in &self.repeated_triangles {
            messages
                .push(format!("{n} triangles come a second time in the surface `{name}` and are dropped"));
        }
        messages
    }
}
