//! The course of the search: what the history holds against the number of the evaluation.

use maud::{Markup, html};

use super::data::RunData;
use super::plot::{BOTTOM, LEFT, RIGHT, Scale, TOP, WIDTH, axes, dot, grid, line, polyline, svg, text};
use super::ticks::{Count, number};
use super::words::capital;
use crate::show::Evaluation;

/// Height of one drawing area.
const HEIGHT: f64 = 150.0;

/// Constraints that have a figure; the table of evaluations has all.
const MOST_CONSTRAINTS: usize = 12;

/// Bodies whose force has a figure; result.json and history.csv have all.
const MOST_BODIES: usize = 4;

/// Points of a curve that are drawn one by one.
const MOST_DOTS: usize = 60;

/// One quantity of the history.
struct Series<'a> {
    title: String,
    values: Vec<Option<f64>>,
    /// A value that must not be exceeded.
    bound: Option<f64>,
    rows: &'a [Evaluation],
    best: Option<usize>,
    /// Whether the value of the best design stands beside its ring.
    is_labelled: bool,
}

/// All figures.
pub(super) fn figures(data: &RunData) -> Markup {
    let rows = &data.history;
    let series = |title: &str, value: &dyn Fn(&Evaluation) -> Option<f64>| Series {
        title: title.to_owned(),
        values: rows.iter().map(value).map(|v| v.filter(|v| v.is_finite())).collect(),
        bound: None,
        rows,
        best: data.best,
        is_labelled: true,
    };
    let mut all = vec![("objective", series("objective F / F₀", &|row| Some(row.ratio)))];
    let constraints: Vec<&String> =
        rows.first().map(|row| row.constraints.keys().collect()).unwrap_or_default();
    for name in constraints.into_iter().take(MOST_CONSTRAINTS) {
        let plain = name.strip_prefix("c_").unwrap_or(name);
        let title = format!("constraint {plain}: how far beyond its bound, relative to that");
        let mut own = series(&title, &|row| row.constraints.get(name).copied());
        own.bound = Some(0.0);
        all.push(("constraint", own));
    }
    let bodies = rows.first().map(|row| row.forces.as_slice()).unwrap_or_default();
    for (k, body) in bodies.iter().enumerate().take(MOST_BODIES) {
        let size = |row: &Evaluation| {
            let force = row.forces.get(k)?.force_n;
            Some(force.iter().map(|f| f * f).sum::<f64>().sqrt())
        };
        let under = body.state.as_ref().map_or(String::new(), |state| format!(", {state}"));
        all.push(("force", series(&format!("|force| on {}{under} [N]", body.name), &size)));
    }
    all.push((
        "gradient",
        series("norm of the gradient ‖dF/dp‖ [unit of F per m]", &|row| Some(row.gradient_norm)),
    ));
    all.push(("quality", series("worst quality of an element (Eq. 4)", &|row| Some(row.worst_quality))));
    all.push((
        "step",
        series("length of the step [mm]", &|row| Some(1e3 * row.step_norm).filter(|s| *s > 0.0)),
    ));
    for (kind, own) in &mut all {
        own.is_labelled = !matches!(*kind, "gradient" | "step");
    }
    html! {
        div class="grid2" {
            @for (kind, series) in &all {
                figure class="chart" data-chart=(kind) { (series.draw()) figcaption { (series.caption()) } }
            }
        }
    }
}

impl Series<'_> {
    fn known(&self) -> impl Iterator<Item = (&Evaluation, f64)> {
        self.rows.iter().zip(&self.values).filter_map(|(row, value)| Some((row, (*value)?)))
    }

    fn draw(&self) -> Markup {
        let last = self.rows.last().map_or(1, |row| row.evaluation).max(1);
        let pixels = [LEFT + 6.0, WIDTH - RIGHT];
        let x = Scale { low: 0.0, high: last as f64, count: Count::Linear, pixels };
        let y = Scale::around(self.known().map(|(_, v)| v).chain(self.bound), [TOP + HEIGHT, TOP]);
        let point = |(row, value): (&Evaluation, f64)| [x.at(row.evaluation as f64), y.at(value)];
        let points: Vec<[f64; 2]> = self.known().map(point).collect();
        let pairs = || self.rows.windows(2).map(|pair| (&pair[0], &pair[1]));
        let before = |row: &Evaluation| x.at(row.evaluation as f64 - 0.5);
        let levels = pairs().filter(|(a, b)| b.level > a.level).map(|(_, b)| (b.level, before(b)));
        let best = self.known().find(|(row, _)| Some(row.evaluation) == self.best);
        let content = html! {
            (grid(&x, &y, 5))
            (axes(&x, &y, ["evaluation", &self.title], [last.min(8), 5]))
            @for (level, at) in levels {
                (line("bound", [at, y.pixels[0]], [at, y.pixels[1]]))
                (text("tick", at + 3.0, TOP + 21.0, &format!("mesh {level}")))
            }
            @if let Some(bound) = self.bound {
                (line("bound", [x.pixels[0], y.at(bound)], [x.pixels[1], y.at(bound)]))
            }
            (polyline("curve", &points))
            @if points.len() <= MOST_DOTS { @for at in &points { (dot("point", *at, 2.4)) } }
            @if let Some(best) = best { (self.ring(best.1, point(best))) }
        };
        svg(
            TOP + HEIGHT + BOTTOM,
            &format!("{} against the evaluation. {}", self.title, self.caption()),
            &content,
        )
    }

    /// The mark of the best design, its value beside it.
    fn ring(&self, value: f64, at: [f64; 2]) -> Markup {
        let (class, left) = if at[0] > 0.6 * WIDTH { ("mark end", -8.0) } else { ("mark", 8.0) };
        let down = if at[1] > TOP + 0.5 * HEIGHT { -8.0 } else { 16.0 };
        html! {
            (dot("best", at, 4.6))
            @if self.is_labelled {
                (text(class, at[0] + left, at[1] + down, &format!("best: {}", number(value, 4))))
            }
        }
    }

    fn caption(&self) -> String {
        let values: Vec<(&Evaluation, f64)> = self.known().collect();
        let (Some(first), Some(last)) = (values.first(), values.last()) else {
            return format!("{}: no values.", self.title);
        };
        let name = self.title.split(':').next().unwrap_or_default();
        let name = name.split('[').next().unwrap_or_default().trim();
        let mut text = format!(
            "{}: {} at evaluation {}, {} at evaluation {}",
            capital(name),
            number(first.1, 4),
            first.0.evaluation,
            number(last.1, 4),
            last.0.evaluation
        );
        if let Some((row, value)) = values.iter().find(|(row, _)| Some(row.evaluation) == self.best) {
            text += &format!("; best design (ring): evaluation {}, {}", row.evaluation, number(*value, 4));
        }
        if self.bound.is_some() {
            text += "; satisfied where it is not above zero (dashed line)";
        }
        if self.rows.windows(2).any(|pair| pair[1].level > pair[0].level) {
            text += "; dashed upright lines: the mesh was refined, and the search goes on from the best design on it";
        }
        text + "."
    }
}
