//! Figures of the page: the gain over a swept number, and the course of every search.

use maud::{Markup, html};

use super::Criterion;
use super::comparison::{Comparison, Row};
use crate::show::report::markup::missing;
use crate::show::report::plot::{BOTTOM, LEFT, RIGHT, Scale, TOP, WIDTH, axes, dot, grid, polyline, svg};
use crate::show::report::ticks::{Count, number};

/// Height of a drawing area.
const HEIGHT: f64 = 190.0;

/// Curves in one figure: more could not be distinguished.
const MOST_CURVES: usize = 24;

/// Colours of the style sheet; with three strokes each they make [`MOST_CURVES`].
const COLOURS: usize = 8;

/// Title and figure of what the runs are compared by over the value, where a single key is swept over numbers of one unit.
pub(super) fn over_value(comparison: &Comparison) -> Option<(String, Markup)> {
    let [key] = &comparison.keys[..] else { return None };
    let (unit, values) = numbers(&comparison.combinations)?;
    let rows = &comparison.combinations;
    let known = |(i, row): (usize, &Row)| Some((i, [values[i], comparison.compared_value(row)?]));
    let mut points: Vec<(usize, [f64; 2])> = rows.iter().enumerate().filter_map(known).collect();
    points.sort_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]));
    let axis = if unit.is_empty() { key.clone() } else { format!("{key} [{unit}]") };
    let describe =
        |(i, [_, value]): &(usize, [f64; 2])| format!("{} at {}", number(*value, 4), rows[*i].values[0]);
    let best = points.iter().find(|(i, _)| Some(*i) == comparison.best);
    let ring = best.map_or(String::new(), |best| format!("; best (ring): {}", describe(best)));
    let (first, last) = (describe(points.first()?), describe(points.last()?));
    let measure = comparison.compared_symbol();
    let caption = format!("{measure} over {key}: {first}, {last}{ring}.");
    let x = Scale::around(points.iter().map(|(_, p)| p[0]), [LEFT + 10.0, WIDTH - RIGHT - 6.0]);
    let y = Scale::around(points.iter().map(|(_, p)| p[1]), [TOP + HEIGHT, TOP]);
    let place = |(_, [swept, value]): &(usize, [f64; 2])| [x.at(*swept), y.at(*value)];
    let places: Vec<[f64; 2]> = points.iter().map(place).collect();
    let content = html! {
        (grid(&x, &y, 5))
        (axes(&x, &y, [&axis, &format!("objective {measure}")], [6, 5]))
        (polyline("curve", &places))
        @for at in &places { (dot("point", *at, 2.6)) }
        @if let Some(best) = best { (dot("best", place(best), 5.0)) }
    };
    Some((format!("{measure} over {key}"), figure("over-value", &caption, &content)))
}

/// Title and figure of two quantities that the runs trade for each other; those on the front are joined, and marked.
pub(super) fn front(comparison: &Comparison) -> Option<(String, Markup)> {
    let [first, second] = &comparison.criteria[..] else { return None };
    let points: Vec<(usize, [f64; 2])> = comparison.points().collect();
    if points.is_empty() {
        return None;
    }
    let better = |criterion: &Criterion| if criterion.smaller_is_better { "smaller" } else { "larger" };
    let caption = format!(
        "{} over {}: {} of {} runs are on the front (joined), where no other run is better in both; better is the {} {} and the \
         {} {}. A run that violates a constraint is not on it.",
        second.name,
        first.name,
        comparison.front.len(),
        points.len(),
        better(first),
        first.name,
        better(second),
        second.name
    );
    let x = Scale::around(points.iter().map(|(_, p)| p[0]), [LEFT + 10.0, WIDTH - RIGHT - 6.0]);
    let y = Scale::around(points.iter().map(|(_, p)| p[1]), [TOP + HEIGHT, TOP]);
    let at = |p: &[f64; 2]| [x.at(p[0]), y.at(p[1])];
    let of_row = |row: &usize| points.iter().find(|(index, _)| index == row).map(|(_, p)| at(p));
    let joined: Vec<[f64; 2]> = comparison.front.iter().filter_map(of_row).collect();
    let content = html! {
        (grid(&x, &y, 5))
        (axes(&x, &y, [&first.title(), &second.title()], [6, 5]))
        (polyline("curve", &joined))
        @for (_, p) in &points { (dot("point", at(p), 2.6)) }
        @for p in &joined { (dot("best", *p, 4.0)) }
    };
    Some(("Pareto front".to_owned(), figure("front", &caption, &content)))
}

fn figure(kind: &str, caption: &str, content: &Markup) -> Markup {
    html! {
        figure class="chart narrow" data-chart=(kind) {
            (svg(TOP + HEIGHT + BOTTOM, caption, content))
            figcaption { (caption) }
        }
    }
}

/// F / F₀ of every evaluation of every run.
pub(super) fn convergence(comparison: &Comparison) -> Markup {
    let begun: Vec<(usize, &Row)> =
        comparison.combinations.iter().enumerate().filter(|(_, row)| !row.curve.is_empty()).collect();
    if begun.is_empty() {
        return missing("the convergence", "no evaluation was completed");
    }
    // The best is among those that are drawn.
    let mut drawn: Vec<(usize, &Row)> = begun.iter().copied().take(MOST_CURVES).collect();
    if let Some(best) = begun.iter().find(|(i, _)| Some(*i) == comparison.best)
        && !drawn.iter().any(|(i, _)| *i == best.0)
        && let Some(last) = drawn.last_mut()
    {
        *last = *best;
    }
    let longest = drawn.iter().filter_map(|(_, row)| row.curve.last()).fold(1.0_f64, |n, p| n.max(p[0]));
    let x = Scale { low: 0.0, high: longest, count: Count::Linear, pixels: [LEFT + 6.0, WIDTH - RIGHT] };
    let ratios = drawn.iter().flat_map(|(_, row)| row.curve.iter().map(|p| p[1]));
    let y = Scale::around(ratios, [TOP + HEIGHT, TOP]);
    let more = match begun.len() - drawn.len() {
        0 => String::new(),
        _ => format!(", of {} that have begun", begun.len()),
    };
    let count = drawn.len();
    let bold = if comparison.best.is_some() { "; the best run is drawn bold" } else { "" };
    let caption = format!("F / F₀ of {count} runs up to evaluation {longest}{more}{bold}.");
    let curves: Vec<(String, &Row)> =
        drawn.iter().enumerate().map(|(k, (i, row))| (class(k, comparison.best == Some(*i)), *row)).collect();
    let curve = |row: &Row| row.curve.iter().map(|[e, r]| [x.at(*e), y.at(*r)]).collect::<Vec<_>>();
    let content = html! {
        (grid(&x, &y, 5))
        (axes(&x, &y, ["evaluation", "objective F / F₀"], [(longest as usize).min(8), 5]))
        @for (class, row) in &curves { (polyline(class, &curve(row))) }
    };
    html! {
        figure class="chart narrow" data-chart="convergence" {
            (svg(TOP + HEIGHT + BOTTOM, &format!("Convergence. {caption}"), &content))
            figcaption { (caption) }
            ul class="key" { @for (class, row) in &curves { li { (stroke(class, row)) span { (row.directory) } } } }
        }
    }
}

/// A piece of the curve of a run, for the key.
fn stroke(class: &str, row: &Row) -> Markup {
    html! {
        svg viewBox="0 0 26 10" role="img" aria-label={ "Stroke of the run " (row.directory) } {
            path class=(class) d="M1 5L25 5" {}
        }
    }
}

/// The class of a curve by its place among those drawn.
fn class(place: usize, is_best: bool) -> String {
    let stroke = ["", " dashed", " dotted"][(place / COLOURS) % 3];
    format!("k k{}{stroke}{}", place % COLOURS, if is_best { " strong" } else { "" })
}

/// The values of the one swept key as numbers with their unit; `None` unless all are, in the same unit.
fn numbers(rows: &[Row]) -> Option<(String, Vec<f64>)> {
    let read = |row: &Row| {
        let [value] = &row.values[..] else { return None };
        let value = value.trim_matches(['"', '\'']).trim();
        // The longest beginning that is a number: what is left is its unit.
        let end = (1..=value.len()).rev().filter(|&end| value.is_char_boundary(end));
        let found =
            end.filter_map(|end| Some((value[..end].trim().parse::<f64>().ok()?, value[end..].trim())));
        found.filter(|(number, _)| number.is_finite()).map(|(number, unit)| (number, unit.to_owned())).next()
    };
    let all: Vec<(f64, String)> = rows.iter().map(read).collect::<Option<_>>()?;
    let unit = all.first()?.1.clone();
    let is_unit = unit.is_empty() || unit.starts_with(|c: char| c.is_alphabetic() || matches!(c, '°' | '%'));
    (is_unit && all.iter().all(|(_, own)| *own == unit))
        .then(|| (unit, all.iter().map(|(n, _)| *n).collect()))
}
