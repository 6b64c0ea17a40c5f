//! Nodes that must keep to where they lie: those of surfaces with a condition, and those of the sides of the mesh.

use std::collections::BTreeMap;

use fluxmorph_geometry::directions::Frame;
use fluxmorph_geometry::tet4::{Point, centroid, cross, dot, norm, sub};
use fluxmorph_geometry::{Mesh, NodeId, millimetres};
use fluxmorph_optimizer::design::DesignSurface;
use fluxmorph_remesh::ElasticMap;
use fluxmorph_solver::FieldModel;

use super::shape::{Inputs, may_move};
use super::soundness::normal;
use crate::config::Diagnostic;

/// Sine of the angle to a plane up to which a direction is along it: files carry few digits, and their facets differ by that.
const ALONG: f64 = 1e-3;

/// Distance from a plane up to which a node lies in it, by the diagonal of the mesh, beside what [`ALONG`] allows.
const IN_PLANE: f64 = 1e-7;

/// A plane through a face of the outside.
struct Plane {
    normal: Point,
    at: Point,
    /// Whether the whole mesh lies on one side of it, and more of it than one face in it.
    is_side: bool,
}

impl Plane {
    /// Height of a point over it, less what is rounding [m].
    fn height(&self, x: Point, rounding: f64) -> f64 {
        let way = sub(x, self.at);
        let height = dot(self.normal, way);
        height.signum() * (height.abs() - rounding - ALONG * norm(way)).max(0.0)
    }
}

/// The outer faces, of those that are wanted, whose plane has the whole mesh on one side, with the normal outwards: planes of symmetry
/// and outer walls, and not the walls of a hole.
pub(super) fn sides(mesh: &Mesh, is_wanted: impl Fn([NodeId; 3]) -> bool) -> Vec<([NodeId; 3], Point)> {
    let [lower, upper] = mesh.bounding_box();
    let rounding = IN_PLANE * norm(sub(upper, lower));
    let mut planes: Vec<Plane> = Vec::new();
    let mut found = Vec::new();
    for nodes in mesh.topology().outer_facets().map(|facet| facet.nodes).filter(|nodes| is_wanted(*nodes)) {
        let vertices = nodes.map(|node| mesh.point(node));
        let lies_in = |plane: &&Plane| vertices.iter().all(|&x| plane.height(x, rounding) == 0.0);
        let known = planes.iter().position(|plane| lies_in(&plane)).unwrap_or_else(|| {
            let mut plane = Plane { normal: normal(mesh, nodes), at: centroid(vertices), is_side: false };
            let heights = || mesh.points().iter().map(|&x| plane.height(x, rounding));
            let is_side = heights().all(|height| height <= 0.0);
            plane.is_side = is_side && heights().filter(|height| *height == 0.0).nth(3).is_some();
            planes.push(plane);
            planes.len() - 1
        });
        if planes[known].is_side {
            found.push((nodes, planes[known].normal));
        }
    }
    found
}

/// Refuses a motion of nodes whose condition belongs to where they lie: on curved or oblique surfaces, and where A is
/// prescribed.
pub(super) fn held_node_fault(
    inputs: &Inputs<'_>,
    surface: &DesignSurface,
    map: &ElasticMap,
    model: &FieldModel,
) -> Option<Diagnostic> {
    let (space, unknowns) = (model.space(), model.unknowns());
    let moves = |node: NodeId| may_move(surface, map, node);
    if let Some(held) = unknowns.prescribed_carriers().find(|&n| space.vertices_of(n).into_iter().any(moves))
    {
        return Some(leaves_its_surface(inputs, space.position(inputs.mesh, held)));
    }
    let designed = |node: NodeId| surface.nodes().binary_search(&node).ok();
    let leaves = |node: NodeId, normal: Point| match designed(node) {
        Some(i) => dot(surface.directions()[i], normal).abs() > ALONG * norm(surface.directions()[i]),
        None => norm(map.unknown_part(node, normal)) > ALONG,
    };
    let oblique = unknowns.oblique_nodes().iter().find(|(node, normal)| leaves(*node, *normal));
    let smoothed = || unknowns.smoothed_nodes().find(|&node| moves(node));
    if let Some(node) = oblique.map(|(node, _)| *node).or_else(smoothed) {
        return Some(leaves_its_surface(inputs, inputs.mesh.point(node)));
    }
    let of_planes = unknowns.plane_nodes().find_map(|(node, axes)| {
        let is_left = |&axis: &usize| axes >> axis & 1 == 1 && leaves(node, Frame::COORDINATES.axes[axis]);
        (0..3).find(is_left).map(|axis| (node, axis))
    });
    let Some((node, axis)) = of_planes else { return natural_side_fault(inputs, leaves) };
    let message = format!(
        "a plane with a condition at right angles to {} would lose its nodes at {}",
        ["x", "y", "z"][axis],
        millimetres(inputs.mesh.point(node))
    );
    let fault = inputs.source.diagnostic("remesh", message);
    Some(fault.expected(match designed(node) {
        Some(_) => "a design.direction along the plane, or a design.surface that ends before it",
        None => "the plane listed in remesh.slide, or a remesh region that ends before it",
    }))
}

/// A node of a conditioned surface at right angles to no axis that would leave it.
fn leaves_its_surface(inputs: &Inputs<'_>, place: Point) -> Diagnostic {
    let message = format!(
        "a surface with a condition that is curved, oblique or has an applied field would move at {}",
        millimetres(place)
    );
    let fault = inputs.source.diagnostic("remesh", message);
    fault.expected("such surfaces outside the remesh region, or listed in remesh.fixed")
}

/// A node of a side of the mesh without a condition that would leave it: flux goes through such a side at right angles while it is a
/// plane alone. Beside a part of that side that is designed it goes along.
fn natural_side_fault(inputs: &Inputs<'_>, leaves: impl Fn(NodeId, Point) -> bool) -> Option<Diagnostic> {
    let full = inputs.full_mesh;
    let same = full.nodes_in(inputs.mesh);
    let mut own: BTreeMap<NodeId, Vec<Point>> = BTreeMap::new();
    for triangle in
        inputs.design.surface.iter().filter_map(|name| full.topology().surface(name).ok()).flatten()
    {
        let normal = normal(full, *triangle);
        triangle.iter().for_each(|node| own.entry(*node).or_default().push(normal));
    }
    let is_designed = |node: NodeId, normal: Point| {
        own.get(&node).is_some_and(|all| all.iter().any(|own| norm(cross(*own, normal)) <= ALONG))
    };
    let would_leave = |node: NodeId, normal: Point| {
        !is_designed(node, normal) && same[node.index()].is_some_and(|node| leaves(node, normal))
    };
    // What moves across its own face, before it is looked at whether that is a side.
    let is_left = |nodes: [NodeId; 3]| {
        let normal = normal(full, nodes);
        nodes.iter().any(|&node| would_leave(node, normal))
    };
    let (nodes, normal) = sides(full, is_left).into_iter().next()?;
    let node = nodes.into_iter().find(|&node| would_leave(node, normal)).unwrap_or(nodes[0]);
    let message =
        format!("an outer face of the mesh would leave its plane at {}", millimetres(full.point(node)));
    let expected = "its surface listed in remesh.slide or remesh.fixed, or a design.direction along it";
    Some(inputs.source.diagnostic("remesh", message).expected(expected))
}
