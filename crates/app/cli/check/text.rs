//! What `check` found, for people: a block of lines with names in front, then tables.

use std::path::Path;

use fluxmorph_geometry::{Millimetres, Readable};
use fluxmorph_optimizer::design::GridSide;

use super::estimate::{ConstraintError, EstimateSummary};
use super::reach::Reach;
use super::summary::{FieldProblem, Summary};
use crate::config::{
    CoilShape, Constraint, Corner, DesignDirection, Limit, Material, Objective, RegionModel, RemeshExtent,
    ValueBound, WrittenCurve,
};
use crate::files::{SAFETY, shell_word};
use crate::show::text_table::{Align, Table};

/// Names stand in a column of this width: the longest is `design variables`.
const NAMES: usize = 18;

/// Everything, with the command to type next.
pub(super) fn text(summary: &Summary<'_>, config: &Path) -> String {
    let mut text = format!("{}\n\n", summary.title);
    let mut row = |name: &str, value: String| text += &format!("{name:<NAMES$}{value}\n");
    mesh(summary, &mut row);
    field(summary, &mut row);
    shape(summary, &mut row);
    row("memory, about", format!("{:.0} MiB", summary.memory_estimate_bytes as f64 / (1 << 20) as f64));
    row("output", summary.output_directory.clone());
    if let Some(found) = &summary.estimate {
        let unit = summary.objective.map(Objective::behind_value).unwrap_or_default();
        estimate(found, &unit, summary.constraints, &mut row);
    }
    text += &region_table(summary).text();
    text += &material_table(summary).text();
    text += &surface_table(summary).text();
    text += &open_table(summary).text();
    text += &coil_table(summary).text();
    text += &skin_table(summary).text();
    text += &motion_table(summary).text();
    let command = match (summary.motions.is_empty(), summary.objective.is_some() && summary.design.is_some())
    {
        (false, _) => "morph",
        (true, true) => "run",
        (true, false) => "solve",
    };
    let warnings = match summary.warnings.len() {
        0 => String::new(),
        1 => ", with 1 warning".to_owned(),
        count => format!(", with {count} warnings"),
    };
    text + &format!("\nok{warnings}; next: fluxmorph {command} {}\n", shell_word(config))
}

/// The objective of the initial design with its error bar, or why there is none.
fn estimate(
    found: &EstimateSummary,
    unit: &str,
    constraints: &[Constraint],
    row: &mut impl FnMut(&str, String),
) {
    if let (Some(value), Some(error), Some(bar)) =
        (found.objective, found.error_estimate, found.error_bar_relative)
    {
        let bar = 100.0 * bar;
        row(
            "initial design",
            format!("F = {value:.6e}{unit} ± {bar:.2} %, estimated error {error:+.1e}{unit}"),
        );
    }
    for ConstraintError { name, value, error_estimate } in &found.constraints {
        let own = constraints.iter().find(|own| own.is_called(name));
        let unit = own.map_or(String::new(), |own| own.limit.dimension().behind_value());
        let bar = SAFETY * error_estimate.abs();
        row(
            "initial design",
            format!(
                "{name} = {value:.6e}{unit} ± {bar:.1e}{unit}, estimated error {error_estimate:+.1e}{unit}"
            ),
        );
    }
    found.notices.iter().for_each(|notice| row("initial design", notice.clone()));
}

fn mesh(summary: &Summary<'_>, row: &mut impl FnMut(&str, String)) {
    match &summary.mesh_file {
        Some(file) => row("mesh file", format!("{}, coordinates in {}", file.path, file.unit)),
        None => row("mesh", format!("made by the generator {}", summary.mesh_origin)),
    }
    row("size", format!("{} nodes, {} tetrahedra", summary.nodes, summary.tets));
    let [lower, upper] = summary.bounding_box_m.map(millimetres);
    row("bounding box", format!("{lower} to {upper} mm"));
    let q = &summary.quality;
    let at = millimetres(q.worst_at_m);
    row("worst quality", format!("{:.4} in the {}: element {} at {at} mm", q.worst, q.of, q.worst_element));
    let [poor, fair, good] = [q.up_to_0_3, q.from_0_3_to_0_6, q.from_0_6].map(|share| 100.0 * share);
    row("shares of quality", format!("{poor:.1} % up to 0.3, {fair:.1} % to 0.6, {good:.1} % above"));
}

fn field(summary: &Summary<'_>, row: &mut impl FnMut(&str, String)) {
    if summary.field_problem == FieldProblem::None {
        row("field problem", "none: only the mesh moves".to_owned());
        return;
    }
    let frequencies: Vec<String> = summary.frequencies_hz.iter().map(|f| format!("{f} Hz")).collect();
    let rest = if summary.frequencies_hz == [0.0] { " (magnetostatic)" } else { "" };
    row("frequency", format!("{}{rest}", frequencies.join(", ")));
    if !summary.loads.is_empty() {
        row("loads", summary.loads.iter().map(|load| load.name.as_str()).collect::<Vec<_>>().join(", "));
    }
    row("unknowns", format!("{} of the field, elements of order {}", summary.unknowns, summary.order));
    let conditions = summary.boundaries;
    for (name, surfaces) in
        [("flux parallel", &conditions.flux_parallel), ("flux normal", &conditions.flux_normal)]
    {
        if !surfaces.is_empty() {
            row(name, surfaces.join(", "));
        }
    }
    if let Some(field) = &conditions.uniform_field {
        let [x, y, z] = field.b;
        row("uniform field", format!("({x}, {y}, {z}) T on {}", field.surfaces.join(", ")));
    }
    if let Some(open) = summary.open {
        let beyond = open.region.as_deref().map_or_else(|| open.surfaces().join(", "), str::to_owned);
        row("open space", format!("beyond {beyond}"));
    }
    if let Some(wall) = &summary.truncation {
        let (distance, size) = (millimetre(wall.distance_m), millimetre(wall.source_size_m));
        let times = wall.distance_m / wall.source_size_m;
        row(
            "nearest wall",
            format!(
                "{}: {distance} mm from coils, matter and what is observed, {times:.1} times their half \
                 diagonal {size} mm; [open] takes walls away",
                wall.named("")
            ),
        );
    }
    row("linear solver", summary.linear_solvers.join(", "));
    row("objective", objective(summary));
    for constraint in summary.constraints {
        row("constraint", format!("{}{}", bound_of(constraint), initially(constraint, summary)));
    }
    if !summary.probes.is_empty() {
        let probe = |p: &crate::config::Probe| format!("{} ({})", p.name, p.points.len());
        row("probes (points)", summary.probes.iter().map(probe).collect::<Vec<_>>().join(", "));
    }
    for set in summary.multipoles {
        let (radius, [x, y, z]) = (millimetre(set.radius), set.center.map(millimetre));
        let shape = set.shape.name();
        row(
            "expansion",
            format!("{}: {shape} of {radius} mm at ({x}, {y}, {z}) mm, up to order {}", set.name, set.order),
        );
    }
}

/// The objective in a line: its goal, its terms and its unit.
fn objective(summary: &Summary<'_>) -> String {
    let Some(objective) = summary.objective else { return "none".to_owned() };
    let goal = objective.goal_word();
    let term = |term: &crate::config::Term| {
        let weight = if term.weight == 1.0 { String::new() } else { format!("{} x ", term.weight) };
        let region = term.functional.region.as_deref().map(|region| format!(" in {region}"));
        let at = match (term.functional.frequency, &term.functional.load) {
            (_, Some(load)) => format!(" under {load}"),
            (frequency, None) => frequency.map(|f| format!(" at {f} Hz")).unwrap_or_default(),
        };
        format!("{weight}{}{}{at}", term.functional.kind.name(), region.unwrap_or_default())
    };
    let terms: Vec<String> = objective.terms().iter().map(term).collect();
    let unit = summary.objective_unit.map(|unit| format!(" [{unit}]")).unwrap_or_default();
    match objective.worst() {
        None => format!("{goal} {}{unit}", terms.join(" + ")),
        Some(worst) => format!("{goal} {worst} of {}{unit}", terms.join(", ")),
    }
}

fn shape(summary: &Summary<'_>, row: &mut impl FnMut(&str, String)) {
    if let Some(design) = summary.design {
        let side = |side: GridSide| format!("{} along {}", side.count, side.axis_name());
        let grid = summary
            .grid_sides
            .map(|sides| format!(", grid {}", sides.map(side).join(", ")))
            .unwrap_or_default();
        let filter =
            summary.filter_radius_m.map(|radius| format!(", filtered over {} mm", millimetre(radius)));
        let (surfaces, smoothed) = (design.surface.join(", "), filter.unwrap_or(grid));
        row("design variables", format!("{} on {surfaces}{smoothed}", summary.design_variables));
        let way = match design.direction {
            DesignDirection::Vector([x, y, z]) => format!("along ({}, {}, {})", x + 0.0, y + 0.0, z + 0.0),
            DesignDirection::Word(word) => format!("along the {}", word.name()),
        };
        row("bounds", format!("{} to {} mm {way}", millimetre(design.lower), millimetre(design.upper)));
    }
    for Reach { bound, share, cause } in &summary.reach {
        if let Some(cause) = cause {
            let (share, decimals) = (100.0 * share, usize::from(*share < 0.1));
            row(
                &format!("{bound} bound"),
                format!("the mesh follows all variables for {share:.decimals$} % of the way there: {cause}"),
            );
        }
    }
    if let Some(remesh) = summary.remesh {
        let body = match &remesh.extent {
            RemeshExtent::Regions(names) => names.join(", "),
            RemeshExtent::Box([lower, upper]) => {
                format!("all in {} to {} mm", millimetres(*lower), millimetres(*upper))
            }
        };
        let equations = match summary.elastic_equations {
            0 => String::new(),
            count => format!(": {count} equations"),
        };
        let stiffness = summary.stiffness.as_ref().map_or(String::new(), |own| format!(", stiffness {own}"));
        row("mesh motion", format!("{body}{stiffness}{equations}"));
    }
    if let Some(motion) = &summary.mesh_motion {
        row("law of motion", motion.clone());
    }
    if summary.design.is_some() && summary.objective.is_some() {
        let optimizer = summary.optimizer;
        let time = optimizer.max_time.map(|seconds| format!(" or {seconds} s")).unwrap_or_default();
        let most = optimizer.max_evaluations;
        row("optimiser", format!("{}, at most {most} evaluations{time}", optimizer.algorithm.name()));
    }
}

/// What a constraint of the shape is measured by has at the initial design, behind its bound.
fn initially(constraint: &Constraint, summary: &Summary<'_>) -> String {
    let text = match constraint.limit {
        Limit::Thickness { .. } => summary
            .initial_shape
            .constrained_thickness_m
            .map(|[least, most]| format!("{:.3} to {:.3} mm", Millimetres(least), Millimetres(most))),
        Limit::Functional { .. } => summary
            .initial_shape
            .constrained_bodies
            .get(&constraint.name)
            .map(|value| format!("{value:.4e}{}", constraint.limit.dimension().behind_value())),
    };
    text.map_or(String::new(), |text| format!(", {text} initially"))
}

/// A constraint in words.
fn bound_of(constraint: &Constraint) -> String {
    let unit = constraint.limit.dimension().behind_value();
    let value = |bound: &ValueBound| match bound {
        ValueBound::AtMost(upper) => format!("at most {upper:e}{unit}"),
        ValueBound::AtMostRatio(ratio) => format!("at most {ratio} times that of the initial design"),
        ValueBound::AtLeast(lower) => format!("at least {lower:e}{unit}"),
        ValueBound::AtLeastRatio(ratio) => format!("at least {ratio} times that of the initial design"),
    };
    let bounds = match &constraint.limit {
        Limit::Functional { bound, .. } => value(bound),
        Limit::Thickness { minimum, maximum, .. } => {
            let side =
                |word: &str, value: &Option<f64>| value.map(|t| format!("{word} {} mm", millimetre(t)));
            let sides = [side("at least", minimum), side("at most", maximum)];
            sides.into_iter().flatten().collect::<Vec<_>>().join(", ")
        }
    };
    format!("{} {bounds}", constraint.name)
}

fn region_table(summary: &Summary<'_>) -> Table<5> {
    use Align::{Left, Right};
    let columns =
        [("region", Left), ("tets", Right), ("volume cm³", Right), ("material", Left), ("model", Left)];
    let rows = summary.regions.iter().map(|r| {
        let volume = format_number(r.volume_m3 * 1e6);
        [r.name.clone(), r.tets.to_string(), volume, r.material.clone(), r.model.to_owned()]
    });
    Table::new(columns, rows)
}

fn material_table(summary: &Summary<'_>) -> Table<4> {
    use Align::{Left, Right};
    let columns =
        [("material", Left), ("permeability", Left), ("conductivity S/m", Right), ("density kg/m³", Right)];
    let rows = summary.materials.iter().map(|(name, material)| {
        let density = material.density.map_or_else(String::new, |density| density.to_string());
        [name.clone(), permeability(material), material.conductivity.to_string(), density]
    });
    Table::new(columns, rows)
}

/// The law of a material: its relative permeability, or what its curve is.
fn permeability(material: &Material) -> String {
    let relative = material.relative_permeability;
    match (&material.bh, &material.bh_file, material.saturation) {
        (Some(WrittenCurve::Named(steel)), ..) => format!("B-H curve {}", steel.name()),
        (Some(WrittenCurve::Points(points)), ..) => {
            let [_, last] = points.last().copied().unwrap_or_default();
            format!("B-H curve of {} points, to {last} T", points.len())
        }
        (None, Some(path), _) => format!("B-H curve of {}", path.display()),
        (None, None, Some(saturation)) => format!("{relative}, saturated at {saturation} T"),
        (None, None, None) => relative.to_string(),
    }
}

fn surface_table(summary: &Summary<'_>) -> Table<3> {
    let surfaces = summary.surfaces.iter();
    let rows = surfaces.map(|s| [s.name.clone(), s.triangles.to_string(), format_number(s.area_m2 * 1e4)]);
    Table::of_numbers(["surface", "triangles", "area cm²"], rows)
}

/// Most sides without condition that are listed: those of a box, and as many again.
const MOST_SIDES: usize = 12;

fn open_table(summary: &Summary<'_>) -> Table<4> {
    use Align::{Left, Right};
    let columns =
        [("no condition, field normal", Left), ("triangles", Right), ("area cm²", Right), ("at mm", Left)];
    let rows = summary.open_sides.iter().take(MOST_SIDES).map(|side| {
        let area = format_number(side.area_m2 * 1e4);
        [side.region.clone(), side.triangles.to_string(), area, millimetres(side.at_m)]
    });
    Table::new(columns, rows)
}

fn coil_table(summary: &Summary<'_>) -> Table<4> {
    use Align::{Left, Right};
    let columns = [("coil", Left), ("ampere-turns A", Right), ("phase deg", Right), ("shape", Left)];
    let rows = summary.coils.iter().map(|coil| {
        let at = |center: [f64; 3]| format!("centre {} mm", millimetres(center));
        let window = |[a, b]: [f64; 2]| format!("window 2 x {} by 2 x {} mm", millimetre(a), millimetre(b));
        let section =
            |width: f64, height: f64| format!("section {} x {} mm", millimetre(width), millimetre(height));
        let shape = match &coil.shape {
            CoilShape::Racetrack(c) => {
                let name = match c.corner {
                    Corner::Sharp(_) => "rectangular",
                    Corner::Round(_) => "racetrack",
                };
                format!("{name}, {}, {}, {}", window(c.half_window), section(c.width, c.height), at(c.center))
            }
            CoilShape::Circular(c) => {
                let radius = millimetre(c.radius);
                format!(
                    "circular, inner radius {radius} mm, {}, {}",
                    section(c.width, c.height),
                    at(c.center)
                )
            }
            CoilShape::Region(c) if coil.is_solid() => format!("solid conductor, region {}", c.region),
            CoilShape::Region(c) => format!("region {}", c.region),
        };
        let phase = format!("{}", (coil.phase.to_degrees() * 1e6).round() / 1e6 + 0.0);
        [
            coil.name.clone(),
            match (coil.ampere_turns, coil.voltage) {
                (Some(current), _) => current.to_string(),
                (None, voltage) => format!("{} V", voltage.unwrap_or_default()),
            },
            phase,
            shape,
        ]
    });
    Table::new(columns, rows)
}

fn skin_table(summary: &Summary<'_>) -> Table<5> {
    use Align::{Left, Right};
    let columns = [
        ("conductor", Left),
        ("model", Left),
        ("skin depth mm", Right),
        ("elements per depth", Right),
        ("2V/S in depths", Right),
    ];
    let has_several = summary.skin.iter().any(|s| s.frequency_hz != summary.skin[0].frequency_hz);
    let rows = summary.skin.iter().map(|s| {
        let conductor = match has_several {
            true => format!("{} at {} Hz", s.region, Readable(s.frequency_hz)),
            false => s.region.clone(),
        };
        let elements = if s.model == RegionModel::Volume.name() {
            format!("{:.2} (least {:.2})", s.median_elements_per_skin_depth, s.least_elements_per_skin_depth)
        } else {
            "none inside".to_owned()
        };
        let unsaturated = if s.largest_permeability.is_some() { " unsaturated" } else { "" };
        let depth = format!("{:.3}{unsaturated}", Millimetres(s.skin_depth_m));
        let thickness = format!("{:.1}", s.thickness_in_skin_depths);
        [conductor, s.model.to_owned(), depth, elements, thickness]
    });
    Table::new(columns, rows)
}

fn motion_table(summary: &Summary<'_>) -> Table<5> {
    let names = ["motion", "moved nodes", "largest mm", "elements of body", "equations"];
    let rows = summary.motions.iter().map(|m| {
        let largest = format!("{:.3}", Millimetres(m.largest_displacement_m));
        let [nodes, elements, equations] = [m.moved_nodes, m.elements, m.equations].map(|n| n.to_string());
        [m.name.clone(), nodes, largest, elements, equations]
    });
    Table::of_numbers(names, rows)
}

/// A length to a micrometre [mm].
fn millimetre(length: f64) -> f64 {
    (length * 1e6).round() / 1e3 + 0.0
}

fn millimetres(point: [f64; 3]) -> String {
    let [x, y, z] = point.map(millimetre);
    format!("({x}, {y}, {z})")
}

/// Four decimals, five digits of what is small, and no more digits than a sum of element volumes has.
fn format_number(value: f64) -> String {
    match value.abs() {
        1e9.. => format!("{value:.6e}"),
        0.0 | 0.01.. => format!("{value:.4}"),
        _ => format!("{value:.4e}"),
    }
}
