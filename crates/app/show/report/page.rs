//! The page: its sections in their order, and what replaces a figure that cannot be drawn.

use maud::{Markup, html};

use super::data::RunData;
use super::files::files;
use super::head::head;
use super::markup::{document, footer, json, missing, section};
use super::surface::Surface;
use super::ticks::{group_digits, trim_zeros};
use super::words::capital;
use super::{convergence, deviation, error_map, facts, field, histogram, iron, map, tables};
use crate::build::{Outline, OutlinedDesign};

const VIEW: &str = include_str!("view.js");

/// Longest page that can be sent by mail without a thought [bytes].
const LONGEST: usize = 2_000_000;

/// Longest resolved configuration that the page holds [bytes].
const LONGEST_CONFIGURATION: usize = 200_000;

/// How much the page holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Detail {
    /// Everything.
    All,
    /// No view in three dimensions.
    WithoutView,
}

/// The page of a run; `links` is the path from it to the run directory, with a slash at its end, or nothing.
///
/// Where the page would be longer than [`LONGEST`], the turning view is left out.
pub(super) fn page(data: &RunData, links: &str) -> String {
    let title = format!("{} · fluxmorph report", data.config.title);
    let page = |detail| document(&title, "", VIEW, &body(data, links, detail));
    let whole = page(Detail::All);
    if whole.len() <= LONGEST { whole } else { page(Detail::WithoutView) }
}

fn body(data: &RunData, links: &str, detail: Detail) -> Markup {
    html! {
        (head(data))
        @if data.config.design.is_some() { (section("shape", "Shape", &shape(data, detail))) }
        @if data.is_run() { (section("convergence", "Convergence", &convergence(data))) }
        (section("field", "Field", &field(data)))
        @if let Some(figure) = data.outline.as_ref().ok().and_then(|outline| error_map::figure(data, outline)) {
            (section("error", "Error of the mesh", &or_missing("the map of the error", figure)))
        }
        (section("results", "Results", &results(data)))
        @if !data.history.is_empty() { (section("evaluations", "Evaluations", &tables::evaluations(data))) }
        (section("mesh", "Mesh and equations", &mesh(data)))
        (section("files", "Files, and how to continue", &files(data, links)))
        (section("provenance", "Provenance", &provenance(data)))
        (footer("the run"))
    }
}

/// A figure, or why there is none.
fn or_missing(what: &str, figure: Result<Markup, String>) -> Markup {
    figure.unwrap_or_else(|cause| missing(what, &cause))
}

/// A figure for which the mesh is needed.
fn of_outline(
    data: &RunData,
    figure: impl FnOnce(&RunData, &Outline) -> Result<Markup, String>,
) -> Result<Markup, String> {
    figure(data, data.outline.as_ref().map_err(Clone::clone)?)
}

fn field(data: &RunData) -> Markup {
    html! {
        (or_missing("the cut through the field", of_outline(data, field::figure)))
        @if let Some(figure) = data.outline.as_ref().ok().and_then(|outline| deviation::figure(data, outline)) {
            (or_missing("the map of the deviation", figure))
        }
        @if let Some(figure) = data.outline.as_ref().ok().and_then(|outline| iron::figure(data, outline)) { (figure) }
    }
}

fn convergence(data: &RunData) -> Markup {
    if data.history.is_empty() {
        return missing("the convergence", "no evaluation was completed");
    }
    convergence::figures(data)
}

fn results(data: &RunData) -> Markup {
    match &data.result {
        Some(result) => html! {
            @for warning in &result.warnings { p class="warning" { (warning) } }
            (tables::outcome(data, result))
        },
        None => missing("the results", "the run has not come to its end, so there is no result.json"),
    }
}

fn mesh(data: &RunData) -> Markup {
    let skin = of_outline(data, |_, outline| Ok(tables::skin(outline, data.result.as_ref())));
    html! {
        div class="pair" {
            div { (facts::mesh(data)) }
            div { (or_missing("the histogram of quality", of_outline(data, histogram::figure))) }
        }
        h3 { "Skin depth" }
        (or_missing("the skin-depth audit", skin))
    }
}

fn provenance(data: &RunData) -> Markup {
    html! {
        (facts::provenance(data))
        @if let Some(resolved) = &data.resolved {
            details {
                summary { "Resolved configuration, with its defaults" }
                @if resolved.len() <= LONGEST_CONFIGURATION {
                    pre tabindex="0" { code { (resolved) } }
                } @else {
                    p { "It is too long for this page: see resolved.toml." }
                }
            }
        }
    }
}

fn shape(data: &RunData, detail: Detail) -> Markup {
    let figures = |_: &RunData, outline: &Outline| {
        let design = outline.design.as_ref().ok_or("there is no design")?;
        Ok(html! {
            (or_missing("the view in three dimensions", view(data, outline, design, detail)))
            (or_missing("the map of the design surface", map::figure(data, outline, design)))
        })
    };
    or_missing("the shape", of_outline(data, figures))
}

fn view(
    data: &RunData,
    outline: &Outline,
    design: &OutlinedDesign,
    detail: Detail,
) -> Result<Markup, String> {
    let surface = Surface::new(data, outline, design)?;
    if detail == Detail::WithoutView {
        return Err("the page would be longer than 2 MB".to_owned());
    }
    let label = format!(
        "Three-dimensional view of {}. Arrow keys turn it, plus and minus zoom, Home puts it back.",
        surface.what
    );
    Ok(html! {
        figure id="view" class="view" {
            div class="stage" {
                canvas tabindex="0" role="img" aria-label=(label) {}
                p class="no-view" {
                    "The turning view needs scripts and WebGL 2, which this reader does not have or does not allow. \
                     The maps below show the same shape."
                }
            }
            div class="controls" hidden {}
            figcaption { (caption(data, &surface)) }
            (json("surface", &surface.json))
        }
    })
}

fn caption(data: &RunData, surface: &Surface) -> String {
    let mut text = format!(
        "{} at evaluation {}, {} triangles. ",
        capital(&surface.what),
        data.best.map_or("–".to_owned(), |best| best.to_string()),
        group_digits(surface.triangles)
    );
    if surface.exaggeration > 1.0 {
        text += &format!("The motion is drawn {} times as large. ", trim_zeros(surface.exaggeration, 0));
    }
    text += "Drag to turn, wheel or two fingers to zoom, arrow keys when selected";
    text += if surface.moves { "; the slider goes from the initial shape to the best one." } else { "." };
    if data.fields[1].is_ok() {
        text += " |B| is that of the body where it is meshed, else that of the air at its surface.";
    }
    text
}
