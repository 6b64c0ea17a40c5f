//! Planes of outer faces, and how a field goes on beyond them: at a flux-parallel one with the unit normal `n` that of the image is
//! `B(Rx) = RB(x)` with `R = 1 − 2nnᵀ`, at a flux-normal one `−RB(x)`.

use std::collections::HashMap;

use fluxmorph_geometry::directions::{beside, unit};
use fluxmorph_geometry::tet4::{Point, area_vector, dot, norm, sub};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{Facet, Mesh, MeshError, NodeId, Topology};

use crate::boundary::Boundary;

/// Sine of an angle up to which directions count as one, and share of the way to a point by which it may lie off a plane: faces
/// of a fine mesh with coordinates of six digits have directions of their own.
pub(super) const ROUNDING: f64 = 1e-3;

/// What holds on a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Condition {
    FluxParallel,
    FluxNormal,
    /// Anything else: `A` is given, is a gradient along the face, or free.
    Other,
}

/// A symmetry plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    pub(super) place: Point,
    /// Of unit length.
    pub(super) normal: Point,
    pub(super) condition: Condition,
}

/// The condition of every face of the named surfaces, by its key; of one that has two of them [`Condition::Other`].
///
/// # Errors
/// [`MeshError::UnknownSurface`].
pub(super) fn conditions(
    topology: &Topology,
    boundaries: &[(String, Boundary)],
) -> Result<HashMap<[NodeId; 3], Condition>, MeshError> {
    let mut conditions = HashMap::new();
    for (name, boundary) in boundaries {
        let condition = match boundary {
            Boundary::FluxParallel => Condition::FluxParallel,
            Boundary::FluxNormal => Condition::FluxNormal,
            Boundary::UniformField(_) => Condition::Other,
        };
        for face in topology.surface(name)? {
            let known = conditions.entry(face_key(*face)).or_insert(condition);
            *known = if *known == condition { condition } else { Condition::Other };
        }
    }
    Ok(conditions)
}

impl Plane {
    /// That of a face.
    pub(super) fn of(mesh: &Mesh, face: [NodeId; 3], condition: Condition) -> Self {
        let normal = unit(area_vector(face.map(|n| mesh.point(n))));
        Self { place: mesh.point(face[0]), normal, condition }
    }

    /// Whether the field beyond it is the image of that of the mesh: which lies on one side of it, with no outer face of another
    /// condition in the plane. Natural faces have that of flux-normal ones.
    pub(super) fn is_symmetry(&self, mesh: &Mesh, conditions: &HashMap<[NodeId; 3], Condition>) -> bool {
        let outer = mesh.topology().outer_facets();
        let mut in_plane = outer.filter(|facet| facet.nodes.iter().all(|&n| self.holds(mesh.point(n))));
        let is_alike = |facet: &Facet| {
            let condition = conditions.get(&face_key(facet.nodes)).copied().unwrap_or(Condition::FluxNormal);
            condition == self.condition
        };
        self.condition != Condition::Other
            && !self.is_crossed(mesh.points().iter().copied())
            && in_plane.all(is_alike)
    }

    pub(super) fn is_parallel(&self, other: &Self) -> bool {
        norm(beside(&[self.normal], other.normal)) <= ROUNDING
    }

    pub(super) fn is_square_to(&self, other: &Self) -> bool {
        dot(self.normal, other.normal).abs() <= ROUNDING
    }

    /// How far a point lies off it on the side of the normal [m].
    pub(super) fn height(&self, x: Point) -> f64 {
        dot(self.normal, sub(x, self.place))
    }

    /// The image of a place.
    pub(crate) fn image(&self, x: Point) -> Point {
        let twice = 2.0 * self.height(x);
        std::array::from_fn(|d| x[d] - twice * self.normal[d])
    }

    pub(super) fn holds(&self, x: Point) -> bool {
        self.height(x).abs() <= ROUNDING * norm(sub(x, self.place))
    }

    /// Whether both are the same plane, whatever their conditions.
    pub(super) fn lies_in(&self, other: &Self) -> bool {
        self.is_parallel(other) && self.holds(other.place)
    }

    /// Whether points lie on both sides of it.
    pub(super) fn is_crossed(&self, points: impl Iterator<Item = Point>) -> bool {
        let mut sides = points.filter(|&x| !self.holds(x)).map(|x| self.height(x) > 0.0);
        let first = sides.next();
        sides.any(|side| Some(side) != first)
    }

    /// `Rv`.
    pub(super) fn reflect(&self, v: Point) -> Point {
        let twice = 2.0 * dot(self.normal, v);
        std::array::from_fn(|d| v[d] - twice * self.normal[d])
    }

    /// `B` at the image of where it is `b`.
    pub(super) fn turn(&self, b: Point) -> Point {
        let reflected = self.reflect(b);
        if self.condition == Condition::FluxNormal { reflected.map(|c| -c) } else { reflected }
    }

    /// The same, at right angles to others to the last digit: reflections then commute.
    pub(super) fn squared_to(self, others: &[Self]) -> Self {
        let normals: Vec<Point> = others.iter().map(|other| other.normal).collect();
        Self { normal: unit(beside(&normals, self.normal)), ..self }
    }
}
