//! Figures of the page: the gain over a swept number, and the way of every search.

use super::comparison::{Comparison, Row};
use crate::report::html::Html;
use crate::report::plot::{BOTTOM, LEFT, RIGHT, Scale, TOP, WIDTH, axes, dot, grid, polyline, svg};
use crate::report::ticks::{Count, number};

/// Height of a drawing area.
const HEIGHT: f64 = 190.0;

/// Curves in one figure: more could not be told apart.
const MOST_CURVES: usize = 24;

/// Colours of the style sheet; with three strokes each they make [`MOST_CURVES`].
const COLOURS: usize = 8;

/// Values that differ by more than this factor are drawn by factors.
const WIDE: f64 = 30.0;

/// F / F₀ over the value, where a single key is swept over numbers of one unit.
pub(super) fn over_value(html: &mut Html, comparison: &Comparison) {
    let ([key], Some((unit, values))) = (&comparison.keys[..], numbers(&comparison.combinations)) else {
        return;
    };
    let rows = &comparison.combinations;
    let known =
        |(i, row): (usize, &Row)| Some((i, [values[i], row.ratio.filter(|ratio| ratio.is_finite())?]));
    let mut points: Vec<(usize, [f64; 2])> = rows.iter().enumerate().filter_map(known).collect();
    points.sort_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]));
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return };
    let title = if unit.is_empty() { key.clone() } else { format!("{key} [{unit}]") };
    let told =
        |(i, [_, ratio]): &(usize, [f64; 2])| format!("{} at {}", number(*ratio, 4), rows[*i].values[0]);
    let best = points.iter().find(|(i, _)| Some(*i) == comparison.best);
    let ring = best.map_or(String::new(), |best| format!("; best (ring): {}", told(best)));
    let caption = format!("F / F₀ over {key}: {}, {}{ring}.", told(first), told(last));
    let x = scale(points.iter().map(|(_, p)| p[0]), [LEFT + 10.0, WIDTH - RIGHT - 6.0]);
    let y = scale(points.iter().map(|(_, p)| p[1]), [TOP + HEIGHT, TOP]);
    html.element("section", &[("id", "over-value")], |html| {
        html.leaf("h2", &[], &format!("F / F₀ over {key}"));
        html.element("figure", &[("class", "chart narrow"), ("data-chart", "over-value")], |html| {
            svg(html, TOP + HEIGHT + BOTTOM, &caption, |html| {
                grid(html, &x, &y, 5);
                axes(html, &x, &y, [&title, "objective F / F₀"], [6, 5]);
                let places: Vec<[f64; 2]> = points.iter().map(|(_, [v, r])| [x.at(*v), y.at(*r)]).collect();
                polyline(html, "curve", &places);
                places.iter().for_each(|place| dot(html, "point", *place, 2.6));
                if let Some((_, [value, ratio])) = best {
                    dot(html, "best", [x.at(*value), y.at(*ratio)], 5.0);
                }
            });
            html.leaf("figcaption", &[], &caption);
        });
    });
    html.newline();
}

/// F / F₀ of every evaluation of every run.
pub(super) fn convergence(html: &mut Html, comparison: &Comparison) {
    let begun: Vec<(usize, &Row)> =
        comparison.combinations.iter().enumerate().filter(|(_, row)| !row.curve.is_empty()).collect();
    if begun.is_empty() {
        let text = "Not shown: the convergence. Reason: no evaluation was completed.";
        html.leaf("p", &[("class", "missing")], text);
        return;
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
    let y = scale(ratios, [TOP + HEIGHT, TOP]);
    let mut caption = format!("F / F₀ of {} runs up to evaluation {longest}", drawn.len());
    if drawn.len() < begun.len() {
        caption += &format!(", of {} that have begun", begun.len());
    }
    caption += "; the best run is drawn bold.";
    html.element("figure", &[("class", "chart narrow"), ("data-chart", "convergence")], |html| {
        svg(html, TOP + HEIGHT + BOTTOM, &format!("Convergence. {caption}"), |html| {
            grid(html, &x, &y, 5);
            axes(html, &x, &y, ["evaluation", "objective F / F₀"], [(longest as usize).min(8), 5]);
            for (place, (i, row)) in drawn.iter().enumerate() {
                let points: Vec<[f64; 2]> = row.curve.iter().map(|[e, r]| [x.at(*e), y.at(*r)]).collect();
                polyline(html, &class(place, comparison.best == Some(*i)), &points);
            }
        });
        html.leaf("figcaption", &[], &caption);
        html.element("ul", &[("class", "key")], |html| {
            for (place, (i, row)) in drawn.iter().enumerate() {
                html.element("li", &[], |html| {
                    let class = class(place, comparison.best == Some(*i));
                    let label = format!("Stroke of the run {}", row.directory);
                    html.element(
                        "svg",
                        &[("viewBox", "0 0 26 10"), ("role", "img"), ("aria-label", &label)],
                        |html| {
                            html.void("path", &[("class", &class), ("d", "M1 5L25 5")]);
                        },
                    );
                    html.leaf("span", &[], &row.directory);
                });
            }
        });
    });
}

/// The class of a curve by its place among those drawn.
fn class(place: usize, is_best: bool) -> String {
    let stroke = ["", " dashed", " dotted"][(place / COLOURS) % 3];
    format!("k k{}{stroke}{}", place % COLOURS, if is_best { " strong" } else { "" })
}

/// A scale with some room around finite values.
fn scale(values: impl Iterator<Item = f64>, pixels: [f64; 2]) -> Scale {
    let finite = values.filter(|value| value.is_finite());
    let [low, high] = finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
    if !(low.is_finite() && high.is_finite()) {
        return Scale { low: 0.0, high: 1.0, count: Count::Linear, pixels };
    }
    if low > 0.0 && high / low > WIDE {
        let room = (high / low).powf(0.05);
        return Scale { low: low / room, high: high * room, count: Count::Logarithmic, pixels };
    }
    let room = if high > low { 0.06 * (high - low) } else { 0.1 * high.abs().max(1e-9) };
    Scale { low: low - room, high: high + room, count: Count::Linear, pixels }
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
