//! A part of a mesh as a VTU file of its own, and the header (`.pvtu`) that names all parts.
//!
//! A piece holds some elements and the nodes that they touch: what lies on the border of two pieces is in both. The numbers
//! of its nodes and elements in the whole mesh go with it as what VTK calls global ids, by which readers tell that two
//! nodes are one.

use super::writer::{file_bytes, push_escaped, push_layout, push_start};
use super::{ArrayData, Field, GLOBAL_ELEMENTS, GLOBAL_NODES};
use crate::error::MeshError;
use crate::ids::{ElementId, NodeId};
use crate::tet4::Point;
use crate::topology::Topology;

/// Some elements of a mesh and the nodes that they touch.
#[derive(Clone, Debug)]
pub struct VtuPiece {
    nodes: Vec<NodeId>,
    elements: Vec<ElementId>,
    /// Nodes of every element by their places in `nodes`.
    tets: Vec<[NodeId; 4]>,
    /// Of the whole mesh.
    region_names: Vec<String>,
}

impl VtuPiece {
    /// The piece of the given elements; their order does not matter, and one given twice is there once.
    ///
    /// # Panics
    /// If an element does not exist.
    pub fn new(topology: &Topology, elements: &[ElementId]) -> Self {
        let mut elements = elements.to_vec();
        elements.sort_unstable();
        elements.dedup();
        let mut place = vec![None; topology.node_count()];
        for n in elements.iter().flat_map(|&e| topology.tet(e)) {
            place[n.index()] = Some(NodeId(0));
        }
        let mut nodes = Vec::new();
        for node in topology.nodes() {
            if let Some(place) = &mut place[node.index()] {
                *place = NodeId::new(nodes.len());
                nodes.push(node);
            }
        }
        let local = |n: NodeId| place[n.index()].expect("the nodes of its elements are in the piece");
        let tets = elements.iter().map(|&e| topology.tet(e).map(local)).collect();
        Self { nodes, elements, tets, region_names: topology.region_names().to_vec() }
    }

    /// Its nodes in the whole mesh, ascending.
    pub fn nodes(&self) -> &[NodeId] {
        &self.nodes
    }

    /// Its elements in the whole mesh, ascending.
    pub fn elements(&self) -> &[ElementId] {
        &self.elements
    }

    /// The bytes of its file; `points` [m] are those of the whole mesh, shape `(n_nodes, 3)`, the arrays those of the
    /// piece, in the order of [`VtuPiece::nodes`] and [`VtuPiece::elements`].
    ///
    /// # Errors
    /// As [`super::vtu_bytes`].
    ///
    /// # Panics
    /// If a node of the piece has no point.
    pub fn bytes(
        &self,
        points: &[Point],
        point_data: &[Field<'_>],
        cell_data: &[Field<'_>],
    ) -> Result<Vec<u8>, MeshError> {
        let points: Vec<Point> = self.nodes.iter().map(|n| points[n.index()]).collect();
        let nodes: Vec<u32> = self.nodes.iter().map(|n| n.0).collect();
        let elements: Vec<u32> = self.elements.iter().map(|e| e.0).collect();
        let [point_data, cell_data] = with_global_ids(point_data, cell_data, [&nodes, &elements]);
        file_bytes(&self.region_names, &self.tets, &points, &point_data, &cell_data)
    }
}

/// The arrays of a piece: those given, and the numbers in the whole mesh behind them.
fn with_global_ids<'a>(
    point_data: &[Field<'a>],
    cell_data: &[Field<'a>],
    ids: [&'a [u32]; 2],
) -> [Vec<Field<'a>>; 2] {
    let [nodes, elements] = [(GLOBAL_NODES, ids[0]), (GLOBAL_ELEMENTS, ids[1])]
        .map(|(name, ids)| Field { name, data: ArrayData::GlobalIds(ids) });
    [[point_data, &[nodes]].concat(), [cell_data, &[elements]].concat()]
}

/// The text of the header of pieces with these arrays, whose values do not matter; `pieces` are paths relative to the
/// header.
pub fn pvtu_text(point_data: &[Field<'_>], cell_data: &[Field<'_>], pieces: &[String]) -> String {
    let mut text = String::from("<?xml version=\"1.0\"?>\n");
    text += "<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" ";
    text += "header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n<PUnstructuredGrid GhostLevel=\"0\">\n";
    let [point_data, cell_data] = with_global_ids(point_data, cell_data, [&[], &[]]);
    let places = Field { name: "Points", data: ArrayData::Vector(&[]) };
    for (tag, fields) in [("PPointData", point_data), ("PCellData", cell_data), ("PPoints", vec![places])] {
        push_start(&mut text, tag, &fields);
        for field in &fields {
            text += "<PDataArray";
            push_layout(&mut text, field.name, field.data);
            text += "/>\n";
        }
        text += "</";
        text += tag;
        text += ">\n";
    }
    for piece in pieces {
        text += "<Piece Source=\"";
        push_escaped(&mut text, piece);
        text += "\"/>\n";
    }
    text + "</PUnstructuredGrid>\n</VTKFile>\n"
}
