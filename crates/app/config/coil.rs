//! `[[coils]]`: sources given by their analytic shape, or by a region of the mesh.

use schemars::{JsonSchema, Schema};
use serde::Serialize;
use serde_json::json;

use super::Dimension;
use super::choice::choice;
use super::range::Range;
use super::section::Section;
use crate::schema::form::{each_once, length as length_form, not_all_zero, not_zero, number, quantity};
use crate::schema::rules::{Rules, Then};

/// A source of current: either with a `shape`, of uniform current density and given by it alone, so that the mesh need not
/// follow it, or a `region` of the mesh. A coil must lie outside of the part of the mesh that moves.
///
/// Where the outside of the mesh cuts a coil, it must cut straight sides at right angles, on a flux-parallel surface; a
/// flux-normal plane may halve a coil's height, but no current may cross it. Anything else is an error that says where and
/// why.
///
/// A `region` without `terminals` closes on itself: `center` and `axis` give any line through its hole, and positive
/// current runs counter-clockwise about it. The current has the direction of conduction and the same magnitude everywhere,
/// as in a stranded winding, less what is needed to free it of divergence; what is left of that, and the current through
/// cross-sections, is printed.
///
/// ```toml
/// [[coils]]
/// name = "coil"
/// shape = "racetrack"
/// ampere_turns = "40 kA"
/// center = ["0 mm", "0 mm", "60 mm"]
/// half_window = ["60 mm", "160 mm"]
/// width = "20 mm"
/// height = "40 mm"
///
/// [[coils]]
/// name = "winding"
/// region = "winding"
/// ampere_turns = "500 A"
/// phase = "90 deg"
/// terminals = ["y_min", "x_min"]
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Coil {
    /// What the coil is called in messages and results; each name once.
    pub name: String,
    /// Amplitude of current times turns [A], not 0; positive is counter-clockwise about the axis, or from the first terminal
    /// to the second.
    #[schemars(transform = quantity(Dimension::Current, Range::FINITE), transform = not_zero)]
    pub ampere_turns: f64,
    /// Phase of the current [rad].
    #[schemars(transform = quantity(Dimension::Angle, Range::FINITE), extend("default" = 0))]
    pub phase: f64,
    /// Where the current flows.
    #[serde(flatten)]
    #[schemars(with = "ShapeKeys")]
    pub shape: CoilShape,
}

/// The keys that say where the current flows, for all shapes together.
#[derive(JsonSchema)]
#[schemars(transform = keys_of_the_shape)]
#[allow(dead_code, reason = "stands for the keys of `CoilShape` in the schema")]
struct ShapeKeys {
    /// The shape of the winding. Either this or `region`.
    shape: Option<ShapeWord>,
    /// Instead of `shape`: the region of the mesh that is the winding. It must not conduct at a frequency above 0.
    region: Option<String>,
    /// Centre of the coil [m]; required with `shape`. Of a `region` without `terminals`: a point of a line through its hole.
    #[schemars(transform = length_form(Range::FINITE))]
    center: Option<[f64; 3]>,
    /// Axis of the winding; the length of a vector does not matter.
    #[schemars(extend("default" = AxisWord::Z))]
    axis: Axis,
    /// Racetrack and rectangular: direction of the first half size of the window, of which the part across the axis counts;
    /// the second is at right angles to it, counter-clockwise. Default: the coordinate that follows the axis cyclically (x
    /// for z), or its part across a slanted axis.
    #[schemars(transform = number(Range::FINITE), transform = not_all_zero)]
    direction: Option<[f64; 3]>,
    /// Racetrack and rectangular, required: inner half sizes along `direction` and across it [m].
    #[schemars(transform = length_form(Range::POSITIVE))]
    half_window: Option<[f64; 2]>,
    /// Circular, required: inner radius [m].
    #[schemars(transform = length_form(Range::POSITIVE))]
    radius: Option<f64>,
    /// Radial width of the winding [m]; required with `shape`.
    #[schemars(transform = length_form(Range::POSITIVE))]
    width: Option<f64>,
    /// Axial height of the winding [m]; required with `shape`.
    #[schemars(transform = length_form(Range::POSITIVE))]
    height: Option<f64>,
    /// Racetrack: how the straight sides meet. Default `"mitred"`.
    corner: Option<CornerWord>,
    /// Racetrack, instead of `corner`: concentric round corners with this inner radius [m], at most the smaller half size of
    /// the window.
    #[schemars(transform = length_form(Range::POSITIVE))]
    inner_radius: Option<f64>,
    /// With `region`: the surface where the current comes in, and the one where it goes out; both flux-parallel. Only
    /// triangles that are faces of the region count, so they may be whole symmetry planes. Separate parts of the region are
    /// in series: each carries all ampere-turns.
    #[schemars(transform = each_once)]
    terminals: Option<[String; 2]>,
}

/// Which keys go with which shape.
fn keys_of_the_shape(schema: &mut Schema) {
    const SIDES: [&str; 2] = ["direction", "half_window"];
    const CORNERS: [&str; 2] = ["corner", "inner_radius"];
    const BODY: [&str; 4] = ["center", "width", "height", "half_window"];
    Rules::of(schema)
        .exactly_one(&["shape", "region"])
        .not_both(CORNERS)
        .when("shape", &["racetrack"], Then { required: &BODY, refused: &["radius", "terminals"] })
        .when(
            "shape",
            &["rectangular"],
            Then { required: &BODY, refused: &["radius", "terminals", CORNERS[0], CORNERS[1]] },
        )
        .when(
            "shape",
            &["circular"],
            Then {
                required: &["center", "width", "height", "radius"],
                refused: &["terminals", SIDES[0], SIDES[1], CORNERS[0], CORNERS[1]],
            },
        )
        .with(
            "region",
            Then {
                required: &[],
                refused: &["radius", "width", "height", SIDES[0], SIDES[1], CORNERS[0], CORNERS[1]],
            },
        )
        .with("terminals", Then { required: &[], refused: &["center", "axis"] })
        .add(json!({ "anyOf": [
            { "required": ["shape"] }, { "required": ["terminals"] }, { "required": ["center"] },
        ] }));
}

/// Where a coil's current flows.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "shape", rename_all = "lowercase")]
pub enum CoilShape {
    /// Four straight sides.
    Racetrack(Racetrack),
    /// Four straight sides with mitred corners.
    Rectangular(Rectangular),
    /// A circle.
    Circular(Circular),
    /// A region of the mesh.
    #[serde(untagged)]
    Region(RegionCoil),
}

/// A coil with straight sides, as analytic source.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Racetrack {
    /// Centre of the coil [m].
    pub center: [f64; 3],
    /// Axis of the winding. Default z.
    pub axis: Axis,
    /// Direction of the first half size of the window. Default: the coordinate that follows the axis cyclically.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f64; 3]>,
    /// Inner half sizes across the axis: along the direction, and across both [m].
    pub half_window: [f64; 2],
    /// Radial width of the winding [m].
    pub width: f64,
    /// Axial height of the winding [m].
    pub height: f64,
    /// How the straight sides meet. Default mitred: the rectangular coil of the paper.
    #[serde(flatten)]
    pub corner: Corner,
}

/// A rectangular coil, as analytic source; fields as those of [`Racetrack`].
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the fields are those of the racetrack")]
pub struct Rectangular {
    pub center: [f64; 3],
    pub axis: Axis,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f64; 3]>,
    pub half_window: [f64; 2],
    pub width: f64,
    pub height: f64,
}

/// A circular coil, as analytic source.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Circular {
    /// Centre of the coil [m].
    pub center: [f64; 3],
    /// Axis of the winding. Default z.
    pub axis: Axis,
    /// Inner radius [m].
    pub radius: f64,
    /// Radial width of the winding [m].
    pub width: f64,
    /// Axial height of the winding [m].
    pub height: f64,
}

/// A coil that is a region of the mesh.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RegionCoil {
    /// Name of the region.
    pub region: String,
    /// The way of the current.
    #[serde(flatten)]
    pub path: CoilPath,
}

/// The way of the current in a region.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum CoilPath {
    /// From one surface to another.
    Terminals {
        /// Names of the surfaces.
        terminals: [String; 2],
    },
    /// Round a hole.
    Closed {
        /// A point of a line through the hole [m].
        center: [f64; 3],
        /// Direction of that line. Default z.
        axis: Axis,
    },
}

choice! {
    /// Words for `shape`.
    pub enum ShapeWord {
        /// Four straight sides with corners of choice.
        Racetrack = "racetrack",
        /// Four straight sides with mitred corners.
        Rectangular = "rectangular",
        /// A circle.
        Circular = "circular",
    }
}

choice! {
    /// A coordinate axis.
    pub enum AxisWord {
        /// x.
        X = "x",
        /// y.
        Y = "y",
        /// z.
        Z = "z",
    }
}

impl AxisWord {
    /// Its coordinate: 0, 1 or 2.
    pub fn index(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
        }
    }
}

/// The axis of a coil or of a rotation: the name of a coordinate, or a vector.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum Axis {
    /// A coordinate axis.
    Coordinate(AxisWord),
    /// Along a vector of any length but zero.
    Vector(#[schemars(transform = number(Range::FINITE), transform = not_all_zero)] [f64; 3]),
}

impl Axis {
    /// A vector along the axis.
    pub fn vector(self) -> [f64; 3] {
        match self {
            Self::Coordinate(word) => {
                let mut vector = [0.0; 3];
                vector[word.index()] = 1.0;
                vector
            }
            Self::Vector(vector) => vector,
        }
    }
}

choice! {
    /// Words for `corner`.
    pub enum CornerWord {
        /// The current turns on the diagonal.
        Mitred = "mitred",
    }
}

/// How the sides of a racetrack meet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum Corner {
    /// Straight to the corner.
    #[serde(rename = "corner")]
    Sharp(CornerWord),
    /// Concentric arcs with this inner radius [m].
    #[serde(rename = "inner_radius")]
    Round(f64),
}

/// Examples for messages.
const CENTER: &str = "[\"0 mm\", \"0 mm\", \"60 mm\"]";

/// Read `[[coils]]`.
pub(super) fn read_coils(root: &Section<'_>) -> Vec<Coil> {
    let coils: Vec<_> = root.tables("coils").into_iter().map(Coil::read).collect();
    let names: Vec<_> = coils.iter().map(|coil| coil.name.clone()).collect();
    root.named_twice("coils", &names, "coils", "a different name for each coil");
    coils
}

impl Coil {
    fn read(section: Section<'_>) -> Self {
        let name = section.text("name");
        let ampere_turns = section.quantity("ampere_turns", Dimension::Current, Range::FINITE);
        if ampere_turns == Some(0.0) {
            let message = format!("`{}.ampere_turns` is 0 A: the coil makes no field", section.path());
            section.wrong("ampere_turns", message, "any current but 0 A");
        }
        let phase = section.quantity("phase", Dimension::Angle, Range::FINITE).unwrap_or(0.0);
        let shape = section.choice("shape");
        let region = section.text("region");
        if section.has("shape") && section.has("region") {
            section.clash(
                ["shape", "region"],
                format!("`{}` has both `shape` and `region`", section.path()),
                "shape with its dimensions, or region with its terminals",
            );
        } else if !section.has("shape") && !section.has("region") {
            section.missing("shape", "shape = \"racetrack\", or region = \"winding\"");
        }
        let coil = Self {
            name: section.need("name", name, "\"coil\""),
            ampere_turns: section.need("ampere_turns", ampere_turns, "\"40 kA\""),
            phase,
            shape: match (shape, region) {
                (None, Some(region)) if !section.has("shape") => {
                    CoilShape::Region(RegionCoil { region, path: read_path(&section) })
                }
                (shape, _) => read_shape(&section, shape.unwrap_or(ShapeWord::Racetrack)),
            },
        };
        section.finish();
        coil
    }
}

fn read_shape(section: &Section<'_>, shape: ShapeWord) -> CoilShape {
    if section.names("terminals").is_some() && !section.has("region") {
        section.wrong(
            "terminals",
            format!("`{}` has terminals, but an analytic coil closes on itself", section.path()),
            "region = \"NAME\" in place of shape, or no terminals",
        );
    }
    let center = section.need("center", section.lengths("center", Range::FINITE), CENTER);
    let axis = read_axis(section);
    let width = section.quantity("width", Dimension::Length, Range::POSITIVE);
    let height = section.quantity("height", Dimension::Length, Range::POSITIVE);
    let width = section.need("width", width, "\"20 mm\"");
    let height = section.need("height", height, "\"40 mm\"");
    if shape == ShapeWord::Circular {
        let radius = section.quantity("radius", Dimension::Length, Range::POSITIVE);
        let radius = section.need("radius", radius, "\"60 mm\"");
        return CoilShape::Circular(Circular { center, axis, radius, width, height });
    }
    let direction = read_direction(section, axis);
    let window = section.lengths("half_window", Range::POSITIVE);
    let half_window = section.need("half_window", window, "[\"60 mm\", \"160 mm\"]");
    if shape == ShapeWord::Rectangular {
        return CoilShape::Rectangular(Rectangular { center, axis, direction, half_window, width, height });
    }
    let corner = read_corner(section, window);
    CoilShape::Racetrack(Racetrack { center, axis, direction, half_window, width, height, corner })
}

fn read_path(section: &Section<'_>) -> CoilPath {
    let names = section.names("terminals");
    let center = section.lengths("center", Range::FINITE);
    let axis = read_axis(section);
    if section.has("terminals") {
        for key in ["center", "axis"].into_iter().filter(|key| section.has(key)) {
            section.wrong(
                key,
                format!("`{}` has terminals, and `{key}` of a coil that closes on itself", section.path()),
                "terminals, or center and axis of a line through the hole",
            );
        }
        let terminals = names.and_then(|names| {
            let count = names.len();
            let pair = <[String; 2]>::try_from(names).ok();
            if pair.is_none() {
                let message = format!("`{}.terminals` has {count} items", section.path());
                section.wrong(
                    "terminals",
                    message,
                    "two surfaces: where the current comes in, where it goes out",
                );
            }
            pair
        });
        return CoilPath::Terminals { terminals: terminals.unwrap_or_default() };
    }
    if !section.has("center") {
        section.missing(
            "terminals",
            "terminals = [\"in\", \"out\"], or center = [\"0 mm\", \"0 mm\", \"0 mm\"] with an axis for a closed coil",
        );
    }
    CoilPath::Closed { center: center.unwrap_or([f64::NAN; 3]), axis }
}

/// `axis`: the name of a coordinate, or a vector.
pub(super) fn read_axis(section: &Section<'_>) -> Axis {
    let default = Axis::Coordinate(AxisWord::Z);
    if !section.is_list("axis") {
        return section.choice("axis").map_or(default, Axis::Coordinate);
    }
    match section.numbers("axis", Range::FINITE) {
        Some(vector) if length(vector) > 0.0 => Axis::Vector(vector),
        Some(_) => {
            let message = format!("`{}.axis` has no length", section.path());
            section.wrong("axis", message, "\"x\", \"y\", \"z\", or a vector that is not zero");
            default
        }
        None => default,
    }
}

fn read_direction(section: &Section<'_>, axis: Axis) -> Option<[f64; 3]> {
    let direction: [f64; 3] = section.numbers("direction", Range::FINITE)?;
    let [a, b] = [axis.vector(), direction];
    let across = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    // The bound of the solver's frame, below which no plane is left to turn in.
    if length(across) > 1e-6 * length(a) * length(b) {
        return Some(direction);
    }
    let message = format!("`{}.direction` has no part across the axis", section.path());
    section.wrong("direction", message, "a vector that is not along the axis");
    None
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

fn read_corner(section: &Section<'_>, half_window: Option<[f64; 2]>) -> Corner {
    let word = section.choice("corner");
    let radius = section.quantity("inner_radius", Dimension::Length, Range::POSITIVE);
    if section.has("corner") && section.has("inner_radius") {
        section.clash(
            ["corner", "inner_radius"],
            format!("`{}` has both `corner` and `inner_radius`", section.path()),
            "one of them",
        );
    }
    if let (Some(radius), Some([a, b])) = (radius, half_window)
        && radius > a.min(b)
    {
        section.wrong(
            "inner_radius",
            format!("`{}.inner_radius` is {radius} m, more than a half size of the window", section.path()),
            format!("at most {} m", a.min(b)),
        );
    }
    match radius {
        Some(radius) => Corner::Round(radius),
        None => Corner::Sharp(word.unwrap_or(CornerWord::Mitred)),
    }
}
