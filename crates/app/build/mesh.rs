//! The mesh of a configuration: generated or read, with the interfaces that the configuration names.
//!
//! A surface name `"a|b"` that the mesh does not have stands for the faces between the regions `a` and `b`. It is added to
//! the mesh under that name before anything else looks for it, so that every key may use it.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::io::ErrorKind;
use std::path::Path;
use std::sync::Arc;

use fluxmorph_geometry::generate::{block, boxes, shield, sphere};
use fluxmorph_geometry::io::msh::{MshError, Place as MshPlace};
use fluxmorph_geometry::io::read_msh_file;
use fluxmorph_geometry::topology::{OUTSIDE, face_key};
use fluxmorph_geometry::{Mesh, MeshError, NodeId, RegionId, Topology};
use fluxmorph_optimizer::design::DesignSurface;

use super::open;
use super::references::{is_condition, surface_names};
use crate::config::{Config, ConfigError, Diagnostic, Document, LengthUnit, MeshConfig, SourceMap, Span};
use crate::error::Error;
use crate::files::OutputError;

/// A mesh with all its surfaces, and what was done to its file.
pub(super) struct Built {
    pub(super) mesh: Mesh,
    pub(super) notices: Vec<String>,
    /// The design surface, where it comes from a coarser mesh.
    pub(super) surface: Option<DesignSurface>,
}

impl From<(Mesh, Option<DesignSurface>)> for Built {
    fn from((mesh, surface): (Mesh, Option<DesignSurface>)) -> Self {
        Self { mesh, notices: Vec::new(), surface }
    }
}

/// Builds or reads the mesh of a configuration.
pub(super) fn build(config: &Config, source: &SourceMap) -> Result<Built, Error> {
    let generated = |mesh: Result<Mesh, MeshError>| match mesh {
        Ok(mesh) => Ok(Built::from((mesh, None))),
        Err(error) => Err(parameter_fault(error, source)),
    };
    let built = match &config.mesh {
        MeshConfig::Shield(parameters) => generated(shield(&parameters.parameters())),
        MeshConfig::Block(parameters) => generated(block(&parameters.parameters())),
        MeshConfig::Boxes(parameters) => generated(boxes(&parameters.parameters())),
        MeshConfig::Sphere(parameters) => generated(sphere(&parameters.parameters())),
        MeshConfig::File { path, unit } => {
            let read = read_msh_file(path, unit.metres()).map_err(|error| file_fault(error, source))?;
            source.check(loose_faults(config, source, &read.notices.loose_triangles))?;
            let with_file = |message: String| format!("mesh file `{}`: {message}", path.display());
            Ok(Built {
                notices: read.notices.messages().into_iter().map(with_file).collect(),
                ..Built::from((read.mesh, None))
            })
        }
    }?;
    let mesh = named_interfaces(built.mesh, config)?;
    Ok(Built { mesh: open::with_shell(mesh, config, source)?, ..built })
}

/// The mesh with a surface for every interface that the configuration names.
pub(super) fn named_interfaces(mesh: Mesh, config: &Config) -> Result<Mesh, MeshError> {
    with_interfaces(mesh, &surface_names(config))
}

/// The unit in which the mesh of a configuration is written: that of its file, and millimetres for a generator.
pub(crate) fn unit(config: &Config) -> LengthUnit {
    match &config.mesh {
        MeshConfig::File { unit, .. } => *unit,
        _ => LengthUnit::Millimetre,
    }
}

/// Every surface that the configuration names and of which a part is the face of no tetrahedron.
fn loose_faults(config: &Config, source: &SourceMap, loose: &BTreeMap<String, usize>) -> Vec<Diagnostic> {
    let fault = |(path, name): (String, &str)| {
        let count = loose.get(name)?;
        let message = format!("{count} triangles of the surface `{name}` are faces of no tetrahedron");
        let fault = source.diagnostic(&path, message).expected("a surface of the volumes in the mesh");
        Some(fault.help(
            "usual cause: a volume beside it that was not meshed, belongs to no physical group, or does not share its nodes",
        ))
    };
    surface_names(config).into_iter().filter_map(fault).collect()
}

/// A parameter that a generator refuses becomes a fault at its key.
fn parameter_fault(error: MeshError, source: &SourceMap) -> Error {
    let MeshError::Parameter { parameter, value, expected } = error else { return error.into() };
    let path = format!("mesh.{parameter}");
    source.error(vec![source.diagnostic(&path, format!("{path} = {value}")).expected(expected)]).into()
}

/// A fault of a mesh file is shown at the key that names it.
fn file_fault(error: MeshError, source: &SourceMap) -> Error {
    match error {
        MeshError::Msh { path, cause } => msh_fault(&path, &cause, source).into(),
        MeshError::File { path, cause } if cause.kind() == ErrorKind::NotFound => {
            source.error(vec![source.no_file("mesh.file", &path)]).into()
        }
        MeshError::File { path, cause } => OutputError::io("read mesh.file", path)(cause).into(),
        other => other.into(),
    }
}

/// A fault of a mesh file is shown in the file where that is text, and at the key that names it.
fn msh_fault(path: &Path, error: &MshError, source: &SourceMap) -> ConfigError {
    let file = path.display().to_string();
    let mut fault =
        source.diagnostic("mesh.file", format!("mesh file `{file}`, {error}")).with_advice_apart();
    if path.extension().is_some_and(|extension| extension == "geo") {
        fault.help = Some("this is the geometry: `gmsh -3 -format msh41` makes the mesh of it".to_owned());
    }
    let (MshPlace::Line(first_line), Some(excerpt)) = (error.place, &error.excerpt) else {
        return source.error(vec![fault]);
    };
    let document = Document { name: file, text: excerpt.text.clone(), first_line };
    let (source, number) = source.with_document(document);
    let span = Span { document: number, range: excerpt.span.clone() };
    let named = fault.span.clone();
    source.error(vec![Diagnostic { span, ..fault }.secondary(named, "the file is named here")])
}

/// The mesh with a surface for every name of an interface; names that stand for none are left to [`surface_faults`].
fn with_interfaces(mesh: Mesh, names: &[(String, &str)]) -> Result<Mesh, MeshError> {
    let missing: BTreeSet<&str> = names
        .iter()
        .map(|(_, name)| *name)
        .filter(|name| name.contains('|') && mesh.topology().surface(name).is_err())
        .collect();
    let found: Vec<_> = missing
        .into_iter()
        .filter_map(|name| Some((name, mesh.topology().faces_between(name).ok()?)))
        .collect();
    if found.is_empty() {
        return Ok(mesh);
    }
    let mut topology = mesh.topology().as_ref().clone();
    for (name, faces) in found {
        topology = topology.with_surface(name, faces)?;
    }
    Mesh::new(Arc::new(topology), mesh.points().to_vec())
}

/// Every surface named that the mesh does not have, or that is empty.
pub(super) fn surface_faults(config: &Config, source: &SourceMap, topology: &Topology) -> Vec<Diagnostic> {
    let surfaces: Vec<&str> = topology.surface_names().collect();
    let mut sides: Vec<&str> = topology.region_names().iter().map(String::as_str).collect();
    sides.push(OUTSIDE);
    let fault = |(path, name): (String, &str)| match topology.surface(name) {
        Ok([]) => Some(source.diagnostic(&path, format!("the surface `{name}` has no triangles"))),
        Ok(_) => None,
        Err(_) => Some(match topology.faces_between(name) {
            Err(MeshError::UnknownRegion { name, .. }) => source.unknown_name(&path, "region", &name, &sides),
            Err(MeshError::NoInterface { .. }) => source
                .diagnostic(&path, format!("the two sides of `{name}` have no face in common"))
                .expected("two regions that touch, or a region that reaches the outside"),
            _ => match faces_of_region(topology, name, &path).as_slice() {
                [] => source.unknown_name(&path, "surface", name, &surfaces),
                faces => source
                    .diagnostic(&path, format!("`{name}` is a region, and no surface"))
                    .expected(format!("one of its faces: {}", faces.join(", "))),
            },
        }),
    };
    surface_names(config).into_iter().filter(|(_, name)| !name.is_empty()).filter_map(fault).collect()
}

/// How to name the faces of a region, by the region on their other side; of a condition those at the outside alone.
fn faces_of_region(topology: &Topology, name: &str, path: &str) -> Vec<String> {
    let Ok(own) = topology.region(name) else { return Vec::new() };
    let touches = |k: &usize| !is_condition(path) && !topology.interface(own, RegionId::new(*k)).is_empty();
    let others = topology.region_names();
    let inside = (0..others.len()).filter(touches).map(|k| others[k].as_str());
    let outside = Some(OUTSIDE).filter(|_| !topology.outer_faces(own).is_empty());
    inside.chain(outside).map(|other| format!("`{name}|{other}`")).collect()
}

/// Every condition on a surface that does not lie at the outside of the mesh.
pub(super) fn inner_faults(config: &Config, source: &SourceMap, topology: &Topology) -> Vec<Diagnostic> {
    let outer: HashSet<[NodeId; 3]> = topology.outer_facets().map(|f| face_key(f.nodes)).collect();
    surface_names(config)
        .into_iter()
        .filter(|(path, _)| is_condition(path))
        .filter(|(_, name)| {
            topology.surface(name).is_ok_and(|s| s.iter().any(|t| !outer.contains(&face_key(*t))))
        })
        .map(|(path, name)| {
            source
                .diagnostic(&path, format!("the surface `{name}` has faces inside the mesh"))
                .expected("a surface at the outside of the mesh: conditions hold there")
        })
        .collect()
}
