//! Whether the current of a coil region goes on where it ends: the load must do no work on a field without a curl.
//!
//! `∫J·∇q` over a region is zero for every `q` that is constant on each connected set of walls with a fixed tangential
//! `A` and of conductors, or current gathers there; `∫J·h` for a curl-free `h` round a tunnel is zero, or a current
//! flows through a loop on which `H` has nothing to turn round. Otherwise there is no field, and what edge elements give depends on
//! their tree. Analytic coils and magnets act through `curl w`: there is nothing to check.

use fluxmorph_geometry::disjoint_sets::DisjointSets;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Tet4, dot};
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
    for &(e, density) in current.current_density() {
        let tet = Tet4::new(mesh.vertices(e));
        for (node, gradient) in mesh.topology().tet(e).into_iter().zip(tet.gradients) {
            left[joined.root(node.index())] += tet.volume * dot(density, gradient);
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
    for &(e, density) in current.current_density() {
        let local = space.elements().current_load(&space.cell(mesh, e), &density.map(c64::from));
        for (carrier, values) in space.carriers_of(e).iter().zip(local.values()) {
            if let Some(entry) = load.get_mut(carrier.index()) {
                *entry += values[0].re;
            }
        }
    }
    harmonic
        .iter()
        .map(|field| field.circulations.iter().map(|&(edge, value)| value * load[edge]).sum::<f64>())
        .any(|current: f64| current.abs() > LEFT_OVER)
        .then_some(RegionFault::RoundTunnel)
}
