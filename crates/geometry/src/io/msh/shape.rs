//! The element types of the format: their codes, names, dimensions and numbers of nodes.
//!
//! Source: Gmsh reference manual, "MSH file format", table of element types.

/// What is done with elements of a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Use {
    /// Becomes an element of the mesh; its first four nodes are its vertices.
    Tetrahedron,
    /// Becomes a triangle of a surface; its first three nodes are its vertices.
    Triangle,
    /// Is skipped.
    Nothing,
}

/// One element type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Shape {
    pub(super) code: i32,
    pub(super) name: &'static str,
    pub(super) dimension: i32,
    /// Number of nodes.
    pub(super) nodes: usize,
}

/// Code, name, dimension, nodes.
const SHAPES: [(i32, &str, i32, usize); 36] = [
    (1, "line", 1, 2),
    (2, "triangle", 2, 3),
    (3, "quadrangle", 2, 4),
    (4, "tetrahedron", 3, 4),
    (5, "hexahedron", 3, 8),
    (6, "prism", 3, 6),
    (7, "pyramid", 3, 5),
    (8, "second-order line", 1, 3),
    (9, "second-order triangle", 2, 6),
    (10, "second-order quadrangle", 2, 9),
    (11, "second-order tetrahedron", 3, 10),
    (12, "second-order hexahedron", 3, 27),
    (13, "second-order prism", 3, 18),
    (14, "second-order pyramid", 3, 14),
    (15, "point", 0, 1),
    (16, "second-order quadrangle", 2, 8),
    (17, "second-order hexahedron", 3, 20),
    (18, "second-order prism", 3, 15),
    (19, "second-order pyramid", 3, 13),
    (20, "third-order triangle", 2, 9),
    (21, "third-order triangle", 2, 10),
    (22, "fourth-order triangle", 2, 12),
    (23, "fourth-order triangle", 2, 15),
    (24, "fifth-order triangle", 2, 15),
    (25, "fifth-order triangle", 2, 21),
    (26, "third-order line", 1, 4),
    (27, "fourth-order line", 1, 5),
    (28, "fifth-order line", 1, 6),
    (29, "third-order tetrahedron", 3, 20),
    (30, "fourth-order tetrahedron", 3, 35),
    (31, "fifth-order tetrahedron", 3, 56),
    (36, "third-order quadrangle", 2, 16),
    (37, "fourth-order quadrangle", 2, 25),
    (38, "fifth-order quadrangle", 2, 36),
    (92, "third-order hexahedron", 3, 64),
    (93, "fourth-order hexahedron", 3, 125),
];

impl Shape {
    /// The type of a code.
    pub(super) fn of(code: i32) -> Option<Self> {
        let &(code, name, dimension, nodes) = SHAPES.iter().find(|shape| shape.0 == code)?;
        Some(Self { code, name, dimension, nodes })
    }

    /// What becomes of it.
    pub(super) fn becomes(self) -> Use {
        match self.code {
            4 | 11 => Use::Tetrahedron,
            2 | 9 => Use::Triangle,
            _ => Use::Nothing,
        }
    }

    /// Whether midside nodes are dropped.
    pub(super) fn is_second_order(self) -> bool {
        matches!(self.code, 9 | 11)
    }
}
