//! What impedance surfaces leave out at the sharp edges of conductors.
//!
//! A surface impedance is that of a half space. Along a sharp edge the field grows, with the distance `s` from it as `s^(p − 1)`,
//! `p = π/θ` by the angle `θ` outside, until it is a skin depth away; what goes on there is a matter of the angle, of the
//! permeability and of the skin depth alone. Of current along the edge the conductor has more loss there than its surface: beside a
//! right-angled edge of copper by six tenths of what the surface has within a skin depth. That is some percent of the loss of a thick
//! conductor, and a third of that of a bar of five skin depths by twelve across the field. Current across an edge is left out.
//!
//! How much it is comes from the loss that the surface has in the elements beside the edge, by [`MORE`], which was found in the
//! plane: a wedge and its surface in a disc of 120 skin depths, linear elements of a hundredth of one at the edge, and what both
//! differ by within 8 to 16 (0.1 % from two such meshes). The whole of bars of 25 by 10 mm is 13.8, 22.1 and 31.5 % at skin depths
//! of 0.3, 0.94 and 2.1 mm in the same way, and 14.0, 23.2 and 35.1 % of the loss beside their edges.

use std::collections::{BTreeMap, HashMap};

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, area_vector, centroid, cross, dot, norm, sub};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{ElementId, Mesh, NodeId};

use crate::element::Complex3;
use crate::model::FieldModel;
use crate::reentrant::{Bend, bend};
use crate::solution::FieldSolution;
use crate::surface::{Conductor, SurfaceLaw};

/// Widths of a strip beside an edge, in skin depths.
const WIDTHS: [f64; 8] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0];

/// Angles of conductors [°], and what they have more loss by than their surfaces, over the loss of the surfaces within [`WIDTHS`].
const MORE: [(f64, [f64; 8]); 8] = [
    (30.0, [5.722, 3.388, 2.126, 1.486, 1.133, 0.909, 0.752, 0.640]),
    (45.0, [4.086, 2.393, 1.479, 1.016, 0.760, 0.597, 0.484, 0.403]),
    (60.0, [3.101, 1.795, 1.092, 0.735, 0.538, 0.413, 0.326, 0.265]),
    (75.0, [2.413, 1.379, 0.824, 0.543, 0.388, 0.289, 0.222, 0.175]),
    (90.0, RIGHT_ANGLE),
    (105.0, [1.466, 0.814, 0.466, 0.291, 0.195, 0.136, 0.097, 0.070]),
    (120.0, [1.110, 0.606, 0.338, 0.205, 0.132, 0.088, 0.060, 0.041]),
    (140.0, [0.692, 0.369, 0.198, 0.114, 0.069, 0.043, 0.027, 0.017]),
];

/// That of a right angle.
const RIGHT_ANGLE: [f64; 8] = [1.889, 1.065, 0.624, 0.401, 0.278, 0.201, 0.149, 0.113];

/// Relative permeabilities, and the same of a right angle.
const MORE_OF_IRON: [(f64, [f64; 8]); 7] = [
    (1.0, RIGHT_ANGLE),
    (2.0, [1.989, 1.072, 0.588, 0.351, 0.229, 0.158, 0.113, 0.084]),
    (4.0, [1.986, 1.039, 0.543, 0.305, 0.185, 0.119, 0.082, 0.059]),
    (10.0, [1.762, 0.902, 0.454, 0.240, 0.135, 0.079, 0.050, 0.034]),
    (30.0, [1.210, 0.612, 0.301, 0.154, 0.082, 0.044, 0.025, 0.015]),
    (100.0, [0.606, 0.305, 0.149, 0.075, 0.039, 0.020, 0.011, 0.006]),
    (300.0, [0.250, 0.126, 0.061, 0.031, 0.016, 0.008, 0.004, 0.002]),
];

/// Component of a unit vector along an edge across a face that begins at it.
const ASIDE: f64 = 0.2;

/// What the impedance surface of a conductor leaves out.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgeLoss {
    /// Name of the region.
    pub region: String,
    /// Loss of the surface [W].
    pub of_surface: f64,
    /// What the conductor has more at its sharp edges, about [W].
    pub more: f64,
}

/// What the impedance surfaces of a field leave out at the sharp edges of their conductors.
pub fn edge_losses(model: &FieldModel, mesh: &Mesh, solution: &FieldSolution) -> Vec<EdgeLoss> {
    let mut losses: Vec<HashMap<[NodeId; 3], f64>> = vec![HashMap::new(); model.conductors().len()];
    for (index, triangle, loss) in solution.surface_losses(model, mesh) {
        losses[index].insert(face_key(triangle), loss);
    }
    let outer = mesh.topology().facets().iter().filter(|facet| facet.outside.is_none());
    let inside: HashMap<[NodeId; 3], ElementId> =
        outer.map(|facet| (face_key(facet.nodes), facet.inside)).collect();
    let of = |(conductor, losses): (&Conductor, &HashMap<[NodeId; 3], f64>)| {
        let SurfaceLaw::Impedance(material) = conductor.law else { return None };
        let skin_depth = material.skin_depth(model.angular_frequency())?;
        let edges = SharpEdges::of(mesh, &conductor.surface);
        let mut more = 0.0;
        for triangle in &conductor.surface {
            let Some(strip) = edges.strip(mesh, *triangle) else { continue };
            let key = face_key(*triangle);
            let (Some(loss), Some(&e)) = (losses.get(&key), inside.get(&key)) else { continue };
            let along = share_along(strip.direction, electric_field((model, mesh, solution), e, key));
            more += loss
                * along
                * share_more(strip.angle, strip.width / skin_depth, material.relative_permeability);
        }
        Some(EdgeLoss { region: conductor.name.clone(), of_surface: losses.values().sum(), more })
    };
    model.conductors().iter().zip(&losses).filter_map(of).collect()
}

/// The field in the middle of a face, by the element that it is of; `E/(−jω)` [T m].
fn electric_field(
    (model, mesh, solution): (&FieldModel, &Mesh, &FieldSolution),
    e: ElementId,
    face: [NodeId; 3],
) -> Complex3 {
    let of_face = |node: NodeId| if face.contains(&node) { 1.0 / 3.0 } else { 0.0 };
    solution.at(model, mesh, e, &mesh.topology().tet(e).map(of_face)).electric_potential
}

/// Share of the square of a field along a face, in the direction of a unit vector.
fn share_along((direction, normal): (Point, Point), field: Complex3) -> f64 {
    let part = |unit: Point| (0..3).map(|d| field[d] * unit[d]).sum::<c64>().norm_sqr();
    let whole: f64 = field.iter().map(|c| c.norm_sqr()).sum::<f64>() - part(normal);
    if whole > 0.0 { (part(direction) / whole).min(1.0) } else { 0.0 }
}

/// By how much a conductor has more loss than its surface within a strip of so many skin depths beside an edge, over the loss there.
fn share_more(angle: f64, width: f64, relative_permeability: f64) -> f64 {
    let at_width = |shares: &[f64; 8]| interpolated(&WIDTHS, shares, width);
    let of_angles = MORE.map(|(_, shares)| at_width(&shares));
    let angle = angle.clamp(MORE[0].0, MORE[7].0);
    let of_irons = MORE_OF_IRON.map(|(_, shares)| at_width(&shares));
    let iron = relative_permeability.clamp(MORE_OF_IRON[0].0, MORE_OF_IRON[6].0);
    interpolated(&MORE.map(|(angle, _)| angle), &of_angles, angle)
        * interpolated(&MORE_OF_IRON.map(|(permeability, _)| permeability), &of_irons, iron)
        / at_width(&RIGHT_ANGLE)
}

/// Between ascending places linear in the logarithms; beyond them as between the last two.
fn interpolated(places: &[f64], values: &[f64], at: f64) -> f64 {
    let k = places.partition_point(|place| *place < at).clamp(1, places.len() - 1);
    let share = (at / places[k - 1]).ln() / (places[k] / places[k - 1]).ln();
    values[k - 1] * (values[k] / values[k - 1]).powf(share)
}

/// A sharp edge between two faces of a conductor.
struct SharpEdge {
    ends: [NodeId; 2],
    /// Between the faces, inside the conductor [°].
    angle: f64,
}

/// The sharp edges of a surface by the nodes on them.
struct SharpEdges(BTreeMap<NodeId, Vec<SharpEdge>>);

/// Where a triangle lies beside an edge.
struct Strip {
    /// Unit vectors along the edge and across the triangle.
    direction: (Point, Point),
    /// From the edge to the far side of the triangle [m].
    width: f64,
    /// Of the conductor at the edge [°].
    angle: f64,
}

impl SharpEdges {
    /// Those of a surface whose triangles are oriented into the conductor.
    fn of(mesh: &Mesh, surface: &[[NodeId; 3]]) -> Self {
        let mut around: BTreeMap<[NodeId; 2], Vec<[NodeId; 3]>> = BTreeMap::new();
        for triangle in surface {
            for k in 0..3 {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                around.entry([a.min(b), a.max(b)]).or_default().push(*triangle);
            }
        }
        let mut by_node: BTreeMap<NodeId, Vec<SharpEdge>> = BTreeMap::new();
        for (ends, sides) in around {
            let &[one, other] = sides.as_slice() else { continue };
            if !matches!(bend(mesh, ends, [one, other]), Bend::Reentrant) {
                continue;
            }
            let [n, m] = [one, other].map(|side| area_vector(side.map(|node| mesh.point(node))));
            let angle = 180.0 - (dot(n, m) / (norm(n) * norm(m))).clamp(-1.0, 1.0).acos().to_degrees();
            for node in ends {
                by_node.entry(node).or_default().push(SharpEdge { ends, angle });
            }
        }
        Self(by_node)
    }

    /// Where a triangle lies beside the nearest edge that it begins at; `None` where it touches none.
    fn strip(&self, mesh: &Mesh, triangle: [NodeId; 3]) -> Option<Strip> {
        let vertices = triangle.map(|node| mesh.point(node));
        let area = area_vector(vertices);
        let normal = area.map(|c| c / norm(area));
        let mut nearest: Option<(f64, Strip)> = None;
        for edge in triangle.iter().filter_map(|node| self.0.get(node)).flatten() {
            let [a, b] = edge.ends.map(|node| mesh.point(node));
            let along = sub(b, a);
            let direction = along.map(|c| c / norm(along));
            if dot(direction, normal).abs() > ASIDE {
                continue;
            }
            let distance = |x: Point| norm(cross(sub(x, a), direction));
            let off = distance(centroid(vertices));
            if nearest.as_ref().is_none_or(|(least, _)| off < *least) {
                let width = vertices.into_iter().map(distance).fold(0.0, f64::max);
                nearest = Some((off, Strip { direction: (direction, normal), width, angle: edge.angle }));
            }
        }
        let (_, strip) = nearest?;
        // From edge to edge half of the face is beside each.
        let ends_at_edges = triangle.iter().all(|node| self.0.contains_key(node));
        Some(Strip { width: if ends_at_edges { 0.5 * strip.width } else { strip.width }, ..strip })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_those_of_the_table_and_go_on_as_powers() {
        assert_eq!(share_more(90.0, 1.0, 1.0), 0.624);
        assert!((share_more(90.0, 2.0, 10.0) - 0.240).abs() < 1e-12);
        let between = share_more(82.5, 3.0, 1.0);
        assert!((share_more(90.0, 4.0, 1.0)..share_more(75.0, 2.0, 1.0)).contains(&between), "{between}");
        // Far from the edge the loss of the surface grows with the third root of the width.
        let slope = (share_more(90.0, 64.0, 1.0) / share_more(90.0, 512.0, 1.0)).log(8.0);
        assert!((0.33..0.42).contains(&slope), "{slope}");
        assert!(share_more(180.0, 1.0, 1e5) < share_more(90.0, 1.0, 100.0));
    }
}
