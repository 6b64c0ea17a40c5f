//! `sweep.html`: one page that compares the runs of a sweep, in the form of the report about a single run.

use maud::{Markup, html};

use super::comparison::{Comparison, Row};
use super::{Criterion, Sweep, plots};
use crate::files::{RunStatus, StopReason, Verdict};
use crate::show::report::markup::{Card, address, document, footer, header, note, section, table};
use crate::show::report::ticks::{duration, number};

/// What this page has beside the style of the report.
const OWN_STYLE: &str = include_str!("style.css");

/// Rows of the table; `sweep.csv` has all.
const MOST_ROWS: usize = 2000;

/// Values of a key that are listed in words.
const MOST_VALUES: usize = 12;

/// Files beside the page.
const FILES: [(&str, &str); 3] = [
    ("sweep.csv", "the table above, with all digits"),
    ("sweep.json", "keys, values, and the command of every combination"),
    ("logs/", "what every run has said"),
];

/// The page.
pub(super) fn page(sweep: &Sweep, comparison: &Comparison) -> String {
    let files = html! {
        ul class="files" {
            @for (file, what) in FILES { li { a href=(file) { (file) } span class="note" { (what) } } }
        }
    };
    let content = html! {
        (head(sweep, comparison))
        (section("comparison", "Comparison", &rows(comparison)))
        @if let Some((title, figure)) = plots::front(comparison) {
            (section("front", &title, &html! { (figure) (front(comparison)) }))
        }
        @if let Some((title, figure)) = plots::over_value(comparison) { (section("over-value", &title, &figure)) }
        (section("convergence", "Convergence", &plots::convergence(comparison)))
        (section("files", "Files", &files))
        (footer("the runs"))
    };
    document(&format!("{} · fluxmorph sweep", sweep.title), OWN_STYLE, "", &content)
}

fn head(sweep: &Sweep, comparison: &Comparison) -> Markup {
    let rows = &comparison.combinations;
    let ended = rows.iter().filter(|row| row.has_ended()).count();
    let failed = rows.iter().filter(|row| row.status == Some(RunStatus::Failed)).count();
    let class = match (failed, ended == rows.len()) {
        (0, true) => "good",
        (0, false) => "fair",
        _ => "bad",
    };
    let more = if failed > 0 { format!(", {failed} failed") } else { String::new() };
    let status = format!("{ended} of {} combinations have ended{more}", rows.len());
    let cards = cards(comparison, ended);
    header("Sweep of shape optimisations", &sweep.title, (class, &status), &lead(sweep), &cards)
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

fn cards(comparison: &Comparison, ended: usize) -> Vec<Card> {
    let rows = &comparison.combinations;
    let mut all = vec![("combinations", rows.len().to_string(), format!("{ended} have ended"))];
    if let Some((row, value)) =
        comparison.best.and_then(|best| Some((&rows[best], rows[best].objective_best?)))
    {
        all.push(("best F", number(value, 4), row.directory.clone()));
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

    /// How far it is, in words, with the constraints that its best design violates and what came of the check of its gain.
    pub fn describe(&self) -> String {
        let mut words = self.how_it_ended();
        if !self.violated.is_empty() {
            words += &format!(", violates {}", self.violated.join(", "));
        }
        if self.verdict == Some(Verdict::NotConfirmed) {
            words += ", gain not confirmed";
        }
        if let Some(difference) = &self.difference {
            words += &format!(", not compared: {difference}");
        }
        words
    }

    fn how_it_ended(&self) -> String {
        match (self.status, self.stop_reason) {
            (None, _) => "not begun".to_owned(),
            (Some(RunStatus::Converged), _) => "converged".to_owned(),
            (Some(RunStatus::Stopped), Some(StopReason::MaxEvaluations)) => "stopped: evaluations".to_owned(),
            (Some(RunStatus::Stopped), Some(StopReason::MaxTime)) => "stopped: time".to_owned(),
            (Some(RunStatus::Stopped), Some(reason)) => format!("stopped: {}", reason.describe()),
            (Some(RunStatus::Stopped | RunStatus::Done), _) => "ended".to_owned(),
            (Some(RunStatus::Interrupted), _) => "interrupted".to_owned(),
            (Some(RunStatus::Failed), _) => "failed".to_owned(),
            (Some(RunStatus::Running), _) => "running or interrupted".to_owned(),
        }
    }
}

/// Columns after those of the keys.
const HEAD: [&str; 10] = [
    "run",
    "status",
    "F / F₀",
    "on a finer mesh",
    "F initial",
    "F best",
    "evaluations",
    "worst quality",
    "time",
    "memory",
];

fn rows(comparison: &Comparison) -> Markup {
    let all = &comparison.combinations;
    let shown = all.len().min(MOST_ROWS);
    let head: Vec<&str> = comparison.keys.iter().map(String::as_str).chain(HEAD).collect();
    let rows: Vec<Vec<Markup>> = all[..shown].iter().map(cells).collect();
    html! {
        @if shown < all.len() { (note(&format!("The first {shown} of {} rows; sweep.csv has all.", all.len()))) }
        (table(&head, &rows, comparison.best))
        @if comparison.goal.is_none() {
            (note("The runs have different objectives: none is the best."))
        } @else if comparison.best.is_some() {
            (note("Marked: the best F of the runs that keep their constraints. Where a current or a frequency is swept, F follows that too."))
        }
    }
}

/// The runs on the front.
fn front(comparison: &Comparison) -> Markup {
    let titles: Vec<String> = comparison.criteria.iter().map(Criterion::title).collect();
    let titles = titles.iter().map(String::as_str);
    let head: Vec<&str> = comparison.keys.iter().map(String::as_str).chain(titles).collect();
    let row = |&index: &usize| -> Vec<String> {
        let row = &comparison.combinations[index];
        row.values.iter().cloned().chain(row.criteria.iter().map(|value| number(*value, 5))).collect()
    };
    let rows: Vec<Vec<String>> = comparison.front.iter().take(MOST_ROWS).map(row).collect();
    table(&head, &rows, None)
}

fn cells(row: &Row) -> Vec<Markup> {
    let shown = |value: Option<f64>| value.map_or("–".to_owned(), |value| number(value, 4));
    let run = match &row.file {
        Some((file, text)) => html! { a href=(address(file)) { (text) } },
        None => html! { "–" },
    };
    let memory = row.peak_memory_bytes.filter(|bytes| *bytes > 0);
    let texts = [
        row.describe(),
        shown(row.ratio),
        shown(row.verified_ratio),
        shown(row.objective_initial),
        shown(row.objective_best),
        row.evaluations.map_or("–".to_owned(), |count| count.to_string()),
        shown(row.worst_quality),
        row.seconds.map_or("–".to_owned(), duration),
        memory.map_or("–".to_owned(), |bytes| format!("{} MiB", bytes.div_ceil(1 << 20))),
    ];
    let text = |text: &String| html! { (text) };
    row.values.iter().map(text).chain([run]).chain(texts.iter().map(text)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_says_what_speaks_against_it() {
        let ended = Row { status: Some(RunStatus::Converged), ..Row::default() };
        assert_eq!(ended.describe(), "converged");
        let doubtful =
            Row { violated: vec!["mass".to_owned()], verdict: Some(Verdict::NotConfirmed), ..ended };
        assert_eq!(doubtful.describe(), "converged, violates mass, gain not confirmed");
        let other = Row { difference: Some("it is another".to_owned()), ..Row::default() };
        assert_eq!(other.describe(), "not begun, not compared: it is another");
    }
}
