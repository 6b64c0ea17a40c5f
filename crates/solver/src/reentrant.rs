//! Surfaces with `A_t` of their own that meet at a re-entrant edge of the mesh, where nodal elements need `ψ` on the surface.
//!
//! The field around an edge at which the domain has an interior angle above 180° is not in H¹: with `A_t = 0`, or `E_t` from
//! `A_t` alone, on both faces nodal elements converge to a wrong field without a sign of it (Costabel and Dauge, Numer.
//! Math. 93 (2002) 239). With `A_t + ∇_tψ` instead, `A` may be regular and the field is right. `ψ` is needed on the smooth
//! patches that end at such an edge; on all others it is zero, which leaves no gradient undetermined in a cavity. A
//! surface that ends at a natural face (flux-normal) goes on in its mirror image: there the angle counts twice.

use std::collections::HashSet;

use fluxmorph_geometry::disjoint_sets::DisjointSets;
use fluxmorph_geometry::tet4::{area_vector, dot, norm, sub};
use fluxmorph_geometry::topology::{around_edges, face_key};
use fluxmorph_geometry::{Mesh, NodeId};

use crate::fixed_directions::CREASE;

/// Of some outer faces, given by their ascending nodes, those on patches that end at a re-entrant edge between two of
/// them, or between one and a natural face; oriented out of the mesh, in the order of the mesh.
///
/// Faces that are neither among `faces` nor `applied` are natural.
pub(crate) fn beside_reentrant_edges(
    mesh: &Mesh,
    faces: &HashSet<[NodeId; 3]>,
    applied: &HashSet<[NodeId; 3]>,
) -> Vec<[NodeId; 3]> {
    let triangles: Vec<[NodeId; 3]> = mesh.topology().outer_facets().map(|facet| facet.nodes).collect();
    let is_listed: Vec<bool> = triangles.iter().map(|t| faces.contains(&face_key(*t))).collect();
    let around = around_edges(&triangles);
    let mut patches = DisjointSets::new(triangles.len());
    let mut beside = Vec::new();
    let listed_around = around.into_iter().filter(|(_, sides)| sides.iter().any(|&t| is_listed[t]));
    for (edge, [one, other]) in listed_around.flat_map(|(edge, sides)| wedges(mesh, edge, &sides, &triangles))
    {
        let sides = [one, other].map(|t| triangles[t]);
        match (is_listed[one], is_listed[other], bend(mesh, edge, sides)) {
            (true, true, Bend::Smooth) => patches.join([one, other]),
            (true, true, Bend::Reentrant) => beside.extend([one, other]),
            (true, true, Bend::Convex) | (false, false, _) => {}
            (true, false, bend) | (false, true, bend) => {
                let (own, natural) = if is_listed[one] { (one, other) } else { (other, one) };
                let is_natural = !applied.contains(&face_key(triangles[natural]));
                if is_natural && is_obtuse(mesh, bend, sides) {
                    beside.push(own);
                }
            }
        }
    }
    let found: HashSet<usize> = beside.into_iter().map(|t| patches.root(t)).collect();
    let is_beside = |t: &usize| is_listed[*t] && found.contains(&patches.root(*t));
    (0..triangles.len()).filter(is_beside).map(|t| triangles[t]).collect()
}

/// The pairs of outer faces at an edge with a part of the mesh between them: one, or more where parts touch at the edge.
fn wedges(
    mesh: &Mesh,
    edge: [NodeId; 2],
    sides: &[usize],
    triangles: &[[NodeId; 3]],
) -> Vec<([NodeId; 2], [usize; 2])> {
    if let &[one, other] = sides {
        return vec![(edge, [one, other])];
    }
    let topology = mesh.topology();
    // Every element at the edge links its two other vertices; a chain of links leads from face to face.
    let mut links: Vec<[NodeId; 2]> = Vec::new();
    for tet in topology.elements_around(edge[0]).iter().map(|&e| topology.tet(e)) {
        let mut others = tet.into_iter().filter(|n| !edge.contains(n));
        if let (Some(a), Some(b), None) = (others.next(), others.next(), others.next()) {
            links.push([a, b]);
        }
    }
    let mut pairs = Vec::new();
    for &one in sides {
        let mut at = apex(triangles[one], edge);
        let mut rest = links.clone();
        while let Some(k) = rest.iter().position(|link| link.contains(&at)) {
            let [a, b] = rest.swap_remove(k);
            at = if a == at { b } else { a };
        }
        let other = sides.iter().copied().find(|&t| apex(triangles[t], edge) == at);
        pairs.extend(other.filter(|&other| one < other).map(|other| (edge, [one, other])));
    }
    pairs
}

/// The vertex of a triangle that an edge of it lacks.
fn apex(triangle: [NodeId; 3], edge: [NodeId; 2]) -> NodeId {
    triangle.into_iter().find(|v| !edge.contains(v)).expect("a triangle has three nodes")
}

/// How two outer faces meet.
#[derive(Clone, Copy)]
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
    if dot(n, m) > CREASE.to_radians().cos() * norm(n) * norm(m) {
        Bend::Smooth
    } else if is_reentrant(mesh, edge, [one, other]) {
        Bend::Reentrant
    } else {
        Bend::Convex
    }
}

/// Whether the domain has an interior angle above 180° between two faces that are oriented out of it.
pub(crate) fn is_reentrant(mesh: &Mesh, edge: [NodeId; 2], [one, other]: [[NodeId; 3]; 2]) -> bool {
    let normal = area_vector(one.map(|node| mesh.point(node)));
    dot(normal, sub(mesh.point(apex(other, edge)), mesh.point(edge[0]))) > 0.0
}

/// Whether the domain has an interior angle above 90° between two faces, so that the mirror image makes it re-entrant; an angle
/// that the image makes part of a smooth surface is none.
fn is_obtuse(mesh: &Mesh, bend: Bend, sides: [[NodeId; 3]; 2]) -> bool {
    let [n, m] = sides.map(|triangle| area_vector(triangle.map(|n| mesh.point(n))));
    match bend {
        Bend::Smooth | Bend::Reentrant => true,
        Bend::Convex => dot(n, m) > (0.5 * CREASE).to_radians().sin() * norm(n) * norm(m),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fluxmorph_geometry::generate::Grid;
    use fluxmorph_geometry::{RegionId, Topology};
    use std::sync::Arc;

    #[test]
    fn a_hole_has_reentrant_edges_and_the_box_around_it_has_none() {
        let line = || (0..=3).map(f64::from).collect::<Vec<_>>();
        let grid = Grid::new("grid", [line(), line(), line()]).expect("a grid");
        let hole = |x: [f64; 3]| x.iter().all(|c| (1.0..2.0).contains(c));
        let mesh = grid.mesh(&["air", "hole"], |x| RegionId(u32::from(hole(x)))).expect("two regions");
        let (mesh, exposed) = mesh.without_region(RegionId(1)).expect("what is left");
        let all: HashSet<_> = mesh.topology().outer_facets().map(|facet| face_key(facet.nodes)).collect();
        let keys =
            |triangles: &[[NodeId; 3]]| -> HashSet<_> { triangles.iter().map(|t| face_key(*t)).collect() };
        assert_eq!(keys(&beside_reentrant_edges(&mesh, &all, &HashSet::new())), keys(&exposed));
        let one_side = mesh.topology().surface("x_min").expect("a side");
        assert!(beside_reentrant_edges(&mesh, &keys(one_side), &HashSet::new()).is_empty());
    }

    /// A block whose side x_max leans outward: 135° at y_min, 45° at y_max, and a right angle with top and bottom.
    #[test]
    fn a_corner_that_a_symmetry_plane_halves_is_reentrant() {
        let line = || (0..=2).map(|i| 0.5 * f64::from(i)).collect::<Vec<_>>();
        let grid = Grid::new("grid", [line(), line(), line()]).expect("a grid");
        let topology = grid.topology(&["air"], |_| RegionId(0)).expect("a region");
        let points = grid.points().into_iter().map(|[x, y, z]| [x * (1.0 + y), y, z]).collect();
        let mesh = Mesh::new(Arc::new(topology), points).expect("a mesh");
        let keys = |name: &str| -> HashSet<_> {
            mesh.topology().surface(name).expect("a side").iter().map(|t| face_key(*t)).collect()
        };
        let none = HashSet::new();
        assert_eq!(beside_reentrant_edges(&mesh, &keys("x_max"), &none).len(), keys("x_max").len());
        assert!(beside_reentrant_edges(&mesh, &keys("x_min"), &none).is_empty(), "right angles");
        // Where the field is applied there is no mirror image.
        assert!(beside_reentrant_edges(&mesh, &keys("x_max"), &keys("y_min")).is_empty());
    }

    /// Elements in a fan around one edge: four of 60° in a row, and one of 30° apart from them.
    #[test]
    fn parts_that_touch_at_an_edge_are_looked_at_one_by_one() {
        let angles = [0.0_f64, 60.0, 120.0, 180.0, 240.0, 285.0, 315.0];
        let mut points = vec![[0.0; 3], [0.0, 0.0, 1.0]];
        points.extend(angles.iter().map(|a| [a.to_radians().cos(), a.to_radians().sin(), 0.5]));
        let tets: Vec<_> = [2, 3, 4, 5, 7].map(|k| [0, k, k + 1, 1].map(NodeId)).to_vec();
        let topology = Topology::new(points.len(), tets, vec!["air".to_owned()], vec![RegionId(0); 5]);
        let mesh = Mesh::new(Arc::new(topology.expect("a fan")), points).expect("a mesh");
        let of_edge = |t: &[NodeId; 3]| t.contains(&NodeId(0)) && t.contains(&NodeId(1));
        let outer = mesh.topology().outer_facets();
        let all: HashSet<_> = outer.map(|facet| face_key(facet.nodes)).filter(of_edge).collect();
        let every: HashSet<_> = mesh.topology().facets().iter().map(|facet| face_key(facet.nodes)).collect();
        let others = every.difference(&all).copied().collect();
        let found = beside_reentrant_edges(&mesh, &all, &others);
        let apexes: Vec<_> = found.iter().map(|t| apex(*t, [NodeId(0), NodeId(1)])).collect();
        assert_eq!((all.len(), apexes.len()), (4, 2));
        assert!([2, 6].iter().all(|n| apexes.contains(&NodeId(*n))), "{apexes:?}");
    }
}
