//! Open space of a configuration: the shell on its mesh, what must not lie in it, and what `check` says about truncation.

use fluxmorph_geometry::generate::{OpenShellParameters, open_shell};
use fluxmorph_geometry::topology::Topology;
use fluxmorph_geometry::{Mesh, MeshError};
use fluxmorph_solver::{Boundary, OpenRegion};

use super::references::{functionals, is_condition, region_in_mesh, surface_names};
use crate::config::{Config, Diagnostic, ObjectiveKind, Open, SourceMap};
use crate::error::Error;

/// The region of a shell that is put around a mesh.
const REGION: &str = "open";

/// Its outer surface.
const INFINITY: &str = "infinity";

/// Whether a region is the shell of open space.
pub(crate) fn is_open(config: &Config, region: &str) -> bool {
    config.open.as_ref().is_some_and(|open| region_of(open) == region)
}

/// The name of the shell's region.
pub(super) fn region_of(open: &Open) -> &str {
    open.region.as_deref().unwrap_or(REGION)
}

/// The mesh with the shell of the configuration around it; one that names no such surface is refused later, with all other names.
pub(super) fn with_shell(mesh: Mesh, config: &Config, source: &SourceMap) -> Result<Mesh, Error> {
    if config.open.is_some() && config.boundaries.uniform_field.is_some() {
        let message = "an applied field does not vanish at infinity, as [open] has it";
        let instead =
            "coils that make it, such as two large circular ones around the device; or walls without [open]";
        return Err(source
            .error(vec![source.diagnostic("boundaries.uniform_field", message).expected(instead)])
            .into());
    }
    let Some(open) = config.open.as_ref().filter(|open| open.region.is_none()) else { return Ok(mesh) };
    if open.surfaces().iter().any(|name| mesh.topology().surface(name).is_err()) {
        return Ok(mesh);
    }
    let parameters = OpenShellParameters {
        surfaces: open.surfaces().to_vec(),
        centre: open.center,
        layers: open.layers,
        region: REGION.to_owned(),
        outer: INFINITY.to_owned(),
    };
    open_shell(&mesh, &parameters).map_err(|error| match error {
        MeshError::Parameter { parameter, value, expected } => {
            let message = format!("{parameter} = {value}: no shell can be put around the mesh");
            source.error(vec![source.diagnostic(parameter, message).expected(expected)]).into()
        }
        other => other.into(),
    })
}

/// The shell for the field problem.
pub(super) fn region(config: &Config, topology: &Topology) -> Result<Option<OpenRegion>, Error> {
    let of = |open: &Open| Ok(OpenRegion { region: topology.region(region_of(open))?, centre: open.center });
    config.open.as_ref().map(of).transpose()
}

/// The condition at infinity of a shell that is put around the mesh.
pub(super) fn condition(config: &Config) -> Option<(String, Boundary)> {
    let open = config.open.as_ref()?;
    open.region.is_none().then(|| (INFINITY.to_owned(), Boundary::FluxParallel))
}

/// Conditions on surfaces that are open, and functionals of B in the shell.
pub(super) fn faults(config: &Config, source: &SourceMap) -> Vec<Diagnostic> {
    let Some(open) = &config.open else { return Vec::new() };
    let twice = |(path, name): (String, &str)| {
        let is_open = is_condition(&path) && open.surfaces().iter().any(|own| own == name);
        is_open.then(|| {
            source
                .diagnostic(&path, format!("`{name}` has a condition, but space is open beyond it"))
                .expected("each surface either here or in open.surfaces")
        })
    };
    let observed = |(path, functional): (String, &crate::config::Functional)| {
        let is_inside = region_in_mesh(functional) == Some(region_of(open));
        (is_inside && functional.kind != ObjectiveKind::Energy).then(|| {
            let message = format!("`{}` stands for all space outside", region_of(open));
            source
                .diagnostic(&format!("{path}.region"), message)
                .expected("a region inside; of the shell, only the energy means something")
        })
    };
    let named = surface_names(config).into_iter().filter_map(twice);
    named.chain(functionals(config).into_iter().filter_map(observed)).collect()
}
