//! The solved field: potentials at nodes; B, J and loss in elements.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Tet4;
use fluxmorph_geometry::{ElementId, Mesh, NodeId, RegionId};
use rayon::prelude::*;

use crate::element::impedance;
use crate::element::volume::{NodalField, curl, gradient, scalar_gradient};
use crate::element::{Complex3, dot3};
use crate::linear::LinearSolverReport;
use crate::model::{FieldModel, SurfaceTerm};

/// Potentials of one state, and how the solver reached them.
#[derive(Clone, Debug)]
pub struct FieldSolution {
    values: Vec<c64>,
    report: LinearSolverReport,
}

impl FieldSolution {
    pub(crate) fn new(values: Vec<c64>, report: LinearSolverReport) -> Self {
        Self { values, report }
    }

    /// The unknowns, one per equation.
    pub fn values(&self) -> &[c64] {
        &self.values
    }

    /// Iterations and true residual of the linear solver.
    pub fn report(&self) -> LinearSolverReport {
        self.report
    }

    /// `A_x, A_y, A_z` [T m] and `ψ` [T m²] at a node; zero where fixed, ψ zero outside conductors.
    #[inline]
    pub fn potentials(&self, model: &FieldModel, node: NodeId) -> [c64; 4] {
        model.unknowns().dofs.gather(&self.values, node)
    }

    /// Potentials at the four nodes of an element.
    #[inline]
    pub(crate) fn nodal_field(&self, model: &FieldModel, e: ElementId) -> NodalField {
        NodalField::new(model.topology().tet(e).map(|n| self.potentials(model, n)))
    }

    /// `B = curl A` [T] in an element, where it is constant.
    #[inline]
    pub fn flux_density(&self, model: &FieldModel, mesh: &Mesh, e: ElementId) -> Complex3 {
        let field = self.nodal_field(model, e);
        curl(&gradient(&Tet4::new(mesh.vertices(e)), &field.vector_potential))
    }

    /// `B` [T] in every element, shape `(n_tets, 3)`.
    pub fn flux_densities(&self, model: &FieldModel, mesh: &Mesh) -> Vec<Complex3> {
        let elements: Vec<ElementId> = model.topology().elements().collect();
        elements.into_par_iter().map(|e| self.flux_density(model, mesh, e)).collect()
    }

    /// `J = −jωσ(A + ∇ψ)` [A/m²] at the centroid of every element, shape `(n_tets, 3)`.
    pub fn current_densities(&self, model: &FieldModel, mesh: &Mesh) -> Vec<Complex3> {
        let elements: Vec<ElementId> = model.topology().elements().collect();
        elements
            .into_par_iter()
            .map(|e| {
                let eddy = model.coefficients_of(e).eddy;
                if eddy == c64::default() {
                    return [c64::default(); 3];
                }
                let field = self.nodal_field(model, e);
                let slope = scalar_gradient(&Tet4::new(mesh.vertices(e)), &field.scalar_potential);
                std::array::from_fn(|d| {
                    let mean: c64 = field.vector_potential.iter().map(|a| 0.25 * a[d]).sum();
                    -eddy * (mean + slope[d])
                })
            })
            .collect()
    }

    /// Time-averaged loss density [W/m³] of every element: `½σ|E|²` averaged exactly over the element.
    pub fn loss_densities(&self, model: &FieldModel, mesh: &Mesh) -> Vec<f64> {
        let elements: Vec<ElementId> = model.topology().elements().collect();
        elements.into_par_iter().map(|e| self.loss_density(model, mesh, e)).collect()
    }

    fn loss_density(&self, model: &FieldModel, mesh: &Mesh, e: ElementId) -> f64 {
        let eddy = model.coefficients_of(e).eddy;
        if eddy == c64::default() {
            return 0.0;
        }
        let field = self.nodal_field(model, e);
        let slope = scalar_gradient(&Tet4::new(mesh.vertices(e)), &field.scalar_potential);
        let total: [Complex3; 4] = field.vector_potential.map(|a| std::array::from_fn(|d| a[d] + slope[d]));
        let sum: Complex3 = std::array::from_fn(|d| total.iter().map(|v| v[d]).sum());
        let magnitude = |v: Complex3| dot3(v, v.map(|c| c.conj())).re;
        // ∫N_a N_b / V = (1 + δ_ab)/20.
        let mean_square = 0.05 * (magnitude(sum) + total.iter().map(|v| magnitude(*v)).sum::<f64>());
        0.5 * model.angular_frequency() * eddy.im * mean_square
    }

    /// Time-averaged loss [W] of every conductor by name: meshed regions, then impedance surfaces.
    pub fn losses(&self, model: &FieldModel, mesh: &Mesh) -> Vec<(String, f64)> {
        let topology = model.topology();
        let mut by_region = vec![0.0; topology.region_names().len()];
        for e in topology.elements() {
            let density = self.loss_density(model, mesh, e);
            if density != 0.0 {
                by_region[topology.region_of()[e.index()].index()] +=
                    density * Tet4::new(mesh.vertices(e)).volume;
            }
        }
        let mut losses: Vec<(String, f64)> = (0..by_region.len())
            .filter(|&r| model.materials()[r].conductivity > 0.0 && model.angular_frequency() > 0.0)
            .filter(|&r| topology.region_of().contains(&RegionId::new(r)))
            .map(|r| (topology.region_names()[r].clone(), by_region[r]))
            .collect();
        let mut by_surface = vec![0.0; model.conductors().len()];
        for (nodes, term) in model.surface() {
            if let SurfaceTerm::Impedance(coefficient, index) = term {
                let vertices = nodes.map(|n| mesh.point(n));
                let potential = nodes.map(|n| {
                    let [x, y, z, _] = self.potentials(model, n);
                    [x, y, z]
                });
                by_surface[index] +=
                    impedance::loss(vertices, coefficient, model.angular_frequency(), &potential);
            }
        }
        losses.extend(model.conductors().iter().zip(by_surface).map(|(c, loss)| (c.name.clone(), loss)));
        losses
    }
}
