//! Before and after: what the field misses of the quality that is asked for, where it is asked for.

use std::collections::BTreeSet;

use fluxmorph_geometry::ElementId;
use fluxmorph_geometry::tet4::volume;
use maud::{Markup, html};

use super::colour::ColourMap;
use super::cut::{CutPlane, NodeMeans, Patch};
use super::data::{RunData, Snapshot};
use super::picture::{Picture, pair};
use super::plane::{Plane, bounds, extremes};
use super::tables::behind_title;
use super::ticks::{Count, number};
use super::window::Window;
use crate::build::{Outline, functionals};
use crate::config::ObjectiveKind;
use crate::show::states::State;

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
    Some(drawn(outline, window, (&all, &states(data))))
}

/// The loads or frequencies at which qualities are asked for, where there are several: of each its first.
fn states(data: &RunData) -> String {
    use ObjectiveKind::{Homogeneity, MultipoleContent, TargetField};
    let Some(result) = &data.result else { return String::new() };
    let cases = data.config.load_cases();
    let asked_for = functionals(&data.config).into_iter().map(|(_, own)| own);
    let taken: BTreeSet<usize> = asked_for
        .filter(|own| matches!(own.kind, TargetField | Homogeneity | MultipoleContent))
        .filter_map(|own| cases.iter().position(|case| own.is_taken_under(case)))
        .collect();
    let all = State::all(result);
    taken.into_iter().filter_map(|index| all.get(index)).map(behind_title).collect()
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

fn drawn<'a>(
    outline: &Outline,
    window: Window,
    (all, state): (&[Deviation<'a>], &str),
) -> Result<Markup, String> {
    let [low, high] = extremes(all.iter().flat_map(|own| own.elements.iter().map(|e| own.values[e.index()])));
    let most = low.abs().max(high.abs());
    if !(most.is_finite() && most > 0.0) {
        return Err("the deviation is no number".to_owned());
    }
    let (unit, name) = UNITS.into_iter().find(|(unit, _)| most >= 0.1 * unit).unwrap_or(UNITS[3]);
    let is_signed = low < 0.0;
    let (map, lowest) = if is_signed { (ColourMap::Signed, -most / unit) } else { (ColourMap::Field, 0.0) };
    let range = (lowest, most / unit, Count::Linear);
    let picture = Picture::new(outline, window, range, map, &format!("deviation [{name}]"));
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
    let drawn = |(k, own): (usize, &Deviation<'a>)| {
        let (id, label) = (format!("deviation-{k}"), picture.label("Deviation of the field", own.field));
        let patches = patches(&picture, own, unit).into_iter();
        (own.field, picture.draw((own.field, patches), &id, &label, [&html! {}, &html! {}]))
    };
    let pictures: Vec<_> = all.iter().enumerate().map(drawn).collect();
    Ok(html! {
        figure id="deviation" {
            (pair("Deviation", &pictures))
            figcaption {
                "Deviation of the field from what is asked for" (state) ", in " (picture.window.describe("mm"))
                ", the same scale for all. " (words) " Elements count by their volume."
            }
        }
    })
}

/// The patches in which the plane cuts the elements, with the deviation in a unit.
fn patches(picture: &Picture<'_>, own: &Deviation<'_>, unit: f64) -> Vec<Patch> {
    let topology = picture.outline.mesh.topology();
    let means = NodeMeans { topology, points: &own.field.points, values: own.values };
    let is_own = |e: &ElementId| own.elements.binary_search(e).is_ok();
    let plane = &picture.window.plane;
    let cut = own.elements.iter().map(|&e| (e, topology.tet(e).map(|n| own.field.points[n.index()])));
    cut.filter(|(_, points)| plane.cuts(points))
        .flat_map(|(e, points)| {
            plane.of_tet(points, topology.tet(e).map(|node| means.at(node, is_own) / unit))
        })
        .collect()
}
