//! `[[coils]]`: sources given by their analytic shape, or by a region of the mesh.

use serde::Serialize;
use serde_json::json;

use super::axis::{Axis, check_axis, length};
use crate::config::section::Section;
use crate::config::table::kinds::WORD;
use crate::config::table::rules::{Rules, Then, is};
use crate::config::table::{Group, table};
use crate::config::value::choice::choice;

table! {
    /// A source of current: either with a `shape`, of uniform current density and given by it alone, so that the mesh need not
    /// follow it, or a `region` of the mesh. A winding must lie outside of the part of the mesh that moves; in its window, up to
    /// the ends of the coil, the mesh may move.
    ///
    /// Where the outside of the mesh cuts a coil, it must cut straight sides at right angles, on a flux-parallel surface; a
    /// flux-normal plane may cut a coil's height, but no current may cross it: what is meshed of the winding is mirrored, so that the
    /// plane halves the coil in its middle, and makes another one of it elsewhere. Anything else is an error that says where and why.
    ///
    /// A `region` without `terminals` closes on itself: `center` and `axis` give any line through its hole, and positive
    /// current runs counter-clockwise about it. The current has the direction of conduction and the same magnitude everywhere,
    /// as in a stranded winding, less what is needed to free it of divergence; what is left of that, and the current through
    /// cross-sections, is printed. With `conductor = "solid"` the region is a conductor of its material, such as a busbar: above
    /// 0 Hz its current follows from the field, with skin effect and proximity, and it may move with the design.
    ///
    /// On a symmetry model all numbers are those of the meshed part. A plane along the current, which halves the cross-section of
    /// a `region`, halves its `ampere_turns`, and the `turns` of strands; a plane that the current crosses changes neither. The
    /// first is one of `flux_normal`, the second of `flux_parallel`. For either plane `voltage`, `resistance` and
    /// `series_inductance` of strands are half of the whole coil's, and `series_capacitance` is twice; so it is for a solid conductor
    /// that the plane crosses. Where the plane is along the current a solid conductor keeps its voltage and has half of the current,
    /// so that what is in series with it counts twice: twice the `resistance` and `series_inductance`, half of the
    /// `series_capacitance`. A `shape` keeps the ampere-turns and turns of the whole coil.
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
    ///
    /// [[coils]]
    /// name = "busbar"
    /// region = "busbar"
    /// conductor = "solid"
    /// voltage = "50 mV"
    /// terminals = ["z_min", "z_max"]
    /// ```
    pub struct Coil {
        /// What the coil is called in messages and results; each name once.
        name: String = TEXT, need "\"coil\"";
        /// Amplitude of current times turns [A]; positive is counter-clockwise about the axis, or from the first terminal to the
        /// second. Not 0, but of a coil with `turns` that is open. Either this or `voltage`.
        ampere_turns: Option<f64> = quantity(Current, FINITE);
        /// Turns of the winding; one of a solid conductor. With them the result has the coil's current, flux linkage, resistance and voltage, and the matrix of
        /// inductances, all of the meshed part.
        turns: Option<f64> = number(POSITIVE);
        /// Amplitude of the voltage that drives the current [V], instead of `ampere_turns`: across the winding and what is in series
        /// with it, of the meshed part.
        voltage: Option<f64> = quantity(Voltage, FINITE);
        /// Resistance of the wire and of what is in series [Ω]; of a solid conductor the latter alone. Above zero for a coil of
        /// strands that a voltage drives at 0 Hz. Default 0.
        resistance: Option<f64> = quantity(Resistance, NOT_NEGATIVE);
        /// Of a coil that a voltage drives, here or under a load: an inductance in series [H]. Default 0.
        series_inductance: Option<f64> = quantity(Inductance, NOT_NEGATIVE);
        /// Of a coil that a voltage drives, here or under a load: a capacitance in series [F], at frequencies above 0.
        series_capacitance: Option<f64> = quantity(Capacitance, POSITIVE);
        /// Phase of the current or voltage [rad].
        phase: f64 = quantity(Angle, FINITE) => 0.0;
        /// Where the current flows.
        #[serde(flatten)]
        shape: CoilShape = KEYS;
    }
    check = Coil::check;
    rules = keys_of_the_drive;
}

/// A current or a voltage, and windings for circuits.
fn keys_of_the_drive(rules: Rules) -> Rules {
    // A coil that is open must have terminals.
    let open = json!({ "required": ["ampere_turns"], "properties": { "ampere_turns": { "const": 0 } } });
    let rules = rules.exactly_one(&["ampere_turns", "voltage"]);
    let solid = is("conductor", &["solid"]);
    let turns = [
        json!({ "if": open, "then": { "required": ["turns"] } }),
        json!({ "dependentRequired": { "voltage": ["turns"], "resistance": ["turns"] } }),
    ];
    let one_turn = json!({ "properties": { "turns": { "const": 1 } } });
    rules.add(json!({ "if": solid, "then": one_turn, "else": { "allOf": turns } }))
}

/// Keys of a coil that a voltage drives, in `[[coils]]` or under a load.
pub(super) const IN_SERIES: [&str; 2] = ["series_inductance", "series_capacitance"];

table! {
    /// The keys that say where the current flows, for all shapes together.
    pub(in crate::config) struct ShapeKeys {
        /// The shape of the winding. Either this or `region`.
        shape: Option<ShapeWord> = WORD;
        /// Instead of `shape`: the region of the mesh that is the winding. One of strands must not conduct at a frequency above 0.
        region: Option<String> = TEXT;
        /// With `region`: strands that share the current equally, or one solid conductor. Default `"stranded"`.
        conductor: Option<ConductorWord> = WORD;
        /// Of a solid conductor: how separate parts between its terminals are connected. In series each carries the whole current.
        /// Default `"series"`.
        connection: Option<ConnectionWord> = WORD;
        /// Centre of the coil [m]; required with `shape`. Of a `region` without `terminals`: a point of a line through its hole.
        center: Option<[f64; 3]> = length(FINITE);
        /// Axis of the winding; the length of a vector does not matter.
        axis: Axis = ONE_OF => Axis::default();
        /// Racetrack and rectangular: direction of the first half size of the window, of which the part across the axis counts;
        /// the second is at right angles to it, counter-clockwise. Default: the coordinate that follows the axis cyclically (x
        /// for z), or its part across a slanted axis.
        #[also(not_all_zero)]
        direction: Option<[f64; 3]> = number(FINITE);
        /// Racetrack and rectangular, required: inner half sizes along `direction` and across it [m].
        half_window: Option<[f64; 2]> = length(POSITIVE);
        /// Circular, required: inner radius [m].
        radius: Option<f64> = length(POSITIVE);
        /// Radial width of the winding [m]; required with `shape`.
        width: Option<f64> = length(POSITIVE);
        /// Axial height of the winding [m]; required with `shape`.
        height: Option<f64> = length(POSITIVE);
        /// Racetrack: how the straight sides meet. Default `"mitred"`.
        corner: Option<CornerWord> = WORD;
        /// Racetrack, instead of `corner`: concentric round corners with this inner radius [m], at most the smaller half size of
        /// the window.
        inner_radius: Option<f64> = length(POSITIVE);
        /// With `region`: the surface where the current comes in, and the one where it goes out; both flux-parallel. Only
        /// triangles that are faces of the region count, so they may be whole symmetry planes. Separate parts of the region are
        /// in series: each carries all ampere-turns. Parts of strands that touch in nodes or along a line are separate, those with a common
        /// face are one.
        terminals: Option<[String; 2]> =
            two_names("two surfaces: where the current comes in, where it goes out");
    }
    unused = ShapeKeys::unused;
    rules = keys_of_the_shape;
}

const SIDES: [&str; 2] = ["direction", "half_window"];
const CORNERS: [&str; 2] = ["corner", "inner_radius"];
const BODY: [&str; 4] = ["center", "width", "height", "half_window"];
const NOT_OF_A_REGION: [&str; 7] =
    ["radius", "width", "height", "direction", "half_window", "corner", "inner_radius"];

impl ShapeKeys {
    /// The keys that go with other shapes.
    fn unused(section: &Section<'_>) -> Vec<&'static str> {
        match section.peek("shape", &WORD) {
            _ if section.has("region") && !section.has("shape") => NOT_OF_A_REGION.to_vec(),
            None | Some(ShapeWord::Racetrack) => vec!["radius", "conductor", "connection"],
            Some(ShapeWord::Rectangular) => [&["radius", "conductor", "connection"], &CORNERS[..]].concat(),
            Some(ShapeWord::Circular) => [&["conductor", "connection"], &SIDES[..], &CORNERS[..]].concat(),
        }
    }
}

/// Which keys go with which shape.
fn keys_of_the_shape(rules: Rules) -> Rules {
    rules
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
        .needs("conductor", &["region"])
        .add(json!({ "if": { "required": ["connection"] }, "then": is("conductor", &["solid"]) }))
        .with("region", Then { required: &[], refused: &NOT_OF_A_REGION })
        .with("terminals", Then { required: &[], refused: &["center", "axis"] })
        .add(json!({ "anyOf": [
            { "required": ["shape"] }, { "required": ["terminals"] }, { "required": ["center"] },
        ] }))
}

/// Where a coil's current flows.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "shape", rename_all = "lowercase")]
pub enum CoilShape {
    /// Four straight sides; `"rectangular"` is one with mitred corners.
    Racetrack(Racetrack),
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
    /// Strands, or one solid conductor. Default strands.
    #[serde(skip_serializing_if = "ConductorWord::is_stranded")]
    pub conductor: ConductorWord,
    /// Of a solid conductor: how its parts are connected. Default in series.
    #[serde(skip_serializing_if = "ConnectionWord::is_series")]
    pub connection: ConnectionWord,
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
    /// Words for `conductor`.
    pub enum ConductorWord {
        /// The current is given, with the same magnitude everywhere.
        Stranded = "stranded",
        /// The current is that of conduction and of the field.
        Solid = "solid",
    }
}

choice! {
    /// Words for `connection`.
    pub enum ConnectionWord {
        /// Each part carries the whole current.
        Series = "series",
        /// The parts share it.
        Parallel = "parallel",
    }
}

impl ConnectionWord {
    fn is_series(&self) -> bool {
        *self == Self::Series
    }
}

impl ConductorWord {
    fn is_stranded(&self) -> bool {
        *self == Self::Stranded
    }
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

impl Coil {
    /// Whether it is a solid conductor of the mesh.
    pub fn is_solid(&self) -> bool {
        matches!(&self.shape, CoilShape::Region(region) if region.conductor == ConductorWord::Solid)
    }

    fn check(&mut self, section: &Section<'_>) {
        section.exactly_one(&["ampere_turns", "voltage"], "ampere_turns = \"40 kA\"", "one of them");
        let is_solid = self.is_solid();
        if let Some(turns) = self.turns.filter(|turns| is_solid && *turns != 1.0) {
            let message = format!("`{}` is a solid conductor with {turns} turns", section.path());
            section.wrong("turns", message, "one turn or no such key, or conductor = \"stranded\"");
        }
        if is_solid {
            self.turns = Some(1.0);
        }
        if self.ampere_turns == Some(0.0) && self.turns.is_none() {
            let message = format!("`{}.ampere_turns` is 0 A: the coil makes no field", section.path());
            section.wrong("ampere_turns", message, "any current but 0 A, or turns of an open coil");
        }
        let needs = [("voltage", "turns"), ("resistance", "turns")];
        let is_there = |key: &str| section.has(key) || is_solid && key == "turns";
        for (key, other) in needs.into_iter().filter(|(key, other)| section.has(key) && !is_there(other)) {
            let message = format!("`{}.{key}` has no use without `{other}`", section.path());
            section.wrong(key, message, format!("{other} beside it, or no such key"));
        }
    }
}

impl Group for CoilShape {
    type Written = ShapeKeys;

    fn of(written: ShapeKeys, section: &Section<'_>) -> Self {
        section.exactly_one(
            &["shape", "region"],
            "shape = \"racetrack\", or region = \"winding\"",
            "shape with its dimensions, or region with its terminals",
        );
        check_axis(written.axis, section);
        match written.region.clone() {
            // What is no name is a fault of its own.
            region if section.has("region") && !section.has("shape") => {
                let region = region.unwrap_or_default();
                let conductor = written.conductor.unwrap_or(ConductorWord::Stranded);
                let connection = written.connection.unwrap_or(ConnectionWord::Series);
                if conductor == ConductorWord::Stranded && section.has("connection") {
                    let message = format!("`{}.connection` has no use for strands", section.path());
                    section.wrong("connection", message, "conductor = \"solid\" beside it, or no such key");
                }
                let path = CoilPath::of(written, section);
                Self::Region(RegionCoil { region, conductor, connection, path })
            }
            _ => Self::analytic(written, section),
        }
    }
}

impl CoilShape {
    fn analytic(written: ShapeKeys, section: &Section<'_>) -> Self {
        let ShapeKeys { shape, center, axis, direction, half_window, radius, width, height, .. } = written;
        let is_known = shape.is_some();
        if !is_known {
            section.excuse_hidden();
        }
        let shape = shape.unwrap_or(ShapeWord::Racetrack);
        if written.terminals.is_some() && !section.has("region") {
            section.wrong(
                "terminals",
                format!("`{}` has terminals, but an analytic coil closes on itself", section.path()),
                "region = \"NAME\" in place of shape, or no terminals",
            );
        }
        let window = ("half_window", "[\"60 mm\", \"160 mm\"]");
        let across = if shape == ShapeWord::Circular { ("radius", "\"60 mm\"") } else { window };
        let center_example = "[\"0 mm\", \"0 mm\", \"60 mm\"]";
        let required = [("center", center_example), ("width", "\"20 mm\""), ("height", "\"40 mm\""), across];
        // Which ones it needs, a shape that is missing or misspelt does not say.
        for (key, example) in required.into_iter().filter(|(key, _)| is_known && !section.has(key)) {
            section.missing(&[key], &format!("{key} = {example}"));
        }
        let center = center.unwrap_or([f64::NAN; 3]);
        let [radius, width, height] = [radius, width, height].map(|value| value.unwrap_or(f64::NAN));
        let direction = direction.filter(|direction| check_direction(*direction, axis, section));
        let half_window = half_window.unwrap_or([f64::NAN; 2]);
        if shape == ShapeWord::Circular {
            return Self::Circular(Circular { center, axis, radius, width, height });
        }
        // A rectangular coil has the keys of neither corner: it is mitred.
        let corner = Corner::of(written.corner, written.inner_radius, half_window, section);
        Self::Racetrack(Racetrack { center, axis, direction, half_window, width, height, corner })
    }
}

impl CoilPath {
    fn of(written: ShapeKeys, section: &Section<'_>) -> Self {
        if section.has("terminals") {
            for key in ["center", "axis"].into_iter().filter(|key| section.has(key)) {
                section.wrong(
                    key,
                    format!(
                        "`{}` has terminals, and `{key}` of a coil that closes on itself",
                        section.path()
                    ),
                    "terminals, or center and axis of a line through the hole",
                );
            }
            return Self::Terminals { terminals: written.terminals.unwrap_or_default() };
        }
        if !section.has("center") {
            section.missing(
                &["terminals", "center"],
                "terminals = [\"in\", \"out\"], or center = [\"0 mm\", \"0 mm\", \"0 mm\"] with an axis for a closed coil",
            );
        }
        Self::Closed { center: written.center.unwrap_or([f64::NAN; 3]), axis: written.axis }
    }
}

impl Corner {
    fn of(word: Option<CornerWord>, radius: Option<f64>, [a, b]: [f64; 2], section: &Section<'_>) -> Self {
        section.at_most_one(&CORNERS, "one of them");
        let Some(radius) = radius else { return Self::Sharp(word.unwrap_or(CornerWord::Mitred)) };
        if radius > a.min(b) {
            section.wrong(
                "inner_radius",
                format!(
                    "`{}.inner_radius` is {radius} m, more than a half size of the window",
                    section.path()
                ),
                format!("at most {} m", a.min(b)),
            );
        }
        Self::Round(radius)
    }
}

/// Whether a direction has a part across the axis.
fn check_direction(direction: [f64; 3], axis: Axis, section: &Section<'_>) -> bool {
    let [a, b] = [axis.vector(), direction];
    let across = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    // The bound of the solver's frame, below which no plane is left to turn in.
    let has_part = length(across) > 1e-6 * length(a) * length(b);
    if !has_part {
        let message = format!("`{}.direction` has no part across the axis", section.path());
        section.wrong("direction", message, "a vector that is not along the axis");
    }
    has_part
}
