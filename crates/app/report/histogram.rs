//! Before and after: how the quality of the elements is distributed.

use fluxmorph_geometry::ElementId;
use fluxmorph_geometry::quality::QualityReport;

use super::data::{RunData, Snapshot};
use super::html::Html;
use super::plot::{WIDTH, px, svg, text};
use super::ticks::{grouped, number};
use crate::setup::Outline;

/// Height of the two bars of a tenth, and the room above and below.
const ROW: f64 = 25.0;
const BAR: f64 = 9.0;
const ABOVE: f64 = 22.0;

/// Left end of the bars, and their longest.
const START: f64 = 66.0;
const LONGEST: f64 = WIDTH - START - 58.0;

/// The figure with its caption.
pub(super) fn figure(html: &mut Html, data: &RunData, outline: &Outline) -> Result<(), String> {
    let after = data.fields[1].as_ref().map_err(Clone::clone)?;
    let before = data.fields[0].as_ref().ok();
    let moving = outline.design.as_ref().map(|design| design.moving.clone()).filter(|m| !m.is_empty());
    let (elements, of) = match moving {
        Some(moving) => (moving, "the elements that move with the design"),
        None => (outline.mesh.topology().elements().collect(), "all elements"),
    };
    let report = |field: &Snapshot| report(outline, field, &elements);
    let after = report(after).ok_or("there is no element")?;
    let before = before.and_then(report);
    html.element("figure", &[("id", "quality-histogram"), ("class", "narrow")], |html| {
        draw(html, before.as_ref(), &after);
        html.leaf("figcaption", &[], &caption(before.as_ref(), &after, of));
    });
    Ok(())
}

fn report(outline: &Outline, field: &Snapshot, elements: &[ElementId]) -> Option<QualityReport> {
    QualityReport::of_points(outline.mesh.topology(), &field.points, elements)
}

fn draw(html: &mut Html, before: Option<&QualityReport>, after: &QualityReport) {
    let most = before.into_iter().chain([after]).flat_map(|r| r.histogram).max().unwrap_or(1).max(1);
    let bins = after.histogram.len();
    let label = format!("Number of elements by tenths of quality, worst {}", number(after.worst, 3));
    svg(html, ABOVE + ROW * bins as f64 + 26.0, &label, |html| {
        text(html, "title", 2.0, 13.0, "quality");
        text(html, "title", START, 13.0, "elements");
        for k in 0..bins {
            let top = ABOVE + ROW * k as f64;
            let tenth = format!("{:.1}–{:.1}", k as f64 / bins as f64, (k + 1) as f64 / bins as f64);
            text(html, "tick end", START - 8.0, top + 15.0, &tenth);
            let bars = [before.map(|r| ("bar-before", r)), Some(("bar-after", after))];
            for (row, (class, report)) in bars.into_iter().flatten().enumerate() {
                let count = report.histogram[k];
                let length = LONGEST * count as f64 / most as f64;
                let y = top + 2.0 + (BAR + 1.0) * row as f64;
                let place = [START, y, length.max(if count > 0 { 0.8 } else { 0.0 }), BAR].map(px);
                let [left, top, width, height] = place.each_ref().map(String::as_str);
                html.void(
                    "rect",
                    &[("class", class), ("x", left), ("y", top), ("width", width), ("height", height)],
                );
                text(html, "count", START + length + 4.0, y + 8.0, &grouped(count));
            }
        }
        let y = ABOVE + ROW * bins as f64 + 8.0;
        let keys = [("bar-before", "before", before.is_some()), ("bar-after", "after", true)];
        for (i, (class, name, _)) in keys.into_iter().filter(|(_, _, shown)| *shown).enumerate() {
            let left = START + 80.0 * i as f64;
            let place = [left, y, 10.0, 9.0].map(px);
            let [left_text, top, width, height] = place.each_ref().map(String::as_str);
            html.void(
                "rect",
                &[("class", class), ("x", left_text), ("y", top), ("width", width), ("height", height)],
            );
            text(html, "tick", left + 15.0, y + 8.5, name);
        }
    });
}

fn caption(before: Option<&QualityReport>, after: &QualityReport, of: &str) -> String {
    let mut text = format!(
        "Quality (Eq. 4 of the paper: 1 for a regular tetrahedron, 0 for a flat one) of {of}, {} in all. ",
        grouped(after.elements)
    );
    let words =
        |r: &QualityReport| format!("worst {}, {} elements up to 0.3", number(r.worst, 3), grouped(r.poor));
    if let Some(before) = before {
        text += &format!("Before: {}; after: {}.", words(before), words(after));
    } else {
        text += &format!("{}.", words(after).replacen('w', "W", 1));
    }
    text
}
