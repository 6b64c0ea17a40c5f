//! Bodies whose force or torque means little: of air, that touch iron outside of them, and cut by an outer face.

use fluxmorph_geometry::directions::unit;
use fluxmorph_geometry::tet4::{Point, area_vector, centroid, cross, dot, norm, sub};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{ElementId, Mesh, NodeId, RegionId, millimetres};
use fluxmorph_solver::coil;

use super::entries::{is_magnet, is_wound, material};
use super::plausible::{INCLINED, place_of_current, windings};
use super::references::{body_of, functionals};
use super::soundness::faces_of;
use crate::config::{Config, ForceBody, ObjectiveKind, RegionModel};

/// Cosine of the angle (one degree) between normals of planes that count as parallel.
const ONE_DIRECTION: f64 = 0.9998;

/// What is to be said of all bodies; `coils` are those of the configuration.
pub(super) fn warnings(config: &Config, mesh: &Mesh, coils: &[coil::Coil]) -> Vec<String> {
    let bodies = config.forces.iter().filter_map(|body| force_warning(config, mesh, coils, body));
    // Of one that is sought for more is said.
    let functionals = functionals(config);
    let sought: Vec<&ForceBody> = functionals.iter().filter_map(|(_, own)| body_of(config, own)).collect();
    let reported = config.forces.iter().filter(|body| sought.iter().all(|own| own.name != body.name));
    let cut = reported.filter_map(|body| cut_winding_warning(config, mesh, body));
    bodies.chain(cut).chain(cut_warnings(config, mesh)).collect()
}

/// What to say of a body whose force means little: one of air, and one that touches iron outside of it.
fn force_warning(config: &Config, mesh: &Mesh, coils: &[coil::Coil], body: &ForceBody) -> Option<String> {
    let topology = mesh.topology();
    let is_iron = |name: &str| material(config, name).relative_permeability != 1.0;
    let acts = |name: &String| {
        let is_perfect = config.regions.get(name).is_some_and(|own| own.model == RegionModel::Perfect);
        let conducts = is_perfect || config.alternates() && material(config, name).conductivity > 0.0;
        is_iron(name) || is_magnet(config, name) || conducts || is_wound(config, name)
    };
    let (name, regions) = (&body.name, body.regions.join("`, `"));
    let is_own = |e: &ElementId| body.regions.iter().any(|name| name == topology.region_name_at(*e));
    let holds_a_coil = || {
        windings(coils)
            .any(|(_, winding)| place_of_current(mesh, winding, topology.elements().filter(is_own)).is_some())
    };
    if !body.regions.iter().any(acts) && !holds_a_coil() {
        return Some(format!(
            "no force acts on the body `{name}`: nothing in `{regions}` is magnetic or carries a current, and what is computed is \
             that on what lies beside it"
        ));
    }
    // An edge or a corner in common will do: the layer in which a force is taken has all elements around the nodes of the body.
    let own = body.regions.iter().filter_map(|name| topology.region(name).ok());
    let is_of_body = topology.is_node_of(own.flat_map(|region| topology.elements_of(region)));
    let touches = |other: RegionId| {
        topology
            .elements_of(other)
            .iter()
            .any(|&e| topology.tet(e).iter().any(|node| is_of_body[node.index()]))
    };
    let mut outside = topology.region_names().iter().filter(|name| !body.regions.contains(name));
    let joined = outside.find(|name| is_iron(name.as_str()) && topology.region(name).is_ok_and(touches))?;
    Some(format!(
        "the body `{name}` touches the iron of `{joined}`: its force is taken in the elements around it, those in iron do not hold the \
         field at its face, and the result depends on the mesh; take `{joined}` into its regions, or leave air between the two"
    ))
}

/// What to say of a winding that a surface cuts: the force that its turns feel across that is another.
fn cut_winding_warning(config: &Config, mesh: &Mesh, body: &ForceBody) -> Option<String> {
    if !body.regions.iter().any(|name| is_wound(config, name)) {
        return None;
    }
    let cuts = cutting_surfaces(config, mesh, body, |_| true)?;
    if is_straight_between_planes(mesh, body) {
        return None;
    }
    let (cuts, verb) = (cuts.join(" and "), if cuts.len() == 1 { "cuts" } else { "cut" });
    Some(format!(
        "{cuts} {verb} the winding `{}`: its force across that, as the axial one of half a winding, is the one on the free faces of the \
         meshed part, without the stress in the cut, and not the J × B of its turns; mesh the whole winding for it",
        body.name
    ))
}

/// Whether a body is cut by parallel planes on opposite sides alone, as a bar in a slab: its current goes from one to the other, and
/// feels no force across them.
fn is_straight_between_planes(mesh: &Mesh, body: &ForceBody) -> bool {
    let topology = mesh.topology();
    let regions = body.regions.iter().filter_map(|name| topology.region(name).ok());
    let normal = |face: [NodeId; 3]| unit(area_vector(face.map(|node| mesh.point(node))));
    let normals: Vec<Point> = regions.flat_map(|region| topology.outer_faces(region)).map(normal).collect();
    let Some(first) = normals.first() else { return false };
    let along = || normals.iter().map(|own| dot(*own, *first));
    along().all(|own| own.abs() > ONE_DIRECTION) && along().any(|own| own < 0.0)
}

/// The surfaces that cut a body, in words: those with a condition before one without; of faces that count.
fn cutting_surfaces(
    config: &Config,
    mesh: &Mesh,
    body: &ForceBody,
    counts: impl Fn(&[NodeId; 3]) -> bool,
) -> Option<Vec<String>> {
    let topology = mesh.topology();
    let regions = body.regions.iter().filter_map(|name| topology.region(name).ok());
    let outside: Vec<[NodeId; 3]> =
        regions.flat_map(|region| topology.outer_faces(region)).filter(|face| counts(face)).collect();
    let cuts = |surface: &&String| {
        let faces = faces_of(topology, [surface.as_str()]);
        outside.iter().any(|face| faces.contains(&face_key(*face)))
    };
    let named = config.boundaries.surfaces().filter(cuts).map(|surface| format!("the surface `{surface}`"));
    let named: Vec<String> = named.collect();
    if !named.is_empty() {
        return Some(named);
    }
    let place = millimetres(centroid(outside.first()?.map(|node| mesh.point(node))));
    Some(vec![format!("the outer face at {place}, which has no condition,")])
}

/// What to say of forces and torques that are sought across a plane which cuts their body: of these only a part is computed.
fn cut_warnings(config: &Config, mesh: &Mesh) -> Vec<String> {
    let mut warnings = Vec::new();
    for (path, own) in functionals(config) {
        let Some(body) = body_of(config, own) else { continue };
        let direction = own.direction.unwrap_or_default();
        // Of the virtual motion of the body.
        let velocity = |x: Point| match own.kind {
            ObjectiveKind::Force => direction,
            ObjectiveKind::Torque => cross(direction, sub(x, body.about)),
            _ => [0.0; 3],
        };
        // Outer faces hold the nodes of the body (`Force`), with a condition or without.
        let goes_across = |face: &[NodeId; 3]| {
            let corners = face.map(|node| mesh.point(node));
            let (area, v) = (area_vector(corners), velocity(centroid(corners)));
            dot(v, area).abs() > INCLINED * norm(v) * norm(area)
        };
        if let Some([surface, ..]) = cutting_surfaces(config, mesh, body, goes_across).as_deref() {
            let of_magnet = if body.regions.iter().any(|name| is_magnet(config, name)) {
                "; of a magnet it comes from the singular field beside the cut, and its error bar is far too small"
            } else {
                ""
            };
            warnings.push(format!(
                "{path}: {surface} cuts the body `{}`, and what is computed across it is that on the free faces of \
                 the meshed part, without the stress in the cut; on half of a symmetric body that is not a force on anything{of_magnet}. \
                 Take a direction along the surface, or mesh the whole body",
                body.name
            ));
        }
    }
    warnings
}
