//! VTK XML files of tetrahedral meshes (`.vtu`): the only file that names vtkio.
//!
//! Arrays are written inline in base64, compressed by zlib, headers of 64 bits, little endian: what every reader since
//! ParaView 5 understands (appended raw data is not). Equal input makes equal bytes.
//!
//! One flaw of the library is stepped around: it cuts arrays into blocks of 32768 bytes, and closes an array that fills
//! its last block with one empty block more, whose header says that it is full. VTK 9.7 and meshio happen to read that,
//! but the format does not allow it; a file with such an array is written without compression.

use std::collections::BTreeMap;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use vtkio::model::{
    Attribute, Attributes, ByteOrder, CellType, Cells, DataArray, DataSet, IOBuffer, Piece,
    UnstructuredGridPiece, Version, VertexNumbers, Vtk,
};
use vtkio::xml::Compressor;

use crate::error::MeshError;
use crate::ids::NodeId;
use crate::mesh::Mesh;
use crate::tet4::Point;
use crate::topology::Topology;

/// Bytes of one compressed block in the library.
const BLOCK_BYTES: usize = 32_768;

/// zlib level: mantissas of fields are noise to it. On 61k tetrahedra with all arrays of a run, level 1 makes 9.7 MB
/// of the 15.5 MB of no compression, level 5 makes 9.4 MB in twice the time.
const COMPRESSION_LEVEL: u32 = 1;

/// The values of one array to be written, one entry a node or an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ArrayData<'a> {
    /// One number each, shape `(n,)`.
    Scalar(&'a [f64]),
    /// One vector each, shape `(n, 3)`.
    Vector(&'a [Point]),
    /// One whole number each, shape `(n,)`: region numbers, flags.
    Integer(&'a [i32]),
}

/// A named array to be written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field<'a> {
    /// The name that ParaView shows; the unit is not written.
    pub name: &'a str,
    /// The values.
    pub data: ArrayData<'a>,
}

/// The values of one array that was read.
#[derive(Clone, Debug, PartialEq)]
pub enum VtuArray {
    /// Shape `(n,)`.
    Scalar(Vec<f64>),
    /// Shape `(n, 3)`.
    Vector(Vec<Point>),
    /// Shape `(n,)`.
    Integer(Vec<i32>),
}

/// A tetrahedral mesh with arrays, as read from a file; its volumes are not checked.
#[derive(Clone, Debug, PartialEq)]
pub struct VtuContents {
    /// Coordinates [m], shape `(n_nodes, 3)`.
    pub points: Vec<Point>,
    /// Nodes of every tetrahedron.
    pub tets: Vec<[NodeId; 4]>,
    /// Arrays over the nodes, by name.
    pub point_data: BTreeMap<String, VtuArray>,
    /// Arrays over the elements, by name.
    pub cell_data: BTreeMap<String, VtuArray>,
}

/// The bytes of a VTU file of a mesh with arrays over its nodes and its elements.
///
/// # Errors
/// [`MeshError::NotFiniteArray`] before anything is made, [`MeshError::ArrayLength`], and [`MeshError::Vtu`] for what
/// the library refuses.
pub fn vtu_bytes(
    mesh: &Mesh,
    point_data: &[Field<'_>],
    cell_data: &[Field<'_>],
) -> Result<Vec<u8>, MeshError> {
    vtu_bytes_at(mesh.topology(), mesh.points(), point_data, cell_data)
}

/// The same for any places of the nodes [m], shape `(n_nodes, 3)`: to look at elements that a motion inverts.
///
/// # Errors
/// As [`vtu_bytes`].
pub fn vtu_bytes_at(
    topology: &Topology,
    points: &[Point],
    point_data: &[Field<'_>],
    cell_data: &[Field<'_>],
) -> Result<Vec<u8>, MeshError> {
    check(&[Field { name: "points", data: ArrayData::Vector(points) }], topology.node_count())?;
    check(point_data, topology.node_count())?;
    check(cell_data, topology.tets().len())?;

    let piece = UnstructuredGridPiece {
        points: IOBuffer::F64(points.as_flattened().to_vec()),
        cells: Cells {
            cell_verts: VertexNumbers::XML {
                connectivity: topology.tets().iter().flatten().map(|n| u64::from(n.0)).collect(),
                offsets: (1..=topology.tets().len() as u64).map(|e| 4 * e).collect(),
            },
            types: vec![CellType::Tetra; topology.tets().len()],
        },
        data: Attributes {
            point: point_data.iter().map(attribute).collect(),
            cell: cell_data.iter().map(attribute).collect(),
        },
    };
    let compressor = if fills_blocks(topology, points, point_data, cell_data) {
        Compressor::None
    } else {
        Compressor::ZLib
    };
    let vtk = Vtk {
        version: Version::new_xml(1, 0),
        title: String::new(),
        byte_order: ByteOrder::LittleEndian,
        data: DataSet::UnstructuredGrid { meta: None, pieces: vec![Piece::Inline(Box::new(piece))] },
        file_path: None,
    };
    let file = vtk.try_into_xml_format(compressor, COMPRESSION_LEVEL).map_err(refused)?;
    let mut bytes = b"<?xml version=\"1.0\"?>\n".to_vec();
    file.write(&mut bytes).map_err(refused)?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// Writes what [`vtu_bytes`] makes.
///
/// # Errors
/// As [`vtu_bytes`], and [`MeshError::Vtu`] if the writer fails.
pub fn write_vtu(
    mut writer: impl Write,
    mesh: &Mesh,
    point_data: &[Field<'_>],
    cell_data: &[Field<'_>],
) -> Result<(), MeshError> {
    writer.write_all(&vtu_bytes(mesh, point_data, cell_data)?).map_err(refused)
}

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
    // The library indexes decoded data without a check: a cut file would end the program.
    let vtk = catch_unwind(AssertUnwindSafe(|| Vtk::parse_xml(bytes)))
        .map_err(|_| refused("the file is damaged"))?
        .map_err(refused)?;
    let DataSet::UnstructuredGrid { pieces, .. } = vtk.data else {
        return Err(refused("an unstructured grid is expected"));
    };
    let Ok([Piece::Inline(piece)]) = <[_; 1]>::try_from(pieces) else {
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

/// Whether an array's bytes fill whole blocks of the library (see the module).
fn fills_blocks(
    topology: &Topology,
    points: &[Point],
    point_data: &[Field<'_>],
    cell_data: &[Field<'_>],
) -> bool {
    let (nodes, elements) = (points.len(), topology.tets().len());
    let topology = [24 * nodes, 32 * elements, 8 * elements, elements];
    let fields = point_data.iter().chain(cell_data).map(|field| match field.data {
        ArrayData::Scalar(values) => 8 * values.len(),
        ArrayData::Vector(values) => 24 * values.len(),
        ArrayData::Integer(values) => 4 * values.len(),
    });
    topology.into_iter().chain(fields).any(|bytes| bytes % BLOCK_BYTES == 0)
}

fn check(fields: &[Field<'_>], expected: usize) -> Result<(), MeshError> {
    for field in fields {
        let (length, values): (usize, &[f64]) = match field.data {
            ArrayData::Scalar(values) => (values.len(), values),
            ArrayData::Vector(values) => (values.len(), values.as_flattened()),
            ArrayData::Integer(values) => (values.len(), &[]),
        };
        let array = || field.name.to_owned();
        if length != expected {
            return Err(MeshError::ArrayLength { array: array(), length, expected });
        }
        if let Some(i) = values.iter().position(|v| !v.is_finite()) {
            let position = if matches!(field.data, ArrayData::Vector(_)) { i / 3 } else { i };
            return Err(MeshError::NotFiniteArray { array: array(), value: values[i], position });
        }
    }
    Ok(())
}

fn attribute(field: &Field<'_>) -> Attribute {
    let (components, data) = match field.data {
        ArrayData::Scalar(values) => (1, IOBuffer::F64(values.to_vec())),
        ArrayData::Vector(values) => (3, IOBuffer::F64(values.as_flattened().to_vec())),
        ArrayData::Integer(values) => (1, IOBuffer::I32(values.to_vec())),
    };
    Attribute::DataArray(DataArray::new(field.name, components).with_data(data))
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

impl VtuArray {
    /// Number of entries.
    pub fn len(&self) -> usize {
        match self {
            Self::Scalar(values) => values.len(),
            Self::Vector(values) => values.len(),
            Self::Integer(values) => values.len(),
        }
    }

    /// Whether there is no entry.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

fn vectors(values: Vec<f64>) -> Vec<Point> {
    values.as_chunks::<3>().0.to_vec()
}

fn refused(cause: impl std::fmt::Display) -> MeshError {
    MeshError::Vtu { cause: cause.to_string() }
}
