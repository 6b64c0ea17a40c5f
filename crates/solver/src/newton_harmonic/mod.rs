//! Time-harmonic iron: the curve at the largest and the least `|B|` of a period ([`crate::bh`]'s `phasor`).
//!
//! It is an approximation, the fundamental alone: real iron has harmonics. The law is no complex-differentiable function, its
//! derivative is linear over the real numbers alone, and with eddy currents nothing is minimised either. Newton's steps are solved
//! by GMRES over the real numbers (`linear::gmres`), preconditioned by the complex symmetric matrix with the real part of the mean of
//! the derivative over the phases, the part of it that such a matrix can hold. With `∂F/∂u` as of a linear problem,
//! `dF = 2 Re(dᵀ du)`, the adjoint law is the conjugate of the derivative along the conjugate: the same number `Re Lᵀ dH`, for
//! the derivative is symmetric.
//!
//! Circuits stay linear. Their unknowns stand behind the field's, and a state on the way obeys their equations: the start is one
//! that does, or is made one, steps keep to them, and what GMRES sees are the rows of the field alone. Of inductive circuits the
//! residual along a step still grows with its length: `Re dᴴF δ = −L_s|δ|²`; a capacitance in series may have several states beside
//! iron (ferroresonance).

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::scalar::{axpy, norm};
use fluxmorph_geometry::fem::{CsrMatrix, c64};
use rayon::prelude::*;

use crate::bh::{PhasorLaw, Tangent};
use crate::circuit::{Equations, Excitation, SolidRows};
use crate::element::Complex3;
use crate::element::tensor::MOST_POINTS;
use crate::error::{NonConvergence, SolverError};
use crate::linear::gmres::{self, Ended};
use crate::linear::{Left, LinearSolverReport, PreparedSystem, RealLinear};
use crate::model::FieldModel;
use crate::newton::{self, NewtonObserver, NewtonProgress};
use crate::newton_steps::{Descent, MOST_STEPS, StepSystems, Verdict};
use crate::solution::{FieldSolution, FieldState};
use crate::tangents::Tangents;

mod search;

/// Elements whose integrals are held at once: some megabytes.
const CHUNK: usize = 8192;

/// A residual of a step's own system [1], at most: Newton's method need not know its direction better far from the solution.
const LOOSEST: f64 = 1e-2;

/// Applications of the tangent for one system: some tens are usual, where the curve has its knee.
const MOST_APPLICATIONS: usize = 400;

/// A residual of circuits' equations [1] above which a state is first made one that obeys them: conductors have moved.
const CONSISTENT: f64 = 1e-9;

/// Which of the two derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    State,
    Adjoint,
}

/// The law at one point of an element.
#[derive(Clone, Copy, Debug)]
struct PointLaw {
    law: PhasorLaw,
    /// `ν_r` of its linear part [m/H].
    linear: f64,
}

impl PointLaw {
    /// What a further field changes `H − ν_r B` by.
    fn derivative(&self, side: Side, of: Complex3) -> Complex3 {
        let own = match side {
            Side::State => self.law.derivative(of),
            Side::Adjoint => self.law.adjoint(of),
        };
        std::array::from_fn(|d| own[d] - self.linear * of[d])
    }

    /// The tensor of the preconditioner, less `ν_r`.
    fn tensor(&self) -> Tangent {
        let mut tensor = self.law.mean();
        (0..3).for_each(|d| tensor[d][d] -= self.linear);
        tensor
    }
}

/// The derivative of the field's equations in one state.
#[derive(Debug)]
pub(crate) struct HarmonicTangent {
    model: FieldModel,
    mesh: Mesh,
    /// Of the linear parts.
    matrix: CsrMatrix<c64>,
    /// By the elements with a law, in their order.
    points: Vec<[Option<PointLaw>; MOST_POINTS]>,
}

impl HarmonicTangent {
    /// The derivative along some unknowns, in the rows of the field; those of circuits are left as zero.
    fn apply(&self, side: Side, x: &[c64], circuits: Option<&Equations>) -> Vec<c64> {
        let count = self.model.unknown_count();
        let mut y = vec![c64::default(); count];
        self.matrix.mul(&x[..count], &mut y);
        if let Some(circuits) = circuits {
            circuits.add_loads(&x[count..].iter().map(|x| -x).collect::<Vec<_>>(), &mut y);
        }
        // Without the prescribed part of `A`, which does not change.
        let own = x[..count].to_vec();
        let change = FieldSolution::adjoint(own, LinearSolverReport { iterations: 0, residual: 0.0 });
        let law = |position: usize, point: usize, b: Complex3| {
            self.points[position][point].map_or_else(Complex3::default, |law| law.derivative(side, b))
        };
        add_strengths((&self.model, &self.mesh, &change), &law, &mut y);
        y.resize(x.len(), c64::default());
        y
    }

    /// Solves with the derivative for all unknowns, preconditioned by the system of the matrix that is nearest to it.
    fn invert(
        &self,
        side: Side,
        right_side: &[c64],
        nearest: &mut PreparedSystem,
        tolerance: f64,
    ) -> Result<(Vec<c64>, LinearSolverReport), SolverError> {
        let count = self.model.unknown_count();
        let circuits = nearest.circuits().cloned();
        let mut rest = right_side.to_vec();
        let mut first = vec![c64::default(); rest.len()];
        let mut scale = norm(right_side);
        if let Some(circuits) = &circuits {
            // What the rows of circuits ask for first: the rest is of the field alone.
            rest[..count].fill(c64::default());
            first = nearest.solve_once(&rest)?.0;
            rest = right_side[..count].to_vec();
            rest.resize(first.len(), c64::default());
            scale = norm(&rest) + circuits.size(&first[count..]);
            axpy(c64::from(-1.0), &self.apply(side, &first, Some(circuits)), &mut rest);
        }
        let mut inner = 0;
        let operator = &mut |x: &[c64]| Ok(self.apply(side, x, circuits.as_ref()));
        let preconditioner = &mut |r: &[c64]| {
            let (z, report) = nearest.solve_roughly(r)?;
            inner += report.iterations;
            Ok(z)
        };
        let left = norm(&rest);
        let share = if scale > 0.0 { left / scale } else { 0.0 };
        if share <= tolerance {
            return Ok((first, LinearSolverReport { iterations: 0, residual: share }));
        }
        let limits = (tolerance / share, MOST_APPLICATIONS);
        let (x, Ended { residual, .. }) = gmres::solve(&rest, operator, preconditioner, limits)?;
        axpy(c64::from(1.0), &x, &mut first);
        Ok((first, LinearSolverReport { iterations: inner, residual: residual * share }))
    }

    /// Whether what an adjoint solution leaves is rounding, whatever the method of the system that is nearest: there is no other one for
    /// an adjoint problem alone.
    fn is_rounding(&self, (load, solution): (&[c64], &[c64]), nearest: &mut PreparedSystem) -> bool {
        let count = self.model.unknown_count();
        let mut load = load[..count].to_vec();
        let mut residual = load.clone();
        let of_state = self.apply(Side::Adjoint, solution, nearest.circuits());
        axpy(c64::from(-1.0), &of_state[..count], &mut residual);
        let Ok((step, _)) = nearest.solve_once(&residual) else { return false };
        if let Some(circuits) = nearest.circuits() {
            circuits.add_loads(&solution[count..], &mut load);
        }
        let required = self.model.setup().linear_solver.required;
        let (load, solution, step) = (&load[..], &solution[..count], &step[..count]);
        let left = |matrix| Left { matrix, load, solution, residual: &residual, step };
        nearest.matrix().map(left).is_some_and(|left| left.is_rounding(required))
    }

    /// The tensors of the complex symmetric matrix that is nearest.
    fn tensors(&self) -> Tangents {
        let of = |points: &[Option<PointLaw>; MOST_POINTS]| {
            points.map(|point| point.map_or_else(Tangent::default, |law| law.tensor()))
        };
        Tangents::new(self.model.elements_with_a_law().to_vec(), self.points.iter().map(of).collect())
    }
}

impl RealLinear for HarmonicTangent {
    fn solve_adjoint(
        &self,
        right_side: &[c64],
        nearest: &mut PreparedSystem,
    ) -> Result<(Vec<c64>, LinearSolverReport), SolverError> {
        let settings = &self.model.setup().linear_solver;
        let (x, report) = self.invert(Side::Adjoint, right_side, nearest, settings.tolerance)?;
        let LinearSolverReport { residual, iterations } = report;
        if residual <= settings.required || self.is_rounding((right_side, &x), nearest) {
            return Ok((x, report));
        }
        let (required, cause) = (settings.required, NonConvergence::IllConditioned);
        Err(SolverError::NotConverged { residual, required, iterations, cause })
    }
}

/// Adds `∫H·curl w` over the elements with a law, for an `H` by position of the element, point and `B`.
fn add_strengths(
    (model, mesh, state): FieldState<'_>,
    strength: &(dyn Fn(usize, usize, Complex3) -> Complex3 + Sync),
    sum: &mut [c64],
) {
    let (space, elements) = (model.space(), model.elements_with_a_law());
    for (number, chunk) in elements.chunks(CHUNK).enumerate() {
        let of_element = |(k, &e): (usize, &_)| {
            let mut point = 0;
            let density = &mut |b| {
                point += 1;
                (0.0, strength(number * CHUNK + k, point - 1, b))
            };
            let field = state.element(model, e);
            space.elements().flux_integral(&space.cell(mesh, e), field.values(), density).potentials
        };
        let of_chunk: Vec<_> = chunk.par_iter().enumerate().map(of_element).collect();
        // In the order of the elements, whatever the number of threads.
        for (&e, potentials) in chunk.iter().zip(of_chunk) {
            for (&carrier, terms) in space.carriers_of(e).iter().zip(potentials.values()) {
                model.unknowns().scatter_add(sum, carrier, *terms);
            }
        }
    }
}

/// A state on the way.
struct Iterate {
    /// Those of circuits behind those of the field.
    values: Vec<c64>,
    /// In the rows of the field.
    residual: Vec<c64>,
}

/// The problem of one mesh.
struct Problem<'a> {
    model: &'a FieldModel,
    mesh: &'a Mesh,
    matrix: CsrMatrix<c64>,
    load: Vec<c64>,
    /// Net currents [A] of solid conductors, behind the load.
    of_solids: Vec<c64>,
    circuits: Option<Equations>,
}

impl<'a> Problem<'a> {
    fn new(model: &'a FieldModel, mesh: &'a Mesh) -> Self {
        let (mut load, solids) = (model.load(mesh), model.solid_rows(mesh));
        let of_solids = load.split_off(model.unknown_count());
        let circuits = Equations::new(model.windings(), solids, model.angular_frequency());
        Self { model, mesh, matrix: model.assemble(mesh), load, of_solids, circuits }
    }

    /// The load of the field with that of currents and voltages among some unknowns.
    fn load_of(&self, values: &[c64]) -> Vec<c64> {
        let mut load = self.load.clone();
        if let Some(circuits) = &self.circuits {
            circuits.add_loads(&values[load.len()..], &mut load);
        }
        load
    }

    /// The size of that load, whatever of it cancels.
    fn scale(&self, values: &[c64]) -> f64 {
        let of_circuits = self.circuits.as_ref().map(|own| own.size(&values[self.load.len()..]));
        norm(&self.load) + of_circuits.unwrap_or_default()
    }

    /// What some unknowns leave of the equations of circuits, as [`Equations::residual`] has it.
    fn residual_of_circuits(&self, values: &[c64]) -> (Vec<c64>, f64) {
        let of = |own: &Equations| own.residual(values.split_at(self.load.len()), &self.of_solids);
        self.circuits.as_ref().map(of).unwrap_or_default()
    }

    /// What solid conductors add to the matrix.
    fn solids(&self) -> SolidRows {
        self.circuits.as_ref().map(|own| own.solids().clone()).unwrap_or_default()
    }

    /// The state that some unknowns are, after so many steps and iterations, with the system for its adjoint.
    fn ended(
        &self,
        mut values: Vec<c64>,
        (steps, report): (usize, LinearSolverReport),
        (system, tangent): (PreparedSystem, HarmonicTangent),
    ) -> (FieldSolution, PreparedSystem) {
        let currents = values.split_off(self.load.len() + self.solids().count());
        let state = FieldSolution::state(values, report).with_currents(currents);
        (state.after_newton(steps), system.with_tangent(tangent))
    }

    /// The system of the matrix that is nearest to a derivative.
    fn nearest(
        &self,
        tangent: &HarmonicTangent,
        systems: &mut StepSystems<'_>,
    ) -> Result<PreparedSystem, SolverError> {
        let matrix = self.model.with_tangents(&self.matrix, &tangent.tensors(), self.mesh);
        systems.prepare((matrix, self.solids()))
    }

    /// Whether what is left in the rows of the field is rounding, and nothing lowers it.
    fn is_rounding(
        &self,
        [values, right_side, step]: [&[c64]; 3],
        (system, systems): (&PreparedSystem, &StepSystems<'_>),
    ) -> bool {
        let load = self.load_of(values);
        let [solution, residual, step] = [values, right_side, step].map(|all| &all[..load.len()]);
        let left = |matrix| Left { matrix, load: &load, solution, residual, step };
        systems.is_rounding(system.method(), system.matrix().map(left))
    }

    /// Some unknowns with their residual.
    fn at(&self, values: Vec<c64>) -> Iterate {
        let count = self.load.len();
        let mut residual = vec![c64::default(); count];
        self.matrix.mul(&values[..count], &mut residual);
        axpy(c64::from(-1.0), &self.load_of(&values), &mut residual);
        let elements = self.model.elements_with_a_law();
        let strength = |position: usize, _: usize, b: Complex3| {
            let e = elements[position];
            let curve = self.model.curve_of(e).expect("an element with a law");
            let (h, linear) = (curve.phasor(b).field_strength(), self.model.coefficients_of(e).reluctivity);
            std::array::from_fn(|d| h[d] - linear * b[d])
        };
        let state = FieldSolution::of_state(values[..count].to_vec());
        add_strengths((self.model, self.mesh, &state), &strength, &mut residual);
        Iterate { values, residual }
    }

    /// Why there is no state: what a step would change most.
    fn refused(&self, at: (usize, f64), values: &[c64], step: &[c64]) -> SolverError {
        let count = self.load.len();
        let [from, to] = [values[..count].to_vec(), sum(&values[..count], &step[..count])];
        let [from, to] = [from, to].map(FieldSolution::of_state);
        newton::refused(self.model, self.mesh, at, &from, &to)
    }

    /// Where to start: the field of the linear parts that circuits drive, and a share of that of given currents, as in statics.
    fn start(&self, systems: &mut StepSystems<'_>) -> Result<(Iterate, usize), SolverError> {
        let mut system = systems.prepare((self.matrix.clone(), self.solids()))?;
        let (values, report) = system.solve_all(&self.load)?;
        let mut driven = vec![c64::default(); self.load.len()];
        if self.circuits.is_some() {
            driven.extend(&self.of_solids);
            let (field, _, currents) = system.solve_with(&driven, Excitation::Voltages)?;
            driven = [field, currents].concat();
        }
        let driven = self.at(driven);
        let found = self.search(&driven, &values, &mut system)?;
        systems.keep(system.into_field());
        Ok((found.map_or(driven, |(start, _)| start), report.iterations))
    }

    /// The derivative at some unknowns.
    fn tangent(&self, values: &[c64]) -> HarmonicTangent {
        let (space, model) = (self.model.space(), self.model);
        let state = FieldSolution::of_state(values[..self.load.len()].to_vec());
        let of_element = |&e: &_| {
            let curve = model.curve_of(e).expect("an element with a law");
            let (mut points, mut count) = ([None; MOST_POINTS], 0);
            let density = &mut |b| {
                let linear = model.coefficients_of(e).reluctivity;
                points[count] = Some(PointLaw { law: curve.phasor(b), linear });
                count += 1;
                (0.0, [c64::default(); 3])
            };
            space.elements().flux_integral(
                &space.cell(self.mesh, e),
                state.element(model, e).values(),
                density,
            );
            points
        };
        let points = model.elements_with_a_law().par_iter().map(of_element).collect();
        HarmonicTangent { model: model.clone(), mesh: self.mesh.clone(), matrix: self.matrix.clone(), points }
    }
}

/// `a + b`
fn sum(a: &[c64], b: &[c64]) -> Vec<c64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

/// What states, with the unknowns of circuits behind those of the field, take of the load in the rows of the field, less that load.
pub(crate) fn residuals(model: &FieldModel, mesh: &Mesh, states: [Vec<c64>; 2]) -> [Vec<c64>; 2] {
    let problem = Problem::new(model, mesh);
    states.map(|values| problem.at(values).residual)
}

/// Solves the state problem of a time-harmonic model with B–H laws; also returns the system with the derivative in that state,
/// for the adjoint.
///
/// # Errors
/// [`SolverError::Newton`], and those of the linear solver.
pub(crate) fn solve(
    model: &FieldModel,
    mesh: &Mesh,
    (systems, start): (&mut StepSystems<'_>, Option<&[c64]>),
    observer: &mut NewtonObserver<'_>,
) -> Result<(FieldSolution, PreparedSystem), SolverError> {
    let problem = Problem::new(model, mesh);
    let settings = &model.setup().linear_solver;
    let mut descent = Descent::new(settings.tolerance);
    let (mut iterate, mut iterations, mut steps) = match start {
        Some(values) => (problem.at(values.to_vec()), 0, 0),
        None => {
            let (iterate, iterations) = problem.start(systems)?;
            (iterate, iterations, 1)
        }
    };
    let (mut damping, mut is_consistent) = (1.0, false);
    loop {
        let (scale, (of_circuits, worst)) =
            (problem.scale(&iterate.values), problem.residual_of_circuits(&iterate.values));
        let residual = if scale > 0.0 { norm(&iterate.residual) / scale } else { 0.0 }.max(worst);
        observer(NewtonProgress { steps, residual, energy: None, damping });
        let tangent = problem.tangent(&iterate.values);
        let mut system = problem.nearest(&tangent, systems)?;
        let mut right_side: Vec<c64> = iterate.residual.iter().map(|r| -r).collect();
        right_side.extend(of_circuits);
        if worst > CONSISTENT && !is_consistent {
            right_side[..problem.load.len()].fill(c64::default());
            let (change, _) = system.solve_once(&right_side)?;
            systems.keep(system.into_field());
            (iterate, is_consistent) = (problem.at(sum(&iterate.values, &change)), true);
            continue;
        }
        let verdict = descent.after(residual);
        let report = LinearSolverReport { iterations, residual };
        if systems.is_state(verdict, residual, system.method()) {
            return Ok(problem.ended(iterate.values, (steps, report), (system, tangent)));
        }
        // As exact as the next residual is small.
        let tolerance = residual.min(LOOSEST).max(0.1 * settings.tolerance / residual);
        let (step, LinearSolverReport { iterations: own, .. }) =
            tangent.invert(Side::State, &right_side, &mut system, tolerance)?;
        let goes_on = steps < MOST_STEPS && verdict == Verdict::Falling;
        let found =
            if goes_on { problem.search_from(&iterate, &step, (&tangent, &mut system))? } else { None };
        let Some((next, length)) = found else {
            let left = [&iterate.values[..], &right_side, &step];
            let is_state = worst <= settings.required && problem.is_rounding(left, (&system, systems));
            systems.keep(system.into_field());
            if is_state {
                let system = problem.nearest(&tangent, systems)?;
                return Ok(problem.ended(iterate.values, (steps, report), (system, tangent)));
            }
            return Err(problem.refused((steps, residual), &iterate.values, &step));
        };
        systems.keep(system.into_field());
        iterations += own;
        (steps, damping, iterate) = (steps + 1, length, next);
    }
}
