//! Links to the files of the run, and how to continue it.

use maud::{Markup, html};

use super::data::RunData;
use super::markup::address;
use crate::files::{RunStatus, StopReason, extend_command, resume_command};

/// Field files that are listed one by one.
const MOST_LINKS: usize = 200;

/// The lists of files, and what to do with them; `links` is the path from the page to the run directory, with a slash at its
/// end, or nothing.
pub(super) fn files(data: &RunData, links: &str) -> Markup {
    let (fields, others): (Vec<&String>, Vec<&String>) =
        data.files.iter().partition(|file| file.starts_with("fields/"));
    let link = |file: &str| html! { a href={ (links) (address(file)) } { (file) } };
    let listed = fields.len().min(MOST_LINKS);
    html! {
        ul class="files" {
            @for file in others { li { (link(file)) span class="note" { (describe(file)) } } }
        }
        @if !fields.is_empty() {
            details {
                summary { (fields.len()) " field files" }
                ul class="files columns" {
                    @for file in &fields[..listed] { li { (link(file)) } }
                    @if listed < fields.len() { li { "and " (fields.len() - listed) " more" } }
                }
            }
        }
        @if data.files.iter().any(|file| file == "fields.pvd") {
            h3 { "Open it in ParaView" }
            ol {
                li { "File › Open, choose fields.pvd of the run directory, then Apply." }
                li {
                    "Colour by B_abs (flux density, in cells) or displacement; for one region alone add the filter \
                     Threshold on region."
                }
                li { "Step through time: its value is the number of the evaluation." }
            }
        }
        @if let Some((why, command)) = continuation(data) {
            h3 { "Go on with this run" }
            p { (why) " " code { (command) } }
        }
    }
}

fn describe(file: &str) -> &'static str {
    match file {
        "fields.pvd" => "the series of fields, for ParaView and pyvista",
        "error.vtu" => "where the mesh makes the error of the objective",
        "optimum.msh" => "the mesh of this design, for Gmsh",
        "optimum_refined.msh" => "the same with finer elements",
        "history.csv" => "a row for each evaluation",
        "result.json" => "all numbers of the result",
        "resolved.toml" => "the configuration with its defaults",
        "config.toml" => "the configuration as given",
        file if file.ends_with(".stl") => "a surface of this design, for CAD",
        _ => "",
    }
}

/// Whether the run can be resumed: why, and by which command.
fn continuation(data: &RunData) -> Option<(&'static str, String)> {
    if !data.is_run() {
        return None;
    }
    let resume = resume_command(&data.directory);
    let Some(result) = &data.result else {
        return Some(("All completed evaluations are saved:", resume));
    };
    match result.stop_reason {
        StopReason::Interrupted | StopReason::MaxTime => Some(("All evaluations are saved:", resume)),
        _ if result.status == RunStatus::Interrupted => {
            Some(("To run the check on a finer mesh that is missing:", resume))
        }
        StopReason::MaxEvaluations => Some((
            "The search stopped at its limit of evaluations; to continue with more:",
            extend_command(&data.directory, result.evaluations),
        )),
        _ => None,
    }
}
