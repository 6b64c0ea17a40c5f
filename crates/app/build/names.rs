//! Every name of a configuration against its mesh: what the mesh does not have, what is empty, and what cannot be used as
//! it is. What the names stand for is made elsewhere.

use fluxmorph_geometry::{Mesh, RegionId, Topology};

use super::{field, functional, loads, mesh, open, references};
use crate::config::{self, Config, ConfigError, Diagnostic, DiagnosticReport, SourceMap};
use crate::error::Error;

/// Refuses names that the mesh does not have; what was left out of a mesh file is often why.
pub(super) fn check_names(
    config: &Config,
    source: &SourceMap,
    mesh: &Mesh,
    notices: &[String],
) -> Result<(), ConfigError> {
    let mut faults = name_faults(config, source, mesh.topology());
    if let Some(first) = faults.first_mut() {
        let notices = notices.iter().map(|notice| format!("of the mesh: {notice}"));
        let help: Vec<String> = first.help.take().into_iter().chain(notices).collect();
        first.help = Some(help.join("\n")).filter(|help| !help.is_empty());
    }
    source.check(faults)
}

/// With more faults in the text of a configuration its names are not checked against the mesh as well.
const MOST_TEXT_FAULTS: usize = 100;

/// A report of what is wrong with the text of a configuration, with what is wrong with its names in the mesh as well.
///
/// That is looked at where the tables of the mesh are sound. What could be read stands in for the rest: a name that is
/// missing or faulty is empty, and left out.
pub fn with_names(error: ConfigError) -> ConfigError {
    match error {
        ConfigError::Invalid(report) => ConfigError::Invalid(Box::new(report_with_names(*report))),
        other => other,
    }
}

fn report_with_names(report: DiagnosticReport) -> DiagnosticReport {
    let DiagnosticReport { source, diagnostics: mut faults, of, unfinished } = report;
    let of_mesh = |fault: &Diagnostic| {
        let path = fault.path.as_str();
        path.is_empty() || path == "mesh" || path.starts_with("mesh.") || path.starts_with("morph.case")
    };
    let is_short = faults.len() <= MOST_TEXT_FAULTS;
    let Some(config) = unfinished.filter(|_| is_short && !faults.iter().any(of_mesh)) else {
        return DiagnosticReport { source, diagnostics: faults, of, unfinished: None };
    };
    let stays_in_folder = source.confined(config::OutputNamedBy::User).is_ok();
    if stays_in_folder && super::memory_limit::check_mesh(&config, &source).is_ok() {
        match mesh::build(&config, &source) {
            Ok(built) => {
                let found = names(&config, &source, built.mesh.topology());
                // A place that has a fault already says enough.
                let new = |fault: &Diagnostic| faults.iter().all(|known| known.span != fault.span);
                let found: Vec<Diagnostic> = found.into_iter().filter(new).collect();
                faults.extend(found);
                faults.sort_by_key(|fault| (fault.span.document, fault.span.range.start));
            }
            // Places of the mesh file belong to the texts of its own report, behind those of the configuration.
            Err(Error::Config(ConfigError::Invalid(mut of_mesh))) => {
                of_mesh.diagnostics.splice(0..0, faults);
                return *of_mesh;
            }
            Err(_) => {}
        }
    }
    DiagnosticReport { source, diagnostics: faults, of, unfinished: None }
}

/// Every name of the configuration that the mesh does not have, every region named that is empty, and every one that cannot
/// be used as it is.
pub(super) fn name_faults(config: &Config, source: &SourceMap, topology: &Topology) -> Vec<Diagnostic> {
    let mut faults = names(config, source, topology);
    faults.extend(field::coil_faults(config, source));
    faults.extend(loads::faults(config, source));
    let open = open::faults(config, source);
    let inner = mesh::inner_faults(config, source, topology).into_iter();
    faults.extend(inner.filter(|fault| open.iter().all(|known| known.span != fault.span)));
    faults.extend(open);
    faults.extend(functional::faults(config, source, topology));
    faults.sort_by_key(|fault| (fault.span.document, fault.span.range.start));
    faults
}

/// Every name of the configuration that the mesh does not have, and every region named that is empty; empty names are left
/// out.
fn names(config: &Config, source: &SourceMap, topology: &Topology) -> Vec<Diagnostic> {
    let mut faults = Vec::new();
    let regions: Vec<&str> = topology.region_names().iter().map(String::as_str).collect();
    let mut region = |path: String, name: &str| match topology.region(name) {
        _ if name.is_empty() => {}
        Err(_) if topology.surface(name).is_ok() => {
            let fault = source.diagnostic(&path, format!("`{name}` is a surface, and no region"));
            faults.push(fault.expected(format!("one of the regions {}", regions.join(", "))));
        }
        Err(_) => faults.push(source.unknown_name(&path, "region", name, &regions)),
        Ok(id) if is_empty(topology, id) => {
            let fault = source.diagnostic(&path, format!("the region `{name}` has no elements"));
            faults.push(match config.mesh {
                config::MeshConfig::File { .. } => fault.expected(
                    "a region with elements; a mesh that a run has written has none where an impedance surface or a perfect \
                     conductor stood: take the mesh that the run began with",
                ),
                config::MeshConfig::Boxes(_) => {
                    fault.expected("a region with elements; where regions overlap, the later one has them")
                }
                _ => fault.expected("a region with elements"),
            });
        }
        Ok(_) => {}
    };
    for name in config.regions.keys() {
        region(format!("regions.{name}"), name);
    }
    for (i, coil) in config.coils.iter().enumerate() {
        if let config::CoilShape::Region(own) = &coil.shape {
            region(format!("coils[{i}].region"), &own.region);
        }
    }
    for (path, name) in references::regions(config) {
        region(path, name);
    }
    if let Some(name) = config.open.as_ref().and_then(|open| open.region.as_deref()) {
        region("open.region".to_owned(), name);
    }
    if let Some(remesh) = &config.remesh {
        if let config::RemeshExtent::Regions(names) = &remesh.extent {
            for (i, name) in names.iter().enumerate() {
                region(format!("remesh.region[{i}]"), name);
            }
        }
        for (i, subregion) in remesh.subregions.iter().enumerate() {
            region(format!("remesh.subregions[{i}].name"), &subregion.name);
        }
    }
    faults.extend(mesh::surface_faults(config, source, topology));
    faults
}

fn is_empty(topology: &Topology, region: RegionId) -> bool {
    !topology.region_of().contains(&region)
}
