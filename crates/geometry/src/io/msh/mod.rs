//! Gmsh mesh files (`.msh`): read in versions 2.2 and 4.1, ASCII and binary of both byte orders; written in version 4.1.
//!
//! Physical volumes become regions and physical surfaces become named surfaces; a group without name is called
//! `volume_TAG` or `surface_TAG`. Nodes, elements and triangles are numbered in the order of their tags, whatever the
//! order of blocks in the file; regions in the order of theirs. What is done to a file beyond that is told in
//! [`MshNotices`]; what would leave a hole, an overlap or a doubt is refused with its place ([`MshError`]):
//!
//! * every tetrahedron belongs to exactly one physical volume, and a physical volume holds nothing else;
//! * two groups of one dimension have different names;
//! * second-order elements are read with straight edges; points, lines, quadrangles, and whatever belongs to no physical
//!   group are skipped, but not tetrahedra;
//! * a triangle that is no face of a tetrahedron is dropped with a notice: no boundary can be there, and the rest of a
//!   file may be sound.
//!
//! A header's counts are compared with the bytes that remain before memory is taken. Source of the format: Gmsh
//! reference manual, "MSH file format" and "MSH file format version 2 (Legacy)".

mod assemble;
mod cursor;
mod error;
mod notices;
mod reader;
mod scale;
mod shape;
mod shells;
mod writer;

use std::path::Path;

pub use error::{Excerpt, MshError, MshFault, Place, Subject};
pub use notices::MshNotices;
pub use writer::{MshEncoding, msh_bytes};

use crate::error::MeshError;
use crate::io::regular::read_regular;
use crate::mesh::Mesh;
use scale::Scale;

/// A mesh from a file, and what was done to it.
#[derive(Clone, Debug)]
pub struct MshMesh {
    /// The mesh, in metres.
    pub mesh: Mesh,
    /// What was skipped, dropped or turned around.
    pub notices: MshNotices,
}

/// Reads the bytes of a file whose coordinates are in units of `metres_per_unit` [m].
///
/// # Errors
/// [`MshError`] with line or byte, and the node, element, entity or section.
///
/// # Panics
/// If `metres_per_unit` is not positive and finite.
pub fn read_msh(bytes: &[u8], metres_per_unit: f64) -> Result<MshMesh, MshError> {
    assemble::assemble(reader::read(bytes, Scale::new(metres_per_unit))?)
}

/// Reads a file as [`read_msh`] does its bytes.
///
/// # Errors
/// [`MeshError::File`] when the file cannot be read or is no regular file, [`MeshError::Msh`] when its content is refused.
///
/// # Panics
/// If `metres_per_unit` is not positive and finite.
pub fn read_msh_file(path: &Path, metres_per_unit: f64) -> Result<MshMesh, MeshError> {
    let bytes = read_regular(path).map_err(|cause| MeshError::File { path: path.to_owned(), cause })?;
    read_msh(&bytes, metres_per_unit)
        .map_err(|cause| MeshError::Msh { path: path.to_owned(), cause: Box::new(cause) })
}
