//! The terms of the weak form on triangles: jumps of the reluctivity, and impedance surfaces.

use std::collections::HashSet;

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::{Point, area_vector, norm};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{ElementId, Mesh, NodeId};

use crate::boundary::Boundary;
use crate::element::impedance::{self, ImpedanceTriangle};
use crate::element::interface::InterfaceTriangle;
use crate::element::lagrange::Lagrange;
use crate::element::volume::Coefficients;
use crate::error::SolverError;
use crate::fixed_directions::axis_of;
use crate::material::Material;
use crate::space::ElementFamily;

/// A conductor that is not meshed but replaced by its impedance surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Conductor {
    /// Name of the region it stood for.
    pub name: String,
    /// Its surface, oriented out of the surrounding mesh.
    pub surface: Vec<[NodeId; 3]>,
    /// Its material.
    pub material: Material,
}

/// A term of the weak form on one triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SurfaceTerm {
    /// Jump of the reluctivity `ν_inside − ν_outside` [m/H].
    Interface(f64),
    /// `jω/Zs` [1/H] of the conductor with this index.
    Impedance(c64, usize),
}

/// The matrix of one surface term.
pub(crate) enum SurfaceMatrix<const N: usize> {
    Interface(InterfaceTriangle<N>),
    Impedance(ImpedanceTriangle<N>),
}

impl<const N: usize> SurfaceMatrix<N> {
    /// The matrix of a nodal triangle.
    #[inline]
    pub(crate) fn new(shape: &'static Lagrange<N, 3>, vertices: [Point; 3], term: SurfaceTerm) -> Self {
        match term {
            SurfaceTerm::Interface(jump) => Self::Interface(InterfaceTriangle::new(shape, vertices, jump)),
            SurfaceTerm::Impedance(coefficient, _) => {
                Self::Impedance(ImpedanceTriangle::new(shape, vertices, coefficient))
            }
        }
    }
}

impl<const N: usize> LocalMatrix<c64, N, 4> for SurfaceMatrix<N> {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[c64; 4]; 4] {
        match self {
            Self::Interface(triangle) => triangle.block(a, b),
            Self::Impedance(triangle) => triangle.block(a, b),
        }
    }
}

/// Triangles with a term, and the term of each.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surfaces {
    pub(crate) triangles: Vec<[NodeId; 3]>,
    pub(crate) terms: Vec<SurfaceTerm>,
}

impl Surfaces {
    /// Of nodal elements the triangles at which ν jumps, natural and curved outer faces; of all, impedance surfaces.
    ///
    /// `coefficients` by region. Nodes are in ascending order for edge elements.
    ///
    /// # Errors
    /// [`SolverError::Mesh`] for an unknown surface, [`SolverError::Parameter`] for an impedance surface without skin
    /// depth.
    pub(crate) fn new(
        mesh: &Mesh,
        family: ElementFamily,
        coefficients: &[Coefficients],
        boundaries: &[(String, Boundary)],
        conductors: &[Conductor],
        angular_frequency: f64,
    ) -> Result<Self, SolverError> {
        let mut surfaces = match family {
            ElementFamily::Nodal => Self::interfaces(mesh, coefficients, boundaries)?,
            ElementFamily::Edge => Self::default(),
        };
        for (index, conductor) in conductors.iter().enumerate() {
            let Some(skin_depth) = conductor.material.skin_depth(angular_frequency) else {
                return Err(SolverError::Parameter {
                    what: format!("model of `{}`", conductor.name),
                    value: "impedance".to_owned(),
                    expected:
                        "an impedance surface needs a conductivity and a frequency above zero; use model = \
                               \"volume\""
                            .to_owned(),
                });
            };
            let conductivity = conductor.material.conductivity;
            let coefficient = impedance::surface_coefficient(angular_frequency, conductivity, skin_depth);
            for triangle in &conductor.surface {
                surfaces.triangles.push(match family {
                    ElementFamily::Nodal => *triangle,
                    ElementFamily::Edge => face_key(*triangle),
                });
                surfaces.terms.push(SurfaceTerm::Impedance(coefficient, index));
            }
        }
        Ok(surfaces)
    }

    /// Triangles at which ν jumps, natural and curved outer faces.
    fn interfaces(
        mesh: &Mesh,
        coefficients: &[Coefficients],
        boundaries: &[(String, Boundary)],
    ) -> Result<Self, SolverError> {
        let topology = mesh.topology();
        let needless = faces_without_term(mesh, boundaries)?;
        let reluctivity = |e: ElementId| coefficients[topology.region_of()[e.index()].index()].reluctivity;
        let mut surfaces = Self::default();
        for facet in topology.facets() {
            let outside = facet.outside.map_or(0.0, reluctivity);
            let jump = reluctivity(facet.inside) - outside;
            if jump != 0.0 && !(facet.outside.is_none() && needless.contains(&face_key(facet.nodes))) {
                surfaces.triangles.push(facet.nodes);
                surfaces.terms.push(SurfaceTerm::Interface(jump));
            }
        }
        Ok(surfaces)
    }

    /// Every triangle with its term.
    pub(crate) fn iter(&self) -> impl Iterator<Item = ([NodeId; 3], SurfaceTerm)> + '_ {
        self.triangles.iter().copied().zip(self.terms.iter().copied())
    }
}

/// Faces of planes along the axes whose condition is zero: the term couples components there that the condition fixes to
/// zero, and need not be stored. On a curved surface the components in the nodes' frames are not those of one face.
fn faces_without_term(
    mesh: &Mesh,
    boundaries: &[(String, Boundary)],
) -> Result<HashSet<[NodeId; 3]>, SolverError> {
    let mut faces = HashSet::new();
    let mut needed = HashSet::new();
    for (name, boundary) in boundaries {
        for triangle in mesh.topology().surface(name)? {
            let area = area_vector(triangle.map(|n| mesh.point(n)));
            let plane = axis_of(area.map(|c| c / norm(area))).is_some();
            let applied = matches!(boundary, Boundary::UniformField(_));
            (if plane && !applied { &mut faces } else { &mut needed }).insert(face_key(*triangle));
        }
    }
    // A face that two surfaces name keeps its term where one of them needs it.
    faces.retain(|face| !needed.contains(face));
    Ok(faces)
}
