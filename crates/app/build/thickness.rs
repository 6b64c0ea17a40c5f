//! Bodies whose wall thickness is not that of the device.

use std::collections::{BTreeSet, HashSet};

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::topology::face_key;
use fluxmorph_optimizer::problem::Shape;

use super::soundness::faces_of;
use crate::config::{Config, Constraint, Limit};

/// What to say of a constraint on the thickness of a body that ends at the outside of the mesh: where a plane of symmetry cuts it, the
/// body goes on as its image.
pub(super) fn cut_warning(config: &Config, shape: Option<&Shape>, full_mesh: &Mesh) -> Option<String> {
    let is_on_thickness = |own: &&Constraint| matches!(own.limit, Limit::Thickness { .. });
    let constraint = config.constraints.iter().find(is_on_thickness)?;
    // In it a region that its surface replaces ends where the device does.
    let topology = full_mesh.topology();
    let outer: HashSet<_> = topology.outer_facets().map(|facet| face_key(facet.nodes)).collect();
    let opposite = shape?.thickness()?.opposite_faces().map(|(place, face)| (place, face_key(face)));
    let opposite: Vec<_> = opposite.collect();
    let cut: Vec<_> = opposite.iter().filter(|(_, face)| outer.contains(face)).collect();
    if cut.is_empty() {
        return None;
    }
    let ends_at = |name: &&String| {
        let faces = faces_of(topology, [name.as_str()]);
        cut.iter().any(|(_, face)| faces.contains(face))
    };
    let named: Vec<String> =
        config.boundaries.surfaces().filter(ends_at).map(|name| format!("`{name}`")).collect();
    let at = if named.is_empty() { "a face without a condition".to_owned() } else { named.join(" or ") };
    Some(format!(
        "`{}`: the thickness behind {} of {} design nodes ends at {at}, at the outside of the mesh, and is that of the meshed part; where \
         that is a plane of symmetry, halve the bound",
        constraint.name,
        cut.iter().map(|(place, _)| place).collect::<BTreeSet<_>>().len(),
        opposite.iter().map(|(place, _)| place).collect::<BTreeSet<_>>().len()
    ))
}
