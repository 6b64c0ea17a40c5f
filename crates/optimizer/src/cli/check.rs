//! `fluxmorph check`: what a configuration means, without solving.

use fluxmorph_geometry::tet4::volume;
use serde::Serialize;

use super::args::CheckArgs;
use super::exit::ExitCode;
use super::{stdout, with_threads};
use crate::config::{Config, MeshConfig, RegionModel, Source};
use crate::error::Error;
use crate::memory_limit;
use crate::morph::{self, MotionSummary};
use crate::output::OlderRun;
use crate::setup::{Purpose, Setup, set_up};

/// Set the problem up and print what it is, as a table or JSON.
///
/// # Errors
/// When the configuration or the mesh is wrong, or standard output cannot be written to.
pub(super) fn check(args: &CheckArgs) -> Result<ExitCode, Error> {
    let (config, source) = args.common.load()?;
    with_threads(args.common.threads, |_| {
        let summary = summary(&config, &source, args.common.older_run())?;
        if args.common.json {
            stdout::print_json(&summary)?;
        } else {
            stdout::print(&table(&summary))?;
        }
        Ok(ExitCode::Success)
    })
}

/// What `check` found.
#[derive(Debug, Serialize)]
struct Summary {
    title: String,
    /// The file of the mesh and the unit of its coordinates; `None` for a generated mesh.
    mesh_file: Option<MeshFileSummary>,
    nodes: usize,
    tets: usize,
    unknowns: usize,
    elastic_equations: usize,
    design_variables: usize,
    bounding_box_m: [[f64; 3]; 2],
    regions: Vec<RegionSummary>,
    surfaces: Vec<SurfaceSummary>,
    quality: QualitySummary,
    skin: Vec<SkinSummary>,
    motions: Vec<MotionSummary>,
    /// The method of each state's linear solver.
    linear_solvers: Vec<&'static str>,
    memory_estimate_bytes: usize,
    warnings: Vec<String>,
}

/// The file that the mesh was read from.
#[derive(Debug, Serialize)]
struct MeshFileSummary {
    path: String,
    unit: &'static str,
}

/// One region of the mesh.
#[derive(Debug, Serialize)]
struct RegionSummary {
    name: String,
    tets: usize,
    volume_m3: f64,
    material: String,
    model: &'static str,
}

/// One named surface.
#[derive(Debug, Serialize)]
struct SurfaceSummary {
    name: String,
    triangles: usize,
    area_m2: f64,
}

/// Quality of the elements that may move, or of all.
#[derive(Debug, Serialize)]
struct QualitySummary {
    of: &'static str,
    worst: f64,
    worst_element: u32,
    worst_at_m: [f64; 3],
    up_to_0_3: f64,
    from_0_3_to_0_6: f64,
    from_0_6: f64,
}

/// One conductor.
#[derive(Debug, Serialize)]
struct SkinSummary {
    region: String,
    model: &'static str,
    skin_depth_m: f64,
    median_elements_per_skin_depth: f64,
    least_elements_per_skin_depth: f64,
    thickness_in_skin_depths: f64,
}

fn model_name(model: RegionModel) -> &'static str {
    match model {
        RegionModel::Volume => "volume",
        RegionModel::Impedance => "impedance",
    }
}

fn summary(config: &Config, source: &Source, older: OlderRun) -> Result<Summary, Error> {
    let setup: Setup = set_up(config, source, Purpose::Inspection)?;
    memory_limit::check_problem(setup.problem.memory_estimate(), source, older)?;
    let motions = morph::inspected(config, source)?;
    let mesh = &setup.full_mesh;
    let topology = mesh.topology();
    let mut regions: Vec<RegionSummary> = topology
        .region_names()
        .iter()
        .map(|name| {
            let entry = config.regions.get(name);
            RegionSummary {
                name: name.clone(),
                tets: 0,
                volume_m3: 0.0,
                material: entry.map_or_else(|| "air".to_owned(), |region| region.material.clone()),
                model: entry.map_or("volume", |region| model_name(region.model)),
            }
        })
        .collect();
    for e in topology.elements() {
        let region = &mut regions[topology.region_of()[e.index()].index()];
        region.tets += 1;
        region.volume_m3 += volume(mesh.vertices(e));
    }
    let surfaces = topology
        .surface_names()
        .map(|name| {
            let triangles = topology.surface(name)?;
            let area = |t: &[fluxmorph_geometry::NodeId; 3]| {
                fluxmorph_geometry::tet4::norm(fluxmorph_geometry::tet4::area_vector(
                    t.map(|n| mesh.point(n)),
                ))
            };
            Ok(SurfaceSummary {
                name: name.to_owned(),
                triangles: triangles.len(),
                area_m2: triangles.iter().map(area).sum(),
            })
        })
        .collect::<Result<_, Error>>()?;
    let problem = &setup.problem;
    let quality = problem.quality(&problem.original);
    let [poor, fair, good] = quality.shares();
    let skin = setup
        .audits
        .iter()
        .map(|audited| SkinSummary {
            region: audited.audit.region.clone(),
            model: model_name(audited.model),
            skin_depth_m: audited.audit.skin_depth,
            median_elements_per_skin_depth: audited.audit.median_elements_per_skin_depth,
            least_elements_per_skin_depth: audited.audit.least_elements_per_skin_depth,
            thickness_in_skin_depths: audited.audit.thickness_in_skin_depths,
        })
        .collect();
    let reference = problem.original.topology();
    Ok(Summary {
        title: config.title.clone(),
        mesh_file: match &config.mesh {
            MeshConfig::File { path, unit } => {
                Some(MeshFileSummary { path: path.display().to_string(), unit: unit.name() })
            }
            _ => None,
        },
        nodes: reference.node_count(),
        tets: reference.tets().len(),
        unknowns: problem.states.iter().map(|model| model.unknown_count()).sum(),
        elastic_equations: problem.shape.as_ref().map_or(0, |shape| shape.motion.map().equation_count()),
        design_variables: problem.shape.as_ref().map_or(0, |shape| shape.surface.variable_count()),
        bounding_box_m: mesh.bounding_box(),
        regions,
        surfaces,
        quality: QualitySummary {
            of: if problem.moving_elements().is_empty() { "mesh" } else { "remesh region" },
            worst: quality.worst,
            worst_element: quality.worst_element.0,
            worst_at_m: quality.worst_centroid,
            up_to_0_3: poor,
            from_0_3_to_0_6: fair,
            from_0_6: good,
        },
        skin,
        motions,
        linear_solvers: problem.states.iter().map(|model| model.linear_solver().method().name()).collect(),
        memory_estimate_bytes: problem.memory_estimate(),
        warnings: setup.warnings,
    })
}

fn table(summary: &Summary) -> String {
    let millimetres = |p: [f64; 3]| format!("{:.1} {:.1} {:.1}", p[0] * 1e3, p[1] * 1e3, p[2] * 1e3);
    let mut text = format!("{}\n\n", summary.title);
    let mut row = |name: &str, value: String| text += &format!("{name:<22}{value}\n");
    if let Some(file) = &summary.mesh_file {
        row("mesh file", format!("{}, coordinates in {}", file.path, file.unit));
    }
    row("nodes", summary.nodes.to_string());
    row("tetrahedra", summary.tets.to_string());
    row("unknowns", format!("{} (field), {} (elastic)", summary.unknowns, summary.elastic_equations));
    row("design variables", summary.design_variables.to_string());
    let [lower, upper] = summary.bounding_box_m;
    row("bounding box", format!("{} to {} mm", millimetres(lower), millimetres(upper)));
    let q = &summary.quality;
    row(
        "worst quality",
        format!(
            "{:.4} in the {}: element {} at {} mm",
            q.worst,
            q.of,
            q.worst_element,
            millimetres(q.worst_at_m)
        ),
    );
    row(
        "shares of quality",
        format!(
            "{:.1} % up to 0.3, {:.1} % to 0.6, {:.1} % above",
            q.up_to_0_3 * 100.0,
            q.from_0_3_to_0_6 * 100.0,
            q.from_0_6 * 100.0
        ),
    );
    if !summary.linear_solvers.is_empty() {
        row("linear solver", summary.linear_solvers.join(", "));
    }
    row("memory, about", format!("{:.0} MiB", summary.memory_estimate_bytes as f64 / (1 << 20) as f64));
    text += &format!("\n{:<18}{:>10}{:>14}  {:<16}{}\n", "region", "tets", "volume cm³", "material", "model");
    for r in &summary.regions {
        text += &format!(
            "{:<18}{:>10}{:>14.4}  {:<16}{}\n",
            r.name,
            r.tets,
            r.volume_m3 * 1e6,
            r.material,
            r.model
        );
    }
    text += &format!("\n{:<18}{:>10}{:>14}\n", "surface", "triangles", "area cm²");
    for s in &summary.surfaces {
        text += &format!("{:<18}{:>10}{:>14.4}\n", s.name, s.triangles, s.area_m2 * 1e4);
    }
    if !summary.skin.is_empty() {
        text += &format!(
            "\n{:<18}{:<12}{:>14}{:>24}{:>22}\n",
            "conductor", "model", "skin depth mm", "elements per depth", "2V/S in depths"
        );
    }
    for s in &summary.skin {
        text += &format!(
            "{:<18}{:<12}{:>14.3}{:>24}{:>22.1}\n",
            s.region,
            s.model,
            s.skin_depth_m * 1e3,
            format!("{:.2} (least {:.2})", s.median_elements_per_skin_depth, s.least_elements_per_skin_depth),
            s.thickness_in_skin_depths
        );
    }
    if !summary.motions.is_empty() {
        text += &format!(
            "\n{:<18}{:>12}{:>14}{:>18}{:>12}\n",
            "motion", "moved nodes", "largest mm", "elements of body", "equations"
        );
    }
    for m in &summary.motions {
        text += &format!(
            "{:<18}{:>12}{:>14.3}{:>18}{:>12}\n",
            m.name,
            m.moved_nodes,
            m.largest_displacement_m * 1e3,
            m.elements,
            m.equations
        );
    }
    for warning in &summary.warnings {
        text += &format!("\nwarning: {warning}\n");
    }
    text
}
