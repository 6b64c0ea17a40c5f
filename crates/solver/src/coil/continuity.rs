//! Whether the current of a coil region goes on where it ends: the load must do no work on a field without a curl.
//!
//! `∫J·∇q` over a region is zero for every `q` that is constant on each connected set of walls with a fixed tangential
//! `A` and of conductors, or current gathers there; `∫J·h` for a curl-free `h` round a tunnel is zero, or a current
//! flows through a loop on which `H` has nothing to turn round. Otherwise there is no field, and what edge elements give depends on
//! their tree. What a current brings to vertices does not change as it is carried along with the mesh, so that a conductor that moves
//! passes wherever it did at first. Analytic coils and magnets act through `curl w`: there is nothing to check.

use fluxmorph_geometry::disjoint_sets::DisjointSets;
use fluxmorph_geometry::tet4::EDGES;
use fluxmorph_geometry::{Mesh, NodeId};

use super::Coil;
use super::fault::RegionFault;
use super::region::RegionCurrent;
use crate::error::SolverError;
use crate::harmonic::HarmonicField;
use crate::space::Space;

/// Share of a coil's current that may be left over: the rounding of its own linear system is 1e-12, one turn in a million
/// changes no field.
const LEFT_OVER: f64 = 1e-6;

/// Refuses coil regions whose current does not go on.
///
/// `joined` connects the vertices between which current may pass: on walls with a fixed tangential `A`, and in conductors.
///
/// # Errors
/// [`SolverError::CoilRegion`].
pub(crate) fn check(
    mesh: &Mesh,
    coils: &[Coil],
    joined: &mut DisjointSets,
    (space, harmonic): (&Space, &[HarmonicField]),
) -> Result<(), SolverError> {
    for coil in coils {
        let Some(current) = coil.shape.region_current() else { continue };
        let fault = gathered(mesh, current, joined).or_else(|| encircled(mesh, current, space, harmonic));
        if let Some(fault) = fault {
            return Err(SolverError::CoilRegion { coil: coil.name.clone(), fault });
        }
    }
    Ok(())
}

/// Where current gathers.
fn gathered(mesh: &Mesh, current: &RegionCurrent, joined: &mut DisjointSets) -> Option<RegionFault> {
    let mut left = vec![0.0; mesh.topology().node_count()];
    for ((e, _), into) in current.current_density().iter().zip(current.brought_to_vertices()) {
        for (node, share) in mesh.topology().tet(*e).into_iter().zip(into) {
            left[joined.root(node.index())] += share;
        }
    }
    let place = left.iter().position(|i| i.abs() > LEFT_OVER)?;
    Some(RegionFault::Unconnected { place: mesh.point(NodeId::new(place)) })
}

/// A tunnel that the current flows round.
fn encircled(
    mesh: &Mesh,
    current: &RegionCurrent,
    space: &Space,
    harmonic: &[HarmonicField],
) -> Option<RegionFault> {
    if harmonic.is_empty() {
        return None;
    }
    let mut load = vec![0.0; space.edges().len()];
    for ((e, _), into) in current.current_density().iter().zip(current.brought_to_vertices()) {
        let into = space.cell(mesh, *e).order.map(|place| into[usize::from(place)]);
        // `∫J·(λ_i∇λ_j − λ_j∇λ_i)` of a constant J.
        for (carrier, [i, j]) in space.carriers_of(*e).iter().zip(EDGES) {
            load[carrier.index()] += 0.25 * (into[j] - into[i]);
        }
    }
    harmonic
        .iter()
        .map(|field| field.circulations.iter().map(|&(edge, value)| value * load[edge]).sum::<f64>())
        .any(|current: f64| current.abs() > LEFT_OVER)
        .then_some(RegionFault::RoundTunnel)
}
