//! What `check` finds: the configuration as it is understood, and what the mesh and the problem are.
//!
//! Serialised as it is by `--json`; everything is in SI. The table for people is made of it in [`super::text`].

use std::collections::BTreeMap;

use fluxmorph_geometry::soundness::OpenPatch;
use fluxmorph_geometry::tet4::{area_vector, norm, volume};
use fluxmorph_geometry::{Mesh, NodeId};
use fluxmorph_optimizer::Error as OptimizerError;
use fluxmorph_optimizer::constraint::{self, Quantity};
use fluxmorph_optimizer::design::GridSide;
use fluxmorph_optimizer::geometric::WallThickness;
use fluxmorph_optimizer::problem::{Problem, Progress, Shape};
use fluxmorph_remesh::MotionLaw;
use fluxmorph_solver::FieldModel;
use serde::Serialize;

use super::advice::advice;
use super::estimate::EstimateSummary;
use super::reach::Reach;
use crate::build::{
    Audited, Mode, PermeabilityOf, Setup, Truncation, memory_limit, motion_in_words, set_up_watched,
    stiffness_policy,
};
use crate::config::{
    self, Boundaries, Coil, Config, Constraint, Design, Generator, Load, Material, MeshConfig, MultipoleSet,
    Objective, Open, Optimizer, Probe, RegionModel, Remesh, SourceMap,
};
use crate::error::Error;
use crate::files::OverwritePolicy;
use crate::run::memory;
use crate::run::morph::{self, MotionSummary};

/// What `check` found.
#[derive(Debug, Serialize)]
pub(super) struct Summary<'a> {
    pub(super) title: &'a str,
    /// The generator of the mesh, or `file`.
    pub(super) mesh_origin: &'static str,
    /// The file of the mesh and the unit of its coordinates; `None` for a generated mesh.
    pub(super) mesh_file: Option<MeshFileSummary>,
    /// What the file asks for.
    pub(super) field_problem: FieldProblem,
    pub(super) frequencies_hz: Vec<f64>,
    pub(super) loads: &'a [Load],
    /// Polynomial degree of the elements.
    pub(super) order: u8,
    pub(super) nodes: usize,
    pub(super) tets: usize,
    pub(super) unknowns: usize,
    pub(super) elastic_equations: usize,
    pub(super) design_variables: usize,
    /// Radius of the filter of the design [m].
    pub(super) filter_radius_m: Option<f64>,
    /// The sides of the control grid.
    #[serde(skip)]
    pub(super) grid_sides: Option<[GridSide; 2]>,
    /// How the mesh follows the design, and why so.
    pub(super) mesh_motion: Option<String>,
    /// How stiffness follows element size.
    pub(super) stiffness: Option<String>,
    pub(super) bounding_box_m: [[f64; 3]; 2],
    pub(super) regions: Vec<RegionSummary>,
    pub(super) materials: &'a BTreeMap<String, Material>,
    pub(super) surfaces: Vec<SurfaceSummary>,
    /// Sides of the mesh without condition, on which the field is left normal.
    pub(super) open_sides: Vec<OpenSideSummary>,
    pub(super) quality: QualitySummary,
    pub(super) skin: Vec<SkinSummary>,
    pub(super) motions: Vec<MotionSummary>,
    /// The method of each state's linear solver.
    pub(super) linear_solvers: Vec<String>,
    pub(super) coils: &'a [Coil],
    pub(super) boundaries: &'a Boundaries,
    pub(super) open: Option<&'a Open>,
    /// The nearest wall, where space is not open.
    pub(super) truncation: Option<Truncation>,
    pub(super) objective: Option<&'a Objective>,
    /// Unit of the objective in SI; `None` where its terms have several.
    pub(super) objective_unit: Option<&'static str>,
    pub(super) constraints: &'a [Constraint],
    #[serde(flatten)]
    pub(super) initial_shape: ConstrainedShape,
    pub(super) design: Option<&'a Design>,
    /// Whether the mesh follows all variables to their bounds.
    pub(super) reach: Vec<Reach>,
    pub(super) remesh: Option<&'a Remesh>,
    pub(super) optimizer: &'a Optimizer,
    pub(super) probes: &'a [Probe],
    #[serde(skip_serializing_if = "<[MultipoleSet]>::is_empty")]
    pub(super) multipoles: &'a [MultipoleSet],
    pub(super) output_directory: String,
    pub(super) memory_estimate_bytes: usize,
    /// Where `--estimate` asks for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) estimate: Option<EstimateSummary>,
    pub(super) warnings: Vec<String>,
}

/// What constraints of the shape are measured by at the initial design.
#[derive(Debug, Default, Serialize)]
pub(super) struct ConstrainedShape {
    /// Volumes [m³] and masses [kg], by the names of the constraints.
    pub(super) constrained_bodies: BTreeMap<String, f64>,
    /// Least and greatest thickness [m].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) constrained_thickness_m: Option<[f64; 2]>,
}

/// Whether there is a field to be computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum FieldProblem {
    /// Yes.
    Given,
    /// No: only the mesh moves.
    None,
}

/// The file that the mesh was read from.
#[derive(Debug, Serialize)]
pub(super) struct MeshFileSummary {
    pub(super) path: String,
    pub(super) unit: &'static str,
}

/// One region of the mesh.
#[derive(Debug, Serialize)]
pub(super) struct RegionSummary {
    pub(super) name: String,
    pub(super) tets: usize,
    pub(super) volume_m3: f64,
    pub(super) material: String,
    pub(super) model: &'static str,
}

/// One named surface.
#[derive(Debug, Serialize)]
pub(super) struct SurfaceSummary {
    pub(super) name: String,
    pub(super) triangles: usize,
    pub(super) area_m2: f64,
}

/// Outer faces without condition.
#[derive(Debug, Serialize)]
pub(super) struct OpenSideSummary {
    /// The region behind them.
    pub(super) region: String,
    pub(super) triangles: usize,
    pub(super) area_m2: f64,
    /// The middle of the largest triangle.
    pub(super) at_m: [f64; 3],
}

/// Quality of the elements that may move, or of all.
#[derive(Debug, Serialize)]
pub(super) struct QualitySummary {
    pub(super) of: &'static str,
    pub(super) worst: f64,
    pub(super) worst_element: u32,
    pub(super) worst_at_m: [f64; 3],
    pub(super) up_to_0_3: f64,
    pub(super) from_0_3_to_0_6: f64,
    pub(super) from_0_6: f64,
}

/// One conductor.
#[derive(Debug, Serialize)]
pub(super) struct SkinSummary {
    pub(super) region: String,
    pub(super) model: &'static str,
    pub(super) frequency_hz: f64,
    pub(super) skin_depth_m: f64,
    /// Of iron with a B–H curve: the depth is that of its largest permeability, this one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) largest_permeability: Option<f64>,
    pub(super) median_elements_per_skin_depth: f64,
    pub(super) least_elements_per_skin_depth: f64,
    pub(super) thickness_in_skin_depths: f64,
}

impl SkinSummary {
    fn of(audited: &Audited) -> Self {
        let audit = &audited.audit;
        Self {
            region: audit.region.clone(),
            model: audited.model.name(),
            frequency_hz: audited.frequency,
            skin_depth_m: audit.skin_depth,
            largest_permeability: (audited.permeability_of == PermeabilityOf::LargestOfCurve)
                .then_some(audit.relative_permeability),
            median_elements_per_skin_depth: audit.median_elements_per_skin_depth,
            least_elements_per_skin_depth: audit.least_elements_per_skin_depth,
            thickness_in_skin_depths: audit.thickness_in_skin_depths,
        }
    }
}

/// How stiffness follows element size: in the motion of a design, or of `[morph]`.
fn stiffness(remesh: &Remesh, shape: Option<&Shape>) -> String {
    let law = match remesh.law {
        Some(config::MotionLaw::Hyperelastic) => MotionLaw::Hyperelastic,
        _ => MotionLaw::Linear,
    };
    let policy =
        shape.map_or_else(|| stiffness_policy(remesh, law), |shape| shape.motion().map().setup().policy);
    policy.name().to_owned()
}

/// Inspects a configuration; every stage is reported to `progress` as it begins.
pub(super) fn summary<'a>(
    config: &'a Config,
    source: &SourceMap,
    overwrite: OverwritePolicy,
    progress: &mut dyn Progress,
) -> Result<Summary<'a>, Error> {
    let setup: Setup = set_up_watched(config, source, Mode::Inspection, None, progress)?;
    memory_limit::check_problem(&setup.problem, source, overwrite)?;
    let motions = morph::inspect(config, source)?;
    let mesh = &setup.full_mesh;
    let problem = &setup.problem;
    let moves = config.remesh.as_ref().zip(problem.shape());
    let skin = setup.audits.iter().map(SkinSummary::of).collect();
    let reference = problem.original().topology();
    let truncation = Truncation::of(config, &setup);
    let sent_back = truncation.as_ref().and_then(Truncation::sent_back);
    let warnings = setup.warnings.iter().cloned().chain(advice(config, &setup)).chain(sent_back).collect();
    Ok(Summary {
        title: &config.title,
        mesh_origin: config.mesh.generator().map_or("file", Generator::name),
        mesh_file: MeshFileSummary::of(&config.mesh),
        field_problem: field_problem(config),
        frequencies_hz: config.frequencies(),
        loads: &config.loads,
        order: config.analysis.order.into(),
        nodes: reference.node_count(),
        tets: reference.tets().len(),
        unknowns: problem.states().iter().map(|model| model.unknown_count()).sum(),
        elastic_equations: problem.shape().map_or(0, |shape| shape.motion().map().equation_count()),
        design_variables: problem.shape().map_or(0, |shape| shape.surface().variable_count()),
        filter_radius_m: problem.shape().and_then(|shape| shape.surface().filter_radius()),
        grid_sides: problem.shape().and_then(|shape| shape.surface().grid_sides()),
        mesh_motion: moves.map(|(remesh, shape)| motion_in_words(remesh, shape.motion())),
        stiffness: config.remesh.as_ref().map(|remesh| stiffness(remesh, problem.shape())),
        bounding_box_m: mesh.bounding_box(),
        regions: regions(config, mesh),
        materials: &config.materials,
        surfaces: surfaces(mesh)?,
        open_sides: open_sides(&setup),
        quality: quality(&setup),
        skin,
        motions,
        linear_solvers: problem.states().iter().map(FieldModel::method_name).collect(),
        coils: &config.coils,
        boundaries: &config.boundaries,
        open: config.open.as_ref(),
        truncation,
        objective: config.objective.as_ref(),
        objective_unit: config.objective.as_ref().and_then(Objective::si_unit),
        constraints: &config.constraints,
        initial_shape: ConstrainedShape::of(problem)?,
        design: config.design.as_ref(),
        reach: Reach::of(problem),
        remesh: config.remesh.as_ref(),
        optimizer: &config.optimizer,
        probes: &config.probes,
        multipoles: &config.multipoles,
        output_directory: config.output.directory.display().to_string(),
        memory_estimate_bytes: memory::peak(config, &setup)?,
        estimate: None,
        warnings,
    })
}

impl ConstrainedShape {
    fn of(problem: &Problem) -> Result<Self, Error> {
        let mut found = Self::default();
        let of_shape = |own: &&constraint::Constraint| !own.quantity.is_of_field();
        let mut constraints = problem.constraints().iter().filter(of_shape).peekable();
        let Some(shape) = problem.shape().filter(|_| constraints.peek().is_some()) else { return Ok(found) };
        let moved = problem.moved(shape.initial()).map_err(OptimizerError::from)?;
        for own in constraints {
            if let Quantity::Thickness { .. } = own.quantity {
                let range = |thickness: &WallThickness| thickness.range(&moved.mesh).into();
                found.constrained_thickness_m = shape.thickness().map(range);
            } else if let Some((value, _)) = own.of_shape(&moved, shape).map_err(OptimizerError::from)? {
                found.constrained_bodies.insert(own.name.clone(), value);
            }
        }
        Ok(found)
    }
}

impl MeshFileSummary {
    fn of(mesh: &MeshConfig) -> Option<Self> {
        let MeshConfig::File { path, unit } = mesh else { return None };
        Some(Self { path: path.display().to_string(), unit: unit.name() })
    }
}

/// With [morph] a field problem need not be there.
fn field_problem(config: &Config) -> FieldProblem {
    let is_given = !config.boundaries.is_empty() || !config.coils.is_empty() || config.objective.is_some();
    if config.morph.is_some() && !is_given { FieldProblem::None } else { FieldProblem::Given }
}

fn regions(config: &Config, mesh: &Mesh) -> Vec<RegionSummary> {
    let topology = mesh.topology();
    let empty = |name: &String| {
        let entry = config.regions.get(name);
        RegionSummary {
            name: name.clone(),
            tets: 0,
            volume_m3: 0.0,
            material: entry.map_or_else(|| "air".to_owned(), |region| region.material.clone()),
            model: entry.map_or(RegionModel::Volume, |region| region.model).name(),
        }
    };
    let mut regions: Vec<RegionSummary> = topology.region_names().iter().map(empty).collect();
    for e in topology.elements() {
        let region = &mut regions[topology.region_of()[e.index()].index()];
        region.tets += 1;
        region.volume_m3 += volume(mesh.vertices(e));
    }
    regions
}

fn surfaces(mesh: &Mesh) -> Result<Vec<SurfaceSummary>, Error> {
    let topology = mesh.topology();
    let of = |name: &str| {
        let triangles = topology.surface(name)?;
        let area = |t: &[NodeId; 3]| norm(area_vector(t.map(|n| mesh.point(n))));
        Ok(SurfaceSummary {
            name: name.to_owned(),
            triangles: triangles.len(),
            area_m2: triangles.iter().map(area).sum(),
        })
    };
    topology.surface_names().map(of).collect()
}

fn open_sides(setup: &Setup) -> Vec<OpenSideSummary> {
    let side = |patch: &OpenPatch| OpenSideSummary {
        region: setup.full_mesh.topology().region_names()[patch.region.index()].clone(),
        triangles: patch.faces.len(),
        area_m2: patch.area,
        at_m: patch.place,
    };
    setup.open_patches.iter().map(side).collect()
}

fn quality(setup: &Setup) -> QualitySummary {
    let problem = &setup.problem;
    let quality = problem.quality(problem.original());
    let [poor, fair, good] = quality.shares();
    QualitySummary {
        of: if problem.moving_elements().is_empty() { "mesh" } else { "remesh region" },
        worst: quality.worst,
        worst_element: quality.worst_element.0,
        worst_at_m: quality.worst_centroid,
        up_to_0_3: poor,
        from_0_3_to_0_6: fair,
        from_0_6: good,
    }
}
