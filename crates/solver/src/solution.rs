//! The solved field: potentials at nodes; B, J and loss in elements.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Tet4, volume};
use fluxmorph_geometry::{ElementId, Mesh, NodeId, RegionId};
use rayon::prelude::*;

use crate::element::lagrange::Lagrange;
use crate::element::point::PointField;
use crate::element::tabulated::{Rule, Tabulated};
use crate::element::volume::NodalField;
use crate::element::{Complex3, impedance};
use crate::linear::LinearSolverReport;
use crate::model::FieldModel;
use crate::space::{Basis, Order};
use crate::surface::SurfaceTerm;

/// Whose potentials a solution holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    /// The field: fixed components have their prescribed values.
    State,
    /// The adjoint: fixed components are zero.
    Adjoint,
}

/// Potentials of one state or adjoint, and how the solver reached them.
#[derive(Clone, Debug)]
pub struct FieldSolution {
    values: Vec<c64>,
    role: Role,
    report: LinearSolverReport,
}

impl FieldSolution {
    pub(crate) fn state(values: Vec<c64>, report: LinearSolverReport) -> Self {
        Self { values, role: Role::State, report }
    }

    /// The solution of a state of which nothing but its unknowns is known, one per equation.
    pub fn of_state(values: Vec<c64>) -> Self {
        Self::state(values, LinearSolverReport { iterations: 0, residual: 0.0 })
    }

    pub(crate) fn adjoint(values: Vec<c64>, report: LinearSolverReport) -> Self {
        Self { values, role: Role::Adjoint, report }
    }

    /// The unknowns, one per equation.
    pub fn values(&self) -> &[c64] {
        &self.values
    }

    /// Iterations and true residual of the linear solver.
    pub fn report(&self) -> LinearSolverReport {
        self.report
    }

    /// `A_x, A_y, A_z` [T m] and `ψ` [T m²] at a node of the space; ψ is zero outside conductors.
    #[inline]
    pub fn potentials(&self, model: &FieldModel, node: NodeId) -> [c64; 4] {
        let unknowns = model.unknowns();
        let mut potentials = unknowns.gather(&self.values, node);
        if self.role == Role::State
            && let Some(prescribed) = unknowns.prescribed_at(node)
        {
            for d in 0..3 {
                potentials[d] += prescribed[d];
            }
        }
        potentials
    }

    /// Potentials at the given nodes.
    #[inline]
    pub(crate) fn nodal_field<const N: usize>(
        &self,
        model: &FieldModel,
        nodes: [NodeId; N],
    ) -> NodalField<N> {
        NodalField::new(nodes.map(|n| self.potentials(model, n)))
    }

    /// Potentials at the nodes of an element.
    ///
    /// # Panics
    /// If the elements of the model's space have another number of nodes.
    #[inline]
    pub(crate) fn element_field<const N: usize>(&self, model: &FieldModel, e: ElementId) -> NodalField<N> {
        let nodes = model.space().nodes_of(e);
        self.nodal_field(model, nodes.try_into().expect("the caller knows the order of the space"))
    }

    /// The field at a point of an element, given by the shape functions there.
    #[inline]
    pub fn at(&self, model: &FieldModel, basis: &Basis) -> PointField {
        let mut field = PointField::default();
        for (node, value, gradient) in basis.iter() {
            let [x, y, z, psi] = self.potentials(model, node);
            field.add(value, gradient, [x, y, z], psi);
        }
        field
    }

    /// The mean of `B = curl A` [T] over an element; of linear elements, the constant.
    #[inline]
    pub fn flux_density(&self, model: &FieldModel, mesh: &Mesh, e: ElementId) -> Complex3 {
        self.at_centroid(model, mesh, e).flux_density()
    }

    #[inline]
    fn at_centroid(&self, model: &FieldModel, mesh: &Mesh, e: ElementId) -> PointField {
        let tet = Tet4::new(mesh.vertices(e));
        match model.space().order() {
            Order::Linear => {
                let table = &Lagrange::<4, 4>::tet().at(Rule::Centroid)[0];
                PointField::tabulated(table, &tet, &self.element_field(model, e))
            }
            Order::Quadratic => {
                let table = &Lagrange::<10, 4>::tet().at(Rule::Centroid)[0];
                PointField::tabulated(table, &tet, &self.element_field(model, e))
            }
        }
    }

    /// `B` [T] in every element, shape `(n_tets, 3)`.
    pub fn flux_densities(&self, model: &FieldModel, mesh: &Mesh) -> Vec<Complex3> {
        self.flux_densities_of(model, mesh, &all(model))
    }

    /// `B` [T] in some elements, in their order, shape `(n, 3)`.
    pub fn flux_densities_of(
        &self,
        model: &FieldModel,
        mesh: &Mesh,
        elements: &[ElementId],
    ) -> Vec<Complex3> {
        elements.par_iter().map(|&e| self.flux_density(model, mesh, e)).collect()
    }

    /// `J = −jωσ(A + ∇ψ)` [A/m²] at the centroid of every element, shape `(n_tets, 3)`.
    pub fn current_densities(&self, model: &FieldModel, mesh: &Mesh) -> Vec<Complex3> {
        self.current_densities_of(model, mesh, &all(model))
    }

    /// `J` [A/m²] at the centroids of some elements, in their order, shape `(n, 3)`.
    pub fn current_densities_of(
        &self,
        model: &FieldModel,
        mesh: &Mesh,
        elements: &[ElementId],
    ) -> Vec<Complex3> {
        elements
            .par_iter()
            .map(|&e| {
                let eddy = model.coefficients_of(e).eddy;
                if eddy == c64::default() {
                    return [c64::default(); 3];
                }
                self.at_centroid(model, mesh, e).electric_potential().map(|v| -eddy * v)
            })
            .collect()
    }

    /// Time-averaged loss density [W/m³] of every element: `½σ|E|²` averaged exactly over the element.
    pub fn loss_densities(&self, model: &FieldModel, mesh: &Mesh) -> Vec<f64> {
        self.loss_densities_of(model, mesh, &all(model))
    }

    /// Time-averaged loss density [W/m³] of some elements, in their order, shape `(n,)`.
    pub fn loss_densities_of(&self, model: &FieldModel, mesh: &Mesh, elements: &[ElementId]) -> Vec<f64> {
        elements.par_iter().map(|&e| self.loss_density(model, mesh, e)).collect()
    }

    fn loss_density(&self, model: &FieldModel, mesh: &Mesh, e: ElementId) -> f64 {
        let eddy = model.coefficients_of(e).eddy;
        if eddy == c64::default() {
            return 0.0;
        }
        let tet = Tet4::new(mesh.vertices(e));
        let mean_square = match model.space().order() {
            Order::Linear => {
                mean_square(Lagrange::<4, 4>::tet().at(Rule::Degree2), &tet, &self.element_field(model, e))
            }
            Order::Quadratic => {
                mean_square(Lagrange::<10, 4>::tet().at(Rule::Degree5), &tet, &self.element_field(model, e))
            }
        };
        0.5 * model.angular_frequency() * eddy.im * mean_square
    }

    /// Time-averaged loss [W] of every conductor by name: meshed regions, then impedance surfaces.
    pub fn losses(&self, model: &FieldModel, mesh: &Mesh) -> Vec<(String, f64)> {
        let topology = model.topology();
        let mut by_region = vec![0.0; topology.region_names().len()];
        // Computed in parallel, added in the order of the elements.
        for (e, density) in topology.elements().zip(self.loss_densities(model, mesh)) {
            if density != 0.0 {
                by_region[topology.region_of()[e.index()].index()] += density * volume(mesh.vertices(e));
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
                let omega = model.angular_frequency();
                by_surface[index] += match model.space().order() {
                    Order::Linear => impedance::loss(
                        Lagrange::<3, 3>::triangle(),
                        vertices,
                        coefficient,
                        omega,
                        &self.nodal_field(model, nodes).vector_potential,
                    ),
                    Order::Quadratic => impedance::loss(
                        Lagrange::<6, 3>::triangle(),
                        vertices,
                        coefficient,
                        omega,
                        &self.nodal_field(model, model.space().quadratic_triangle(nodes)).vector_potential,
                    ),
                };
            }
        }
        losses.extend(model.conductors().iter().zip(by_surface).map(|(c, loss)| (c.name.clone(), loss)));
        losses
    }
}

fn all(model: &FieldModel) -> Vec<ElementId> {
    model.topology().elements().collect()
}

/// The mean of `|A + ∇ψ|²` over an element [T² m²] by a rule.
fn mean_square<const N: usize>(table: &[Tabulated<N>], tet: &Tet4, nodal: &NodalField<N>) -> f64 {
    let square = |at: &Tabulated<N>| {
        let potential = PointField::tabulated(at, tet, nodal).electric_potential();
        at.share * potential.iter().map(|c| c.norm_sqr()).sum::<f64>()
    };
    table.iter().map(square).sum()
}
