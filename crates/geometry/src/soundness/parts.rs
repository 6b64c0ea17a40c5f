//! Parts of a mesh that have no node in common.

use std::collections::BTreeMap;

use crate::disjoint_sets::DisjointSets;
use crate::ids::{ElementId, RegionId};
use crate::mesh::Mesh;

/// Elements that hang together.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// How many.
    pub elements: usize,
    /// Their regions, ascending.
    pub regions: Vec<RegionId>,
    /// The first of them.
    pub first: ElementId,
}

/// The parts of a mesh that share no node with each other, in the order of their first elements: one of a mesh in one piece.
pub fn separate_parts(mesh: &Mesh) -> Vec<Part> {
    let topology = mesh.topology();
    let mut nodes = DisjointSets::new(topology.node_count());
    for tet in topology.tets() {
        nodes.join(tet.map(|n| n.index()));
    }
    let mut parts: BTreeMap<usize, Part> = BTreeMap::new();
    for element in topology.elements() {
        let root = nodes.root(topology.tet(element)[0].index());
        let none = Part { elements: 0, regions: Vec::new(), first: element };
        let part = parts.entry(root).or_insert(none);
        part.elements += 1;
        let region = topology.region_of()[element.index()];
        if let Err(place) = part.regions.binary_search(&region) {
            part.regions.insert(place, region);
        }
    }
    let mut parts: Vec<Part> = parts.into_values().collect();
    parts.sort_by_key(|part| part.first);
    parts
}
