//! Parts of a mesh that overlap, or that touch without common nodes.
//!
//! In a sound mesh no outer face has an element before it, or two behind it, and no outer node lies in an element that it does not belong to.

use std::collections::{BTreeMap, BTreeSet};

use super::hull::Hull;
use crate::ids::{ElementId, NodeId, RegionId};
use crate::locate::holders;
use crate::tet4::{Point, add, centroid, norm, sub};

/// How far before an outer face another element is looked for, as a share of the square root of its area: coordinates in
/// files have six digits or more, and no gap that is meshed around is a thousandth of the triangles at it.
const BEFORE: f64 = 1e-3;

/// Barycentric coordinates above which a point lies inside an element and not on a face that it shares: rounding.
const INSIDE: f64 = 1e-6;

/// Nodes nearer than this share of the edges at them are one node twice: the same reasons.
const SAME: f64 = 1e-4;

/// How two parts of a mesh meet that share no nodes there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Meeting {
    /// They touch.
    Touching,
    /// They fill the same space.
    Overlapping,
}

/// Where two parts of a mesh meet without common nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct Contact {
    /// How they meet.
    pub meeting: Meeting,
    /// The regions on both sides, by number; twice the same one where a region is cut.
    pub regions: [RegionId; 2],
    /// Outer faces, of either side, that meet the other; zero where only edges or corners do.
    pub faces: usize,
    /// Their area [m²].
    pub area: f64,
    /// Outer nodes that lie in the other part.
    pub nodes: usize,
    /// Of those, nodes at the place of another one.
    pub doubled: usize,
    /// The middle of the largest face, or a node [m].
    pub place: Point,
}

/// All contacts, by regions; overlapping ones for themselves.
///
/// `has_condition` says of every face of the hull whether it carries a boundary condition: two such faces may touch, as the
/// two sides of a sheet.
///
/// # Panics
/// If `has_condition` has not one entry a face.
pub fn contacts(hull: &Hull<'_>, has_condition: &[bool]) -> Vec<Contact> {
    assert_eq!(has_condition.len(), hull.faces().len(), "one entry a face");
    let mut found = BTreeMap::new();
    at_faces(hull, has_condition, &mut found);
    at_nodes(hull, has_condition, &mut found);
    found.into_values().collect()
}

/// What is found so far, by kind and regions.
type Found = BTreeMap<(Meeting, [RegionId; 2]), Contact>;

/// The entry of two regions.
fn entry(found: &mut Found, meeting: Meeting, regions: [RegionId; 2], place: Point) -> &mut Contact {
    let [a, b] = regions;
    let regions = if a <= b { [a, b] } else { [b, a] };
    let none = Contact { meeting, regions, faces: 0, area: 0.0, nodes: 0, doubled: 0, place };
    found.entry((meeting, regions)).or_insert(none)
}

/// Elements before outer faces, and elements behind them beside their own.
fn at_faces(hull: &Hull<'_>, has_condition: &[bool], found: &mut Found) {
    let shifted = |face: usize, sign: f64| {
        let step = sign * BEFORE * hull.area(face).sqrt();
        add(centroid(hull.corners(face)), hull.normal(face).map(|n| step * n))
    };
    let [before, behind] = [1.0, -1.0].map(|sign| {
        let points: Vec<Point> = (0..hull.faces().len()).map(|face| shifted(face, sign)).collect();
        holders(hull.mesh(), &points)
    });
    let mut met: BTreeMap<usize, (Meeting, ElementId)> = BTreeMap::new();
    for (face, (element, _)) in before {
        met.entry(face).or_insert((Meeting::Touching, element));
    }
    let mut covers: BTreeMap<usize, Vec<ElementId>> = BTreeMap::new();
    for (face, (element, coordinates)) in behind {
        if coordinates.iter().all(|&c| c > INSIDE) {
            covers.entry(face).or_default().push(element);
        }
    }
    for (face, elements) in covers.into_iter().filter(|(_, elements)| elements.len() > 1) {
        let other = elements.into_iter().find(|e| *e != hull.faces()[face].inside);
        met.insert(face, (Meeting::Overlapping, other.expect("one of two is another")));
    }
    let region_of = hull.mesh().topology().region_of();
    let conditioned: BTreeSet<ElementId> =
        hull.faces().iter().zip(has_condition).filter(|(_, own)| **own).map(|(f, _)| f.inside).collect();
    let mut largest = BTreeMap::new();
    for (face, (meeting, other)) in met {
        let is_sheet = has_condition[face] && conditioned.contains(&other);
        if is_sheet && meeting == Meeting::Touching {
            continue;
        }
        let regions = [hull.faces()[face].inside, other].map(|e| region_of[e.index()]);
        let contact = entry(found, meeting, regions, centroid(hull.corners(face)));
        let area = hull.area(face);
        contact.faces += 1;
        contact.area += area;
        let most = largest.entry((meeting, contact.regions)).or_insert(0.0);
        if area > *most {
            (*most, contact.place) = (area, centroid(hull.corners(face)));
        }
    }
}

/// Outer nodes in elements that they do not belong to.
fn at_nodes(hull: &Hull<'_>, has_condition: &[bool], found: &mut Found) {
    let (mesh, topology) = (hull.mesh(), hull.mesh().topology());
    let conditioned: BTreeSet<NodeId> =
        hull.faces().iter().zip(has_condition).filter(|(_, own)| **own).flat_map(|(f, _)| f.nodes).collect();
    let mut nodes: Vec<NodeId> = hull.faces().iter().flat_map(|f| f.nodes).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let places: Vec<Point> = nodes.iter().map(|&n| mesh.point(n)).collect();
    let mut met: Vec<(usize, ElementId)> = holders(mesh, &places)
        .into_iter()
        .map(|(i, (element, _))| (i, element))
        .filter(|&(i, element)| !topology.tet(element).contains(&nodes[i]))
        .collect();
    met.sort_unstable();
    met.dedup_by_key(|(i, _)| *i);
    for (i, element) in met {
        let vertices = mesh.vertices(element);
        let near = |x: &Point| norm(sub(*x, places[i]));
        let longest = vertices.iter().map(near).fold(0.0, f64::max);
        let is_doubled = vertices.iter().any(|x| near(x) <= SAME * longest);
        if is_doubled && conditioned.contains(&nodes[i]) {
            continue;
        }
        let own = topology.elements_around(nodes[i])[0];
        let regions = [own, element].map(|e| topology.region_of()[e.index()]);
        let kinds = [Meeting::Overlapping, Meeting::Touching];
        let key = if regions[0] <= regions[1] { regions } else { [regions[1], regions[0]] };
        let known = kinds.into_iter().find(|&kind| found.contains_key(&(kind, key)));
        let meeting = known.unwrap_or(if is_doubled { Meeting::Touching } else { Meeting::Overlapping });
        let contact = entry(found, meeting, regions, places[i]);
        contact.nodes += 1;
        contact.doubled += usize::from(is_doubled);
    }
}
