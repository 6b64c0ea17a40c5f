//! VTK XML files of tetrahedral meshes (`.vtu`), made in `writer` and read in `reader`; parts of a mesh in `piece`, with the
//! header that names them (`.pvtu`), and put together again in `join`.
//!
//! Arrays are inline in base64, compressed by zlib, headers of 64 bits, little endian: what every reader since
//! ParaView 5 understands (appended raw data is not). Equal input makes equal bytes, for any number of threads.

mod join;
mod piece;
mod reader;
mod writer;

use std::collections::BTreeMap;

use crate::error::MeshError;
use crate::ids::NodeId;
use crate::tet4::Point;
pub use join::join_pieces;
pub use piece::{VtuPiece, pvtu_text};
pub use reader::{pvtu_pieces, read_vtu, vtu_contents};
pub use writer::{vtu_bytes, vtu_bytes_at};

/// The values of one array to be written, one entry a node or an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ArrayData<'a> {
    /// One number each, shape `(n,)`.
    Scalar(&'a [f64]),
    /// One vector each, shape `(n, 3)`.
    Vector(&'a [Point]),
    /// One whole number each, shape `(n,)`: region numbers, flags.
    Integer(&'a [i32]),
    /// The number in the whole mesh of each node or element of a part of it, shape `(n,)`; ParaView knows them as such.
    GlobalIds(&'a [u32]),
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
#[derive(Clone, Debug, Default, PartialEq)]
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

/// The array over the nodes of a piece that holds their numbers in the whole mesh.
const GLOBAL_NODES: &str = "GlobalPointIds";
/// The array over the elements of a piece that holds their numbers in the whole mesh.
const GLOBAL_ELEMENTS: &str = "GlobalCellIds";

fn refused(cause: impl std::fmt::Display) -> MeshError {
    MeshError::Vtu { cause: cause.to_string() }
}
