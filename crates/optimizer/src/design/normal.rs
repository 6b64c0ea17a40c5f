//! Directions along the surface's normal: area-weighted at every node, and within the planes that the node must keep.
//!
//! The sum of the area vectors of the triangles around a node is the gradient of the enclosed volume with respect to the
//! node (times three), so it is the way that adds most volume. At a node on a symmetry plane, or on a face along which the
//! mesh slides, the part that leaves the plane is taken away and the rest is made a unit vector again: on a symmetry plane
//! this is the normal of the whole surface, of which the mesh holds one half. A face keeps a node whatever the shape of
//! the whole surface: at an edge of two planes the node moves along it, in a corner it stays.

use std::collections::BTreeSet;

use fluxmorph_geometry::directions::{beside, extend, unit};
use fluxmorph_geometry::tet4::{Point, area_vector, norm};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{Mesh, NodeId};

/// Normals closer to the span of others than this sine are in it: planes in files are flat to 6 or more digits, and
/// different planes of a device meet at angles far above a twentieth of a degree.
const SAME_PLANE: f64 = 1e-3;

/// Shortest mean normal, as a share of the area around the node, that still gives a direction. Below it, the surface is a
/// sheet folded back on itself or all but lies in the plane that the node keeps; then the node stays.
const SHORTEST: f64 = 0.05;

/// Largest component of a unit normal across its axis that is rounding: coordinates in files carry 6 or more digits.
const FLAT: f64 = 1e-6;

/// Unit directions of the nodes (ascending), shape `(n_nodes, 3)`; zero where there is none.
pub(super) fn directions(
    mesh: &Mesh,
    nodes: &[NodeId],
    triangles: &[[NodeId; 3]],
    kept: &[[NodeId; 3]],
) -> Vec<Point> {
    let vector = |triangle: &[NodeId; 3]| area_vector(triangle.map(|n| mesh.point(n)));
    let row = |n: &NodeId| nodes.binary_search(n).ok();
    let mut sums = vec![[0.0; 3]; nodes.len()];
    let mut areas = vec![0.0; nodes.len()];
    for triangle in triangles {
        let area = vector(triangle);
        for i in triangle.iter().filter_map(row) {
            for (sum, a) in sums[i].iter_mut().zip(area) {
                *sum += a;
            }
            areas[i] += norm(area);
        }
    }
    let own: BTreeSet<[NodeId; 3]> = triangles.iter().copied().map(face_key).collect();
    let mut planes = vec![Vec::new(); nodes.len()];
    for triangle in kept.iter().filter(|t| !own.contains(&face_key(**t))) {
        let area = vector(triangle);
        for i in triangle.iter().filter_map(row) {
            add_plane(&mut planes[i], unit(area));
        }
    }
    sums.iter()
        .zip(&areas)
        .zip(&planes)
        .map(|((&sum, &area), planes)| {
            let within = beside(planes, sum);
            let length = norm(within);
            if length > SHORTEST * area { within.map(|c| c / length) } else { [0.0; 3] }
        })
        .collect()
}

/// Adds the normal of a plane through a node to the orthonormal span of those before.
fn add_plane(planes: &mut Vec<Point>, normal: Point) {
    // A plane of constant coordinate has exactly that normal, whatever the rounding of its triangles.
    let axis = super::dominant_axis(normal);
    let flat = (0..3).all(|d| d == axis || normal[d].abs() < FLAT);
    let normal = if flat { std::array::from_fn(|d| f64::from(d == axis)) } else { normal };
    extend(planes, normal, SAME_PLANE);
}
