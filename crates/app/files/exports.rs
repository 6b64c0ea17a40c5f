//! The mesh of the best design, or a finer one, in the forms that other programs read: a Gmsh file, and STL files of surfaces.
//!
//! It is the mesh that was solved on: a region that its impedance surface replaces is not in it. Coordinates are in the unit
//! of the mesh file, and in millimetres where the mesh was generated.

use std::collections::HashMap;
use std::path::Path;

use fluxmorph_geometry::io::{MshEncoding, msh_bytes, stl_bytes};
use fluxmorph_geometry::topology::{Facet, face_key};
use fluxmorph_geometry::{ElementId, Mesh, MeshError, NodeId, Topology};

use crate::build::{mesh, out_of_body};
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
        let triangles = oriented_outwards(config, mesh.topology(), name);
        if triangles.is_empty() {
            observer.warning(&format!(
                "the surface `{name}` is not written: nothing of it is left in the mesh that was solved on"
            ));
            continue;
        }
        match stl_bytes(mesh, &triangles, unit.metres()) {
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

/// A surface with its normals out of the body, whatever the order of its triangles in a file; between two bodies, or none, out of the
/// region that comes first.
fn oriented_outwards(config: &Config, topology: &Topology, name: &str) -> Vec<[NodeId; 3]> {
    let facets: HashMap<[NodeId; 3], &Facet> =
        topology.facets().iter().map(|facet| (face_key(facet.nodes), facet)).collect();
    let region = |e: ElementId| topology.region_of()[e.index()];
    let oriented = |triangle: &[NodeId; 3]| {
        let facet = facets.get(&face_key(*triangle)).copied();
        let of_first = |facet: &Facet| match facet {
            Facet { nodes: [a, b, c], inside, outside: Some(e) } if region(*e) < region(*inside) => {
                [*a, *c, *b]
            }
            facet => facet.nodes,
        };
        out_of_body(config, topology, name, facet).or(facet.map(of_first)).unwrap_or(*triangle)
    };
    topology.surface(name).unwrap_or_default().iter().map(oriented).collect()
}
