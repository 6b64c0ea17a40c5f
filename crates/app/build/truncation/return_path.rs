//! Whether the way back of flux is among what walls cut off: of a device that goes on beyond two planes, as a long coil does, the flux
//! that passes them returns nowhere. Walls without a tangential `A` all round have none leave: `∮A·dl` along the rim of a plane is
//! the flux through it.

use std::collections::HashSet;

use fluxmorph_geometry::topology::{rim_edges, triangle_edges};
use fluxmorph_geometry::{Mesh, NodeId};
use fluxmorph_solver::{Boundary, FieldModel, SurfaceLaw};

use super::{Side, Standing};

/// Two planes that coils or matter reach and flux passes, where no flux passes what joins them: those at the ends of a slice, or of a
/// sector that leaves out its axis. Planes that meet have an edge along which nothing holds `A`; parts of one plane are not two.
pub(super) fn confined<'s>(
    sides: &'s [Side],
    (model, mesh): (&FieldModel, &Mesh),
    rounding: f64,
) -> Option<[&'s Side; 2]> {
    let held = held_edges(model, mesh);
    let is_closed = |side: &&Side| {
        // Of a flux-parallel plane the edges inside are held as well.
        let is_free = || edges(&side.triangles).any(|edge| !held.contains(&edge));
        let is_plane = side.standing == Standing::Reached && side.normal.is_some();
        is_plane && rim_edges(&side.triangles).iter().all(|edge| held.contains(edge)) && is_free()
    };
    let closed: Vec<&Side> = sides.iter().filter(is_closed).collect();
    closed.iter().enumerate().find_map(|(i, &side)| {
        let other = closed[i + 1..].iter().find(|other| !side.is_coplanar(other, rounding))?;
        Some([side, *other])
    })
}

/// Edges along which `A` is zero.
fn held_edges(model: &FieldModel, mesh: &Mesh) -> HashSet<[NodeId; 2]> {
    let setup = model.setup();
    let parallel = setup.boundaries.iter().filter(|(_, boundary)| *boundary == Boundary::FluxParallel);
    let surfaces = parallel.flat_map(|(name, _)| mesh.topology().surface(name).unwrap_or_default());
    let perfect = setup.conductors.iter().filter(|conductor| conductor.law == SurfaceLaw::Perfect);
    let triangles = surfaces.chain(perfect.flat_map(|conductor| &conductor.surface));
    edges(triangles).collect()
}

fn edges<'t>(triangles: impl IntoIterator<Item = &'t [NodeId; 3]>) -> impl Iterator<Item = [NodeId; 2]> {
    triangles.into_iter().flat_map(|&triangle| triangle_edges(triangle))
}
