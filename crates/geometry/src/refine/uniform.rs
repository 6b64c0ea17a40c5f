//! Every element cut into eight: four at its vertices, and the octahedron between them into four along a diagonal.
//!
//! The shortest of the three diagonals is taken. With it the elements stay regular however often this is repeated (Kröger
//! and Preusser, Numer. Math. 109 (2008) 435).

use std::sync::Arc;

use rayon::prelude::*;

use super::{RefineLimits, Refinement, inherit, middle};
use crate::error::MeshError;
use crate::ids::{ElementId, NodeId};
use crate::mesh::Mesh;
use crate::tet4::{EDGES, Point, dot, sub};
use crate::topology::edge_key;

/// Places in [`EDGES`] of the two ends of each diagonal: edges that have no vertex in common.
const DIAGONALS: [[usize; 2]; 3] = [[0, 5], [1, 4], [2, 3]];

/// The other four midpoints in their order around each diagonal, right-handed about its direction.
const AROUND: [[usize; 4]; 3] = [[1, 2, 4, 3], [0, 3, 5, 2], [0, 1, 5, 4]];

/// Halves every edge of a mesh: eight elements for each.
///
/// # Errors
/// [`MeshError::RefinementLimit`]; [`MeshError::Inverted`] where elements are so flat that the parts vanish in rounding.
pub fn uniform(mesh: &Mesh, limits: RefineLimits) -> Result<Refinement, MeshError> {
    let topology = mesh.topology();
    let count = topology.tets().len().saturating_mul(8);
    if count > limits.most_tets {
        return Err(MeshError::RefinementLimit { what: "elements", most: limits.most_tets });
    }
    let old = topology.node_count();
    let mut edges: Vec<[NodeId; 2]> =
        topology.tets().par_iter().flat_map_iter(|tet| EDGES.map(|e| edge_key(e.map(|v| tet[v])))).collect();
    edges.par_sort_unstable();
    edges.dedup();
    let midpoint = |a: NodeId, b: NodeId| {
        let place =
            edges.binary_search(&edge_key([a, b])).expect("the edge of an element is one of the mesh");
        NodeId::new(old + place)
    };
    let mut points = mesh.points().to_vec();
    points.extend(edges.iter().map(|&[a, b]| middle(mesh.point(a), mesh.point(b))));
    let tets: Vec<[NodeId; 4]> = topology
        .tets()
        .par_iter()
        .flat_map_iter(|tet| {
            let middles = EDGES.map(|[a, b]| midpoint(tet[a], tet[b]));
            let diagonal = shortest(middles.map(|m| points[m.index()]));
            parts(*tet, middles, diagonal)
        })
        .collect();
    let ancestors: Vec<ElementId> = (0..count).map(|e| ElementId::new(e / 8)).collect();
    let split = |[a, b, c]: [NodeId; 3], parts: &mut Vec<[NodeId; 3]>| {
        let [ab, bc, ca] = [midpoint(a, b), midpoint(b, c), midpoint(c, a)];
        parts.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    };
    let fine = inherit::inherit(topology, points.len(), tets, &ancestors, split)?;
    let mesh = Mesh::new(Arc::new(fine), points)?;
    Ok(Refinement { mesh, parents: edges, ancestors })
}

/// The shortest diagonal between midpoints; of equal ones the first.
fn shortest(middles: [Point; 6]) -> usize {
    let length = |[a, b]: [usize; 2]| {
        let diagonal = sub(middles[b], middles[a]);
        dot(diagonal, diagonal)
    };
    let lengths = DIAGONALS.map(length);
    (0..3).fold(0, |best, k| if lengths[k] < lengths[best] { k } else { best })
}

/// The eight parts of a tetrahedron with the midpoints of its edges.
fn parts(tet: [NodeId; 4], m: [NodeId; 6], diagonal: usize) -> [[NodeId; 4]; 8] {
    let [from, to] = DIAGONALS[diagonal];
    let around = AROUND[diagonal];
    let wedge = |k: usize| [m[from], m[to], m[around[k]], m[around[(k + 1) % 4]]];
    [
        [tet[0], m[0], m[1], m[2]],
        [m[0], tet[1], m[3], m[4]],
        [m[1], m[3], tet[2], m[5]],
        [m[2], m[4], m[5], tet[3]],
        wedge(0),
        wedge(1),
        wedge(2),
        wedge(3),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tet4::volume;

    /// Any tetrahedron serves: the parts are the same combinations of its vertices.
    #[test]
    fn every_diagonal_gives_eight_parts_of_one_eighth_each() {
        let vertices = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.2, 0.9, 0.1], [0.3, 0.2, 1.2]];
        let middles = EDGES.map(|[a, b]| middle(vertices[a], vertices[b]));
        let points: Vec<Point> = vertices.into_iter().chain(middles).collect();
        let whole = volume(vertices);
        for diagonal in 0..3 {
            let tet = [0, 1, 2, 3].map(NodeId);
            let middles = [4, 5, 6, 7, 8, 9].map(NodeId);
            for part in parts(tet, middles, diagonal) {
                let share = volume(part.map(|n| points[n.index()])) / whole;
                // A dozen roundings of numbers of order one.
                assert!((share - 0.125).abs() < 1e-15, "diagonal {diagonal}, {part:?}: {share}");
            }
        }
    }
}
