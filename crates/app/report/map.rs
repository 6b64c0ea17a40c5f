//! Before and after: the design surface seen along the way it moves, coloured by the thickness behind it.

use fluxmorph_geometry::tet4::{Point, area_vector, norm};

use super::colour::ColourMap;
use super::data::RunData;
use super::html::Html;
use super::plane::{Plane, extremes, images, mirrored, mirrors};
use super::plot::{BAR, BOTTOM, LEFT, RIGHT, Scale, TOP, WIDTH, axes, colour_bar, dot, line, svg, text};
use super::raster::Raster;
use super::ticks::{Count, number, trimmed};
use super::words::capital;
use crate::config::{DesignDirection, DirectionWord};
use crate::setup::{Outline, OutlinedDesign};

/// Pixels of the image for each of the drawing.
const SHARPNESS: f64 = 2.0;

/// Tallest drawing area.
const TALLEST: f64 = 300.0;

/// What the surface is coloured by.
#[derive(Debug)]
pub(super) struct SurfaceValues {
    /// At the design nodes before and after [mm]; `None` where there is none.
    pub(super) values: [Option<Vec<Option<f64>>>; 2],
    /// Whether it is a thickness, and no displacement.
    pub(super) is_thickness: bool,
}

impl SurfaceValues {
    /// Thickness where one direction moves a body that has one, else the height along each node's direction.
    pub(super) fn new(data: &RunData, design: &OutlinedDesign) -> Self {
        let along_one =
            data.config.design.as_ref().is_some_and(|design| {
                !matches!(design.direction, DesignDirection::Word(DirectionWord::Normal))
            });
        let thickness = design.thickness.as_ref().filter(|_| along_one);
        let values = data.designs.each_ref().map(|values| {
            let heights = design.surface.normal_displacements(values.as_ref()?);
            Some(match thickness {
                None => heights.iter().map(|h| Some(1e3 * h)).collect(),
                Some(thickness) => {
                    let mut all = vec![None; heights.len()];
                    thickness.at_nodes().for_each(|(i, t)| all[i] = Some(1e3 * (t + heights[i])));
                    all
                }
            })
        });
        Self { values, is_thickness: thickness.is_some() }
    }

    /// Least and greatest value before and after; zero in the middle for displacements of both signs.
    pub(super) fn range(&self) -> Option<[f64; 2]> {
        let [low, high] = extremes(self.values.iter().flatten().flatten().flatten().copied());
        if !(low.is_finite() && high.is_finite()) {
            return None;
        }
        if self.is_signed() {
            let most = low.abs().max(high.abs()).max(1e-9);
            return Some([-most, most]);
        }
        let room = if high - low < 1e-9 * high.abs().max(1e-6) { 0.1 * high.abs().max(1e-3) } else { 0.0 };
        Some([low - room, high + room])
    }

    fn is_signed(&self) -> bool {
        !self.is_thickness
    }

    /// The map of its colours.
    pub(super) fn colours(&self) -> ColourMap {
        if self.is_signed() { ColourMap::Signed } else { ColourMap::Length }
    }

    /// What it is, without unit.
    pub(super) fn name(&self) -> &'static str {
        if self.is_thickness { "thickness" } else { "displacement along the design direction" }
    }
}

/// Both figures with their caption.
pub(super) fn figure(
    html: &mut Html,
    data: &RunData,
    outline: &Outline,
    design: &OutlinedDesign,
) -> Result<(), String> {
    let surface = SurfaceValues::new(data, design);
    let after = surface.values[1].as_ref().ok_or("the best design is not known")?;
    let [low, high] = surface.range().ok_or("no node of the design surface has a value")?;
    let scale = Scale { low, high, count: Count::Linear, pixels: [LEFT, WIDTH - RIGHT] };
    let drawing = Drawing::new(data, outline, design, scale);
    let names = if data.is_run() { ["before", "after"] } else { ["undeformed", "the design analysed"] };
    html.element("figure", &[("id", "shape-map")], |html| {
        html.element("div", &[("class", "pair")], |html| {
            for (k, name) in names.into_iter().enumerate() {
                if let Some(values) = &surface.values[k] {
                    html.element("div", &[], |html| {
                        html.leaf("h3", &[], &capital(name));
                        drawing.draw(html, &surface, values, &format!("map-{k}"), name);
                    });
                }
            }
        });
        html.leaf("figcaption", &[], &caption(data, outline, design, &surface, after));
    });
    Ok(())
}

/// One view of the surface: where its triangles are on the page.
struct Drawing {
    plane: Plane,
    /// Corners of every triangle in every mirror image [mm], with the places of its nodes in the surface.
    triangles: Vec<([[f64; 2]; 3], [usize; 3])>,
    scale: Scale,
    x: Scale,
    y: Scale,
    mirror_lines: bool,
}

impl Drawing {
    fn new(data: &RunData, outline: &Outline, design: &OutlinedDesign, scale: Scale) -> Self {
        let points: Vec<Point> = design.surface.nodes().iter().map(|&n| outline.full_mesh.point(n)).collect();
        let plane = Plane::across(view_normal(data, design), &points);
        let mirrors = mirrors(&data.config);
        let nodes = design.surface.nodes();
        let place = |node| nodes.binary_search(&node).unwrap_or(0);
        let mut triangles = Vec::new();
        for image in images(&mirrors) {
            for triangle in &design.triangles {
                let corners = triangle.map(|n| plane.flat(mirrored(&image, outline.full_mesh.point(n))));
                triangles.push((corners, triangle.map(place)));
            }
        }
        let corners = || triangles.iter().flat_map(|(corners, _)| corners);
        let ends = [0, 1].map(|d| extremes(corners().map(|p| p[d])));
        let extent = ends.map(|[low, high]| (high - low).max(1e-9));
        let per_mm = ((WIDTH - LEFT - RIGHT) / extent[0]).min(TALLEST / extent[1]);
        let (width, height) = (extent[0] * per_mm, extent[1] * per_mm);
        let left = LEFT + 0.5 * (WIDTH - LEFT - RIGHT - width);
        let axis =
            |k: usize, pixels| Scale { low: ends[k][0], high: ends[k][1], count: Count::Linear, pixels };
        Self {
            x: axis(0, [left, left + width]),
            y: axis(1, [TOP + height, TOP]),
            mirror_lines: !mirrors.is_empty(),
            plane,
            triangles,
            scale,
        }
    }

    fn draw(&self, html: &mut Html, surface: &SurfaceValues, values: &[Option<f64>], id: &str, name: &str) {
        let (x, y) = (&self.x, &self.y);
        let [width, height] = [x.pixels[1] - x.pixels[0], y.pixels[0] - y.pixels[1]];
        let pixels = [width, height].map(|side| (side * SHARPNESS).ceil().max(1.0));
        let mut image = Raster::new(pixels[0] as usize, pixels[1] as usize);
        for (corners, nodes) in &self.triangles {
            let [Some(a), Some(b), Some(c)] = nodes.map(|n| values[n]) else { continue };
            let at = |p: [f64; 2]| [x.share(p[0]) * pixels[0], (1.0 - y.share(p[1])) * pixels[1]];
            image.triangle(corners.map(at), [a, b, c].map(|v| self.scale.share(v)));
        }
        let url = image.data_url(surface.colours());
        let [least, most] = extremes(values.iter().flatten().copied());
        let label = format!(
            "Map of the {} {name}: from {} to {} millimetres",
            surface.name(),
            trimmed(least, 2),
            trimmed(most, 2)
        );
        let bottom = y.pixels[0];
        svg(html, bottom + BOTTOM + BAR, &label, |html| {
            let place = [x.pixels[0], y.pixels[1], width, height].map(super::plot::px);
            let [left, top, width, height] = place.each_ref().map(String::as_str);
            html.void(
                "image",
                &[
                    ("href", &url),
                    ("x", left),
                    ("y", top),
                    ("width", width),
                    ("height", height),
                    ("preserveAspectRatio", "none"),
                ],
            );
            let titles = self.plane.titles.each_ref().map(String::as_str);
            axes(html, x, y, titles, [6, 5]);
            if self.mirror_lines {
                let [u, v] = [x.at(0.0), y.at(0.0)];
                line(html, "mirror", [u, y.pixels[0]], [u, y.pixels[1]]);
                line(html, "mirror", [x.pixels[0], v], [x.pixels[1], v]);
            }
            for extreme in [least, most].iter().take(if most - least > 1e-6 * most.abs() { 2 } else { 0 }) {
                self.mark(html, values, *extreme);
            }
            let title = format!("{} [mm]", surface.name());
            colour_bar(html, id, surface.colours(), &self.scale, &title, bottom + BOTTOM + 4.0);
        });
    }

    /// A dot with its value at the place, of those with an extreme value, that lies deepest among its like.
    fn mark(&self, html: &mut Html, values: &[Option<f64>], extreme: f64) {
        let near = 1e-3 * (self.scale.high - self.scale.low);
        let is = |n: usize| values[n].is_some_and(|v| (v - extreme).abs() <= near);
        // Of the model itself, which comes before its images.
        let own = &self.triangles[..self.triangles.len() / if self.mirror_lines { 4 } else { 1 }];
        let centre =
            |corners: &[[f64; 2]; 3]| [0, 1].map(|d| corners.iter().map(|c| c[d]).sum::<f64>() / 3.0);
        let (whole, others): (Vec<_>, Vec<_>) = own
            .iter()
            .map(|(corners, nodes)| (centre(corners), nodes))
            .partition(|(_, nodes)| nodes.iter().all(|&n| is(n)));
        let apart = |p: &[f64; 2]| {
            let to_other = others.iter().map(|(o, _)| (o[0] - p[0]).hypot(o[1] - p[1]));
            let to_edge = [p[0] - self.x.low, self.x.high - p[0], p[1] - self.y.low, self.y.high - p[1]];
            to_other.chain(to_edge).fold(f64::INFINITY, f64::min)
        };
        // A thousand candidates tell where there is room.
        let step = whole.len().div_ceil(1000).max(1);
        let candidates = whole.iter().step_by(step).map(|(place, _)| (apart(place), place));
        let Some((_, place)) = candidates.max_by(|(a, _), (b, _)| a.total_cmp(b)) else { return };
        let at = [self.x.at(place[0]), self.y.at(place[1])];
        dot(html, "spot", at, 2.2);
        let right = at[0] > self.x.pixels[1] - 60.0;
        let (class, x) = if right { ("spot-text end", at[0] - 6.0) } else { ("spot-text", at[0] + 6.0) };
        text(html, class, x, at[1] + 4.0, &format!("{} mm", trimmed(extreme, 2)));
    }
}

/// The direction of the design, or where most of the surface looks.
pub(super) fn view_normal(data: &RunData, design: &OutlinedDesign) -> Point {
    if let Some(DesignDirection::Vector(direction)) = data.config.design.as_ref().map(|d| d.direction) {
        return direction;
    }
    // Out of the body, whatever the turn of the triangles.
    let directions = design.surface.directions();
    let sum: Point = std::array::from_fn(|d| directions.iter().map(|own| own[d]).sum());
    if norm(sum) > 0.2 * directions.len() as f64 { sum } else { [0.0, 0.0, 1.0] }
}

fn caption(
    data: &RunData,
    outline: &Outline,
    design: &OutlinedDesign,
    surface: &SurfaceValues,
    after: &[Option<f64>],
) -> String {
    let names = data.config.design.as_ref().map_or(String::new(), |d| d.surface.join(", "));
    let [least, most] = extremes(after.iter().flatten().copied());
    let mut text = if surface.is_thickness {
        let body =
            design.bodies.first().map(|r| outline.full_mesh.topology().region_names()[r.index()].as_str());
        format!("Thickness of {} behind the surface {names}", body.unwrap_or("the body"))
    } else {
        format!("Displacement of the surface {names} along its direction of motion")
    };
    if let Some(before) = &surface.values[0] {
        let [low, high] = extremes(before.iter().flatten().copied());
        let range = if high - low < 1e-6 * high.abs().max(1e-3) {
            format!("{} mm everywhere", trimmed(low, 2))
        } else {
            format!("{} to {} mm", trimmed(low, 2), trimmed(high, 2))
        };
        text += &format!("; before: {range}");
    }
    text += &format!("; after: {} to {} mm. ", trimmed(least, 2), trimmed(most, 2));
    if let Some(before) = &surface.values[0] {
        let [less, more] = changed(outline, design, before, after);
        let words = if surface.is_thickness {
            ["thinner", "thicker"]
        } else {
            ["moved against it", "moved along it"]
        };
        text += &format!(
            "{} % of its area is {} than before, {} % {}. ",
            number(100.0 * less, 3),
            words[0],
            number(100.0 * more, 3),
            words[1]
        );
        if !surface.is_thickness {
            text = text.replace(" than before", "");
        }
    }
    text += "Both figures have the same scale.";
    if !mirrors(&data.config).is_empty() {
        text +=
            " The quarter that was computed is mirrored over its symmetry planes x = 0 and y = 0 (dashed).";
    }
    text
}

/// Shares of the area whose value has become less and more.
fn changed(
    outline: &Outline,
    design: &OutlinedDesign,
    before: &[Option<f64>],
    after: &[Option<f64>],
) -> [f64; 2] {
    let nodes = design.surface.nodes();
    let (mut total, mut shares) = (0.0, [0.0; 2]);
    for triangle in &design.triangles {
        let area = norm(area_vector(triangle.map(|n| outline.full_mesh.point(n))));
        let change: f64 = triangle
            .iter()
            .filter_map(|n| nodes.binary_search(n).ok())
            .filter_map(|i| Some(after[i]? - before[i]?))
            .sum();
        total += area;
        // A micrometre is nobody's design.
        if change < -3e-3 {
            shares[0] += area;
        } else if change > 3e-3 {
            shares[1] += area;
        }
    }
    shares.map(|share| share / total)
}
