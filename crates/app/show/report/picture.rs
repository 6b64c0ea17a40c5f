//! A quantity on the plane of a window: coloured triangles, the boundaries of regions, axes, and what the colours stand for.

use maud::{Markup, html};

use super::colour::ColourMap;
use super::cut::Patch;
use super::data::Snapshot;
use super::frame::Frame;
use super::plot::{LEFT, RIGHT, Scale, WIDTH, axes, colour_bar, path, svg};
use super::ticks::Count;
use super::window::Window;
use crate::build::Outline;

/// Tallest drawing area.
const TALLEST: f64 = 320.0;

/// What all pictures of a figure have in common.
pub(super) struct Picture<'a> {
    pub(super) outline: &'a Outline,
    pub(super) window: Window,
    pub(super) frame: Frame,
    pub(super) scale: Scale,
    map: ColourMap,
    /// The sign of the quantity, with its unit.
    sign: String,
}

impl<'a> Picture<'a> {
    /// Of a quantity between two values.
    pub(super) fn new(
        outline: &'a Outline,
        window: Window,
        (low, high, count): (f64, f64, Count),
        map: ColourMap,
        sign: &str,
    ) -> Self {
        let frame = Frame::new(window.low, window.high, TALLEST);
        let scale = Scale { low, high, count, pixels: [LEFT, WIDTH - RIGHT] };
        Self { outline, window, frame, scale, map, sign: sign.to_owned() }
    }

    /// One of them, read out as `label`: patches with values of the scale, and what is drawn below and above the boundaries of
    /// the regions as they are in a field.
    pub(super) fn draw(
        &self,
        (field, patches): (&Snapshot, impl Iterator<Item = Patch>),
        id: &str,
        label: &str,
        [below, above]: [&Markup; 2],
    ) -> Markup {
        let Self { window, frame, scale, map, .. } = self;
        let flat =
            |patch: Patch| (patch.map(|(p, _)| window.page.flat(p)), patch.map(|(_, v)| scale.share(v)));
        let lines = format!("{id}-lines");
        let inside = html! {
            (below)
            defs { path id=(lines) d=(self.boundaries(field)) {} }
            @for class in ["outline-halo", "outline"] { use class=(class) href={ "#" (lines) } {} }
            (above)
        };
        let content = html! {
            (frame.image(*map, patches.map(flat)))
            (frame.clip(&format!("{id}-frame"), &inside))
            (axes(&frame.x, &frame.y, window.page.titles.each_ref().map(String::as_str), [6, 5]))
            (colour_bar(id, *map, scale, &self.sign, frame.bar_top()))
        };
        svg(frame.height(), label, &content)
    }

    /// Faces between regions, and of the outside, as one path.
    fn boundaries(&self, field: &Snapshot) -> String {
        let Self { window, frame, .. } = self;
        let facets = self.outline.mesh.topology().facets().iter();
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

    /// What a picture shows, read out.
    pub(super) fn label(&self, name: &str, field: &Snapshot) -> String {
        format!("{name} in {} at evaluation {}", self.window.describe("millimetres"), field.evaluation)
    }
}

/// Pictures of fields before and after, side by side; a single one under its own title.
pub(super) fn pair(title: &str, pictures: &[(&Snapshot, Markup)]) -> Markup {
    let titled = |k: usize, field: &Snapshot| match (pictures.len(), k) {
        (1, _) => title.to_owned(),
        (_, 0) => format!("Before (evaluation {})", field.evaluation),
        _ => format!("After (evaluation {})", field.evaluation),
    };
    html! {
        div class="pair" {
            @for (k, (field, picture)) in pictures.iter().enumerate() { div { h3 { (titled(k, field)) } (picture) } }
        }
    }
}
