//! Motion along the surface's normal: area-weighted at every node, mitred at sharp edges, and within the planes that the node
//! must keep.
//!
//! The sum of the area vectors of the triangles around a node is the gradient of the enclosed volume with respect to the
//! node (times three), so it is the way that adds most volume. At a node on a symmetry plane, or on a face along which the
//! mesh slides, the part that leaves the plane is taken away and the rest is made a unit vector again: on a symmetry plane
//! this is the normal of the whole surface, of which the mesh holds one half. A face keeps a node whatever the shape of
//! the whole surface: at an edge of two planes the node moves along it, in a corner it stays.
//!
//! Where faces meet at more than the angle of [`SMOOTH`], a unit step along their mean moves each of them by less than one, and
//! an edge would be left behind as a lip, or a chamfer, one row of triangles wide. There the node moves as the edge of the faces
//! that are moved by one, `v·n_f = 1` for the unit normals `n_f` of all faces: by `√2` at an edge of 90°, `√3` in the corner of
//! a cube. Of more than three faces it is the fit of least squares, and in directions that no face looks into the node does not
//! move. The same at a plane that the node keeps, where the surface and its mirror image meet in an edge: within the plane.

use std::collections::BTreeSet;

use fluxmorph_geometry::curved::SMOOTH;
use fluxmorph_geometry::directions::{beside, extend, unit};
use fluxmorph_geometry::disjoint_sets::DisjointSets;
use fluxmorph_geometry::tet4::{Point, area_vector, cross, dot, norm};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{Mesh, NodeId};

/// Normals closer to the span of others than this sine are in it: planes in files are flat to 6 or more digits, and
/// different planes of a device meet at angles far above a twentieth of a degree.
const SAME_PLANE: f64 = 1e-3;

/// Shortest mean normal, as a share of the area around the node, that still gives a direction. Below it, the surface is a
/// sheet folded back on itself or all but lies in the plane that the node keeps; then the node stays.
const SHORTEST: f64 = 0.05;

/// Longest step of a node for a unit step of its faces: that of an edge of 60 degrees. The step of sharper ones has no bound, and
/// would leave no room to the elements around; their faces move by less than a unit at the edge.
const LONGEST: f64 = 2.0;

/// Halvings of an interval after which its ends are neighbouring numbers.
const HALVINGS: usize = 60;

/// Largest component of a unit normal across its axis that is rounding: coordinates in files carry 6 or more digits.
const FLAT: f64 = 1e-6;

/// How the nodes (ascending) move for a unit step of the faces around them: unit directions, shape `(n_nodes, 3)`, zero where
/// there is none, and the lengths of the steps, 1 but at sharp edges.
pub(super) fn directions(
    mesh: &Mesh,
    nodes: &[NodeId],
    triangles: &[[NodeId; 3]],
    kept: &[[NodeId; 3]],
) -> (Vec<Point>, Vec<f64>) {
    let vector = |triangle: &[NodeId; 3]| area_vector(triangle.map(|n| mesh.point(n)));
    let row = |n: &NodeId| nodes.binary_search(n).ok();
    let mut around = vec![Vec::new(); nodes.len()];
    for triangle in triangles {
        let area = vector(triangle);
        triangle.iter().filter_map(row).for_each(|i| around[i].push((*triangle, area)));
    }
    let own: BTreeSet<[NodeId; 3]> = triangles.iter().copied().map(face_key).collect();
    let mut planes = vec![Vec::new(); nodes.len()];
    for triangle in kept.iter().filter(|t| !own.contains(&face_key(**t))) {
        let area = vector(triangle);
        for i in triangle.iter().filter_map(row) {
            add_plane(&mut planes[i], unit(area));
        }
    }
    around.iter().zip(&planes).map(|(triangles, planes)| step(triangles, planes)).unzip()
}

/// Direction and length of the step of a node with these triangles around it, and their area vectors.
fn step(triangles: &[([NodeId; 3], Point)], planes: &[Point]) -> (Point, f64) {
    let within = beside(planes, sum(triangles.iter().map(|(_, area)| *area)));
    let area: f64 = triangles.iter().map(|(_, area)| norm(*area)).sum();
    let length = norm(within);
    if length > SHORTEST * area {
        let faces = normals(triangles);
        if !is_sharp(&faces, planes) {
            return (within.map(|c| c / length), 1.0);
        }
        let mitred = mitred(&faces, planes);
        let length = norm(mitred);
        if length > SHORTEST {
            return (mitred.map(|c| c / length), length);
        }
    }
    ([0.0; 3], 1.0)
}

/// The faces that triangles around a node form, each by the places of its triangles: over an edge, one goes on in the other where they
/// turn little. Triangles without area are in none.
pub(crate) fn faces_around(triangles: &[([NodeId; 3], Point)]) -> Vec<Vec<usize>> {
    let places: Vec<usize> = (0..triangles.len()).filter(|&i| norm(triangles[i].1) > 0.0).collect();
    let mut sets = DisjointSets::new(places.len());
    for (i, (nodes, area)) in places.iter().map(|&i| &triangles[i]).enumerate() {
        for (j, (others, other)) in places[..i].iter().map(|&j| &triangles[j]).enumerate() {
            let share_an_edge = nodes.iter().filter(|n| others.contains(n)).count() > 1;
            if share_an_edge && dot(unit(*area), unit(*other)) > SMOOTH {
                sets.join([i, j]);
            }
        }
    }
    let roots: Vec<usize> = (0..places.len()).map(|i| sets.root(i)).collect();
    let of = |root: usize| (0..places.len()).filter(|&i| roots[i] == root).map(|i| places[i]).collect();
    (0..places.len()).filter(|&i| roots[i] == i).map(of).collect()
}

/// Their unit normals.
fn normals(triangles: &[([NodeId; 3], Point)]) -> Vec<Point> {
    let area = |own: Vec<usize>| sum(own.into_iter().map(|i| triangles[i].1));
    let areas = faces_around(triangles).into_iter().map(area);
    areas.filter(|area| norm(*area) > 0.0).map(unit).collect()
}

/// Whether two faces meet in a sharp edge, or one and its mirror image in a plane.
fn is_sharp(faces: &[Point], planes: &[Point]) -> bool {
    let own = faces.iter().enumerate();
    let mut pairs = own.flat_map(|(i, a)| faces[..i].iter().map(|b| dot(*a, *b)));
    pairs.any(|cosine| cosine < SMOOTH)
        || faces.iter().any(|normal| {
            let within = beside(planes, *normal);
            2.0 * dot(within, within) - 1.0 < SMOOTH
        })
}

/// The shortest `v` beside the planes with the least `Σ (v·n_f − 1)²` of all that are no longer than [`LONGEST`].
fn mitred(faces: &[Point], planes: &[Point]) -> Point {
    let within = faces.iter().map(|normal| beside(planes, *normal));
    let mut span = Vec::new();
    within.clone().for_each(|normal| extend(&mut span, normal, SHORTEST));
    let (mut matrix, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
    for normal in within {
        let own: Point = std::array::from_fn(|d| span.get(d).map_or(0.0, |axis| dot(*axis, normal)));
        for d in 0..3 {
            right[d] += own[d];
            (0..3).for_each(|k| matrix[d][k] += own[d] * own[k]);
        }
    }
    // Of directions that no face looks into nothing is asked.
    (span.len()..3).for_each(|d| matrix[d][d] = 1.0);
    let solution = |damping: f64| {
        let mut damped = matrix;
        (0..3).for_each(|d| damped[d][d] += damping);
        solve(damped, right)
    };
    let mut best = solution(0.0);
    if norm(best) > LONGEST {
        // The length falls as the damping grows, from a damping of |right| / LONGEST on it is allowed.
        let (mut low, mut high) = (0.0, norm(right) / LONGEST);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if norm(solution(middle)) > LONGEST { low = middle } else { high = middle }
        }
        best = solution(high);
    }
    sum(span.iter().zip(best).map(|(axis, c)| axis.map(|a| c * a)))
}

/// The solution of a symmetric system of three equations.
fn solve([a, b, c]: [Point; 3], right: Point) -> Point {
    let determinant = dot(a, cross(b, c));
    [cross(b, c), cross(c, a), cross(a, b)].map(|row| dot(row, right) / determinant)
}

/// The sum of vectors, in their order.
fn sum(vectors: impl Iterator<Item = Point>) -> Point {
    vectors.fold([0.0; 3], |sum, own| std::array::from_fn(|d| sum[d] + own[d]))
}

/// Adds the normal of a plane through a node to the orthonormal span of those before.
fn add_plane(planes: &mut Vec<Point>, normal: Point) {
    // A plane of constant coordinate has exactly that normal, whatever the rounding of its triangles.
    let axis = super::dominant_axis(normal);
    let flat = (0..3).all(|d| d == axis || normal[d].abs() < FLAT);
    let normal = if flat { std::array::from_fn(|d| f64::from(d == axis)) } else { normal };
    extend(planes, normal, SAME_PLANE);
}

#[cfg(test)]
mod tests;
