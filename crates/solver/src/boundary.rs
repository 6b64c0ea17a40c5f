//! Conditions on named surfaces, and the potential of an applied field.

use fluxmorph_geometry::tet4::{Point, area_vector, cross, norm, sub};
use fluxmorph_geometry::{Mesh, MeshError};

use crate::fixed_directions::axis_of;

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

/// The point `c` of a uniform field among other conditions.
///
/// # Errors
/// [`MeshError::UnknownSurface`].
pub(crate) fn centre(
    mesh: &Mesh,
    boundaries: &[(String, Boundary)],
    field: &UniformField,
) -> Result<Point, MeshError> {
    if let Some(centre) = field.centre {
        return Ok(centre);
    }
    let mut centre = [0.0; 3];
    for (name, _) in boundaries.iter().filter(|(_, b)| *b == Boundary::FluxParallel) {
        for triangle in mesh.topology().surface(name)? {
            let vertices = triangle.map(|n| mesh.point(n));
            let area = area_vector(vertices);
            if let Some(axis) = axis_of(area.map(|c| c / norm(area))) {
                centre[axis] = vertices[0][axis];
            }
        }
    }
    Ok(centre)
}
