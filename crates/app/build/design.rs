//! The design surface of a configuration: its triangles, which side of them is the body, and the planes it meets.

use std::collections::{BTreeMap, BTreeSet};

use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{ElementId, Facet, Mesh, MeshError, NodeId, Topology, millimetres};
use fluxmorph_optimizer::design::{
    BoundaryMotion, Control, DesignError, DesignSetup, DesignSurface, Direction, Mirror, Triangulation,
    default_filter_radius, edges_without_image,
};

use super::held::sides;
use crate::config::{self, Config, DesignDirection, DirectionWord, RimMotion, SourceMap};
use crate::error::Error;

/// The design surface on the mesh with all regions.
pub(super) fn surface(
    config: &Config,
    source: &SourceMap,
    design: &config::Design,
    mesh: &Mesh,
) -> Result<DesignSurface, Error> {
    let topology = mesh.topology();
    let facets: BTreeMap<[NodeId; 3], &Facet> =
        topology.facets().iter().map(|facet| (face_key(facet.nodes), facet)).collect();
    let mut triangles = Vec::new();
    let mut own = BTreeSet::new();
    for name in &design.surface {
        for &triangle in topology.surface(name)?.iter().filter(|t| own.insert(face_key(**t))) {
            triangles.push(match design.direction {
                DesignDirection::Vector(_) => triangle,
                DesignDirection::Word(DirectionWord::Normal) => {
                    let facet = facets.get(&face_key(triangle)).copied();
                    out_of_body(config, topology, name, facet)
                        .ok_or_else(|| unclear_side(source, mesh, name, triangle))?
                }
            });
        }
    }
    let mut kept = Vec::new();
    for name in kept_surfaces(config) {
        kept.extend(topology.surface(name)?.iter().copied().filter(|t| !own.contains(&face_key(*t))));
    }
    let outer = |t: &[NodeId; 3]| facets.get(&face_key(*t)).is_some_and(|facet| facet.outside.is_none());
    let cuts = kept.iter().copied().filter(outer).collect();
    let nodes: BTreeSet<NodeId> = triangles.iter().flatten().copied().collect();
    let sides =
        sides(mesh, |face| face.iter().any(|node| nodes.contains(node)) && !own.contains(&face_key(face)))
            .into_iter()
            .map(|(triangle, _)| triangle);
    kept.extend(sides);
    let setup = DesignSetup {
        direction: match design.direction {
            DesignDirection::Vector(direction) => Direction::Along(direction),
            DesignDirection::Word(DirectionWord::Normal) => Direction::Normal,
        },
        control: match (design.grid, design.filter_radius) {
            (Some(counts), _) => Control::Grid(counts),
            (None, Some(0.0)) => Control::Nodes,
            (None, Some(radius)) => Control::Filter(radius),
            (None, None) => Control::Filter(default_filter_radius(mesh, &triangles)),
        },
        mirrors: mirrors(design),
        boundary: match design.rim {
            RimMotion::Free => BoundaryMotion::Free,
            RimMotion::Fixed => BoundaryMotion::Fixed,
        },
        cuts,
        triangles,
        kept,
    };
    let surface = DesignSurface::new(mesh, &setup).map_err(|error| fault(source, design, error))?;
    if surface.variable_count() == 0 {
        let fault = source
            .diagnostic("design", "no node of the design surface can move")
            .expected("a surface with nodes off its rim and off the planes that it must keep")
            .help("take rim = \"free\", or another surface or direction");
        return Err(source.error(vec![fault]).into());
    }
    Ok(surface)
}

/// Surfaces that stay where they are: with a condition, or listed in `remesh.slide`.
fn kept_surfaces(config: &Config) -> BTreeSet<&String> {
    let slide = config.remesh.iter().flat_map(|remesh| &remesh.slide);
    config.boundaries.surfaces().chain(slide).collect()
}

/// The triangles of the design surface, each once, on the mesh with all regions.
pub(crate) fn triangulation(design: &config::Design, mesh: &Mesh) -> Result<Triangulation, Error> {
    Ok(Triangulation::new(mesh, &triangles(design, mesh)?))
}

/// The planes of symmetry.
fn mirrors(design: &config::Design) -> Vec<Mirror> {
    design.symmetry.iter().map(|plane| Mirror { axis: plane.axis.index(), at: plane.at }).collect()
}

/// A surface that is symmetric in its nodes alone, as where the cells of a generator are all cut along the same diagonal.
pub(super) fn asymmetry_warning(
    design: &config::Design,
    mesh: &Mesh,
    surface: (&DesignSurface, &[[NodeId; 3]]),
) -> Option<String> {
    let count = edges_without_image(mesh, surface, &mirrors(design));
    (count > 0).then(|| {
        format!(
            "design.symmetry: {count} edges of the design surface have no mirror image that moves as they do. Between its nodes the \
             shape is symmetric up to its facets, and so are forces that should cancel. Half of the device, which ends in the plane, \
             has no such difference"
        )
    })
}

/// The triangles themselves.
pub(super) fn triangles(design: &config::Design, mesh: &Mesh) -> Result<Vec<[NodeId; 3]>, MeshError> {
    let mut own = BTreeSet::new();
    let mut triangles = Vec::new();
    for name in &design.surface {
        let surface = mesh.topology().surface(name)?;
        triangles.extend(surface.iter().copied().filter(|t| own.insert(face_key(*t))));
    }
    Ok(triangles)
}

/// The same surface on the mesh without the regions that impedance surfaces replace.
pub(super) fn on_remaining(
    source: &SourceMap,
    surface: &DesignSurface,
    full_mesh: &Mesh,
    mesh: &Mesh,
) -> Result<DesignSurface, Error> {
    let same = full_mesh.nodes_in(mesh);
    let nodes: Vec<NodeId> = surface.nodes().iter().filter_map(|n| same[n.index()]).collect();
    if nodes.len() == surface.nodes().len() {
        return Ok(surface.renumbered(nodes));
    }
    let message = format!(
        "{} of {} nodes of the design surface lie inside a region that its impedance surface replaces",
        surface.nodes().len() - nodes.len(),
        surface.nodes().len()
    );
    let fault = source
        .diagnostic("design.surface", message)
        .expected("a surface between such a region and a meshed one, or model = \"volume\"");
    Err(source.error(vec![fault]).into())
}

/// A triangle of a surface oriented out of the body; `None` where neither side is, or both are.
///
/// The body is the side with a `[regions]` entry; where that does not decide, the first region of a surface named
/// `first|second`. Behind an outer face of air lies a body that is not meshed.
pub(crate) fn out_of_body(
    config: &Config,
    topology: &Topology,
    name: &str,
    facet: Option<&Facet>,
) -> Option<[NodeId; 3]> {
    let facet = facet?;
    let region = |e: ElementId| topology.region_names()[topology.region_of()[e.index()].index()].as_str();
    let is_body = |e: ElementId| config.regions.contains_key(region(e));
    let [a, b, c] = facet.nodes;
    let (out_of_inside, out_of_outside) = ([a, b, c], [a, c, b]);
    match (is_body(facet.inside), facet.outside.map(|e| (e, is_body(e)))) {
        (true, None | Some((_, false))) => Some(out_of_inside),
        (false, None | Some((_, true))) => Some(out_of_outside),
        (_, Some((outside, _))) => {
            let first = name.split_once('|')?.0.trim();
            match (region(facet.inside) == first, region(outside) == first) {
                (true, false) => Some(out_of_inside),
                (false, true) => Some(out_of_outside),
                _ => None,
            }
        }
    }
}

fn unclear_side(source: &SourceMap, mesh: &Mesh, name: &str, triangle: [NodeId; 3]) -> Error {
    let place = fluxmorph_geometry::tet4::centroid(triangle.map(|n| mesh.point(n)));
    let message = format!(
        "which side of `{name}` is the body that the design thickens is not clear at {}",
        millimetres(place)
    );
    let fault = source.diagnostic("design.direction", message).expected(
        "a surface with a [regions] entry on one side and air on the other, or a direction of three numbers",
    );
    source.error(vec![fault]).into()
}

/// The fault at the key that the surface does not fit.
fn fault(source: &SourceMap, design: &config::Design, error: DesignError) -> Error {
    let names = design.surface.join("`, `");
    let fault = match error {
        DesignError::Empty => source.diagnostic("design.surface", format!("the surface `{names}` has no triangles")),
        DesignError::NoExtent { .. } => source
            .diagnostic("design.direction", format!("a control grid cannot be laid across `design.direction` on `{names}`"))
            .expected("the direction nearest to the normal of the surface, or no design.grid"),
        DesignError::Folded { point, axis } => source
            .diagnostic(
                "design.grid",
                format!("a control grid cannot be laid over `{names}`: at {} it turns back along {axis}", millimetres(point)),
            )
            .expected("a surface that is a height over two coordinates, or design.filter_radius instead of design.grid"),
        DesignError::NoPartner { what, point, axis, at, distance } => source
            .diagnostic(
                "design.symmetry",
                format!(
                    "the {what} at {} has no partner in the mirror {axis} = {:.3} mm: the nearest lies {:.3e} mm from its \
                     image",
                    millimetres(point),
                    at * 1e3,
                    distance * 1e3
                ),
            )
            .expected("a surface and a mesh that are symmetric about the plane")
            .help("check `at` and mesh.unit, mesh one half and mirror it, or leave the symmetry out"),
        DesignError::WideFilter { .. } => source
            .diagnostic("design.filter_radius", error.to_string())
            .help("take a smaller radius, or a coarser mesh on the surface"),
        // Of a mirror plane.
        _ => source.diagnostic("design.symmetry", error.to_string()),
    };
    source.error(vec![fault]).into()
}
