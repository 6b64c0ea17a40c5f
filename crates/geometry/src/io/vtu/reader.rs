//! Reads the VTU files that the writer makes, and the headers of their pieces: what the report draws. Other kinds of VTU files, such
//! as those with appended data, are refused; VTK reads them all.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use roxmltree::{Document, Node};

use super::{VtuArray, VtuContents, refused};
use crate::error::MeshError;
use crate::ids::NodeId;

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
/// [`MeshError::DanglingNode`]; [`MeshError::ArrayLength`].
pub fn vtu_contents(bytes: &[u8]) -> Result<VtuContents, MeshError> {
    let document = parse(bytes)?;
    let piece = child(grid(&document, "UnstructuredGrid")?, "Piece")?;
    let places = child(child(piece, "Points")?, "DataArray")?;
    let VtuArray::Vector(points) = values(places)? else { return Err(refused("points are no vectors")) };
    let cells = child(piece, "Cells")?;
    let own = |name: &str| {
        let mut arrays = cells.children().filter(|array| array.attribute("Name") == Some(name));
        data(arrays.next().ok_or_else(|| refused(format!("the array `{name}` is missing")))?)
    };
    let connectivity = numbers(&own("connectivity")?, i64::from_le_bytes)?;
    let elements = count(piece, "NumberOfCells")?;
    // As the writer writes tetrahedra: 4, 8, 12, …, all of type 10.
    let mut offsets = numbers(&own("offsets")?, i64::from_le_bytes)?.into_iter().zip(1..);
    let are_tetrahedra = own("types")?.iter().all(|t| *t == 10) && offsets.all(|(offset, e)| offset == 4 * e);
    if !are_tetrahedra
        || connectivity.len() / 4 != elements
        || count(piece, "NumberOfPoints")? != points.len()
    {
        return Err(refused("only tetrahedra are read, as many as the file says"));
    }
    let number = |n: i64| {
        let node = NodeId(u32::try_from(n).unwrap_or(u32::MAX));
        let exists = (node.0 as usize) < points.len();
        exists.then_some(node).ok_or(MeshError::DanglingNode { node, nodes: points.len() })
    };
    let nodes = connectivity.into_iter().map(number).collect::<Result<Vec<_>, _>>()?;
    let tets = nodes.as_chunks::<4>().0.to_vec();
    let point_data = arrays(child(piece, "PointData")?, points.len())?;
    let cell_data = arrays(child(piece, "CellData")?, elements)?;
    Ok(VtuContents { points, tets, point_data, cell_data })
}

/// The files that the bytes of a PVTU file name, in its order, as it names them: relative to it.
///
/// # Errors
/// [`MeshError::Vtu`] if they are damaged or of another kind.
pub fn pvtu_pieces(bytes: &[u8]) -> Result<Vec<String>, MeshError> {
    let document = parse(bytes)?;
    let pieces = grid(&document, "PUnstructuredGrid")?.children().filter(|node| node.has_tag_name("Piece"));
    pieces.map(|piece| Ok(attribute(piece, "Source")?.to_owned())).collect()
}

fn parse(bytes: &[u8]) -> Result<Document<'_>, MeshError> {
    Document::parse(std::str::from_utf8(bytes).map_err(refused)?).map_err(refused)
}

/// The grid of a file of this kind, whose arrays are stored as the writer stores them.
fn grid<'a>(document: &'a Document<'_>, kind: &str) -> Result<Node<'a, 'a>, MeshError> {
    let root = document.root_element();
    let stored = [("byte_order", "LittleEndian"), ("header_type", "UInt64")];
    if stored.iter().any(|(name, value)| root.attribute(*name) != Some(value)) {
        return Err(refused("numbers in little endian with headers of 64 bits are expected"));
    }
    child(root, kind)
}

/// The one child with this tag.
fn child<'a>(parent: Node<'a, 'a>, tag: &str) -> Result<Node<'a, 'a>, MeshError> {
    let mut children = parent.children().filter(|node| node.has_tag_name(tag));
    match (children.next(), children.next()) {
        (Some(only), None) => Ok(only),
        _ => Err(refused(format!("one element `{tag}` is expected in `{}`", parent.tag_name().name()))),
    }
}

fn attribute<'a>(node: Node<'a, 'a>, name: &str) -> Result<&'a str, MeshError> {
    let missing = || refused(format!("`{name}` is missing in `{}`", node.tag_name().name()));
    node.attribute(name).ok_or_else(missing)
}

fn count(node: Node<'_, '_>, name: &str) -> Result<usize, MeshError> {
    let text = node.attribute(name).unwrap_or_default();
    text.parse().map_err(|_| refused(format!("`{name}` is no number: `{text}`")))
}

fn arrays(parent: Node<'_, '_>, length: usize) -> Result<BTreeMap<String, VtuArray>, MeshError> {
    let mut arrays = BTreeMap::new();
    for array in parent.children().filter(|node| node.has_tag_name("DataArray")) {
        let (name, values) = (attribute(array, "Name")?.to_owned(), values(array)?);
        if values.len() != length {
            return Err(MeshError::ArrayLength { array: name, length: values.len(), expected: length });
        }
        arrays.insert(name, values);
    }
    Ok(arrays)
}

fn values(array: Node<'_, '_>) -> Result<VtuArray, MeshError> {
    let kind = (attribute(array, "type")?, attribute(array, "NumberOfComponents")?);
    let bytes = data(array)?;
    match kind {
        ("Float64", "1") => Ok(VtuArray::Scalar(numbers(&bytes, f64::from_le_bytes)?)),
        ("Float64", "3") => {
            let numbers = numbers(&bytes, f64::from_le_bytes)?;
            let (points, []) = numbers.as_chunks::<3>() else { return Err(refused("a vector is cut off")) };
            Ok(VtuArray::Vector(points.to_vec()))
        }
        ("Int32", "1") => Ok(VtuArray::Integer(numbers(&bytes, i32::from_le_bytes)?)),
        ("Int64", "1") => {
            let numbers = numbers(&bytes, i64::from_le_bytes)?;
            let narrow = numbers.into_iter().map(i32::try_from).collect::<Result<_, _>>();
            Ok(VtuArray::Integer(narrow.map_err(refused)?))
        }
        (kind, components) => Err(refused(format!("arrays of {components} {kind} are not read"))),
    }
}

/// Numbers of `N` bytes each.
fn numbers<const N: usize, T>(bytes: &[u8], of: impl Fn([u8; N]) -> T) -> Result<Vec<T>, MeshError> {
    let (numbers, []) = bytes.as_chunks::<N>() else { return Err(refused("a number is cut off")) };
    Ok(numbers.iter().map(|number| of(*number)).collect())
}

/// The bytes of an array: blocks, compressed each on its own, behind a header of their sizes, both in base64.
fn data(array: Node<'_, '_>) -> Result<Vec<u8>, MeshError> {
    let damaged = || refused("the blocks of an array are not those that its header names");
    if array.attribute("format") != Some("binary") {
        return Err(refused("arrays inline in base64 are expected"));
    }
    let text = array.text().unwrap_or_default().trim();
    // Of 9 bytes the first 8: the number of blocks. Their size, that of the last and the compressed sizes follow.
    let first = STANDARD.decode(text.get(..12).ok_or_else(damaged)?).map_err(refused)?;
    let (blocks, _) = first.split_first_chunk().ok_or_else(damaged)?;
    let words = usize::try_from(u64::from_le_bytes(*blocks)).ok().and_then(|n| n.checked_add(3));
    let characters =
        words.and_then(|n| n.checked_mul(8)).map(|bytes| bytes.div_ceil(3)).and_then(|n| n.checked_mul(4));
    let (header, rest) = characters.and_then(|n| text.split_at_checked(n)).ok_or_else(damaged)?;
    let header = numbers(&STANDARD.decode(header).map_err(refused)?, u64::from_le_bytes)?;
    let compressed = STANDARD.decode(rest).map_err(refused)?;
    let (mut rest, mut bytes) = (compressed.as_slice(), Vec::new());
    for (k, size) in header[3..].iter().enumerate() {
        let size = usize::try_from(*size).map_err(refused)?;
        let (block, behind) = rest.split_at_checked(size).ok_or_else(damaged)?;
        let expected = if k + 4 == header.len() { header[2] } else { header[1] };
        let limited = ZlibDecoder::new(block).take(expected.saturating_add(1)).read_to_end(&mut bytes);
        if limited.map_err(refused)? as u64 != expected {
            return Err(damaged());
        }
        rest = behind;
    }
    rest.is_empty().then_some(bytes).ok_or_else(damaged)
}
