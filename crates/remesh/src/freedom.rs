//! The unknown displacement components: along the coordinate axes, or at nodes that keep to a plane oblique to these along
//! the axes of a frame of their own. Vectors outside of it are in coordinates.

use std::collections::BTreeMap;

use fluxmorph_geometry::NodeId;
use fluxmorph_geometry::directions::Frame;
use fluxmorph_geometry::fem::{DofMap, RotatedMatrix};
use fluxmorph_geometry::tet4::{Point, dot};

/// Equation numbers, and the frames of the nodes that have one.
#[derive(Debug)]
pub(crate) struct Freedom {
    dofs: DofMap<3>,
    frames: BTreeMap<NodeId, Frame>,
}

impl Freedom {
    pub(crate) fn new(dofs: DofMap<3>, frames: BTreeMap<NodeId, Frame>) -> Self {
        Self { dofs, frames }
    }

    /// The equation numbers, of components in the frame of each node.
    pub(crate) fn dofs(&self) -> &DofMap<3> {
        &self.dofs
    }

    fn frame(&self, node: NodeId) -> Option<&Frame> {
        if self.frames.is_empty() { None } else { self.frames.get(&node) }
    }

    /// The directions of the components at a node.
    pub(crate) fn axes(&self, node: NodeId) -> [Point; 3] {
        self.frame(node).unwrap_or(&Frame::COORDINATES).axes
    }

    /// The displacement of a node out of a vector of unknowns; without what is not an unknown.
    pub(crate) fn gather(&self, values: &[f64], node: NodeId) -> Point {
        let own = self.dofs.gather(values, node);
        self.frame(node).map_or(own, |frame| in_coordinates(frame, own))
    }

    /// Adds a nodal vector into one of unknowns; what is not an unknown is dropped.
    pub(crate) fn scatter_add(&self, values: &mut [f64], node: NodeId, vector: Point) {
        let own = self.frame(node).map_or(vector, |frame| frame.axes.map(|axis| dot(axis, vector)));
        self.dofs.scatter_add(values, node, own);
    }

    /// The part of a nodal vector along the unknowns.
    pub(crate) fn part(&self, node: NodeId, vector: Point) -> Point {
        let frame = self.frame(node);
        let own = frame.map_or(vector, |frame| frame.axes.map(|axis| dot(axis, vector)));
        let kept = std::array::from_fn(|c| if self.dofs.equation(node, c).is_some() { own[c] } else { 0.0 });
        frame.map_or(kept, |frame| in_coordinates(frame, kept))
    }

    /// The matrix of an element in the frames of its nodes.
    pub(crate) fn turned<L>(&self, matrix: L, nodes: [NodeId; 4]) -> RotatedMatrix<'_, L, 4> {
        RotatedMatrix::new(matrix, nodes.map(|node| self.frame(node)))
    }
}

fn in_coordinates(frame: &Frame, own: Point) -> Point {
    std::array::from_fn(|d| (0..3).map(|k| own[k] * frame.axes[k][d]).sum())
}
