//! A field of one order more on the same mesh, near one that is known: what the error of a functional is estimated from.
//!
//! The first-order field `u` is one of the second-order space too. There, with the residual `r = f − K u`,
//!
//! ```text
//! F(u⁺) − F(u) = [F(u + e) − F(u)] + 2 Re zᵀ(r − K e),   K e ≈ r,   K z ≈ ∂F/∂u
//! ```
//!
//! up to the product of what both approximations lack, so that few iterations do: the dual-weighted residual (Becker and
//! Rannacher, Acta Numerica 10 (2001) 1) with both errors taken from one order more. `∂F/∂u` is taken half way, where it is
//! exact for a quadratic `F`. Since `r` vanishes on the first-order space, `2 Re zᵀr` comes from the functions that only the
//! second order has, and `Σ_i 2 Re z_i r_i` over those of an element's carriers says where the error is made. A functional of a
//! recovered field is another function of `u` in second order: `F(u)` is that of first order, `F(u + e)` and `∂F/∂u` that of second.
//!
//! With B–H curves `e` comes from Newton's method with its line search, until the residual is a thousandth of the load; `K` is
//! the tangent at `u + e`, and what is weighed is the residual that is left there.
//!
//! Does not live here: sums over terms and frequencies, and what is done with the number.

use std::collections::BTreeMap;

use fluxmorph_geometry::fem::{CsrMatrix, c64};
use fluxmorph_geometry::{CarrierId, ElementId, Mesh};

use crate::circuit::Excitation;
use crate::elements::{ElementFamily, Order};
use crate::error::SolverError;
use crate::linear::{LinearSolver, LinearSolverCache, LinearSolverSettings, Method, PreparedSystem, Reuse};
use crate::model::FieldModel;
use crate::prolongation::{ScalarSpace, injection, prolongation};
use crate::setup::FieldModelSetup;
use crate::solution::FieldSolution;
use crate::unknowns::Unknowns;

/// Relative residual of the corrections. The error of a field may be a hundred times its residual; at a thousandth the product
/// of both is still below a hundredth of the estimate.
const TOLERANCE: f64 = 1e-3;

/// Relative residual above which a correction is none.
const REQUIRED: f64 = 1e-2;

/// Iterations after which the corrections are given up, and where they may take any effort. A dozen or two are usual.
const MOST_ITERATIONS: [usize; 2] = [300, 3000];

/// Evaluations that the iterations of an affordable estimate may cost.
const MOST_EVALUATIONS: f64 = 6.0;

/// Counted work that is affordable whatever an evaluation costs [ns]: ten seconds.
const ALWAYS_AFFORDABLE: f64 = 1e10;

/// Solutions with the nearest matrix that a step of Newton's method takes along a B–H curve above 0 Hz, in units of the longest of
/// them: of a dozen most are rough.
const SOLUTIONS_OF_A_STEP: f64 = 4.0;

/// How much an estimate may cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Iterations of as much work as six evaluations of a linear state, or ten seconds; along a B–H curve for every step of Newton's
    /// method.
    Affordable,
    /// As much as it takes.
    Any,
}

/// The second-order system near a first-order field.
#[derive(Debug)]
pub struct Enrichment {
    model: FieldModel,
    system: PreparedSystem,
    prolongation: CsrMatrix<f64>,
    field: Vec<c64>,
    residual: Vec<c64>,
    /// What the correction leaves of it.
    rest: Vec<c64>,
    correction: Vec<c64>,
    /// Currents that voltages drive [A]: of the first order, and their corrections.
    currents: [Vec<c64>; 2],
    /// By the place of a winding.
    responses: BTreeMap<usize, Response>,
    iterations: usize,
}

/// The response to 1 A in a winding.
#[derive(Debug)]
struct Response {
    /// Of the first order.
    field: Vec<c64>,
    residual: Vec<c64>,
    correction: Vec<c64>,
}

/// A first-order field corrected.
struct Corrected {
    /// With the matrix, or the tangent, that duals are solved with.
    system: PreparedSystem,
    residual: Vec<c64>,
    rest: Vec<c64>,
    correction: Vec<c64>,
    driven: Vec<c64>,
    iterations: usize,
}

/// What the dual problem says.
#[derive(Clone, Debug, PartialEq)]
pub struct WeightedResidual {
    /// `2 Re zᵀ(r − K e)` [unit of F]; with B–H curves the residual of `u + e` in place of `r − K e`.
    pub remainder: f64,
    /// What every element adds to `2 Re zᵀr` [unit of F], shape `(n_tets,)`.
    pub by_element: Vec<f64>,
}

impl FieldModel {
    /// The same problem in second order on the undeformed mesh, for which this model was made, to be solved roughly and with so much effort.
    ///
    /// # Errors
    /// As [`FieldModel::new`]; [`SolverError::Parameter`] where there is no higher order, or several ranks, and for nodal elements at
    /// re-entrant edges of walls.
    pub fn enriched(&self, mesh: &Mesh, effort: Effort) -> Result<Self, SolverError> {
        let refuse = |what: &str, value: &str, expected: &str| SolverError::Parameter {
            what: what.to_owned(),
            value: value.to_owned(),
            expected: expected.to_owned(),
        };
        if self.setup().order != Order::Linear {
            return Err(refuse("order", "2", "first order: there is no third one to estimate an error from"));
        }
        if self.has_reentrant_walls() {
            return Err(refuse(
                "elements",
                "nodal, beside a re-entrant edge of a wall that no flux passes",
                "edge elements: the walls' term of nodal ones differs between the orders, and an estimate says too little",
            ));
        }
        if self.setup().ownership.is_some() {
            return Err(refuse("ranks", "several", "one process for an error estimate"));
        }
        let most_work = match (effort, self.linear_solver()) {
            // Half for each of the two corrections.
            (Effort::Affordable, Some(own)) => {
                let is_iterated = !self.is_linear() && self.angular_frequency() > 0.0;
                let solutions = if is_iterated { SOLUTIONS_OF_A_STEP } else { 1.0 };
                0.5 * (MOST_EVALUATIONS * own.work_of(2)?).max(ALWAYS_AFFORDABLE) / solutions
            }
            _ => f64::INFINITY,
        };
        let linear_solver = LinearSolverSettings {
            most_work,
            method: LinearSolver::Fixed(Method::TwoLevel),
            tolerance: TOLERANCE,
            required: REQUIRED,
            max_iterations: Some(MOST_ITERATIONS[usize::from(effort == Effort::Any)]),
            // No fallback: a factor of second order would cost more than the estimate is worth.
            factor_bytes: 0,
            reuse: Reuse::Never,
            ..self.setup().linear_solver
        };
        let setup = FieldModelSetup { order: Order::Quadratic, linear_solver, ..self.setup().clone() };
        Self::with_sources(mesh, setup, Some(self))
    }
}

impl Corrected {
    /// Where all is linear.
    fn in_one_step(
        model: &FieldModel,
        mesh: &Mesh,
        (field, currents): (&[c64], &[c64]),
        shared: Option<Enrichment>,
    ) -> Result<Self, SolverError> {
        let mut system = match shared {
            Some(other) => model.take_over(other.system)?,
            None => model.prepare(model.assembled(mesh))?,
        };
        let mut residual = model.load(mesh);
        model.windings().add_driven_load(currents, &mut residual);
        system.subtract_product(field, &mut residual);
        // First-order functions are second-order ones, so that the circuits' equations hold as they did.
        let (correction, report, driven) = system.solve_with(&residual, Excitation::Given(&[]))?;
        let mut rest = residual.clone();
        model.windings().add_driven_load(&driven, &mut rest);
        system.subtract_product(&correction, &mut rest);
        Ok(Self { system, residual, rest, correction, driven, iterations: report.iterations })
    }

    /// With B–H curves: the second-order state itself, as far as a thousandth of the load, and the tangent there. One step from the
    /// first-order field is none of it where iron is saturated: beyond the knee it overshoots, and what is left of the residual is
    /// no small part.
    fn by_newton(
        model: &FieldModel,
        mesh: &Mesh,
        (field, currents): (&[c64], &[c64]),
    ) -> Result<Self, SolverError> {
        let first = [field, currents].concat();
        let from = (&mut LinearSolverCache::default(), Some(&first[..]));
        let (state, system) = model.solve_nonlinear(mesh, from, &mut |_| {})?;
        let less = |u: &[c64], first: &[c64]| u.iter().zip(first).map(|(u, first)| u - first).collect();
        let [residual, rest] = model.nonlinear_residuals(mesh, [first, state.unknowns()]);
        Ok(Self {
            system,
            residual,
            rest,
            correction: less(state.values(), field),
            driven: less(state.currents(), currents),
            iterations: state.report().iterations,
        })
    }
}

impl Enrichment {
    /// The correction of a state of `coarse` on a mesh; `model` is [`FieldModel::enriched`] of it, and `shared` is of another state on
    /// that mesh whose model has the same matrix.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve`].
    pub fn new(
        coarse: &FieldModel,
        model: FieldModel,
        (mesh, state): (&Mesh, &FieldSolution),
        shared: Option<Self>,
    ) -> Result<Self, SolverError> {
        let fine = model.unknowns();
        let prolongation = match model.space().family() {
            ElementFamily::Nodal => prolongation(coarse.unknowns(), model.space(), fine, ScalarSpace::Linear),
            ElementFamily::Edge => injection(coarse.unknowns(), fine),
        };
        let mut field = vec![c64::default(); fine.dofs.count()];
        prolongation.mul(&state.values()[..coarse.unknown_count()], &mut field);
        field.extend(state.solid_unknowns(coarse));
        let currents = state.currents().to_vec();
        let Corrected { system, residual, rest, correction, driven, iterations } = if model.is_linear() {
            Corrected::in_one_step(&model, mesh, (&field, &currents), shared)?
        } else {
            Corrected::by_newton(&model, mesh, (&field, &currents))?
        };
        Ok(Self {
            model,
            system,
            prolongation,
            field,
            residual,
            rest,
            correction,
            currents: [currents, driven],
            responses: BTreeMap::new(),
            iterations,
        })
    }

    /// The correction of the response to 1 A in a winding; again only where it is not known yet.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve`].
    pub fn respond(&mut self, winding: usize, coarse: &FieldSolution) -> Result<(), SolverError> {
        if self.responses.contains_key(&winding) {
            return Ok(());
        }
        let (of_first, of_solids) = coarse.values().split_at(self.prolongation.structure.column_count);
        let mut field = vec![c64::default(); self.model.unknown_count()];
        self.prolongation.mul(of_first, &mut field);
        field.extend(of_solids);
        let mut residual = self.model.windings().load(winding).to_vec();
        residual.resize(field.len(), c64::default());
        self.system.subtract_product(&field, &mut residual);
        let (correction, report) = self.system.solve_field(&residual)?;
        self.iterations += report.iterations;
        self.responses.insert(winding, Response { field, residual, correction });
        Ok(())
    }

    /// What each element adds to the error of a function of inductances with these derivatives
    /// ([`crate::FunctionalValue::inductances`]): `2 Re Σ ∂F/∂L_jk (W_j⁺ − W_j)ᵀ r_k`, by the functions that only the second order has.
    pub fn weigh_inductances(&self, coarse: &FieldModel, derivatives: &[(usize, usize, c64)]) -> Vec<f64> {
        let mut sum = vec![0.0; self.model.space().element_count()];
        for (j, k, derivative) in derivatives {
            let (Some(first), Some(second)) = (self.responses.get(j), self.responses.get(k)) else {
                continue;
            };
            let with = |(u, e): (&c64, &c64)| u + e;
            let dual = first.field.iter().zip(&first.correction).map(with).collect();
            let surplus = self.without_first_order(coarse.unknowns(), dual);
            let terms = surplus.iter().zip(&second.residual);
            let weighted: Vec<f64> = terms.map(|(z, r)| 2.0 * (derivative * z * r).re).collect();
            sum.iter_mut().zip(self.by_element(&weighted)).for_each(|(sum, own)| *sum += own);
        }
        sum
    }

    /// The second-order model.
    pub fn model(&self) -> &FieldModel {
        &self.model
    }

    /// Iterations of all corrections so far.
    pub fn iterations(&self) -> usize {
        self.iterations
    }

    /// The state with a share of its correction: 0 is the first-order field, 1 nearly that of second order.
    pub fn state(&self, share: f64) -> FieldSolution {
        let sum =
            |u: &[c64], e: &[c64]| -> Vec<c64> { u.iter().zip(e).map(|(u, e)| u + share * e).collect() };
        let currents = sum(&self.currents[0], &self.currents[1]);
        let mut state = FieldSolution::of_state(sum(&self.field, &self.correction)).with_currents(currents);
        for (winding, response) in &self.responses {
            let values = sum(&response.field, &response.correction);
            state.respond(*winding, FieldSolution::adjoint(values, state.report()));
        }
        state
    }

    /// Weighs the residual with the solution of the dual problem for `∂F/∂u` at half the correction.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve`].
    pub fn weigh(
        &mut self,
        coarse: &FieldModel,
        derivative: &[c64],
    ) -> Result<WeightedResidual, SolverError> {
        let (dual, report) = self.system.solve(derivative)?;
        self.iterations += report.iterations;
        let remainder = dual.iter().zip(&self.rest).map(|(z, r)| 2.0 * (z * r).re).sum();
        let surplus = self.without_first_order(coarse.unknowns(), dual);
        let weighted: Vec<f64> = surplus.iter().zip(&self.residual).map(|(z, r)| 2.0 * (z * r).re).collect();
        Ok(WeightedResidual { remainder, by_element: self.by_element(&weighted) })
    }

    /// What only the second order has of some values: first-order functions have theirs at the same carriers.
    fn without_first_order(&self, coarse: &Unknowns, mut values: Vec<c64>) -> Vec<c64> {
        let fine = &self.model.unknowns().dofs;
        let mut at_carriers = vec![c64::default(); coarse.dofs.count()];
        for carrier in (0..coarse.dofs.carrier_count()).map(CarrierId::new) {
            for component in 0..4 {
                let equations = (coarse.dofs.equation(carrier, component), fine.equation(carrier, component));
                if let (Some(coarse), Some(fine)) = equations {
                    at_carriers[coarse] = values[fine];
                }
            }
        }
        let mut first = vec![c64::default(); fine.count()];
        self.prolongation.mul(&at_carriers, &mut first);
        values.iter_mut().zip(first).for_each(|(value, first)| *value -= first);
        values
    }

    /// Values of unknowns as sums over elements: every carrier gives equal shares to the elements that have it.
    fn by_element(&self, weighted: &[f64]) -> Vec<f64> {
        let (space, dofs) = (self.model.space(), &self.model.unknowns().dofs);
        let elements = || (0..space.element_count()).map(ElementId::new);
        let mut around = vec![0u32; space.carrier_count()];
        elements().for_each(|e| space.carriers_of(e).iter().for_each(|c| around[c.index()] += 1));
        let share = |&carrier: &CarrierId| -> f64 {
            let own = (0..4).filter_map(|component| dofs.equation(carrier, component));
            own.map(|equation| weighted[equation]).sum::<f64>() / f64::from(around[carrier.index()])
        };
        elements().map(|e| space.carriers_of(e).iter().map(share).sum()).collect()
    }
}
