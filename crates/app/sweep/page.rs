//! `sweep.html`: one page that compares the runs of a sweep, in the form of the report about a single run.

use super::comparison::{Comparison, Row};
use super::{Sweep, plots};
use crate::output::{RunStatus, StopReason};
use crate::report::html::Html;
use crate::report::page::{STYLE, address};
use crate::report::ticks::{duration, number};

/// What this page has beside the style of the report.
const OWN_STYLE: &str = include_str!("style.css");

/// Rows of the table; `sweep.csv` has all.
const MOST_ROWS: usize = 2000;

/// Values of a key that are listed in words.
const MOST_VALUES: usize = 12;

/// The page.
pub(super) fn page(sweep: &Sweep, comparison: &Comparison) -> String {
    let mut html = Html::default();
    html.element("html", &[("lang", "en")], |html| {
        html.element("head", &[], |html| {
            html.void("meta", &[("charset", "utf-8")]);
            html.void("meta", &[("name", "viewport"), ("content", "width=device-width, initial-scale=1")]);
            html.void("meta", &[("name", "color-scheme"), ("content", "light dark")]);
            html.void("meta", &[("name", "generator"), ("content", "fluxmorph")]);
            html.leaf("title", &[], &format!("{} · fluxmorph sweep", sweep.title));
            html.style(STYLE);
            html.style(OWN_STYLE);
        });
        html.newline();
        html.element("body", &[], |html| {
            html.element("main", &[], |html| body(html, sweep, comparison));
        });
    });
    html.into_document()
}

fn body(html: &mut Html, sweep: &Sweep, comparison: &Comparison) {
    head(html, sweep, comparison);
    section(html, "comparison", "Comparison", |html| table(html, comparison));
    plots::over_value(html, comparison);
    section(html, "convergence", "Convergence", |html| plots::convergence(html, comparison));
    section(html, "files", "Files", |html| {
        html.element("ul", &[("class", "files")], |html| {
            for (file, what) in [
                ("sweep.csv", "the table above, with all digits"),
                ("sweep.json", "keys, values, and the command of every combination"),
                ("logs/", "what every run has said"),
            ] {
                html.element("li", &[], |html| {
                    html.leaf("a", &[("href", file)], file);
                    html.leaf("span", &[("class", "note")], what);
                });
            }
        });
    });
    html.leaf(
        "footer",
        &[],
        &format!("Written by fluxmorph {} from the files of the runs.", env!("CARGO_PKG_VERSION")),
    );
}

fn section(html: &mut Html, id: &str, title: &str, content: impl FnOnce(&mut Html)) {
    html.element("section", &[("id", id)], |html| {
        html.leaf("h2", &[], title);
        content(html);
    });
    html.newline();
}

fn head(html: &mut Html, sweep: &Sweep, comparison: &Comparison) {
    let rows = &comparison.combinations;
    let ended = rows.iter().filter(|row| row.has_ended()).count();
    let failed = rows.iter().filter(|row| row.status == Some(RunStatus::Failed)).count();
    html.element("header", &[], |html| {
        html.leaf("p", &[("class", "kind")], "Sweep of shape optimisations");
        html.leaf("h1", &[], &sweep.title);
        let class = match (failed, ended == rows.len()) {
            (0, true) => "good",
            (0, false) => "fair",
            _ => "bad",
        };
        let more = if failed > 0 { format!(", {failed} failed") } else { String::new() };
        let status = format!("{ended} of {} combinations have ended{more}", rows.len());
        html.leaf("p", &[("class", &format!("status {class}"))], &status);
        html.leaf("p", &[("class", "lead")], &lead(sweep));
        html.element("div", &[("class", "cards")], |html| {
            for (name, value, note) in figures(comparison, ended) {
                html.element("div", &[("class", "card")], |html| {
                    html.leaf("span", &[("class", "name")], name);
                    html.leaf("strong", &[], &value);
                    html.leaf("span", &[("class", "note")], &note);
                });
            }
        });
    });
    html.newline();
}

/// Which keys take which values.
fn lead(sweep: &Sweep) -> String {
    let swept: Vec<String> = sweep
        .swept()
        .map(|setting| {
            let shown = setting.values.len().min(MOST_VALUES);
            let more = match setting.values.len() - shown {
                0 => String::new(),
                more => format!(" and {more} more"),
            };
            format!("{} = {}{more}", setting.key, setting.values[..shown].join(", "))
        })
        .collect();
    let fixed: Vec<String> = sweep.fixed().map(|s| format!("{} = {}", s.key, s.values.join(", "))).collect();
    let mut text = format!("{} with ", sweep.config.path);
    text += &if swept.is_empty() { "nothing swept".to_owned() } else { swept.join("; ") };
    if !fixed.is_empty() {
        text += &format!("; in all runs {}", fixed.join("; "));
    }
    text + "."
}

fn figures(comparison: &Comparison, ended: usize) -> Vec<(&'static str, String, String)> {
    let rows = &comparison.combinations;
    let mut all = vec![("combinations", rows.len().to_string(), format!("{ended} have ended"))];
    if let Some((row, ratio)) = comparison.best.and_then(|best| Some((&rows[best], rows[best].ratio?))) {
        all.push(("best F / F₀", number(ratio, 4), row.directory.clone()));
    }
    let evaluations: usize = rows.iter().filter_map(|row| row.evaluations).sum();
    all.push(("evaluations", evaluations.to_string(), "of all runs".to_owned()));
    let seconds: f64 = rows.iter().filter_map(|row| row.seconds).sum();
    all.push(("time", duration(seconds), "of all runs that have ended, one after the other".to_owned()));
    all
}

impl Row {
    /// Whether its run came to its end.
    pub(super) fn has_ended(&self) -> bool {
        matches!(self.status, Some(RunStatus::Converged | RunStatus::Stopped))
    }

    /// How far it is, in words.
    pub fn told(&self) -> String {
        match (self.status, self.stop_reason) {
            (None, _) => "not begun".to_owned(),
            (Some(RunStatus::Converged), _) => "converged".to_owned(),
            (Some(RunStatus::Stopped), Some(StopReason::MaxEvaluations)) => "stopped: evaluations".to_owned(),
            (Some(RunStatus::Stopped), Some(StopReason::MaxTime)) => "stopped: time".to_owned(),
            (Some(RunStatus::Stopped), Some(reason)) => format!("stopped: {}", reason.describe()),
            (Some(RunStatus::Stopped | RunStatus::Done), _) => "ended".to_owned(),
            (Some(RunStatus::Interrupted), _) => "interrupted".to_owned(),
            (Some(RunStatus::Failed), _) => "failed".to_owned(),
            (Some(RunStatus::Running), _) => "running, or broken off".to_owned(),
        }
    }
}

/// Columns behind those of the keys.
const HEAD: [&str; 10] = [
    "run",
    "status",
    "F / F₀",
    "on a fresh mesh",
    "F initial",
    "F best",
    "evaluations",
    "worst quality",
    "time",
    "memory",
];

fn table(html: &mut Html, comparison: &Comparison) {
    let rows = &comparison.combinations;
    let shown = rows.len().min(MOST_ROWS);
    if shown < rows.len() {
        html.leaf(
            "p",
            &[("class", "note")],
            &format!("The first {shown} of {} rows; sweep.csv has all.", rows.len()),
        );
    }
    html.element("div", &[("class", "scroll"), ("tabindex", "0")], |html| {
        html.element("table", &[], |html| {
            html.element("thead", &[], |html| {
                html.element("tr", &[], |html| {
                    let cells = comparison.keys.iter().map(String::as_str).chain(HEAD);
                    cells.for_each(|cell| html.leaf("th", &[("scope", "col")], cell));
                });
            });
            html.element("tbody", &[], |html| {
                for (i, row) in rows[..shown].iter().enumerate() {
                    let class: &[_] = if comparison.best == Some(i) { &[("class", "marked")] } else { &[] };
                    html.element("tr", class, |html| cells(html, row));
                }
            });
        });
    });
    if comparison.best.is_some() {
        let note = "Marked: the best F / F₀ of the runs that keep their constraints.";
        html.leaf("p", &[("class", "note")], note);
    }
}

fn cells(html: &mut Html, row: &Row) {
    let shown = |value: Option<f64>| value.map_or("–".to_owned(), |value| number(value, 4));
    row.values.iter().for_each(|value| html.leaf("td", &[], value));
    html.element("td", &[], |html| {
        let (target, text) = match (row.is_reported, row.status) {
            (true, _) => ("report.html", "report"),
            (false, Some(_)) => ("", "files"),
            (false, None) => return html.text("–"),
        };
        html.leaf("a", &[("href", &format!("{}/{target}", address(&row.directory)))], text);
    });
    let memory = row.peak_memory_bytes.filter(|bytes| *bytes > 0);
    for cell in [
        row.told(),
        shown(row.ratio),
        shown(row.verified_ratio),
        shown(row.objective_initial),
        shown(row.objective_best),
        row.evaluations.map_or("–".to_owned(), |count| count.to_string()),
        shown(row.worst_quality),
        row.seconds.map_or("–".to_owned(), duration),
        memory.map_or("–".to_owned(), |bytes| format!("{} MB", bytes.div_ceil(1_000_000))),
    ] {
        html.leaf("td", &[], &cell);
    }
}
