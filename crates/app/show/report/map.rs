//! Before and after: the design surface seen along its direction of motion, coloured by the thickness behind it.

use fluxmorph_geometry::tet4::{Point, area_vector, norm};
use maud::{Markup, html};

use super::colour::ColourMap;
use super::data::RunData;
use super::frame::Frame;
use super::plane::{Plane, extremes, images, mirrored, mirrors, with_room};
use super::plot::{LEFT, RIGHT, Scale, WIDTH, axes, colour_bar, dot, line, svg, text};
use super::ticks::{Count, number, trim_zeros};
use super::words::capital;
use crate::build::{Outline, OutlinedDesign};
use crate::config::{DesignDirection, DirectionWord};

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
        Some(with_room([low, high]))
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
pub(super) fn figure(data: &RunData, outline: &Outline, design: &OutlinedDesign) -> Result<Markup, String> {
    let surface = SurfaceValues::new(data, design);
    let after = surface.values[1].as_ref().ok_or("the best design is not known, or not one of this mesh")?;
    let [low, high] = surface.range().ok_or("no node of the design surface has a value")?;
    if surface.is_signed() && surface.values.iter().flatten().flatten().flatten().all(|height| *height == 0.0)
    {
        return Err("nothing has moved".to_owned());
    }
    let scale = Scale { low, high, count: Count::Linear, pixels: [LEFT, WIDTH - RIGHT] };
    let drawing = Drawing::new(data, outline, design, scale);
    let names = if data.is_run() { ["before", "after"] } else { ["undeformed", "the design analysed"] };
    let maps = names.into_iter().zip(&surface.values).enumerate();
    let known = maps.filter_map(|(k, (name, values))| Some((format!("map-{k}"), name, values.as_ref()?)));
    Ok(html! {
        figure id="shape-map" {
            div class="pair" {
                @for (id, name, values) in known {
                    div { h3 { (capital(name)) } (drawing.draw(&surface, values, &id, name)) }
                }
            }
            figcaption { (caption(data, outline, design, &surface, after)) }
        }
    })
}

/// One view of the surface: where its triangles are on the page.
struct Drawing {
    plane: Plane,
    /// Corners of every triangle in every mirror image [mm], with the places of its nodes in the surface.
    triangles: Vec<([[f64; 2]; 3], [usize; 3])>,
    scale: Scale,
    frame: Frame,
    is_mirrored: bool,
}

impl Drawing {
    fn new(data: &RunData, outline: &Outline, design: &OutlinedDesign, scale: Scale) -> Self {
        let nodes = design.surface.nodes();
        let points: Vec<Point> = nodes.iter().map(|&n| outline.full_mesh.point(n)).collect();
        let plane = Plane::across(view_normal(data, design), &points);
        let mirrors = mirrors(&data.config);
        let place = |node| nodes.binary_search(&node).unwrap_or(0);
        let mut triangles = Vec::new();
        for image in images(&mirrors) {
            for triangle in &design.triangles {
                let corners = triangle.map(|n| plane.flat(mirrored(&image, outline.full_mesh.point(n))));
                triangles.push((corners, triangle.map(place)));
            }
        }
        let corners = || triangles.iter().flat_map(|(corners, _)| corners);
        let [u, v] = [0, 1].map(|d| extremes(corners().map(|p| p[d])));
        let frame = Frame::new([u[0], v[0]], [u[1], v[1]], TALLEST);
        Self { plane, triangles, scale, frame, is_mirrored: !mirrors.is_empty() }
    }

    fn draw(&self, surface: &SurfaceValues, values: &[Option<f64>], id: &str, name: &str) -> Markup {
        let Frame { x, y } = self.frame;
        let coloured = self.triangles.iter().filter_map(|(corners, nodes)| {
            let [Some(a), Some(b), Some(c)] = nodes.map(|n| values[n]) else { return None };
            Some((*corners, [a, b, c].map(|v| self.scale.share(v))))
        });
        let [least, most] = extremes(values.iter().flatten().copied());
        let ends = if most - least > 1e-6 * most.abs() { vec![least, most] } else { Vec::new() };
        let [u, v] = self.frame.at([0.0; 2]);
        let titles = self.plane.titles.each_ref().map(String::as_str);
        let bar = format!("{} [mm]", surface.name());
        let content = html! {
            (self.frame.image(surface.colours(), coloured))
            (axes(&x, &y, titles, [6, 5]))
            @if self.is_mirrored {
                (line("mirror", [u, y.pixels[0]], [u, y.pixels[1]]))
                (line("mirror", [x.pixels[0], v], [x.pixels[1], v]))
            }
            @for end in ends { @if let Some(at) = self.middle_of(values, end) { (self.mark(at, end)) } }
            (colour_bar(id, surface.colours(), &self.scale, &bar, self.frame.bar_top()))
        };
        let [from, to] = [least, most].map(|end| trim_zeros(end, 2));
        let label = format!("Map of the {} {name}: from {from} to {to} millimetres", surface.name());
        svg(self.frame.height(), &label, &content)
    }

    /// A dot with its value beside it.
    fn mark(&self, at: [f64; 2], value: f64) -> Markup {
        let right = at[0] > self.frame.x.pixels[1] - 60.0;
        let (class, x) = if right { ("spot-text end", at[0] - 6.0) } else { ("spot-text", at[0] + 6.0) };
        html! {
            (dot("spot", at, 2.2))
            (text(class, x, at[1] + 4.0, &format!("{} mm", trim_zeros(value, 2))))
        }
    }

    /// The place on the page, of those with an extreme value, that lies deepest among its like.
    fn middle_of(&self, values: &[Option<f64>], extreme: f64) -> Option<[f64; 2]> {
        let near = 1e-3 * (self.scale.high - self.scale.low);
        let is = |n: usize| values[n].is_some_and(|v| (v - extreme).abs() <= near);
        // Of the model itself, which comes before its images.
        let own = &self.triangles[..self.triangles.len() / if self.is_mirrored { 4 } else { 1 }];
        let centre =
            |corners: &[[f64; 2]; 3]| [0, 1].map(|d| corners.iter().map(|c| c[d]).sum::<f64>() / 3.0);
        let (whole, others): (Vec<_>, Vec<_>) = own
            .iter()
            .map(|(corners, nodes)| (centre(corners), nodes))
            .partition(|(_, nodes)| nodes.iter().all(|&n| is(n)));
        let Frame { x, y } = &self.frame;
        let apart = |p: &[f64; 2]| {
            let to_other = others.iter().map(|(o, _)| (o[0] - p[0]).hypot(o[1] - p[1]));
            let to_edge = [p[0] - x.low, x.high - p[0], p[1] - y.low, y.high - p[1]];
            to_other.chain(to_edge).fold(f64::INFINITY, f64::min)
        };
        // A thousand candidates are enough to find where there is room.
        let step = whole.len().div_ceil(1000).max(1);
        let candidates = whole.iter().step_by(step).map(|(place, _)| (apart(place), place));
        candidates.max_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, place)| self.frame.at(*place))
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
        let regions = outline.full_mesh.topology().region_names();
        let bodies: Vec<&str> = design.bodies.iter().map(|r| regions[r.index()].as_str()).collect();
        format!("Thickness of {} behind the surface {names}", bodies.join(", "))
    } else {
        format!("Displacement of the surface {names} along its direction of motion")
    };
    if let Some(before) = &surface.values[0] {
        let [low, high] = extremes(before.iter().flatten().copied());
        let range = if high - low < 1e-6 * high.abs().max(1e-3) {
            format!("{} mm everywhere", trim_zeros(low, 2))
        } else {
            format!("{} to {} mm", trim_zeros(low, 2), trim_zeros(high, 2))
        };
        text += &format!("; before: {range}");
    }
    text += &format!("; after: {} to {} mm. ", trim_zeros(least, 2), trim_zeros(most, 2));
    if let Some(before) = &surface.values[0] {
        let [less, more] = shares_changed(outline, design, before, after);
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
fn shares_changed(
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
