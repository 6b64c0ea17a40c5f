//! Outer faces without a boundary condition, patch by patch, and where such a patch lies.

use super::hull::{Hull, Ridge};
use crate::disjoint_sets::DisjointSets;
use crate::ids::RegionId;
use crate::tet4::{Point, centroid, dot, norm, sub};

/// Sine of the angle by which two faces of one smooth side may be turned: 20°, a circle of eighteen facets.
const SMOOTH: f64 = 0.342;

/// Where a patch without condition lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Situation {
    /// A side of the mesh of its own, as a plane of symmetry.
    Side,
    /// It stands into the mesh, as the wall of a body that is left out.
    Inward,
    /// It continues a side that carries a condition.
    BesideCondition,
    /// It is the wall of a hole.
    Hole,
}

/// Outer faces without condition that follow each other smoothly, or make the wall of one hole.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenPatch {
    /// Where it lies.
    pub situation: Situation,
    /// Places of its faces in [`Hull::faces`], ascending.
    pub faces: Vec<usize>,
    /// Area [m²].
    pub area: f64,
    /// Area vector [m²], out of the mesh.
    pub area_vector: Point,
    /// Middle of its largest face [m].
    pub place: Point,
    /// The region behind that.
    pub region: RegionId,
}

/// Patches of outer faces without condition, in the order of their first faces.
///
/// # Panics
/// If `has_condition` has not one entry a face.
pub fn open_patches(hull: &Hull<'_>, has_condition: &[bool]) -> Vec<OpenPatch> {
    assert_eq!(has_condition.len(), hull.faces().len(), "one entry a face");
    if has_condition.iter().all(|condition| *condition) {
        return Vec::new();
    }
    let mut situations: Vec<Situation> = hull
        .walls_of_holes()
        .into_iter()
        .map(|is_wall| if is_wall { Situation::Hole } else { Situation::Side })
        .collect();
    let mut sides = DisjointSets::new(hull.faces().len());
    for ridge in hull.ridges() {
        let turn = turn(hull, &ridge);
        let open = ridge.faces.map(|face| !has_condition[face]);
        // The wall of a hole is one, whatever its edges.
        let is_hole = ridge.faces.iter().all(|&face| situations[face] == Situation::Hole);
        match (turn.abs() < SMOOTH || is_hole, open) {
            (true, [true, true]) => sides.join(ridge.faces),
            (true, [false, false]) => {}
            (true, _) => raise(&mut situations, &ridge, Situation::BesideCondition),
            (false, _) if turn < 0.0 => raise(&mut situations, &ridge, Situation::Inward),
            (false, _) => {}
        }
    }
    let mut patches: Vec<Option<OpenPatch>> = vec![None; hull.faces().len()];
    let mut largest = vec![0.0; hull.faces().len()];
    for face in (0..hull.faces().len()).filter(|&face| !has_condition[face]) {
        let (root, area) = (sides.root(face), hull.area(face));
        let patch = patches[root].get_or_insert_with(|| OpenPatch {
            situation: Situation::Side,
            faces: Vec::new(),
            area: 0.0,
            area_vector: [0.0; 3],
            place: [0.0; 3],
            region: RegionId(0),
        });
        patch.situation = patch.situation.max(situations[face]);
        patch.faces.push(face);
        patch.area += area;
        let normal = hull.normal(face);
        patch.area_vector = std::array::from_fn(|d| patch.area_vector[d] + area * normal[d]);
        if area > largest[root] {
            largest[root] = area;
            patch.place = centroid(hull.corners(face));
            patch.region = hull.mesh().topology().region_of()[hull.faces()[face].inside.index()];
        }
    }
    patches.into_iter().flatten().collect()
}

fn raise(situations: &mut [Situation], ridge: &Ridge, to: Situation) {
    for face in ridge.faces {
        situations[face] = situations[face].max(to);
    }
}

/// Sine of the angle between two faces at their edge: positive where the mesh is convex, negative where it is not; one
/// where they turn by a right angle or more.
fn turn(hull: &Hull<'_>, ridge: &Ridge) -> f64 {
    let [first, second] = ridge.faces;
    let (n1, n2) = (hull.normal(first), hull.normal(second));
    let at = hull.mesh().point(ridge.nodes[0]);
    let apex = hull.faces()[second].nodes.into_iter().find(|n| !ridge.nodes.contains(n));
    let towards = apex.map_or([0.0; 3], |n| sub(hull.mesh().point(n), at));
    let rises = dot(towards, n1);
    let cosine = dot(n1, n2);
    let sine = if cosine > 0.0 { norm(crate::tet4::cross(n1, n2)) } else { 1.0 };
    if rises > 0.0 { -sine } else { sine }
}
