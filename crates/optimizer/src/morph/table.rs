//! The result of a motion as text and as CSV.

use super::{CaseReport, MorphReport, TuneReport};
use crate::config::Paper;

/// The report as text: one table with a row for each case, published values in brackets behind the own ones, and one with
/// the places.
pub fn text(report: &MorphReport) -> String {
    let mut text = report.tuned.as_ref().map_or_else(String::new, TuneReport::text);
    text +=
        &format!("quality (Eq. 4) of the elements of the {}, before -> after the motion", report.quality_of);
    if report.cases.iter().any(|case| case.paper.is_some()) {
        text += "; (in brackets: the paper)";
    }
    text += "\n\n";
    let header = [
        "case",
        "equations",
        "elements",
        "q worst",
        "q <= 0.3",
        "% <= 0.3",
        "% between",
        "% >= 0.6",
        "inverted",
        "motion %",
        "increments",
        "rescues",
    ];
    let rows: Vec<Vec<String>> = report.cases.iter().map(row).collect();
    text += &aligned(&header, &rows);
    text.push('\n');
    let header =
        ["case", "worst element", "region", "at mm", "first inverts", "at motion x", "region", "at mm"];
    let rows: Vec<Vec<String>> = report.cases.iter().map(places).collect();
    text += &aligned(&header, &rows);
    for case in report.cases.iter().filter(|case| !case.valid) {
        text += &format!("\n{}: {}", case.name, trouble(case));
    }
    text.push('\n');
    text
}

/// Why a case is not valid.
fn trouble(case: &CaseReport) -> String {
    if case.inverted > 0 {
        return format!(
            "{} inverted elements: take more increments or increments = \"auto\", another remesh.stiffness, or a \
             larger remesh region",
            case.inverted
        );
    }
    if case.reached < 1.0 {
        return format!("the mesh allows {:.1} % of the motion only", case.reached * 100.0);
    }
    format!("the worst quality {:.4} is below morph.least_quality", case.after.worst)
}

fn row(case: &CaseReport) -> Vec<String> {
    let paper = case.paper.unwrap_or_default();
    let (before, after) = (&case.before, &case.after);
    let beside = |own: String, published: Option<String>| match published {
        Some(published) => format!("{own} ({published})"),
        None => own,
    };
    let percent = |value: Option<f64>| value.map(|value| format!("{value}"));
    let share = |k: usize, published: Option<f64>| {
        let [was, is] = [before, after].map(|quality| quality.shares_percent[k]);
        beside(format!("{was:.2} -> {is:.2}"), percent(published))
    };
    vec![
        case.name.clone(),
        beside(case.equations.to_string(), paper.equations.map(|n| n.to_string())),
        after.elements.to_string(),
        beside(
            format!("{:.4} -> {:.4}", before.worst, after.worst),
            paper.worst_quality.map(|q| format!("{q:.4}")),
        ),
        beside(format!("{} -> {}", before.poor, after.poor), paper.poor.map(|n| n.to_string())),
        share(0, paper.share_poor_percent),
        share(1, paper.share_fair_percent),
        share(2, paper.share_good_percent),
        case.inverted.to_string(),
        format!("{:.1}", case.reached * 100.0),
        case.increments.to_string(),
        case.rescues.to_string(),
    ]
}

fn places(case: &CaseReport) -> Vec<String> {
    let place = |p: [f64; 3]| {
        let [x, y, z] = p.map(|c| (c * 1e6).round() * 1e-3 + 0.0);
        format!("{x:.2} {y:.2} {z:.2}")
    };
    let dash = || "-".to_owned();
    let inversion = &case.inversion;
    vec![
        case.name.clone(),
        case.worst_element.element.to_string(),
        case.worst_element.region.clone(),
        place(case.worst_element.at_m),
        inversion.element.map_or_else(dash, |e| e.to_string()),
        inversion.step.map_or_else(|| "never".to_owned(), |step| format!("{step:.4}")),
        inversion.region.clone().unwrap_or_else(dash),
        inversion.at_m.map_or_else(dash, place),
    ]
}

/// Columns of equal width, the first to the left.
pub(super) fn aligned(header: &[&str], rows: &[Vec<String>]) -> String {
    let width = |column: usize| {
        let cells = rows.iter().map(|row| row[column].chars().count());
        cells.chain([header[column].chars().count()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..header.len()).map(width).collect();
    let line = |cells: Vec<&str>| {
        let padded: Vec<String> = cells
            .into_iter()
            .zip(&widths)
            .enumerate()
            .map(|(column, (cell, &width))| match column {
                0 => format!("{cell:<width$}"),
                _ => format!("{cell:>width$}"),
            })
            .collect();
        format!("{}\n", padded.join("  ").trim_end())
    };
    let mut text = line(header.to_vec());
    rows.iter().for_each(|row| text += &line(row.iter().map(String::as_str).collect()));
    text
}

/// The columns of `morph.csv`.
const COLUMNS: [&str; 25] = [
    "case",
    "valid",
    "equations",
    "elements",
    "worst_before",
    "worst_after",
    "poor_before",
    "poor_after",
    "fair_before",
    "fair_after",
    "good_before",
    "good_after",
    "inverted",
    "worst_element",
    "worst_region",
    "inversion_step",
    "inversion_element",
    "reached",
    "increments",
    "rescues",
    "paper_worst_quality",
    "paper_poor",
    "paper_share_poor_percent",
    "paper_share_fair_percent",
    "paper_share_good_percent",
];

/// The report as CSV, one row for each case; shortest digits that read back as the same number, empty for what is not
/// known.
pub fn csv(report: &MorphReport) -> String {
    let mut text = format!("{}\n", COLUMNS.join(","));
    for case in &report.cases {
        let Paper { worst_quality, poor, share_poor_percent, share_fair_percent, share_good_percent, .. } =
            case.paper.unwrap_or_default();
        let (before, after) = (&case.before, &case.after);
        let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:?}"));
        let cells: [String; 25] = [
            quoted(&case.name),
            case.valid.to_string(),
            case.equations.to_string(),
            after.elements.to_string(),
            number(Some(before.worst)),
            number(Some(after.worst)),
            before.poor.to_string(),
            after.poor.to_string(),
            before.fair.to_string(),
            after.fair.to_string(),
            before.good.to_string(),
            after.good.to_string(),
            case.inverted.to_string(),
            case.worst_element.element.to_string(),
            quoted(&case.worst_element.region),
            number(case.inversion.step),
            case.inversion.element.map_or_else(String::new, |e| e.to_string()),
            number(Some(case.reached)),
            case.increments.to_string(),
            case.rescues.to_string(),
            number(worst_quality),
            poor.map_or_else(String::new, |n| n.to_string()),
            number(share_poor_percent),
            number(share_fair_percent),
            number(share_good_percent),
        ];
        text += &format!("{}\n", cells.join(","));
    }
    text
}

/// A text as a CSV cell.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}
