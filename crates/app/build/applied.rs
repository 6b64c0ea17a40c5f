//! Applied fields that contradict faces of the mesh, and what is rarely meant by one.

use std::collections::HashSet;

use fluxmorph_geometry::tet4::{centroid, dot, norm};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{Mesh, NodeId, RegionId, millimetres};

use super::entries::material;
use super::plausible::{INCLINED, beside};
use super::soundness::{faces_of, normal};
use crate::config::{Config, Diagnostic, RegionModel, SourceMap};

/// Faults of an applied field that lies along a surface which it can only cross at right angles, beside one where it is given: nothing
/// of it would enter.
pub(super) fn faults(config: &Config, source: &SourceMap, mesh: &Mesh) -> Vec<Diagnostic> {
    let Some(field) = &config.boundaries.uniform_field else { return Vec::new() };
    let topology = mesh.topology();
    let applied = faces_of(topology, field.surfaces.iter().map(String::as_str));
    let applied: HashSet<NodeId> = applied.into_iter().flatten().collect();
    let size = norm(field.b);
    let contradicts = |face: &[NodeId; 3]| {
        face.iter().filter(|node| applied.contains(node)).count() >= 2
            && beside(dot(normal(mesh, *face), field.b).abs() / size) > INCLINED
    };
    let expected = "flux_parallel, or the applied field there too";
    let mut faults = Vec::new();
    for (k, name) in config.boundaries.flux_normal.iter().enumerate() {
        if faces_of(topology, [name.as_str()]).iter().any(contradicts) {
            let message =
                format!("the applied field does not cross `{name}` at right angles, as flux_normal asks");
            faults
                .push(source.diagnostic(&format!("boundaries.flux_normal[{k}]"), message).expected(expected));
        }
    }
    // What is replaced by its surface has no field.
    let names = topology.region_names().iter().enumerate();
    let regions = names.filter(|(_, name)| config.is_meshed(name)).map(|(k, _)| RegionId::new(k));
    let outer = regions.flat_map(|region| topology.outer_faces(region)).map(face_key);
    let conditions = faces_of(topology, config.boundaries.surfaces().map(String::as_str));
    let mut open = outer.filter(|face| !conditions.contains(face));
    if let Some(face) = open.find(contradicts) {
        let middle = centroid(face.map(|node| mesh.points()[node.index()]));
        let message = format!(
            "the applied field lies along the outer face at {}, which has no condition: flux crosses such faces at right angles",
            millimetres(middle)
        );
        faults.push(source.diagnostic("boundaries.uniform_field", message).expected(expected));
    }
    faults
}

/// What to say of conductors at the surfaces of an applied field: the given A is an electric field along them, whose part without a
/// curl is that of no device.
pub(super) fn on_conductors(config: &Config, mesh: &Mesh) -> Vec<String> {
    let Some(field) = config.boundaries.uniform_field.as_ref().filter(|_| config.alternates()) else {
        return Vec::new();
    };
    let topology = mesh.topology();
    let conducts = |name: &&String| {
        config.regions[*name].model != RegionModel::Perfect && material(config, name).conductivity > 0.0
    };
    let warning = |name: &String| {
        let region = topology.region(name).ok()?;
        let nodes: HashSet<NodeId> =
            topology.elements_of(region).into_iter().flat_map(|e| topology.tet(e)).collect();
        let touches = |surface: &&String| {
            let faces = faces_of(topology, [surface.as_str()]);
            faces.iter().any(|face| face.iter().filter(|node| nodes.contains(node)).count() >= 2)
        };
        let surface = field.surfaces.iter().find(touches)?;
        Some(format!(
            "the conductor `{name}` reaches `{surface}`, where the applied field is given: its eddy currents depend on \
             boundaries.uniform_field.center there. Let the field be given farther out, with air between"
        ))
    };
    config.regions.keys().filter(conducts).filter_map(warning).collect()
}
