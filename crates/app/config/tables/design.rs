//! `[design]`: which surface moves, which way, and how far.

use super::axis::AxisWord;
use super::initial::InitialDesign;
use crate::config::section::Section;
use crate::config::table::{one_of, table};
use crate::config::value::Placeholder;
use crate::config::value::choice::choice;
use crate::config::value::range::Range;

/// Components of a vector whose length does not matter: their squares stay numbers.
pub(super) const COMPONENTS: Range = Range::closed(-1e100, 1e100);

table! {
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
    /// that is not meshed. A node on a surface of `[boundaries]` or of `remesh.slide`, or on another plane side of the mesh, moves
    /// within that plane; where two such planes meet, along their edge.
    ///
    /// Where faces of the surface meet at more than 42 degrees, their edge moves so that each of them is displaced by the same
    /// length along its own normal: by √2 of the displacement at an edge of 90 degrees, √3 in the corner of a cube, and never
    /// by more than twice the displacement, so that the tips of walls of less than 60 degrees stay behind. A surface that
    /// meets its mirror image in a symmetry plane at such an angle moves there as at any other edge.
    ///
    /// Symmetry planes, for `rim` and `filter_radius`, are the outer faces named in `[boundaries]` or `remesh.slide`: the model
    /// ends there, the device does not. The filter sees the mirror images of the nodes across them, so that a quarter model
    /// gives the surface of the whole. So does a wedge, whose planes meet at an angle that divides 180 degrees.
    ///
    /// ```toml
    /// [design]
    /// surface = "plate_bottom"
    /// direction = [0, 0, -1]
    /// grid = [7, 13]
    /// lower = "-5 mm"
    /// upper = "20 mm"
    /// ```
    pub struct Design {
        /// The nodes of these surfaces move.
        surface: Vec<String> = NAME_OR_NAMES, need "\"plate_bottom\"";
        /// Direction of a positive displacement: a vector, whose length does not matter, or `"normal"`.
        direction: DesignDirection = ONE_OF, need "[0.0, 0.0, -1.0], or direction = \"normal\"";
        /// Points of the control grid along the two coordinates of the surface, bilinear in between: x and y where it moves along
        /// z, x and z along y, y and z along x. The first is slow in the order of the variables. With `direction = "normal"` the
        /// grid lies across the axis that the normals follow most, and the surface must not turn back over it. Default: every node
        /// of the surface is a variable.
        grid: Option<[usize; 2]> = integer(2, 300);
        /// The displacement of a node is the mean of the variables at the nodes around it, with the weight (1 − distance /
        /// radius) × area: shapes stay smooth, and the same on a finer mesh. Two to four sizes of a cell are a good start. 0: a
        /// node follows its own variable. Not with `grid`, which is smooth already. Default: 1.5 sizes of a cell of the surface,
        /// a length that the log and `check` name.
        filter_radius: Option<f64> = length(NOT_NEGATIVE);
        /// What the nodes on the edge of the surface do.
        rim: RimMotion = WORD => RimMotion::Free;
        /// Least displacement [m]; below `upper`.
        lower: f64 = length(FINITE), need "\"-5 mm\"";
        /// Greatest displacement [m].
        upper: f64 = length(FINITE), need "\"20 mm\"";
        /// Where the optimisation starts, between `lower` and `upper`: all variables alike, each with its own value in the order
        /// of `design.points_m` of the result, or each anywhere between its bounds. The default is the mesh as it is.
        initial: InitialDesign = ONE_OF => InitialDesign::Uniform(0.0);
        /// Planes over which mirrored variables are constrained to be equal.
        symmetry: Vec<SymmetryPlane> = TABLES => Vec::new();
    }
    check = Design::check;
    rules = |rules| rules.not_both(["grid", "filter_radius"]);
}

one_of! {
    /// Direction of a positive displacement.
    #[derive(Copy)]
    pub enum DesignDirection {
        /// The same for every node, of length 1.
        #[also(not_all_zero)]
        Vector([f64; 3]) = number(COMPONENTS);
        /// One for each node.
        Word(DirectionWord) = WORD, if text;
    }
}

impl Placeholder for DesignDirection {
    fn placeholder() -> Self {
        Self::Vector(Placeholder::placeholder())
    }
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

table! {
    /// Variables that are mirror images of each other across a plane become one: for a mesh of the whole device whose shape is
    /// to stay symmetric. Every node (of a control grid: every point) needs a partner within 1e-6 of the surface's size. A
    /// `design.direction` of three numbers must lie in the plane; normals become mirror images of each other. Where the triangles
    /// of the surface are no mirror images, as in cells that are all cut along one diagonal, the shape is symmetric up to its
    /// facets, which is warned of.
    ///
    /// ```toml
    /// [[design.symmetry]]
    /// axis = "x"
    /// at = "40 mm"
    /// ```
    #[derive(Copy)]
    pub struct SymmetryPlane {
        /// Normal of the plane; each axis once.
        axis: AxisWord = WORD, need "\"y\"";
        /// Place of the plane on that axis [m].
        at: f64 = length(FINITE) => 0.0;
    }
}

impl Design {
    fn check(&mut self, section: &Section<'_>) {
        if section.has("grid") && section.has("filter_radius") {
            section.clash(
                ["grid", "filter_radius"],
                "design.grid and design.filter_radius are both given: a grid is smooth already",
                "one of them",
            );
        }
        if let DesignDirection::Vector(vector) = self.direction {
            self.direction =
                unit_vector(section, vector).map_or_else(Placeholder::placeholder, DesignDirection::Vector);
        }
        self.initial.check(section, self.lower, self.upper);
        self.check_symmetry(section);
    }

    fn check_symmetry(&self, section: &Section<'_>) {
        for (index, plane) in self.symmetry.iter().enumerate() {
            let Some(table) =
                section.inner(&format!("symmetry[{index}]")).filter(|table| !table.is_faulty(table.path()))
            else {
                continue;
            };
            let name = plane.axis.name();
            if self.symmetry[..index].iter().any(|earlier| earlier.axis == plane.axis) {
                table.wrong("axis", format!("there are two symmetry planes along {name}"), "each axis once");
            }
            // More than rounding across the plane.
            if let DesignDirection::Vector(direction) = self.direction
                && direction[plane.axis.index()].abs() > 1e-9
            {
                table.wrong(
                    "axis",
                    format!("design.direction = {direction:?} leaves the symmetry plane along {name}"),
                    format!("direction = \"normal\", or a design.direction without {name} component"),
                );
            }
        }
    }
}

/// The vector `direction` of a table, scaled to length one.
pub(super) fn unit_vector(section: &Section<'_>, vector: [f64; 3]) -> Option<[f64; 3]> {
    if vector.iter().any(|component| component.is_nan()) {
        return None;
    }
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
