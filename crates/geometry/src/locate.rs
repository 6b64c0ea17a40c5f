//! Which element holds a point.
//!
//! Points are few and elements many: so the points are put into a tree, and each element, once, asks for those in its box.
//! A tree of the elements would take longer to make than all of this. Does not live here: the field at a point.

use rayon::prelude::*;

use crate::box_tree::{AxisBox, BoxTree};
use crate::ids::ElementId;
use crate::mesh::Mesh;
use crate::tet4::{Point, Tet4, dot, sub};

/// How far outside a tetrahedron, in barycentric coordinates, a point still counts as inside: rounding of a shared face.
const INSIDE_TOLERANCE: f64 = -1e-9;

/// How far such a point may lie outside the box, as a share of its extent: three coordinates of that tolerance, with room.
const BOX_MARGIN: f64 = 1e-8;

/// An element, and a point's barycentric coordinates in it.
pub type Located = (ElementId, [f64; 4]);

/// For every point [m] the element that holds it, the first of several; `None` outside the mesh.
pub fn locate(mesh: &Mesh, points: &[Point]) -> Vec<Option<Located>> {
    let mut found: Vec<Option<Located>> = vec![None; points.len()];
    for (i, located) in holders(mesh, points) {
        if found[i].is_none_or(|(e, _)| located.0 < e) {
            found[i] = Some(located);
        }
    }
    found
}

/// Every element that holds one of the points [m], with the number of the point; by ascending element.
#[expect(clippy::disallowed_methods, reason = "lists joined in order are one list, wherever they are cut")]
pub fn holders(mesh: &Mesh, points: &[Point]) -> Vec<(usize, Located)> {
    if points.is_empty() {
        return Vec::new();
    }
    let tree = BoxTree::of_points(points);
    (0..mesh.topology().tets().len())
        .into_par_iter()
        .map(ElementId::new)
        .with_min_len(1024)
        .fold(Vec::new, |mut inside, e| {
            let vertices = mesh.vertices(e);
            let tight = AxisBox::around(vertices);
            let around = tight.grown(BOX_MARGIN * tight.extent());
            let mut near = Vec::new();
            tree.for_each(|own| own.meets(&around), |i| near.push(i));
            if !near.is_empty() {
                let tet = Tet4::new(vertices);
                for i in near {
                    let offset = sub(points[i], vertices[0]);
                    let mut coordinates = tet.gradients.map(|g| dot(g, offset));
                    coordinates[0] += 1.0;
                    if coordinates.iter().all(|&b| b >= INSIDE_TOLERANCE) {
                        inside.push((i, (e, coordinates)));
                    }
                }
            }
            inside
        })
        .flatten()
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::{BlockParameters, block};

    #[test]
    fn a_point_is_given_back_by_its_coordinates_and_a_shared_one_to_the_first_element() {
        let mesh = block(&BlockParameters { size: [1.0; 3], cells: [4; 3] }).expect("a block");
        let mut points: Vec<Point> = mesh.points().to_vec();
        points.extend((0..50).map(|k| [0.31, 0.02 * k as f64, (0.37 * k as f64) % 1.0]));
        for (point, located) in points.iter().zip(locate(&mesh, &points)) {
            let (e, coordinates) = located.expect("inside");
            let vertices = mesh.vertices(e);
            for d in 0..3 {
                let x: f64 = (0..4).map(|a| coordinates[a] * vertices[a][d]).sum();
                // Rounding of lengths of a metre.
                assert!((x - point[d]).abs() < 1e-14, "{point:?}");
            }
            assert_eq!(mesh.topology().elements().find(|&other| holds(&mesh, other, *point)), Some(e));
        }
    }

    fn holds(mesh: &Mesh, e: ElementId, point: Point) -> bool {
        let tet = Tet4::new(mesh.vertices(e));
        let offset = sub(point, mesh.vertices(e)[0]);
        let coordinates = tet.gradients.map(|g| dot(g, offset));
        coordinates[0] + 1.0 >= -1e-9 && coordinates[1..].iter().all(|&b| b >= -1e-9)
    }

    #[test]
    fn outside_there_is_no_element() {
        let mesh = block(&BlockParameters { size: [1.0; 3], cells: [2; 3] }).expect("a block");
        let found = locate(&mesh, &[[0.5, 0.5, 1.0 + 1e-6], [0.5, 0.5, 1.0], [-3.0, 0.0, 0.0]]);
        assert_eq!(found.iter().map(Option::is_some).collect::<Vec<_>>(), [false, true, false]);
        assert!(locate(&mesh, &[]).is_empty());
    }
}
