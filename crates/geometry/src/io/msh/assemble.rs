//! From the contents of a file to a mesh: regions, orientation, and surfaces that are faces of tetrahedra.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rayon::prelude::*;

use super::MshMesh;
use super::error::{MshError, MshFault, Subject};
use super::reader::Contents;
use crate::error::MeshError;
use crate::ids::{NodeId, RegionId};
use crate::mesh::Mesh;
use crate::tet4::{self, Point};
use crate::topology::Topology;

/// Bound of the rounding in six times a volume, over `eps · c · L²` (c: largest coordinate, L: longest edge).
///
/// A coordinate is rounded by eps c / 2, so an edge by eps c and the product of three edges by 3 eps c L²; the
/// arithmetic adds some eps L³. Below 16 times that unit the sign of a volume says nothing about the shape.
const ROUNDING: f64 = 16.0;

/// Makes the mesh.
pub(super) fn assemble(mut contents: Contents<'_>) -> Result<MshMesh, MshError> {
    if contents.tetrahedra.is_empty() {
        return Err(contents.cursor.fault_at(contents.cursor.position(), Subject::File, MshFault::Empty));
    }
    if !contents.tetrahedra.is_sorted_by_key(|tet| tet.tag) {
        contents.tetrahedra.sort_by_key(|tet| tet.tag);
    }
    let (region_tags, region_names) = groups(&contents, 3, contents.tetrahedra.iter().map(|tet| tet.group))?;
    orient(&mut contents)?;

    let (renumbered, points) = renumber(&mut contents);
    let tets =
        contents.tetrahedra.iter().map(|tet| tet.nodes.map(|n| NodeId(renumbered[n as usize]))).collect();
    let region_of = contents
        .tetrahedra
        .iter()
        .map(|tet| RegionId::new(region_tags.binary_search(&tet.group).expect("all groups were gathered")))
        .collect();
    let mut topology = Topology::new(points.len(), tets, region_names, region_of)
        .map_err(|error| overlap(&contents, &renumbered, &error))?;
    if has_repetition(&topology)
        && let Some(repeated) = repetition(&contents)
    {
        return Err(repeated);
    }
    for (name, triangles) in surfaces(&mut contents, &renumbered, &topology)? {
        topology = topology.with_surface(&name, triangles).map_err(|error| refused(&contents, &error))?;
    }
    let mesh = Mesh::new(Arc::new(topology), points).map_err(|error| refused(&contents, &error))?;
    name_unnamed(&mut contents);
    Ok(MshMesh { mesh, notices: contents.notices })
}

/// Tags and names of the groups of a dimension, named or used, by ascending tag.
fn groups(
    contents: &Contents<'_>,
    dimension: i32,
    used: impl Iterator<Item = i32>,
) -> Result<(Vec<i32>, Vec<String>), MshError> {
    let mut tags: BTreeSet<i32> = contents.names.tags(dimension).collect();
    let mut last = None;
    for tag in used {
        // Elements of one group follow each other: most need no look into the set.
        if last != Some(tag) {
            tags.insert(tag);
            last = Some(tag);
        }
    }
    let mut owners: BTreeMap<String, i32> = BTreeMap::new();
    for &tag in &tags {
        let name = contents.names.of(dimension, tag);
        if let Some(&first) = owners.get(&name) {
            let subject = Subject::Group { dimension, tag };
            let fault = MshFault::NameTwice { name, first };
            return Err(contents.cursor.fault_at(0, subject, fault));
        }
        owners.insert(name, tag);
    }
    let names = tags.iter().map(|&tag| contents.names.of(dimension, tag)).collect();
    Ok((tags.into_iter().collect(), names))
}

/// Most made names that a notice lists.
const MOST_LISTED: usize = 20;

/// Notes the groups in use that have no name of their own.
fn name_unnamed(contents: &mut Contents<'_>) {
    let volumes: BTreeSet<i32> = contents.tetrahedra.iter().map(|tet| tet.group).collect();
    let surfaces: BTreeSet<i32> = contents.triangles.iter().map(|triangle| triangle.group).collect();
    let groups = volumes.into_iter().map(|tag| (3, tag)).chain(surfaces.into_iter().map(|tag| (2, tag)));
    let unnamed = groups.filter(|&(dimension, tag)| !contents.names.is_named(dimension, tag));
    let names: Vec<String> =
        unnamed.take(MOST_LISTED).map(|(dimension, tag)| contents.names.of(dimension, tag)).collect();
    contents.notices.unnamed_groups = names;
}

/// Whether two tetrahedra have the same four nodes.
fn has_repetition(topology: &Topology) -> bool {
    let mut sorted: Vec<[NodeId; 4]> = topology
        .tets()
        .par_iter()
        .map(|tet| {
            let mut nodes = *tet;
            nodes.sort_unstable();
            nodes
        })
        .collect();
    sorted.par_sort_unstable();
    sorted.par_windows(2).any(|pair| pair[0] == pair[1])
}

/// The tetrahedron with the nodes of an earlier one that comes first in the file.
fn repetition(contents: &Contents<'_>) -> Option<MshError> {
    let tetrahedra = &contents.tetrahedra;
    let mut keys: Vec<([u32; 4], u32)> = tetrahedra
        .iter()
        .enumerate()
        .map(|(i, tet)| {
            let mut nodes = tet.nodes;
            nodes.sort_unstable();
            (nodes, i as u32)
        })
        .collect();
    keys.sort_unstable();
    let repeated = keys.windows(2).filter(|pair| pair[0].0 == pair[1].0);
    let at = |i: u32| &tetrahedra[i as usize];
    let in_file = |pair: &[([u32; 4], u32)]| {
        let (a, b) = (at(pair[0].1), at(pair[1].1));
        if a.place <= b.place { (*a, *b) } else { (*b, *a) }
    };
    let (first, second) = repeated.map(in_file).min_by_key(|(_, second)| second.place)?;
    let fault = if first.group == second.group {
        MshFault::DuplicateElement { first: first.tag }
    } else {
        let name = |group| contents.names.of(3, group);
        MshFault::TwoGroups { first: name(first.group), second: name(second.group) }
    };
    Some(contents.cursor.fault_at(second.place, Subject::Element(second.tag), fault))
}

/// Turns left-handed tetrahedra around, and refuses flat ones.
fn orient(contents: &mut Contents<'_>) -> Result<(), MshError> {
    let points = contents.nodes.points();
    for tet in &mut contents.tetrahedra {
        let vertices = tet.nodes.map(|n| points[n as usize]);
        let volume = tet4::volume(vertices);
        if volume.abs() > smallest_volume(vertices) {
            if volume < 0.0 {
                tet.nodes.swap(2, 3);
                contents.notices.reoriented += 1;
            }
            continue;
        }
        let fault = MshFault::Flat { volume, centroid: tet4::centroid(vertices) };
        return Err(contents.cursor.fault_at(tet.place, Subject::Element(tet.tag), fault));
    }
    Ok(())
}

/// The volume below which rounding decides the sign [m³].
fn smallest_volume(vertices: [Point; 4]) -> f64 {
    let edge = |[a, b]: [usize; 2]| {
        let e = tet4::sub(vertices[a], vertices[b]);
        tet4::dot(e, e)
    };
    let longest = tet4::EDGES.into_iter().map(edge).fold(0.0, f64::max);
    let farthest = vertices.as_flattened().iter().fold(0.0, |most: f64, c| most.max(c.abs()));
    ROUNDING * f64::EPSILON * farthest.max(longest.sqrt()) * longest / 6.0
}

/// The place of an absent node in the new numbers.
const NONE: u32 = u32::MAX;

/// New numbers of the vertices of tetrahedra, in the order of their tags, and their coordinates [m].
fn renumber(contents: &mut Contents<'_>) -> (Vec<u32>, Vec<Point>) {
    let mut renumbered = vec![NONE; contents.nodes.len()];
    for n in contents.tetrahedra.iter().flat_map(|tet| tet.nodes) {
        renumbered[n as usize] = 0;
    }
    let mut points = Vec::with_capacity(renumbered.iter().filter(|n| **n == 0).count());
    for (new, point) in renumbered.iter_mut().zip(contents.nodes.points()).filter(|(new, _)| **new == 0) {
        *new = points.len() as u32;
        points.push(*point);
    }
    contents.notices.unused_nodes = renumbered.len() - points.len();
    (renumbered, points)
}

/// The name of a surface and its triangles.
type NamedSurface = (String, Vec<[NodeId; 3]>);

/// Triangles of every surface, in the order of their tags.
fn surfaces(
    contents: &mut Contents<'_>,
    renumbered: &[u32],
    topology: &Topology,
) -> Result<Vec<NamedSurface>, MshError> {
    contents.triangles.sort_by_key(|triangle| (triangle.group, triangle.tag));
    let (tags, names) = groups(contents, 2, contents.triangles.iter().map(|triangle| triangle.group))?;
    let mut surfaces: Vec<NamedSurface> = names.into_iter().map(|name| (name, Vec::new())).collect();
    for group in contents.triangles.chunk_by(|a, b| a.group == b.group) {
        let index = tags.binary_search(&group[0].group).expect("all groups were gathered");
        let (name, triangles) = &mut surfaces[index];
        let mut known = BTreeSet::new();
        let (mut loose, mut repeated) = (0, 0);
        for triangle in group {
            let nodes = triangle.nodes.map(|n| renumbered[n as usize]);
            let mut key = nodes;
            key.sort_unstable();
            if nodes.contains(&NONE) || !topology.has_face(key.map(NodeId)) {
                loose += 1;
            } else if known.insert(key) {
                triangles.push(nodes.map(NodeId));
            } else {
                repeated += 1;
            }
        }
        if loose > 0 {
            contents.notices.loose_triangles.insert(name.clone(), loose);
        }
        if repeated > 0 {
            contents.notices.repeated_triangles.insert(name.clone(), repeated);
        }
    }
    Ok(surfaces)
}

/// Finds the elements that overlap in the file; repeated elements are the better explanation.
fn overlap(contents: &Contents<'_>, renumbered: &[u32], error: &MeshError) -> MshError {
    let overlaps = matches!(error, MeshError::OverfullFace { .. } | MeshError::Folded { .. });
    if let Some(repeated) = repetition(contents).filter(|_| overlaps) {
        return repeated;
    }
    if let MeshError::Folded { elements } = error {
        let [other, tet] = elements.map(|e| contents.tetrahedra[e.index()]);
        let regions = Box::new([tet, other].map(|tet| contents.names.of(3, tet.group)));
        let centroid = tet4::centroid(tet.nodes.map(|n| contents.nodes.points()[n as usize]));
        let fault = MshFault::Folded { other: other.tag, regions, centroid };
        return contents.cursor.fault_at(tet.place, Subject::Element(tet.tag), fault);
    }
    let MeshError::OverfullFace { face } = error else { return refused(contents, error) };
    let old = face.map(|node| renumbered.iter().position(|&n| n == node.0).unwrap_or(0) as u32);
    let has_face = |tet: &&super::reader::Tetrahedron| old.iter().all(|n| tet.nodes.contains(n));
    let mut around: Vec<_> = contents.tetrahedra.iter().filter(has_face).collect();
    around.sort_by_key(|tet| tet.place);
    match around.get(2) {
        Some(third) => {
            let fault = MshFault::Overlap { face: old.map(|n| contents.nodes.tag(n)) };
            contents.cursor.fault_at(third.place, Subject::Element(third.tag), fault)
        }
        None => refused(contents, error),
    }
}

fn refused(contents: &Contents<'_>, error: &MeshError) -> MshError {
    contents.cursor.fault_at(0, Subject::File, MshFault::Mesh { cause: error.to_string() })
}
