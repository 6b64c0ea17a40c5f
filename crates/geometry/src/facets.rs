//! Finds the faces between regions and at the outside of a mesh, in time linear in the number of elements.
//!
//! What such a face is lives in [`crate::topology`].

use rayon::prelude::*;

use crate::error::MeshError;
use crate::ids::{ElementId, NodeId, RegionId};
use crate::tet4::FACES;
use crate::topology::{Facet, same_turn};

/// One face in the bucket of its smallest node.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Face {
    /// The other two nodes, ascending.
    others: [NodeId; 2],
    /// Four times the element plus the local face.
    code: u32,
}

/// Faces between different regions and at the outside.
///
/// All faces are put into buckets by their smallest node and sorted there: a bucket holds some dozen, so that the work is
/// linear in the number of elements.
pub(crate) fn find_facets(
    node_count: usize,
    tets: &[[NodeId; 4]],
    region_of: &[RegionId],
) -> Result<Vec<Facet>, MeshError> {
    let (starts, mut faces) = sort_into_buckets(node_count, tets);
    let mut buckets: Vec<&mut [Face]> = Vec::with_capacity(node_count);
    let mut rest = faces.as_mut_slice();
    for pair in starts.windows(2) {
        let (bucket, behind) = rest.split_at_mut((pair[1] - pair[0]) as usize);
        buckets.push(bucket);
        rest = behind;
    }
    let found: Vec<Result<Vec<(u32, Facet)>, MeshError>> = buckets
        .into_par_iter()
        .enumerate()
        .with_min_len(1024)
        .map(|(node, bucket)| {
            bucket.sort_unstable();
            facets_of(NodeId::new(node), bucket, tets, region_of)
        })
        .filter(|found| !found.as_ref().is_ok_and(Vec::is_empty))
        .collect();
    let mut facets = Vec::new();
    for found in found {
        facets.extend(found?);
    }
    facets.sort_unstable_by_key(|&(code, _)| code);
    Ok(facets.into_iter().map(|(_, facet)| facet).collect())
}

/// The faces of all elements by their smallest nodes: where the bucket of each node starts, and the faces.
fn sort_into_buckets(node_count: usize, tets: &[[NodeId; 4]]) -> (Vec<u32>, Vec<Face>) {
    let mut starts = vec![0u32; node_count + 1];
    for tet in tets {
        for face in FACES {
            starts[sorted_nodes(tet, face)[0].index() + 1] += 1;
        }
    }
    for i in 0..node_count {
        starts[i + 1] += starts[i];
    }
    let mut cursor = starts.clone();
    let mut faces = vec![Face { others: [NodeId(0); 2], code: 0 }; 4 * tets.len()];
    for (e, tet) in tets.iter().enumerate() {
        for (f, face) in FACES.into_iter().enumerate() {
            let [a, b, c] = sorted_nodes(tet, face);
            let slot = &mut cursor[a.index()];
            faces[*slot as usize] = Face { others: [b, c], code: (4 * e + f) as u32 };
            *slot += 1;
        }
    }
    (starts, faces)
}

/// The nodes of a face, ascending.
#[inline]
fn sorted_nodes(tet: &[NodeId; 4], face: [usize; 3]) -> [NodeId; 3] {
    let [mut a, mut b, mut c] = face.map(|v| tet[v]);
    if a > b {
        (a, b) = (b, a);
    }
    if b > c {
        (b, c) = (c, b);
    }
    if a > b {
        (a, b) = (b, a);
    }
    [a, b, c]
}

/// The facets in the sorted bucket of a node, each with its code.
fn facets_of(
    node: NodeId,
    bucket: &[Face],
    tets: &[[NodeId; 4]],
    region_of: &[RegionId],
) -> Result<Vec<(u32, Facet)>, MeshError> {
    let oriented = |code: u32| {
        let tet = tets[(code / 4) as usize];
        (FACES[(code % 4) as usize].map(|v| tet[v]), ElementId(code / 4))
    };
    let mut found = Vec::new();
    for group in bucket.chunk_by(|a, b| a.others == b.others) {
        let (nodes, inside) = oriented(group[0].code);
        match group {
            [face] => found.push((face.code, Facet { nodes, inside, outside: None })),
            [face, other] => {
                let (seen_from_outside, outside) = oriented(other.code);
                if same_turn(nodes, seen_from_outside) {
                    return Err(MeshError::Folded { elements: [inside, outside] });
                }
                if region_of[inside.index()] != region_of[outside.index()] {
                    found.push((face.code, Facet { nodes, inside, outside: Some(outside) }));
                }
            }
            [face, ..] => {
                return Err(MeshError::OverfullFace { face: [node, face.others[0], face.others[1]] });
            }
            [] => unreachable!("a group has a member"),
        }
    }
    Ok(found)
}
