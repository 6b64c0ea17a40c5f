//! What is wrong with a mesh although every element of it is sound: in words, with region, place and the usual cause.
//!
//! What `fluxmorph_geometry::soundness` finds is refused here, or told, at the key that it comes from.

use std::collections::{BTreeSet, HashSet};

use fluxmorph_geometry::directions::unit;
use fluxmorph_geometry::soundness::{
    Contact, Hull, Leaning, Meeting, OpenPatch, Situation, contacts, leaning_layers, open_patches,
    separate_parts,
};
use fluxmorph_geometry::tet4::{self, Point, area_vector, centroid, dot, norm, sub};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{Mesh, Millimetres, NodeId, RegionId, Topology, millimetres};

use super::entries::material;
use super::open;
use crate::config::{self, Config, Diagnostic, MeshConfig, SourceMap};

/// Sizes of a mesh file beyond which its unit is doubted [m]: a speck, and a house.
const USUAL: [f64; 2] = [1e-3, 30.0];

/// Share of the size of a mesh by which a node may be off a plane: rounding of coordinates and of the motion.
const PLANE: f64 = 1e-9;

/// Differences of unit normals, and of distances as shares of that size, of planes that are looked at once: those of small facets have
/// more rounding.
const SAME: f64 = 1e-7;

/// Cosine of the angle (45 degrees) between normals of neighbouring outer faces below which an edge is between them.
const ROUND: f64 = std::f64::consts::FRAC_1_SQRT_2 + 1e-6;

/// Share of a mesh that is air in devices with air around them.
const MOSTLY: f64 = 0.75;

/// Most places of one kind that are listed.
const MOST_LISTED: usize = 6;

/// What to do with volumes that share no nodes.
const FRAGMENTS: &str = "usual cause: the volumes were not cut with each other before they were meshed (in Gmsh `BooleanFragments` or \
                         `Coherence`), or files were put together and doubled nodes not merged (`Coherence Mesh`)";

/// What is known of a mesh's outside.
#[derive(Debug, Default)]
pub(super) struct Outside {
    /// Outer faces without condition, where that may be meant.
    pub(super) open: Vec<OpenPatch>,
    /// What is rarely meant.
    pub(super) warnings: Vec<String>,
}

/// Parts of a mesh file that overlap, or touch without common nodes.
pub(super) fn contact_faults(config: &Config, source: &SourceMap, mesh: &Mesh) -> Vec<Diagnostic> {
    if !matches!(config.mesh, MeshConfig::File { .. }) {
        return Vec::new();
    }
    let hull = Hull::new(mesh);
    let found = contacts(&hull, &with_condition(config, &hull));
    found.iter().take(MOST_LISTED).map(|contact| contact_fault(source, mesh, contact)).collect()
}

/// Holes, walls and parts that no condition of a field problem reaches, and the sides where none is given.
///
/// # Errors
/// Those of which it cannot be said that they are meant: holes, and faces of no named surface.
pub(super) fn outside(config: &Config, source: &SourceMap, mesh: &Mesh) -> Result<Outside, Vec<Diagnostic>> {
    let hull = Hull::new(mesh);
    let patches = open_patches(&hull, &with_condition(config, &hull));
    let named = faces_of(mesh.topology(), mesh.topology().surface_names());
    let is_named =
        |patch: &OpenPatch| patch.faces.iter().all(|&f| named.contains(&face_key(hull.faces()[f].nodes)));
    let (mut outside, mut faults) = (Outside::default(), parts_fault(source, mesh));
    // Faces of a region that its surface replaces are no faces of the field.
    let is_meshed =
        |face: &usize| config.is_meshed(mesh.topology().region_name_at(hull.faces()[*face].inside));
    for patch in patches.into_iter().filter(|patch| patch.faces.iter().any(is_meshed)) {
        let text = patch_text(&hull, &patch);
        match patch.situation {
            Situation::Side => outside.open.push(patch),
            Situation::Inward | Situation::BesideCondition if is_named(&patch) => {
                outside.warnings.push(format!("{text}: the field is left normal to it, as in flux_normal"));
                outside.open.push(patch);
            }
            _ => faults.push(patch_fault(source, &patch, text)),
        }
    }
    faults.truncate(MOST_LISTED);
    if faults.is_empty() { Ok(outside) } else { Err(faults) }
}

/// Layers under the design surfaces of a mesh file that lean.
pub(super) fn layer_warnings(config: &Config, mesh: &Mesh) -> Vec<String> {
    let is_file = matches!(config.mesh, MeshConfig::File { .. });
    let surfaces = config.design.iter().flat_map(|design| &design.surface).filter(|_| is_file);
    surfaces.filter_map(|surface| layer_warning(mesh, surface)).collect()
}

fn layer_warning(mesh: &Mesh, surface: &str) -> Option<String> {
    let Leaning { share, lean, height, place } =
        leaning_layers(mesh, mesh.topology().surface(surface).ok()?)?;
    Some(format!(
        "the layers of elements beside `{surface}` lean on {:.0} % of it: at {} by {:.3} mm over a height of {:.3} mm. A design \
         that moves this surface shears them; mesh both ends of an extrusion alike, node above node",
        100.0 * share,
        millimetres(place),
        Millimetres(lean),
        Millimetres(height)
    ))
}

/// A mesh file of an unusual size.
pub(super) fn unit_warning(config: &Config, mesh: &Mesh) -> Option<String> {
    let MeshConfig::File { unit, .. } = &config.mesh else { return None };
    let (size, [least, most]) = (size(mesh), USUAL);
    (size < least || size > most).then(|| {
        format!(
            "the mesh is {size:.4e} m from corner to corner: check mesh.unit, which is \"{}\"",
            unit.name()
        )
    })
}

/// From corner to corner of a mesh [m].
pub(super) fn size(mesh: &Mesh) -> f64 {
    let [low, high] = mesh.bounding_box();
    norm(sub(high, low))
}

/// Lengths of the design beyond the size of the mesh.
pub(super) fn length_warnings(config: &Config, mesh: &Mesh) -> Vec<String> {
    let Some(design) = &config.design else { return Vec::new() };
    let size = size(mesh);
    let lengths = [
        ("lower", Some(-design.lower)),
        ("upper", Some(design.upper)),
        ("filter_radius", design.filter_radius),
    ];
    let warning = |(key, length): (&str, Option<f64>)| {
        let length = length.filter(|length| *length > size)?;
        Some(format!(
            "design.{key} is {length} m, more than the whole mesh ({size:.4} m): a number without unit is in metres"
        ))
    };
    lengths.into_iter().filter_map(warning).collect()
}

/// Iron or a conductor where air is expected.
pub(super) fn swap_warning(config: &Config, mesh: &Mesh) -> Option<String> {
    let MeshConfig::File { .. } = &config.mesh else { return None };
    let topology = mesh.topology();
    let mut volumes = vec![0.0; topology.region_names().len()];
    for element in topology.elements() {
        volumes[topology.region_of()[element.index()].index()] += tet4::volume(mesh.vertices(element));
    }
    let whole: f64 = volumes.iter().sum();
    let (name, volume) =
        topology.region_names().iter().zip(volumes).max_by(|(_, a), (_, b)| a.total_cmp(b))?;
    let written = config.regions.get(name).and_then(|region| config.materials.get(&region.material));
    let own = material(config, name);
    let is_matter = own.relative_permeability != 1.0
        || own.conductivity > 0.0
        || written.is_some_and(config::Material::saturates);
    (is_matter && volume > MOSTLY * whole).then(|| {
        format!(
            "the region `{name}`, which is iron or conducts, fills {:.0} % of the mesh: are the groups of two regions swapped?",
            100.0 * volume / whole
        )
    })
}

/// The outer faces of a mesh that carry no condition.
pub(super) fn faces_without_condition(config: &Config, mesh: &Mesh) -> HashSet<[NodeId; 3]> {
    let hull = Hull::new(mesh);
    let faces = hull.faces().iter().zip(with_condition(config, &hull));
    faces.filter(|(_, has_condition)| !has_condition).map(|(facet, _)| face_key(facet.nodes)).collect()
}

/// For every face of a hull whether [boundaries] names a surface that it belongs to.
fn with_condition(config: &Config, hull: &Hull<'_>) -> Vec<bool> {
    let infinity = open::condition(config).map(|(name, _)| name);
    let surfaces = config.boundaries.surfaces().chain(&infinity).map(String::as_str);
    let faces = faces_of(hull.mesh().topology(), surfaces);
    hull.faces().iter().map(|facet| faces.contains(&face_key(facet.nodes))).collect()
}

/// The faces of surfaces; of a name that the mesh does not have none.
pub(super) fn faces_of<'a>(
    topology: &Topology,
    names: impl IntoIterator<Item = &'a str>,
) -> HashSet<[NodeId; 3]> {
    let surfaces = names.into_iter().filter_map(|name| topology.surface(name).ok());
    surfaces.flatten().map(|nodes| face_key(*nodes)).collect()
}

/// The unit normal of a face.
pub(super) fn normal(mesh: &Mesh, face: [NodeId; 3]) -> Point {
    unit(area_vector(face.map(|node| mesh.point(node))))
}

/// A design that moves a wall of a body which is no part of the mesh, or is replaced by its surface, through another wall of it or through
/// a flat side of the mesh, behind which its mirror image may lie: elements do not notice. The meshes are those that are solved on, before
/// and after.
pub(crate) fn overlap_warning(
    config: &Config,
    full_mesh: &Mesh,
    [original, moved]: [&Mesh; 2],
) -> Option<String> {
    let solved = full_mesh.nodes_in(original);
    let of_full = faces_of(full_mesh.topology(), config.design.as_ref()?.surface.iter().map(String::as_str));
    let on_solved = |face: [NodeId; 3]| {
        let [a, b, c] = face.map(|n| solved[n.index()]);
        Some(face_key([a?, b?, c?]))
    };
    let designed: HashSet<[NodeId; 3]> = of_full.into_iter().filter_map(on_solved).collect();
    let is_wall = |face: &[NodeId; 3]| designed.contains(&face_key(*face));
    let hull = Hull::new(original);
    let (walls, others): (Vec<[NodeId; 3]>, Vec<_>) =
        hull.faces().iter().map(|facet| facet.nodes).partition(is_wall);
    if walls.is_empty() {
        return None;
    }
    // What overlaps from the beginning is not the design's.
    let overlap = overlap(moved).filter(|_| overlap(original).is_none());
    let what = match overlap {
        Some(place) => format!(
            "the design surface has passed through another wall at {}, and the mesh overlaps itself: nothing is left there of the body \
             between them, and no number of this design means anything",
            millimetres(place)
        ),
        None => format!(
            "the design surface has passed beyond a flat side of the mesh at {}: where that is a plane of symmetry, the mesh overlaps its \
             mirror image, nothing is left there of the body between them, and no number of this design means anything",
            millimetres(beyond_a_side([original, moved], [&walls, &others])?)
        ),
    };
    Some(format!(
        "{what}; take bounds that leave some of it, or mesh the body as a region, with model = \"perfect\" or \"impedance\", of which \
         bounds are checked where it has a thickness along the design's direction"
    ))
}

/// A place at which a mesh overlaps itself.
fn overlap(mesh: &Mesh) -> Option<Point> {
    let hull = Hull::new(mesh);
    let found = contacts(&hull, &vec![false; hull.faces().len()]);
    found.iter().find(|contact| contact.meeting == Meeting::Overlapping).map(|contact| contact.place)
}

/// Where walls have gone beyond a flat side: one that has all of the mesh before it and none of these walls in it, stays where it is, and
/// ends at edges: facets of a round outside are none. The faces are the outer ones, walls and others.
fn beyond_a_side([original, moved]: [&Mesh; 2], [walls, others]: [&[[NodeId; 3]]; 2]) -> Option<Point> {
    let (size, topology) = (size(original), original.topology());
    let rounding = PLANE * size;
    let of_walls: BTreeSet<NodeId> = walls.iter().flatten().copied().collect();
    let mut seen = HashSet::new();
    others.iter().find_map(|&face| {
        let outwards = normal(original, face);
        let at = dot(outwards, original.point(face[0]));
        let [x, y, z] = outwards;
        seen.insert([x, y, z, at / size].map(|c| (c / SAME).round() as i64)).then_some(())?;
        let height = |mesh: &Mesh, n: NodeId| dot(outwards, mesh.point(n)) - at;
        let beyond = |n: &NodeId| height(moved, *n) > rounding && height(original, *n) < -rounding;
        let passed = *of_walls.iter().find(|n| beyond(n))?;
        let is_in_it = |n: NodeId| height(original, n).abs() <= rounding;
        let stays = |n: NodeId| of_walls.contains(&n) || !is_in_it(n) || height(moved, n).abs() <= rounding;
        let is_side = topology.nodes().all(|n| height(original, n) <= rounding && stays(n));
        let lies_in_it = |face: &[NodeId; 3]| face.iter().all(|n| is_in_it(*n));
        let goes_on = |face: &[NodeId; 3]| {
            let shares_an_edge = face.iter().filter(|n| is_in_it(**n)).count() == 2;
            shares_an_edge && dot(normal(original, *face), outwards) > ROUND
        };
        let ends = !walls.iter().chain(others).any(goes_on);
        (is_side && ends && !walls.iter().any(lies_in_it)).then(|| moved.point(passed))
    })
}

fn contact_fault(source: &SourceMap, mesh: &Mesh, contact: &Contact) -> Diagnostic {
    let name = |region: RegionId| mesh.topology().region_names()[region.index()].clone();
    let [a, b] = contact.regions.map(name);
    let who = match (contact.meeting, a == b) {
        (Meeting::Touching, true) => {
            format!("the region `{a}` is cut: its two sides touch without common nodes")
        }
        (Meeting::Touching, false) => format!("the regions `{a}` and `{b}` touch without common nodes"),
        (Meeting::Overlapping, true) => format!("the region `{a}` overlaps itself"),
        (Meeting::Overlapping, false) => format!("the regions `{a}` and `{b}` overlap"),
    };
    let how_much = match contact {
        Contact { faces: 0, nodes, doubled, .. } => format!("{nodes} nodes, {doubled} of them doubled"),
        Contact { faces, area, .. } => format!("{} of {:.4} cm²", count_of_faces(*faces), area * 1e4),
    };
    let message = format!("{who}, at {} and elsewhere: {how_much}", millimetres(contact.place));
    source
        .diagnostic("mesh.file", message)
        .expected("regions that share the nodes between them: nothing passes from one to the other else")
        .help(FRAGMENTS)
}

fn parts_fault(source: &SourceMap, mesh: &Mesh) -> Vec<Diagnostic> {
    let parts = separate_parts(mesh);
    if parts.len() < 2 {
        return Vec::new();
    }
    let names: BTreeSet<String> = parts
        .iter()
        .take(MOST_LISTED)
        .map(|part| {
            let names = part.regions.iter().map(|region| &*mesh.topology().region_names()[region.index()]);
            let names = names.collect::<Vec<_>>().join("`, `");
            format!("`{names}` at {}", millimetres(centroid(mesh.vertices(part.first))))
        })
        .collect();
    let list = names.into_iter().collect::<Vec<_>>().join("; ");
    let message = format!("the mesh falls into {} parts that share no node: {list}", parts.len());
    vec![
        source
            .diagnostic("mesh", message)
            .expected("one mesh, air between the bodies included")
            .help(FRAGMENTS),
    ]
}

fn count_of_faces(count: usize) -> String {
    if count == 1 { "1 face".to_owned() } else { format!("{count} faces") }
}

/// What a patch is, where and how large.
fn patch_text(hull: &Hull<'_>, patch: &OpenPatch) -> String {
    let region_at = |&face: &usize| hull.mesh().topology().region_name_at(hull.faces()[face].inside);
    let regions: BTreeSet<&str> = patch.faces.iter().map(region_at).collect();
    let regions = regions.into_iter().collect::<Vec<_>>().join("`, `");
    let what = match patch.situation {
        Situation::Side => "an outer side",
        Situation::Inward => "a wall that stands into the mesh",
        Situation::BesideCondition => "a part of a side whose rest has a condition",
        Situation::Hole => "the wall of a hole",
    };
    format!(
        "{what} has no condition in [boundaries]: {} of `{regions}`, {:.4} cm², at {}",
        count_of_faces(patch.faces.len()),
        patch.area * 1e4,
        millimetres(patch.place)
    )
}

fn patch_fault(source: &SourceMap, patch: &OpenPatch, text: String) -> Diagnostic {
    let (expected, help) = match patch.situation {
        Situation::Hole => (
            "a mesh without holes, or a condition on their walls",
            "usual cause: a volume that was not meshed or belongs to no physical group, or elements that were lost; for a body \
             left out on purpose, put its wall into a physical surface and name it in flux_parallel or flux_normal",
        ),
        _ => (
            "the whole side in the surface that has the condition, or its rest in another",
            "usual cause: triangles that are missing from the physical surface, or a volume that is missing from the mesh; where \
             it is meant, put these faces into a physical surface, and name it in flux_parallel or flux_normal",
        ),
    };
    source.diagnostic("boundaries", text).expected(expected).help(help)
}

#[cfg(test)]
mod tests {
    use fluxmorph_geometry::generate::{SphereParameters, sphere};

    use super::*;
    use crate::build::build_mesh;

    /// What is said of a plate of 10 mm from this height upwards that is left out of the mesh, and of which a face is moved.
    fn said(plate: f64, face: f64, motion: f64) -> Option<String> {
        let top = plate + 0.01;
        let text = format!(
            "[mesh]\ngenerator = \"boxes\"\n[mesh.boxes]\nbox = [[0, 0, 0], [0.03, 0.03, 0.05]]\n\
             [[mesh.boxes.regions]]\nname = \"plate\"\nbox = [[0, 0, {plate}], [0.02, 0.02, {top}]]\ncells = [2, 2, 1]\n\
             [[mesh.boxes.surfaces]]\nname = \"face\"\nbox = [[0, 0, {face}], [0.02, 0.02, {face}]]\n\
             [analysis]\nfrequency = 0\n[design]\nsurface = \"face\"\ndirection = [0, 0, 1]\nlower = 0\nupper = 0.02\n\
             [remesh]\nregion = \"air\"\n[objective]\nkind = \"energy\"\n"
        );
        let (config, source) = Config::from_str(&text, "device.toml").expect("sound");
        let whole = build_mesh(&config, &source).expect("a mesh");
        let region = whole.topology().region("plate").expect("a region");
        let (mesh, _) = whole.without_region(region).expect("air is left");
        let place = |&[x, y, z]: &[f64; 3]| {
            let is_of_face = (z - face).abs() < 1e-9 && x < 0.019 && y < 0.019;
            [x, y, if is_of_face { z + motion } else { z }]
        };
        let points = mesh.points().iter().map(place).collect();
        let moved = Mesh::new(mesh.topology().clone(), points).expect("sound");
        // Of the mesh with the plate as well, where its surface replaces it.
        let [left_out, replaced] =
            [&mesh, &whole].map(|full| overlap_warning(&config, full, [&mesh, &moved]));
        assert_eq!(left_out, replaced);
        left_out
    }

    #[test]
    fn a_wall_that_passes_through_another_one_or_a_side_is_named() {
        for (plate, face, motion, expected) in [
            (0.02, 0.02, 0.008, None),
            (0.02, 0.02, 0.012, Some("has passed through another wall at")),
            (0.0, 0.01, -0.008, None),
            (
                0.0,
                0.01,
                -0.012,
                Some("has passed beyond a flat side of the mesh at (0.000, 0.000, -2.000) mm"),
            ),
        ] {
            let found = said(plate, face, motion);
            let is_expected = |text: &str| expected.is_some_and(|own| text.contains(own));
            assert!(found.as_deref().map_or(expected.is_none(), is_expected), "{face} {motion}: {found:?}");
        }
    }

    /// A cap of the outside of an octant of a ball that bulges: it is beyond the planes of the facets around it, and of no side.
    #[test]
    fn facets_of_a_round_outside_are_no_sides() {
        let parameters = SphereParameters { divisions: 4, ..SphereParameters::default() };
        let mesh = sphere(&parameters).expect("defaults are valid");
        let is_of_cap = |n: &NodeId| {
            let x = mesh.point(*n);
            norm(x) > 0.999 * parameters.outer_radius && x[2] > 0.6 * parameters.outer_radius
        };
        let hull = Hull::new(&mesh);
        let outer = hull.faces().iter().map(|facet| facet.nodes);
        let (walls, others): (Vec<_>, Vec<_>) = outer.partition(|face| face.iter().all(is_of_cap));
        let bulged = |n: NodeId| mesh.point(n).map(|c| if is_of_cap(&n) { 1.1 * c } else { c });
        let points = mesh.topology().nodes().map(bulged).collect();
        let moved = Mesh::new(mesh.topology().clone(), points).expect("sound");
        assert!(walls.len() > 4);
        assert_eq!(beyond_a_side([&mesh, &moved], [&walls, &others]), None);
    }
}
