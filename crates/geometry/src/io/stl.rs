//! Triangulated surfaces for printing and machining (`.stl`, binary).
//!
//! The format has no unit: coordinates are written in the unit that the caller names.

use crate::error::MeshError;
use crate::ids::NodeId;
use crate::mesh::Mesh;
use crate::tet4::{area_vector, norm};

/// The 80 bytes before the count of triangles; they may not begin with `solid`, the mark of the text form.
const HEADER: &[u8; 80] = b"fluxmorph surface, binary STL                                                   ";

/// The bytes of an STL file of triangles, with coordinates in units of `metres_per_unit` [m].
///
/// Normals follow the order of the nodes by the right-hand rule; that of a triangle without area is zero, as the format
/// has it. Equal input makes equal bytes.
///
/// # Errors
/// [`MeshError::NotFiniteArray`] when a coordinate is too large for the 32 bits of the format.
///
/// # Panics
/// If a node is not in the mesh.
pub fn stl_bytes(mesh: &Mesh, triangles: &[[NodeId; 3]], metres_per_unit: f64) -> Result<Vec<u8>, MeshError> {
    let mut bytes = Vec::with_capacity(84 + 50 * triangles.len());
    bytes.extend(HEADER);
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for (position, triangle) in triangles.iter().enumerate() {
        let vertices = triangle.map(|n| mesh.point(n));
        let area = area_vector(vertices);
        let length = norm(area);
        let normal = area.map(|x| if length > 0.0 { x / length } else { 0.0 });
        let in_units = vertices.map(|v| v.map(|x| x / metres_per_unit));
        for x in std::iter::once(normal).chain(in_units).flatten() {
            let value = x as f32;
            if !value.is_finite() {
                return Err(MeshError::NotFiniteArray { array: "coordinates".into(), value: x, position });
            }
            bytes.extend(value.to_le_bytes());
        }
        bytes.extend([0, 0]);
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::{BlockParameters, block};

    fn floats(bytes: &[u8]) -> Vec<f32> {
        bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
    }

    #[test]
    fn triangles_have_unit_normals_and_coordinates_in_the_unit() {
        let mesh = block(&BlockParameters { size: [0.02; 3], cells: [1; 3] }).expect("valid");
        let top = mesh.topology().surface("z_max").expect("the block has it");
        let bytes = stl_bytes(&mesh, top, 1e-3).expect("finite");
        assert_eq!(bytes.len(), 84 + 50 * top.len());
        assert!(!bytes.starts_with(b"solid"));
        assert_eq!(bytes[80..84], (top.len() as u32).to_le_bytes());
        for (record, triangle) in bytes[84..].chunks(50).zip(top) {
            let values = floats(&record[..48]);
            let area = area_vector(triangle.map(|n| mesh.point(n)));
            assert_eq!(values[..3], [0.0, 0.0, area[2].signum() as f32]);
            for (vertex, node) in values[3..].chunks(3).zip(triangle) {
                let point = mesh.point(*node);
                // Single precision of 20 mm.
                assert!((0..3).all(|d| (f64::from(vertex[d]) - 1e3 * point[d]).abs() < 2e-6));
            }
        }
        assert_eq!(bytes, stl_bytes(&mesh, top, 1e-3).expect("finite"));
        assert!(stl_bytes(&mesh, top, 1e-300).is_err());
    }
}
