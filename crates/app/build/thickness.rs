//! Bodies whose wall thickness is not that of the device.

use std::collections::HashSet;

use fluxmorph_geometry::topology::face_key;
use fluxmorph_optimizer::problem::Problem;

use super::soundness::faces_of;
use crate::config::{Config, Constraint, Limit};

/// What to say of a constraint on the thickness of a body that ends at the outside of the mesh: where a plane of symmetry cuts it, the
/// body goes on as its image.
pub(super) fn cut_warning(config: &Config, problem: &Problem) -> Option<String> {
    let is_on_thickness = |own: &&Constraint| matches!(own.limit, Limit::Thickness { .. });
    let constraint = config.constraints.iter().find(is_on_thickness)?;
    let topology = problem.original().topology();
    let outer = topology.facets().iter().filter(|facet| facet.outside.is_none());
    let mut outer: HashSet<_> = outer.map(|facet| face_key(facet.nodes)).collect();
    // A region that its surface replaces ends there, and not the device.
    for conductor in problem.states().first().into_iter().flat_map(|state| state.conductors()) {
        conductor.surface.iter().for_each(|face| {
            outer.remove(&face_key(*face));
        });
    }
    let opposite: Vec<_> = problem.shape()?.thickness()?.opposite_faces().map(face_key).collect();
    let cut: Vec<_> = opposite.iter().filter(|face| outer.contains(*face)).collect();
    let first = *cut.first()?;
    let named = config.boundaries.surfaces().find(|name| faces_of(topology, [name.as_str()]).contains(first));
    let at = named.map_or_else(|| "a face without a condition".to_owned(), |name| format!("`{name}`"));
    Some(format!(
        "`{}`: the thickness behind {} of {} design nodes ends at {at}, at the outside of the mesh, and is that of the meshed part; where \
         that is a plane of symmetry, halve the bound",
        constraint.name,
        cut.len(),
        opposite.len()
    ))
}
