//! Before and after: how the quality of the elements is distributed.

use fluxmorph_geometry::ElementId;
use fluxmorph_geometry::quality::QualityReport;
use maud::{Markup, html};

use super::bars::{self, START};
use super::data::{RunData, Snapshot};
use super::plot::{rect, svg, text};
use super::ticks::{group_digits, number};
use crate::build::Outline;

/// The figure with its caption.
pub(super) fn figure(data: &RunData, outline: &Outline) -> Result<Markup, String> {
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
    Ok(html! {
        figure id="quality-histogram" class="narrow" {
            (draw(before.as_ref(), &after))
            figcaption { (caption(before.as_ref(), &after, of)) }
        }
    })
}

fn report(outline: &Outline, field: &Snapshot, elements: &[ElementId]) -> Option<QualityReport> {
    QualityReport::of_points(outline.mesh.topology(), &field.points, elements)
}

fn draw(before: Option<&QualityReport>, after: &QualityReport) -> Markup {
    let shown: Vec<_> = before
        .map(|r| ("bar-before", "before", r))
        .into_iter()
        .chain([("bar-after", "after", after)])
        .collect();
    let most = shown.iter().flat_map(|(_, _, report)| report.histogram).max().unwrap_or(1).max(1);
    let bins = after.histogram.len();
    let row = |k: usize| {
        let tenth = format!("{:.1}–{:.1}", k as f64 / bins as f64, (k + 1) as f64 / bins as f64);
        let bar = |(class, _, report): &(&'static str, &str, &QualityReport)| {
            let count = report.histogram[k];
            Some((*class, count as f64, group_digits(count)))
        };
        (tenth, shown.iter().map(bar).collect())
    };
    let rows: Vec<bars::Row> = (0..bins).map(row).collect();
    let (rows, bottom) = bars::rows(["quality", "elements"], &rows, most as f64);
    let content = html! {
        (rows)
        @for (i, (class, name, _)) in shown.iter().enumerate() {
            (rect(class, [START + 80.0 * i as f64, bottom + 8.0, 10.0, 9.0]))
            (text("tick", START + 80.0 * i as f64 + 15.0, bottom + 16.5, name))
        }
    };
    let label = format!("Number of elements by tenths of quality, worst {}", number(after.worst, 3));
    svg(bottom + 26.0, &label, &content)
}

fn caption(before: Option<&QualityReport>, after: &QualityReport, of: &str) -> String {
    let mut text = format!(
        "Quality (Eq. 4 of the paper: 1 for a regular tetrahedron, 0 for a flat one) of {of}, {} in all. ",
        group_digits(after.elements)
    );
    let words = |r: &QualityReport| {
        format!("worst {}, {} elements up to 0.3", number(r.worst, 3), group_digits(r.poor))
    };
    if let Some(before) = before {
        text += &format!("Before: {}; after: {}.", words(before), words(after));
    } else {
        text += &format!("{}.", words(after).replacen('w', "W", 1));
    }
    text
}
