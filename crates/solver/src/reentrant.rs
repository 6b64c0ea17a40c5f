//! Surfaces with `A_t` of their own that meet at a re-entrant edge of the mesh, where nodal elements need `ψ` on the surface.
//!
//! The field around an edge at which the domain has an interior angle above 180° is not in H¹: with `A_t = 0`, or `E_t` from
//! `A_t` alone, on both faces nodal elements converge to a wrong field without a sign of it (Costabel and Dauge, Numer.
//! Math. 93 (2002) 239). With `A_t + ∇_tψ` instead, `A` may be regular and the field is right. `ψ` is needed on the smooth
//! patches that end at such an edge; on all others it is zero, which leaves no gradient undetermined in a cavity.

use std::collections::{BTreeMap, HashSet};

use fluxmorph_geometry::disjoint_sets::DisjointSets;
use fluxmorph_geometry::tet4::{area_vector, dot, norm, sub};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{Mesh, NodeId};

use crate::fixed_directions::CREASE;

/// Of some outer faces, given by their ascending nodes, those on patches that end at a re-entrant edge between two of
/// them; oriented out of the mesh, in the order of the mesh.
pub(crate) fn beside_reentrant_edges(mesh: &Mesh, faces: &HashSet<[NodeId; 3]>) -> Vec<[NodeId; 3]> {
    let outer = mesh.topology().facets().iter().filter(|facet| facet.outside.is_none());
    let triangles: Vec<[NodeId; 3]> =
        outer.map(|facet| facet.nodes).filter(|&nodes| faces.contains(&face_key(nodes))).collect();
    let mut around: BTreeMap<[NodeId; 2], Vec<usize>> = BTreeMap::new();
    for (t, triangle) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            around.entry([a.min(b), a.max(b)]).or_default().push(t);
        }
    }
    let mut patches = DisjointSets::new(triangles.len());
    let mut beside = Vec::new();
    for (edge, sides) in around {
        let [one, other] = sides[..] else { continue };
        match bend(mesh, edge, [triangles[one], triangles[other]]) {
            Bend::Smooth => patches.join([one, other]),
            Bend::Reentrant => beside.extend([one, other]),
            Bend::Convex => {}
        }
    }
    let found: HashSet<usize> = beside.into_iter().map(|t| patches.root(t)).collect();
    (0..triangles.len()).filter(|&t| found.contains(&patches.root(t))).map(|t| triangles[t]).collect()
}

/// How two outer faces meet.
enum Bend {
    /// Two facets of one surface.
    Smooth,
    /// The domain has an interior angle below 180°.
    Convex,
    /// It has one above.
    Reentrant,
}

fn bend(mesh: &Mesh, edge: [NodeId; 2], [one, other]: [[NodeId; 3]; 2]) -> Bend {
    let [n, m] = [one, other].map(|triangle| area_vector(triangle.map(|n| mesh.point(n))));
    let apex = other.into_iter().find(|v| !edge.contains(v)).expect("a triangle has three nodes");
    if dot(n, m) > CREASE.to_radians().cos() * norm(n) * norm(m) {
        Bend::Smooth
    } else if dot(n, sub(mesh.point(apex), mesh.point(edge[0]))) > 0.0 {
        Bend::Reentrant
    } else {
        Bend::Convex
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fluxmorph_geometry::RegionId;
    use fluxmorph_geometry::generate::Grid;
    use std::sync::Arc;

    #[test]
    fn a_hole_has_reentrant_edges_and_the_box_around_it_has_none() {
        let line = || (0..=3).map(f64::from).collect::<Vec<_>>();
        let grid = Grid::new("grid", [line(), line(), line()]).expect("a grid");
        let hole = |x: [f64; 3]| x.iter().all(|c| (1.0..2.0).contains(c));
        let topology =
            grid.topology(&["air", "hole"], |x| RegionId(u32::from(hole(x)))).expect("two regions");
        let mesh = Mesh::new(Arc::new(topology), grid.points()).expect("a mesh");
        let (mesh, exposed) = mesh.without_region(RegionId(1)).expect("what is left");
        let outside = mesh.topology().facets().iter().filter(|facet| facet.outside.is_none());
        let all: HashSet<_> = outside.map(|facet| face_key(facet.nodes)).collect();
        let keys =
            |triangles: &[[NodeId; 3]]| -> HashSet<_> { triangles.iter().map(|t| face_key(*t)).collect() };
        assert_eq!(keys(&beside_reentrant_edges(&mesh, &all)), keys(&exposed));
        let one_side = mesh.topology().surface("x_min").expect("a side");
        assert!(beside_reentrant_edges(&mesh, &keys(one_side)).is_empty());
    }
}
