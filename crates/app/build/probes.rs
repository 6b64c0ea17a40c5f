//! Whether the field can be measured at every point of the probes, before a run is spent on it, on which side of a face, and how near
//! to an edge at which it has no limit.

use std::collections::BTreeMap;

use fluxmorph_geometry::box_tree::{AxisBox, BoxTree};
use fluxmorph_geometry::curved::SMOOTH;
use fluxmorph_geometry::depth::nearest_on_triangle;
use fluxmorph_geometry::locate::{holders, locate};
use fluxmorph_geometry::tet4::{Point, dot, volume};
use fluxmorph_geometry::topology::triangle_edges;
use fluxmorph_geometry::{ElementId, Mesh, Millimetres, NodeId, millimetres};

use super::entries::material;
use super::open;
use super::soundness::normal;
use crate::config::{Config, Diagnostic, ElementOrder, Probe, SourceMap};

/// Every probe point outside the mesh that is solved on, in a region that its surface replaces, or in the shell of open space.
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
                None if is_replaced() => {
                    ("in a region that its surface replaces", "a point in a region that is meshed".to_owned())
                }
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

/// Probes with points on faces across which B jumps, where that of one side is measured, and beside edges; both meshes as in
/// [`faults`].
pub(super) fn warnings(config: &Config, full_mesh: &Mesh, mesh: &Mesh) -> Vec<String> {
    if config.probes.is_empty() {
        return Vec::new();
    }
    let points: Vec<Point> = config.probes.iter().flat_map(|probe| probe.points.iter().copied()).collect();
    // By ascending element: the field is taken in the first one.
    let mut around: Vec<Vec<ElementId>> = vec![Vec::new(); points.len()];
    for (i, (e, _)) in holders(mesh, &points) {
        around[i].push(e);
    }
    let mut around = &around[..];
    let edges = Edges::of(config, full_mesh, mesh);
    let mut warnings = Vec::new();
    for probe in &config.probes {
        let (own, others) = around.split_at(probe.points.len());
        around = others;
        warnings.extend(edges.warning(probe, own));
        warnings.extend(face_warnings(config, mesh, probe, own));
    }
    warnings
}

/// Points of a probe on faces across which B jumps; `around` has the elements at each.
fn face_warnings(config: &Config, mesh: &Mesh, probe: &Probe, around: &[Vec<ElementId>]) -> Vec<String> {
    let topology = mesh.topology();
    let name = |e: ElementId| topology.region_names()[topology.region_of()[e.index()].index()].as_str();
    let mut between: BTreeMap<[&str; 2], Vec<usize>> = BTreeMap::new();
    for (j, elements) in around.iter().enumerate() {
        let Some(taken) = elements.first().map(|&e| name(e)) else { continue };
        let other = elements.iter().map(|&e| name(e)).find(|other| flux_density_jumps(config, taken, other));
        if let Some(other) = other {
            between.entry([taken, other]).or_default().push(j);
        }
    }
    let warning = |([taken, other], points): ([&str; 2], Vec<usize>)| {
        format!(
            "the point {}{} of the probe `{}` lies between `{taken}` and `{other}`, where B jumps: it is that in `{taken}`; move it \
             to the side that is meant",
            millimetres(probe.points[points[0]]),
            and_more(points.len(), ""),
            probe.name
        )
    };
    between.into_iter().map(warning).collect()
}

/// Behind the first of so many points: that there are others.
fn and_more(count: usize, how: &str) -> String {
    match count - 1 {
        0 => String::new(),
        more => format!(", and {more} more of them{how},"),
    }
}

/// Edges of iron, of magnets and of conductors that their surfaces replace.
///
/// Towards an edge of 270° of air B grows with the distance d as d^(−1/3) (Jackson, Classical Electrodynamics, 2.11); recovered in
/// elements of size h it has about what it has at 0.6 h, in both orders that an estimate compares: beside a cube of iron in a
/// uniform field B is 1.56, 1.29, 1.19 and 1.13 times as large at 0.08, 0.25, 0.34 and 0.42 h, on a mesh of a quarter of the size.
struct Edges<'a> {
    /// Without what is replaced.
    mesh: &'a Mesh,
    ends: Vec<[Point; 2]>,
    tree: BoxTree,
    /// Elements of this order have the field of so many along each axis.
    order: f64,
}

impl<'a> Edges<'a> {
    fn of(config: &Config, full_mesh: &Mesh, mesh: &'a Mesh) -> Self {
        let ends = sharp_edges(config, full_mesh);
        let tree = BoxTree::new(ends.iter().map(AxisBox::around).collect());
        let order = if config.analysis.order == ElementOrder::Quadratic { 2.0 } else { 1.0 };
        Self { mesh, ends, tree, order }
    }

    /// The distance of a point in an element from an edge, in sizes of the element, and that size; `None` where the element can tell
    /// the two apart.
    fn near(&self, point: Point, element: ElementId) -> Option<(f64, f64)> {
        let size = (6.0 * volume(self.mesh.vertices(element))).cbrt() / self.order;
        let reach = 0.5 * size;
        let mut least = f64::INFINITY;
        self.tree.for_each(
            |around| around.square_distance(point) < reach * reach,
            |k| {
                let [a, b] = self.ends[k];
                least = least.min(nearest_on_triangle(point, &[a, b, b]).1);
            },
        );
        (least < reach).then_some((least / size, size))
    }

    /// What to say of a probe with points nearer to an edge than the elements there can tell.
    fn warning(&self, probe: &Probe, around: &[Vec<ElementId>]) -> Option<String> {
        let near = |(point, elements): (&Point, &Vec<ElementId>)| {
            Some((*point, self.near(*point, *elements.first()?)?))
        };
        let all: Vec<_> = probe.points.iter().zip(around).filter_map(near).collect();
        let &(point, (share, size)) = all.iter().min_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
        // At the edge itself there is no number.
        let factor = (share / 0.6).max(1e-3).powf(-1.0 / 3.0);
        Some(format!(
            "the point {}{} of the probe `{}` is {:.3} mm from an edge of iron, of a magnet or of a replaced conductor, in elements of \
             {:.3} mm: B grows without limit towards an edge, and is up to {factor:.1} times as large as what such elements have \
             there, which no error bar counts; take smaller elements, or a point farther away",
            millimetres(point),
            and_more(all.len(), " less so"),
            probe.name,
            Millimetres(share * size),
            Millimetres(size * self.order)
        ))
    }
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
        let out_of_the_first = if inside < outside { 1.0 } else { -1.0 };
        let normal = normal(mesh, facet.nodes).map(|component| out_of_the_first * component);
        for edge in triangle_edges(facet.nodes) {
            normals.entry(edge).or_default().push(normal);
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

/// Whether the part of B along a face jumps between two regions: permeabilities, curves or magnets differ, or one alone is replaced by
/// its surface.
fn flux_density_jumps(config: &Config, region: &str, other: &str) -> bool {
    let own = |region: &str| {
        if !config.is_meshed(region) {
            return None;
        }
        let entry = config.regions.get(region);
        let curve = entry
            .map(|own| &own.material)
            .filter(|name| config.materials.get(*name).is_some_and(|m| m.saturates()));
        Some((material(config, region).relative_permeability, curve, entry.and_then(|own| own.remanence)))
    };
    own(region) != own(other)
}
