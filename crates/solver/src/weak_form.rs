//! The weak form on a mesh: which coefficients an element or a surface triangle has, and its matrix.
//!
//! Lives here: coefficients by region, surface terms by triangle, and the choice of the element kernel. Does not live here:
//! the formulas of the kernels ([`crate::element`]), numbering and assembly (`discretisation`).

use std::sync::Arc;

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::{ElementId, Mesh, NodeId, Topology};

use crate::bh::BhCurve;
use crate::boundary::Boundary;
use crate::element::tabulated::Rule;
use crate::element::tensor::{TensorField, TensorTerm, WithTensor};
use crate::element::volume::Coefficients;
use crate::elements::{ElementFamily, Order};
use crate::error::SolverError;
use crate::family::{Cell, Matrices};
use crate::material::Material;
use crate::open::{OpenRegion, Shell, Stretch};
use crate::surface::{Conductor, SurfaceTerm, Surfaces};
use crate::unknowns::Conductors;

/// Coefficients of the weak form at one frequency.
#[derive(Debug)]
pub(crate) struct WeakForm {
    topology: Arc<Topology>,
    /// By region.
    coefficients: Vec<Coefficients>,
    /// By region; shorter where the rest is linear.
    curves: Vec<Option<Arc<BhCurve>>>,
    /// Those of a region with a curve, ascending.
    elements_with_a_law: Vec<ElementId>,
    surfaces: Surfaces,
    shell: Option<Shell>,
}

impl WeakForm {
    /// Coefficients of every region and terms of every triangle, for the angular frequency `ω` [rad/s] and the penalty
    /// factor `p`.
    ///
    /// # Errors
    /// As [`Surfaces::new`] and [`Shell::new`].
    pub(crate) fn new(
        mesh: &Mesh,
        elements: (ElementFamily, Order),
        (angular_frequency, penalty): (f64, f64),
        materials: &[Material],
        boundaries: &[(String, Boundary)],
        conductors: &[Conductor],
        open: Option<&OpenRegion>,
    ) -> Result<Self, SolverError> {
        let coefficients: Vec<Coefficients> = materials
            .iter()
            .map(|m| Coefficients {
                reluctivity: m.reluctivity(),
                extra_penalty: (penalty - 1.0) * m.reluctivity(),
                eddy: c64::new(0.0, angular_frequency * m.conductivity),
            })
            .collect();
        let surfaces =
            Surfaces::new(mesh, elements, &coefficients, boundaries, conductors, angular_frequency)?;
        let shell = open.map(|open| Shell::new(mesh, open)).transpose()?;
        let topology = Arc::clone(mesh.topology());
        Ok(Self {
            topology,
            coefficients,
            curves: Vec::new(),
            elements_with_a_law: Vec::new(),
            surfaces,
            shell,
        })
    }

    /// The same with B–H laws by region; the rest is linear.
    pub(crate) fn with_curves(mut self, curves: &[Option<Arc<BhCurve>>]) -> Self {
        self.curves = curves.to_vec();
        self.elements_with_a_law = self.topology.elements().filter(|&e| self.curve_of(e).is_some()).collect();
        self
    }

    /// The B–H law of an element.
    #[inline]
    pub(crate) fn curve_of(&self, e: ElementId) -> Option<&BhCurve> {
        self.curves.get(self.topology.region_of()[e.index()].index())?.as_deref()
    }

    /// Elements with a B–H law, ascending.
    pub(crate) fn elements_with_a_law(&self) -> &[ElementId] {
        &self.elements_with_a_law
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

    /// The largest reluctivity of an element over the smallest; of a B–H law that of its linear part. What an impedance surface stands
    /// for has no elements.
    pub(crate) fn reluctivity_contrast(&self) -> f64 {
        let reluctivities = self.topology.elements().map(|e| self.coefficients_of(e).reluctivity);
        let wider = |(least, most): (f64, f64), nu: f64| (least.min(nu), most.max(nu));
        let (least, most) = reluctivities.fold((f64::INFINITY, 0.0), wider);
        most / least
    }

    /// Whether eddy currents flow in an element, so that it has ψ.
    pub(crate) fn conducts(&self, e: ElementId) -> bool {
        self.coefficients_of(e).eddy != c64::default()
    }

    /// Whether the three components of `A` couple inside an element.
    pub(crate) fn couples_components(&self, e: ElementId) -> bool {
        self.coefficients.iter().any(|c| c.extra_penalty != 0.0)
            || self.curve_of(e).is_some()
            || self.stretch_of(e).is_some()
    }

    /// The shell that stands for open space.
    pub(crate) fn shell(&self) -> Option<&Shell> {
        self.shell.as_ref()
    }

    /// The map of an element of that shell.
    #[inline]
    pub(crate) fn stretch_of(&self, e: ElementId) -> Option<&Stretch> {
        self.shell.as_ref().and_then(|shell| shell.of(e))
    }

    /// What the reluctivity of an element is beyond the scalar of its region; `None` where it is that scalar.
    pub(crate) fn tensors_of(&self, e: ElementId) -> Option<TensorField> {
        let reluctivity = self.coefficients_of(e).reluctivity;
        self.stretch_of(e).map(|stretch| stretch.tensors(reluctivity, Rule::Degree5))
    }

    /// Triangles with a term.
    pub(crate) fn triangles(&self) -> &[[NodeId; 3]] {
        &self.surfaces.triangles
    }

    /// Whether there are walls that no flux passes and that end at a re-entrant edge, where nodal elements have `ψ`.
    pub(crate) fn has_reentrant_walls(&self) -> bool {
        let is_wall = |((_, term), has_psi): ((_, SurfaceTerm), &bool)| {
            *has_psi && matches!(term, SurfaceTerm::Perfect(_))
        };
        self.surface().zip(&self.surfaces.has_psi).any(is_wall)
    }

    /// Where currents flow.
    pub(crate) fn conductors(&self) -> Conductors {
        let mut conductors = Conductors {
            elements: self.topology.elements().filter(|&e| self.conducts(e)).collect(),
            grounded: self.surfaces.known.clone(),
            ..Conductors::default()
        };
        for ((triangle, term), has_psi) in self.surface().zip(&self.surfaces.has_psi) {
            match term {
                SurfaceTerm::Interface(_) => {}
                _ if *has_psi => conductors.surface.push(triangle),
                _ => conductors.grounded.push(triangle),
            }
        }
        conductors
    }

    /// The triangles at which the reluctivity jumps.
    pub(crate) fn interfaces(&self) -> impl Iterator<Item = [NodeId; 3]> + '_ {
        self.surface()
            .filter(|(_, term)| matches!(term, SurfaceTerm::Interface(_)))
            .map(|(triangle, _)| triangle)
    }

    /// Every triangle with its term.
    pub(crate) fn surface(&self) -> impl Iterator<Item = ([NodeId; 3], SurfaceTerm)> + '_ {
        self.surfaces.iter()
    }

    /// The matrix of a tetrahedron.
    #[inline]
    pub(crate) fn tet<const N: usize, const F: usize>(
        &self,
        matrices: &impl Matrices<N, F>,
        cell: Cell,
        e: ElementId,
    ) -> impl LocalMatrix<c64, N, 4> {
        let term = self.tensors_of(e).map(|field| {
            let curls = matrices.curls(&cell, field.rule);
            let points = field.rule.nodes().iter().zip(&field.values).zip(&curls);
            TensorTerm::new(points.map(|(((_, share), d), curls)| (share * cell.tet.volume, d, curls)))
        });
        WithTensor { scalar: matrices.tet(cell, *self.coefficients_of(e)), term }
    }

    /// The matrix of a triangle, by its number.
    pub(crate) fn triangle<const N: usize, const F: usize>(
        &self,
        matrices: &impl Matrices<N, F>,
        mesh: &Mesh,
        triangle: usize,
    ) -> impl LocalMatrix<c64, F, 4> {
        let vertices = self.surfaces.triangles[triangle].map(|n| mesh.point(n));
        matrices.triangle(vertices, self.surfaces.terms[triangle])
    }
}
