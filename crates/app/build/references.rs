//! Where a configuration names surfaces, regions and functionals: each name with the key path at which it stands. Whether
//! the mesh has them is `names`' business.

use crate::config::{self, CoilPath, CoilShape, Config, ForceBody, MultipoleSet, Target};

/// Whether the path of a key is that of a condition on a surface.
pub(super) fn is_condition(path: &str) -> bool {
    path.starts_with("boundaries.")
}

/// Every surface that the configuration names, with the path of its key.
pub(crate) fn surface_names<'a>(config: &'a Config) -> Vec<(String, &'a str)> {
    let mut names = Vec::new();
    let mut add = |path: &str, surfaces: &'a [String]| {
        names.extend(surfaces.iter().enumerate().map(|(i, name)| (format!("{path}[{i}]"), name.as_str())));
    };
    add("boundaries.flux_parallel", &config.boundaries.flux_parallel);
    add("boundaries.flux_normal", &config.boundaries.flux_normal);
    if let Some(field) = &config.boundaries.uniform_field {
        add("boundaries.uniform_field.surfaces", &field.surfaces);
    }
    if let Some(open) = &config.open {
        add("open.surfaces", open.surfaces());
    }
    for (i, coil) in config.coils.iter().enumerate() {
        if let CoilShape::Region(region) = &coil.shape
            && let CoilPath::Terminals { terminals } = &region.path
        {
            add(&format!("coils[{i}].terminals"), terminals.as_slice());
        }
    }
    if let Some(remesh) = &config.remesh {
        add("remesh.slide", &remesh.slide);
        add("remesh.fixed", &remesh.fixed);
        add("remesh.free", &remesh.free);
    }
    for (i, motion) in config.morph.iter().flat_map(|morph| &morph.motion).enumerate() {
        if let Target::Surface(surfaces) = &motion.target {
            add(&format!("morph.motion[{i}].surface"), surfaces);
        }
    }
    let design = config.design.as_ref().map(|design| design.surface.as_slice()).unwrap_or_default();
    // By default it is the design surface, whose own key is the better place for a fault.
    if config.output.stl != design {
        add("output.stl", &config.output.stl);
    }
    if let [one] = design {
        names.push(("design.surface".to_owned(), one.as_str()));
    } else {
        add("design.surface", design);
    }
    names
}

/// Every functional of the configuration with its key path: terms of the objective, then constraints.
pub(crate) fn functionals(config: &Config) -> Vec<(String, &config::Functional)> {
    let terms = config.objective.iter().flat_map(|objective| {
        let terms = objective.terms().iter().enumerate();
        terms.map(|(k, term)| (objective.path(k), &term.functional))
    });
    let constraints =
        config.constraints.iter().enumerate().filter_map(|(k, constraint)| {
            Some((format!("constraints[{k}]"), constraint.limit.functional()?))
        });
    terms.chain(constraints).collect()
}

/// The region of the mesh that a functional names; none of a body or an expansion, which may be called as a region is.
pub(crate) fn region_in_mesh(functional: &config::Functional) -> Option<&str> {
    functional.region.as_deref().filter(|_| functional.kind.is_of_a_region())
}

/// The body that a functional acts on.
pub(super) fn body_of<'a>(config: &'a Config, functional: &config::Functional) -> Option<&'a ForceBody> {
    let name = functional.region.as_ref().filter(|_| functional.kind.is_of_a_body())?;
    config.forces.iter().find(|body| body.name == *name)
}

/// The expansion that a functional is of.
pub(super) fn expansion_of<'a>(
    config: &'a Config,
    functional: &config::Functional,
) -> Option<&'a MultipoleSet> {
    let name = functional.region.as_ref().filter(|_| functional.kind.is_of_terms())?;
    config.multipoles.iter().find(|set| set.name == *name)
}

/// Key path and name of every region that objective and constraints name.
pub(super) fn regions<'a>(config: &'a Config) -> Vec<(String, &'a str)> {
    let measured = functionals(config)
        .into_iter()
        .filter_map(|(path, f)| Some((format!("{path}.region"), region_in_mesh(f)?)));
    let forces = config.forces.iter().enumerate().flat_map(|(k, force)| {
        let path = move |(i, name): (usize, &'a String)| (format!("forces[{k}].regions[{i}]"), name.as_str());
        force.regions.iter().enumerate().map(path)
    });
    measured.chain(forces).collect()
}
