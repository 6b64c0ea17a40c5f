//! The mesh of the best design, or a finer one, in the forms that other programs read: a Gmsh file, and STL files of surfaces.
//!
//! It is the mesh that was solved on: a region that its impedance surface replaces is not in it. Coordinates are in the unit
//! of the mesh file, and in millimetres where the mesh was generated.

use std::collections::HashMap;
use std::path::Path;

use fluxmorph_geometry::io::{MshEncoding, msh_bytes, stl_bytes};
use fluxmorph_geometry::topology::{Facet, face_key};
use fluxmorph_geometry::{ElementId, Mesh, MeshError, NodeId, Topology};

use crate::build::{is_air, mesh};
use crate::config::{Config, LengthUnit};
use crate::error::Error;
use crate::files::{RunDirectory, surface_files};
use crate::show::Observer;

/// Largest mesh written as text, which people can read and compare: about 25 MB. Beyond, bytes are read faster.
const LARGEST_TEXT: usize = 500_000;

/// Writes what `[output]` asks for, the mesh as `optimum`.
///
/// A surface that cannot be written is a warning: the result of a run is worth more than one of its forms.
pub(crate) fn write(
    config: &Config,
    directory: &RunDirectory,
    optimum: &Path,
    mesh: &Mesh,
    observer: &mut dyn Observer,
) -> Result<(), Error> {
    let unit = mesh::unit(config);
    if config.output.mesh {
        match gmsh_file(mesh, unit) {
            Ok(bytes) => directory.write(optimum, &bytes)?,
            Err(error) => observer.warning(&format!("the mesh of the optimum is not written: {error}")),
        }
    }
    for (name, file) in config.output.stl.iter().zip(surface_files(&config.output.stl)) {
        let triangles = mesh.topology().surface(name).unwrap_or_default();
        if triangles.is_empty() {
            observer.warning(&format!(
                "the surface `{name}` is not written: nothing of it is left in the mesh that was solved on"
            ));
            continue;
        }
        match stl_bytes(mesh, &oriented_outwards(config, mesh.topology(), triangles), unit.metres()) {
            Ok(bytes) => directory.write(&directory.surface(&file), &bytes)?,
            Err(error) => observer.warning(&format!("the surface `{name}` is not written: {error}")),
        }
    }
    Ok(())
}

/// The Gmsh file of a mesh.
fn gmsh_file(mesh: &Mesh, unit: LengthUnit) -> Result<Vec<u8>, MeshError> {
    let large = mesh.topology().tets().len() > LARGEST_TEXT;
    msh_bytes(mesh, unit.metres(), if large { MshEncoding::Binary } else { MshEncoding::Ascii })
}

/// Triangles of a mesh with their normals out of what is no air, whatever their order in a file, and between two bodies out of that whose
/// region comes first in the mesh. Those of a conductor that its surface replaces, which is not in the mesh, keep their order.
fn oriented_outwards(config: &Config, topology: &Topology, triangles: &[[NodeId; 3]]) -> Vec<[NodeId; 3]> {
    let facets: HashMap<[NodeId; 3], &Facet> =
        topology.facets().iter().map(|facet| (face_key(facet.nodes), facet)).collect();
    let is_air: Vec<bool> = topology.region_names().iter().map(|name| is_air(config, name)).collect();
    let rank = |e: ElementId| {
        let region = topology.region_of()[e.index()].index();
        (is_air[region], region)
    };
    let turned = |triangle: &[NodeId; 3]| match facets.get(&face_key(*triangle)) {
        Some(Facet { nodes: [a, b, c], inside, outside: Some(outside) })
            if rank(*outside) < rank(*inside) =>
        {
            [*a, *c, *b]
        }
        Some(facet) if facet.outside.is_some() || !rank(facet.inside).0 => facet.nodes,
        _ => *triangle,
    };
    triangles.iter().map(turned).collect()
}
