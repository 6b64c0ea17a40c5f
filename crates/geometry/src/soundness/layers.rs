//! Layers of thin elements under a surface: do the nodes of the next layer lie behind those of the surface?
//!
//! An extruded layer splits the prism under a triangle into tetrahedra, of which one stands on the triangle with its apex
//! behind one of the corners. Where the two ends of an extrusion are meshed unlike, the apex lies beside the triangle: the
//! columns lean, elements are long across the surface, and a motion of the surface shears them. Columns that cross invert
//! elements, which no [`crate::Mesh`] has. A prism that lies along the surface has its apex beside the triangle too, but behind
//! another node of the surface, with an edge between them.

use std::collections::{BTreeMap, BTreeSet};

use crate::ids::{ElementId, NodeId};
use crate::mesh::Mesh;
use crate::tet4::{Point, area_vector, centroid, cross, dot, norm, sub};

/// Height over the square root of the area below which an element belongs to a layer: unstructured elements have 1.1.
const THIN: f64 = 0.5;

/// How far the apex may lie beside the triangle, as a share of the square root of the area.
const BESIDE: f64 = 0.25;

/// Share of the surface on which layers may lean: edges and corners.
const TOLERATED: f64 = 0.05;

/// Layers that lean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leaning {
    /// Share of the surface's area under which they do, of one side.
    pub share: f64,
    /// How far the apex lies beside its triangle at the worst place [m].
    pub lean: f64,
    /// Height of the element there [m].
    pub height: f64,
    /// The middle of its triangle [m].
    pub place: Point,
}

/// How much the layers on either side of a surface lean; `None` where they do so on a twentieth of it or less.
pub fn leaning_layers(mesh: &Mesh, surface: &[[NodeId; 3]]) -> Option<Leaning> {
    let mut around: BTreeMap<NodeId, BTreeSet<NodeId>> = BTreeMap::new();
    for nodes in surface {
        nodes.iter().for_each(|&node| around.entry(node).or_default().extend(nodes));
    }
    let (mut area, mut leaning) = (0.0, 0.0);
    let mut worst: Option<Leaning> = None;
    for nodes in surface {
        let corners = nodes.map(|n| mesh.point(n));
        let size = norm(area_vector(corners));
        for element in elements_at(mesh, *nodes) {
            area += size;
            let apex = mesh.topology().tet(element).into_iter().find(|n| !nodes.contains(n));
            let Some(apex) = apex else { continue };
            let place = mesh.point(apex);
            let (beside, height) = (distance_beside(corners, place), height(corners, place));
            if height > THIN * size.sqrt() || beside < height.max(BESIDE * size.sqrt()) {
                continue;
            }
            let mut near = nodes.iter().flat_map(|node| &around[node]);
            let is_above =
                |&&node: &&NodeId| is_behind(area_vector(corners), mesh.point(node), mesh.point(apex));
            if near.find(is_above).is_some_and(|&node| is_joined(mesh, node, apex)) {
                continue;
            }
            leaning += size;
            if worst.is_none_or(|worst| beside > worst.lean) {
                worst = Some(Leaning { share: 0.0, lean: beside, height, place: centroid(corners) });
            }
        }
    }
    worst.map(|worst| Leaning { share: leaning / area, ..worst }).filter(|found| found.share > TOLERATED)
}

/// The elements with a face.
fn elements_at(mesh: &Mesh, nodes: [NodeId; 3]) -> impl Iterator<Item = ElementId> + '_ {
    let holds = move |e: &ElementId| nodes.iter().all(|n| mesh.topology().tet(*e).contains(n));
    mesh.topology().elements_around(nodes[0]).iter().copied().filter(holds)
}

/// Whether two nodes are the ends of an edge.
fn is_joined(mesh: &Mesh, a: NodeId, b: NodeId) -> bool {
    let topology = mesh.topology();
    topology.elements_around(a).iter().any(|&e| topology.tet(e).contains(&b))
}

/// Whether a point lies behind a node rather than beside it, along a normal.
fn is_behind(normal: Point, node: Point, point: Point) -> bool {
    let step = sub(point, node);
    2.0 * norm(cross(step, normal)) < dot(step, normal).abs()
}

/// Distance of a point from the plane of a triangle [m].
fn height(corners: [Point; 3], point: Point) -> f64 {
    let normal = area_vector(corners);
    dot(sub(point, corners[0]), normal).abs() / norm(normal)
}

/// How far the foot of a point in the plane of a triangle lies outside of its edges' lines, the farthest of the three [m].
fn distance_beside(corners: [Point; 3], point: Point) -> f64 {
    let normal = area_vector(corners);
    let beyond = |k: usize| {
        let edge = sub(corners[(k + 1) % 3], corners[k]);
        let outward = cross(edge, normal);
        dot(sub(point, corners[k]), outward) / norm(outward)
    };
    beyond(0).max(beyond(1)).max(beyond(2)).max(0.0)
}
