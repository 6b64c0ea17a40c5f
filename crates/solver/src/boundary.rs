//! Conditions on named surfaces, and the potential of an applied field.

use std::collections::{HashMap, HashSet};

use fluxmorph_geometry::directions::{axis_of, beside};
use fluxmorph_geometry::tet4::{Point, area_vector, cross, dot, norm, sub};
use fluxmorph_geometry::topology::triangle_edges;
use fluxmorph_geometry::{Mesh, MeshError, NodeId};

use crate::error::SolverError;

/// Share of an applied field's largest `|A|` that may be left where another condition says otherwise. A face of a fine mesh with
/// coordinates of six digits has a direction of its own; the error of what is left is of this size, too.
pub(crate) const CONFLICT: f64 = 1e-3;

/// What the normal of a plane must have beside those of others [1] to be another plane, and not a face of the same.
const INDEPENDENT: f64 = 1e-2;

/// A condition on a named surface, plane or curved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Boundary {
    /// B·n = 0.
    FluxParallel,
    /// n × H = 0.
    FluxNormal,
    /// The tangential components of `A` are those of a uniform applied field.
    UniformField(UniformField),
}

/// A uniform applied flux density, far from all that disturbs it.
///
/// Its potential is `A = ½ B × (x − c)`. A flux-parallel plane that touches the surface must hold `c`, for there `A_t`
/// is zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UniformField {
    /// `B` [T], peak.
    pub flux_density: Point,
    /// `c` [m]; `None`: on all flux-parallel planes, and at the origin in the directions without one.
    pub centre: Option<Point>,
}

impl UniformField {
    /// `A = ½ B × (x − c)` [T m].
    pub fn vector_potential(&self, centre: Point, x: Point) -> Point {
        cross(self.flux_density, sub(x, centre)).map(|c| 0.5 * c)
    }
}

/// The point `c` of uniform fields that give none: on the flux-parallel planes that touch their surfaces, and at 0 in the directions
/// without one.
///
/// # Errors
/// [`MeshError::UnknownSurface`].
pub(crate) fn default_centre(mesh: &Mesh, boundaries: &[(String, Boundary)]) -> Result<Point, MeshError> {
    let mut given: HashSet<NodeId> = HashSet::new();
    for (name, _) in boundaries.iter().filter(|(_, b)| matches!(b, Boundary::UniformField(_))) {
        given.extend(mesh.topology().surface(name)?.iter().flatten());
    }
    let mut planes = Vec::new();
    for (name, _) in boundaries.iter().filter(|(_, b)| *b == Boundary::FluxParallel) {
        let touch =
            |triangle: &&[NodeId; 3]| triangle.iter().filter(|node| given.contains(node)).count() >= 2;
        for triangle in mesh.topology().surface(name)?.iter().filter(touch) {
            let vertices = triangle.map(|n| mesh.point(n));
            let area = area_vector(vertices);
            planes.push((vertices[0], area.map(|c| c / norm(area))));
        }
    }
    let (mut centre, mut directions): (Point, Vec<Point>) = ([0.0; 3], Vec::new());
    for &(place, normal) in &planes {
        if let Some(axis) = axis_of(normal) {
            centre[axis] = place[axis];
            let direction = std::array::from_fn(|d| f64::from(u8::from(d == axis)));
            if !directions.contains(&direction) {
                directions.push(direction);
            }
        }
    }
    // Onto the others along what their normals have beside those before.
    for (place, normal) in planes.into_iter().filter(|(_, normal)| axis_of(*normal).is_none()) {
        let rest = beside(&directions, normal);
        let length = norm(rest);
        if length > INDEPENDENT {
            let way = dot(normal, sub(place, centre)) / (length * length);
            (0..3).for_each(|d| centre[d] += way * rest[d]);
            directions.push(rest.map(|c| c / length));
        }
    }
    Ok(centre)
}

/// Refuses applied fields that contradict each other where their surfaces meet, or a perfect conductor, by name and surface, that
/// touches one: there is one `A`, and along a perfect conductor none, whether or not along the edge where they meet.
///
/// # Errors
/// [`SolverError::TwoFields`], [`SolverError::FieldOnConductor`].
pub(crate) fn check_applied<'a>(
    mesh: &Mesh,
    boundaries: &[(String, Boundary)],
    perfect: impl Iterator<Item = (&'a str, &'a [[NodeId; 3]])>,
) -> Result<(), SolverError> {
    let default = default_centre(mesh, boundaries)?;
    let mut applied: HashMap<[NodeId; 2], (Point, &str)> = HashMap::new();
    let (mut largest, mut apart) = (0.0_f64, Vec::new());
    for (surface, boundary) in boundaries {
        let Boundary::UniformField(field) = boundary else { continue };
        let centre = field.centre.unwrap_or(default);
        for edge in mesh.topology().surface(surface)?.iter().flat_map(|t| triangle_edges(*t)) {
            let potential = field.vector_potential(centre, middle(mesh, edge));
            largest = largest.max(norm(potential));
            let (first, other) = *applied.entry(edge).or_insert((potential, surface));
            if other != surface {
                apart.push((edge, norm(sub(first, potential)), [other, surface.as_str()]));
            }
        }
    }
    let differs = |(_, difference, _): &([NodeId; 2], f64, _)| *difference > CONFLICT * largest;
    if let Some((edge, _, surfaces)) = apart.into_iter().find(differs) {
        let surfaces = surfaces.map(str::to_owned);
        return Err(SolverError::TwoFields { surfaces, place: middle(mesh, edge) });
    }
    for (name, triangles) in perfect {
        for (triangle, edge) in triangles.iter().flat_map(|t| triangle_edges(*t).map(|edge| (t, edge))) {
            let Some(&(potential, surface)) = applied.get(&edge) else { continue };
            let area = area_vector(triangle.map(|n| mesh.point(n)));
            if norm(cross(potential, area)) > CONFLICT * largest * norm(area) {
                return Err(SolverError::FieldOnConductor {
                    conductor: name.to_owned(),
                    surface: surface.to_owned(),
                    place: middle(mesh, edge),
                });
            }
        }
    }
    Ok(())
}

fn middle(mesh: &Mesh, [a, b]: [NodeId; 2]) -> Point {
    let (x, y) = (mesh.point(a), mesh.point(b));
    std::array::from_fn(|d| 0.5 * (x[d] + y[d]))
}
