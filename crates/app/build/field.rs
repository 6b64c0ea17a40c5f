//! The field problems of a configuration.

use std::collections::HashSet;
use std::sync::Arc;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::parallel::{Krylov, Ownership, SubSolver};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{ElementId, Mesh, NodeId, Topology};
use fluxmorph_optimizer::Error as OptimizerError;
use fluxmorph_solver::coil::{
    self, CoilShape, Connection, Frame, Path, Racetrack, RegionCurrent, SolidConductor, Terminal,
};
use fluxmorph_solver::linear::{
    DistributedMethod, DistributedSettings, LinearSolver, LinearSolverSettings, Method, Reuse,
};
use fluxmorph_solver::{
    BhCurve, Boundary, Conductor, ElementFamily, FieldModel, FieldModelSetup, LoadCase, Material, Order,
    SolverError, SurfaceLaw, UniformField, Winding,
};

use super::curves::Curves;
use super::entries::{material, solid_coil};
use super::locate_error::DiagnosticSink;
use super::{loads, open};
use crate::config::{
    self, Combination, Config, Diagnostic, FactorReuse, PetscKrylov, PetscSolver, PetscSubSolver,
    RegionModel, SolverMethod, SourceMap,
};
use crate::error::Error;

/// The mesh without the regions that their surfaces replace, and those surfaces on it.
pub(super) fn without_replaced_regions(
    config: &Config,
    full: &Mesh,
) -> Result<(Mesh, Vec<Conductor>), Error> {
    let mut mesh = full.clone();
    let law = |(name, region): (&'_ String, &config::Region)| match region.model {
        RegionModel::Volume => None,
        RegionModel::Impedance => Some((name.clone(), SurfaceLaw::Impedance(material(config, name)))),
        RegionModel::Perfect => Some((name.clone(), SurfaceLaw::Perfect)),
    };
    let replaced: Vec<(String, SurfaceLaw)> = config.regions.iter().filter_map(law).collect();
    for (name, _) in &replaced {
        mesh = mesh.without_region(full.topology().region(name)?)?.0;
    }
    // Node numbers are final only now.
    let old_of = remaining_nodes(config, full.topology());
    let exposed = |(name, law): (String, SurfaceLaw)| {
        let removed = full.topology().boundary(full.topology().region(&name)?);
        let removed: HashSet<_> = removed.into_iter().map(face_key).collect();
        let outer = mesh.topology().outer_facets().map(|facet| facet.nodes);
        let surface = outer.filter(|nodes| removed.contains(&face_key(nodes.map(|n| old_of[n.index()]))));
        Ok(Conductor { name, surface: surface.collect(), law })
    };
    let conductors: Result<_, Error> = replaced.into_iter().map(exposed).collect();
    Ok((mesh, conductors?))
}

/// The nodes that are left without the regions that their surfaces replace, ascending: those of the mesh that is solved on,
/// in its order.
pub(crate) fn remaining_nodes(config: &Config, full: &Topology) -> Vec<NodeId> {
    let remains = full.is_node_of(remaining_elements(config, full));
    full.nodes().filter(|n| remains[n.index()]).collect()
}

/// The elements that are left without those regions, ascending.
pub(crate) fn remaining_elements(config: &Config, full: &Topology) -> Vec<ElementId> {
    let meshed: Vec<bool> = full.region_names().iter().map(|name| config.is_meshed(name)).collect();
    full.elements().filter(|e| meshed[full.region_of()[e.index()].index()]).collect()
}

/// Conductors replaced by their surfaces that touch a meshed conductor: what flows from one to the other is in neither.
pub(super) fn contact_faults(
    config: &Config,
    source: &SourceMap,
    mesh: &Mesh,
    conductors: &[Conductor],
) -> Vec<Diagnostic> {
    if !config.alternates() {
        return Vec::new();
    }
    let topology = mesh.topology();
    let conducts: Vec<bool> =
        topology.region_names().iter().map(|name| material(config, name).conductivity > 0.0).collect();
    let touched = |conductor: &Conductor| -> Option<usize> {
        let around = conductor.surface.iter().flatten().flat_map(|&node| topology.elements_around(node));
        let mut regions = around.map(|e| topology.region_of()[e.index()].index());
        regions.find(|&region| conducts[region])
    };
    let fault = |conductor: &Conductor| {
        let (name, other) = (&conductor.name, &topology.region_names()[touched(conductor)?]);
        let message =
            format!("`{name}` is replaced by its surface, but touches the meshed conductor `{other}`");
        Some(
            source
                .diagnostic(&format!("regions.{name}.model"), message)
                .expected("air between the two, or one kind of model for both"),
        )
    };
    conductors.iter().filter_map(fault).collect()
}

/// The field models of a configuration on its mesh, one a load case.
pub(super) fn field_models(
    config: &Config,
    mesh: &Mesh,
    conductors: &[Conductor],
    (coils, curves): (&[coil::Coil], &Curves),
    moving: &[ElementId],
    share: Option<&Ownership>,
) -> Result<Vec<FieldModel>, Error> {
    let mut models: Vec<FieldModel> = Vec::new();
    for case in config.load_cases() {
        let frequency = case.frequency;
        let load_case = loads::load_case(config, &case);
        // Of one frequency two models share their matrix too, above 0 Hz all but their numbers.
        let known = || models.iter().rev();
        let is_alike = |model: &&FieldModel| (model.angular_frequency() > 0.0) == (frequency > 0.0);
        let nearest =
            known().find(|model| model.setup().frequency == frequency).or_else(|| known().find(is_alike));
        models.push(match nearest {
            Some(model) => model.at_load_case(mesh, &load_case)?,
            None => {
                let sources = (conductors.to_vec(), coils.to_vec());
                field_model(config, mesh, &load_case, (sources, curves, moving), share)?
            }
        });
    }
    Ok(models)
}

fn field_model(
    config: &Config,
    mesh: &Mesh,
    load_case: &LoadCase,
    ((conductors, coils), curves, moving): ((Vec<Conductor>, Vec<coil::Coil>), &Curves, &[ElementId]),
    share: Option<&Ownership>,
) -> Result<FieldModel, Error> {
    let names = mesh.topology().region_names();
    let bh: Vec<Option<Arc<BhCurve>>> = names.iter().map(|name| curves.of(config, name)).collect();
    let material = |(name, curve): (&String, &Option<Arc<BhCurve>>)| match curve {
        None => material(config, name),
        // What is left of a linear material is the penalty of nodal elements.
        Some(curve) => {
            Material { relative_permeability: curve.largest_permeability(), ..material(config, name) }
        }
    };
    let materials = names.iter().zip(&bh).map(material).collect();
    let of = |names: &[String], boundary: Boundary| -> Vec<(String, Boundary)> {
        names.iter().map(|name| (name.clone(), boundary)).collect()
    };
    let mut boundaries = of(&config.boundaries.flux_parallel, Boundary::FluxParallel);
    boundaries.extend(of(&config.boundaries.flux_normal, Boundary::FluxNormal));
    if let Some(field) = &config.boundaries.uniform_field {
        let applied = UniformField { flux_density: field.b, centre: field.center };
        boundaries.extend(of(&field.surfaces, Boundary::UniformField(applied)));
    }
    boundaries.extend(open::condition(config));
    let linear_solver = LinearSolverSettings {
        solutions: solutions(config, load_case.frequency),
        ..linear_solver(&config.analysis.linear_solver)
    };
    let setup = FieldModelSetup {
        penalty: config.analysis.penalty,
        family: family(config),
        order: order(config),
        materials,
        remanence: remanences(config, mesh.topology()),
        bh,
        conductors,
        coils,
        windings: config.coils.iter().map(winding).collect(),
        boundaries,
        open: open::region(config, mesh.topology())?,
        moving: moving.to_vec(),
        linear_solver,
        ownership: share.map(|share| (share.clone(), distributed_settings(&config.analysis.petsc))),
        ..FieldModelSetup::default()
    };
    Ok(FieldModel::new(mesh, load_case.applied_to(&setup))?)
}

/// Solutions that a design takes with one matrix: of every load case that shares it the state and the adjoints of objective and
/// constraints, and what a volt at a coil drives. Along a B–H curve every load case has a matrix of its own.
fn solutions(config: &Config, frequency: f64) -> usize {
    let all = config.load_cases();
    let mut cases: Vec<_> = all.iter().filter(|case| case.frequency == frequency).collect();
    if config.saturating_region().is_some() {
        cases.truncate(1);
    }
    let is_taken = |own: &config::Functional, case: &config::LoadCase<'_>| {
        own.kind.is_of_field() && own.is_taken_under(case)
    };
    let adjoints = |case: &config::LoadCase<'_>| {
        let terms = config.objective.iter().flat_map(|objective| objective.terms());
        let terms = terms.filter(|term| is_taken(&term.functional, case)).count();
        let is_worst = config.objective.as_ref().is_some_and(|own| own.combine == Combination::WorstCase);
        let constraints = config.constraints.iter().filter_map(|constraint| constraint.limit.functional());
        (if is_worst { terms } else { terms.min(1) }) + constraints.filter(|own| is_taken(own, case)).count()
    };
    let voltages = config.coils.iter().filter(|coil| cases.iter().any(|case| case.feed(coil).by_voltage));
    cases.iter().map(|case| 1 + adjoints(case)).sum::<usize>() + voltages.count()
}

/// How the linear systems are solved.
fn linear_solver(options: &config::LinearSolver) -> LinearSolverSettings {
    let method = match options.method {
        SolverMethod::Automatic => LinearSolver::Automatic,
        SolverMethod::Direct => LinearSolver::Fixed(Method::Direct),
        SolverMethod::DirectSingle => LinearSolver::Fixed(Method::DirectSingle),
        SolverMethod::RealFactor => LinearSolver::Fixed(Method::RealFactor),
        SolverMethod::RealFactorSingle => LinearSolver::Fixed(Method::RealFactorSingle),
        SolverMethod::Incomplete => LinearSolver::Fixed(Method::Incomplete),
        SolverMethod::TwoLevel => LinearSolver::Fixed(Method::TwoLevel),
    };
    let reuse = match options.reuse {
        FactorReuse::WhileItPays => Reuse::WhileItPays,
        FactorReuse::Never => Reuse::Never,
    };
    let usual = LinearSolverSettings::default();
    LinearSolverSettings {
        method,
        reuse,
        tolerance: options.tolerance,
        required: usual.required.max(options.tolerance),
        factor_bytes: (options.factor_gib * GIB) as usize,
        ..usual
    }
}

/// How they are solved on several ranks.
fn distributed_settings(options: &config::Petsc) -> DistributedSettings {
    DistributedSettings {
        method: match options.solver {
            PetscSolver::Automatic => None,
            PetscSolver::Mumps => Some(DistributedMethod::Direct),
            PetscSolver::Asm => Some(DistributedMethod::Schwarz),
        },
        krylov: match options.krylov {
            PetscKrylov::Gmres => Krylov::Gmres,
            PetscKrylov::Cocg => Krylov::Cocg,
        },
        overlap: options.overlap,
        sub_solver: match options.sub_solver {
            PetscSubSolver::Incomplete => SubSolver::Incomplete,
            PetscSubSolver::Complete => SubSolver::Complete,
        },
    }
}

/// Bytes of a GiB.
const GIB: f64 = (1u64 << 30) as f64;

/// The family of the elements.
fn family(config: &Config) -> ElementFamily {
    match config.analysis.elements {
        config::Elements::Nodal => ElementFamily::Nodal,
        config::Elements::Edge => ElementFamily::Edge,
    }
}

/// The order of the elements.
pub(super) fn order(config: &Config) -> Order {
    match config.analysis.order {
        config::ElementOrder::Linear => Order::Linear,
        config::ElementOrder::Quadratic => Order::Quadratic,
    }
}

/// A coil of the configuration on its mesh.
fn coil(coil: &config::Coil, mesh: &Mesh) -> Result<coil::Coil, Error> {
    let frame = |center, axis: config::Axis, direction| Frame::new(center, axis.vector(), direction);
    let shape = match &coil.shape {
        config::CoilShape::Racetrack(r) => {
            let corner = match r.corner {
                config::Corner::Sharp(config::CornerWord::Mitred) => coil::Corner::Mitred,
                config::Corner::Round(inner_radius) => coil::Corner::Round { inner_radius },
            };
            let frame = frame(r.center, r.axis, r.direction)?;
            Racetrack::in_frame(frame, r.half_window, r.width, r.height, corner)?.into()
        }
        config::CoilShape::Circular(c) => {
            Racetrack::circular(frame(c.center, c.axis, None)?, c.radius, c.width, c.height)?.into()
        }
        config::CoilShape::Region(region) => {
            let topology = mesh.topology();
            let elements = topology.elements_of(topology.region(&region.region)?);
            let terminal = |name: &String| -> Result<Terminal, Error> {
                Ok(Terminal { name: name.clone(), triangles: topology.surface(name)?.to_vec() })
            };
            let path = match &region.path {
                config::CoilPath::Terminals { terminals: [from, to] } => {
                    Path::Terminals { from: terminal(from)?, to: terminal(to)? }
                }
                config::CoilPath::Closed { center, axis } => Path::Closed(frame(*center, *axis, None)?),
            };
            match region.conductor {
                config::ConductorWord::Stranded => {
                    RegionCurrent::new(mesh, &coil.name, &elements, &path)?.into()
                }
                config::ConductorWord::Solid => {
                    let connection = match region.connection {
                        config::ConnectionWord::Series => Connection::Series,
                        config::ConnectionWord::Parallel => Connection::Parallel,
                    };
                    SolidConductor::new(mesh, &coil.name, &elements, (&path, connection))?.into()
                }
            }
        }
    };
    // What feeds it is the load case's.
    Ok(coil::Coil { name: coil.name.clone(), ampere_turns: c64::default(), shape })
}

/// The winding of a coil that has turns.
fn winding(coil: &config::Coil) -> Option<Winding> {
    Some(Winding {
        turns: coil.turns?,
        resistance: coil.resistance.unwrap_or(0.0),
        series_inductance: coil.series_inductance.unwrap_or(0.0),
        series_capacitance: coil.series_capacitance,
        voltage: None,
    })
}

/// Divergence of a current, relative to its density, below which nothing is said of it.
const LEAST_DIVERGENCE: f64 = 1e-4;

/// Share that the projection changes of a current, above which its region is no bundle of strands: sharp bends have up to 17 %, a
/// frame in which the current branches has 32 %.
const BRANCHED: f64 = 0.25;

/// Notices about the current of each coil region.
pub(super) fn coil_notices(model: &FieldModel) -> Vec<String> {
    let notice = |coil: &coil::Coil| match &coil.shape {
        // The current of a solid conductor is part of the solution.
        CoilShape::Racetrack(_) | CoilShape::Solid(_) => None,
        CoilShape::Region(current) => {
            let report = current.report();
            let is_smooth = report.after.jump.max(report.after.wall) < LEAST_DIVERGENCE;
            let is_branched = report.correction > BRANCHED;
            let meaning = if is_branched {
                "the region branches, or its cross-section changes along the way, and strands of one current density do not fit it: its \
                 current runs back in parts of it, and inductances may be off by tenths, which no error bar counts. Give each \
                 winding a region of its own and one cross-section, or set conductor = \"solid\" where currents may part"
            } else {
                "where the winding bends its current is off from element to element, and as a whole nearer to the inside: fields, \
                 inductances, losses and forces that it makes in air are off by about a tenth of that, which no error bar counts, \
                 beside iron by far less; a finer mesh of the winding has less, and `shape` in place of `region` none"
            };
            (is_branched || !is_smooth).then(|| format!("coil `{}`: {report}; {meaning}", coil.name))
        }
    };
    model.coils().iter().filter_map(notice).collect()
}

/// The coils on the mesh, or the faults of all of them.
pub(super) fn coils(config: &Config, source: &SourceMap, mesh: &Mesh) -> Result<Vec<coil::Coil>, Error> {
    let mut sink = DiagnosticSink::new(config, source, Vec::new());
    let mut coils = Vec::new();
    for (i, written) in config.coils.iter().enumerate() {
        let built = coil(written, mesh).map_err(|error| match error {
            Error::Optimizer(OptimizerError::Solver(SolverError::Parameter { ref what, .. })) => {
                source.error(vec![source.diagnostic(&format!("coils[{i}].{what}"), error.to_string())]).into()
            }
            other => other,
        });
        coils.extend(sink.take(built)?);
    }
    sink.check()?;
    Ok(coils)
}

/// Every region that no coil can be.
pub(super) fn coil_faults(config: &Config, source: &SourceMap) -> Vec<Diagnostic> {
    let mut faults = Vec::new();
    for (i, coil) in config.coils.iter().enumerate() {
        let config::CoilShape::Region(region) = &coil.shape else { continue };
        let (path, name) = (format!("coils[{i}].region"), &region.region);
        if !config.is_meshed(name) {
            let fault = source.diagnostic(&path, format!("`{name}` is replaced by its surface"));
            faults.push(fault.expected("a region that is meshed"));
        } else if coil.is_solid() {
            faults.extend(solid_fault(config, source, i, name));
        } else if config.alternates() && material(config, name).conductivity > 0.0 {
            let message = format!(
                "`{name}` conducts: eddy currents would flow in it beside the given current of its strands"
            );
            faults.push(
                source.diagnostic(&path, message).expected("a material without conductivity for the winding"),
            );
        }
    }
    faults
}

/// A solid conductor that does not conduct, and one that is another coil's too: it has one voltage between its terminals.
fn solid_fault(config: &Config, source: &SourceMap, coil: usize, region: &str) -> Option<Diagnostic> {
    let fault = |message: String| source.diagnostic(&format!("coils[{coil}].region"), message);
    if material(config, region).conductivity == 0.0 {
        let fault = fault(format!("`{region}` is a solid conductor, but does not conduct"));
        return Some(
            fault.expected("a material with a conductivity for the region, or conductor = \"stranded\""),
        );
    }
    let twin = solid_coil(config, region).filter(|own| own.name != config.coils[coil].name)?;
    config.alternates().then(|| {
        fault(format!("`{region}` is already the solid conductor of the coil `{}`", twin.name))
            .expected("one coil with the sum of both currents, or a region for each conductor")
    })
}

/// Remanence of every region [T], by `RegionId`; zero where there is no magnet.
fn remanences(config: &Config, topology: &Topology) -> Vec<[f64; 3]> {
    let of = |name: &String| config.regions.get(name).and_then(|region| region.remanence);
    topology.region_names().iter().map(|name| of(name).unwrap_or_default()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_solutions_of_a_matrix_are_those_of_all_that_share_it() {
        let of = |overrides: &[&str], frequency: f64| {
            let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/shield_quick.toml");
            let overrides: Vec<String> = overrides.iter().map(|own| (*own).to_owned()).collect();
            let (config, _) = Config::from_file(&path, &overrides).expect("a sound configuration");
            solutions(&config, frequency)
        };
        assert_eq!(of(&[], 60.0), 2, "state and adjoint");
        let loss = "constraints=[{ kind = \"loss\", region = \"plate\", upper_ratio = 2, load = \"b\" }]";
        let loads =
            "loads=[{ name = \"a\" }, { name = \"b\", amplitude = 2 }, { name = \"c\", frequency = 200 }]";
        assert_eq!([60.0, 200.0].map(|frequency| of(&[loads], frequency)), [4, 2]);
        assert_eq!(of(&[loads, loss], 60.0), 5, "its adjoint under one of two loads");
    }
}
