//! `[[morph.motion]]`: which nodes move, and along which path.

use schemars::{JsonSchema, Schema};
use serde::Serialize;
use serde_json::json;

use super::super::choice::choice;
use super::super::coil::{Axis, AxisWord, read_axis};
use super::super::quantity::Dimension;
use super::super::range::Range;
use super::super::section::Section;
use crate::schema::form::{length, name_or_names, not_empty, number, quantity};
use crate::schema::rules::{Rules, Then};

/// Nodes and their motion. Exactly one of `surface`, `line`, `nodes`, `box` and `design` says which nodes; later motions
/// win at nodes of several. All three components of such a node are prescribed. A node belongs to a line, box or point up
/// to a millionth of the mesh's diagonal.
///
/// With t from 0 to 1 a node is scaled by 1 + (factor − 1) t, then turned by t times the angle, then shifted by t times the
/// displacement. At least one of the three is needed where there is no `design`, and none beside it.
///
/// ```toml
/// [[morph.motion]]
/// surface = "z_max"
/// displacement = ["0 mm", "0 mm", "5 mm"]
///
/// [[morph.motion]]
/// box = [["0 mm", "0 mm", "0 mm"], ["10 mm", "10 mm", "0 mm"]]
/// rotation = { axis = "z", angle = "30 deg" }
/// ```
// A node at x goes to c_r + R(t · angle) (c_s + (1 + (factor − 1) t) (x − c_s) − c_r) + t · displacement.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PrescribedMotion {
    /// Which nodes.
    #[serde(flatten)]
    #[schemars(with = "TargetKeys")]
    pub target: Target,
    /// Translation [m].
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(transform = length(Range::FINITE))]
    pub displacement: Option<[f64; 3]>,
    /// Finite rotation, after the scaling.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation: Option<Rotation>,
    /// Scaling, before all else.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<Scale>,
}

/// Which nodes move, as it is written.
#[derive(JsonSchema)]
#[schemars(transform = one_target)]
#[allow(dead_code, reason = "stands for the keys of `Target` in the schema")]
struct TargetKeys {
    /// All nodes of these surfaces, interfaces `"a|b"` included.
    #[schemars(transform = name_or_names)]
    surface: Option<Vec<String>>,
    /// All nodes on the segment between two points [m].
    #[schemars(transform = length(Range::FINITE))]
    line: Option<[[f64; 3]; 2]>,
    /// The nodes at these points [m].
    #[schemars(transform = length(Range::FINITE), transform = not_empty)]
    nodes: Option<Vec<[f64; 3]>>,
    /// All nodes between two corners [m], the lower one first; the box may be flat.
    #[schemars(transform = length(Range::FINITE))]
    r#box: Option<[[f64; 3]; 2]>,
    /// The nodes of `[design]`, moved by a design.
    design: Option<DesignMotion>,
}

fn one_target(schema: &mut Schema) {
    Rules::of(schema)
        .exactly_one(&TARGETS)
        .with("design", Then { required: &[], refused: &TRANSFORMS })
        .add(json!({ "if": { "required": ["design"] }, "else": { "anyOf": TRANSFORMS.map(|key| json!({ "required": [key] })) } }));
}

/// Which nodes move.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Target {
    /// All nodes of these surfaces.
    #[serde(rename = "surface")]
    Surface(Vec<String>),
    /// All nodes on the segment between two points [m].
    #[serde(rename = "line")]
    Line([[f64; 3]; 2]),
    /// The nodes at these points [m].
    #[serde(rename = "nodes")]
    Nodes(Vec<[f64; 3]>),
    /// All nodes between two corners [m].
    #[serde(rename = "box")]
    Box([[f64; 3]; 2]),
    /// The nodes of `[design]`, moved by a design.
    #[serde(rename = "design")]
    Design(DesignMotion),
}

/// A design of `[design]`.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum DesignMotion {
    /// One made from the bounds.
    Word(DesignWord),
    /// The variables [m], one length for each.
    Values(#[schemars(transform = length(Range::FINITE))] Vec<f64>),
}

choice! {
    /// Designs made from the bounds.
    pub enum DesignWord {
        /// All variables at the lower bound.
        Lower = "lower",
        /// All variables at the upper bound.
        Upper = "upper",
        /// At the lower and the upper bound in turn, as on a chessboard over the control grid.
        Alternating = "alternating",
    }
}

/// A rotation by a finite angle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Rotation {
    /// Direction of the axis; the length of a vector does not matter.
    #[schemars(extend("default" = AxisWord::Z))]
    pub axis: Axis,
    /// A point on the axis [m].
    #[schemars(transform = length(Range::FINITE), extend("default" = [0, 0, 0]))]
    pub center: [f64; 3],
    /// Right-handed angle [rad]; more than a turn is more than a turn.
    #[schemars(transform = quantity(Dimension::Angle, Range::FINITE))]
    pub angle: f64,
}

/// A scaling about a point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Scale {
    /// The point that stays [m].
    #[schemars(transform = length(Range::FINITE), extend("default" = [0, 0, 0]))]
    pub center: [f64; 3],
    /// Ratio of lengths after to before.
    #[schemars(transform = number(Range::POSITIVE))]
    pub factor: f64,
}

/// The keys that say which nodes.
const TARGETS: [&str; 5] = ["surface", "line", "nodes", "box", "design"];
/// The keys that say how.
const TRANSFORMS: [&str; 3] = ["displacement", "rotation", "scale"];

impl PrescribedMotion {
    pub(super) fn read(section: Section<'_>) -> Self {
        let target = read_target(&section);
        let motion = Self {
            target,
            displacement: section.lengths("displacement", Range::FINITE),
            rotation: section.table("rotation").map(Rotation::read),
            scale: section.table("scale").map(Scale::read),
        };
        let given = TRANSFORMS.into_iter().find(|key| section.has(key));
        match (&motion.target, given) {
            (Target::Design(_), Some(key)) => section.wrong(
                key,
                format!("`{}` moves the design nodes by a design, and has `{key}`", section.path()),
                "a design alone, or a surface with a displacement, rotation or scale",
            ),
            (Target::Design(_), None) | (_, Some(_)) => {}
            (_, None) => section.missing("displacement", "displacement = [\"0 mm\", \"0 mm\", \"5 mm\"]"),
        }
        section.finish();
        motion
    }
}

fn read_target(section: &Section<'_>) -> Target {
    let surface = section.name_or_names("surface");
    let line = section.two_points("line");
    let nodes = section.points("nodes");
    let corners = section.flat_corners("box");
    let design = read_design(section);
    let given: Vec<&str> = TARGETS.into_iter().filter(|key| section.has(key)).collect();
    match given.as_slice() {
        [] => section.missing("surface", "surface = \"top\", or line, nodes, box or design"),
        [_] => {}
        [first, second, ..] => section.clash(
            [first, second],
            format!("`{}` has both `{first}` and `{second}`", section.path()),
            "one of surface, line, nodes, box and design",
        ),
    }
    if let Some(design) = design {
        return Target::Design(design);
    }
    if let Some(line) = line {
        return Target::Line(line);
    }
    if let Some(nodes) = nodes {
        return Target::Nodes(nodes);
    }
    if let Some(corners) = corners {
        return Target::Box(corners);
    }
    Target::Surface(surface.unwrap_or_default())
}

fn read_design(section: &Section<'_>) -> Option<DesignMotion> {
    if section.is_list("design") {
        return section.length_list("design", Range::FINITE).map(DesignMotion::Values);
    }
    let word = section.choice("design").map(DesignMotion::Word);
    // A faulty word is a design all the same: nothing else is asked for.
    word.or_else(|| section.has("design").then(|| DesignMotion::Values(Vec::new())))
}

impl Rotation {
    fn read(section: Section<'_>) -> Self {
        let angle = section.quantity("angle", Dimension::Angle, Range::FINITE);
        let rotation = Self {
            axis: read_axis(&section),
            center: section.lengths("center", Range::FINITE).unwrap_or([0.0; 3]),
            angle: section.need("angle", angle, "\"45 deg\""),
        };
        section.finish();
        rotation
    }
}

impl Scale {
    fn read(section: Section<'_>) -> Self {
        let factor = section.number("factor", Range::POSITIVE);
        let scale = Self {
            center: section.lengths("center", Range::FINITE).unwrap_or([0.0; 3]),
            factor: section.need("factor", factor, "2.5"),
        };
        section.finish();
        scale
    }
}
