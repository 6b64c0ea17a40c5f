//! Whether the field can be measured at every point of the probes, before a run is spent on it, on which side of a face, and how near
//! to an edge at which it has no limit.

use std::collections::BTreeMap;

use fluxmorph_geometry::box_tree::{AxisBox, BoxTree};
use fluxmorph_geometry::curved::SMOOTH;
use fluxmorph_geometry::locate::{Located, holders, locate};
use fluxmorph_geometry::tet4::{Point, area_vector, dot, norm, volume};
use fluxmorph_geometry::{ElementId, Mesh, NodeId, RegionId, millimetres};

use super::entries::material;
use super::motion::distance_to_line;
use super::open;
use crate::config::{Config, Diagnostic, ElementOrder, Probe, SourceMap};

/// Every probe point outside the mesh, in a region that its surface replaces, or in the shell of open space.
pub(super) fn faults(config: &Config, source: &SourceMap, full_mesh: &Mesh, mesh: &Mesh) -> Vec<Diagnostic> {
    let shell = config.open.as_ref().and_then(|open| mesh.topology().region(open::region_of(open)).ok());
    let mut faults = Vec::new();
    for (i, probe) in config.probes.iter().enumerate() {
        for (j, found) in locate(mesh, &probe.points).into_iter().enumerate() {
            let is_replaced = || locate(full_mesh, &[probe.points[j]])[0].is_some();
            let (place, expected) = match found {
                Some((e, _)) if shell == Some(mesh.topology().region_of()[e.index()]) => (
                    "in the shell of open space",
                    "a point in the mesh inside the shell, whose places mean others far away".to_owned(),
                ),
                Some(_) => continue,
                None if is_replaced() => (
                    "in a region that its impedance surface replaces",
                    "a point in a region that is meshed".to_owned(),
                ),
                None => {
                    let [lower, upper] = full_mesh.bounding_box().map(millimetres);
                    let expected = format!("a point inside the mesh, which goes from {lower} to {upper}");
                    ("outside the mesh", expected)
                }
            };
            let at = millimetres(probe.points[j]);
            let message = format!("the point {at} of the probe `{}` lies {place}", probe.name);
            faults.push(source.diagnostic(&format!("probes[{i}].points[{j}]"), message).expected(expected));
        }
    }
    faults
}

/// Probes with points on faces across which B jumps: that of one side is measured there.
pub(super) fn warnings(config: &Config, mesh: &Mesh) -> Vec<String> {
    let regions = mesh.topology().region_names();
    let name = |region: RegionId| regions[region.index()].as_str();
    let points: Vec<Point> = config.probes.iter().flat_map(|probe| probe.points.iter().copied()).collect();
    // The first region at a point is that of the first element, whose field is taken.
    let mut around: Vec<Vec<RegionId>> = vec![Vec::new(); points.len()];
    for (i, (e, _)) in holders(mesh, &points) {
        around[i].push(mesh.topology().region_of()[e.index()]);
    }
    let mut around = around.iter();
    let mut warnings = edge_warnings(config, mesh);
    for probe in &config.probes {
        let mut between: BTreeMap<[&str; 2], Vec<usize>> = BTreeMap::new();
        for (j, regions) in around.by_ref().take(probe.points.len()).enumerate() {
            let Some(&first) = regions.first() else { continue };
            let taken = name(first);
            if let Some(other) = regions.iter().find(|&&other| flux_density_jumps(config, taken, name(other)))
            {
                between.entry([taken, name(*other)]).or_default().push(j);
            }
        }
        warnings.extend(between.into_iter().map(|([taken, other], points)| {
            let more = match points.len() - 1 {
                0 => String::new(),
                more => format!(", and {more} more of them,"),
            };
            format!(
                "the point {}{more} of the probe `{}` lies between `{taken}` and `{other}`, where B jumps: it is that in `{taken}`; move it \
                 to the side that is meant",
                millimetres(probe.points[points[0]]),
                probe.name
            )
        }));
    }
    warnings
}

/// Probes with points nearer to an edge of iron or of a magnet than the elements there can tell.
///
/// Towards an edge of 270° of air B grows with the distance d as d^(−1/3) (Jackson, Classical Electrodynamics, 2.11); recovered in
/// elements of size h it has what it has at h/2, in both orders that an estimate compares.
fn edge_warnings(config: &Config, mesh: &Mesh) -> Vec<String> {
    let edges = sharp_edges(config, mesh);
    let tree = BoxTree::new(edges.iter().map(AxisBox::around).collect());
    let order = if config.analysis.order == ElementOrder::Quadratic { 2.0 } else { 1.0 };
    let near = |(point, located): (&Point, Option<Located>)| {
        let (e, _) = located?;
        let size = (6.0 * volume(mesh.vertices(e))).cbrt() / order;
        let reach = 0.5 * size;
        let mut least = f64::INFINITY;
        tree.for_each(
            |around| around.square_distance(*point) < reach * reach,
            |k| least = least.min(distance_to_line(*point, edges[k])),
        );
        (least < reach).then_some((*point, least, size))
    };
    let warning = |probe: &Probe| {
        let all: Vec<_> = probe.points.iter().zip(locate(mesh, &probe.points)).filter_map(near).collect();
        let share = |&(_, distance, size): &(Point, f64, f64)| distance / size;
        let worst = all.iter().min_by(|a, b| share(a).total_cmp(&share(b)))?;
        let &(point, distance, size) = worst;
        let more = match all.len() - 1 {
            0 => String::new(),
            more => format!(", and {more} more of them less so,"),
        };
        // At the edge itself there is no number.
        let factor = (2.0 * distance / size).max(1e-3).powf(-1.0 / 3.0);
        Some(format!(
            "the point {}{more} of the probe `{}` is {:.3} mm from an edge of iron or of a magnet, in elements of {:.3} mm: B grows \
             without limit towards an edge, and is up to {factor:.1} times as large as what such elements have there, which no \
             error bar counts; take smaller elements, or a point farther away",
            millimetres(point),
            probe.name,
            1e3 * distance,
            1e3 * size * order
        ))
    };
    config.probes.iter().filter_map(warning).collect()
}

/// The edges at which faces across which B jumps meet at an angle, or more than two of them. Where one ends at the outside of the mesh
/// it is taken to go on there.
fn sharp_edges(config: &Config, mesh: &Mesh) -> Vec<[Point; 2]> {
    let topology = mesh.topology();
    let names = topology.region_names();
    let jumps: Vec<Vec<bool>> = names
        .iter()
        .map(|own| names.iter().map(|other| flux_density_jumps(config, own, other)).collect())
        .collect();
    let region = |e: ElementId| topology.region_of()[e.index()].index();
    let mut normals: BTreeMap<[NodeId; 2], Vec<Point>> = BTreeMap::new();
    for facet in topology.facets() {
        let Some([inside, outside]) = facet.outside.map(|outside| [facet.inside, outside].map(region)) else {
            continue;
        };
        if !jumps[inside][outside] {
            continue;
        }
        let [a, b, c] = facet.nodes;
        let out_of_the_first = if inside < outside { 1.0 } else { -1.0 };
        let area = area_vector(facet.nodes.map(|n| mesh.point(n)));
        let normal = area.map(|component| out_of_the_first * component / norm(area));
        for [m, n] in [[a, b], [b, c], [c, a]] {
            normals.entry([m.min(n), m.max(n)]).or_default().push(normal);
        }
    }
    let is_sharp = |normals: &[Point]| match normals {
        [_] => false,
        [first, second] => dot(*first, *second) < SMOOTH,
        _ => true,
    };
    normals.retain(|_, normals| is_sharp(normals));
    normals.into_keys().map(|edge| edge.map(|n| mesh.point(n))).collect()
}

/// Whether the part of B along a face jumps between two regions: permeabilities, curves or magnets differ.
fn flux_density_jumps(config: &Config, region: &str, other: &str) -> bool {
    let own = |region: &str| {
        let entry = config.regions.get(region);
        let curve = entry
            .map(|own| &own.material)
            .filter(|name| config.materials.get(*name).is_some_and(|m| m.saturates()));
        (material(config, region).relative_permeability, curve, entry.and_then(|own| own.remanence))
    };
    own(region) != own(other)
}
