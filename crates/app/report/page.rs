//! The page: its head, its sections in their order, and what stands in the place of a figure that cannot be made.

use super::data::RunData;
use super::html::Html;
use super::surface::Surface;
use super::ticks::{duration, number, trimmed};
use super::words::capital;
use super::{convergence, field, histogram, map, paper, tables, words};
use crate::config::{MeshConfig, Objective};
use crate::output::{RunResult, RunStatus, StopReason, extend_command, resume_command};

/// How pages of this program look.
pub(crate) const STYLE: &str = include_str!("style.css");
const VIEW: &str = include_str!("view.js");

/// Field files that are listed one by one.
const MOST_LINKS: usize = 200;

/// Longest resolved configuration that the page holds [bytes].
const LONGEST_CONFIGURATION: usize = 200_000;

/// The page of a run; `links` is the way from it to the run directory, with a slash at its end, or nothing.
///
/// Where the page would be longer than [`LONGEST`], the turning view is left out.
pub(super) fn page(data: &RunData, links: &str) -> String {
    let whole = made(data, links, Detail::All);
    if whole.len() <= LONGEST { whole } else { made(data, links, Detail::WithoutView) }
}

/// Longest page that can be sent by mail without a thought [bytes].
const LONGEST: usize = 2_000_000;

/// How much the page holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Detail {
    /// Everything.
    All,
    /// No view in three dimensions.
    WithoutView,
}

fn made(data: &RunData, links: &str, detail: Detail) -> String {
    let mut html = Html::default();
    html.element("html", &[("lang", "en")], |html| {
        html.element("head", &[], |html| {
            html.void("meta", &[("charset", "utf-8")]);
            html.void("meta", &[("name", "viewport"), ("content", "width=device-width, initial-scale=1")]);
            html.void("meta", &[("name", "color-scheme"), ("content", "light dark")]);
            html.void("meta", &[("name", "generator"), ("content", "fluxmorph")]);
            html.leaf("title", &[], &format!("{} · fluxmorph report", data.config.title));
            html.style(STYLE);
        });
        html.newline();
        html.element("body", &[], |html| {
            html.element("main", &[], |html| body(html, data, links, detail));
            html.script(VIEW);
        });
    });
    html.into_document()
}

fn body(html: &mut Html, data: &RunData, links: &str, detail: Detail) {
    head(html, data);
    shape(html, data, detail);
    if data.is_run() {
        section(html, "convergence", "Convergence", |html| {
            if data.history.is_empty() {
                missing(html, "the convergence", "no evaluation was completed");
            } else {
                convergence::figures(html, data);
            }
        });
    }
    section(html, "field", "Field", |html| {
        let made = data.outline.as_ref().map_err(Clone::clone).and_then(|o| field::figure(html, data, o));
        told(html, "the cut through the field", made);
    });
    let rows = paper::rows(data);
    if !rows.is_empty() {
        section(html, "paper", "Comparison with the paper", |html| {
            html.leaf(
                "p",
                &[],
                "This configuration is the paper's second example, the shielding plate, as far as the paper describes it.",
            );
            tables::paper_rows(html, &rows);
        });
    }
    section(html, "results", "Results", |html| match &data.result {
        Some(result) => tables::outcome(html, data, result),
        None => missing(html, "the results", "the run has not come to its end, so there is no result.json"),
    });
    if !data.history.is_empty() {
        section(html, "evaluations", "Evaluations", |html| tables::evaluations(html, data));
    }
    section(html, "mesh", "Mesh and equations", |html| {
        html.element("div", &[("class", "pair")], |html| {
            html.element("div", &[], |html| tables::mesh(html, data));
            html.element("div", &[], |html| {
                let outline = data.outline.as_ref().map_err(Clone::clone);
                let made = outline.and_then(|o| histogram::figure(html, data, o));
                told(html, "the histogram of quality", made);
            });
        });
        if let Some(result) = data.result.as_ref().filter(|result| !result.rounds.is_empty()) {
            html.leaf("h3", &[], "Rounds and remedies of the mesh motion");
            tables::rounds(html, result);
        }
        html.leaf("h3", &[], "Skin depth");
        match &data.outline {
            Ok(outline) => tables::skin(html, outline),
            Err(cause) => missing(html, "the skin-depth audit", cause),
        }
    });
    section(html, "files", "Files, and how to go on", |html| files(html, data, links));
    section(html, "provenance", "Provenance", |html| {
        tables::provenance(html, data);
        if let Some(resolved) = &data.resolved {
            html.element("details", &[], |html| {
                html.leaf("summary", &[], "Resolved configuration, every default written out");
                if resolved.len() <= LONGEST_CONFIGURATION {
                    html.element("pre", &[("tabindex", "0")], |html| html.leaf("code", &[], resolved));
                } else {
                    html.leaf("p", &[], "It is too long for this page: see resolved.toml.");
                }
            });
        }
    });
    html.leaf(
        "footer",
        &[],
        &format!("Written by fluxmorph {} from the files of the run.", env!("CARGO_PKG_VERSION")),
    );
}

fn section(html: &mut Html, id: &str, title: &str, content: impl FnOnce(&mut Html)) {
    html.element("section", &[("id", id)], |html| {
        html.leaf("h2", &[], title);
        content(html);
    });
    html.newline();
}

/// A sentence in the place of what cannot be shown.
fn missing(html: &mut Html, what: &str, cause: &str) {
    html.leaf("p", &[("class", "missing")], &format!("Not shown: {what}. Reason: {cause}."));
}

fn told(html: &mut Html, what: &str, made: Result<(), String>) {
    if let Err(cause) = made {
        missing(html, what, &cause);
    }
}

fn head(html: &mut Html, data: &RunData) {
    html.element("header", &[], |html| {
        let kind = if data.is_run() { "Shape optimisation" } else { "Field analysis" };
        html.leaf("p", &[("class", "kind")], kind);
        html.leaf("h1", &[], &data.config.title);
        let (class, words) = status(data);
        html.element("p", &[("class", &format!("status {class}"))], |html| html.text(&words));
        let variables = data.designs[1].as_ref().or(data.designs[0].as_ref()).map(Vec::len);
        html.leaf("p", &[("class", "lead")], &words::summary(&data.config, variables, data.is_run()));
        html.element("div", &[("class", "cards")], |html| {
            for (name, value, note) in figures(data) {
                html.element("div", &[("class", "card")], |html| {
                    html.leaf("span", &[("class", "name")], &name);
                    html.leaf("strong", &[], &value);
                    html.leaf("span", &[("class", "note")], &note);
                });
            }
        });
    });
    html.newline();
}

/// A class, and how far the run is in words.
fn status(data: &RunData) -> (&'static str, String) {
    if let Some(result) = &data.result {
        let reason = result.stop_reason.describe();
        return match result.status {
            RunStatus::Converged => ("good", format!("Converged: {reason}")),
            RunStatus::Done => ("good", "Done".to_owned()),
            RunStatus::Stopped if result.stop_reason == StopReason::Infeasible => {
                ("bad", format!("Stopped: {reason}"))
            }
            RunStatus::Stopped => ("fair", format!("Stopped at a limit: {reason}; the results are valid")),
            RunStatus::Interrupted => ("fair", "Interrupted: the best design so far is shown".to_owned()),
            RunStatus::Failed => ("bad", format!("Failed: {reason}; the best design before is shown")),
            RunStatus::Running => ("fair", "Not ended".to_owned()),
        };
    }
    match data.manifest.status {
        RunStatus::Running => ("fair", "Still running, or broken off: there is no result yet".to_owned()),
        RunStatus::Interrupted => ("fair", "Interrupted before there was a result".to_owned()),
        RunStatus::Failed => ("bad", "Failed before there was a result".to_owned()),
        _ => ("bad", "There is no result.json, though the run has ended".to_owned()),
    }
}

/// The unit of the objective, where all its terms have the same.
fn unit(data: &RunData) -> &'static str {
    data.config.objective.as_ref().and_then(Objective::si_unit).unwrap_or_default()
}

/// Key figures: name, value, remark.
fn figures(data: &RunData) -> Vec<(String, String, String)> {
    let mut all = Vec::new();
    let mut add = |name: &str, value: String, note: String| all.push((name.to_owned(), value, note));
    let objective = data.result.as_ref().and_then(|result| result.objective.as_ref());
    if data.is_run() {
        if let Some(ratio) = data.ratio() {
            let note = match objective {
                Some(o) => format!("{} → {} {}", number(o.initial, 4), number(o.best, 4), unit(data)),
                None => "so far".to_owned(),
            };
            add("objective F / F₀", number(ratio, 4), note);
        }
        if let Some(verified) = objective.and_then(|o| o.verified_ratio) {
            let note = objective.and_then(|o| o.verification).map_or(
                "the initial shape is the best".to_owned(),
                |v| {
                    format!(
                        "refined × {}, {} tetrahedra",
                        trimmed(v.refinement, 3),
                        super::ticks::grouped(v.tets)
                    )
                },
            );
            add("on a fresh mesh", number(verified, 4), note);
        } else if objective.is_some() {
            let note = match data.config.mesh {
                MeshConfig::File { .. } => "the mesh is from a file: solve both shapes on another one",
                _ => "see what the run told at its end",
            };
            add("on a fresh mesh", "not checked".to_owned(), note.to_owned());
        }
        let (evaluations, iterations) = match (&data.result, data.history.last()) {
            (Some(result), _) => (result.evaluations, result.iterations),
            (None, Some(row)) => (row.evaluation.saturating_add(1), row.iteration),
            (None, None) => (0, 0),
        };
        let best = data.best.map_or(String::new(), |best| format!("; best: {best}"));
        add("evaluations", evaluations.to_string(), format!("{iterations} iterations improved{best}"));
    } else if let Some(objective) = objective {
        add("objective F", number(objective.best, 5), unit(data).to_owned());
    }
    if let Some(seconds) = data.manifest.seconds {
        add("time", duration(seconds), format!("on {} threads", data.manifest.threads));
    }
    match (&data.result, &data.manifest.mesh) {
        (Some(RunResult { mesh, .. }), _) => {
            let unknowns = format!("{} unknowns", super::ticks::grouped(mesh.unknowns));
            add("tetrahedra", super::ticks::grouped(mesh.tets), unknowns);
        }
        (None, Some(mesh)) => {
            let nodes = format!("{} nodes", super::ticks::grouped(mesh.nodes));
            add("tetrahedra", super::ticks::grouped(mesh.tets), nodes);
        }
        _ => {}
    }
    if let Ok(outline) = &data.outline {
        let [low, high] = outline.full_mesh.bounding_box();
        let size = [0, 1, 2].map(|d| trimmed(1e3 * (high[d] - low[d]), 1)).join(" × ");
        let device = outline.design.as_ref().map(|design| {
            let nodes = design.surface.nodes().iter().map(|&n| outline.full_mesh.point(n));
            let [low, high] = super::plane::bounds(nodes);
            [0, 1, 2].map(|d| high[d] - low[d]).into_iter().filter(|e| *e > 1e-9).map(|e| trimmed(1e3 * e, 1))
        });
        match device {
            Some(device) => {
                let device = device.collect::<Vec<_>>().join(" × ");
                add("design surface", format!("{device} mm"), format!("in a mesh of {size} mm"));
            }
            None => add("size", format!("{size} mm"), "of the whole mesh".to_owned()),
        }
    }
    all
}

fn shape(html: &mut Html, data: &RunData, detail: Detail) {
    if data.config.design.is_none() {
        return;
    }
    section(html, "shape", "Shape", |html| {
        let design = match &data.outline {
            Ok(outline) => {
                outline.design.as_ref().map(|design| (outline, design)).ok_or("there is no design".to_owned())
            }
            Err(cause) => Err(cause.clone()),
        };
        let (outline, design) = match design {
            Ok(found) => found,
            Err(cause) => {
                missing(html, "the shape", &cause);
                return;
            }
        };
        match Surface::new(data, outline, design) {
            Ok(_) if detail == Detail::WithoutView => {
                missing(html, "the view in three dimensions", "the page would be longer than 2 MB");
            }
            Ok(surface) => view(html, data, &surface),
            Err(cause) => missing(html, "the view in three dimensions", &cause),
        }
        let made = map::figure(html, data, outline, design);
        told(html, "the map of the design surface", made);
    });
}

fn view(html: &mut Html, data: &RunData, surface: &Surface) {
    html.element("figure", &[("id", "view"), ("class", "view")], |html| {
        html.element("div", &[("class", "stage")], |html| {
            let label = format!(
                "Three-dimensional view of {}. Arrow keys turn it, plus and minus zoom, Home puts it back.",
                surface.what
            );
            html.element("canvas", &[("tabindex", "0"), ("role", "img"), ("aria-label", &label)], |_| {});
            html.element("p", &[("class", "no-view")], |html| {
                html.text("The turning view needs scripts and WebGL 2, which this reader does not have or does not allow. The maps below show the same shape.");
            });
        });
        html.element("div", &[("class", "controls"), ("hidden", "hidden")], |_| {});
        let mut caption = format!(
            "{} at evaluation {}, {} triangles. ",
            capital(&surface.what),
            data.best.map_or("–".to_owned(), |best| best.to_string()),
            super::ticks::grouped(surface.triangles)
        );
        if surface.exaggeration > 1.0 {
            caption += &format!("The motion is drawn {} times as large. ", trimmed(surface.exaggeration, 0));
        }
        caption += "Drag to turn, wheel or two fingers to zoom, arrow keys when selected; the slider goes from the initial \
                    shape to the best one.";
        if data.fields[1].is_ok() {
            caption += " |B| is that of the body where it is meshed, else that of the air at its surface.";
        }
        html.leaf("figcaption", &[], &caption);
        html.data("surface", &surface.json);
    });
}

fn files(html: &mut Html, data: &RunData, links: &str) {
    let (fields, others): (Vec<&String>, Vec<&String>) =
        data.files.iter().partition(|file| file.starts_with("fields/"));
    let link = |html: &mut Html, file: &str| {
        html.leaf("a", &[("href", &format!("{links}{}", address(file)))], file);
    };
    html.element("ul", &[("class", "files")], |html| {
        for file in others {
            html.element("li", &[], |html| {
                link(html, file);
                html.leaf("span", &[("class", "note")], describe(file));
            });
        }
    });
    if !fields.is_empty() {
        html.element("details", &[], |html| {
            html.leaf("summary", &[], &format!("{} field files", fields.len()));
            html.element("ul", &[("class", "files columns")], |html| {
                let listed = fields.len().min(MOST_LINKS);
                fields[..listed].iter().for_each(|file| html.element("li", &[], |html| link(html, file)));
                if listed < fields.len() {
                    html.leaf("li", &[], &format!("and {} more", fields.len() - listed));
                }
            });
        });
    }
    if data.files.iter().any(|file| file == "fields.pvd") {
        html.leaf("h3", &[], "Open it in ParaView");
        html.element("ol", &[], |html| {
            html.leaf("li", &[], "File › Open, choose fields.pvd of the run directory, then Apply.");
            html.leaf("li", &[], "Colour by B_abs (flux density, in cells) or displacement; for one region alone add the filter Threshold on region.");
            html.leaf("li", &[], "Step through time: its value is the number of the evaluation.");
        });
    }
    if let Some(how) = go_on(data) {
        html.leaf("h3", &[], "Go on with this run");
        html.element("p", &[], |html| {
            html.text(&how.0);
            html.text(" ");
            html.leaf("code", &[], &how.1);
        });
    }
}

/// Whether and how the run can go on.
fn go_on(data: &RunData) -> Option<(String, String)> {
    if !data.is_run() {
        return None;
    }
    let command = resume_command(&data.directory);
    match &data.result {
        None => Some(("All completed evaluations are saved:".to_owned(), command)),
        Some(result) => match result.stop_reason {
            StopReason::Interrupted | StopReason::MaxTime => {
                Some(("All evaluations are saved:".to_owned(), command))
            }
            _ if result.status == RunStatus::Interrupted => {
                Some(("The check on a fresh mesh can be made up for:".to_owned(), command))
            }
            StopReason::MaxEvaluations => Some((
                "The search stopped at its limit of evaluations; with more of them it goes on from here:"
                    .to_owned(),
                extend_command(&data.directory, result.evaluations),
            )),
            _ => None,
        },
    }
}

fn describe(file: &str) -> &'static str {
    match file {
        "fields.pvd" => "the series of fields, for ParaView and pyvista",
        "optimum.msh" => "the mesh of this design, for Gmsh",
        "history.csv" => "a row for each evaluation",
        "result.json" => "all numbers of the result",
        "resolved.toml" => "the configuration with every default",
        "config.toml" => "the configuration as given",
        file if file.ends_with(".stl") => "a surface of this design, for CAD",
        _ => "",
    }
}

/// A path as an address: what is not plain is written by its bytes.
pub(crate) fn address(path: &str) -> String {
    let mut text = String::new();
    for byte in path.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'.' | b'_' | b'-' | b'~' => {
                text.push(char::from(byte))
            }
            other => text += &format!("%{other:02X}"),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_has_plain_characters_only() {
        assert_eq!(address("a b/ü?.stl"), "a%20b/%C3%BC%3F.stl");
    }
}
