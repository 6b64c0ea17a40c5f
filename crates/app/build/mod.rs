//! From a configuration to a problem: the one place where names of the configuration meet names of the mesh.
//!
//! Every name is checked against the mesh before anything is computed, and all faults are reported at once at their
//! keys. `mesh` makes the mesh, `field` the field problems, `loads` what excites them, `functional` objective and constraints, `design` the design
//! surface, `shape` the elastic map, `references` where names stand and `names` whether the mesh has them, `plausible` what cannot be meant, `thin_windings` what cells are too wide for, `applied` that of applied fields, `probes` where nothing is measured, `elements` what family and order cannot represent, `soundness` what is wrong with the mesh as a whole, `skin` the audits of conductors, `motion` a prescribed motion without a field problem, `outline` what a report draws.

mod applied;
mod curves;
mod design;
mod divided_mesh;
mod elastic_body;
mod elements;
mod entries;
mod field;
mod forces;
mod functional;
mod held;
mod loads;
pub(crate) mod locate_error;
pub(crate) mod memory_limit;
pub(crate) mod mesh;
mod motion;
pub(crate) mod multipole;
mod names;
mod open;
mod outline;
mod plausible;
mod probes;
mod references;
mod refined;
mod shape;
mod share;
mod skin;
mod soundness;
pub(crate) mod steels;
mod thickness;
mod thin_windings;
mod truncation;

pub(crate) use curves::LARGEST_TABLE;
pub(crate) use design::{out_of_body, triangulation as design_triangulation};
pub(crate) use divided_mesh::DividedMesh;
pub(crate) use elastic_body::{motion_in_words, stiffness_policy};
pub(crate) use entries::{is_air, is_pushed, is_wound, material};
pub(crate) use field::{remaining_elements, remaining_nodes};
pub(crate) use functional::with_cells_written_down;
pub use motion::{MotionSetup, set_up_motion};
pub use names::with_names;
pub(crate) use open::is_open;
pub use outline::{Outline, OutlinedDesign, outline};
pub(crate) use references::{functionals, region_in_mesh, surface_names};
pub(crate) use refined::RefinedMesh;
pub use skin::{Audited, PermeabilityOf};
pub(crate) use skin::{audit_in_field, least_thickness, result_warnings, warnings as skin_warnings};
pub(crate) use soundness::overlap_warning;
pub(crate) use truncation::{Truncation, observed_regions};

use std::collections::BTreeMap;
use std::path::PathBuf;

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::parallel::RankGroup;
use fluxmorph_geometry::soundness::OpenPatch;
use fluxmorph_optimizer::Error as OptimizerError;
use fluxmorph_optimizer::constraint::Constraint;
use fluxmorph_optimizer::design::DesignSurface;
use fluxmorph_optimizer::problem::{Cut, Problem, Progress, Shape, Stage};
use fluxmorph_remesh::RemeshError;
use fluxmorph_solver::{FieldModel, SolverError};

use self::curves::Curves;
use self::locate_error::DiagnosticSink;
use self::names::{check_names, name_faults};
use self::skin::audits;
use crate::config::{Config, ElementOrder, Objective, SourceMap};
use crate::error::Error;

/// A problem, and what the user should know of it.
#[derive(Debug)]
pub struct Setup {
    /// The problem.
    pub problem: Problem,
    /// Skin-depth audit of every conductor.
    pub audits: Vec<Audited>,
    /// Warnings and notices, in the order found.
    pub warnings: Vec<String>,
    /// The mesh as read or generated, with all its regions.
    pub full_mesh: Mesh,
    /// Outer faces of it without a condition.
    pub open_patches: Vec<OpenPatch>,
    /// The B–H tables that were read from files, with BLAKE3 of their content.
    pub tables: BTreeMap<PathBuf, String>,
}

/// Which parts of the configuration a command needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// A field analysis: objective and design take part where they are given.
    Analysis,
    /// A look at everything, without solving: with [morph] a field problem need not be complete.
    Inspection,
    /// An optimisation: objective, design and remesh region must be there.
    Optimisation,
}

/// Builds or reads the mesh of a configuration, with the interfaces that the configuration names.
///
/// # Errors
/// [`Error::Config`] for a parameter that a generator refuses or a mesh file that is damaged, [`Error::Output`] for a mesh
/// file that cannot be read.
pub fn build_mesh(config: &Config, source: &SourceMap) -> Result<Mesh, Error> {
    Ok(mesh::build(config, source)?.mesh)
}

/// Sets up the problem of a configuration.
///
/// # Errors
/// All faults of names and of their use at once; then whatever the mesh, the solver or the elastic map refuses.
pub fn set_up(config: &Config, source: &SourceMap, mode: Mode) -> Result<Setup, Error> {
    set_up_watched(config, source, mode, None, &mut |_| ())
}

/// As [`set_up`], shared out among the ranks of a group if there is one: every rank sets up the same problem, and only the
/// first one gives commands. Every stage is reported to `progress` as it begins.
pub fn set_up_watched(
    config: &Config,
    source: &SourceMap,
    mode: Mode,
    group: Option<&RankGroup>,
    progress: &mut dyn Progress,
) -> Result<Setup, Error> {
    if mode == Mode::Optimisation {
        config.optimisation(source)?;
    }
    progress.stage(Stage::Mesh);
    let mut set_up = |group| {
        mesh::build(config, source)
            .and_then(|built| problem_on(built, config, source, mode, group, progress))
            .map_err(|error| locate_error::attribute_error(error, config, source))
    };
    let mut setup = set_up(group).map_err(|error| match error {
        // Another rank has met a fault of the configuration before this one: alone it is met, and located.
        Error::Optimizer(
            OptimizerError::Remesh(RemeshError::Rank(_)) | OptimizerError::Solver(SolverError::Rank(_)),
        ) => match set_up(None) {
            Err(fault @ Error::Config(_)) => fault,
            _ => error,
        },
        other => other,
    })?;
    if !(mode == Mode::Inspection && config.morph.is_some()) {
        multipole::check_all(config, source, &setup.problem)?;
    }
    let at_bounds = skin::bound_warnings(config, &setup.audits, (&setup.problem, &setup.full_mesh));
    setup.warnings.extend(at_bounds);
    setup.warnings.extend(thickness::cut_warning(config, setup.problem.shape(), &setup.full_mesh));
    Ok(setup)
}

/// Sets up the problem of a configuration on a mesh that is not its own, but has its regions and surfaces; with the design
/// surface where that comes from a coarser mesh. What its bounds allow has been warned of.
pub(crate) fn set_up_on(
    mesh: (Mesh, Option<DesignSurface>),
    config: &Config,
    source: &SourceMap,
    mode: Mode,
) -> Result<Setup, Error> {
    problem_on(mesh.into(), config, source, mode, None, &mut |_| ())
        .map_err(|error| locate_error::attribute_error(error, config, source))
}

fn problem_on(
    mesh::Built { mesh: full_mesh, notices: mut warnings, surface }: mesh::Built,
    config: &Config,
    source: &SourceMap,
    mode: Mode,
    group: Option<&RankGroup>,
    progress: &mut dyn Progress,
) -> Result<Setup, Error> {
    let motion_alone = mode == Mode::Inspection && config.morph.is_some();
    let open_patches = look_at_mesh(config, source, &full_mesh, motion_alone, &mut warnings)?;
    let curves = Curves::read(config, source);
    let audits = audits(config, &full_mesh, curves.as_ref().unwrap_or(&Curves::default()));
    // The field of an analysis says what the skin of iron with a B–H curve is.
    let is_known = |own: &&Audited| mode != Mode::Analysis || own.permeability_of == PermeabilityOf::Material;
    warnings.extend(skin::warnings(audits.iter().filter(is_known)));
    let (mesh, conductors) = field::without_replaced_regions(config, &full_mesh)?;
    let mut faults = probes::faults(config, source, &full_mesh, &mesh);
    faults.extend(field::contact_faults(config, source, &mesh, &conductors));
    faults.extend(elements::faults(config, source, &full_mesh, &audits));
    let mut sink = DiagnosticSink::new(config, source, faults);
    if conductors.is_empty() && !motion_alone {
        sink.take(check_conditions(config, source))?;
    }
    progress.stage(Stage::Unknowns);
    let share = group.map(|group| share::of_mesh(config, &mesh, group)).transpose()?;
    let coils = sink.take(field::coils(config, source, &mesh))?;
    let curves = sink.take(curves)?.unwrap_or_default();
    warnings.extend(curves.warnings(config));
    if !motion_alone {
        let coils = coils.as_deref().unwrap_or_default();
        let faults = plausible::coil_faults(config, source, &full_mesh, coils);
        sink.take(source.check(faults).map_err(Error::from))?;
        warnings.extend(plausible::warnings(config, &full_mesh, coils, &open_patches));
        warnings.extend(applied::on_conductors(config, &full_mesh));
        warnings.extend(probes::warnings(config, &full_mesh, &mesh));
        warnings.extend(functional::warnings(config));
        warnings.extend(loads::sum_warnings(config));
        warnings.extend(elements::warnings(config, &full_mesh, &audits));
    }
    let (full, remaining, owned) = (&full_mesh, &mesh, share.as_ref());
    let design = config.design.as_ref().zip(config.remesh.as_ref()).map(|(design, remesh)| shape::Inputs {
        source,
        design,
        remesh,
        full_mesh: full,
        mesh: remaining,
        surface: surface.as_ref(),
        share: owned,
    });
    let body = match &design {
        Some(inputs) => sink.take(shape::body(inputs, config, &mut warnings))?,
        None => None,
    };
    // Neither needs the other: faults in both are reported together.
    let states = match coils {
        Some(coils) => {
            // Where one design is analysed, an order for many is not worth its price.
            let moving =
                body.as_ref().filter(|_| mode != Mode::Analysis).map_or(&[][..], shape::Body::moving);
            let parts = (&coils[..], &curves);
            sink.take(field::field_models(config, &mesh, &conductors, parts, moving, share.as_ref()))?
        }
        None => None,
    };
    sink.check()?;
    if !motion_alone {
        source.check(applied::faults(config, source, &full_mesh))?;
    }
    let states = states.expect("without faults there are coils and states");
    warnings.extend(field::coil_notices(&states[0]));
    if states.iter().all(FieldModel::is_unexcited) && !motion_alone {
        warnings.push(unexcited(config, source, mode)?);
    }
    let objective = functional::objective(config, [&full_mesh, &mesh], &states)?;
    let shape = match (&design, body) {
        (Some(inputs), Some(body)) => {
            progress.stage(Stage::Elasticity);
            let observed = functional::fixed_elements(config, [&full_mesh, &mesh], &states)?;
            let shape = shape::shape(inputs, config, body, &states, &observed)?;
            source.check(functional::bodies_at_rest(config, source, &mesh, (&shape, &states[0])))?;
            if group.is_none() {
                check_initial_design(source, (&shape, &mesh))?;
            }
            Some(shape)
        }
        _ => None,
    };
    progress.stage(Stage::Other);
    let constraints = functional::constraints(config, source, [&full_mesh, &mesh], &states, shape.as_ref())?;
    warnings.extend(functional::mean_warnings(objective.as_ref(), &constraints, &states[0]));
    if shape.is_none() && constraints.len() < config.constraints.len() {
        warnings
            .push("[[constraints]] on a body have no meaning without [design]: they are left out".to_owned());
    }
    warnings.extend(optimisation_warnings(config, &constraints, mode));
    let bodies = functional::bodies(config, &mesh, &states)?;
    let problem =
        Problem::new(mesh, states, objective, constraints, shape).shared_out(share).with_bodies(bodies);
    let tables = curves.into_files();
    Ok(Setup { problem, audits, warnings, full_mesh, open_patches, tables })
}

/// Refuses a mesh that is broken, or lacks what the configuration names, with warnings of what is rarely meant; outer faces
/// without a condition, unless only the mesh is to move.
fn look_at_mesh(
    config: &Config,
    source: &SourceMap,
    mesh: &Mesh,
    motion_alone: bool,
    warnings: &mut Vec<String>,
) -> Result<Vec<OpenPatch>, Error> {
    // Regions without common nodes have no interface that a name could stand for: first things first.
    source.check(soundness::contact_faults(config, source, mesh))?;
    check_names(config, source, mesh, warnings)?;
    warnings.extend_from_slice(source.notices());
    let mut open = Vec::new();
    if !motion_alone {
        let outside = soundness::outside(config, source, mesh).map_err(|faults| source.error(faults))?;
        warnings.extend(outside.warnings);
        warnings.extend(soundness::unit_warning(config, mesh));
        warnings.extend(soundness::swap_warning(config, mesh));
        open = outside.open;
    }
    warnings.extend(soundness::length_warnings(config, mesh));
    warnings.extend(soundness::layer_warnings(config, mesh));
    Ok(open)
}

/// What is said where nothing excites a field.
///
/// # Errors
/// Where an objective is to be changed by it.
fn unexcited(config: &Config, source: &SourceMap, mode: Mode) -> Result<String, Error> {
    let message = "nothing excites a field, it is zero everywhere";
    let advice = "add [[coils]], a magnet's remanence or an applied field";
    if mode != Mode::Analysis && config.objective.is_some() {
        return Err(source.error(vec![source.diagnostic("objective", message).help(advice)]).into());
    }
    Ok(format!("{message}; {advice}"))
}

/// What is rarely meant by objective and constraints, and by a tolerance.
fn optimisation_warnings(config: &Config, constraints: &[Constraint], mode: Mode) -> Vec<String> {
    let mut warnings = Vec::new();
    let is_of_shape = |own: &Objective| !own.is_of_field();
    if config.objective.as_ref().is_some_and(is_of_shape)
        && constraints.iter().all(|own| !own.quantity.is_of_field())
    {
        warnings.push(
            "the objective is of the shape alone and no constraint is on the field: no field has a say in the optimum; bound \
             what the device has to do in [[constraints]]"
                .to_owned(),
        );
    }
    let is_second_order = config.analysis.order == ElementOrder::Quadratic;
    if config.accuracy.tolerance.is_some() && mode != Mode::Analysis && is_second_order {
        warnings
            .push("accuracy.tolerance needs analysis.order = 1: the mesh of a run is not refined".to_owned());
    }
    warnings
}

/// Refuses on the first of several ranks what [`set_up_watched`] refuses on one process: they move the mesh together, once all are
/// set up.
///
/// # Errors
/// [`Error::Config`] for an initial design of which the mesh carries a part alone.
pub(crate) fn check_on_ranks(setup: &Setup, source: &SourceMap) -> Result<(), Error> {
    match (setup.problem.share(), setup.problem.shape()) {
        (Some(_), Some(shape)) => check_initial_design(source, (shape, setup.problem.original())),
        _ => Ok(()),
    }
}

/// Refuses an initial design of which the mesh carries a part alone.
fn check_initial_design(source: &SourceMap, (shape, mesh): (&Shape, &Mesh)) -> Result<(), Error> {
    let initial = shape.initial();
    if initial.iter().all(|&p| p == 0.0) {
        return Ok(());
    }
    let carried = shape.carried(&vec![0.0; initial.len()], initial).map_err(OptimizerError::from)?;
    if carried.share == 1.0 {
        return Ok(());
    }
    let cut = Cut::of(shape, mesh, initial, carried.room.element);
    let message = format!(
        "the mesh carries {:.0} % of the initial design: beyond, {}",
        100.0 * carried.share,
        cut.cause
    );
    let fault = source.diagnostic("design.initial", message);
    let expected = format!("a design nearer to the mesh as it is, or more room for the mesh: {}", cut.cure);
    Err(source.error(vec![fault.expected(expected)]).into())
}

/// Refuses a field problem whose potential no surface fixes.
fn check_conditions(config: &Config, source: &SourceMap) -> Result<(), Error> {
    if !config.boundaries.is_empty() || open::condition(config).is_some() {
        return Ok(());
    }
    let message = "no surface has a condition: the potential is known up to a constant only";
    let fault = source
        .diagnostic("boundaries", message)
        .expected("the outer surfaces in boundaries.flux_parallel, or another condition");
    Err(source.error(vec![fault]).into())
}

/// Number of design variables of a configuration.
///
/// # Errors
/// [`Error::Config`] when the configuration has no design or names no surface of the mesh.
pub fn variable_count(config: &Config, source: &SourceMap) -> Result<usize, Error> {
    let Some(design) = &config.design else {
        let fault = source.diagnostic("design", "there is no [design], so a design has no meaning");
        return Err(source.error(vec![fault]).into());
    };
    if let (Some([n, m]), []) = (design.grid, design.symmetry.as_slice()) {
        return Ok(n * m);
    }
    let mesh = build_mesh(config, source)?;
    source.check(name_faults(config, source, mesh.topology()))?;
    Ok(design::surface(config, source, design, &mesh)?.variable_count())
}
