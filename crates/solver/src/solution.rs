//! The solved field: potentials at nodes; B, J and loss in elements.

use std::collections::BTreeMap;
use std::sync::Arc;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::volume;
use fluxmorph_geometry::{CarrierId, ElementId, Mesh, NodeId, RegionId};
use rayon::prelude::*;

use crate::element::Complex3;
use crate::element::edge::FieldPoint;
use crate::elements::ElementFamily;
use crate::family::Local;
use crate::linear::LinearSolverReport;
use crate::model::FieldModel;
use crate::surface::SurfaceTerm;

/// Whose potentials a solution holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    /// The field: fixed components have their prescribed values.
    State,
    /// The adjoint, or the response to 1 A in a coil: fixed components are zero, and no magnet acts.
    Adjoint,
}

/// A state with its model and the mesh on which it was computed.
pub type FieldState<'a> = (&'a FieldModel, &'a Mesh, &'a FieldSolution);

/// Potentials of one state or adjoint, and how the solver reached them.
#[derive(Clone, Debug)]
pub struct FieldSolution {
    values: Vec<c64>,
    role: Role,
    report: LinearSolverReport,
    /// Of Newton's method with its start; zero where all is linear.
    newton_steps: usize,
    /// Of voltage-driven coils [A].
    currents: Vec<c64>,
    /// `K⁻¹F` by the place of a winding, where it was asked for.
    responses: BTreeMap<usize, Arc<FieldSolution>>,
}

impl FieldSolution {
    pub(crate) fn state(values: Vec<c64>, report: LinearSolverReport) -> Self {
        Self::new(values, Role::State, report)
    }

    /// The same with the currents [A] that voltages drive.
    pub(crate) fn with_currents(self, currents: Vec<c64>) -> Self {
        Self { currents, ..self }
    }

    /// Currents [A] of the voltage-driven coils, in their order, in harmonics.
    pub(crate) fn currents(&self) -> &[c64] {
        &self.currents
    }

    /// The solution of a state of which nothing but its unknowns is known, as [`FieldSolution::values`] has them.
    pub fn of_state(values: Vec<c64>) -> Self {
        Self::state(values, LinearSolverReport { iterations: 0, residual: 0.0 })
    }

    pub(crate) fn adjoint(values: Vec<c64>, report: LinearSolverReport) -> Self {
        Self::new(values, Role::Adjoint, report)
    }

    fn new(values: Vec<c64>, role: Role, report: LinearSolverReport) -> Self {
        Self { values, role, report, newton_steps: 0, currents: Vec::new(), responses: BTreeMap::new() }
    }

    /// Whether sources and prescribed values act in it: not in an adjoint, nor in the response to 1 A.
    pub(crate) fn is_state(&self) -> bool {
        self.role == Role::State
    }

    /// The response to 1 A in a winding by its place; `None` where it was not solved for.
    pub fn response(&self, winding: usize) -> Option<&Self> {
        self.responses.get(&winding).map(Arc::as_ref)
    }

    /// The same with the response of a winding.
    pub(crate) fn respond(&mut self, winding: usize, response: Self) {
        self.responses.insert(winding, Arc::new(response));
    }

    /// The same with the responses of another state on the same mesh whose problem has the same matrix.
    #[must_use]
    pub fn with_responses_of(self, other: &Self) -> Self {
        Self { responses: other.responses.clone(), ..self }
    }

    /// The same, found in some steps of Newton's method.
    pub(crate) fn after_newton(self, steps: usize) -> Self {
        Self { newton_steps: steps, ..self }
    }

    /// Steps of Newton's method, its start included; zero where all is linear.
    pub fn newton_steps(&self) -> usize {
        self.newton_steps
    }

    /// The unknowns, one per equation, then one per segment of a solid conductor above 0 Hz.
    pub fn values(&self) -> &[c64] {
        &self.values
    }

    /// All unknowns, the currents that voltages drive behind the others: what a similar state may begin with.
    pub fn unknowns(&self) -> Vec<c64> {
        [&self.values[..], &self.currents].concat()
    }

    /// Iterations and true residual of the linear solver.
    pub fn report(&self) -> LinearSolverReport {
        self.report
    }

    /// The coefficients of a carrier: of a node `A_x, A_y, A_z` [T m] and `ψ` [T m²], ψ zero outside conductors; of an edge
    /// or face those of its functions.
    #[inline]
    pub fn potentials(&self, model: &FieldModel, carrier: CarrierId) -> [c64; 4] {
        let unknowns = model.unknowns();
        let mut potentials = unknowns.gather(&self.values, carrier);
        if self.role == Role::State
            && let Some(prescribed) = unknowns.prescribed_at(carrier)
        {
            for d in 0..3 {
                potentials[d] += prescribed[d];
            }
        }
        potentials
    }

    /// Coefficients of some carriers.
    #[inline]
    pub(crate) fn local(&self, model: &FieldModel, carriers: &[CarrierId]) -> Local {
        Local::new(carriers.len(), |a| self.potentials(model, carriers[a]))
    }

    /// Coefficients of an element, with what the voltage of a solid conductor adds to them.
    #[inline]
    pub(crate) fn element(&self, model: &FieldModel, e: ElementId) -> Local {
        let mut local = self.local(model, model.space().carriers_of(e));
        model.solids().add_to(e, self.solid_unknowns(model), &mut local);
        local
    }

    /// `V/(jω)` [Wb] of solid conductors.
    #[inline]
    pub(crate) fn solid_unknowns(&self, model: &FieldModel) -> &[c64] {
        self.values.get(model.unknown_count()..).unwrap_or_default()
    }

    /// The field at barycentric coordinates in an element.
    #[inline]
    pub fn at(&self, model: &FieldModel, mesh: &Mesh, e: ElementId, lambda: &[f64; 4]) -> FieldPoint {
        let space = model.space();
        let field = space.elements().field(&space.cell(mesh, e), lambda, self.element(model, e).values());
        outside(model, e, lambda, field)
    }

    /// `A_x, A_y, A_z` [T m] and `ψ` [T m²] at nodes of the mesh. Edge elements do not tell `A` from `∇ψ`, and are
    /// discontinuous across their faces: theirs is the mean of `A + ∇ψ` over the elements around, and ψ is zero.
    pub fn nodal_potentials(&self, model: &FieldModel, mesh: &Mesh, nodes: &[NodeId]) -> Vec<[c64; 4]> {
        let space = model.space();
        let of_edges = |&node: &NodeId| {
            let around = model.topology().elements_around(node);
            let mut mean = [c64::default(); 4];
            for &e in around {
                let vertex = model.topology().tet(e).iter().position(|&n| n == node);
                let vertex = vertex.expect("the elements around a node have it");
                let (cell, field) = (space.cell(mesh, e), self.element(model, e));
                let at = space.elements().at_vertex(&cell, vertex, field.values()).vector_potential;
                (0..3).for_each(|d| mean[d] += at[d] / around.len() as f64);
            }
            mean
        };
        match space.family() {
            ElementFamily::Nodal => nodes.par_iter().map(|&n| self.potentials(model, n.into())).collect(),
            ElementFamily::Edge => nodes.par_iter().map(of_edges).collect(),
        }
    }

    /// The mean of `B = curl A` [T] over an element; of linear elements, the constant.
    #[inline]
    pub fn flux_density(&self, model: &FieldModel, mesh: &Mesh, e: ElementId) -> Complex3 {
        self.at_centroid(model, mesh, e).flux_density
    }

    #[inline]
    fn at_centroid(&self, model: &FieldModel, mesh: &Mesh, e: ElementId) -> FieldPoint {
        let space = model.space();
        let field = space.elements().at_centroid(&space.cell(mesh, e), self.element(model, e).values());
        outside(model, e, &[0.25; 4], field)
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

    /// `J = −jωσ(A + ∇ψ)` [A/m²] at the centroids of some elements, in their order, shape `(n, 3)`.
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
                self.at_centroid(model, mesh, e).electric_potential.map(|v| -eddy * v)
            })
            .collect()
    }

    /// Time-averaged loss [W] under every triangle of an impedance surface, with the number of the conductor and the triangle.
    pub fn surface_losses(&self, model: &FieldModel, mesh: &Mesh) -> Vec<(usize, [NodeId; 3], f64)> {
        let of = |(nodes, term): ([NodeId; 3], SurfaceTerm)| {
            let SurfaceTerm::Impedance(coefficient, index) = term else { return None };
            let vertices = nodes.map(|n| mesh.point(n));
            let field = self.local(model, &model.space().triangle(nodes));
            // ½ω²Re(1/Zs), and the real part ωRe(1/Zs) of the surface coefficient.
            let factor = 0.5 * model.angular_frequency() * coefficient.re;
            let loss = model.space().elements().surface_loss(vertices, factor, field.values()).value;
            Some((index, nodes, loss))
        };
        model.surface().filter_map(of).collect()
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
        let space = model.space();
        let field = self.element(model, e);
        let mean_square = space.elements().mean_square(&space.cell(mesh, e), field.values());
        0.5 * model.angular_frequency() * eddy.im * mean_square
    }

    /// Time-averaged loss [W] of every conductor by name: meshed regions, then those replaced by their surfaces.
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
        self.surface_losses(model, mesh).into_iter().for_each(|(index, _, loss)| by_surface[index] += loss);
        losses.extend(model.conductors().iter().zip(by_surface).map(|(c, loss)| (c.name.clone(), loss)));
        losses
    }
}

/// The field at the place that a point of the open shell stands for; elsewhere as it is.
#[inline]
fn outside(model: &FieldModel, e: ElementId, lambda: &[f64; 4], field: FieldPoint) -> FieldPoint {
    match model.form().stretch_of(e) {
        Some(stretch) => {
            FieldPoint { flux_density: stretch.flux_density(lambda, field.flux_density), ..field }
        }
        None => field,
    }
}

fn all(model: &FieldModel) -> Vec<ElementId> {
    model.topology().elements().collect()
}
