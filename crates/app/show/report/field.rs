//! Before and after: |B| on a plane through what is observed and what moves.

use maud::{Markup, html};

use super::coils::sections;
use super::colour::ColourMap;
use super::data::{RunData, Snapshot};
use super::field_cut::{FieldCut, colour_scale};
use super::frame::Frame;
use super::observed;
use super::plot::{Scale, axes, colour_bar, path, rect, svg, text};
use super::ticks::{Count, number, trim_zeros};
use super::window::Window;
use crate::build::Outline;

/// Tallest drawing area.
pub(super) const TALLEST: f64 = 320.0;

/// Both figures with their caption.
pub(super) fn figure(data: &RunData, outline: &Outline) -> Result<Markup, String> {
    let after = data.fields[1].as_ref().map_err(Clone::clone)?;
    let before = data.fields[0].as_ref().ok();
    let window = Window::new(data, outline, after);
    let fields = before.into_iter().chain([after]);
    let cuts: Vec<FieldCut<'_>> = fields.map(|field| FieldCut::new(&window, outline, field)).collect();
    let scale = colour_scale(data, outline, &cuts).ok_or("the plane of the figure meets no element")?;
    let caption = caption(data, outline, &window, &cuts, &scale);
    let frame = Frame::new(window.low, window.high, TALLEST);
    let drawing = Drawing { data, outline, window, frame, scale, shown: FLUX_DENSITY };
    let title = |k: usize| match (cuts.len(), k) {
        (1, _) => "Flux density".to_owned(),
        (_, 0) => format!("Before (evaluation {})", cuts[0].field.evaluation),
        _ => format!("After (evaluation {})", cuts[1].field.evaluation),
    };
    Ok(html! {
        figure id="field-cut" {
            div class="pair" {
                @for (k, cut) in cuts.iter().enumerate() {
                    div { h3 { (title(k)) } (drawing.draw(cut, &format!("cut-{k}"))) }
                }
            }
            figcaption { (caption) }
        }
    })
}

/// A quantity of the elements as it is drawn.
pub(super) struct Shown {
    /// Its name, with a capital.
    pub(super) name: &'static str,
    /// Its sign with the unit that is shown.
    pub(super) sign: &'static str,
    /// From the values of the field to that unit.
    pub(super) factor: f64,
}

const FLUX_DENSITY: Shown = Shown { name: "Flux density", sign: "|B| [mT]", factor: 1e3 };

/// What all figures of a plane have in common.
pub(super) struct Drawing<'a> {
    pub(super) data: &'a RunData,
    pub(super) outline: &'a Outline,
    pub(super) window: Window,
    pub(super) frame: Frame,
    pub(super) scale: Scale,
    pub(super) shown: Shown,
}

impl Drawing<'_> {
    pub(super) fn draw(&self, cut: &FieldCut<'_>, id: &str) -> Markup {
        let Self { window, frame, scale, shown, .. } = self;
        let coloured = cut.triangles.iter().map(|triangle| {
            let corners = triangle.patch.map(|(p, _)| window.page.flat(p));
            (corners, triangle.patch.map(|(_, v)| scale.share((shown.factor * v).max(0.0))))
        });
        let lines = format!("{id}-lines");
        let inside = html! {
            defs { path id=(lines) d=(boundaries(self.outline, window, frame, cut.field)) {} }
            @for class in ["outline-halo", "outline"] { use class=(class) href={ "#" (lines) } {} }
            (self.coils())
            (self.names(cut))
        };
        let content = html! {
            (frame.image(ColourMap::Field, coloured))
            (frame.clip(&format!("{id}-frame"), &inside))
            (axes(&frame.x, &frame.y, window.page.titles.each_ref().map(String::as_str), [6, 5]))
            (colour_bar(id, ColourMap::Field, scale, shown.sign, frame.bar_top()))
        };
        let plane = window.describe("millimetres");
        let label = format!("{} in {plane} at evaluation {}", shown.name, cut.field.evaluation);
        svg(frame.height(), &label, &content)
    }

    /// Cross-sections of coils that are given by their shape.
    fn coils(&self) -> Markup {
        let all = self.data.config.coils.iter();
        let cut = all.flat_map(|coil| sections(coil, self.window.plane).into_iter().map(move |s| (coil, s)));
        let [first, last] = self.frame.x.pixels;
        html! {
            @for (coil, section) in cut {
                @let [a, b] = section.map(|p| self.frame.at(self.window.page.flat(p)));
                @let (left, top) = (a[0].min(b[0]), a[1].min(b[1]));
                @let (width, height) = ((a[0] - b[0]).abs(), (a[1] - b[1]).abs());
                (rect("coil", [left, top, width, height]))
                @if (first..last).contains(&(left + 0.5 * width)) {
                    (text("label middle", left + 0.5 * width, top + 0.5 * height + 3.5, &coil.name))
                }
            }
        }
    }

    /// Names of the regions that the configuration speaks of.
    fn names(&self, cut: &FieldCut<'_>) -> Markup {
        let observed = observed::region_names(self.data);
        let is_named = |name: &str| self.data.config.regions.contains_key(name) || observed.contains(&name);
        html! {
            @for (region, middle) in cut.middles() {
                @let name = &self.outline.mesh.topology().region_names()[region.index()];
                @let [x, y] = self.frame.at(middle);
                @if is_named(name) { (text("label middle", x, y + 3.5, name)) }
            }
        }
    }
}

/// Faces between regions, and of the outside, as one path.
pub(super) fn boundaries(outline: &Outline, window: &Window, frame: &Frame, field: &Snapshot) -> String {
    let facets = outline.mesh.topology().facets().iter();
    let cut = facets.filter_map(|facet| {
        let points = facet.nodes.map(|n| field.points[n.index()]);
        let ends = window.plane.of_triangle(points).filter(|ends| window.shows(ends))?;
        let line = path(&ends.map(|p| frame.at(window.page.flat(p))));
        // Shorter than the page's digits.
        let (from, to) = line.split_once('L')?;
        (from.trim_start_matches('M') != to).then_some(line)
    });
    cut.collect()
}

fn caption(
    data: &RunData,
    outline: &Outline,
    window: &Window,
    cuts: &[FieldCut<'_>],
    scale: &Scale,
) -> String {
    let cases = data.config.load_cases();
    let mut text = format!("Magnitude of the flux density in {}", window.describe("mm"));
    if cases.iter().any(|case| case.frequency != 0.0) {
        text += " (peak value)";
    }
    if let [first, _, ..] = cases.as_slice() {
        text += &match first.name() {
            Some(load) => format!(" under the load {load}, the first of {}", cases.len()),
            None => {
                format!(" at {} Hz, the first of {} frequencies", trim_zeros(first.frequency, 6), cases.len())
            }
        };
    }
    text += &format!(
        ", {} scale from {} to {} mT, the same for all; lines: boundaries of regions. What lies beyond has the colour of \
         the end. Values of elements are averaged at the nodes within each region.",
        if scale.count == Count::Logarithmic { "logarithmic" } else { "linear" },
        number(scale.low, 3),
        number(scale.high, 3)
    );
    let means = cuts.iter().filter_map(|cut| observed::mean_flux_density(data, outline, cut.field));
    let means: Vec<String> = means.map(|mean| format!("{} mT", number(1e3 * mean, 4))).collect();
    let regions = observed::region_names(data).join(", ");
    match means.as_slice() {
        [before, after] => text += &format!(" Mean |B| in {regions}: {before} before, {after} after."),
        [one] => text += &format!(" Mean |B| in {regions}: {one}."),
        _ => {}
    }
    if outline.node_of.iter().any(Option::is_none) {
        text += " A conductor that its surface impedance replaces has no field inside and is left empty.";
    }
    text
}
