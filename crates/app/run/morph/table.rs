//! The result of a motion as text and as CSV.

use super::{CaseReport, CaseResult, MorphReport, TuneReport};
use crate::config::Paper;
use crate::files::csv_text;
use crate::show::text_table::Table;

/// The columns of the first table.
const ROW: [&str; 8] =
    ["case", "equations", "elements", "q worst", "q <= 0.3", "inverted", "motion %", "Newton steps"];
/// The columns of the table of shares.
const SHARES: [&str; 4] = ["case", "% q <= 0.3", "% between", "% q >= 0.6"];
/// The columns of the table of places.
const PLACES: [&str; 8] =
    ["case", "worst element", "region", "at mm", "first inverts", "at motion x", "region", "at mm"];

/// The report as text: tables with a row for each case, published values in brackets after the own ones: counts, shares
/// and places; each fits a terminal of 120 columns.
pub fn text(report: &MorphReport) -> String {
    let mut text = report.tuned.as_ref().map_or_else(String::new, TuneReport::text);
    text +=
        &format!("quality (Eq. 4) of the elements of the {}, before -> after the motion", report.quality_of);
    if report.cases.iter().any(|case| case.paper.is_some()) {
        text += "; (in brackets: the paper)";
    }
    text += "\n";
    text += &Table::of_numbers(ROW, report.cases.iter().map(row)).text();
    text += &Table::of_numbers(SHARES, report.cases.iter().map(shares)).text();
    text += &Table::of_numbers(PLACES, report.cases.iter().map(places)).text();
    for case in report.cases.iter().filter(|case| !case.valid) {
        text += &format!("\n{}: {}", case.name, trouble(case));
    }
    text.push('\n');
    text
}

/// Why a case is not valid.
fn trouble(case: &CaseReport) -> String {
    let Some(case) = &case.result else { return case.error.clone().unwrap_or_default() };
    if case.inverted > 0 {
        return format!(
            "{} inverted elements: take remesh.law = \"hyperelastic\", another remesh.stiffness, or a larger remesh region",
            case.inverted
        );
    }
    if case.reached < 1.0 {
        return format!("the mesh allows {:.1} % of the motion only", case.reached * 100.0);
    }
    format!("the worst quality {:.4} is below morph.least_quality", case.after.worst)
}

fn row(case: &CaseReport) -> [String; ROW.len()] {
    let paper = case.paper.unwrap_or_default();
    let Some(result) = &case.result else { return without_result(case) };
    let CaseResult { before, after, .. } = result;
    [
        case.name.clone(),
        beside(result.equations.to_string(), paper.equations.map(|n| n.to_string())),
        after.elements.to_string(),
        beside(
            format!("{:.4} -> {:.4}", before.worst, after.worst),
            paper.worst_quality.map(|q| format!("{q:.4}")),
        ),
        beside(format!("{} -> {}", before.poor, after.poor), paper.poor.map(|n| n.to_string())),
        result.inverted.to_string(),
        format!("{:.1}", result.reached * 100.0),
        result.newton_steps.to_string(),
    ]
}

fn shares(case: &CaseReport) -> [String; SHARES.len()] {
    let paper = case.paper.unwrap_or_default();
    let Some(CaseResult { before, after, .. }) = &case.result else {
        return without_result(case);
    };
    let share = |k: usize, published: Option<f64>| {
        let [was, is] = [before, after].map(|quality| quality.shares_percent[k]);
        beside(format!("{was:.2} -> {is:.2}"), published.map(|value| format!("{value}")))
    };
    [
        case.name.clone(),
        share(0, paper.share_poor_percent),
        share(1, paper.share_fair_percent),
        share(2, paper.share_good_percent),
    ]
}

/// A value with the published one in brackets, where there is one.
fn beside(own: String, published: Option<String>) -> String {
    match published {
        Some(published) => format!("{own} ({published})"),
        None => own,
    }
}

/// The row of a case that could not be computed.
fn without_result<const N: usize>(case: &CaseReport) -> [String; N] {
    std::array::from_fn(|k| if k == 0 { case.name.clone() } else { "-".to_owned() })
}

fn places(case: &CaseReport) -> [String; PLACES.len()] {
    let place = |p: [f64; 3]| {
        let [x, y, z] = p.map(|c| (c * 1e6).round() * 1e-3 + 0.0);
        format!("{x:.2} {y:.2} {z:.2}")
    };
    let dash = || "-".to_owned();
    let Some(CaseResult { inversion, worst_element: worst, .. }) = &case.result else {
        return without_result(case);
    };
    [
        case.name.clone(),
        worst.element.to_string(),
        worst.region.clone(),
        place(worst.at_m),
        inversion.element.map_or_else(dash, |e| e.to_string()),
        inversion.step.map_or_else(|| "never".to_owned(), |step| format!("{step:.4}")),
        inversion.region.clone().unwrap_or_else(dash),
        inversion.at_m.map_or_else(dash, place),
    ]
}

/// A column: its name, and its value in a row.
type Column<T> = (&'static str, fn(&T) -> String);

/// Columns of `morph.csv` that say what came out of a motion.
const RESULT: [Column<CaseResult>; 17] = [
    ("equations", |r| r.equations.to_string()),
    ("elements", |r| r.after.elements.to_string()),
    ("worst_before", |r| number(Some(r.before.worst))),
    ("worst_after", |r| number(Some(r.after.worst))),
    ("poor_before", |r| r.before.poor.to_string()),
    ("poor_after", |r| r.after.poor.to_string()),
    ("fair_before", |r| r.before.fair.to_string()),
    ("fair_after", |r| r.after.fair.to_string()),
    ("good_before", |r| r.before.good.to_string()),
    ("good_after", |r| r.after.good.to_string()),
    ("inverted", |r| r.inverted.to_string()),
    ("worst_element", |r| r.worst_element.element.to_string()),
    ("worst_region", |r| csv_text(&r.worst_element.region)),
    ("inversion_step", |r| number(r.inversion.step)),
    ("inversion_element", |r| r.inversion.element.map_or_else(String::new, |e| e.to_string())),
    ("reached", |r| number(Some(r.reached))),
    ("newton_steps", |r| r.newton_steps.to_string()),
];

/// Columns of published values.
const PAPER: [Column<Paper>; 6] = [
    ("paper_worst_quality", |p| number(p.worst_quality)),
    ("paper_poor", |p| count(p.poor)),
    ("paper_share_poor_percent", |p| number(p.share_poor_percent)),
    ("paper_share_fair_percent", |p| number(p.share_fair_percent)),
    ("paper_share_good_percent", |p| number(p.share_good_percent)),
    ("paper_equations", |p| count(p.equations)),
];

/// The report as CSV, one row for each case; shortest digits that read back as the same number, empty for what is not
/// known.
pub fn csv(report: &MorphReport) -> String {
    let names = RESULT.map(|(name, _)| name).into_iter().chain(PAPER.map(|(name, _)| name));
    let mut text =
        ["case", "valid"].into_iter().chain(names).chain(["error"]).collect::<Vec<_>>().join(",") + "\n";
    for case in &report.cases {
        let paper = case.paper.unwrap_or_default();
        let mut cells = vec![csv_text(&case.name), case.valid.to_string()];
        cells.extend(RESULT.map(|(_, cell)| case.result.as_ref().map_or_else(String::new, cell)));
        cells.extend(PAPER.map(|(_, cell)| cell(&paper)));
        cells.push(case.error.as_deref().map_or_else(String::new, csv_text));
        text += &format!("{}\n", cells.join(","));
    }
    text
}

fn count(value: Option<usize>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| format!("{value:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exit_code::ExitCode;
    use crate::files::{RunStatus, StopReason, to_json};

    fn broken() -> CaseReport {
        CaseReport {
            name: "b, stiff".to_owned(),
            valid: false,
            error: Some("the matrix is singular".to_owned()),
            nodes: 125,
            tets: 384,
            moved_nodes: 1,
            result: None,
            paper: Some(Paper { equations: Some(360), poor: Some(7), ..Paper::default() }),
        }
    }

    #[test]
    fn a_case_that_could_not_be_computed_is_a_row_with_its_error() {
        let report = MorphReport::of(vec![broken(), broken()]);
        let csv = csv(&report);
        let rows: Vec<&str> = csv.lines().collect();
        assert_eq!(rows[0].split(',').count(), rows[1].split(',').count() - 1, "a name has a comma");
        let empty = ",".repeat(RESULT.len());
        assert_eq!(rows[1], format!("\"b, stiff\",false{empty},,7,,,,360,the matrix is singular"));
        let text = text(&report);
        assert!(text.contains("\nb, stiff: the matrix is singular"), "{text}");
        let json = String::from_utf8(to_json(&report)).expect("UTF-8");
        assert!(
            json.contains("\"error\": \"the matrix is singular\"") && !json.contains("\"after\""),
            "{json}"
        );
    }

    #[test]
    fn a_broken_case_stops_a_sweep_and_a_single_motion_fails_only_if_inverted() {
        let stopped = MorphReport::of(vec![broken(), CaseReport { valid: true, ..broken() }]);
        assert_eq!((stopped.status, stopped.stop_reason), (RunStatus::Stopped, StopReason::MeshLimited));
        assert_eq!(stopped.exit_code(), ExitCode::Stopped);
        assert_eq!(MorphReport::of(vec![broken()]).exit_code(), ExitCode::Stopped);
        assert_eq!(MorphReport::of(Vec::new()).exit_code(), ExitCode::Success);
        let failed = MorphReport { status: RunStatus::Failed, ..MorphReport::of(vec![broken()]) };
        assert_eq!(failed.exit_code(), ExitCode::Numerical);
    }
}
