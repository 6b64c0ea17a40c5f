//! Tables of the page: evaluations, constraints, terms, losses, probes, skin depths, mesh, provenance.

use std::path::Path;

use super::data::RunData;
use super::html::Html;
use super::paper;
use super::ticks::{duration, grouped, number, trimmed};
use crate::config::RegionModel;
use crate::observer::Evaluation;
use crate::output::{ProbeResult, RunResult, shell_word};
use crate::setup::Outline;

/// Rows of a table that is shown at once; a longer one is opened by the reader.
const SHOWN: usize = 12;

/// Points of probes that a table holds.
const MOST_POINTS: usize = 200;

/// Evaluations that a table holds: the first and the last of so many.
const MOST_ROWS: usize = 800;

/// A table in a box of its own, which scrolls where the page is narrower.
fn table(html: &mut Html, head: &[&str], rows: &[Vec<String>], marked: Option<usize>) {
    let shown = rows.len().min(MOST_ROWS);
    if shown < rows.len() {
        let text = format!("The first {shown} of {} rows; result.json has all.", rows.len());
        html.leaf("p", &[("class", "note")], &text);
    }
    let rows = &rows[..shown];
    html.element("div", &[("class", "scroll"), ("tabindex", "0")], |html| {
        html.element("table", &[], |html| {
            html.element("thead", &[], |html| {
                html.element("tr", &[], |html| {
                    head.iter().for_each(|cell| html.leaf("th", &[("scope", "col")], cell))
                });
            });
            html.element("tbody", &[], |html| {
                for (i, row) in rows.iter().enumerate() {
                    let class: &[_] = if marked == Some(i) { &[("class", "marked")] } else { &[] };
                    html.element("tr", class, |html| row.iter().for_each(|cell| html.leaf("td", &[], cell)));
                }
            });
        });
    });
}

/// Names and values.
fn pairs(html: &mut Html, rows: &[(String, String)]) {
    html.element("dl", &[], |html| {
        for (name, value) in rows {
            html.element("div", &[], |html| {
                html.leaf("dt", &[], name);
                html.leaf("dd", &[], value);
            });
        }
    });
}

/// The rows of the history.
pub(super) fn evaluations(html: &mut Html, data: &RunData) {
    let rows = &data.history;
    let constraints: Vec<&String> =
        rows.first().map(|row| row.constraints.keys().collect()).unwrap_or_default();
    let mut head =
        vec!["evaluation", "iteration", "F", "F / F₀", "‖dF/dp‖ [F/m]", "step [mm]", "worst quality"];
    let has_thickness = rows.iter().any(|row| row.min_thickness_m.is_some());
    if has_thickness {
        head.push("thickness [mm]");
    }
    head.extend(["inversion at", "solver iterations", "round", "time [s]"]);
    let names: Vec<String> =
        constraints.iter().map(|c| c.strip_prefix("c_").unwrap_or(c).to_owned()).collect();
    head.extend(names.iter().map(String::as_str));
    let cells = |row: &Evaluation| {
        let mut cells = vec![
            row.evaluation.to_string(),
            row.iteration.to_string(),
            number(row.objective, 6),
            number(row.ratio, 4),
            number(row.gradient_norm, 3),
            number(1e3 * row.step_norm, 3),
            number(row.worst_quality, 3),
        ];
        if has_thickness {
            let thickness = row.min_thickness_m.zip(row.max_thickness_m);
            cells.push(thickness.map_or(String::new(), |(low, high)| {
                format!("{}–{}", trimmed(1e3 * low, 2), trimmed(1e3 * high, 2))
            }));
        }
        cells.push(row.step_to_inversion.map_or("never".to_owned(), |step| format!("{} ×", number(step, 3))));
        cells.extend([row.linear_iterations.to_string(), row.round.to_string(), number(row.seconds, 3)]);
        cells.extend(
            constraints.iter().map(|c| row.constraints.get(*c).map_or(String::new(), |v| number(*v, 3))),
        );
        cells
    };
    let kept: Vec<&Evaluation> = if rows.len() > MOST_ROWS {
        rows[..MOST_ROWS / 2].iter().chain(&rows[rows.len() - MOST_ROWS / 2..]).collect()
    } else {
        rows.iter().collect()
    };
    let marked = kept.iter().position(|row| Some(row.evaluation) == data.best);
    let body: Vec<Vec<String>> = kept.iter().map(|row| cells(row)).collect();
    let left_out = rows.len() - kept.len();
    if left_out > 0 {
        let text = format!("{left_out} rows in the middle are left out here; history.csv has all.");
        html.leaf("p", &[("class", "note")], &text);
    }
    if body.len() <= SHOWN {
        table(html, &head, &body, marked);
    } else {
        html.element("details", &[], |html| {
            html.leaf("summary", &[], &format!("All {} evaluations", rows.len()));
            table(html, &head, &body, marked);
        });
    }
    html.leaf(
        "p",
        &[("class", "note")],
        "The best design is marked. An iteration is an evaluation that improves on all before; “inversion at” is the multiple \
         of the motion from the round's reference mesh at which the first element would invert.",
    );
}

/// Constraints and terms of the objective, losses and probes: what the result says beside the objective.
pub(super) fn outcome(html: &mut Html, data: &RunData, result: &RunResult) {
    if !result.constraints.is_empty() {
        html.leaf("h3", &[], "Constraints at the best design");
        let row = |c: &crate::output::ConstraintResult| {
            let kept = if c.satisfied { "kept" } else { "broken" };
            vec![c.name.clone(), number(c.value, 5), number(c.bound, 5), kept.to_owned()]
        };
        let rows: Vec<Vec<String>> = result.constraints.iter().map(row).collect();
        table(html, &["constraint", "value [SI]", "bound [SI]", ""], &rows, None);
    }
    if let Some(objective) = result.objective.as_ref().filter(|objective| !objective.terms.is_empty()) {
        html.leaf("h3", &[], "Terms of the objective at the best design");
        let row = |t: &crate::output::TermResult| {
            vec![
                t.kind.replace('_', " "),
                t.region.clone().unwrap_or_else(|| "whole mesh".to_owned()),
                t.frequency.map_or("all".to_owned(), |f| format!("{} Hz", trimmed(f, 6))),
                trimmed(t.weight, 6),
                number(t.value, 6),
                number(t.weight * t.value, 6),
            ]
        };
        let rows: Vec<Vec<String>> = objective.terms.iter().map(row).collect();
        table(html, &["term", "region", "frequency", "weight", "value [SI]", "weighted"], &rows, None);
    }
    let states: Vec<(f64, &std::collections::BTreeMap<String, f64>, &[ProbeResult])> =
        if result.states.is_empty() {
            let frequency =
                result.frequencies_hz.first().copied().unwrap_or(data.config.analysis.frequency());
            vec![(frequency, &result.losses_w, &result.probes)]
        } else {
            result.states.iter().map(|s| (s.frequency_hz, &s.losses_w, s.probes.as_slice())).collect()
        };
    let losses: Vec<Vec<String>> = states
        .iter()
        .flat_map(|(f, losses, _)| {
            losses.iter().map(|(region, loss)| {
                vec![region.clone(), format!("{} Hz", trimmed(*f, 6)), number(*loss, 5)]
            })
        })
        .collect();
    if !losses.is_empty() {
        html.leaf("h3", &[], "Eddy-current losses of the part that is modelled");
        table(html, &["region", "frequency", "loss [W]"], &losses, None);
    }
    let mut probes: Vec<Vec<String>> =
        states.iter().flat_map(|(f, _, probes)| probes.iter().flat_map(|probe| rows_of(*f, probe))).collect();
    if !probes.is_empty() {
        html.leaf("h3", &[], "Flux density at the probes, best design");
        if probes.len() > MOST_POINTS {
            html.leaf(
                "p",
                &[("class", "note")],
                &format!("The first {MOST_POINTS} of {} points.", probes.len()),
            );
            probes.truncate(MOST_POINTS);
        }
        let head = ["probe", "x, y, z [mm]", "frequency", "|B| [mT]", "Bx [mT]", "By [mT]", "Bz [mT]"];
        table(html, &head, &probes, None);
    }
}

/// The rows of one probe.
fn rows_of(frequency: f64, probe: &ProbeResult) -> Vec<Vec<String>> {
    // A file may be cut short.
    let count = probe.points_m.len().min(probe.b_re_t.len()).min(probe.b_im_t.len());
    let row = |k: usize| {
        let (point, re, im) = (probe.points_m[k], probe.b_re_t[k], probe.b_im_t[k]);
        let place = point.map(|c| trimmed(1e3 * c, 2)).join(", ");
        let mut cells = vec![probe.name.clone(), place, format!("{} Hz", trimmed(frequency, 6))];
        match (re, im) {
            (Some(re), Some(im)) => {
                let size = re.iter().chain(&im).map(|c| c * c).sum::<f64>().sqrt();
                cells.push(number(1e3 * size, 4));
                for d in 0..3 {
                    let real = number(1e3 * re[d], 3);
                    cells.push(if frequency == 0.0 {
                        real
                    } else {
                        let sign = if im[d] < 0.0 { "−" } else { "+" };
                        format!("{real} {sign} {} j", number(1e3 * im[d].abs(), 3))
                    });
                }
            }
            _ => cells.extend([
                "outside the moved mesh".to_owned(),
                String::new(),
                String::new(),
                String::new(),
            ]),
        }
        cells
    };
    (0..count).map(row).collect()
}

/// The comparison with the paper; nothing for other cases.
pub(super) fn paper_rows(html: &mut Html, rows: &[paper::Row]) {
    let rows: Vec<Vec<String>> = rows.iter().map(|row| row.to_vec()).collect();
    table(html, &["", "paper", "this run", "remark"], &rows, None);
}

/// The skin-depth audit.
pub(super) fn skin(html: &mut Html, outline: &Outline) {
    if outline.audits.is_empty() {
        html.leaf(
            "p",
            &[],
            "No region conducts at a frequency above zero: there are no skin depths to resolve.",
        );
        return;
    }
    let row = |audited: &crate::setup::Audited| {
        let a = &audited.audit;
        vec![
            a.region.clone(),
            match audited.model {
                RegionModel::Volume => "meshed",
                RegionModel::Impedance => "surface impedance",
            }
            .to_owned(),
            number(1e3 * a.skin_depth, 3),
            format!(
                "{} (least {})",
                number(a.median_elements_per_skin_depth, 3),
                number(a.least_elements_per_skin_depth, 3)
            ),
            number(a.thickness_in_skin_depths, 3),
        ]
    };
    let rows: Vec<Vec<String>> = outline.audits.iter().map(row).collect();
    let head =
        ["conductor", "model", "skin depth [mm]", "elements per skin depth", "thickness 2V/S [skin depths]"];
    table(html, &head, &rows, None);
    let warnings: Vec<String> = outline.audits.iter().filter_map(|a| a.warning()).collect();
    if warnings.is_empty() {
        html.leaf("p", &[("class", "note")], "The audit has no objections.");
    }
    for warning in warnings {
        html.leaf("p", &[("class", "warning")], &warning);
    }
}

/// Mesh and linear systems.
pub(super) fn mesh(html: &mut Html, data: &RunData) {
    let mut rows: Vec<(String, String)> = Vec::new();
    let mut add = |name: &str, value: String| rows.push((name.to_owned(), value));
    if let Some(mesh) = &data.manifest.mesh {
        add(
            "mesh with all regions",
            format!("{} nodes, {} tetrahedra", grouped(mesh.nodes), grouped(mesh.tets)),
        );
    }
    if let Some(result) = &data.result {
        let mesh = &result.mesh;
        let what = format!("{} nodes, {} tetrahedra", grouped(mesh.nodes), grouped(mesh.tets));
        add("mesh that is solved on", what);
        add("unknowns", grouped(mesh.unknowns));
        let quality = [mesh.worst_quality_initial, mesh.worst_quality_final].map(|q| number(q, 3));
        add("worst quality", if data.is_run() { quality.join(" → ") } else { quality[1].clone() });
        add("linear solver", result.linear_solver.methods.join(", "));
        add("largest relative residual", number(result.linear_solver.worst_residual, 2));
    }
    let order = if u8::from(data.config.analysis.order) == 1 { "linear" } else { "quadratic" };
    add(
        "elements",
        format!("{order} tetrahedra, nodal A–ψ, ν_p/ν = {}", trimmed(data.config.analysis.penalty, 4)),
    );
    if let Ok(outline) = &data.outline {
        let [low, high] = outline.full_mesh.bounding_box().map(|p| p.map(|c| trimmed(1e3 * c, 1)).join(", "));
        add("bounding box", format!("({low}) to ({high}) mm"));
        if let Some(design) = &outline.design {
            let surface = design.surface.nodes().len();
            add(
                "design surface",
                format!("{} nodes, {} triangles", grouped(surface), grouped(design.triangles.len())),
            );
            add("elements that may move", grouped(design.moving.len()));
        }
    }
    pairs(html, &rows);
}

/// Where the run comes from.
pub(super) fn provenance(html: &mut Html, data: &RunData) {
    let manifest = &data.manifest;
    let mut rows: Vec<(String, String)> = Vec::new();
    let mut add = |name: &str, value: String| rows.push((name.to_owned(), value));
    add("program", format!("fluxmorph {}", manifest.version));
    let given = manifest.config.as_ref().map(|config| config.path.clone()).unwrap_or_default();
    let mut command = format!("fluxmorph {} {}", manifest.command, shell_word(Path::new(&given)));
    for overlay in &manifest.overrides {
        command += &format!(" --set {}", shell_word(Path::new(overlay.trim())));
    }
    add("command", command);
    if let Some(limits) = &manifest.limits {
        let mut text = format!("{} evaluations", limits.max_evaluations);
        if let Some(seconds) = limits.max_time_s {
            text += &format!(", {}", duration(seconds));
        }
        add("limits", text);
    }
    if let Some(config) = &manifest.config {
        add("configuration, BLAKE3", config.blake3.clone());
    }
    if let Some(mesh) = &manifest.mesh {
        add("mesh", mesh.origin.clone());
        add("mesh, BLAKE3", mesh.blake3.clone());
    }
    let host = &manifest.host;
    add(
        "machine",
        format!("{}, {} {}, {} threads used", host.name, host.system, host.architecture, manifest.threads),
    );
    add("started", manifest.started.clone());
    for resumption in &manifest.resumed {
        let text = format!(
            "{} on {}, behind {} evaluations, {} threads",
            resumption.at, resumption.host.name, resumption.evaluations, resumption.threads
        );
        add("resumed", text);
    }
    if let Some(finished) = &manifest.finished {
        add("finished", finished.clone());
    }
    if let Some(result) = &data.result {
        let parts: Vec<String> = result
            .timings_s
            .iter()
            .filter(|(part, _)| *part != "total")
            .map(|(part, seconds)| format!("{} {} s", part.replace('_', " "), number(*seconds, 2)))
            .collect();
        add("time by parts", parts.join(", "));
        add("most memory held", format!("{} MiB", result.peak_memory_bytes.div_ceil(1 << 20)));
    }
    pairs(html, &rows);
}

/// Rounds and remedies of the mesh motion.
pub(super) fn rounds(html: &mut Html, result: &RunResult) {
    html.element("ul", &[], |html| {
        let listed = result.rounds.len().min(MOST_ROWS / 5);
        result.rounds[..listed].iter().for_each(|event| html.leaf("li", &[], &event.describe()));
        if listed < result.rounds.len() {
            html.leaf("li", &[], &format!("and {} more", result.rounds.len() - listed));
        }
    });
}
