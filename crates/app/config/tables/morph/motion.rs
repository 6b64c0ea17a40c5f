//! `[[morph.motion]]`: which nodes move, and along which path.

use serde::Serialize;
use serde_json::json;

use crate::config::section::Section;
use crate::config::table::rules::{Then, present};
use crate::config::table::{Group, one_of, table};
use crate::config::tables::axis::{Axis, check_axis};
use crate::config::tables::order::{Corners, flat_box};
use crate::config::value::choice::choice;

table! {
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
    pub struct PrescribedMotion {
        /// Which nodes.
        #[serde(flatten)]
        target: Target = KEYS;
        /// Translation [m].
        displacement: Option<[f64; 3]> = length(FINITE);
        /// Finite rotation, after the scaling.
        rotation: Option<Rotation> = TABLE;
        /// Scaling, before all else.
        scale: Option<Scale> = TABLE;
    }
    check = PrescribedMotion::check;
}

table! {
    /// Which nodes move, as it is written.
    pub(in crate::config) struct TargetKeys {
        /// All nodes of these surfaces, interfaces `"a|b"` included.
        surface: Option<Vec<String>> = NAME_OR_NAMES;
        /// All nodes on the segment between two points [m].
        line: Option<Corners> = length(FINITE);
        /// The nodes at these points [m].
        nodes: Option<Vec<[f64; 3]>> = not_empty(length(FINITE));
        /// All nodes between two corners [m], the lower one first; the box may be flat.
        corners["box"]: Option<Corners> = length(FINITE);
        /// The nodes of `[design]`, moved by a design.
        design: Option<DesignMotion> = ONE_OF;
    }
    rules = |rules| rules
        .exactly_one(&TARGETS)
        .with("design", Then { required: &[], refused: &TRANSFORMS })
        .add(json!({ "if": { "required": ["design"] }, "else": { "anyOf": present(&TRANSFORMS) } }));
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

one_of! {
    /// A design of `[design]`.
    pub enum DesignMotion {
        /// One made from the bounds.
        Word(DesignWord) = WORD;
        /// The variables [m], one length for each.
        Values(Vec<f64>) = length(FINITE), if list;
    }
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

table! {
    /// A rotation by a finite angle.
    #[derive(Copy)]
    pub struct Rotation {
        /// Direction of the axis; the length of a vector does not matter.
        axis: Axis = ONE_OF => Axis::default();
        /// A point on the axis [m].
        center: [f64; 3] = length(FINITE) => [0.0; 3];
        /// Right-handed angle [rad], at most half a turn: the mesh is that of the end of a motion, which the shorter way round has
        /// alike.
        angle: f64 = quantity(Angle, FINITE), need "\"45 deg\"";
    }
    check = |rotation, section| check_axis(rotation.axis, section);
}

table! {
    /// A scaling about a point.
    #[derive(Copy)]
    pub struct Scale {
        /// The point that stays [m].
        center: [f64; 3] = length(FINITE) => [0.0; 3];
        /// Ratio of lengths after to before.
        factor: f64 = number(POSITIVE), need "2.5";
    }
}

/// The keys that say which nodes.
const TARGETS: [&str; 5] = ["surface", "line", "nodes", "box", "design"];
/// The keys that say how.
const TRANSFORMS: [&str; 3] = ["displacement", "rotation", "scale"];

impl PrescribedMotion {
    fn check(&mut self, section: &Section<'_>) {
        let given = TRANSFORMS.into_iter().find(|key| section.has(key));
        match (section.has("design"), given) {
            (true, Some(key)) => section.wrong(
                key,
                format!("`{}` moves the design nodes by a design, and has `{key}`", section.path()),
                "a design alone, or a surface with a displacement, rotation or scale",
            ),
            (true, None) | (false, Some(_)) => {}
            (false, None) => {
                section.missing(&TRANSFORMS, "displacement = [\"0 mm\", \"0 mm\", \"5 mm\"]");
            }
        }
    }
}

impl Group for Target {
    type Written = TargetKeys;

    fn of(written: TargetKeys, section: &Section<'_>) -> Self {
        let example = "surface = \"top\", or line, nodes, box or design";
        section.exactly_one(&TARGETS, example, "one of surface, line, nodes, box and design");
        let corners = written.corners.and_then(|corners| flat_box(section, "box", corners));
        let TargetKeys { surface, line, nodes, design, .. } = written;
        let target = design.map(Self::Design).or(line.map(Self::Line)).or(nodes.map(Self::Nodes));
        target.or(corners.map(Self::Box)).unwrap_or_else(|| Self::Surface(surface.unwrap_or_default()))
    }
}
