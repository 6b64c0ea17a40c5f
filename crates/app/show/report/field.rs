//! Before and after: |B| on a plane through what is observed and what moves.

use maud::{Markup, html};

use super::coils::sections;
use super::colour::ColourMap;
use super::data::RunData;
use super::field_cut::{FieldCut, colour_range};
use super::observed;
use super::picture::{Picture, pair};
use super::plot::{Scale, rect, text};
use super::ticks::{Count, number, trim_zeros};
use super::window::Window;
use crate::build::Outline;

/// Both figures with their caption.
pub(super) fn figure(data: &RunData, outline: &Outline) -> Result<Markup, String> {
    let after = data.fields[1].as_ref().map_err(Clone::clone)?;
    let before = data.fields[0].as_ref().ok();
    let window = Window::new(data, outline, after);
    let fields = before.into_iter().chain([after]);
    let cuts: Vec<FieldCut<'_>> = fields.map(|field| FieldCut::new(&window, outline, field)).collect();
    let range = colour_range(data, outline, &cuts).ok_or("the plane of the figure meets no element")?;
    let picture = Picture::new(outline, window, range, ColourMap::Field, "|B| [mT]");
    let caption = caption(data, outline, &picture.window, &cuts, &picture.scale);
    let drawn = |(k, cut): (usize, &FieldCut<'_>)| {
        draw(data, &picture, cut, (&format!("cut-{k}"), "Flux density", 1e3))
    };
    let pictures: Vec<_> = cuts.iter().map(|cut| cut.field).zip(cuts.iter().enumerate().map(drawn)).collect();
    Ok(html! {
        figure id="field-cut" {
            (pair("Flux density", &pictures))
            figcaption { (caption) }
        }
    })
}

/// A quantity of the elements by its name, `factor` times its values, with the coils and the names of regions.
pub(super) fn draw(
    data: &RunData,
    picture: &Picture<'_>,
    cut: &FieldCut<'_>,
    (id, name, factor): (&str, &str, f64),
) -> Markup {
    let patches =
        cut.triangles.iter().map(|triangle| triangle.patch.map(|(p, v)| (p, (factor * v).max(0.0))));
    let above = html! { (coils(data, picture)) (names(data, picture, cut)) };
    picture.draw((cut.field, patches), id, &picture.label(name, cut.field), [&html! {}, &above])
}

/// Cross-sections of coils that are given by their shape.
fn coils(data: &RunData, Picture { window, frame, .. }: &Picture<'_>) -> Markup {
    let all = data.config.coils.iter();
    let cut = all.flat_map(|coil| sections(coil, window.plane).into_iter().map(move |s| (coil, s)));
    let [first, last] = frame.x.pixels;
    html! {
        @for (coil, section) in cut {
            @let [a, b] = section.map(|p| frame.at(window.page.flat(p)));
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
fn names(data: &RunData, Picture { outline, frame, .. }: &Picture<'_>, cut: &FieldCut<'_>) -> Markup {
    let observed = observed::region_names(data);
    let is_named = |name: &str| data.config.regions.contains_key(name) || observed.contains(&name);
    html! {
        @for (region, middle) in cut.middles() {
            @let name = &outline.mesh.topology().region_names()[region.index()];
            @let [x, y] = frame.at(middle);
            @if is_named(name) { (text("label middle", x, y + 3.5, name)) }
        }
    }
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
        text += " (√(B·B*): the peak value where B does not turn)";
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
