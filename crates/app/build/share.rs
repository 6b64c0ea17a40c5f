//! Which rank has which part of the mesh of a problem.

use std::sync::Arc;

use fluxmorph_geometry::parallel::{Ownership, RankGroup};
use fluxmorph_geometry::{ElementId, Mesh, Partition};

use super::entries::material;
use crate::config::{Config, resolved_toml};
use crate::error::Error;

/// Shares a mesh out by the unknowns of its nodes: three of `A`, and ψ in conductors, which stay together.
///
/// # Errors
/// [`Error::Mesh`] for more ranks than nodes.
pub(super) fn of_mesh(config: &Config, mesh: &Mesh, group: &RankGroup) -> Result<Ownership, Error> {
    let topology = mesh.topology();
    let harmonic = config.alternates();
    let conducts: Vec<bool> = topology
        .region_names()
        .iter()
        .map(|name| harmonic && material(config, name).conductivity > 0.0)
        .collect();
    let in_conductor = |e: &ElementId| conducts[topology.region_of()[e.index()].index()];
    let kept: Vec<ElementId> = topology.elements().filter(in_conductor).collect();
    let mut weights = vec![3u32; topology.node_count()];
    for node in kept.iter().flat_map(|&e| topology.tet(e)) {
        weights[node.index()] = 4;
    }
    let partition = Partition::of_mesh(mesh, group.size(), &weights, &kept)?;
    group.set_identity(identity(config, mesh, &partition));
    Ok(Ownership { group: group.clone(), partition: Arc::new(partition) })
}

/// A number that identifies a problem: configuration, mesh and owners. The limits of a run are the first rank's alone, which a
/// resumed run may have others of.
fn identity(config: &Config, mesh: &Mesh, partition: &Partition) -> u64 {
    let mut config = config.clone();
    (config.optimizer.max_evaluations, config.optimizer.max_time) = (1, None);
    let mut hasher = blake3::Hasher::new();
    hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
    hasher.update(resolved_toml(&config).as_bytes());
    let topology = mesh.topology();
    for (node, point) in topology.nodes().zip(mesh.points()) {
        hasher.update(&(partition.owner_of(node) as u64).to_le_bytes());
        point.iter().for_each(|x| {
            hasher.update(&x.to_bits().to_le_bytes());
        });
    }
    for tet in topology.tets() {
        tet.iter().for_each(|n| {
            hasher.update(&n.0.to_le_bytes());
        });
    }
    let hash = hasher.finalize();
    let (first, _) = hash.as_bytes().split_first_chunk::<8>().expect("a hash has 32 bytes");
    u64::from_le_bytes(*first)
}
