//! The adjoint problem and the derivative of an objective with respect to every node position.
//!
//! `K λ = ∂F/∂u` with the same complex symmetric matrix as the state, hence the same factor, and
//!
//! `dF/dx = −2 Re( λᵀ (∂K/∂x u − ∂f/∂x) )`;
//!
//! `∂f/∂x` is that of magnets alone: elements that meet a coil do not move. The part of `dF/dx` at fixed potentials
//! comes with the functional itself.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, Tet4};
use fluxmorph_geometry::{ElementId, Mesh, NodeId};
use rayon::prelude::*;

use crate::element::lagrange::Lagrange;
use crate::element::{Complex3, impedance, interface, point};
use crate::error::SolverError;
use crate::linear::{LinearSolverReport, PreparedSystem};
use crate::model::FieldModel;
use crate::solution::FieldSolution;
use crate::space::Order;
use crate::surface::SurfaceTerm;

/// Solves the adjoint problem with the state's prepared system for `∂F/∂u` ([`crate::functional`]).
///
/// # Errors
/// As [`PreparedSystem::solve`].
pub fn solve(system: &PreparedSystem, derivative: &[c64]) -> Result<FieldSolution, SolverError> {
    let (values, report): (Vec<c64>, LinearSolverReport) = system.solve(derivative)?;
    Ok(FieldSolution::adjoint(values, report))
}

/// `dF/dx` at every node [unit of F per m], shape `(n_nodes, 3)`; of tetrahedra, only the `moving` ones contribute.
///
/// `moving` lists the elements of which a node may move, ascending; the derivative at nodes that other elements share
/// is incomplete, and those nodes must be held.
pub fn node_gradient(
    model: &FieldModel,
    mesh: &Mesh,
    state: &FieldSolution,
    adjoint: &FieldSolution,
    moving: &[ElementId],
) -> Vec<Point> {
    match model.space().order() {
        Order::Linear => {
            let shapes = (Lagrange::<4, 4>::tet(), Lagrange::<3, 3>::triangle());
            gradient_of_order(shapes, |triangle| triangle, (model, mesh), (state, adjoint), moving)
        }
        Order::Quadratic => {
            let shapes = (Lagrange::<10, 4>::tet(), Lagrange::<6, 3>::triangle());
            let nodes_of = |triangle| model.space().quadratic_triangle(triangle);
            gradient_of_order(shapes, nodes_of, (model, mesh), (state, adjoint), moving)
        }
    }
}

/// [`node_gradient`] on elements with `N` and faces with `F` nodes.
fn gradient_of_order<const N: usize, const F: usize>(
    (tet_shape, face_shape): (&'static Lagrange<N, 4>, &'static Lagrange<F, 3>),
    nodes_of: impl Fn([NodeId; 3]) -> [NodeId; F],
    (model, mesh): (&FieldModel, &Mesh),
    (state, adjoint): (&FieldSolution, &FieldSolution),
    moving: &[ElementId],
) -> Vec<Point> {
    let topology = model.topology();
    let mut gradient = vec![[0.0; 3]; topology.node_count()];
    let mut add = |nodes: &[NodeId], terms: &[Complex3], factor: f64| {
        for (node, term) in nodes.iter().zip(terms) {
            for d in 0..3 {
                gradient[node.index()][d] += factor * term[d].re;
            }
        }
    };
    let contributions: Vec<[Complex3; 4]> = moving
        .par_iter()
        .map(|&e| {
            let (tet, law) = (Tet4::new(mesh.vertices(e)), model.coefficients_of(e));
            let (l, u) = (adjoint.element_field(model, e), state.element_field(model, e));
            point::shape_derivative(tet_shape, &tet, law, &l, &u)
        })
        .collect();
    for (&e, terms) in moving.iter().zip(&contributions) {
        add(&topology.tet(e), terms, -2.0);
    }
    let magnets =
        model.sources().shape_derivatives(tet_shape, mesh, moving, |e| adjoint.element_field(model, e));
    for (e, terms) in magnets {
        add(&topology.tet(e), &terms, 2.0);
    }
    for (triangle, term) in model.surface() {
        let field = |s: &FieldSolution| s.nodal_field(model, nodes_of(triangle)).vector_potential;
        let vertices = triangle.map(|n| mesh.point(n));
        add(&triangle, &surface_derivative(face_shape, vertices, term, &field(adjoint), &field(state)), -2.0);
    }
    gradient
}

/// `∂/∂x_k (λᵀ M u)` of one surface term.
fn surface_derivative<const N: usize>(
    shape: &Lagrange<N, 3>,
    vertices: [Point; 3],
    term: SurfaceTerm,
    adjoint: &[Complex3; N],
    state: &[Complex3; N],
) -> [Complex3; 3] {
    match term {
        SurfaceTerm::Interface(jump) => interface::shape_derivative(shape, jump, adjoint, state),
        SurfaceTerm::Impedance(coefficient, _) => {
            impedance::shape_derivative(shape, vertices, coefficient, adjoint, state)
        }
    }
}
