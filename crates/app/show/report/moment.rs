//! The two shapes that a page shows, and where the nodes of the mesh are in them.

use fluxmorph_geometry::NodeId;
use fluxmorph_geometry::tet4::Point;

use super::data::RunData;
use crate::build::{Outline, OutlinedDesign};

/// Which shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Moment {
    Before,
    After,
}

/// Where every node of the full mesh is [m]: by the field file, else by the design, which moves the design surface alone; `None` where
/// neither is known.
pub(super) fn place<'a>(
    data: &'a RunData,
    outline: &'a Outline,
    design: &OutlinedDesign,
    moment: Moment,
) -> Option<impl Fn(NodeId) -> Point + 'a> {
    let field = data.fields[moment as usize].as_ref().ok();
    let mut moved = Vec::new();
    if field.is_none() {
        let displacement = design.surface.displacement(data.designs[moment as usize].as_ref()?);
        moved = outline.full_mesh.points().to_vec();
        for (node, own) in design.surface.nodes().iter().zip(displacement) {
            (0..3).for_each(|d| moved[node.index()][d] += own[d]);
        }
    }
    Some(move |node: NodeId| match (field, outline.node_of[node.index()]) {
        (Some(field), Some(own)) => field.points[own.index()],
        (Some(_), None) => outline.full_mesh.point(node),
        (None, _) => moved[node.index()],
    })
}
