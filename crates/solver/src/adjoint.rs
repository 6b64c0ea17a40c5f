//! The adjoint problem and the derivative of an objective with respect to every node position.
//!
//! `K λ = ∂F/∂u` with the same complex symmetric matrix as the state, hence the same factor, and
//!
//! `dF/dx = −2 Re( λᵀ (∂K/∂x u − ∂f/∂x) )`;
//!
//! `∂f/∂x` vanishes because elements that meet a coil do not move, `∂F/∂x` because the observation cells do not.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, Tet4};
use fluxmorph_geometry::{ElementId, Mesh};
use rayon::prelude::*;

use crate::element::volume;
use crate::element::{Complex3, impedance, interface};
use crate::error::SolverError;
use crate::linear::{LinearSolverReport, PreparedSystem};
use crate::model::{FieldModel, SurfaceTerm};
use crate::objective::ObjectiveValue;
use crate::solution::FieldSolution;

/// Solves the adjoint problem with the state's prepared system.
///
/// # Errors
/// As [`PreparedSystem::solve`].
pub fn solve(system: &PreparedSystem, objective: &ObjectiveValue) -> Result<FieldSolution, SolverError> {
    let (values, report): (Vec<c64>, LinearSolverReport) = system.solve(&objective.derivative)?;
    Ok(FieldSolution::new(values, report))
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
    let topology = model.topology();
    let contributions: Vec<[Complex3; 4]> = moving
        .par_iter()
        .map(|&e| {
            volume::shape_derivative(
                &Tet4::new(mesh.vertices(e)),
                model.coefficients_of(e),
                &adjoint.nodal_field(model, e),
                &state.nodal_field(model, e),
            )
        })
        .collect();
    let mut gradient = vec![[0.0; 3]; topology.node_count()];
    let mut add = |node: fluxmorph_geometry::NodeId, term: Complex3| {
        for d in 0..3 {
            gradient[node.index()][d] -= 2.0 * term[d].re;
        }
    };
    for (&e, terms) in moving.iter().zip(&contributions) {
        for (node, term) in topology.tet(e).into_iter().zip(terms) {
            add(node, *term);
        }
    }
    for (nodes, term) in model.surface() {
        let vector_potential = |s: &FieldSolution| {
            nodes.map(|n| {
                let [x, y, z, _] = s.potentials(model, n);
                [x, y, z]
            })
        };
        let (l, u) = (vector_potential(adjoint), vector_potential(state));
        let terms = match term {
            SurfaceTerm::Interface(jump) => interface::shape_derivative(jump, &l, &u),
            SurfaceTerm::Impedance(coefficient, _) => {
                impedance::shape_derivative(nodes.map(|n| mesh.point(n)), coefficient, &l, &u)
            }
        };
        for (node, term) in nodes.into_iter().zip(terms) {
            add(node, term);
        }
    }
    gradient
}
