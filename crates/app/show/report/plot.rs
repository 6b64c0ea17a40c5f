//! Axes, scales and colour bars as inline SVG, in units that are pixels on a phone.

use maud::{Markup, html};

use super::colour::ColourMap;
use super::plane::extremes;
use super::ticks::{Count, common_power, labels, linear, logarithmic, number, power_of_ten};

/// Width of every figure: a phone shows it as it is, a larger screen larger.
pub(crate) const WIDTH: f64 = 360.0;

/// Room for the labels of the vertical axis, and on the other side.
pub(crate) const LEFT: f64 = 60.0;
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

/// Positive values that differ by more than this factor are drawn by factors.
pub(super) const WIDE: f64 = 30.0;

/// Share of the scale that is added on both sides of the values.
const ROOM: f64 = 0.06;

impl Scale {
    /// With some room around finite values; 0 to 1 where there are none.
    pub(crate) fn around(values: impl Iterator<Item = f64>, pixels: [f64; 2]) -> Self {
        let [low, high] = extremes(values.filter(|value| value.is_finite()));
        let (low, high, count) = if low > high {
            (0.0, 1.0, Count::Linear)
        } else if low > 0.0 && high / low > WIDE {
            let room = (high / low).powf(ROOM);
            (low / room, high * room, Count::Logarithmic)
        } else {
            let room = if high > low { ROOM * (high - low) } else { 0.1 * high.abs().max(1e-9) };
            (low - room, high + room, Count::Linear)
        };
        Self { low, high, count, pixels }
    }

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

    /// Places and texts of the ticks, at most about `most`; where all are very small or large, as multiples of a power of ten.
    pub(crate) fn ticks(&self, most: usize) -> Vec<(f64, String)> {
        let values = self.values(most);
        let texts = match (self.count, common_power(&values)) {
            (Count::Linear, None) => labels(&values),
            (Count::Linear, Some(power)) => {
                let unit = 10f64.powi(power);
                labels(&values.iter().map(|value| value / unit).collect::<Vec<_>>())
            }
            (Count::Logarithmic, _) => values.iter().map(|v| number(*v, 1)).collect(),
        };
        values.into_iter().map(|v| self.at(v)).zip(texts).collect()
    }

    fn values(&self, most: usize) -> Vec<f64> {
        match self.count {
            Count::Linear => linear(self.low, self.high, most),
            Count::Logarithmic => logarithmic(self.low, self.high, most),
        }
    }

    /// A title with the power of ten of the ticks, in front of its unit where it has one.
    pub(crate) fn titled(&self, title: &str, most: usize) -> String {
        let power =
            common_power(&self.values(most)).filter(|_| self.count == Count::Linear).map(power_of_ten);
        match (power, title.rsplit_once('[')) {
            (None, _) => title.to_owned(),
            (Some(power), Some((name, unit))) => format!("{name}[{power} {unit}"),
            (Some(power), None) => format!("{title} [{power}]"),
        }
    }
}

/// A coordinate in the drawing.
pub(crate) fn px(value: f64) -> String {
    let text = format!("{value:.1}");
    text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
}

/// A drawing that is read out as `label`.
pub(crate) fn svg(height: f64, label: &str, content: &Markup) -> Markup {
    html! { svg viewBox={ "0 0 " (px(WIDTH)) " " (px(height)) } role="img" aria-label=(label) { (content) } }
}

/// A text of a class at a place.
pub(crate) fn text(class: &str, x: f64, y: f64, words: &str) -> Markup {
    html! { text class=(class) x=(px(x)) y=(px(y)) { (words) } }
}

/// A line of a class between two places.
pub(crate) fn line(class: &str, from: [f64; 2], to: [f64; 2]) -> Markup {
    html! { path class=(class) d=(path(&[from, to])) {} }
}

/// A rectangle of a class: left, top, width, height.
pub(super) fn rect(class: &str, [left, top, width, height]: [f64; 4]) -> Markup {
    html! { rect class=(class) x=(px(left)) y=(px(top)) width=(px(width)) height=(px(height)) {} }
}

/// Straight lines from point to point.
pub(super) fn path(points: &[[f64; 2]]) -> String {
    let step =
        |(i, [x, y]): (usize, &[f64; 2])| format!("{}{} {}", if i == 0 { "M" } else { "L" }, px(*x), px(*y));
    points.iter().enumerate().map(step).collect()
}

/// Lines across the drawing at the ticks of the vertical axis.
pub(crate) fn grid(x: &Scale, y: &Scale, ticks: usize) -> Markup {
    html! { @for (at, _) in y.ticks(ticks) { (line("grid", [x.pixels[0], at], [x.pixels[1], at])) } }
}

/// Ticks, and titles with units of both axes; the title of the vertical axis stands above it.
pub(crate) fn axes(x: &Scale, y: &Scale, titles: [&str; 2], ticks: [usize; 2]) -> Markup {
    let [left, right] = x.pixels;
    let [bottom, top] = y.pixels;
    html! {
        @for (at, label) in y.ticks(ticks[1]) {
            (line("axis", [left - 3.0, at], [left, at]))
            (text("tick end", left - 5.0, at + 3.5, &label))
        }
        @for (at, label) in x.ticks(ticks[0]) {
            (line("axis", [at, bottom], [at, bottom + 4.0]))
            (text("tick middle", at, bottom + 15.0, &label))
        }
        (line("axis", [left, bottom], [right, bottom]))
        (line("axis", [left, bottom], [left, top]))
        (text("title middle", 0.5 * (left + right), bottom + 30.0, &x.titled(titles[0], ticks[0])))
        (text("title", 2.0, top - 9.0, &y.titled(titles[1], ticks[1])))
    }
}

/// Most points of a line: two for each pixel of the drawing's width would be more than is seen.
const MOST_POINTS: usize = 600;

/// A line through points; of very many the lowest and the highest of every group.
pub(crate) fn polyline(class: &str, points: &[[f64; 2]]) -> Markup {
    let group = (2 * points.len()).div_ceil(MOST_POINTS);
    let d = if points.len() <= MOST_POINTS {
        path(points)
    } else {
        path(&points.chunks(group).flat_map(lowest_and_highest).collect::<Vec<_>>())
    };
    html! { path class=(class) d=(d) {} }
}

/// In their order.
fn lowest_and_highest(points: &[[f64; 2]]) -> [[f64; 2]; 2] {
    let by_height = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
    let (low, high) = (points.iter().min_by(by_height), points.iter().max_by(by_height));
    let [low, high] = [low, high].map(|p| p.copied().unwrap_or_default());
    if low[0] <= high[0] { [low, high] } else { [high, low] }
}

/// A dot of a class.
pub(crate) fn dot(class: &str, [x, y]: [f64; 2], radius: f64) -> Markup {
    html! { circle class=(class) cx=(px(x)) cy=(px(y)) r=(px(radius)) {} }
}

/// A horizontal bar that explains a colour map, at a height; `id` is that of its gradient on the page.
pub(super) fn colour_bar(id: &str, map: ColourMap, scale: &Scale, title: &str, top: f64) -> Markup {
    let [left, right] = scale.pixels;
    html! {
        linearGradient id=(id) {
            @for share in (0..=24).map(|i| f64::from(i) / 24.0) {
                stop offset=(format!("{share:.4}")) stop-color=(map.css(share)) {}
            }
        }
        rect fill={ "url(#" (id) ")" } x=(px(left)) y=(px(top)) width=(px(right - left)) height="9" {}
        @for (at, label) in scale.ticks(BAR_TICKS) {
            (line("axis", [at, top + 9.0], [at, top + 12.0]))
            (text("tick middle", at, top + 23.0, &label))
        }
        (text("title middle", 0.5 * (left + right), top + 38.0, &scale.titled(title, BAR_TICKS)))
    }
}

/// Ticks of a colour bar, at most about so many.
const BAR_TICKS: usize = 5;

/// Height that a colour bar takes.
pub(super) const BAR: f64 = 50.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_line_keeps_its_extremes() {
        let points: Vec<[f64; 2]> =
            (0..100_000).map(|i| [f64::from(i) * 1e-3, if i == 77_777 { 50.0 } else { 0.0 }]).collect();
        let drawn = polyline("curve", &points).into_string();
        assert!(drawn.len() < 10_000 && drawn.contains("77.8 50"), "{}", drawn.len());
    }

    #[test]
    fn labels_of_the_vertical_axis_are_whole() {
        // Characters of 11 pixels are up to 6.2 wide, and end 5 pixels before the axis.
        let most = ((LEFT - 5.0) / 6.2) as usize;
        for exponent in -12..12 {
            for (low, high) in [(1.0, 1.9), (1.234, 1.238), (-3.0, 5.0), (0.0, 7.0), (2.0, 59.0)] {
                let unit = 10f64.powi(exponent);
                let scale = Scale::around([low * unit, high * unit].into_iter(), [174.0, 24.0]);
                for (_, label) in scale.ticks(5) {
                    assert!(label.chars().count() <= most, "{label} of {low} to {high} times 1e{exponent}");
                }
            }
        }
        let small = Scale::around([1.4e-7, 1.8e-7].into_iter(), [0.0, 1.0]);
        assert_eq!(small.ticks(5)[0].1, "1.40");
        assert_eq!(small.titled("loss [W]", 5), "loss [10⁻⁷ W]");
        assert_eq!(small.titled("share", 5), "share [10⁻⁷]");
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
