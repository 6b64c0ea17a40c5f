//! The field problems of a configuration.

use fluxmorph_geometry::Mesh;
use fluxmorph_solver::coil::{self, Racetrack};
use fluxmorph_solver::linear::LinearSolverSettings;
use fluxmorph_solver::{Boundary, Conductor, FieldModel, FieldModelSetup};

use crate::config::{self, Config, RegionModel};
use crate::error::Error;

/// The mesh without the regions that impedance surfaces replace, and those surfaces on it.
pub(super) fn without_impedance_regions(
    config: &Config,
    full: &Mesh,
) -> Result<(Mesh, Vec<Conductor>), Error> {
    let mut mesh = full.clone();
    let replaced: Vec<&String> = config
        .regions
        .iter()
        .filter(|(_, r)| r.model == RegionModel::Impedance)
        .map(|(name, _)| name)
        .collect();
    for name in &replaced {
        mesh = mesh.without_region(full.topology().region(name)?)?.0;
    }
    // Node numbers are final only now: expose each surface on the last mesh through the positions it kept.
    let mut conductors = Vec::new();
    for name in replaced {
        let surface = exposed_surface(full, &mesh, name)?;
        conductors.push(Conductor { name: name.clone(), surface, material: super::material(config, name) });
    }
    Ok((mesh, conductors))
}

/// The faces of `mesh` that the region `name` of `full` covered, oriented out of `mesh`.
fn exposed_surface(
    full: &Mesh,
    mesh: &Mesh,
    name: &str,
) -> Result<Vec<[fluxmorph_geometry::NodeId; 3]>, Error> {
    let region = full.topology().region(name)?;
    let key = |p: [f64; 3]| p.map(f64::to_bits);
    let faces: std::collections::HashSet<_> = full
        .topology()
        .facets()
        .iter()
        .filter(|f| {
            let at = |e: fluxmorph_geometry::ElementId| full.topology().region_of()[e.index()] == region;
            f.outside.is_some_and(|outside| at(f.inside) != at(outside))
        })
        .map(|f| {
            let mut corners = f.nodes.map(|n| key(full.point(n)));
            corners.sort_unstable();
            corners
        })
        .collect();
    Ok(mesh
        .topology()
        .facets()
        .iter()
        .filter(|f| f.outside.is_none())
        .filter(|f| {
            let mut corners = f.nodes.map(|n| key(mesh.point(n)));
            corners.sort_unstable();
            faces.contains(&corners)
        })
        .map(|f| f.nodes)
        .collect())
}

/// The field models of a configuration on its mesh, one a frequency.
pub(super) fn field_models(
    config: &Config,
    mesh: &Mesh,
    impedance_surfaces: &[Conductor],
) -> Result<Vec<FieldModel>, Error> {
    let at = |&frequency: &f64| field_model(config, mesh, frequency, impedance_surfaces.to_vec());
    config.analysis.frequencies().iter().map(at).collect()
}

fn field_model(
    config: &Config,
    mesh: &Mesh,
    frequency: f64,
    impedance_surfaces: Vec<Conductor>,
) -> Result<FieldModel, Error> {
    let materials = mesh.topology().region_names().iter().map(|name| super::material(config, name)).collect();
    let coils = config.coils.iter().map(coil).collect::<Result<Vec<_>, Error>>()?;
    let of = |names: &[String], boundary: Boundary| -> Vec<(String, Boundary)> {
        names.iter().map(|name| (name.clone(), boundary)).collect()
    };
    let mut boundaries = of(&config.boundaries.flux_parallel, Boundary::FluxParallel);
    boundaries.extend(of(&config.boundaries.flux_normal, Boundary::FluxNormal));
    let linear_solver = LinearSolverSettings {
        tolerance: config.analysis.linear_solver.tolerance,
        ..LinearSolverSettings::default()
    };
    let setup = FieldModelSetup {
        frequency,
        penalty: config.analysis.penalty,
        materials,
        impedance_surfaces,
        coils,
        boundaries,
        linear_solver,
        ..FieldModelSetup::default()
    };
    Ok(FieldModel::new(mesh, setup)?)
}

fn coil(coil: &config::Coil) -> Result<coil::Coil, Error> {
    let config::CoilShape::Racetrack = coil.shape;
    let corner = match coil.corner {
        config::Corner::Sharp(config::CornerWord::Mitred) => coil::Corner::Mitred,
        config::Corner::Round(inner_radius) => coil::Corner::Round { inner_radius },
    };
    let axis = match coil.axis {
        config::Axis::X => 0,
        config::Axis::Y => 1,
        config::Axis::Z => 2,
    };
    let shape = Racetrack::new(coil.center, axis, coil.half_window, coil.width, coil.height, corner)?;
    Ok(coil::Coil { name: coil.name.clone(), ampere_turns: super::phasor(coil), shape: shape.into() })
}
