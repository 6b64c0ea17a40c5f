//! Why the mesh does not follow a design, and what would help, from where and how an element is squeezed.

use fluxmorph_geometry::tet4::{Point, centroid, dot, sub};
use fluxmorph_geometry::{ElementId, Mesh, NodeId};

use super::shape::Shape;

/// Cosine of an angle between directions of the design from which its surface has an edge: facets of a curved surface have less than
/// these 25 degrees between them.
const EDGE: f64 = 0.9;

/// Whether two of the directions, of unit length or zero for nodes that cannot move, are those of faces that meet in an edge, and not of
/// the two sides of a plate.
fn bends(directions: &[Point]) -> bool {
    let moving: Vec<&Point> = directions.iter().filter(|direction| **direction != [0.0; 3]).collect();
    moving.iter().any(|one| moving.iter().any(|other| dot(**one, **other).abs() < EDGE))
}

/// Why a design is not carried.
#[derive(Clone, Debug)]
pub struct Cut {
    /// Which element would be squeezed, and why.
    pub cause: String,
    /// What would help.
    pub cure: &'static str,
}

impl std::fmt::Display for Cut {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}; {}", self.cause, self.cure)
    }
}

impl Cut {
    /// What a design asks too much of: `element` of the undeformed mesh is squeezed most.
    ///
    /// # Panics
    /// If `p` has another length than there are variables.
    pub fn of(shape: &Shape, mesh: &Mesh, p: &[f64], element: ElementId) -> Self {
        let (surface, map) = (shape.surface(), shape.motion().map());
        let displacements = surface.normal_displacements(p);
        let nodes = mesh.topology().tet(element);
        let row = |node: &NodeId| surface.nodes().binary_search(node).ok();
        let rows: Vec<usize> = nodes.iter().filter_map(row).collect();
        let is_held = |node: &&NodeId| row(node).is_none() && !map.is_unknown(**node);
        // Beside the surface rather than in front of it: on the level of a design node, as far as the element goes.
        let levels = |row: usize| {
            let (at, direction) = (mesh.point(surface.nodes()[row]), surface.directions()[row]);
            move |node: &NodeId| dot(sub(mesh.point(*node), at), direction).abs()
        };
        let is_beside = |held: &NodeId, row: usize| {
            let level = levels(row);
            level(held) < 0.25 * nodes.iter().map(&level).fold(0.0, f64::max)
        };
        let is_at_held_rim =
            nodes.iter().filter(is_held).any(|held| rows.iter().any(|&row| is_beside(held, row)));
        let moved = || rows.iter().map(|&row| displacements[row]);
        let (least, most) =
            moved().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), x| (l.min(x), m.max(x)));
        let (why, cure) = if is_at_held_rim {
            (
                "nodes beside the design surface are held there".to_owned(),
                "let their faces slide or be free, or keep the rim of the design where it is",
            )
        } else if rows.len() > 1 && most - least > 0.5 * most.abs().max(least.abs()) {
            let step = 1e3 * (most - least);
            (
                format!("neighbouring nodes of the design lie {step:.1} mm apart"),
                "a filter or a control grid makes the design smoother",
            )
        } else if bends(&rows.iter().map(|&row| surface.directions()[row]).collect::<Vec<_>>()) {
            (
                "the design surface has an edge there, whose faces move towards each other".to_owned(),
                "a coarser filter or control grid, one of the faces alone as the design, or narrower bounds leave the element \
                 room",
            )
        } else {
            (
                "there is no room between the design surface and where the mesh is held".to_owned(),
                "narrower bounds give it, a larger remesh region where it ends inside the mesh, or a surface that is \
                 let go within it: the interfaces of regions and the outside, symmetry planes as well, are held where nothing else \
                 is said",
            )
        };
        let [x, y, z] = centroid(mesh.vertices(element)).map(|c| 1e3 * c);
        let region = mesh.topology().region_name_at(element);
        let cause = format!(
            "element {element} of region `{region}` at ({x:.1}, {y:.1}, {z:.1}) mm would be squeezed, as {why}"
        );
        Self { cause, cure }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_is_where_faces_meet() {
        let (up, aside) = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        assert!(bends(&[up, aside]) && bends(&[up, [0.8, 0.0, 0.6], [0.0; 3]]));
        assert!(!bends(&[up, [0.0; 3], up]), "a node that cannot move");
        assert!(!bends(&[up, [0.0, 0.0, -1.0]]), "both sides of a plate");
        assert!(!bends(&[up, [0.0, 0.28, 0.96]]), "facets of a curve");
    }
}
