//! Before and after: the design surface seen along its direction of motion, coloured by the thickness behind it.

use std::collections::BTreeSet;

use fluxmorph_geometry::NodeId;
use fluxmorph_geometry::box_tree::AxisBox;
use fluxmorph_geometry::tet4::{self, Point, area_vector, norm};
use maud::{Markup, html};

use super::colour::ColourMap;
use super::data::RunData;
use super::frame::Frame;
use super::moment::{Moment, place};
use super::plane::{Plane, extremes, images, mirrored, mirrors, with_room};
use super::plot::{LEFT, RIGHT, Scale, WIDTH, axes, colour_bar, dot, line, svg, text};
use super::ticks::{Count, decimals_of, number, trim_zeros};
use super::words::capital;
use crate::build::{Outline, OutlinedDesign};
use crate::config::{DesignDirection, DirectionWord};

/// Tallest drawing area.
const TALLEST: f64 = 300.0;

/// Named surfaces that have a drawing each.
const MOST_PARTS: usize = 6;

/// What a triangle has across it, over its longest side, where it is seen along its edge.
const EDGE_ON: f64 = 1e-9;

/// An axis is taken for a later one that is as wide but for so much, which rounding may add.
const WIDER: f64 = 1.001;

/// Least height of a row of text, and greatest length of the text of a mark.
const LEAST_ROW: f64 = 18.0;
const LONGEST_MARK: f64 = 60.0;

/// Triangles that are looked at where some are enough to find a place.
const MOST_CANDIDATES: usize = 1000;

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
    fn new(data: &RunData, outline: &Outline, design: &OutlinedDesign) -> Self {
        let thickness = (!is_along_normals(data)).then(|| Self::thickness(data, outline, design)).flatten();
        thickness.unwrap_or_else(|| Self {
            values: data.designs.each_ref().map(|values| {
                let heights = design.surface.normal_displacements(values.as_ref()?);
                Some(heights.iter().map(|h| Some(1e3 * h)).collect())
            }),
            is_thickness: false,
        })
    }

    /// Thickness of the bodies; `None` where they have none, or what lies opposite may have moved and no field file says where to.
    pub(super) fn thickness(data: &RunData, outline: &Outline, design: &OutlinedDesign) -> Option<Self> {
        let thickness = design.thickness.as_ref()?;
        let free = data.config.remesh.iter().flat_map(|remesh| &remesh.free);
        let free = free.filter_map(|name| outline.full_mesh.topology().surface(name).ok());
        let free: BTreeSet<NodeId> = free.flatten().flatten().copied().collect();
        let may_move = thickness.opposite_nodes().any(|node| free.contains(&node));
        let values = [Moment::Before, Moment::After].map(|moment| {
            let place = place(data, outline, design, moment)
                .filter(|_| !may_move || data.fields[moment as usize].is_ok())?;
            let mut all = vec![None; design.surface.nodes().len()];
            let least = thickness.least_at_nodes(place);
            least.into_iter().for_each(|(i, thickness)| all[i] = Some(1e3 * thickness));
            Some(all)
        });
        values[1].is_some().then_some(Self { values, is_thickness: true })
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
    let surface = SurfaceValues::new(data, outline, design);
    let after = surface.values[1].as_ref().ok_or("the best design is not known, or not one of this mesh")?;
    let [low, high] = surface.range().ok_or("no node of the design surface has a value")?;
    if surface.is_signed() && surface.values.iter().flatten().flatten().flatten().all(|height| *height == 0.0)
    {
        return Err("nothing has moved".to_owned());
    }
    let scale = Scale { low, high, count: Count::Linear, pixels: [LEFT, WIDTH - RIGHT] };
    let drawings = drawings(data, outline, design, &scale);
    let is_hidden = drawings.iter().any(|(_, drawing)| drawing.hides_some);
    let names = if data.is_run() { ["before", "after"] } else { ["undeformed", "the design analysed"] };
    let maps = names.into_iter().zip(&surface.values);
    let known: Vec<_> = maps.filter_map(|(name, values)| Some((name, values.as_ref()?))).collect();
    Ok(html! {
        figure id="shape-map" {
            @for (part, (of, drawing)) in drawings.iter().enumerate() {
                div class="pair" {
                    @for (k, (name, values)) in known.iter().enumerate() {
                        div {
                            h3 { (capital(name)) (of) }
                            (drawing.draw(&surface, values, &format!("map-{part}-{k}"), &format!("{name}{of}")))
                        }
                    }
                }
            }
            figcaption {
                (caption(data, outline, design, &surface, after))
                @if is_hidden { " What lies behind other parts of the surface is seen in the turning view alone." }
            }
        }
    })
}

/// The design surface as one drawing; where its named surfaces would hide each other, a drawing for each with its name.
fn drawings(
    data: &RunData,
    outline: &Outline,
    design: &OutlinedDesign,
    scale: &Scale,
) -> Vec<(String, Drawing)> {
    let drawing = |triangles: &[[NodeId; 3]]| Drawing::new(data, outline, (design, triangles), *scale);
    let whole = drawing(&design.triangles);
    let names = data.config.design.as_ref().map_or(&[][..], |design| &design.surface);
    if !(2..=MOST_PARTS).contains(&names.len()) || !whole.hides_some {
        return vec![(String::new(), whole)];
    }
    let triangles_of = |name: &String| outline.full_mesh.topology().surface(name).ok();
    let of = |name: &String| Some((format!(", {name}"), drawing(triangles_of(name)?)));
    names.iter().filter_map(of).collect()
}

/// Where the text of a mark stands.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Left,
    /// Right of it, left at the right edge.
    WithRoom,
}

/// A triangle on the page.
struct Drawn {
    /// [mm]
    corners: [[f64; 2]; 3],
    /// How near its middle is to the reader [m].
    nearness: f64,
    /// The places of its nodes in the surface.
    nodes: [usize; 3],
}

impl Drawn {
    fn middle(&self) -> [f64; 2] {
        [0, 1].map(|d| self.corners.iter().map(|c| c[d]).sum::<f64>() / 3.0)
    }

    /// Whether it lies before a place that is this near.
    fn hides(&self, [x, y]: [f64; 2], nearness: f64) -> bool {
        if self.nearness <= nearness {
            return false;
        }
        let [a, b, c] = self.corners;
        let turn = |p: [f64; 2], q: [f64; 2]| (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
        let turns = [turn(a, b), turn(b, c), turn(c, a)];
        let sides = [(a, b), (b, c), (c, a)].map(|(p, q)| (q[0] - p[0]).powi(2) + (q[1] - p[1]).powi(2));
        // Seen along its edge it hides nothing, whatever rounding says.
        let least = EDGE_ON * sides.into_iter().fold(0.0, f64::max);
        turns.iter().all(|t| *t > least) || turns.iter().all(|t| *t < -least)
    }
}

/// One view of the surface: where its triangles are on the page.
struct Drawing {
    plane: Plane,
    /// Every triangle in every mirror image.
    triangles: Vec<Drawn>,
    scale: Scale,
    frame: Frame,
    is_mirrored: bool,
    /// Whether triangles lie before others, as far as some of them tell.
    hides_some: bool,
}

impl Drawing {
    fn new(
        data: &RunData,
        outline: &Outline,
        (design, triangles_of_model): (&OutlinedDesign, &[[NodeId; 3]]),
        scale: Scale,
    ) -> Self {
        let nodes = design.surface.nodes();
        let points: Vec<Point> =
            triangles_of_model.iter().flatten().map(|&n| outline.full_mesh.point(n)).collect();
        let towards_reader = seen_from(data, outline, (design, triangles_of_model));
        let plane = Plane::across(towards_reader, &points);
        let mirrors = mirrors(&data.config);
        let place = |node| nodes.binary_search(&node).unwrap_or(0);
        let mut triangles = Vec::new();
        for image in images(&mirrors) {
            for triangle in triangles_of_model {
                let points = triangle.map(|n| mirrored(&image, outline.full_mesh.point(n)));
                let nearness = points.iter().map(|p| tet4::dot(*p, towards_reader)).sum::<f64>() / 3.0;
                triangles.push(Drawn {
                    corners: points.map(|p| plane.flat(p)),
                    nearness,
                    nodes: triangle.map(place),
                });
            }
        }
        let corners = || triangles.iter().flat_map(|drawn| drawn.corners);
        let [u, v] = [0, 1].map(|d| extremes(corners().map(|p| p[d])));
        let frame = Frame::new([u[0], v[0]], [u[1], v[1]], TALLEST);
        let mut drawing =
            Self { plane, triangles, scale, frame, is_mirrored: !mirrors.is_empty(), hides_some: false };
        let step = drawing.triangles.len().div_ceil(MOST_CANDIDATES).max(1);
        drawing.hides_some = drawing.triangles.iter().step_by(step).any(|drawn| !drawing.is_seen(drawn));
        drawing
    }

    /// Whether nothing lies before a triangle.
    fn is_seen(&self, drawn: &Drawn) -> bool {
        let middle = drawn.middle();
        !self.triangles.iter().any(|other| other.hides(middle, drawn.nearness))
    }

    fn draw(&self, surface: &SurfaceValues, values: &[Option<f64>], id: &str, name: &str) -> Markup {
        let Frame { x, y } = self.frame;
        // What is near is drawn over what lies behind.
        let mut order: Vec<&Drawn> = self.triangles.iter().collect();
        order.sort_by(|a, b| a.nearness.total_cmp(&b.nearness));
        let coloured = order.into_iter().filter_map(|drawn| {
            let [Some(a), Some(b), Some(c)] = drawn.nodes.map(|n| values[n]) else { return None };
            Some((drawn.corners, [a, b, c].map(|v| self.scale.share(v))))
        });
        let rows = (((y.pixels[0] - y.pixels[1]) / LEAST_ROW) as usize).clamp(1, 5);
        let nodes = self.triangles.iter().flat_map(|drawn| drawn.nodes);
        let [least, most] = extremes(nodes.filter_map(|n| values[n]));
        let ends = if most - least > 1e-6 * most.abs() { vec![least, most] } else { Vec::new() };
        let place = |end: f64| Some((self.middle_of(values, end)?, end));
        let marks: Vec<([f64; 2], f64)> = ends.into_iter().filter_map(place).collect();
        // The text of one would run into the other.
        let is_beside = |at: [f64; 2], other: [f64; 2]| {
            (0.0..2.0 * LONGEST_MARK).contains(&(other[0] - at[0])) && (at[1] - other[1]).abs() < LEAST_ROW
        };
        let [u, v] = self.frame.at([0.0; 2]);
        let titles = self.plane.titles.each_ref().map(String::as_str);
        let bar = format!("{} [mm]", surface.name());
        let content = html! {
            (self.frame.image(surface.colours(), coloured))
            (axes(&x, &y, titles, [6, rows]))
            @if self.is_mirrored {
                (line("mirror", [u, y.pixels[0]], [u, y.pixels[1]]))
                (line("mirror", [x.pixels[0], v], [x.pixels[1], v]))
            }
            @for (k, (at, end)) in marks.iter().enumerate() {
                @let is_left_one = marks.get(1 - k).is_some_and(|(other, _)| is_beside(*at, *other));
                (self.mark(*at, *end, if is_left_one { Side::Left } else { Side::WithRoom }))
            }
            (colour_bar(id, surface.colours(), &self.scale, &bar, self.frame.bar_top()))
        };
        let decimals = decimals_of(&[least, most], 2);
        let [from, to] = [least, most].map(|end| trim_zeros(end, decimals));
        let label = format!("Map of the {} {name}: from {from} to {to} millimetres", surface.name());
        svg(self.frame.height(), &label, &content)
    }

    /// A dot with its value beside it.
    fn mark(&self, at: [f64; 2], value: f64, side: Side) -> Markup {
        let is_left = side == Side::Left || at[0] > self.frame.x.pixels[1] - LONGEST_MARK;
        let (class, x) = if is_left { ("spot-text end", at[0] - 6.0) } else { ("spot-text", at[0] + 6.0) };
        html! {
            (dot("spot", at, 2.2))
            (text(class, x, at[1] + 4.0, &format!("{} mm", trim_zeros(value, decimals_of(&[value], 2)))))
        }
    }

    /// The place on the page, of those with an extreme value that are seen, that lies deepest among its like.
    fn middle_of(&self, values: &[Option<f64>], extreme: f64) -> Option<[f64; 2]> {
        let near = 1e-3 * (self.scale.high - self.scale.low);
        let is = |n: usize| values[n].is_some_and(|v| (v - extreme).abs() <= near);
        // Of the model itself, which comes before its images.
        let own = &self.triangles[..self.triangles.len() / if self.is_mirrored { 4 } else { 1 }];
        let (whole, others): (Vec<&Drawn>, Vec<&Drawn>) =
            own.iter().partition(|drawn| drawn.nodes.iter().all(|&n| is(n)));
        let others: Vec<[f64; 2]> = others.into_iter().map(Drawn::middle).collect();
        let Frame { x, y } = &self.frame;
        let apart = |p: &[f64; 2]| {
            let to_other = others.iter().map(|o| (o[0] - p[0]).hypot(o[1] - p[1]));
            let to_edge = [p[0] - x.low, x.high - p[0], p[1] - y.low, y.high - p[1]];
            to_other.chain(to_edge).fold(f64::INFINITY, f64::min)
        };
        let step = whole.len().div_ceil(MOST_CANDIDATES).max(1);
        let seen = whole.into_iter().step_by(step).filter(|drawn| self.is_seen(drawn)).map(Drawn::middle);
        let candidates = seen.map(|place| (apart(&place), place));
        candidates.max_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, place)| self.frame.at(place))
    }
}

/// Whether every node moves along its own normal.
pub(super) fn is_along_normals(data: &RunData) -> bool {
    let direction = data.config.design.as_ref().map(|design| design.direction);
    matches!(direction, Some(DesignDirection::Word(DirectionWord::Normal)))
}

/// The direction of the design, or where most of the surface looks; upwards where it looks everywhere.
pub(super) fn view_normal(data: &RunData, design: &OutlinedDesign) -> Point {
    common_direction(data, (design, &design.triangles)).unwrap_or([0.0, 0.0, 1.0])
}

/// The direction of the design, or where most of some triangles of the surface look; `None` where they look everywhere.
fn common_direction(data: &RunData, (design, triangles): (&OutlinedDesign, &[[NodeId; 3]])) -> Option<Point> {
    if let Some(DesignDirection::Vector(direction)) = data.config.design.as_ref().map(|d| d.direction) {
        return Some(direction);
    }
    // Out of the body, whatever the turn of the triangles.
    let nodes: BTreeSet<NodeId> = triangles.iter().flatten().copied().collect();
    let own = nodes.iter().filter_map(|node| design.surface.nodes().binary_search(node).ok());
    let directions: Vec<Point> = own.map(|i| design.surface.directions()[i]).collect();
    let sum: Point = std::array::from_fn(|d| directions.iter().map(|own| own[d]).sum());
    (norm(sum) > 0.2 * directions.len() as f64).then_some(sum)
}

/// Where a map is seen from: a surface that looks everywhere, along the axis across which most of its area lies.
fn seen_from(
    data: &RunData,
    outline: &Outline,
    (design, triangles): (&OutlinedDesign, &[[NodeId; 3]]),
) -> Point {
    common_direction(data, (design, triangles)).unwrap_or_else(|| {
        let mut across = [0.0; 3];
        for triangle in triangles {
            let area = area_vector(triangle.map(|n| outline.full_mesh.point(n)));
            (0..3).for_each(|d| across[d] += area[d].abs());
        }
        let widest = (0..3).fold(0, |widest, d| if across[d] > WIDER * across[widest] { d } else { widest });
        std::array::from_fn(|d| f64::from(d == widest))
    })
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
    let decimals = decimals_of(&[least, most], 2);
    if let Some(before) = &surface.values[0] {
        let [low, high] = extremes(before.iter().flatten().copied());
        let range = if high - low <= 1e-6 * high.abs().max(most.abs()) {
            format!("{} mm everywhere", trim_zeros(low, decimals))
        } else {
            format!("{} to {} mm", trim_zeros(low, decimals), trim_zeros(high, decimals))
        };
        text += &format!("; before: {range}");
    }
    text += &format!("; after: {} to {} mm. ", trim_zeros(least, decimals), trim_zeros(most, decimals));
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
    text += "All figures have the same scale.";
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
    let size = 1e3 * AxisBox::around(nodes.iter().map(|&n| outline.full_mesh.point(n))).extent();
    // A micrometre is nobody's design, but on a device of some millimetres.
    let least = 3e-3_f64.min(3e-5 * size);
    for triangle in &design.triangles {
        let area = norm(area_vector(triangle.map(|n| outline.full_mesh.point(n))));
        let change: f64 = triangle
            .iter()
            .filter_map(|n| nodes.binary_search(n).ok())
            .filter_map(|i| Some(after[i]? - before[i]?))
            .sum();
        total += area;
        if change < -least {
            shares[0] += area;
        } else if change > least {
            shares[1] += area;
        }
    }
    shares.map(|share| share / total)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_hides_what_lies_behind_it_and_none_that_is_seen_along_its_edge() {
        let near = Drawn { corners: [[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]], nearness: 1.0, nodes: [0, 1, 2] };
        assert!(near.hides([0.9, 0.9], 0.5) && !near.hides([0.9, 0.9], 1.5) && !near.hides([2.0, 2.0], 0.5));
        let turned = Drawn { corners: [[0.0, 0.0], [0.0, 3.0], [3.0, 0.0]], ..near };
        assert!(turned.hides([0.9, 0.9], 0.5), "from either side");
        let edge_on = Drawn { corners: [[0.0, 0.0], [3.0, 1e-16], [1.5, 1e-15]], ..turned };
        assert!(!edge_on.hides(edge_on.middle(), 0.5));
    }
}
