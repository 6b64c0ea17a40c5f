//! Before and after: what the field misses of the quality that is asked for, where it is asked for.

use fluxmorph_geometry::ElementId;
use fluxmorph_geometry::tet4::volume;
use maud::{Markup, html};

use super::colour::ColourMap;
use super::cut::{CutPlane, NodeMeans};
use super::data::{RunData, Snapshot};
use super::field::{TALLEST, boundaries};
use super::frame::Frame;
use super::plane::{Plane, bounds, extremes};
use super::plot::{LEFT, RIGHT, Scale, WIDTH, axes, colour_bar, svg};
use super::ticks::{Count, number};
use super::window::Window;
use crate::build::Outline;

/// Share of the picture that is added around the elements.
const ROOM: f64 = 0.04;

/// Units of flux density by their size [T].
const UNITS: [(f64, &str); 4] = [(1.0, "T"), (1e-3, "mT"), (1e-6, "µT"), (1e-9, "nT")];

/// The deviation of one field.
struct Deviation<'a> {
    field: &'a Snapshot,
    /// [T], of every element of the mesh.
    values: &'a [f64],
    /// The elements of which a quality is asked for.
    elements: Vec<ElementId>,
}

impl<'a> Deviation<'a> {
    fn of(outline: &Outline, field: &'a Snapshot) -> Option<Self> {
        let values = field.deviation.as_deref()?;
        // An element whose deviation is zero to the last bit shows nothing either way.
        let elements: Vec<ElementId> =
            outline.mesh.topology().elements().filter(|e| values[e.index()] != 0.0).collect();
        (!elements.is_empty()).then_some(Self { field, values, elements })
    }

    /// Root of the mean square by volume, and the largest size [T].
    fn figures(&self, outline: &Outline) -> [f64; 2] {
        let topology = outline.mesh.topology();
        let (mut sum, mut total, mut largest) = (0.0, 0.0, 0.0_f64);
        for &e in &self.elements {
            let own = volume(topology.tet(e).map(|n| self.field.points[n.index()])).abs();
            let value = self.values[e.index()];
            sum += own * value * value;
            total += own;
            largest = largest.max(value.abs());
        }
        [(sum / total).sqrt(), largest]
    }
}

/// Both figures with their caption; `None` where no quality of the field is asked for.
pub(super) fn figure(data: &RunData, outline: &Outline) -> Option<Result<Markup, String>> {
    let fields = data.fields.iter().flatten();
    let all: Vec<Deviation<'_>> = fields.filter_map(|field| Deviation::of(outline, field)).collect();
    let last = all.last()?;
    let window = window(outline, last);
    Some(drawn(outline, &window, &all))
}

/// Across the shortest extent of the elements, through their middle.
fn window(outline: &Outline, deviation: &Deviation<'_>) -> Window {
    let topology = outline.mesh.topology();
    let points = deviation.elements.iter().flat_map(|&e| topology.tet(e));
    let [low, high] = bounds(points.map(|n| deviation.field.points[n.index()]));
    let length = |d: usize| high[d] - low[d];
    let axis = (0..3).fold(0, |best, d| if length(d) < length(best) { d } else { best });
    let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
    let [right, up] = if length(a) >= length(b) { [a, b] } else { [b, a] };
    let page = Plane::of_axes(right, up, axis);
    let room = ROOM * length(right);
    Window {
        plane: CutPlane { axis, at: 0.5 * (low[axis] + high[axis]) },
        low: page.flat(low.map(|c| c - room)),
        high: page.flat(high.map(|c| c + room)),
        page,
    }
}

fn drawn(outline: &Outline, window: &Window, all: &[Deviation<'_>]) -> Result<Markup, String> {
    let [low, high] = extremes(all.iter().flat_map(|own| own.elements.iter().map(|e| own.values[e.index()])));
    let most = low.abs().max(high.abs());
    if !(most.is_finite() && most > 0.0) {
        return Err("the deviation is no number".to_owned());
    }
    let (unit, name) = UNITS.into_iter().find(|(unit, _)| most >= 0.1 * unit).unwrap_or(UNITS[3]);
    let is_signed = low < 0.0;
    let (map, lowest) = if is_signed { (ColourMap::Signed, -most / unit) } else { (ColourMap::Field, 0.0) };
    let pixels = [LEFT, WIDTH - RIGHT];
    let scale = Scale { low: lowest, high: most / unit, count: Count::Linear, pixels };
    let drawing =
        Drawing { outline, window, frame: Frame::new(window.low, window.high, TALLEST), scale, map };
    let title = |k: usize| match (all.len(), k) {
        (1, _) => "Deviation".to_owned(),
        (_, 0) => format!("Before (evaluation {})", all[0].field.evaluation),
        _ => format!("After (evaluation {})", all[1].field.evaluation),
    };
    let figures: Vec<String> = all
        .iter()
        .map(|own| own.figures(outline).map(|figure| number(figure / unit, 3)))
        .map(|[rms, largest]| format!("{rms} {name} root mean square, at most {largest} {name}"))
        .collect();
    let words = match figures.as_slice() {
        [before, after] => format!("Before: {before}; after: {after}."),
        [one] => format!("{one}."),
        _ => String::new(),
    };
    Ok(html! {
        figure id="deviation" {
            div class="pair" {
                @for (k, own) in all.iter().enumerate() {
                    div { h3 { (title(k)) } (drawing.draw(own, unit, name, &format!("deviation-{k}"))) }
                }
            }
            figcaption {
                "Deviation of the field from what is asked for, in " (window.describe("mm"))
                ", the same scale for all. " (words) " Elements count by their volume."
            }
        }
    })
}

/// What both pictures have in common.
struct Drawing<'a> {
    outline: &'a Outline,
    window: &'a Window,
    frame: Frame,
    scale: Scale,
    map: ColourMap,
}

impl Drawing<'_> {
    fn draw(&self, own: &Deviation<'_>, unit: f64, name: &str, id: &str) -> Markup {
        let Self { outline, window, frame, scale, map } = self;
        let topology = outline.mesh.topology();
        let means = NodeMeans { topology, points: &own.field.points, values: own.values };
        let is_own = |e: &ElementId| own.elements.binary_search(e).is_ok();
        let mut coloured = Vec::new();
        for &e in &own.elements {
            let points = topology.tet(e).map(|n| own.field.points[n.index()]);
            if window.plane.cuts(&points) {
                let values = topology.tet(e).map(|node| means.at(node, is_own) / unit);
                for patch in window.plane.of_tet(points, values) {
                    let corners = patch.map(|(p, _)| window.page.flat(p));
                    coloured.push((corners, patch.map(|(_, v)| scale.share(v))));
                }
            }
        }
        let lines = format!("{id}-lines");
        let inside = html! {
            defs { path id=(lines) d=(boundaries(outline, window, frame, own.field)) {} }
            @for class in ["outline-halo", "outline"] { use class=(class) href={ "#" (lines) } {} }
        };
        let content = html! {
            (frame.image(*map, coloured.into_iter()))
            (frame.clip(&format!("{id}-frame"), &inside))
            (axes(&frame.x, &frame.y, window.page.titles.each_ref().map(String::as_str), [6, 5]))
            (colour_bar(id, *map, scale, &format!("deviation [{name}]"), frame.bar_top()))
        };
        let plane = window.describe("millimetres");
        let label = format!("Deviation of the field in {plane} at evaluation {}", own.field.evaluation);
        svg(frame.height(), &label, &content)
    }
}
