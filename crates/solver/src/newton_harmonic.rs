//! Time-harmonic iron: the curve at the largest and the least `|B|` of a period ([`crate::bh`]'s `phasor`).
//!
//! It is an approximation, the fundamental alone: real iron has harmonics. The law is no complex-differentiable function, its
//! derivative is linear over the real numbers alone, and with eddy currents nothing is minimised either. Newton's steps are solved
//! by GMRES over the real numbers (`linear::gmres`), preconditioned by the complex symmetric matrix with the real part of the mean of
//! the derivative over the phases, the part of it that such a matrix can hold. With `∂F/∂u` as of a linear problem,
//! `dF = 2 Re(dᵀ du)`, the adjoint law is the conjugate of the derivative along the conjugate: the same number `Re Lᵀ dH`, for
//! the derivative is symmetric.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::scalar::{axpy, norm, ordered_sum};
use fluxmorph_geometry::fem::{CsrMatrix, c64};
use rayon::prelude::*;

use crate::bh::{PhasorLaw, Tangent};
use crate::element::Complex3;
use crate::element::tensor::MOST_POINTS;
use crate::error::{NonConvergence, SolverError};
use crate::line_search;
use crate::linear::gmres::{self, Ended};
use crate::linear::{FieldSystem, Left, LinearSolverReport, PreparedSystem, RealLinear};
use crate::model::FieldModel;
use crate::newton::{self, NewtonObserver, NewtonProgress};
use crate::newton_steps::{Descent, MOST_STEPS, StepSystems, Verdict};
use crate::solution::FieldSolution;
use crate::tangents::Tangents;

/// Elements whose integrals are held at once: some megabytes.
const CHUNK: usize = 8192;

/// Halvings of one step: Newton's direction lowers the residual, so that one of them is short enough.
const MOST_HALVINGS: usize = 12;

/// The part of the promised decrease of the residual that is asked for (Nocedal and Wright: 1e-4).
const ARMIJO: f64 = 1e-4;

/// A residual of a step's own system [1], at most: Newton's method need not know its direction better far from the solution.
const LOOSEST: f64 = 1e-2;

/// Applications of the tangent for one system: some tens are usual, where the curve has its knee.
const MOST_APPLICATIONS: usize = 400;

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
    /// The derivative along some unknowns.
    fn apply(&self, side: Side, x: &[c64]) -> Vec<c64> {
        let mut y = vec![c64::default(); x.len()];
        self.matrix.mul(x, &mut y);
        // Without the prescribed part of `A`, which does not change.
        let change = FieldSolution::adjoint(x.to_vec(), LinearSolverReport { iterations: 0, residual: 0.0 });
        let law = |position: usize, point: usize, b: Complex3| {
            self.points[position][point].map_or_else(Complex3::default, |law| law.derivative(side, b))
        };
        add_strengths(&self.model, &self.mesh, &change, &law, &mut y);
        y
    }

    /// Solves with the derivative, preconditioned by a system of the matrix that is nearest to it.
    fn invert(
        &self,
        side: Side,
        right_side: &[c64],
        nearest: &mut FieldSystem,
        tolerance: f64,
    ) -> Result<(Vec<c64>, LinearSolverReport), SolverError> {
        let mut inner = 0;
        let operator = &mut |x: &[c64]| Ok(self.apply(side, x));
        let preconditioner = &mut |r: &[c64]| {
            let (z, report) = nearest.solve_once(r)?;
            inner += report.iterations;
            Ok(z)
        };
        let limits = (tolerance, MOST_APPLICATIONS);
        let (x, Ended { residual, .. }) = gmres::solve(right_side, operator, preconditioner, limits)?;
        Ok((x, LinearSolverReport { iterations: inner, residual }))
    }

    /// Whether what an adjoint solution leaves is rounding, whatever the method of the system that is nearest: there is no other one for
    /// an adjoint problem alone.
    fn is_rounding(&self, (load, solution): (&[c64], &[c64]), nearest: &mut FieldSystem) -> bool {
        let mut residual = load.to_vec();
        axpy(c64::from(-1.0), &self.apply(Side::Adjoint, solution), &mut residual);
        let Ok((step, _)) = nearest.solve_once(&residual) else { return false };
        let required = self.model.setup().linear_solver.required;
        let left = |matrix| Left { matrix, load, solution, residual: &residual, step: &step };
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
        nearest: &mut FieldSystem,
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
    model: &FieldModel,
    mesh: &Mesh,
    state: &FieldSolution,
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
    values: Vec<c64>,
    residual: Vec<c64>,
}

/// The problem of one mesh.
struct Problem<'a> {
    model: &'a FieldModel,
    mesh: &'a Mesh,
    matrix: CsrMatrix<c64>,
    load: Vec<c64>,
}

impl Problem<'_> {
    /// Some unknowns with their residual.
    fn at(&self, values: Vec<c64>) -> Iterate {
        let mut residual = vec![c64::default(); values.len()];
        self.matrix.mul(&values, &mut residual);
        axpy(c64::from(-1.0), &self.load, &mut residual);
        let elements = self.model.elements_with_a_law();
        let strength = |position: usize, _: usize, b: Complex3| {
            let e = elements[position];
            let curve = self.model.curve_of(e).expect("an element with a law");
            let (h, linear) = (curve.phasor(b).field_strength(), self.model.coefficients_of(e).reluctivity);
            std::array::from_fn(|d| h[d] - linear * b[d])
        };
        let state = FieldSolution::of_state(values.clone());
        add_strengths(self.model, self.mesh, &state, &strength, &mut residual);
        Iterate { values, residual }
    }

    /// Where to start: a share of the field of the linear parts, as in statics.
    fn start(&self, systems: &mut StepSystems<'_>) -> Result<(Iterate, usize), SolverError> {
        let mut system = systems.prepare(self.matrix.clone())?;
        let (values, report) = system.solve_field(&self.load)?;
        let zero = self.at(vec![c64::default(); self.load.len()]);
        let mut nearest = system.into_field();
        let found = self.search(&zero, &values, &mut nearest)?;
        systems.keep(nearest);
        Ok((found.map_or(zero, |(start, _)| start), report.iterations))
    }

    /// The derivative at some unknowns.
    fn tangent(&self, values: &[c64]) -> HarmonicTangent {
        let (space, model) = (self.model.space(), self.model);
        let state = FieldSolution::of_state(values.to_vec());
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

    /// A length of a step that lowers the residual, first the one at which it has next to no part along the step: a new iterate with
    /// it. The residual is measured by `Re rᴴS⁻¹r` with the matrix `S` that is nearest to the derivative, as an error of the field:
    /// unlike its plain norm that does not ask saturated iron, whose reluctivity is a thousand times that of the rest, to come first.
    fn search(
        &self,
        from: &Iterate,
        step: &[c64],
        nearest: &mut FieldSystem,
    ) -> Result<Option<(Iterate, f64)>, SolverError> {
        let product = |a: &[c64], b: &[c64]| ordered_sum(a.len(), |i| a[i].re * b[i].re + a[i].im * b[i].im);
        let mut measure = |residual: &[c64]| -> Result<f64, SolverError> {
            Ok(product(residual, &nearest.solve_once(residual)?.0))
        };
        let place = |length: f64| {
            let mut values = from.values.clone();
            axpy(c64::from(length), step, &mut values);
            self.at(values)
        };
        let along = line_search::longest_useful(product(&from.residual, step), |length| {
            let trial = place(length);
            (product(&trial.residual, step), trial)
        });
        if along.is_level {
            return Ok(Some((along.state, along.length)));
        }
        let before = measure(&from.residual)?;
        let (mut length, mut trial) = (along.length, along.state);
        for _ in 0..MOST_HALVINGS {
            if measure(&trial.residual)? <= (1.0 - ARMIJO * length.min(1.0)) * before {
                return Ok(Some((trial, length)));
            }
            length *= 0.5;
            trial = place(length);
        }
        Ok(None)
    }
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
    let problem = Problem { model, mesh, matrix: model.assemble(mesh), load: model.load(mesh) };
    let (scale, settings) = (norm(&problem.load), &model.setup().linear_solver);
    let mut descent = Descent::new(settings.tolerance);
    let (mut iterate, mut iterations, mut steps) = match start {
        Some(values) => (problem.at(values.to_vec()), 0, 0),
        None => {
            let (iterate, iterations) = problem.start(systems)?;
            (iterate, iterations, 1)
        }
    };
    let mut damping = 1.0;
    loop {
        let residual = if scale > 0.0 { norm(&iterate.residual) / scale } else { 0.0 };
        observer(NewtonProgress { steps, residual, energy: None, damping });
        let tangent = problem.tangent(&iterate.values);
        let nearest = model.with_tangents(&problem.matrix, &tangent.tensors(), mesh);
        let system = systems.prepare(nearest)?;
        let verdict = descent.after(residual);
        if systems.is_state(verdict, residual, system.method()) {
            let report = LinearSolverReport { iterations, residual };
            let state = FieldSolution::state(iterate.values, report).after_newton(steps);
            return Ok((state, system.with_tangent(tangent)));
        }
        let mut field = system.into_field();
        let right_side: Vec<c64> = iterate.residual.iter().map(|r| -r).collect();
        // As exact as the next residual is small.
        let tolerance = residual.min(LOOSEST).max(0.1 * settings.tolerance / residual);
        let (step, report) = tangent.invert(Side::State, &right_side, &mut field, tolerance)?;
        let goes_on = steps < MOST_STEPS && verdict == Verdict::Falling;
        let found = if goes_on { problem.search(&iterate, &step, &mut field)? } else { None };
        let Some((next, length)) = found else {
            let (load, solution) = (&problem.load[..], &iterate.values[..]);
            let left = |matrix| Left { matrix, load, solution, residual: &right_side, step: &step };
            let is_state = systems.is_rounding(field.method(), field.matrix().map(left));
            systems.keep(field);
            if is_state {
                let nearest = model.with_tangents(&problem.matrix, &tangent.tensors(), mesh);
                let report = LinearSolverReport { iterations, residual };
                let state = FieldSolution::state(iterate.values, report).after_newton(steps);
                return Ok((state, systems.prepare(nearest)?.with_tangent(tangent)));
            }
            let mut values = iterate.values.clone();
            axpy(c64::from(1.0), &step, &mut values);
            let [from, to] = [iterate.values, values].map(FieldSolution::of_state);
            return Err(newton::refused(model, mesh, (steps, residual), &from, &to));
        };
        systems.keep(field);
        iterations += report.iterations;
        (steps, damping, iterate) = (steps + 1, length, next);
    }
}
