//! `[design]`: which surface moves, which way, and how far.

use serde::Serialize;

use super::Dimension;
use super::choice::choice;
use super::coil::AxisWord;
use super::initial::InitialDesign;
use super::range::Range;
use super::section::Section;

/// The design variables: displacements of a surface, every node along its direction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Design {
    /// Names of the surfaces whose nodes move.
    pub surface: Vec<String>,
    /// Direction of a positive displacement.
    pub direction: DesignDirection,
    /// Points of the control grid along the two coordinates of the surface, bilinear in between. Default
    /// `None`: every node of the surface is a variable.
    pub grid: Option<[usize; 2]>,
    /// Radius over which the variables at the nodes are averaged [m]. Default `None`: a node follows its own variable.
    pub filter_radius: Option<f64>,
    /// What the nodes on the free rim do. Default `free`: the shape is not held where nothing holds it.
    pub rim: RimMotion,
    /// Least displacement [m].
    pub lower: f64,
    /// Greatest displacement [m].
    pub upper: f64,
    /// Where the optimisation starts.
    pub initial: InitialDesign,
    /// Planes over which mirrored variables are tied. Default none.
    pub symmetry: Vec<SymmetryPlane>,
}

/// Direction of a positive displacement.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum DesignDirection {
    /// The same for every node, of length 1.
    Vector([f64; 3]),
    /// One for each node.
    Word(DirectionWord),
}

choice! {
    /// Words for `direction`.
    pub enum DirectionWord {
        /// The normal of the surface at the node, out of the body.
        Normal = "normal",
    }
}

choice! {
    /// What the nodes on the free rim of the design surface do.
    pub enum RimMotion {
        /// They move like all others.
        Free = "free",
        /// They stay.
        Fixed = "fixed",
    }
}

/// A symmetry plane of the design.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SymmetryPlane {
    /// Its normal.
    pub axis: AxisWord,
    /// Its place on that axis [m]. Default 0.
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
            section.wrong(
                "filter_radius",
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
    let vector = section.numbers::<3>("direction", Range::closed(-1e100, 1e100))?;
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
