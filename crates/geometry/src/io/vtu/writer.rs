//! Writes VTU files: XML by hand, since it is a dozen tags around blocks of numbers.
//!
//! An array is cut into blocks of a fixed size, each compressed on its own (VTK file formats, "VTK XML File Formats",
//! Kitware: `[blocks, size of a block, size of the last one, compressed sizes…]`, then the blocks, both in base64). So all
//! blocks of a file are compressed in parallel, and put together in their order.
//!
//! The format writes zero for the size of a last block that is full, and some readers take that for an empty block. An
//! array never gets a block size that divides its length, and the question does not come up.

use std::fmt::Write as _;
use std::ops::Range;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::{Compress, Compression, FlushCompress, Status};
use rayon::prelude::*;

use super::{ArrayData, Field, refused};
use crate::error::MeshError;
use crate::ids::NodeId;
use crate::mesh::Mesh;
use crate::tet4::Point;
use crate::topology::Topology;

/// Bytes of one block before compression: the window of zlib twice, so that what starts a block anew costs little.
const BLOCK_BYTES: usize = 65_536;

/// Type of a tetrahedron in VTK.
const VTK_TETRA: u8 = 10;

/// The bytes of a VTU file of a mesh with arrays over its nodes and its elements.
///
/// # Errors
/// [`MeshError::NotFiniteArray`] before anything is made, and [`MeshError::ArrayLength`].
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
    let (length, expected) = (points.len(), topology.node_count());
    if length != expected {
        return Err(MeshError::ArrayLength { array: "points".to_owned(), length, expected });
    }
    file_bytes(topology.region_names(), topology.tets(), points, point_data, cell_data)
}

/// The bytes of a file of tetrahedra between points, with the names of the regions, by their numbers.
pub(super) fn file_bytes(
    region_names: &[String],
    tets: &[[NodeId; 4]],
    points: &[Point],
    point_data: &[Field<'_>],
    cell_data: &[Field<'_>],
) -> Result<Vec<u8>, MeshError> {
    let places = Field { name: "points", data: ArrayData::Vector(points) };
    check(&[places], points.len())?;
    check(point_data, points.len())?;
    check(cell_data, tets.len())?;

    let own = [
        Array { name: "Points", values: Values::Given(places.data) },
        Array { name: "connectivity", values: Values::Connectivity(tets) },
        Array { name: "offsets", values: Values::Offsets(tets.len()) },
        Array { name: "types", values: Values::Types(tets.len()) },
    ];
    let given = point_data.iter().chain(cell_data);
    let given = given.map(|field| Array { name: field.name, values: Values::Given(field.data) });
    let arrays: Vec<Array<'_>> = given.chain(own).collect();
    let elements = encode(&arrays)?;
    let (in_points, rest) = elements.split_at(point_data.len());
    let (in_cells, own) = rest.split_at(cell_data.len());
    let (places, cells) = own.split_at(1);

    let length: usize = elements.iter().map(String::len).sum();
    let mut text = String::with_capacity(length + 1024);
    text += "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" ";
    text += "header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n<UnstructuredGrid>\n";
    push_region_names(&mut text, region_names);
    let (n_nodes, n_tets) = (points.len(), tets.len());
    writeln!(text, "<Piece NumberOfPoints=\"{n_nodes}\" NumberOfCells=\"{n_tets}\">").map_err(refused)?;
    for (tag, elements, fields) in [
        ("PointData", in_points, point_data),
        ("CellData", in_cells, cell_data),
        ("Points", places, &[]),
        ("Cells", cells, &[]),
    ] {
        push_start(&mut text, tag, fields);
        elements.iter().for_each(|element| text += element);
        writeln!(text, "</{tag}>").map_err(refused)?;
    }
    text += "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
    Ok(text.into_bytes())
}

/// The names of the regions as an array of texts over the whole file: entry `i` names the elements whose `region` is `i`.
///
/// VTK writes such an array in ASCII as the bytes of its texts, each followed by a zero.
fn push_region_names(text: &mut String, names: &[String]) {
    if names.is_empty() {
        return;
    }
    *text += "<FieldData><DataArray type=\"String\" Name=\"region_names\" NumberOfTuples=\"";
    *text += &names.len().to_string();
    *text += "\" format=\"ascii\">";
    for byte in names.iter().flat_map(|name| name.bytes().chain([0])) {
        *text += &byte.to_string();
        text.push(' ');
    }
    *text += "</DataArray></FieldData>\n";
}

/// The start of an element with arrays, which says which of them holds global numbers.
pub(super) fn push_start(text: &mut String, tag: &str, fields: &[Field<'_>]) {
    text.push('<');
    *text += tag;
    if let Some(field) = fields.iter().find(|field| matches!(field.data, ArrayData::GlobalIds(_))) {
        *text += " GlobalIds=\"";
        push_escaped(text, field.name);
        text.push('"');
    }
    *text += ">\n";
}

/// The type, name and components of an array, as attributes.
pub(super) fn push_layout(text: &mut String, name: &str, data: ArrayData<'_>) {
    let (kind, _, components, _) = Values::Given(data).layout();
    push_attributes(text, name, kind, components);
}

fn push_attributes(text: &mut String, name: &str, kind: &str, components: usize) {
    *text += " type=\"";
    *text += kind;
    *text += "\" Name=\"";
    push_escaped(text, name);
    *text += "\" NumberOfComponents=\"";
    *text += if components == 3 { "3\"" } else { "1\"" };
}

/// An array of the file.
struct Array<'a> {
    name: &'a str,
    values: Values<'a>,
}

/// Where the numbers of an array come from.
enum Values<'a> {
    Given(ArrayData<'a>),
    /// Four nodes an element.
    Connectivity(&'a [[NodeId; 4]]),
    /// 4, 8, 12, … for so many elements.
    Offsets(usize),
    /// The type of so many elements.
    Types(usize),
}

impl Values<'_> {
    /// VTK's name of the type of a number, bytes of a number, components, and numbers in all.
    fn layout(&self) -> (&'static str, usize, usize, usize) {
        match self {
            Self::Given(ArrayData::Scalar(values)) => ("Float64", 8, 1, values.len()),
            Self::Given(ArrayData::Vector(values)) => ("Float64", 8, 3, 3 * values.len()),
            Self::Given(ArrayData::Integer(values)) => ("Int32", 4, 1, values.len()),
            Self::Given(ArrayData::GlobalIds(values)) => ("Int64", 8, 1, values.len()),
            Self::Connectivity(tets) => ("Int64", 8, 1, 4 * tets.len()),
            Self::Offsets(elements) => ("Int64", 8, 1, *elements),
            Self::Types(elements) => ("UInt8", 1, 1, *elements),
        }
    }

    fn byte_count(&self) -> usize {
        let (_, width, _, count) = self.layout();
        width * count
    }

    /// Bytes of a block: whole numbers, and no divisor of the array's length.
    fn block_bytes(&self) -> usize {
        let length = self.byte_count();
        (0..)
            .map(|k| BLOCK_BYTES - 8 * k)
            .find(|&size| length == 0 || !length.is_multiple_of(size))
            .unwrap_or(BLOCK_BYTES)
    }

    /// The numbers of every block.
    fn blocks(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        let (_, width, _, count) = self.layout();
        let step = self.block_bytes() / width;
        (0..count).step_by(step).map(move |first| first..(first + step).min(count))
    }

    /// Puts the numbers with these indices into `bytes`, little endian.
    fn fill(&self, numbers: Range<usize>, bytes: &mut Vec<u8>) {
        bytes.clear();
        match self {
            Self::Given(ArrayData::Scalar(values)) => {
                values[numbers].iter().for_each(|v| bytes.extend_from_slice(&v.to_le_bytes()));
            }
            Self::Given(ArrayData::Vector(values)) => {
                let values = &values.as_flattened()[numbers];
                values.iter().for_each(|v| bytes.extend_from_slice(&v.to_le_bytes()));
            }
            Self::Given(ArrayData::Integer(values)) => {
                values[numbers].iter().for_each(|v| bytes.extend_from_slice(&v.to_le_bytes()));
            }
            Self::Given(ArrayData::GlobalIds(values)) => {
                values[numbers].iter().for_each(|v| bytes.extend_from_slice(&i64::from(*v).to_le_bytes()));
            }
            Self::Connectivity(tets) => {
                let nodes = &tets.as_flattened()[numbers];
                nodes.iter().for_each(|n| bytes.extend_from_slice(&i64::from(n.0).to_le_bytes()));
            }
            Self::Offsets(_) => {
                numbers.for_each(|e| bytes.extend_from_slice(&(4 * (e as i64 + 1)).to_le_bytes()));
            }
            Self::Types(_) => bytes.resize(numbers.len(), VTK_TETRA),
        }
    }
}

/// The `DataArray` elements of arrays.
fn encode(arrays: &[Array<'_>]) -> Result<Vec<String>, MeshError> {
    let blocks: Vec<(&Values<'_>, Range<usize>)> =
        arrays.iter().flat_map(|array| array.values.blocks().map(|block| (&array.values, block))).collect();
    let compressed: Vec<Vec<u8>> = blocks
        .par_iter()
        .map_init(Deflater::new, |deflater, (values, block)| deflater.compress(values, block.clone()))
        .collect::<Result<_, _>>()?;
    let mut rest = compressed.as_slice();
    let of: Vec<&[Vec<u8>]> = arrays
        .iter()
        .map(|array| {
            let (own, behind) = rest.split_at(array.values.blocks().count());
            rest = behind;
            own
        })
        .collect();
    Ok(arrays.par_iter().zip(of).map(|(array, blocks)| element(array, blocks)).collect())
}

/// One `DataArray` element, with a line end.
fn element(array: &Array<'_>, blocks: &[Vec<u8>]) -> String {
    let (kind, _, components, _) = array.values.layout();
    let (length, block) = (array.values.byte_count(), array.values.block_bytes());
    let sizes = [blocks.len(), block, length % block].into_iter().chain(blocks.iter().map(Vec::len));
    let header: Vec<u8> = sizes.flat_map(|n| (n as u64).to_le_bytes()).collect();
    let data = blocks.concat();
    let mut text = String::with_capacity((header.len() + data.len()) * 4 / 3 + 256 + array.name.len());
    text += "<DataArray";
    push_attributes(&mut text, array.name, kind, components);
    text += " format=\"binary\">";
    STANDARD.encode_string(&header, &mut text);
    STANDARD.encode_string(&data, &mut text);
    text += "</DataArray>\n";
    text
}

/// Text in an attribute: the characters that XML reserves there are written as entities.
pub(super) fn push_escaped(text: &mut String, name: &str) {
    for c in name.chars() {
        match c {
            '&' => *text += "&amp;",
            '<' => *text += "&lt;",
            '>' => *text += "&gt;",
            '"' => *text += "&quot;",
            '\'' => *text += "&apos;",
            other => text.push(other),
        }
    }
}

/// Compresses blocks, one after the other, each on its own.
///
/// At zlib's level 1: mantissas of fields are noise to it. On 73k tetrahedra with all arrays of a run it makes 8.3 MB of
/// 13.8 MB of arrays; zeros, connectivity and region numbers are what shrinks.
struct Deflater {
    zlib: Compress,
    bytes: Vec<u8>,
}

impl Deflater {
    fn new() -> Self {
        Self { zlib: Compress::new(Compression::fast(), true), bytes: Vec::with_capacity(BLOCK_BYTES) }
    }

    fn compress(&mut self, values: &Values<'_>, numbers: Range<usize>) -> Result<Vec<u8>, MeshError> {
        values.fill(numbers, &mut self.bytes);
        self.zlib.reset();
        // Stored as it is, a block grows by a few bytes every 16 KiB or more, and six around it.
        let mut compressed = Vec::with_capacity(self.bytes.len() + self.bytes.len() / 1000 + 64);
        loop {
            let done = self.zlib.total_in() as usize;
            let status = self
                .zlib
                .compress_vec(&self.bytes[done..], &mut compressed, FlushCompress::Finish)
                .map_err(refused)?;
            if status == Status::StreamEnd {
                compressed.shrink_to_fit();
                return Ok(compressed);
            }
            compressed.reserve(self.bytes.len() / 2 + 64);
        }
    }
}

fn check(fields: &[Field<'_>], expected: usize) -> Result<(), MeshError> {
    for field in fields {
        let (length, values): (usize, &[f64]) = match field.data {
            ArrayData::Scalar(values) => (values.len(), values),
            ArrayData::Vector(values) => (values.len(), values.as_flattened()),
            ArrayData::Integer(values) => (values.len(), &[]),
            ArrayData::GlobalIds(values) => (values.len(), &[]),
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
