//! Pieces of a mesh as one again, by the numbers that their nodes and elements have in the whole mesh.

use std::collections::BTreeMap;

use super::{GLOBAL_ELEMENTS, GLOBAL_NODES, VtuArray, VtuContents, refused};
use crate::error::MeshError;
use crate::ids::NodeId;

/// The whole of pieces, each with a name for messages: their nodes, elements and arrays in the order of the whole mesh.
///
/// Where pieces share a node, the values of the first one stand. The numbers in the whole mesh are not among the arrays.
///
/// # Errors
/// [`MeshError::Vtu`] names the piece that has no such numbers, impossible ones, or other arrays than the first; or a node
/// or element that is in no piece, or an element that is in several.
pub fn join_pieces(pieces: Vec<(String, VtuContents)>) -> Result<VtuContents, MeshError> {
    let mut parts = Vec::with_capacity(pieces.len());
    for (name, mut contents) in pieces {
        // Some of the ranks of a small mesh have nothing to write.
        if contents.points.is_empty() && contents.tets.is_empty() {
            continue;
        }
        let nodes = global_ids(&name, &mut contents.point_data, GLOBAL_NODES)?;
        let elements = global_ids(&name, &mut contents.cell_data, GLOBAL_ELEMENTS)?;
        parts.push(Part { name, nodes, elements, contents });
    }
    let Some(first) = parts.first() else { return Err(refused("no piece holds an element")) };
    // Every element is in one piece, every node in one at least: what is larger than their sum is no number of theirs.
    let element_count = parts.iter().map(|part| part.elements.len()).sum();
    let most_nodes = parts.iter().map(|part| part.nodes.len()).sum();
    let node_count = parts.iter().filter_map(|part| part.nodes.last()).max().map_or(0, |&last| last + 1);
    if node_count > most_nodes {
        return Err(refused(format!(
            "node {} is named, but all pieces have {most_nodes} nodes: one is missing",
            node_count - 1
        )));
    }
    let mut whole = VtuContents {
        points: vec![[0.0; 3]; node_count],
        tets: vec![[NodeId(0); 4]; element_count],
        point_data: zeros(&first.contents.point_data, node_count),
        cell_data: zeros(&first.contents.cell_data, element_count),
    };
    let mut has_node = vec![false; node_count];
    let mut has_element = vec![false; element_count];
    for part in &parts {
        part.write_into(&mut whole, &mut has_node, &mut has_element)?;
    }
    if let Some(node) = has_node.iter().position(|&has| !has) {
        return Err(refused(format!("node {node} is in no piece: one is missing")));
    }
    Ok(whole)
}

/// A piece with the places of what it holds.
struct Part {
    name: String,
    nodes: Vec<usize>,
    elements: Vec<usize>,
    contents: VtuContents,
}

impl Part {
    fn write_into(
        &self,
        whole: &mut VtuContents,
        has_node: &mut [bool],
        has_element: &mut [bool],
    ) -> Result<(), MeshError> {
        let name = &self.name;
        for &e in &self.elements {
            match has_element.get_mut(e) {
                Some(has) if !*has => *has = true,
                Some(_) => {
                    return Err(refused(format!(
                        "element {e} of the piece `{name}` is in another one as well"
                    )));
                }
                None => {
                    let count = has_element.len();
                    return Err(refused(format!(
                        "the piece `{name}` has the element {e}, but all pieces have {count}: one is missing"
                    )));
                }
            }
        }
        // Places in the piece of what no earlier one has written.
        let new: Vec<usize> = (0..self.nodes.len()).filter(|&i| !has_node[self.nodes[i]]).collect();
        for &i in &new {
            has_node[self.nodes[i]] = true;
            whole.points[self.nodes[i]] = self.contents.points[i];
        }
        for (&e, tet) in self.elements.iter().zip(&self.contents.tets) {
            whole.tets[e] = tet.map(|n| NodeId::new(self.nodes[n.index()]));
        }
        let all: Vec<usize> = (0..self.elements.len()).collect();
        copy(name, &mut whole.point_data, &self.contents.point_data, &new, &self.nodes)?;
        copy(name, &mut whole.cell_data, &self.contents.cell_data, &all, &self.elements)
    }
}

/// The numbers in the whole mesh, taken from the arrays of a piece; ascending.
fn global_ids(
    piece: &str,
    arrays: &mut BTreeMap<String, VtuArray>,
    name: &str,
) -> Result<Vec<usize>, MeshError> {
    let Some(VtuArray::Integer(ids)) = arrays.remove(name) else {
        return Err(refused(format!("the piece `{piece}` has no array `{name}` of whole numbers")));
    };
    let is_ascending = ids.windows(2).all(|pair| pair[0] < pair[1]);
    match ids.iter().map(|&id| usize::try_from(id).ok()).collect::<Option<Vec<usize>>>() {
        Some(ids) if is_ascending => Ok(ids),
        _ => {
            Err(refused(format!("the array `{name}` of the piece `{piece}` does not ascend from 0 or above")))
        }
    }
}

fn zeros(arrays: &BTreeMap<String, VtuArray>, length: usize) -> BTreeMap<String, VtuArray> {
    let zeros = |array: &VtuArray| match array {
        VtuArray::Scalar(_) => VtuArray::Scalar(vec![0.0; length]),
        VtuArray::Vector(_) => VtuArray::Vector(vec![[0.0; 3]; length]),
        VtuArray::Integer(_) => VtuArray::Integer(vec![0; length]),
    };
    arrays.iter().map(|(name, array)| (name.clone(), zeros(array))).collect()
}

/// Copies the values at `from` in a piece to where `places` says.
fn copy(
    piece: &str,
    whole: &mut BTreeMap<String, VtuArray>,
    arrays: &BTreeMap<String, VtuArray>,
    from: &[usize],
    places: &[usize],
) -> Result<(), MeshError> {
    let other = || refused(format!("the piece `{piece}` has other arrays than those before it"));
    if whole.len() != arrays.len() {
        return Err(other());
    }
    for ((name, to), (own_name, own)) in whole.iter_mut().zip(arrays) {
        match (to, own) {
            _ if name != own_name => return Err(other()),
            (VtuArray::Scalar(to), VtuArray::Scalar(own)) => {
                from.iter().for_each(|&i| to[places[i]] = own[i])
            }
            (VtuArray::Vector(to), VtuArray::Vector(own)) => {
                from.iter().for_each(|&i| to[places[i]] = own[i])
            }
            (VtuArray::Integer(to), VtuArray::Integer(own)) => {
                from.iter().for_each(|&i| to[places[i]] = own[i]);
            }
            _ => return Err(other()),
        }
    }
    Ok(())
}
