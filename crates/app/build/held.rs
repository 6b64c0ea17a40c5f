//! Nodes that must keep to where they lie: those of surfaces with a condition, and those of the sides of the mesh.

use std::collections::BTreeSet;

use fluxmorph_geometry::directions::{Frame, unit};
use fluxmorph_geometry::tet4::{Point, area_vector, dot, norm, sub};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{Mesh, NodeId, millimetres};
use fluxmorph_optimizer::design::DesignSurface;
use fluxmorph_remesh::ElasticMap;
use fluxmorph_solver::FieldModel;

use super::shape::{Inputs, may_move};
use crate::config::Diagnostic;

/// Sine of the angle to a plane up to which a direction is along it: files carry few digits, and their facets differ by that.
const ALONG: f64 = 1e-3;

/// Distance from a plane up to which a node lies in it, by the diagonal of the mesh.
const IN_PLANE: f64 = 1e-7;

/// The outer faces with one of these nodes whose plane has the whole mesh on one side, with the normal outwards: planes of symmetry
/// and outer walls, and not the walls of a hole.
pub(super) fn sides(mesh: &Mesh, is_of: impl Fn(NodeId) -> bool) -> Vec<([NodeId; 3], Point)> {
    let [lower, upper] = mesh.bounding_box();
    let tolerance = IN_PLANE * norm(sub(upper, lower));
    // Neighbours share a plane: what was found for it last holds.
    let mut planes: Vec<(Point, Point, bool)> = Vec::new();
    let mut found = Vec::new();
    for facet in mesh.topology().facets().iter().filter(|facet| facet.outside.is_none()) {
        if !facet.nodes.iter().any(|&node| is_of(node)) {
            continue;
        }
        let vertices = facet.nodes.map(|node| mesh.point(node));
        let height = |(normal, at): (Point, Point), x: Point| dot(normal, sub(x, at));
        let lies_in = |&&(normal, at, _): &&(Point, Point, bool)| {
            vertices.iter().all(|&x| height((normal, at), x).abs() <= tolerance)
        };
        let is_side = planes.iter().find(lies_in).map(|plane| (plane.0, plane.2)).unwrap_or_else(|| {
            let plane = (unit(area_vector(vertices)), vertices[0]);
            let is_side = mesh.points().iter().all(|&x| height(plane, x) <= tolerance);
            planes.push((plane.0, plane.1, is_side));
            (plane.0, is_side)
        });
        if let (normal, true) = is_side {
            found.push((facet.nodes, normal));
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
    if let Some(held) = unknowns.held_carriers().find(|&n| space.vertices_of(n).into_iter().any(moves)) {
        return Some(leaves_its_surface(inputs, space.position(inputs.mesh, held)));
    }
    let designed = |node: NodeId| surface.nodes().binary_search(&node).ok();
    let leaves = |node: NodeId, axis: usize| match designed(node) {
        Some(i) => surface.directions()[i][axis] != 0.0,
        None => map.unknown_part(node, Frame::COORDINATES.axes[axis])[axis] != 0.0,
    };
    if let Some((node, _)) = unknowns.oblique_nodes().iter().find(|(node, normal)| match designed(*node) {
        Some(i) => dot(surface.directions()[i], *normal).abs() > ALONG * norm(surface.directions()[i]),
        None => norm(map.unknown_part(*node, *normal)) > ALONG,
    }) {
        return Some(leaves_its_surface(inputs, inputs.mesh.point(*node)));
    }
    let of_planes = unknowns.plane_nodes().find_map(|(node, axes)| {
        (0..3).find(|&axis| axes >> axis & 1 == 1 && leaves(node, axis)).map(|axis| (node, axis))
    });
    let Some((node, axis)) = of_planes else { return natural_side_fault(inputs, surface, map) };
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
/// plane alone.
fn natural_side_fault(inputs: &Inputs<'_>, surface: &DesignSurface, map: &ElasticMap) -> Option<Diagnostic> {
    let own =
        inputs.design.surface.iter().filter_map(|name| inputs.mesh.topology().surface(name).ok()).flatten();
    let own: BTreeSet<[NodeId; 3]> = own.copied().map(face_key).collect();
    let sides = sides(inputs.mesh, |node| may_move(surface, map, node));
    let leaves = |node: NodeId, normal: Point| match surface.nodes().binary_search(&node) {
        Ok(i) => dot(surface.directions()[i], normal).abs() > ALONG * norm(surface.directions()[i]),
        Err(_) => norm(map.unknown_part(node, normal)) > ALONG,
    };
    let beside = sides.iter().filter(|(nodes, _)| !own.contains(&face_key(*nodes)));
    let node = beside
        .flat_map(|(nodes, normal)| nodes.map(|node| (node, *normal)))
        .find(|(node, normal)| leaves(*node, *normal))?
        .0;
    let message = format!(
        "an outer face of the mesh would leave its plane at {}",
        millimetres(inputs.mesh.point(node))
    );
    let expected = "its surface listed in remesh.slide or remesh.fixed, or a design.direction along it";
    Some(inputs.source.diagnostic("remesh", message).expected(expected))
}
