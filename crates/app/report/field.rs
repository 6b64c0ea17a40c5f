//! Before and after: |B| on a plane through what is observed and what moves.

use std::collections::BTreeMap;

use fluxmorph_geometry::ElementId;
use fluxmorph_geometry::tet4::{Point, area_vector, dot};

use super::coils::{extent, sections};
use super::colour::ColourMap;
use super::cut::{CutPlane, NodeMeans, Patch};
use super::data::{RunData, Snapshot};
use super::html::Html;
use super::map::view_normal;
use super::plane::{Plane, bounds};
use super::plot::{BAR, BOTTOM, LEFT, RIGHT, Scale, TOP, WIDTH, axes, colour_bar, px, svg, text};
use super::raster::Raster;
use super::ticks::{Count, number, trimmed};
use crate::config::CoilShape;
use crate::setup::Outline;

/// Pixels of the image for each of the drawing.
const SHARPNESS: f64 = 2.0;

/// Tallest drawing area.
const TALLEST: f64 = 320.0;

/// Share of the window that is added around what must be seen.
const ROOM: f64 = 0.12;

/// Shares of the area below the colours' lowest value, and up to their highest: the field is infinite at edges.
const QUANTILES: [f64; 2] = [0.005, 0.998];

/// Values that differ by more than this factor are coloured by factors.
const WIDE: f64 = 30.0;

/// Both figures with their caption.
pub(super) fn figure(html: &mut Html, data: &RunData, outline: &Outline) -> Result<(), String> {
    let after = data.fields[1].as_ref().map_err(Clone::clone)?;
    let before = data.fields[0].as_ref().ok();
    let view = View::new(data, outline, after);
    let cuts: Vec<Cut<'_>> =
        before.into_iter().chain([after]).map(|field| view.cut(outline, field)).collect();
    let scale = view.scale(data, outline, &cuts).ok_or("the plane of the figure meets no element")?;
    let names = if before.is_some() { vec!["before", "after"] } else { vec!["field"] };
    html.element("figure", &[("id", "field-cut")], |html| {
        html.element("div", &[("class", "pair")], |html| {
            for (k, (cut, name)) in cuts.iter().zip(&names).enumerate() {
                html.element("div", &[], |html| {
                    let title = match *name {
                        "before" => format!("Before (evaluation {})", cut.field.evaluation),
                        "after" => format!("After (evaluation {})", cut.field.evaluation),
                        _ => "Flux density".to_owned(),
                    };
                    html.leaf("h3", &[], &title);
                    view.draw(html, data, outline, cut, &scale, &format!("cut-{k}"));
                });
            }
        });
        html.leaf("figcaption", &[], &view.caption(data, outline, &cuts, &scale));
    });
    Ok(())
}

/// Which plane is shown, and which part of it.
struct View {
    plane: CutPlane,
    page: Plane,
    /// Lower left and upper right corner [mm].
    window: [[f64; 2]; 2],
}

/// A field on the plane.
struct Cut<'a> {
    field: &'a Snapshot,
    /// With the region that they lie in.
    patches: Vec<(Patch, usize)>,
    /// Middles and areas of the parts of regions in the window, by region.
    regions: BTreeMap<usize, ([f64; 2], f64)>,
}

impl View {
    fn new(data: &RunData, outline: &Outline, after: &Snapshot) -> Self {
        let topology = outline.mesh.topology();
        let observed = observed(data, outline);
        let observed = (!observed.is_empty())
            .then(|| bounds(observed.iter().flat_map(|&e| topology.tet(e)).map(|n| after.points[n.index()])));
        let moved = outline
            .design
            .as_ref()
            .map(|design| bounds(design.surface.nodes().iter().map(|&n| outline.full_mesh.point(n))));
        let whole = bounds(outline.mesh.points().iter().copied());
        let centre = observed.or(moved).unwrap_or(whole);
        let middle = centre.map(|c| c.map(|v| 0.5 * v));
        let middle: Point = std::array::from_fn(|d| middle[0][d] + middle[1][d]);
        let upwards = outline.design.as_ref().map_or([0.0, 0.0, 1.0], |d| view_normal(data, d));
        let up = (0..3).fold(2, |best, d| if upwards[d].abs() > upwards[best].abs() { d } else { best });
        // Of the two planes along the design's axis the one that shows its longer side.
        let shown = moved.unwrap_or(centre);
        let others = [(up + 1) % 3, (up + 2) % 3];
        let length = |d: usize| shown[1][d] - shown[0][d];
        let [axis, right] =
            if length(others[0]) > length(others[1]) { [others[1], others[0]] } else { others };
        let plane = CutPlane { axis, at: middle[axis] };
        let page = Plane::of_axes(right, up, axis);
        let coils = data.config.coils.iter().filter_map(extent);
        let parts = parts(data, outline, after);
        let corners: Vec<Point> =
            observed.into_iter().chain(moved).chain(coils).chain(parts).flatten().collect();
        let corners = if corners.is_empty() { whole.to_vec() } else { corners };
        let around = bounds(corners);
        let room: Point = std::array::from_fn(|d| ROOM * (around[1][d] - around[0][d]));
        let room = room.iter().copied().fold(0.0, f64::max);
        let [low, high]: [Point; 2] = [
            std::array::from_fn(|d| (around[0][d] - room).max(whole[0][d])),
            std::array::from_fn(|d| (around[1][d] + room).min(whole[1][d])),
        ];
        Self { plane, window: [page.flat(low), page.flat(high)], page }
    }

    fn cut<'a>(&self, outline: &'a Outline, field: &'a Snapshot) -> Cut<'a> {
        let topology = outline.mesh.topology();
        let means = NodeMeans { topology, points: &field.points, values: &field.flux_density };
        let (mut patches, mut regions) = (Vec::new(), BTreeMap::<usize, ([f64; 2], f64)>::new());
        for e in topology.elements() {
            let points = topology.tet(e).map(|n| field.points[n.index()]);
            if !self.plane.cuts(&points) || !self.shows(&points) {
                continue;
            }
            for patch in self.plane.of_tet(points, means.of_element(e)) {
                let corners = patch.map(|(p, _)| p);
                let area = dot(area_vector(corners), self.page.normal).abs();
                let middle =
                    self.page.flat(std::array::from_fn(|d| corners.iter().map(|c| c[d]).sum::<f64>() / 3.0));
                if self.holds(middle) {
                    let (sum, total) = regions.entry(topology.region_of()[e.index()].index()).or_default();
                    (0..2).for_each(|d| sum[d] += area * middle[d]);
                    *total += area;
                }
                patches.push((patch, topology.region_of()[e.index()].index()));
            }
        }
        Cut { field, patches, regions }
    }

    fn shows(&self, points: &[Point]) -> bool {
        let flat: Vec<[f64; 2]> = points.iter().map(|p| self.page.flat(*p)).collect();
        (0..2).all(|d| {
            flat.iter().any(|p| p[d] >= self.window[0][d]) && flat.iter().any(|p| p[d] <= self.window[1][d])
        })
    }

    fn holds(&self, place: [f64; 2]) -> bool {
        (0..2).all(|d| self.window[0][d] <= place[d] && place[d] <= self.window[1][d])
    }

    /// The colours' range in millitesla, for all cuts alike.
    ///
    /// Of the regions without an entry of their own, where there are any: the field in iron is a hundred times that around
    /// it, and would leave the others one colour.
    fn scale(&self, data: &RunData, outline: &Outline, cuts: &[Cut<'_>]) -> Option<Scale> {
        let names = outline.mesh.topology().region_names();
        let of_air = |region: usize| !data.config.regions.contains_key(&names[region]);
        let patches = || cuts.iter().flat_map(|cut| &cut.patches);
        let all = !patches().any(|(_, region)| of_air(*region));
        let mut samples: Vec<(f64, f64)> = Vec::new();
        for (patch, _) in patches().filter(|(_, region)| all || of_air(*region)) {
            let corners = patch.map(|(p, _)| p);
            let middle: Point = std::array::from_fn(|d| corners.iter().map(|c| c[d]).sum::<f64>() / 3.0);
            if self.holds(self.page.flat(middle)) {
                let value = patch.iter().map(|(_, v)| v).sum::<f64>() / 3.0;
                samples.push((1e3 * value, dot(area_vector(corners), self.page.normal).abs()));
            }
        }
        samples.sort_by(|a, b| a.0.total_cmp(&b.0));
        let total: f64 = samples.iter().map(|(_, area)| area).sum();
        let [low, high] = QUANTILES.map(|share| {
            let mut below = 0.0;
            let found = samples.iter().find(|(_, area)| {
                below += area;
                below >= share * total
            });
            found.or(samples.last()).map(|(value, _)| *value)
        });
        let (low, high) = (low?, high?);
        let pixels = [LEFT, WIDTH - RIGHT];
        if high <= 0.0 {
            return Some(Scale { low: 0.0, high: 1.0, count: Count::Linear, pixels });
        }
        let lowest = low.max(1e-4 * high);
        Some(if high / lowest > WIDE {
            Scale { low: lowest, high, count: Count::Logarithmic, pixels }
        } else {
            Scale { low: if low < 0.3 * high { 0.0 } else { low }, high, count: Count::Linear, pixels }
        })
    }

    fn draw(
        &self,
        html: &mut Html,
        data: &RunData,
        outline: &Outline,
        cut: &Cut<'_>,
        scale: &Scale,
        id: &str,
    ) {
        let [low, high] = self.window;
        let extent = [high[0] - low[0], high[1] - low[1]].map(|e| e.max(1e-9));
        let per_mm = ((WIDTH - LEFT - RIGHT) / extent[0]).min(TALLEST / extent[1]);
        let [width, height] = extent.map(|e| e * per_mm);
        let left = LEFT + 0.5 * (WIDTH - LEFT - RIGHT - width);
        let axis = |k: usize, pixels| Scale { low: low[k], high: high[k], count: Count::Linear, pixels };
        let (x, y) = (axis(0, [left, left + width]), axis(1, [TOP + height, TOP]));
        let pixels = [width, height].map(|side| (side * SHARPNESS).ceil().max(1.0));
        let mut image = Raster::new(pixels[0] as usize, pixels[1] as usize);
        for (patch, _) in &cut.patches {
            let at = |p: Point| {
                let [u, v] = self.page.flat(p);
                [x.share(u) * pixels[0], (1.0 - y.share(v)) * pixels[1]]
            };
            image.triangle(patch.map(|(p, _)| at(p)), patch.map(|(_, v)| scale.share((1e3 * v).max(0.0))));
        }
        let url = image.data_url(ColourMap::Field);
        let label = format!(
            "Flux density in the plane {} = {} millimetres at evaluation {}",
            ["x", "y", "z"][self.plane.axis],
            trimmed(1e3 * self.plane.at, 1),
            cut.field.evaluation
        );
        svg(html, TOP + height + BOTTOM + BAR, &label, |html| {
            let place = [left, TOP, width, height].map(px);
            let frame: Vec<(&'static str, &str)> =
                ["x", "y", "width", "height"].into_iter().zip(place.iter().map(String::as_str)).collect();
            let image = [("href", url.as_str()), ("preserveAspectRatio", "none")];
            html.void("image", &[frame.as_slice(), &image].concat());
            html.element("clipPath", &[("id", &format!("{id}-frame"))], |html| html.void("rect", &frame));
            html.element("g", &[("clip-path", &format!("url(#{id}-frame)"))], |html| {
                let path = self.outlines(outline, cut.field, &x, &y);
                let lines = format!("{id}-lines");
                html.element("defs", &[], |html| html.void("path", &[("id", &lines), ("d", &path)]));
                for class in ["outline-halo", "outline"] {
                    html.void("use", &[("class", class), ("href", &format!("#{lines}"))]);
                }
                self.coils(html, data, &x, &y);
                self.names(html, data, outline, cut, &x, &y);
            });
            axes(html, &x, &y, self.page.titles.each_ref().map(String::as_str), [6, 5]);
            colour_bar(html, id, ColourMap::Field, scale, "|B| [mT]", TOP + height + BOTTOM + 4.0);
        });
    }

    /// Faces between regions, and of the outside, as one path.
    fn outlines(&self, outline: &Outline, field: &Snapshot, x: &Scale, y: &Scale) -> String {
        let mut path = String::new();
        for facet in outline.mesh.topology().facets() {
            let points = facet.nodes.map(|n| field.points[n.index()]);
            let Some(ends) = self.plane.of_triangle(points).filter(|ends| self.shows(ends)) else { continue };
            let [a, b] = ends.map(|p| {
                let [u, v] = self.page.flat(p);
                [px(x.at(u)), px(y.at(v))]
            });
            if a != b {
                path += &format!("M{} {}L{} {}", a[0], a[1], b[0], b[1]);
            }
        }
        path
    }

    fn coils(&self, html: &mut Html, data: &RunData, x: &Scale, y: &Scale) {
        for coil in &data.config.coils {
            for section in sections(coil, self.plane) {
                let [a, b] = section.map(|p| self.page.flat(p)).map(|[u, v]| [x.at(u), y.at(v)]);
                let low = [a[0].min(b[0]), a[1].min(b[1])];
                let size = [(a[0] - b[0]).abs(), (a[1] - b[1]).abs()];
                let place = [low[0], low[1], size[0], size[1]].map(px);
                let [left, top, width, height] = place.each_ref().map(String::as_str);
                html.void(
                    "rect",
                    &[("class", "coil"), ("x", left), ("y", top), ("width", width), ("height", height)],
                );
                let middle = low[0] + 0.5 * size[0];
                if (x.pixels[0]..x.pixels[1]).contains(&middle) {
                    text(html, "label middle", middle, low[1] + 0.5 * size[1] + 3.5, &coil.name);
                }
            }
        }
    }

    /// Names of the regions that the configuration speaks of.
    fn names(&self, html: &mut Html, data: &RunData, outline: &Outline, cut: &Cut<'_>, x: &Scale, y: &Scale) {
        let topology = outline.mesh.topology();
        for (region, (sum, area)) in &cut.regions {
            let name = &topology.region_names()[*region];
            let is_named = data.config.regions.contains_key(name)
                || observed_regions(data).iter().any(|observed| observed == name);
            if is_named && *area > 0.0 {
                let [u, v] = sum.map(|s| s / area);
                text(html, "label middle", x.at(u), y.at(v) + 3.5, name);
            }
        }
    }

    fn caption(&self, data: &RunData, outline: &Outline, cuts: &[Cut<'_>], scale: &Scale) -> String {
        let mut text = format!(
            "Magnitude of the flux density in the plane {} = {} mm",
            ["x", "y", "z"][self.plane.axis],
            trimmed(1e3 * self.plane.at, 1)
        );
        let frequencies = data.config.analysis.frequencies();
        text += match frequencies {
            [0.0] => "",
            _ => " (peak value)",
        };
        if frequencies.len() > 1 {
            text += &format!(
                " at {} Hz, the first of {} frequencies",
                trimmed(frequencies[0], 6),
                frequencies.len()
            );
        }
        text += &format!(
            ", {} scale from {} to {} mT, the same for all; lines: boundaries of regions.",
            if scale.count == Count::Logarithmic { "logarithmic" } else { "linear" },
            number(scale.low, 3),
            number(scale.high, 3)
        );
        text += " What lies beyond has the colour of the end.";
        text += " Values of elements are averaged at the nodes within each region.";
        let means: Vec<f64> = cuts.iter().filter_map(|cut| mean(data, outline, cut.field)).collect();
        let regions = observed_regions(data).join(", ");
        if let [before, after] = means.as_slice() {
            text += &format!(
                " Mean |B| in {regions}: {} mT before, {} mT after.",
                number(1e3 * before, 4),
                number(1e3 * after, 4)
            );
        } else if let [one] = means.as_slice() {
            text += &format!(" Mean |B| in {regions}: {} mT.", number(1e3 * one, 4));
        }
        let replaced = outline.node_of.iter().any(Option::is_none);
        if replaced {
            text += " A conductor that its surface impedance replaces has no field inside and is left empty.";
        }
        text
    }
}

/// Lower and upper corners around the designed bodies and the coils that are regions of the mesh, as they are after.
fn parts(data: &RunData, outline: &Outline, after: &Snapshot) -> Vec<[Point; 2]> {
    let (topology, full) = (outline.mesh.topology(), outline.full_mesh.topology());
    let bodies = outline.design.iter().flat_map(|design| &design.bodies);
    let bodies = bodies.map(|region| full.region_names()[region.index()].as_str());
    let coils = data.config.coils.iter().filter_map(|coil| match &coil.shape {
        CoilShape::Region(own) => Some(own.region.as_str()),
        _ => None,
    });
    let found = bodies.chain(coils).filter_map(|name| topology.region(name).ok());
    found
        .map(|region| topology.elements_of(region))
        .filter(|elements| !elements.is_empty())
        .map(|elements| {
            bounds(elements.iter().flat_map(|&e| topology.tet(e)).map(|n| after.points[n.index()]))
        })
        .collect()
}

/// Names of the regions that the objective is taken over.
fn observed_regions(data: &RunData) -> Vec<String> {
    let terms = data.config.objective.iter().flat_map(|objective| objective.terms());
    let mut names: Vec<String> = Vec::new();
    for name in terms.filter_map(|term| term.functional.region.clone()) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// The elements of those regions.
fn observed(data: &RunData, outline: &Outline) -> Vec<ElementId> {
    let topology = outline.mesh.topology();
    let regions = observed_regions(data);
    regions
        .iter()
        .filter_map(|name| topology.region(name).ok())
        .flat_map(|r| topology.elements_of(r))
        .collect()
}

/// Mean of |B| over the regions of the objective, by volume [T].
fn mean(data: &RunData, outline: &Outline, field: &Snapshot) -> Option<f64> {
    let topology = outline.mesh.topology();
    let (mut sum, mut total) = (0.0, 0.0);
    for e in observed(data, outline) {
        let own = fluxmorph_geometry::tet4::volume(topology.tet(e).map(|n| field.points[n.index()])).abs();
        sum += own * field.flux_density[e.index()];
        total += own;
    }
    (total > 0.0).then(|| sum / total)
}
