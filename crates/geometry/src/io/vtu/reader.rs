//! Reads VTU files of tetrahedra and the headers of their pieces: the only file that names vtkio.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use vtkio::model::{Attribute, CellType, DataSet, IOBuffer, Piece, UnstructuredGridPiece, Vtk};

use super::{VtuArray, VtuContents, refused};
use crate::error::MeshError;
use crate::ids::NodeId;
use crate::tet4::Point;

/// How the writer begins a mesh of no elements.
const NOTHING: &[u8] = b"<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\">";

/// Bytes within which it stands.
const START: usize = 1024;

/// Reads a VTU file of tetrahedra.
///
/// # Errors
/// [`MeshError::File`] if it cannot be read, else as [`vtu_contents`].
pub fn read_vtu(path: &Path) -> Result<VtuContents, MeshError> {
    let bytes = std::fs::read(path).map_err(|cause| MeshError::File { path: path.to_owned(), cause })?;
    vtu_contents(&bytes)
}

/// The contents of the bytes of a VTU file of tetrahedra.
///
/// # Errors
/// [`MeshError::Vtu`] if they are damaged, of another kind, or hold other cells than tetrahedra;
/// [`MeshError::DanglingNode`].
pub fn vtu_contents(bytes: &[u8]) -> Result<VtuContents, MeshError> {
    // The library cannot decode arrays without a number, which a piece without elements has.
    let start = &bytes[..bytes.len().min(START)];
    if start.windows(NOTHING.len()).any(|window| window == NOTHING) {
        return Ok(VtuContents::default());
    }
    let Ok([Piece::Inline(piece)]) = <[_; 1]>::try_from(pieces_of(bytes)?) else {
        return Err(refused("one piece with inline data is expected"));
    };
    let points = vectors(piece.points.cast_into().ok_or_else(|| refused("points are not numbers"))?);
    if piece.cells.types.iter().any(|&t| t != CellType::Tetra) {
        return Err(refused("only tetrahedra are read"));
    }
    let elements = piece.cells.types.len();
    let (connectivity, offsets) = piece.cells.cell_verts.into_xml();
    let regular = offsets.iter().enumerate().all(|(e, &offset)| offset == 4 * (e as u64 + 1));
    if !regular || offsets.len() != elements || connectivity.len() != 4 * elements {
        return Err(refused("every tetrahedron must have four nodes"));
    }
    if let Some(&n) = connectivity.iter().find(|&&n| n >= points.len() as u64) {
        let node = NodeId(u32::try_from(n).unwrap_or(u32::MAX));
        return Err(MeshError::DanglingNode { node, nodes: points.len() });
    }
    let nodes: Vec<NodeId> = connectivity.into_iter().map(|n| NodeId::new(n as usize)).collect();
    let tets = nodes.as_chunks::<4>().0.to_vec();
    let point_data = arrays(piece.data.point, points.len())?;
    let cell_data = arrays(piece.data.cell, elements)?;
    Ok(VtuContents { points, tets, point_data, cell_data })
}

/// The files that the bytes of a PVTU file name, in its order, as it names them: relative to it.
///
/// # Errors
/// [`MeshError::Vtu`] if they are damaged or of another kind.
pub fn pvtu_pieces(bytes: &[u8]) -> Result<Vec<String>, MeshError> {
    let source = |piece| match piece {
        Piece::Source(path, _) => Ok(path),
        _ => Err(refused("the names of pieces are expected")),
    };
    pieces_of(bytes)?.into_iter().map(source).collect()
}

fn pieces_of(bytes: &[u8]) -> Result<Vec<Piece<UnstructuredGridPiece>>, MeshError> {
    // The library indexes decoded data without a check: a cut file would end the program.
    let vtk = catch_unwind(AssertUnwindSafe(|| Vtk::parse_xml(bytes)))
        .map_err(|_| refused("the file is damaged"))?
        .map_err(refused)?;
    match vtk.data {
        DataSet::UnstructuredGrid { pieces, .. } => Ok(pieces),
        _ => Err(refused("an unstructured grid is expected")),
    }
}

fn arrays(attributes: Vec<Attribute>, length: usize) -> Result<BTreeMap<String, VtuArray>, MeshError> {
    let mut arrays = BTreeMap::new();
    for attribute in attributes {
        let Attribute::DataArray(array) = attribute else { continue };
        let numbers = || refused(format!("the array `{}` does not hold numbers", array.name));
        let values = match (array.num_comp(), &array.data) {
            (1, IOBuffer::F64(_) | IOBuffer::F32(_)) => {
                VtuArray::Scalar(array.data.cast_into().ok_or_else(numbers)?)
            }
            (1, _) => VtuArray::Integer(array.data.cast_into().ok_or_else(numbers)?),
            (3, _) => VtuArray::Vector(vectors(array.data.cast_into().ok_or_else(numbers)?)),
            (n, _) => return Err(refused(format!("the array `{}` has {n} components", array.name))),
        };
        if values.len() != length {
            return Err(MeshError::ArrayLength { array: array.name, length: values.len(), expected: length });
        }
        arrays.insert(array.name, values);
    }
    Ok(arrays)
}

fn vectors(values: Vec<f64>) -> Vec<Point> {
    values.as_chunks::<3>().0.to_vec()
}
