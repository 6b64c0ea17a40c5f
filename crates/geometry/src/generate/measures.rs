//! What the tests of the generators measure.

use crate::mesh::Mesh;
use crate::tet4::{self, Point};

/// Volume of a region [m³].
pub(super) fn volume(mesh: &Mesh, name: &str) -> f64 {
    let id = mesh.topology().region(name).expect("it has it");
    mesh.topology().elements_of(id).iter().map(|&e| tet4::volume(mesh.vertices(e))).sum()
}

/// Sum of the area vectors of a surface [m²].
pub(super) fn area(mesh: &Mesh, name: &str) -> Point {
    let triangles = mesh.topology().surface(name).expect("it has it");
    triangles.iter().fold([0.0; 3], |sum, t| {
        let a = tet4::area_vector(t.map(|n| mesh.point(n)));
        [0, 1, 2].map(|d| sum[d] + a[d])
    })
}
