//! Symmetry constraints: variables that are mirror images of each other are constrained to be equal, and become one.
//!
//! Mirrors are normal to coordinate axes, one an axis at most; so they commute, and the images of a point are at most
//! eight. A point on a mirror is its own partner.

use std::collections::BTreeSet;

use fluxmorph_geometry::box_tree::{AxisBox, BoxTree};
use fluxmorph_geometry::tet4::{Point, norm, sub};
use fluxmorph_geometry::topology::triangle_edges;
use fluxmorph_geometry::{Mesh, NodeId};

use super::{DesignError, DesignSurface, Mirror, Row, axis_name};

/// Largest distance of a partner from the mirror image, as a share of the points' extent: coordinates in files carry 6 or
/// more digits, and nodes lie much further apart.
const TOLERANCE: f64 = 1e-6;

/// Largest difference of two displacements that are alike, for a design of numbers up to 1: what partners that are slightly off their
/// images see less of each other through a filter.
const ALIKE: f64 = 1e-4;

/// Largest component of a unit direction across a mirror: the rounding of the digits of a configuration.
const OBLIQUE: f64 = 1e-9;

/// For every mirror the partner of every point.
///
/// # Errors
/// [`DesignError::NoPartner`] for the first point without one.
pub(super) fn pairs(
    what: &'static str,
    points: &[Point],
    mirrors: &[Mirror],
) -> Result<Vec<Vec<usize>>, DesignError> {
    let tolerance = TOLERANCE * AxisBox::around(points).extent();
    let tree = BoxTree::of_points(points);
    let partner = |mirror: &Mirror, point: Point| {
        let (i, square) = tree.nearest(mirror.image(point)).unwrap_or((0, f64::INFINITY));
        let distance = square.sqrt();
        if distance <= tolerance {
            return Ok(i);
        }
        let (axis, at) = (axis_name(mirror.axis), mirror.at);
        Err(DesignError::NoPartner { what, point, axis, at, distance })
    };
    mirrors.iter().map(|mirror| points.iter().map(|&point| partner(mirror, point)).collect()).collect()
}

/// How many edges of a surface have no mirror image that moves as they do: the surface is symmetric in its nodes at most, and not between
/// them. An edge that is none on the other side has the edge through its mirrored middle as image, as where two cells
/// are cut along different diagonals, and moves like it where the quadrilateral of both stays plane.
pub fn edges_without_image(
    mesh: &Mesh,
    (surface, triangles): (&DesignSurface, &[[NodeId; 3]]),
    mirrors: &[Mirror],
) -> usize {
    if mirrors.is_empty() {
        return 0;
    }
    let edges: BTreeSet<[NodeId; 2]> = triangles.iter().flat_map(|t| triangle_edges(*t)).collect();
    let edges: Vec<[NodeId; 2]> = edges.into_iter().collect();
    let design: Vec<f64> = (0..surface.variable_count()).map(|k| (k as f64).sin()).collect();
    let displacement = surface.displacement(&design);
    let of_node = |n: NodeId| surface.nodes().binary_search(&n).map_or([0.0; 3], |row| displacement[row]);
    let sum = |[a, b]: [Point; 2]| -> Point { std::array::from_fn(|d| a[d] + b[d]) };
    let middles: Vec<Point> =
        edges.iter().map(|edge| sum(edge.map(|n| mesh.point(n))).map(|c| 0.5 * c)).collect();
    let around = AxisBox::around(&middles);
    let tolerance = TOLERANCE * norm(sub(around.upper, around.lower));
    let tree = BoxTree::of_points(&middles);
    let moves_alike = |mirror: &Mirror, k: usize| {
        let Some((image, square)) = tree.nearest(mirror.image(middles[k])) else { return false };
        let [own, other] = [k, image].map(|k| sum(edges[k].map(of_node)));
        square.sqrt() <= tolerance && norm(sub(mirror.reflect(own), other)) < ALIKE
    };
    (0..edges.len()).filter(|&k| !mirrors.iter().all(|mirror| moves_alike(mirror, k))).count()
}

/// Checks that one direction for all nodes is in every mirror plane.
///
/// # Errors
/// [`DesignError::Oblique`] for the first that it leaves.
pub(super) fn check_direction(direction: Point, mirrors: &[Mirror]) -> Result<(), DesignError> {
    match mirrors.iter().find(|mirror| direction[mirror.axis].abs() > OBLIQUE) {
        None => Ok(()),
        Some(mirror) => Err(DesignError::Oblique { direction, axis: axis_name(mirror.axis), at: mirror.at }),
    }
}

/// Makes directions mirror images of each other: the mean of a node's own and its partner's image. They differ where the
/// triangles are not laid symmetrically.
pub(super) fn mirror_directions(directions: &mut Vec<Point>, mirrors: &[Mirror], pairs: &[Vec<usize>]) {
    for (mirror, partner) in mirrors.iter().zip(pairs) {
        *directions = directions
            .iter()
            .zip(partner)
            .map(|(&own, &other)| {
                let image = mirror.reflect(directions[other]);
                let sum: Point = std::array::from_fn(|d| own[d] + image[d]);
                let length = norm(sum);
                // Unit vectors that all but cancel, or a node that cannot move: neither has a symmetric direction.
                if length > 0.1 { sum.map(|c| c / length) } else { [0.0; 3] }
            })
            .collect();
    }
}

/// Makes numbers of mirrored nodes equal: the mean of both.
pub(super) fn mirror_numbers(numbers: &mut Vec<f64>, pairs: &[Vec<usize>]) {
    for partner in pairs {
        *numbers = numbers.iter().zip(partner).map(|(own, &other)| 0.5 * (own + numbers[other])).collect();
    }
}

/// The linear constraints of the variables: which old variable goes into which new one.
#[derive(Clone, Debug)]
pub(super) struct Groups {
    new_of: Vec<usize>,
    /// The first old variable of each new one.
    first: Vec<usize>,
}

/// The groups that partners make of `count` variables, in the order of their first members.
pub(super) fn groups(count: usize, pairs: &[Vec<usize>]) -> Groups {
    let mut least: Vec<usize> = (0..count).collect();
    // A mirror each: after all of them, the least of the up to eight images has reached every one.
    for partner in pairs {
        least = (0..count).map(|i| least[i].min(least[partner[i]])).collect();
    }
    let first: Vec<usize> = (0..count).filter(|&i| least[i] == i).collect();
    let new_of = least
        .iter()
        .map(|i| first.binary_search(i).expect("the least of a group is its own least"))
        .collect();
    Groups { new_of, first }
}

impl Groups {
    /// The new variable that an old one goes into.
    pub(super) fn variable(&self, old: usize) -> usize {
        self.new_of[old]
    }

    /// Renumbers the variables in the rows, adding up weights, and leaves each group the point of its first member.
    pub(super) fn apply(&self, rows: &mut [Row], points: &mut Vec<Point>) {
        if self.first.len() == self.new_of.len() {
            return;
        }
        for row in rows {
            let mut merged: Row = row.iter().map(|&(k, weight)| (self.new_of[k], weight)).collect();
            merged.sort_by_key(|&(k, _)| k);
            row.clear();
            for (k, weight) in merged {
                match row.last_mut() {
                    Some((last, sum)) if *last == k => *sum += weight,
                    _ => row.push((k, weight)),
                }
            }
        }
        *points = self.first.iter().map(|&i| points[i]).collect();
    }
}
