//! Whether the way back of flux is among what walls cut off: of a device that goes on beyond two planes, as a long coil does, the flux
//! that passes them returns nowhere. Walls without a tangential `A` all round have none leave: `∮A·dl` along the rim of a plane is
//! the flux through it.

use std::collections::{HashMap, HashSet};

use fluxmorph_geometry::topology::triangle_edges;
use fluxmorph_geometry::{Mesh, NodeId};
use fluxmorph_solver::{Boundary, FieldModel, SurfaceLaw};

use super::{Side, Standing};

/// Two planes opposite each other that coils or matter reach and flux passes, where no flux passes what joins them.
pub(super) fn confined<'s>(sides: &'s [Side], model: &FieldModel, mesh: &Mesh) -> Option<[&'s Side; 2]> {
    let held = held_edges(model, mesh);
    let is_closed = |side: &&Side| {
        // Of a flux-parallel plane the edges inside are held as well.
        let is_free = || edges(side).any(|edge| !held.contains(&edge));
        let is_plane = side.standing == Standing::Reached && side.normal.is_some();
        is_plane && rim(side).iter().all(|edge| held.contains(edge)) && is_free()
    };
    let closed: Vec<&Side> = sides.iter().filter(is_closed).collect();
    closed.iter().find_map(|side| Some([*side, *closed.iter().find(|other| side.is_opposite(other))?]))
}

/// Edges along which `A` is zero.
fn held_edges(model: &FieldModel, mesh: &Mesh) -> HashSet<[NodeId; 2]> {
    let setup = model.setup();
    let parallel = setup.boundaries.iter().filter(|(_, boundary)| *boundary == Boundary::FluxParallel);
    let surfaces = parallel.flat_map(|(name, _)| mesh.topology().surface(name).unwrap_or_default());
    let perfect = setup.conductors.iter().filter(|conductor| conductor.law == SurfaceLaw::Perfect);
    let triangles = surfaces.chain(perfect.flat_map(|conductor| &conductor.surface));
    triangles.flat_map(|&triangle| triangle_edges(triangle)).collect()
}

fn edges(side: &Side) -> impl Iterator<Item = [NodeId; 2]> {
    side.triangles.iter().flat_map(|&triangle| triangle_edges(triangle))
}

/// The edges that one triangle of a side has alone.
fn rim(side: &Side) -> Vec<[NodeId; 2]> {
    let mut counts: HashMap<[NodeId; 2], usize> = HashMap::new();
    edges(side).for_each(|edge| *counts.entry(edge).or_default() += 1);
    counts.into_iter().filter(|(_, count)| *count == 1).map(|(edge, _)| edge).collect()
}
