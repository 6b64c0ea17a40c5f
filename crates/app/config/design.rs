//! `[design]`: which surface moves, which way, and how far.

use schemars::{JsonSchema, Schema};
use serde::Serialize;

use super::Dimension;
use super::choice::choice;
use super::coil::AxisWord;
use super::initial::InitialDesign;
use super::range::Range;
use super::section::Section;
use crate::schema::form::{integer, length, name_or_names, not_all_zero, number};
use crate::schema::rules::Rules;

/// Components of a vector whose length does not matter: their squares stay numbers.
pub(super) const COMPONENTS: Range = Range::closed(-1e100, 1e100);

/// Which surface moves, which way, and how far; needed by `run` and `gradient`, with `[remesh]`. `morph` can move the mesh
/// by it.
///
/// Every node of the surface is a variable, in ascending order of the nodes, but for nodes that cannot move (on a fixed
/// rim, in the corner of three planes); `design.points_m` of the result says where each variable sits. With `grid` the
/// points of the control grid are the variables.
///
/// `direction = "normal"` moves every node along the area-weighted normal of the undeformed surface, out of the body, so
/// that a positive displacement makes the body thicker. The body is the side with a `[regions]` table; where both sides
/// have one, or neither, it is the first region of a surface named `first|second`. Behind an outer face of air lies a body
/// that is not meshed. A node on a surface of `[boundaries]` or of `remesh.slide` moves within that surface's plane; where
/// two such planes meet, along their edge.
///
/// Symmetry planes, for `rim` and `filter_radius`, are the outer faces named in `[boundaries]` or `remesh.slide`: the model
/// ends there, the device does not. The filter sees the mirror images of the nodes across them, so that a quarter model
/// gives the surface of the whole.
///
/// ```toml
/// [design]
/// surface = "plate_bottom"
/// direction = [0, 0, -1]
/// grid = [7, 13]
/// lower = "-5 mm"
/// upper = "20 mm"
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(transform = smooth_in_one_way)]
pub struct Design {
    /// The nodes of these surfaces move.
    #[schemars(transform = name_or_names)]
    pub surface: Vec<String>,
    /// Direction of a positive displacement: a vector, whose length does not matter, or `"normal"`.
    pub direction: DesignDirection,
    /// Points of the control grid along the two coordinates of the surface, bilinear in between; the first is slow in the
    /// order of the variables. With `direction = "normal"` the grid lies across the axis that the normals follow most, and
    /// the surface must not turn back over it. Default: every node of the surface is a variable.
    #[schemars(transform = integer(2, 300))]
    pub grid: Option<[usize; 2]>,
    /// The displacement of a node is the mean of the variables at the nodes around it, with the weight (1 − distance /
    /// radius) × area: shapes stay smooth, and the same on a finer mesh. Two to four sizes of a cell are a good start. Not
    /// with `grid`, which is smooth already. Default: a node follows its own variable.
    #[schemars(transform = length(Range::POSITIVE))]
    pub filter_radius: Option<f64>,
    /// What the nodes on the edge of the surface do.
    #[schemars(extend("default" = RimMotion::Free))]
    pub rim: RimMotion,
    /// Least displacement [m]; below `upper`.
    #[schemars(transform = length(Range::FINITE))]
    pub lower: f64,
    /// Greatest displacement [m].
    #[schemars(transform = length(Range::FINITE))]
    pub upper: f64,
    /// Where the optimisation starts, between `lower` and `upper`: all variables alike, each with its own value in the order
    /// of `design.points_m` of the result, or each anywhere between its bounds. The default is the mesh as it is.
    #[schemars(extend("default" = 0))]
    pub initial: InitialDesign,
    /// Planes over which mirrored variables are tied.
    #[schemars(default)]
    pub symmetry: Vec<SymmetryPlane>,
}

fn smooth_in_one_way(schema: &mut Schema) {
    Rules::of(schema).not_both(["grid", "filter_radius"]);
}

/// Direction of a positive displacement.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum DesignDirection {
    /// The same for every node, of length 1.
    Vector(#[schemars(transform = number(COMPONENTS), transform = not_all_zero)] [f64; 3]),
    /// One for each node.
    Word(DirectionWord),
}

choice! {
    /// Words for `direction`.
    pub enum DirectionWord {
        /// Every node along the normal of the surface there, out of the body.
        Normal = "normal",
    }
}

choice! {
    /// What the nodes on the free rim of the design surface do.
    pub enum RimMotion {
        /// They move like all others: the shape is not held where nothing holds it.
        Free = "free",
        /// They stay, but for those on a symmetry plane.
        Fixed = "fixed",
    }
}

/// Variables that are mirror images of each other across a plane become one: for a mesh of the whole device whose shape is
/// to stay symmetric. Every node (of a control grid: every point) needs a partner within 1e-6 of the surface's size. A
/// `design.direction` of three numbers must lie in the plane; normals become mirror images of each other.
///
/// ```toml
/// [[design.symmetry]]
/// axis = "x"
/// at = "40 mm"
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct SymmetryPlane {
    /// Normal of the plane; each axis once.
    pub axis: AxisWord,
    /// Place of the plane on that axis [m].
    #[schemars(transform = length(Range::FINITE), extend("default" = 0))]
    pub at: f64,
}

impl Design {
    pub(super) fn read(section: Section<'_>) -> Self {
        let surface = section.name_or_names("surface");
        let direction = read_direction(&section);
        let grid = section.integers("grid", 2, 300);
        let length = |key, range| section.quantity(key, Dimension::Length, range);
        let filter_radius = length("filter_radius", Range::POSITIVE);
        if section.has("grid") && section.has("filter_radius") {
            section.clash(
                ["grid", "filter_radius"],
                "design.grid and design.filter_radius are both given: a grid is smooth already",
                "one of them",
            );
        }
        let rim = section.choice("rim").unwrap_or(RimMotion::Free);
        let (lower, upper) = (length("lower", Range::FINITE), length("upper", Range::FINITE));
        let initial = InitialDesign::read(&section, lower, upper);
        let symmetry = read_symmetry(&section, direction);
        if direction.is_none() && !section.has("direction") {
            section.missing("direction", "direction = [0.0, 0.0, -1.0], or direction = \"normal\"");
        }
        let design = Self {
            surface: section.need("surface", surface, "\"plate_bottom\""),
            direction: direction.unwrap_or(DesignDirection::Vector([f64::NAN; 3])),
            grid,
            filter_radius,
            rim,
            lower: section.need("lower", lower, "\"-5 mm\""),
            upper: section.need("upper", upper, "\"20 mm\""),
            initial,
            symmetry,
        };
        section.finish();
        design
    }
}

fn read_symmetry(section: &Section<'_>, direction: Option<DesignDirection>) -> Vec<SymmetryPlane> {
    let mut planes: Vec<SymmetryPlane> = Vec::new();
    for table in section.tables("symmetry") {
        let axis = table.choice::<AxisWord>("axis");
        if axis.is_none() && !table.has("axis") {
            table.missing("axis", "axis = \"y\"");
        }
        let at = table.quantity("at", Dimension::Length, Range::FINITE).unwrap_or(0.0);
        if let Some(axis) = axis {
            let name = axis.name();
            if planes.iter().any(|plane| plane.axis == axis) {
                table.wrong("axis", format!("there are two symmetry planes along {name}"), "each axis once");
            }
            if let Some(DesignDirection::Vector(direction)) = direction.filter(|d| leaves(d, axis.index())) {
                table.wrong(
                    "axis",
                    format!("design.direction = {direction:?} leaves the symmetry plane along {name}"),
                    format!("direction = \"normal\", or a design.direction without {name} component"),
                );
            }
            planes.push(SymmetryPlane { axis, at });
        }
        table.finish();
    }
    planes
}

/// Whether a direction has more than rounding across a plane normal to an axis.
fn leaves(direction: &DesignDirection, axis: usize) -> bool {
    matches!(direction, DesignDirection::Vector(direction) if direction[axis].abs() > 1e-9)
}

fn read_direction(section: &Section<'_>) -> Option<DesignDirection> {
    if section.is_text("direction") {
        return section.choice("direction").map(DesignDirection::Word);
    }
    read_vector(section).map(DesignDirection::Vector)
}

/// The vector `direction` of a table, scaled to length one.
pub(super) fn read_vector(section: &Section<'_>) -> Option<[f64; 3]> {
    let vector = section.numbers::<3>("direction", COMPONENTS)?;
    let largest = vector.iter().fold(0.0_f64, |largest, component| largest.max(component.abs()));
    if largest < 1e-100 {
        section.wrong(
            "direction",
            format!("{}.direction has no length", section.path()),
            "a vector that is not zero, such as [0.0, 0.0, -1.0]",
        );
        return None;
    }
    let scaled = vector.map(|component| component / largest);
    let length = largest * scaled.iter().map(|component| component * component).sum::<f64>().sqrt();
    // A vector of length 1 keeps its bits, so that a resolved configuration reads back as itself.
    if (length - 1.0).abs() < 4.0 * f64::EPSILON {
        return Some(vector);
    }
    Some(vector.map(|component| component / length))
}
