//! The weak form on a mesh: which coefficients an element or a surface triangle has, and its matrix.
//!
//! Lives here: coefficients by region, surface terms by triangle, and the choice of the element kernel. Does not live here:
//! the formulas of the kernels ([`crate::element`]), numbering and assembly (`discretisation`).

use std::sync::Arc;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Tet4;
use fluxmorph_geometry::{ElementId, Mesh, NodeId, Topology};

use crate::boundary::Boundary;
use crate::element::lagrange::Lagrange;
use crate::element::quadratic::LagrangeTet;
use crate::element::volume::{AphiTet, Coefficients};
use crate::element::{impedance::ImpedanceTriangle, interface::InterfaceTriangle};
use crate::error::SolverError;
use crate::material::Material;
use crate::surface::{Conductor, SurfaceMatrix, SurfaceTerm, Surfaces};

/// Coefficients of the weak form at one frequency.
#[derive(Debug)]
pub(crate) struct WeakForm {
    topology: Arc<Topology>,
    /// By region.
    coefficients: Vec<Coefficients>,
    surfaces: Surfaces,
}

impl WeakForm {
    /// Coefficients of every region and terms of every triangle, for the angular frequency `ω` [rad/s] and the penalty
    /// factor `p`.
    ///
    /// # Errors
    /// As [`Surfaces::new`].
    pub(crate) fn new(
        mesh: &Mesh,
        (angular_frequency, penalty): (f64, f64),
        materials: &[Material],
        boundaries: &[(String, Boundary)],
        conductors: &[Conductor],
    ) -> Result<Self, SolverError> {
        let coefficients: Vec<Coefficients> = materials
            .iter()
            .map(|m| Coefficients {
                reluctivity: m.reluctivity(),
                extra_penalty: (penalty - 1.0) * m.reluctivity(),
                eddy: c64::new(0.0, angular_frequency * m.conductivity),
            })
            .collect();
        let surfaces = Surfaces::new(mesh, &coefficients, boundaries, conductors, angular_frequency)?;
        Ok(Self { topology: Arc::clone(mesh.topology()), coefficients, surfaces })
    }

    /// The topology.
    pub(crate) fn topology(&self) -> &Arc<Topology> {
        &self.topology
    }

    /// `ν`, `(p − 1)ν` and `jωσ` of an element.
    #[inline]
    pub(crate) fn coefficients_of(&self, e: ElementId) -> &Coefficients {
        &self.coefficients[self.topology.region_of()[e.index()].index()]
    }

    /// Whether eddy currents flow in an element, so that it has ψ.
    pub(crate) fn conducts(&self, e: ElementId) -> bool {
        self.coefficients_of(e).eddy != c64::default()
    }

    /// Whether the three components of `A` couple inside the regions.
    pub(crate) fn couples_components(&self) -> bool {
        self.coefficients.iter().any(|c| c.extra_penalty != 0.0)
    }

    /// Triangles with a term.
    pub(crate) fn triangles(&self) -> &[[NodeId; 3]] {
        &self.surfaces.triangles
    }

    /// Every triangle with its term.
    pub(crate) fn surface(&self) -> impl Iterator<Item = ([NodeId; 3], SurfaceTerm)> + '_ {
        self.surfaces.iter()
    }

    /// The matrix of a linear tetrahedron.
    #[inline]
    pub(crate) fn linear_tet(&self, mesh: &Mesh, e: ElementId) -> AphiTet {
        AphiTet::new(Tet4::new(mesh.vertices(e)), *self.coefficients_of(e))
    }

    /// The matrix of a quadratic tetrahedron.
    #[inline]
    pub(crate) fn quadratic_tet(&self, mesh: &Mesh, e: ElementId) -> LagrangeTet<10> {
        let tet = Tet4::new(mesh.vertices(e));
        LagrangeTet::new(Lagrange::<10, 4>::tet(), tet, *self.coefficients_of(e))
    }

    /// The matrix of a triangle, by its number.
    pub(crate) fn triangle<const N: usize>(
        &self,
        shape: &'static Lagrange<N, 3>,
        mesh: &Mesh,
        triangle: usize,
    ) -> SurfaceMatrix<N> {
        let vertices = self.surfaces.triangles[triangle].map(|n| mesh.point(n));
        match self.surfaces.terms[triangle] {
            SurfaceTerm::Interface(jump) => {
                SurfaceMatrix::Interface(InterfaceTriangle::new(shape, vertices, jump))
            }
            SurfaceTerm::Impedance(coefficient, _) => {
                SurfaceMatrix::Impedance(ImpedanceTriangle::new(shape, vertices, coefficient))
            }
        }
    }
}
