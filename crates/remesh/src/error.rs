//! What can be wrong with a remesh region or with a motion of it.

use fluxmorph_geometry::parallel::RankError;
use fluxmorph_geometry::{ElementId, MeshError, NodeId, millimetres};

/// Errors of this crate; each names the culprit.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of a variant says what its fields are")]
pub enum RemeshError {
    /// A rank could not do its share.
    #[error(transparent)]
    Rank(#[from] RankError),
    /// The remesh region has no element.
    #[error("the remesh region has no element: name at least one region of the mesh")]
    EmptyRegion,
    /// An element lies in two subregions.
    #[error(
        "element {element} lies in the remesh subregions `{first}` and `{second}`: they must not overlap"
    )]
    Overlap { element: ElementId, first: String, second: String },
    /// A subregion names an element that the mesh does not have.
    #[error(
        "the remesh subregion `{subregion}` names element {element}, but the mesh has {elements} elements"
    )]
    DanglingElement { subregion: String, element: ElementId, elements: usize },
    /// A surface or node list of the set-up names a node that the mesh does not have.
    #[error("{list} names node {node}, but the mesh has {nodes} nodes")]
    DanglingNode { list: String, node: NodeId, nodes: usize },
    /// A parameter of a subregion is out of range.
    #[error("{parameter} = {value} of the remesh subregion `{subregion}`: {expected}")]
    Parameter { subregion: String, parameter: &'static str, value: f64, expected: &'static str },
    /// A motion along no coordinate axis.
    #[error("nodes are to move along the axis {axis}: expected 0, 1 or 2")]
    Axis { axis: usize },
    /// A design node is no node of the remesh region.
    #[error(
        "design node {node} at {} is not in the remesh region: enlarge the region so that it holds the elements around every \
         design node",
        millimetres(*point)
    )]
    DesignNodeOutside {
        node: NodeId,
        /// Where it lies [m].
        point: [f64; 3],
    },
    /// A design node is listed twice.
    #[error("design node {node} is listed twice: a node has one displacement")]
    RepeatedDesignNode { node: NodeId },
    /// A surface with a boundary kind does not touch the remesh region.
    #[error(
        "no triangle of the surface `{surface}` ({kind}) is a face of the remesh region: drop it from the list"
    )]
    SurfaceElsewhere {
        surface: String,
        /// Its kind: design, fixed, slide or free.
        kind: &'static str,
    },
    /// A sliding surface is curved.
    #[error(
        "the surface `{surface}` cannot slide: its triangle at {} has the normal ({:.3}, {:.3}, {:.3}), and another \
         has one within 25 degrees of it: it is curved, and only planes may slide; list it as fixed, or where it has no condition \
         as free, and of two planes each as a surface of its own",
        millimetres(*centroid), normal[0], normal[1], normal[2]
    )]
    SlideCurved {
        surface: String,
        /// Centroid of the triangle [m].
        centroid: [f64; 3],
        normal: [f64; 3],
    },
    /// A part of the remesh region can move as a rigid body.
    #[error(
        "the connected part of the remesh region around {} can move as a rigid body: fix, or let slide, enough of its \
         boundary",
        millimetres(*point)
    )]
    Unrestrained {
        /// A node of the part [m].
        point: [f64; 3],
    },
    /// A motion inverts an element.
    #[error(
        "the motion inverts element {element} of region `{region}` at {}: only {:.4} of \
         it can be taken; move less, enlarge the remesh region or change its stiffness",
        millimetres(*centroid),
        fraction.min(0.9999)
    )]
    Inverted {
        element: ElementId,
        region: String,
        /// Its centroid before the motion [m].
        centroid: [f64; 3],
        /// Share of the motion at which its volume vanishes, in `0 ..= 1`.
        fraction: f64,
    },
    /// The iterative solver of the elastic system stopped short of its tolerance.
    #[error(
        "the elastic system of {unknowns} unknowns did not converge: relative residual {residual:.1e} after \
         {iterations} iterations, required {tolerance:.0e}; bring the stiffness and the shapes of the remesh region's \
         elements closer together"
    )]
    NotConverged { unknowns: usize, iterations: usize, residual: f64, tolerance: f64 },
    /// The law of motion has found no equilibrium.
    #[error(
        "the mesh motion did not come to rest in {steps} Newton steps: the displacements, or the stiffnesses of the remesh \
         region, span more than numbers hold; check units, bounds and the stiffness policy"
    )]
    NotSettled { steps: usize },
    /// The elastic system gives something that is no number.
    #[error(
        "the elastic system gives a {what} of {value}: the displacements, or the stiffnesses of the remesh region, span \
         more than numbers hold; check units, bounds and the stiffness policy"
    )]
    NotFinite { what: &'static str, value: f64 },
    /// The mesh or the linear algebra failed.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}
