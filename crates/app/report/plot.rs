//! Axes, scales and colour bars as inline SVG, in units that are pixels on a phone.

use super::colour::ColourMap;
use super::html::Html;
use super::ticks::{Count, labels, linear, logarithmic};

/// Width of every figure: a phone shows it as it is, a larger screen larger.
pub(crate) const WIDTH: f64 = 360.0;

/// Room for the labels of the vertical axis, and on the other side.
pub(crate) const LEFT: f64 = 46.0;
pub(crate) const RIGHT: f64 = 12.0;

/// Room for the title of the vertical axis, and for ticks and title of the horizontal one.
pub(crate) const TOP: f64 = 24.0;
pub(crate) const BOTTOM: f64 = 36.0;

/// Values along one axis, and where they are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scale {
    pub(crate) low: f64,
    pub(crate) high: f64,
    pub(crate) count: Count,
    /// Places of the lowest and the highest value.
    pub(crate) pixels: [f64; 2],
}

impl Scale {
    /// Share of the scale at a value, 0 to 1 inside.
    pub(crate) fn share(&self, value: f64) -> f64 {
        let share = match self.count {
            Count::Linear => (value - self.low) / (self.high - self.low),
            Count::Logarithmic => (value / self.low).ln() / (self.high / self.low).ln(),
        };
        if share.is_nan() { 0.0 } else { share }
    }

    /// The place of a value.
    pub(crate) fn at(&self, value: f64) -> f64 {
        self.pixels[0] + self.share(value).clamp(-1.0, 2.0) * (self.pixels[1] - self.pixels[0])
    }

    /// Places and texts of the ticks, at most about `most`.
    pub(crate) fn ticks(&self, most: usize) -> Vec<(f64, String)> {
        let values = match self.count {
            Count::Linear => linear(self.low, self.high, most),
            Count::Logarithmic => logarithmic(self.low, self.high, most),
        };
        let texts = match self.count {
            Count::Linear => labels(&values),
            Count::Logarithmic => values.iter().map(|v| super::ticks::number(*v, 1)).collect(),
        };
        values.into_iter().map(|v| self.at(v)).zip(texts).collect()
    }
}

/// A coordinate in the drawing.
pub(crate) fn px(value: f64) -> String {
    let text = format!("{value:.1}");
    text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
}

/// A drawing that is read out as `label`.
pub(crate) fn svg(html: &mut Html, height: f64, label: &str, content: impl FnOnce(&mut Html)) {
    let view = format!("0 0 {} {}", px(WIDTH), px(height));
    html.element("svg", &[("viewBox", &view), ("role", "img"), ("aria-label", label)], content);
    html.newline();
}

/// A text of a class at a place.
pub(crate) fn text(html: &mut Html, class: &str, x: f64, y: f64, text: &str) {
    html.leaf("text", &[("class", class), ("x", &px(x)), ("y", &px(y))], text);
}

/// A line of a class between two places.
pub(crate) fn line(html: &mut Html, class: &str, from: [f64; 2], to: [f64; 2]) {
    let path = format!("M{} {}L{} {}", px(from[0]), px(from[1]), px(to[0]), px(to[1]));
    html.void("path", &[("class", class), ("d", &path)]);
}

/// Lines across the drawing at the ticks of the vertical axis.
pub(crate) fn grid(html: &mut Html, x: &Scale, y: &Scale, ticks: usize) {
    for (at, _) in y.ticks(ticks) {
        line(html, "grid", [x.pixels[0], at], [x.pixels[1], at]);
    }
}

/// Ticks, and titles with units of both axes; the title of the vertical axis stands above it.
pub(crate) fn axes(html: &mut Html, x: &Scale, y: &Scale, titles: [&str; 2], ticks: [usize; 2]) {
    let [left, right] = x.pixels;
    let [bottom, top] = y.pixels;
    for (at, label) in y.ticks(ticks[1]) {
        line(html, "axis", [left - 3.0, at], [left, at]);
        text(html, "tick end", left - 5.0, at + 3.5, &label);
    }
    for (at, label) in x.ticks(ticks[0]) {
        line(html, "axis", [at, bottom], [at, bottom + 4.0]);
        text(html, "tick middle", at, bottom + 15.0, &label);
    }
    line(html, "axis", [left, bottom], [right, bottom]);
    line(html, "axis", [left, bottom], [left, top]);
    text(html, "title middle", 0.5 * (left + right), bottom + 30.0, titles[0]);
    text(html, "title", 2.0, top - 9.0, titles[1]);
}

/// Most points of a line: two for each pixel of the drawing's width would be more than is seen.
const MOST_POINTS: usize = 600;

/// A line through points; of very many the lowest and the highest of every group.
pub(crate) fn polyline(html: &mut Html, class: &str, points: &[[f64; 2]]) {
    let group = (2 * points.len()).div_ceil(MOST_POINTS);
    let kept: Vec<[f64; 2]> = if points.len() <= MOST_POINTS {
        points.to_vec()
    } else {
        points.chunks(group).flat_map(lowest_and_highest).collect()
    };
    let mut path = String::new();
    for (i, [x, y]) in kept.iter().enumerate() {
        path += &format!("{}{} {}", if i == 0 { "M" } else { "L" }, px(*x), px(*y));
    }
    html.void("path", &[("class", class), ("d", &path)]);
}

/// In their order.
fn lowest_and_highest(points: &[[f64; 2]]) -> [[f64; 2]; 2] {
    let by_height = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
    let (low, high) = (points.iter().min_by(by_height), points.iter().max_by(by_height));
    let [low, high] = [low, high].map(|p| p.copied().unwrap_or_default());
    if low[0] <= high[0] { [low, high] } else { [high, low] }
}

/// A dot of a class.
pub(crate) fn dot(html: &mut Html, class: &str, [x, y]: [f64; 2], radius: f64) {
    html.void("circle", &[("class", class), ("cx", &px(x)), ("cy", &px(y)), ("r", &px(radius))]);
}

/// A horizontal bar that explains a colour map, at a height; `id` is that of its gradient on the page.
pub(super) fn colour_bar(html: &mut Html, id: &str, map: ColourMap, scale: &Scale, title: &str, top: f64) {
    let [left, right] = scale.pixels;
    html.element("linearGradient", &[("id", id)], |html| {
        for i in 0..=24 {
            let share = f64::from(i) / 24.0;
            html.void("stop", &[("offset", &format!("{share:.4}")), ("stop-color", &map.css(share))]);
        }
    });
    let fill = format!("url(#{id})");
    let size = [("width", px(right - left)), ("height", px(9.0))];
    html.void(
        "rect",
        &[
            ("fill", &fill),
            ("x", &px(left)),
            ("y", &px(top)),
            (size[0].0, &size[0].1),
            (size[1].0, &size[1].1),
        ],
    );
    for (at, label) in scale.ticks(5) {
        line(html, "axis", [at, top + 9.0], [at, top + 12.0]);
        text(html, "tick middle", at, top + 23.0, &label);
    }
    text(html, "title middle", 0.5 * (left + right), top + 38.0, title);
}

/// Height that a colour bar takes.
pub(super) const BAR: f64 = 50.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_line_keeps_its_extremes() {
        let points: Vec<[f64; 2]> =
            (0..100_000).map(|i| [f64::from(i) * 1e-3, if i == 77_777 { 50.0 } else { 0.0 }]).collect();
        let mut html = Html::default();
        polyline(&mut html, "curve", &points);
        assert!(html.markup().len() < 10_000 && html.markup().contains("77.8 50"), "{}", html.markup().len());
    }

    #[test]
    fn a_scale_maps_its_ends_and_its_middle() {
        let linear = Scale { low: 5.0, high: 30.0, count: Count::Linear, pixels: [100.0, 0.0] };
        assert_eq!((linear.at(5.0), linear.at(30.0), linear.at(17.5)), (100.0, 0.0, 50.0));
        let decades = Scale { low: 1e-4, high: 1.0, count: Count::Logarithmic, pixels: [0.0, 100.0] };
        assert!((decades.at(1e-2) - 50.0).abs() < 1e-9);
        let flat = Scale { low: 1.0, high: 1.0, count: Count::Linear, pixels: [3.0, 9.0] };
        assert_eq!(flat.at(1.0), 3.0);
    }
}
