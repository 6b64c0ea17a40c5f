//! A plain block of equal cells (the paper's example 1: mesh regeneration alone).

use crate::error::MeshError;
use crate::generate::grading::equal_parts;
use crate::generate::grid::{Grid, check_size};
use crate::ids::RegionId;
use crate::mesh::Mesh;

/// Size and cells of a block with one corner in the origin.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockParameters {
    /// Edge lengths along x, y and z [m]. The paper gives none; 80 mm makes cells of 10 mm.
    pub size: [f64; 3],
    /// Cells along x, y and z, six tetrahedra each. The percentages of Table 1 are multiples of 1/3072: 8 × 8 × 8.
    pub cells: [usize; 3],
}

impl Default for BlockParameters {
    fn default() -> Self {
        Self { size: [0.08; 3], cells: [8; 3] }
    }
}

/// A block of one region `block`, its outer faces the surfaces `x_min` … `z_max`.
///
/// # Errors
/// [`MeshError::Parameter`] names `block.size` or `block.cells`.
pub fn block(parameters: &BlockParameters) -> Result<Mesh, MeshError> {
    grid(parameters)?.mesh(&["block"], |_| RegionId(0))
}

impl BlockParameters {
    /// Tetrahedra of the mesh, which is not made.
    ///
    /// # Errors
    /// As [`block`].
    pub fn tet_count(&self) -> Result<usize, MeshError> {
        Ok(grid(self)?.tet_count())
    }
}

fn grid(parameters: &BlockParameters) -> Result<Grid, MeshError> {
    let BlockParameters { size, cells } = *parameters;
    if !size.iter().all(|s| *s > 0.0 && s.is_finite()) {
        let expected = "all three edge lengths must be positive and finite";
        return Err(MeshError::parameter("block.size", format!("{size:?} m"), expected));
    }
    if cells.contains(&0) {
        let expected = "at least one cell is needed along every axis";
        return Err(MeshError::parameter("block.cells", format!("{cells:?}"), expected));
    }
    check_size("block.cells", cells)?;
    Grid::new("block.size", [0, 1, 2].map(|d| equal_parts([0.0, size[d]], cells[d])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tet4;

    #[test]
    fn the_default_block_has_the_elements_of_table_1() {
        let mesh = block(&BlockParameters::default()).expect("the default is valid");
        assert_eq!(mesh.topology().tets().len(), 3072);
        assert_eq!(mesh.topology().node_count(), 729);
        let volume: f64 = mesh.topology().elements().map(|e| tet4::volume(mesh.vertices(e))).sum();
        assert!((volume / 0.08f64.powi(3) - 1.0).abs() < 1e-12);
        assert_eq!(mesh.bounding_box(), [[0.0; 3], [0.08; 3]]);
        assert_eq!(mesh.topology().facets().len(), 6 * 128);
    }

    #[test]
    fn bad_parameters_are_refused_by_name() {
        let refused = |size, cells| match block(&BlockParameters { size, cells }) {
            Err(MeshError::Parameter { parameter, .. }) => parameter,
            other => panic!("{other:?}"),
        };
        assert_eq!(refused([1.0, 0.0, 1.0], [1; 3]), "block.size");
        assert_eq!(refused([1.0, f64::NAN, 1.0], [1; 3]), "block.size");
        assert_eq!(refused([1.0; 3], [1, 0, 1]), "block.cells");
        assert_eq!(refused([1.0; 3], [usize::MAX; 3]), "block.cells");
        assert_eq!(refused([1.0; 3], [300; 3]), "block.cells");
    }
}
