//! Objective and constraints of a configuration on its states.

mod faults;

pub(super) use faults::{faults, warnings};

use std::collections::BTreeSet;
use std::sync::Arc;

use fluxmorph_geometry::{ElementId, Mesh, MeshError, NodeId, RegionId};
use fluxmorph_optimizer::body::Body;
use fluxmorph_optimizer::constraint::{Constraint, Limit, Quantity};
use fluxmorph_optimizer::geometric;
use fluxmorph_optimizer::objective::{Label, Term, WeightedSum};
use fluxmorph_optimizer::problem::Shape;
use fluxmorph_solver::functional::{self, AtTerminals, Follow, Inductive, Observed, Volume, Weighting};
use fluxmorph_solver::{FieldModel, Functional, RigidMotion};

use super::entries::density;
use super::references::{body_of, functionals, regions};
use super::shape::may_move;
use crate::config::{
    self, Combination, Config, Diagnostic, Limit as Written, LoadCase, ObjectiveKind, SourceMap, ValueBound,
};
use crate::error::Error;

/// The mesh with the cells of every region that is measured written down: a finer mesh has the same ones then, and a sum
/// over cells the same terms.
pub(crate) fn with_cells_written_down(config: &Config, mesh: &Mesh) -> Result<Mesh, MeshError> {
    let mut topology = mesh.topology().as_ref().clone();
    for (_, name) in regions(config) {
        if topology.given_cells(name).is_none() {
            let cells = topology.cells_of(topology.region(name)?);
            topology = topology.with_cells(name, cells);
        }
    }
    Mesh::new(Arc::new(topology), mesh.points().to_vec())
}

/// The objective on the states of a configuration.
pub(super) fn objective(
    config: &Config,
    meshes: [&Mesh; 2],
    states: &[FieldModel],
) -> Result<Option<WeightedSum>, Error> {
    let Some(objective) = &config.objective else { return Ok(None) };
    let mut terms = Vec::new();
    for written in objective.terms() {
        let own = Term { weight: written.weight, ..term(config, &written.functional, meshes, states)? };
        match objective.combine {
            Combination::Sum => terms.push(own),
            Combination::WorstCase if own.functional.is_of_field() => {
                terms.extend(at_each_state(config, &own))
            }
            Combination::WorstCase => terms.push(own),
        }
    }
    Ok(Some(WeightedSum { goal: objective.goal, combination: objective.combine, terms }))
}

/// A term on each of its states alone.
fn at_each_state(config: &Config, term: &Term) -> Vec<Term> {
    let cases = config.load_cases();
    let at = |&state: &usize| {
        let case = cases.get(state);
        let load = case.and_then(LoadCase::name).map(str::to_owned);
        let label = Label { frequency: case.map(|case| case.frequency), load, ..term.label.clone() };
        Term { states: vec![state], label, ..term.clone() }
    };
    term.states.iter().map(at).collect()
}

/// A functional on the states that it is taken at, with the weight one; `meshes` are the whole one and that which moves.
fn term(
    config: &Config,
    functional: &config::Functional,
    meshes: [&Mesh; 2],
    states: &[FieldModel],
) -> Result<Term, Error> {
    let cases = config.load_cases();
    let mut taken: Vec<usize> = (0..states.len()).filter(|&k| functional.is_taken_under(&cases[k])).collect();
    if !functional.kind.is_of_field() {
        // All have the same.
        taken.truncate(1);
    }
    Ok(Term {
        functional: measured(config, functional, meshes, (states, &taken))?,
        states: taken,
        weight: 1.0,
        label: Label {
            kind: functional.kind.name(),
            region: functional.region.clone(),
            coils: functional.coils.clone().unwrap_or_default(),
            frequency: functional.frequency,
            load: functional.load.clone(),
        },
    })
}

/// What a functional measures, on the states that are taken.
fn measured(
    config: &Config,
    functional: &config::Functional,
    meshes: [&Mesh; 2],
    (states, taken): (&[FieldModel], &[usize]),
) -> Result<Functional, Error> {
    let [_, mesh] = meshes;
    let name = functional.region.as_deref().unwrap_or_default();
    let region = || mesh.topology().region(name);
    // All states have the regions, conductors, windings and node numbers of the first that takes part.
    let model = &states[taken.first().copied().unwrap_or_default()];
    let coils: Vec<&str> = functional.coils.iter().flatten().map(String::as_str).collect();
    let of_inductances = |of| Ok(Functional::of_inductances(model, &coils, of)?);
    let at_terminals =
        |of| Ok(Functional::at_terminals(model, coils.first().copied().unwrap_or_default(), of)?);
    match functional.kind {
        ObjectiveKind::FluxDensitySquared
        | ObjectiveKind::TargetField
        | ObjectiveKind::Homogeneity
        | ObjectiveKind::FieldComponent => {
            let follow = follow(functional.follow);
            Ok(Functional::observation(mesh, region()?, observed(functional), follow)?)
        }
        ObjectiveKind::Loss => Ok(Functional::loss(model, name)?),
        ObjectiveKind::Energy => {
            Ok(Functional::energy(model, functional.region.is_some().then(region).transpose()?)?)
        }
        ObjectiveKind::Force | ObjectiveKind::Torque => {
            let body = body_of(config, functional).expect("checked with the names");
            let direction = functional.direction.unwrap_or_default();
            let motion = if functional.kind == ObjectiveKind::Force {
                RigidMotion::Translation(direction)
            } else {
                RigidMotion::Rotation { axis: direction, about: body.about }
            };
            // The layer of the body is free of what any of the loads excites.
            let mut forces = taken.iter().map(|&k| force(body, mesh, &states[k], motion));
            let first = forces.try_fold(None, |first, own| Ok::<_, Error>(first.or(Some(own?))))?;
            Ok(first.expect("a state is taken"))
        }
        ObjectiveKind::Multipole | ObjectiveKind::MultipoleContent => {
            super::multipole::functional(config, functional, mesh, model)
        }
        ObjectiveKind::Inductance => of_inductances(Inductive::Inductance),
        ObjectiveKind::MutualInductance => of_inductances(Inductive::MutualInductance),
        ObjectiveKind::Coupling => of_inductances(Inductive::Coupling),
        ObjectiveKind::Resistance => of_inductances(Inductive::Resistance),
        ObjectiveKind::QualityFactor => of_inductances(Inductive::QualityFactor),
        ObjectiveKind::LinkEfficiency => of_inductances(Inductive::LinkEfficiency),
        ObjectiveKind::FluxLinkage => at_terminals(AtTerminals::FluxLinkage),
        ObjectiveKind::Current => at_terminals(AtTerminals::Current),
        ObjectiveKind::Voltage => at_terminals(AtTerminals::Voltage),
        ObjectiveKind::Power => at_terminals(AtTerminals::Power),
        ObjectiveKind::PowerFactor => at_terminals(AtTerminals::PowerFactor),
        ObjectiveKind::Volume | ObjectiveKind::Mass => {
            Ok(Functional::Volume(body(config, (functional.kind, name), meshes)?))
        }
    }
}

/// The volume of a region, or its mass.
fn body(
    config: &Config,
    (kind, region): (ObjectiveKind, &str),
    [full_mesh, mesh]: [&Mesh; 2],
) -> Result<Volume, Error> {
    let volume = Volume::new(mesh, full_mesh, region)?;
    Ok(match density(config, region) {
        Some(density) if kind == ObjectiveKind::Mass => volume.with_density(density),
        _ => volume,
    })
}

/// What observed places do where the mesh moves.
pub(super) fn follow(written: Option<config::Follow>) -> Follow {
    match written {
        None => Follow::Held,
        Some(config::Follow::Mesh) => Follow::Mesh,
        Some(config::Follow::Space) => Follow::Space,
    }
}

/// What is observed of B in a region.
fn observed(functional: &config::Functional) -> Observed {
    let direction = functional.direction.unwrap_or_default();
    let weighting = match functional.weighting {
        Some(config::Weighting::Volume) => Weighting::Volume,
        _ => Weighting::Point,
    };
    match functional.kind {
        ObjectiveKind::FieldComponent => Observed::Component { direction },
        ObjectiveKind::Homogeneity => {
            let of = match functional.compare {
                Some(config::Compared::Component) => functional::Compared::Component(direction),
                Some(config::Compared::Modulus) => functional::Compared::Modulus,
                _ => functional::Compared::Vector,
            };
            Observed::Homogeneity { of, weighting }
        }
        // The target of |B|² is zero.
        _ => Observed::Deviation { target: functional.target.unwrap_or_default(), weighting },
    }
}

/// The bodies whose forces are reported.
pub(super) fn bodies(config: &Config, mesh: &Mesh, states: &[FieldModel]) -> Result<Vec<Body>, Error> {
    let of = |body: &config::ForceBody| {
        let regions = regions_of(body, mesh)?;
        let mut first = None;
        for model in states {
            first = first.or(Some(Body::new(model, mesh, &body.name, &regions, body.about)?));
        }
        Ok(first.expect("a problem has a state"))
    };
    config.forces.iter().map(of).collect()
}

/// A component of the force or torque on a body.
fn force(
    body: &config::ForceBody,
    mesh: &Mesh,
    model: &FieldModel,
    motion: RigidMotion,
) -> Result<Functional, Error> {
    Ok(Functional::force(model, mesh, &body.name, &regions_of(body, mesh)?, motion)?)
}

fn regions_of(body: &config::ForceBody, mesh: &Mesh) -> Result<Vec<RegionId>, MeshError> {
    body.regions.iter().map(|name| mesh.topology().region(name)).collect()
}

/// Vectors compared with their mean where planes of symmetry leave the whole device none.
pub(super) fn mean_warnings(
    objective: Option<&WeightedSum>,
    constraints: &[Constraint],
    model: &FieldModel,
) -> BTreeSet<String> {
    let constrained = constraints.iter().filter_map(|own| match &own.quantity {
        Quantity::Field(term) => Some(&**term),
        Quantity::Volume(_) | Quantity::Thickness { .. } => None,
    });
    let warning = |term: &Term| {
        let Functional::Observation(observation) = &term.functional else { return None };
        observation.has_no_mean(model).then(|| {
            format!(
                "the planes of symmetry at which `{}` ends leave the mean of B over the whole device no direction: its homogeneity is \
                 relative to the mean over the part that is meshed, which the device does not have. Take compare = \"modulus\", or a \
                 component",
                term.label.region.as_deref().unwrap_or_default()
            )
        })
    };
    objective.into_iter().flat_map(|own| &own.terms).chain(constrained).filter_map(warning).collect()
}

/// Elements that must not move, for they are observed.
pub(super) struct FixedElements {
    pub(super) elements: Vec<ElementId>,
    /// The key path of the region.
    pub(super) path: String,
    /// Whether they are those of an expansion, whose places follow no cells.
    pub(super) is_of_terms: bool,
}

/// Elements that must not move, by functional.
pub(super) fn fixed_elements(
    config: &Config,
    meshes: [&Mesh; 2],
    states: &[FieldModel],
) -> Result<Vec<FixedElements>, Error> {
    let of_field = functionals(config).into_iter().filter(|(_, functional)| functional.kind.is_of_field());
    of_field
        .map(|(path, functional)| {
            let elements = term(config, functional, meshes, states)?.functional.fixed_elements().collect();
            let is_of_terms = functional.kind.is_of_terms();
            Ok(FixedElements { elements, path: format!("{path}.region"), is_of_terms })
        })
        .collect()
}

/// The constraints of a configuration on its states and its shape; without one those on the field alone.
pub(super) fn constraints(
    config: &Config,
    source: &SourceMap,
    meshes: [&Mesh; 2],
    states: &[FieldModel],
    shape: Option<&Shape>,
) -> Result<Vec<Constraint>, Error> {
    let mut constraints = Vec::new();
    for (k, written) in config.constraints.iter().enumerate() {
        let mut add = |name: String, quantity: Quantity, limit: Limit| {
            constraints.push(Constraint { name, quantity, limit });
        };
        match &written.limit {
            Written::Functional { functional, .. } if !functional.kind.is_of_field() && shape.is_none() => {}
            Written::Functional { functional, bound } => {
                let term = term(config, functional, meshes, states)?;
                let quantity = match term.functional {
                    Functional::Volume(body) => Quantity::Volume(body),
                    _ => Quantity::Field(Box::new(term)),
                };
                add(written.name.clone(), quantity, limit(*bound));
            }
            Written::Thickness { minimum, maximum, .. } => {
                let Some(shape) = shape else { continue };
                use geometric::ThicknessLimit::{Maximum, Minimum};
                let bounds = [
                    minimum.map(|bound| ("minimum", bound, Minimum(bound), Limit::AtLeast(bound))),
                    maximum.map(|bound| ("maximum", bound, Maximum(bound), Limit::AtMost(bound))),
                ];
                let has_both = minimum.is_some() && maximum.is_some();
                for (suffix, bound, side, limit) in bounds.into_iter().flatten() {
                    let measure = geometric::ThicknessBound::new(shape, side).map_err(|error| {
                        let fault = source.diagnostic(&format!("constraints[{k}].kind"), error.to_string());
                        source.error(vec![fault.help("limit design.lower and design.upper instead")])
                    })?;
                    // Both bounds of one entry are two constraints, told apart by their names.
                    let name =
                        if has_both { format!("{}_{suffix}", written.name) } else { written.name.clone() };
                    add(name, Quantity::Thickness { measure, bound }, limit);
                }
            }
        }
    }
    // The suffixes of a thickness may meet another constraint's name.
    let mut names = BTreeSet::new();
    if let Some(twice) = constraints.iter().find(|constraint| !names.insert(constraint.name.as_str())) {
        let message = format!("two constraints are named `{}`", twice.name);
        let fault = source.diagnostic("constraints", message).expected("a different name for each");
        return Err(source.error(vec![fault]).into());
    }
    Ok(constraints)
}

/// Volumes and masses of regions of which no node may move; of the objective where it has nothing else.
pub(super) fn bodies_at_rest(
    config: &Config,
    source: &SourceMap,
    mesh: &Mesh,
    (shape, model): (&Shape, &FieldModel),
) -> Vec<Diagnostic> {
    let topology = mesh.topology();
    let moves = |node: NodeId| may_move(shape.surface(), shape.motion().map(), node);
    let bodies = functionals(config).into_iter().filter(|(_, own)| !own.kind.is_of_field());
    let at_rest = |(path, own): (String, &config::Functional)| {
        let name = own.region.as_deref()?;
        // One that is replaced by its surface has that alone here.
        let is_moved = match model.conductors().iter().find(|conductor| conductor.name == name) {
            Some(conductor) => conductor.surface.iter().flatten().any(|&n| moves(n)),
            None => {
                let region = topology.region(name).ok()?;
                let elements = topology.elements_of(region);
                elements.iter().flat_map(|&e| topology.tet(e)).any(moves)
            }
        };
        if is_moved {
            return None;
        }
        let message = format!("nothing of `{name}` moves with the design: its {} stays", own.kind.name());
        let fault = source.diagnostic(&format!("{path}.region"), message);
        Some(fault.expected("a region that the design changes"))
    };
    let faults: Vec<Diagnostic> = bodies.filter_map(at_rest).collect();
    let of_objective = |fault: &Diagnostic| fault.path.starts_with("objective");
    let terms = config.objective.as_ref().map_or(0, |objective| objective.terms().len());
    let is_constant = faults.iter().filter(|fault| of_objective(fault)).count() == terms;
    faults.into_iter().filter(|fault| is_constant || !of_objective(fault)).collect()
}

fn limit(bound: ValueBound) -> Limit {
    match bound {
        ValueBound::AtMost(value) => Limit::AtMost(value),
        ValueBound::AtMostRatio(ratio) => Limit::AtMostRatio(ratio),
        ValueBound::AtLeast(value) => Limit::AtLeast(value),
        ValueBound::AtLeastRatio(ratio) => Limit::AtLeastRatio(ratio),
    }
}
