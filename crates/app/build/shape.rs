//! The design surface and the elastic map of a configuration.

use std::collections::BTreeSet;

use fluxmorph_geometry::box_tree::AxisBox;
use fluxmorph_geometry::parallel::Ownership;
use fluxmorph_geometry::tet4::{Point, add, area_vector, centroid, dot, norm};
use fluxmorph_geometry::topology::{Facet, face_key};
use fluxmorph_geometry::{ElementId, Mesh, Millimetres, NodeId, RegionId, millimetres};
use fluxmorph_optimizer::design::{DesignSurface, GridSide, default_filter_radius};
use fluxmorph_optimizer::geometric::{WallThickness, faces_with_bodies};
use fluxmorph_optimizer::problem::Shape;
use fluxmorph_remesh::{ElasticMap, Motion, RemeshSetup, Subregion};
use fluxmorph_solver::FieldModel;

use super::elastic_body::{Mover, common_axis, guidance, motion_law, regions_at, remesh_setup, unused_keys};
use super::entries::{is_air, material};
use super::functional::FixedElements;
use super::held::held_node_fault;
use super::plausible;
use super::soundness::unit_warning;
use crate::config::{self, Config, Design, Diagnostic, RegionModel, Remesh, SourceMap};
use crate::error::Error;

/// Cosine of the angle to the motion of the design up to which a face lies across it.
const ACROSS: f64 = 0.7;

/// Cosine of the angle up to which two directions of a design are one.
const ALIKE: f64 = 0.99;

/// What the shape is made from.
pub(super) struct Inputs<'a> {
    pub(super) source: &'a SourceMap,
    pub(super) design: &'a Design,
    pub(super) remesh: &'a Remesh,
    /// With all regions.
    pub(super) full_mesh: &'a Mesh,
    /// Without the regions that impedance surfaces replace.
    pub(super) mesh: &'a Mesh,
    /// The design surface on the mesh with all regions, where it comes from a coarser mesh.
    pub(super) surface: Option<&'a DesignSurface>,
    /// The ranks among which it is shared out.
    pub(super) share: Option<&'a Ownership>,
}

/// The design surface and the elastic map, before they are held against the field problem.
pub(super) struct Body {
    /// On the mesh with all regions.
    full_surface: DesignSurface,
    /// On the mesh that is left.
    surface: DesignSurface,
    motion: Motion,
}

impl Body {
    /// Elements of which a node may move, ascending.
    pub(super) fn moving(&self) -> &[ElementId] {
        self.motion.moving()
    }
}

/// Makes the design surface and the elastic map.
pub(super) fn body(inputs: &Inputs<'_>, config: &Config, warnings: &mut Vec<String>) -> Result<Body, Error> {
    let Inputs { source, design, mesh, full_mesh, .. } = *inputs;
    let full_surface = match inputs.surface {
        Some(surface) => surface.clone(),
        None => super::design::surface(config, source, design, full_mesh)?,
    };
    let surface = super::design::on_remaining(source, &full_surface, full_mesh, mesh)?;
    let triangles = super::design::triangles(design, full_mesh)?;
    if let Some(sides) = surface.grid_sides() {
        warnings.extend(sides.into_iter().filter_map(|side| fine_grid_warning(side, full_mesh, &triangles)));
        warnings.extend(idle_warning(&surface));
    }
    warnings.extend(blind_filter_warning(&surface, full_mesh, &triangles));
    warnings.extend(super::design::asymmetry_warning(design, full_mesh, (&full_surface, &triangles)));
    warnings.extend(side_warning(config, design, full_mesh, full_surface.nodes()));
    warnings.extend(held_warning(inputs.remesh, mesh, &surface));
    warnings.extend(slid_warning(inputs.remesh, design));
    let guidance = guidance(source, Some(design), inputs.remesh)?;
    let law = motion_law(source, inputs.remesh, common_axis(surface.directions()), Mover::Design)?;
    warnings.extend(unused_keys(source, inputs.remesh, law));
    let setup = remesh_setup(source, inputs.remesh, mesh, surface.nodes(), (law, guidance), warnings)?;
    warnings.extend(torn_warning(inputs.remesh, mesh, &setup.subregions));
    let setup = RemeshSetup { ownership: inputs.share.cloned(), ..setup };
    let motion = Motion::new(mesh.clone(), setup)?;
    warnings.extend(opposite_warning(inputs.remesh, mesh, &surface, motion.map()));
    Ok(Body { full_surface, surface, motion })
}

/// Distance of the points of a control grid in cells of the surface below which the mesh does not follow them.
const FINEST_GRID: f64 = 0.5;

/// A side of a control grid of which the mesh cannot follow the variables one by one.
fn fine_grid_warning(side: GridSide, mesh: &Mesh, triangles: &[[NodeId; 3]]) -> Option<String> {
    let cell = mean_extent(mesh, triangles, side.axis);
    let most = ((side.extent / cell) as usize + 1).max(2);
    (side.spacing() < FINEST_GRID * cell && side.count > most).then(|| {
        format!(
            "design.grid has a point every {:.3} mm along {axis}, where cells of the surface are {:.3} mm wide: the mesh does not follow \
             them one by one, and what they gain may be lost on another mesh; take up to {most} points along {axis}, or refine the mesh",
            Millimetres(side.spacing()),
            Millimetres(cell),
            axis = side.axis_name(),
        )
    })
}

/// The mean of the triangles' extents along an axis [m], by their areas.
fn mean_extent(mesh: &Mesh, triangles: &[[NodeId; 3]], axis: usize) -> f64 {
    let (mut sum, mut whole) = (0.0, 0.0);
    for triangle in triangles {
        let corners = triangle.map(|n| mesh.point(n));
        let (area, around) = (norm(area_vector(corners)), AxisBox::around(corners));
        sum += area * (around.upper[axis] - around.lower[axis]);
        whole += area;
    }
    sum / whole
}

/// Points of a control grid that move nothing.
fn idle_warning(surface: &DesignSurface) -> Option<String> {
    let mut weights = vec![0.0; surface.variable_count()];
    surface.rows().iter().flatten().for_each(|&(k, weight)| weights[k] += weight);
    let idle = weights.iter().filter(|&&weight| weight == 0.0).count();
    (idle > 0).then(|| {
        format!(
            "{idle} of {} design variables move no node: these points of design.grid lie beside the surface in the rectangle around \
             it, between its nodes or on a fixed rim, and change nothing",
            surface.variable_count()
        )
    })
}

/// A filter that sees no neighbour of any node.
fn blind_filter_warning(surface: &DesignSurface, mesh: &Mesh, triangles: &[[NodeId; 3]]) -> Option<String> {
    let radius = surface.filter_radius()?;
    let rows = surface.rows();
    (rows.iter().all(|row| row.len() <= 1) && rows.iter().any(|row| !row.is_empty())).then(|| {
        format!(
            "design.filter_radius is {:.4} mm, and no node of the surface has another one as near: nothing is smoothed, each node moves \
             on its own, and what that gains may be lost on another mesh; by default it is {:.3} mm here",
            Millimetres(radius),
            Millimetres(default_filter_radius(mesh, triangles)),
        )
    })
}

/// What is rarely meant by a design surface with the same on both sides, or with nothing on one.
fn side_warning(config: &Config, design: &Design, mesh: &Mesh, nodes: &[NodeId]) -> Option<String> {
    let topology = mesh.topology();
    let is_part = |f: &&Facet| f.nodes.iter().all(|n| nodes.binary_search(n).is_ok());
    let facets: Vec<&Facet> = topology.facets().iter().filter(is_part).collect();
    let surface = design.surface.join("`, `");
    if facets.is_empty() {
        return Some(format!(
            "the design surface `{surface}` lies inside a region: both of its sides are alike to the field, and moving it changes none"
        ));
    }
    if facets.iter().all(|f| f.outside.is_none()) {
        return Some(format!(
            "the design surface `{surface}` is at the outside of the mesh: it is the wall of the model that moves, with its condition"
        ));
    }
    let is_static = config.frequencies().iter().all(|&f| f == 0.0);
    let matter = |e: ElementId| {
        let name = topology.region_name_at(e);
        let material = material(config, name);
        let region = config.regions.get(name);
        let entry = region.and_then(|region| config.materials.get(&region.material));
        let curve = entry.filter(|entry| entry.saturates()).and(region).map(|region| &region.material);
        (
            material.relative_permeability,
            if is_static { 0.0 } else { material.conductivity },
            curve,
            region.and_then(|region| region.remanence),
            region.map_or(RegionModel::Volume, |region| region.model),
        )
    };
    let is_alike = |f: &&Facet| f.outside.is_some_and(|other| matter(f.inside) == matter(other));
    facets.iter().all(is_alike).then(|| {
        format!(
            "both sides of the design surface `{surface}` are alike to the field: moving it changes none; check [regions] and the \
             relative_permeability of [materials]"
        )
    })
}

/// Nodes of the design on surfaces that are said to stay.
fn held_warning(remesh: &Remesh, mesh: &Mesh, surface: &DesignSurface) -> Vec<String> {
    let moves = |node: &NodeId| {
        let row = surface.nodes().binary_search(node).ok();
        row.is_some_and(|row| surface.directions()[row] != [0.0; 3] && !surface.rows()[row].is_empty())
    };
    let of = |name: &String| {
        let faces = mesh.topology().surface(name).ok()?;
        let own: BTreeSet<NodeId> = faces.iter().flatten().copied().collect();
        let shared = own.iter().filter(|n| moves(n)).count();
        (shared > 0).then(|| {
            format!(
                "{shared} nodes of `{name}` in remesh.fixed belong to the design and move with it; design.rim = \"fixed\" holds the \
                 edge of the design surface"
            )
        })
    };
    remesh.fixed.iter().filter_map(of).collect()
}

/// Design surfaces that are said to slide.
fn slid_warning(remesh: &Remesh, design: &Design) -> Vec<String> {
    let designed = remesh.slide.iter().filter(|name| design.surface.contains(name));
    let text = |name: &String| {
        format!(
            "`{name}` in remesh.slide is a design surface: its nodes move as the design says, and do not slide"
        )
    };
    designed.map(text).collect()
}

/// Faces in `remesh.free` that lie across the motion of the design and are not named to stay, such as the far side of a plate: they
/// follow it, so that its thickness is not what the variables say.
fn opposite_warning(remesh: &Remesh, mesh: &Mesh, surface: &DesignSurface, map: &ElasticMap) -> Vec<String> {
    let directions = surface.directions().iter().filter(|d| norm(**d) > 0.0);
    let Some(along) = directions.clone().next() else { return Vec::new() };
    let is_along = |d: &Point| dot(*d, *along).abs() > ALIKE * norm(*d) * norm(*along);
    if !directions.clone().all(is_along) {
        return Vec::new();
    }
    let is_designed = |n: &NodeId| surface.nodes().binary_search(n).is_ok();
    let named = remesh.fixed.iter().chain(&remesh.slide);
    let named = named.filter_map(|name| mesh.topology().surface(name).ok()).flatten();
    let stays: BTreeSet<[NodeId; 3]> = named.map(|face| face_key(*face)).collect();
    let of = |free: &String| {
        let across = |face: &&[NodeId; 3]| {
            let normal = area_vector(face.map(|n| mesh.point(n)));
            let is_free = face.iter().any(|n| map.is_unknown(*n));
            let moves = is_free && !face.iter().any(is_designed) && !stays.contains(&face_key(**face));
            moves && dot(normal, *along).abs() > ACROSS * norm(normal) * norm(*along)
        };
        let face = mesh.topology().surface(free).ok()?.iter().find(across)?;
        Some(format!(
            "`{free}` in remesh.free has faces across the motion of the design that are no part of it, as at {}: they move along with \
             it, and a wall between keeps its thickness; where they are to stay, name them in remesh.fixed or remesh.slide",
            millimetres(centroid(face.map(|n| mesh.point(n))))
        ))
    };
    remesh.free.iter().filter_map(of).collect()
}

/// Faces in `remesh.free` whose other side is no part of the elastic body.
fn torn_warning(remesh: &Remesh, mesh: &Mesh, parts: &[Subregion]) -> Vec<String> {
    let topology = mesh.topology();
    let mut moves = vec![false; topology.tets().len()];
    parts.iter().flat_map(|part| &part.elements).for_each(|e| moves[e.index()] = true);
    let still = |f: &Facet| {
        let sides = [f.inside, f.outside?];
        let still = sides.into_iter().find(|e| !moves[e.index()])?;
        sides.iter().any(|e| moves[e.index()]).then_some(still)
    };
    let of = |free: &String| {
        let faces: BTreeSet<_> = topology.surface(free).ok()?.iter().map(|face| face_key(*face)).collect();
        let facets = topology.facets().iter().filter(|f| faces.contains(&face_key(f.nodes)));
        let dragged = topology.region_name_at(facets.filter_map(still).next()?);
        Some(format!(
            "`{free}` in remesh.free is a face of `{dragged}` beyond what moves: its elements there are dragged along; take them into \
             remesh.region or remesh.box, or name the surface in remesh.fixed"
        ))
    };
    remesh.free.iter().filter_map(of).collect()
}

/// The shape of a body, held against the field problem and the bounds.
pub(super) fn shape(
    inputs: &Inputs<'_>,
    config: &Config,
    body: Body,
    models: &[FieldModel],
    observed: &[FixedElements],
) -> Result<Shape, Error> {
    let Inputs { source, design, mesh, full_mesh, .. } = *inputs;
    let Body { full_surface, surface, motion } = body;
    let mut faults = overlap_faults((inputs, surface.nodes()), motion.moving(), models, observed);
    let moves = |node: NodeId| may_move(&surface, motion.map(), node);
    let torn = models.iter().find_map(|model| model.torn_source(moves));
    faults.extend(torn.map(|e| source_fault((inputs, surface.nodes()), config, e)));
    if faults.is_empty() {
        faults.extend(held_node_fault(inputs, &surface, motion.map(), &models[0]));
    }
    let bodies = thickened_regions(full_mesh, &full_surface, config);
    let thickness = WallThickness::measure(full_mesh, &bodies, &full_surface)
        .map(|measured| measured.renumbered(full_mesh, &full_mesh.nodes_in(mesh)));
    let n = surface.variable_count();
    let initial = design.initial.values(n, design.lower, design.upper).unwrap_or_else(|| {
        let fault = source.diagnostic("design.initial", format!("design.initial has not {n} values"));
        faults.push(fault.expected(format!("one value for each of the {n} design variables")));
        Vec::new()
    });
    let quality = motion.quality(mesh).worst;
    if let Some(minimum) = config.optimizer.minimum_quality.filter(|minimum| quality < *minimum) {
        let message = format!(
            "the worst element of the undeformed mesh has the quality {quality:.3e}, below optimizer.minimum_quality = \
             {minimum}"
        );
        let fault = source.diagnostic("optimizer.minimum_quality", message);
        faults.push(fault.expected(format!("at most {quality:.3e}")));
    }
    if let Ok(thickness) = &thickness {
        let doubt = unit_warning(config, full_mesh).map_or(String::new(), |doubt| format!("; {doubt}"));
        faults.extend(vanishing_faults(source, design, mesh, (&surface, thickness), &doubt));
    }
    source.check(faults)?;
    // Unless more is asked for, it is the room of elements that is held.
    let least_quality = config.optimizer.minimum_quality.unwrap_or(0.0);
    let bounds = [vec![design.lower; n], vec![design.upper; n]];
    let shape =
        Shape::new(surface, motion, least_quality, bounds).with_thickness(thickness).starting_at(initial);
    Ok(shape)
}

/// The regions that a positive design thickens, ascending: behind the design surface, with an entry of their own, and of air only where
/// all of them are.
pub(super) fn thickened_regions(mesh: &Mesh, surface: &DesignSurface, config: &Config) -> Vec<RegionId> {
    let topology = mesh.topology();
    let name = |region: &RegionId| &topology.region_names()[region.index()];
    let behind = faces_with_bodies(mesh, surface);
    let behind = behind.into_iter().map(|(_, element)| topology.region_of()[element.index()]);
    let mut bodies: BTreeSet<RegionId> =
        behind.filter(|region| config.regions.contains_key(name(region))).collect();
    if !bodies.iter().all(|region| is_air(config, name(region))) {
        bodies.retain(|region| !is_air(config, name(region)));
    }
    bodies.into_iter().collect()
}

/// Refuses bounds at which nothing is left of the body: all variables there, somewhere, take more than its thickness. What speaks
/// against the unit of the mesh is said behind it.
fn vanishing_faults(
    source: &SourceMap,
    design: &Design,
    mesh: &Mesh,
    (surface, thickness): (&DesignSurface, &WallThickness),
    doubt: &str,
) -> Vec<Diagnostic> {
    let mut faults = Vec::new();
    for (key, bound) in [("design.lower", design.lower), ("design.upper", design.upper)] {
        let displacement = surface.displacement(&vec![bound; surface.variable_count()]);
        let moved = |node: NodeId| match surface.nodes().binary_search(&node) {
            Ok(i) => add(mesh.point(node), displacement[i]),
            Err(_) => mesh.point(node),
        };
        let left = thickness.walls(moved).map(|(_, wall)| wall.thickness);
        // Of the bound, the share that takes all of the wall: the least one is what is left to go to.
        let spent = left.zip(thickness.initial()).filter(|(left, _)| *left <= 0.0);
        let share = spent.map(|(left, (i, thickness))| (thickness / (thickness - left), i, thickness));
        let Some((share, i, thickness)) = share.min_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        let message = format!(
            "`{key}` is {:.3} mm, and at {} the body is {:.3} mm thick along the design's direction: nothing would be left of it",
            Millimetres(bound),
            millimetres(mesh.point(surface.nodes()[i])),
            Millimetres(thickness)
        );
        let fault = source.diagnostic(key, message);
        let most = Millimetres(share * bound);
        faults.push(fault.expected(format!("a bound nearer to zero than {most:.3} mm{doubt}")));
    }
    faults
}

/// Whether a node is a design node or has a component that the elastic map decides.
pub(super) fn may_move(surface: &DesignSurface, map: &ElasticMap, node: NodeId) -> bool {
    surface.nodes().binary_search(&node).is_ok() || map.is_unknown(node)
}

/// Refuses a remesh region that meets the shell of open space, which must stay where it is, or an observation region of which it is
/// not said whether it does.
fn overlap_faults(
    (inputs, design_nodes): (&Inputs<'_>, &[NodeId]),
    moving: &[ElementId],
    models: &[FieldModel],
    observed: &[FixedElements],
) -> Vec<Diagnostic> {
    let Inputs { source, mesh, .. } = *inputs;
    let moves = |e: &ElementId| moving.binary_search(e).is_ok();
    let mut faults = Vec::new();
    for own in observed.iter().filter(|own| own.elements.iter().any(moves)) {
        let (follow, instead) = if own.is_of_terms {
            ("follow = \"space\", for places that stay", "take a smaller radius, or take")
        } else {
            (
                "follow = \"space\" for places that stay, follow = \"mesh\" for cells that move along",
                "or take",
            )
        };
        let fault =
            source.diagnostic(&own.path, "the mesh moves where the field is observed").expected(follow);
        faults.push(fault.help(format!("{instead} the region out of remesh.region, or shrink remesh.box")));
    }
    if let Some(e) = models[0].open_elements().find(moves) {
        let at = millimetres(centroid(mesh.vertices(e)));
        let message = format!("the shell of open space reaches into the remesh region, at {at}");
        let fault = source.diagnostic("open", message);
        let fault = fault.expected("a remesh region inside the shell, which does not move");
        faults.push(match brought_in((inputs, design_nodes), e) {
            Some(cure) => fault.help(cure),
            None => fault,
        });
    }
    faults
}

/// A coil, or an end of its window, in an element that would move.
fn source_fault(
    (inputs, design_nodes): (&Inputs<'_>, &[NodeId]),
    config: &Config,
    element: ElementId,
) -> Diagnostic {
    let Inputs { source, mesh, .. } = *inputs;
    let (at, region) =
        (millimetres(centroid(mesh.vertices(element))), mesh.topology().region_name_at(element));
    let fault = source.diagnostic(
        &coil_at(config, mesh, element),
        format!("a coil reaches into an element with nodes that move, at {at} in `{region}`"),
    );
    if region_coil_at(config, mesh, element).is_some_and(|i| config.coils[i].is_solid()) {
        return fault.expected("a frequency above 0 Hz").help(
            "at 0 Hz the current of a solid conductor is that of conduction in the initial shape, and must not move; a low \
             frequency has the same field, and follows the shape",
        );
    }
    let fault = fault.expected(
        "a remesh region without nodes of elements that a winding or an end of its window cuts: a coil does not move with the mesh",
    );
    let cure = match brought_in((inputs, design_nodes), element) {
        Some(cure) => cure,
        None => "shrink the remesh region, or make what is in the coil's window a region of its own that stays; of a coil that is a \
                 region of the mesh only that has to stay"
            .to_owned(),
    };
    fault.help(match plausible::unit_hint(config, inputs.full_mesh) {
        Some(hint) => format!("{hint}; else {cure}"),
        None => cure,
    })
}

/// That an element moves by a surface alone, not by `remesh.region`: its region is at the design surface, or it has a node there, or in a
/// surface in which `[remesh]` lets nodes move.
fn brought_in((inputs, design_nodes): (&Inputs<'_>, &[NodeId]), element: ElementId) -> Option<String> {
    let Inputs { design, remesh, mesh, .. } = *inputs;
    let topology = mesh.topology();
    let (region, tet) = (topology.region_name_at(element), topology.tet(element));
    let config::RemeshExtent::Regions(named) = &remesh.extent else { return None };
    if named.iter().any(|own| own == region) {
        return None;
    }
    let is_designed = regions_at(mesh, design_nodes).contains(&topology.region_of()[element.index()])
        || tet.iter().any(|node| design_nodes.binary_search(node).is_ok());
    let has_node_in = |surface: &&String| {
        let faces = topology.surface(surface);
        faces.is_ok_and(|faces| faces.iter().flatten().any(|node| tet.contains(node)))
    };
    let surface = if is_designed {
        format!("the design surface `{}`", design.surface.join("`, `"))
    } else if let Some(own) = remesh.free.iter().find(has_node_in) {
        format!("a surface in remesh.free, `{own}`")
    } else {
        format!("a surface in remesh.slide, `{}`", remesh.slide.iter().find(has_node_in)?)
    };
    Some(format!(
        "`{region}` moves because it touches {surface}, not by remesh.region: take another surface, or lay a region between it and what \
         stays"
    ))
}

/// The coil whose region an element is in.
fn region_coil_at(config: &Config, mesh: &Mesh, element: ElementId) -> Option<usize> {
    let topology = mesh.topology();
    let name = &topology.region_names()[topology.region_of()[element.index()].index()];
    config
        .coils
        .iter()
        .position(|coil| matches!(&coil.shape, config::CoilShape::Region(own) if own.region == *name))
}

/// The key path of the position of the coil in an element; all coils where several may be it.
fn coil_at(config: &Config, mesh: &Mesh, element: ElementId) -> String {
    if let Some(i) = region_coil_at(config, mesh, element) {
        return format!("coils[{i}].region");
    }
    let analytic = |coil: &config::Coil| !matches!(coil.shape, config::CoilShape::Region(_));
    let of_shape: Vec<usize> = (0..config.coils.len()).filter(|&i| analytic(&config.coils[i])).collect();
    match of_shape.as_slice() {
        [one] => format!("coils[{one}].center"),
        _ => "coils".to_owned(),
    }
}
