//! The adjoint problem and the derivative of an objective with respect to every node position.
//!
//! `K λ = ∂F/∂u` with the same complex symmetric matrix as the state, hence the same factor, and
//!
//! `dF/dx = −2 Re( λᵀ (∂K/∂x u − ∂f/∂x) )`;
//!
//! `∂f/∂x` is that of magnets alone: elements that meet a coil do not move. The part of `dF/dx` at fixed potentials
//! comes with the functional itself. A functional of inductances `L_jk = F_jᵀ K⁻¹ F_k` needs no adjoint: the responses `K⁻¹F` to
//! 1 A are state and adjoint in one.

use std::collections::BTreeMap;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, NodeId, Topology};
use rayon::prelude::*;

use crate::element::Complex3;
use crate::error::SolverError;
use crate::linear::{LinearSolverReport, PreparedSystem};
use crate::nonlinear;
use crate::solution::{FieldSolution, FieldState};
use crate::surface::SurfaceTerm;

/// Solves the adjoint problem with the state's prepared system for `∂F/∂u` ([`crate::functional`]).
///
/// # Errors
/// As [`PreparedSystem::solve`].
pub fn solve(system: &mut PreparedSystem, derivative: &[c64]) -> Result<FieldSolution, SolverError> {
    solve_to(system, derivative, 0.0)
}

/// As [`solve`], to a relative residual [1] that may be larger than the settings'. The derivative of the objective differs by about
/// as much of itself.
///
/// # Errors
/// As [`PreparedSystem::solve`].
pub fn solve_to(
    system: &mut PreparedSystem,
    derivative: &[c64],
    tolerance: f64,
) -> Result<FieldSolution, SolverError> {
    let (values, report): (Vec<c64>, LinearSolverReport) = system.solve_to(tolerance, derivative)?;
    Ok(FieldSolution::adjoint(values, report))
}

/// `dF/dx` at every node [unit of F per m], shape `(n_nodes, 3)`; of tetrahedra, only the `moving` ones contribute.
///
/// `moving` lists the elements of which a node may move, ascending; the derivative at nodes that other elements share
/// is incomplete, and those nodes must be held. The mesh is the one that the state was solved on.
///
/// # Errors
/// [`SolverError::Rank`] where the problem is distributed.
pub fn node_gradient(
    (model, mesh, state): FieldState<'_>,
    adjoint: &FieldSolution,
    moving: &[ElementId],
) -> Result<Vec<Point>, SolverError> {
    match model.distributed() {
        Some(distributed) => {
            distributed.node_gradient(state.is_state(), [state.values(), adjoint.values()], moving)
        }
        None => Ok(gradient_of((model, mesh, state), adjoint, &Extent { moving, triangles: None })),
    }
}

/// `dF/dx` at every node [unit of F per m], shape `(n_nodes, 3)`, of a function of inductances by its derivatives
/// ([`crate::FunctionalValue::inductances`]): `−2 Re Σ ∂F/∂L_jk W_jᵀ ∂K/∂x W_k` with the responses `W` that the state holds.
///
/// # Errors
/// As [`node_gradient`].
///
/// # Panics
/// Where the state lacks a response, which the functional's value needs too.
pub fn inductance_gradient(
    (model, mesh, state): FieldState<'_>,
    derivatives: &[(usize, usize, c64)],
    moving: &[ElementId],
) -> Result<Vec<Point>, SolverError> {
    let response = |k: usize| state.response(k).expect("the value was computed from it");
    let mut by_second: BTreeMap<usize, Vec<c64>> = BTreeMap::new();
    for &(j, k, derivative) in derivatives {
        let first = response(j);
        let sum = by_second.entry(k).or_insert_with(|| vec![c64::default(); first.values().len()]);
        sum.iter_mut().zip(first.values()).for_each(|(sum, w)| *sum += derivative * w);
    }
    let mut gradient = vec![[0.0; 3]; mesh.points().len()];
    for (k, sum) in by_second {
        let weighted = FieldSolution::adjoint(sum, response(k).report());
        let own = node_gradient((model, mesh, response(k)), &weighted, moving)?;
        gradient.iter_mut().zip(own).for_each(|(sum, own)| (0..3).for_each(|d| sum[d] += own[d]));
    }
    Ok(gradient)
}

/// What contributes to a gradient.
pub(crate) struct Extent<'a> {
    /// Elements, ascending.
    pub(crate) moving: &'a [ElementId],
    /// Triangles with a surface term by number, ascending; `None` for all.
    pub(crate) triangles: Option<&'a [usize]>,
}

/// The contribution of some elements and triangles to [`node_gradient`], shape `(n_nodes, 3)`.
pub(crate) fn gradient_of(
    (model, mesh, state): FieldState<'_>,
    adjoint: &FieldSolution,
    &Extent { moving, triangles }: &Extent<'_>,
) -> Vec<Point> {
    let (topology, space) = (model.topology(), model.space());
    let elements = space.elements();
    let contributions: Vec<[Point; 4]> = moving
        .par_iter()
        .map(|&e| {
            let law = model.coefficients_of(e);
            let (l, u) = (adjoint.element(model, e), state.element(model, e));
            let cell = space.cell(mesh, e);
            let mut terms = elements.shape_derivative(&cell, law, l.values(), u.values());
            if let Some(curve) = model.curve_of(e) {
                let response = |l, u| nonlinear::response(curve, law.reluctivity, l, u);
                let added = elements.flux_shape_derivative(&cell, l.values(), u.values(), &response);
                terms.iter_mut().flatten().zip(added.as_flattened()).for_each(|(sum, term)| *sum += term);
            }
            scale(-2.0, &terms)
        })
        .collect();
    let mut gradient = sum_by_node(topology, moving, &contributions);
    let mut add = |nodes: &[NodeId], terms: &[Point]| {
        for (node, term) in nodes.iter().zip(terms) {
            for d in 0..3 {
                gradient[node.index()][d] += term[d];
            }
        }
    };
    if state.is_state() {
        let magnets = model.sources().shape_derivatives(space, mesh, moving, |e| adjoint.element(model, e));
        for (e, terms) in magnets {
            add(&topology.tet(e), &scale(2.0, &terms));
        }
    }
    let all = model.surface();
    let surface: Vec<([NodeId; 3], SurfaceTerm)> = match triangles {
        None => all.collect(),
        Some(own) => {
            all.enumerate().filter(|(t, _)| own.binary_search(t).is_ok()).map(|(_, term)| term).collect()
        }
    };
    let contributions: Vec<[Point; 3]> = surface
        .par_iter()
        .map(|&(triangle, term)| {
            let carriers = space.triangle(triangle);
            let (l, u) = (adjoint.local(model, &carriers), state.local(model, &carriers));
            let vertices = triangle.map(|n| mesh.point(n));
            scale(-2.0, &elements.surface_derivative(vertices, term, l.values(), u.values()))
        })
        .collect();
    for ((triangle, _), terms) in surface.iter().zip(&contributions) {
        add(triangle, terms);
    }
    gradient
}

/// The real part of some terms, times a factor.
#[inline]
fn scale<const M: usize>(factor: f64, terms: &[Complex3; M]) -> [Point; M] {
    terms.map(|term| term.map(|c| factor * c.re))
}

/// The sum at every node of the contributions of the elements around it, shape `(n_nodes, 3)`.
///
/// `elements` is ascending and has one contribution each. Every node gathers its own in ascending order of the elements:
/// the bits do not depend on the threads.
fn sum_by_node(topology: &Topology, elements: &[ElementId], contributions: &[[Point; 4]]) -> Vec<Point> {
    const NOT_LISTED: u32 = u32::MAX;
    let mut position = vec![NOT_LISTED; topology.tets().len()];
    for (i, e) in (0..).zip(elements) {
        position[e.index()] = i;
    }
    let sum_at = |node: NodeId| {
        let mut sum = [0.0; 3];
        for &e in topology.elements_around(node) {
            let i = position[e.index()];
            if i == NOT_LISTED {
                continue;
            }
            for (n, term) in topology.tet(e).iter().zip(&contributions[i as usize]) {
                if *n == node {
                    for d in 0..3 {
                        sum[d] += term[d];
                    }
                }
            }
        }
        sum
    };
    let nodes: Vec<NodeId> = topology.nodes().collect();
    nodes.into_par_iter().map(sum_at).collect()
}

#[cfg(test)]
mod tests {
    use fluxmorph_geometry::generate::{BlockParameters, block};

    use super::*;

    #[test]
    fn gathered_contributions_have_the_bits_of_a_serial_sum_for_any_number_of_threads() {
        let mesh =
            block(&BlockParameters { cells: [4, 3, 5], ..BlockParameters::default() }).expect("a block");
        let topology = mesh.topology();
        let elements: Vec<ElementId> = topology.elements().filter(|e| e.index() % 7 != 3).collect();
        let term = |i: usize| (0.37 * i as f64).sin() * 1e3_f64.powi(i as i32 % 5);
        let contributions: Vec<[Point; 4]> = (0..elements.len())
            .map(|i| std::array::from_fn(|a| std::array::from_fn(|d| term(12 * i + 3 * a + d))))
            .collect();
        let mut serial = vec![[0.0; 3]; topology.node_count()];
        for (&e, terms) in elements.iter().zip(&contributions) {
            for (node, term) in topology.tet(e).iter().zip(terms) {
                for d in 0..3 {
                    serial[node.index()][d] += term[d];
                }
            }
        }
        for threads in [1, 2, 4] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            assert_eq!(pool.install(|| sum_by_node(topology, &elements, &contributions)), serial);
        }
    }
}
