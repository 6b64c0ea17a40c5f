//! Wall thickness of the designed body behind every design node, measured along the node's direction of motion.
//!
//! From each node of the design surface a ray runs against its direction to the body's opposite face. That face is held
//! (docs/theory.md), so the thickness of a design is the initial one plus the node's height: exactly where one direction
//! moves all nodes, and along normals in the same sense, each along its own. A node without direction has no thickness.

use fluxmorph_geometry::box_tree::{AxisBox, BoxTree};
use fluxmorph_geometry::tet4::{Point, area_vector, cross, dot, norm, sub};
use fluxmorph_geometry::{Mesh, NodeId, RegionId};

use crate::design::DesignSurface;

/// Nodes at the rim of the body send their ray along its side: how far outside a triangle still hits.
const RIM_TOLERANCE: f64 = 1e-6;

/// Sine of the angle (six degrees) between ray and triangle below which the triangle belongs to the body's side: facets of a
/// round side lean by less, and an opposite face as steep as that makes no body whose thickness means anything.
const GRAZING: f64 = 0.1;

/// Initial thickness [m] behind every design node.
#[derive(Clone, Debug)]
pub struct WallThickness {
    /// `None` where the node has no direction.
    initial: Vec<Option<f64>>,
}

impl WallThickness {
    /// Measures the body `region` of the undeformed mesh; `None` where some ray does not meet an opposite face.
    pub fn measure(mesh: &Mesh, region: RegionId, surface: &DesignSurface) -> Option<Self> {
        let topology = mesh.topology();
        let region_at = |e: fluxmorph_geometry::ElementId| topology.region_of()[e.index()];
        let triangles: Vec<[Point; 3]> = topology
            .facets()
            .iter()
            .filter(|f| (region_at(f.inside) == region) != f.outside.is_some_and(|e| region_at(e) == region))
            .filter(|f| !f.nodes.iter().all(|n| surface.nodes().binary_search(n).is_ok()))
            .map(|f| f.nodes.map(|n| mesh.point(n)))
            .collect();
        let faces = BoxTree::new(triangles.iter().map(reach).collect());
        let initial = surface
            .nodes()
            .iter()
            .zip(surface.directions())
            .map(|(&node, direction): (&NodeId, &Point)| {
                if *direction == [0.0; 3] {
                    return Some(None);
                }
                let (origin, back) = (mesh.point(node), direction.map(|d| -d));
                let hits: Vec<usize> = faces.hits(origin, back).into_iter().collect();
                // From a rim the ray runs along the facets of the body's side, and a round side is no plane.
                let across = |i: &usize| !runs_along(back, &triangles[*i]);
                let nearest = |of: &mut dyn Iterator<Item = usize>| {
                    of.filter_map(|i| distance(origin, back, &triangles[i])).min_by(f64::total_cmp)
                };
                let opposite = nearest(&mut hits.iter().copied().filter(across));
                opposite.or_else(|| nearest(&mut hits.iter().copied())).map(Some)
            })
            .collect::<Option<Vec<_>>>()?;
        initial.iter().any(Option::is_some).then_some(())?;
        Some(Self { initial })
    }

    /// Initial thickness [m] at every design node that has one, with the node's place in the design surface.
    pub fn at_nodes(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.initial.iter().enumerate().filter_map(|(i, t)| Some((i, (*t)?)))
    }

    /// Least and greatest thickness [m] for the normal_displacements of the design nodes [m].
    pub fn range(&self, normal_displacements: &[f64]) -> (f64, f64) {
        self.at_nodes()
            .map(|(i, t)| t + normal_displacements[i])
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| (low.min(t), high.max(t)))
    }
}

/// Whether a ray runs along a triangle rather than through it.
fn runs_along(direction: Point, triangle: &[Point; 3]) -> bool {
    let normal = area_vector(*triangle);
    dot(normal, direction).abs() < GRAZING * norm(normal)
}

/// A box that holds every place where a ray counts as hitting a triangle.
fn reach(triangle: &[Point; 3]) -> AxisBox {
    let tight = AxisBox::around(triangle);
    tight.grown(10.0 * RIM_TOLERANCE * tight.extent())
}

/// Distance along the ray at which it meets a triangle that it does not touch at its origin.
fn distance(origin: Point, direction: Point, triangle: &[Point; 3]) -> Option<f64> {
    let normal = area_vector(*triangle);
    let slope = dot(normal, direction);
    let area = norm(normal);
    if slope.abs() < RIM_TOLERANCE * area {
        return None;
    }
    let t = dot(normal, sub(triangle[0], origin)) / slope;
    let hit: Point = std::array::from_fn(|d| origin[d] + t * direction[d]);
    // Barycentric coordinates by sub-areas.
    let inside = (0..3).all(|k| {
        let edge = sub(triangle[(k + 2) % 3], triangle[(k + 1) % 3]);
        let share = 0.5 * dot(cross(edge, sub(hit, triangle[(k + 1) % 3])), normal) / (area * area);
        share >= -RIM_TOLERANCE
    });
    (inside && t > RIM_TOLERANCE * area.sqrt()).then_some(t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::{DesignSetup, Direction};
    use fluxmorph_geometry::generate::{ShieldParameters, shield};

    #[test]
    fn the_plate_is_ten_millimetres_thick_at_every_node() {
        let parameters = ShieldParameters { refinement: 0.5, ..ShieldParameters::default() };
        let mesh = shield(&parameters).expect("defaults are valid");
        let triangles = mesh.topology().surface("plate_bottom").expect("the shield has it");
        let surface =
            DesignSurface::new(&mesh, &DesignSetup::new(triangles, Direction::Along([0.0, 0.0, -1.0])))
                .expect("every node is a variable");
        let plate = mesh.topology().region("plate").expect("the shield has it");
        let thickness = WallThickness::measure(&mesh, plate, &surface).expect("a plate has two faces");
        let (low, high) = thickness.range(&vec![0.001; surface.nodes().len()]);
        assert!((low - 0.011).abs() < 1e-12 && (high - 0.011).abs() < 1e-12, "{low} {high}");
    }
}
