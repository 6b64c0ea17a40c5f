//! What can be wrong with a mesh, its generator or a file.

use std::path::PathBuf;

use crate::ids::{ElementId, NodeId};
use crate::millimetres::millimetres;

/// Errors of this crate; each names the culprit.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of a variant says what its fields are")]
pub enum MeshError {
    /// A node has a coordinate that is not a number or not finite.
    #[error("node {node} lies at {point:?} m: every coordinate must be finite")]
    NotFinite {
        node: NodeId,
        /// Its coordinates [m].
        point: [f64; 3],
    },
    /// A tetrahedron has no or negative volume.
    #[error(
        "element {element} at {} has the volume {:.3e} mm³: it is flat or inverted, and must be positive",
        millimetres(*centroid),
        volume * 1e9
    )]
    Inverted {
        element: ElementId,
        /// Its signed volume [m³].
        volume: f64,
        /// Its centroid [m].
        centroid: [f64; 3],
    },
    /// The number of coordinates is not the number of nodes.
    #[error("{points} points for {nodes} nodes: one point a node is needed")]
    PointCount { points: usize, nodes: usize },
    /// A tetrahedron or surface names a node that does not exist.
    #[error("node {node} is used, but the mesh has {nodes} nodes (numbered from 0)")]
    DanglingNode { node: NodeId, nodes: usize },
    /// Three or more tetrahedra share one face.
    #[error("the face {face:?} is shared by more than two tetrahedra: the mesh overlaps itself")]
    OverfullFace {
        /// The three nodes, sorted.
        face: [NodeId; 3],
    },
    /// Two tetrahedra lie on the same side of their common face.
    #[error(
        "the elements {} and {} lie on the same side of their common face: the mesh is folded there", elements[0], elements[1]
    )]
    Folded { elements: [ElementId; 2] },
    /// A region name that the mesh does not have.
    #[error("there is no region `{name}`; the mesh has: {known}")]
    UnknownRegion { name: String, known: String },
    /// A surface name that the mesh does not have.
    #[error("there is no surface `{name}`; the mesh has: {known}")]
    UnknownSurface { name: String, known: String },
    /// A parameter of a generator is out of range.
    #[error("{parameter} = {value}: {expected}")]
    Parameter {
        /// Generator and parameter, with a dot between them.
        parameter: &'static str,
        value: String,
        expected: String,
    },
    /// A node with more elements than any mesh of a device has.
    #[error("node {} belongs to {tets} tetrahedra; at most {most} may meet at one: the mesh is corrupt or needs remeshing there", node.0)]
    CrowdedNode { node: NodeId, tets: usize, most: usize },
    /// A refinement would pass a limit.
    #[error("a finer mesh would have more than {most} {what}: it is refined as far as it may be")]
    RefinementLimit { what: &'static str, most: usize },
    /// A sparse factorisation failed.
    #[error("the sparse factorisation of {unknowns} unknowns failed: {cause}")]
    Factorisation { unknowns: usize, cause: String },
    /// A mesh cannot be distributed over so many ranks.
    #[error(
        "{ranks} ranks cannot share a mesh of {nodes} nodes, since every rank owns at least one: take 1 to {nodes} ranks"
    )]
    Ranks { ranks: usize, nodes: usize },
    /// A value to be written is not finite.
    #[error("the array `{array}` holds {value} at position {position}: only finite values are written")]
    NotFiniteArray { array: String, value: f64, position: usize },
    /// An array has not one value a node or an element.
    #[error("the array `{array}` has {length} values where {expected} are needed")]
    ArrayLength { array: String, length: usize, expected: usize },
    /// A VTU file could not be made or understood.
    #[error("VTU file: {cause}")]
    Vtu { cause: String },
    /// A Gmsh file is refused.
    #[error("{}, {cause}", path.display())]
    Msh { path: PathBuf, cause: Box<crate::io::MshError> },
    /// The name of a region or surface cannot stand in a mesh file.
    #[error("the name `{}` {problem}, and cannot stand in a mesh file: give it another name", name.escape_debug())]
    Name { name: String, problem: &'static str },
    /// Two regions, or a region and the outside, do not touch.
    #[error("the regions of `{name}` have no face in common")]
    NoInterface { name: String },
    /// Reading or writing a file failed.
    #[error("{}: {cause}", path.display())]
    File { path: PathBuf, cause: std::io::Error },
}

impl MeshError {
    /// [`MeshError::Parameter`] of these texts.
    pub(crate) fn parameter(
        parameter: &'static str,
        value: impl ToString,
        expected: impl Into<String>,
    ) -> Self {
        Self::Parameter { parameter, value: value.to_string(), expected: expected.into() }
    }
}
