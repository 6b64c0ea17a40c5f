//! Sums of functionals over the states, with one adjoint solve a state.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_solver::linear::PreparedSystem;
use fluxmorph_solver::{FieldModel, FieldSolution, FunctionalValue, adjoint};

use super::progress::{Progress, Stage};
use super::stopwatch::Stopwatch;
use super::{Shape, Timings, finite};
use crate::error::Error;
use crate::objective::Term;

/// What all states of an evaluation share.
pub(super) struct Work<'a> {
    pub(super) mesh: &'a Mesh,
    /// Relative residual [1] of adjoint problems, where that of the settings is smaller.
    pub(super) adjoint_tolerance: f64,
    pub(super) timings: Timings,
    pub(super) report: Worst,
    pub(super) progress: &'a mut dyn Progress,
}

/// One state with its factor.
pub(super) struct Solved<'a> {
    pub(super) index: usize,
    pub(super) model: &'a FieldModel,
    pub(super) system: PreparedSystem,
    pub(super) state: FieldSolution,
}

/// A sum of terms over the states.
pub(super) struct AdjointAccumulator {
    /// Value of every term without its weight.
    pub(super) values: Vec<f64>,
    /// dF/dx of the weighted sum, shape `(n_nodes, 3)`.
    pub(super) nodal: Vec<Point>,
}

impl AdjointAccumulator {
    pub(super) fn new(terms: usize, nodes: usize) -> Self {
        Self { values: vec![0.0; terms], nodal: vec![[0.0; 3]; nodes] }
    }

    /// Adds what the terms `(number, term)` of `owner` have on one state; derivatives where a shape is given, by one adjoint.
    pub(super) fn add(
        &mut self,
        owner: &str,
        work: &mut Work<'_>,
        solved: &mut Solved<'_>,
        terms: &[&Term],
        shape: Option<&Shape>,
    ) -> Result<(), Error> {
        let Solved { index, model, system, state } = solved;
        let mut clock = Stopwatch::start();
        let mut right_side: Option<Vec<c64>> = None;
        for (number, term) in terms.iter().enumerate().filter(|(_, term)| term.states.contains(index)) {
            work.timings.gradient += clock.lap();
            for &winding in term.functional.windings() {
                model.respond(system, winding, state).map_err(finite::of_term(owner, term, model))?;
                state.response(winding).into_iter().for_each(|response| work.report.include(response));
            }
            work.timings.state += clock.lap();
            let evaluated = term.functional.evaluate((model, work.mesh, state));
            let FunctionalValue { value, derivative, explicit, inductances } =
                evaluated.map_err(finite::of_term(owner, term, model))?;
            self.values[number] += value;
            let Some(shape) = shape else { continue };
            if !derivative.is_empty() {
                let sum = right_side.get_or_insert_default();
                sum.resize(sum.len().max(derivative.len()), c64::default());
                for (sum, d) in sum.iter_mut().zip(derivative) {
                    *sum += term.weight * d;
                }
            }
            self.add_nodal(term.weight, explicit.as_deref().unwrap_or_default());
            if !inductances.is_empty() {
                let moving = shape.motion().moving();
                let nodal = adjoint::inductance_gradient((model, work.mesh, state), &inductances, moving)?;
                self.add_nodal(term.weight, &nodal);
            }
        }
        work.timings.gradient += clock.lap();
        let (Some(right_side), Some(shape)) = (right_side, shape) else { return Ok(()) };
        let named = finite::of_field(&format!("the adjoint of {owner}"), model);
        work.progress.stage(Stage::Adjoint);
        let lambda = adjoint::solve_to(system, &right_side, work.adjoint_tolerance).map_err(named)?;
        work.report.include_adjoint(&lambda, work.adjoint_tolerance);
        work.timings.adjoint += clock.lap();
        work.progress.stage(Stage::Differentiating);
        let nodal = adjoint::node_gradient((model, work.mesh, state), &lambda, shape.motion().moving())?;
        self.add_nodal(1.0, &nodal);
        work.timings.gradient += clock.lap();
        Ok(())
    }

    fn add_nodal(&mut self, weight: f64, nodal: &[Point]) {
        for (sum, own) in self.nodal.iter_mut().zip(nodal) {
            for d in 0..3 {
                sum[d] += weight * own[d];
            }
        }
    }
}

/// Sum of iterations and worst residual over several solves.
#[derive(Default)]
pub(super) struct Worst {
    pub(super) iterations: usize,
    pub(super) residual: f64,
}

impl Worst {
    pub(super) fn include(&mut self, solution: &FieldSolution) {
        let report = solution.report();
        self.iterations += report.iterations;
        self.residual = self.residual.max(report.residual);
    }

    /// The residual counts where it is asked for to be that of a state.
    fn include_adjoint(&mut self, solution: &FieldSolution, tolerance: f64) {
        if tolerance > 0.0 { self.iterations += solution.report().iterations } else { self.include(solution) }
    }
}
