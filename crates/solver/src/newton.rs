//! Magnetostatics with B–H laws: the minimum of the energy by Newton's method.
//!
//! The state minimises `W(A) = ∫w(|B|) − ∫T·B` (with the penalty of nodal elements), which is convex. Newton's steps have the
//! exact tangent; a step is as long as the energy falls along it, about (`line_search`), and halved until the energy falls by a small
//! part of what its slope promises (Armijo; Nocedal and Wright, Numerical Optimization, 2006, section 3.1). The start is the field of the linear parts, or what the caller gives: the
//! field on the undeformed mesh of a run, so that a state is a function of mesh, model and that field, and not of the designs
//! before. Within one solution a factor serves as long as it pays.

use fluxmorph_geometry::fem::scalar::{axpy, dot, norm};
use fluxmorph_geometry::fem::{CsrMatrix, c64};
use fluxmorph_geometry::tet4::centroid;
use fluxmorph_geometry::{ElementId, Mesh};

use crate::element::amplitude;
use crate::error::SolverError;
use crate::line_search::{self, Along};
use crate::linear::{Goal, Left, LinearSolverReport, PreparedSystem};
use crate::model::FieldModel;
use crate::newton_steps::{Descent, MOST_STEPS, StepSystems, Verdict, failure};
use crate::nonlinear::{self, Added};
use crate::solution::FieldSolution;

/// Halvings of one step: the energy is convex, so that one of them is short enough unless rounding is all that is left.
const MOST_HALVINGS: usize = 30;

/// The part of the promised decrease that is asked for (Nocedal and Wright: 1e-4).
const ARMIJO: f64 = 1e-4;

/// Rounding of the energy relative to its terms: sums over some thousand elements.
const ENERGY_ROUNDING: f64 = 1e-13;

/// The same where elements are nearly flat, whose fluxes are small differences of large circulations. A step that can gain less is
/// judged by the slope, which is the difference that an energy would have to be taken of (Hager and Zhang, SIAM J. Optim. 16 (2005)
/// 170, approximate Wolfe conditions).
const ENERGY_NOISE: f64 = 1e-9;

/// Relative residual [1] above which the solution for a step is refused where it should be smaller: right sides that are rounding
/// themselves have no better solution.
const REQUIRED_OF_A_STEP: f64 = 1e-6;

/// A residual of a step's own system [1], at most: the method need not know its direction better far from the solution.
const LOOSEST: f64 = 1e-2;

/// How exact a step from a relative residual is to be: as the next residual is small, so that the method stays quadratic, and no
/// more than the last one needs (Dembo, Eisenstat and Steihaug, SIAM J. Numer. Anal. 19 (1982) 400).
fn goal_of_a_step(model: &FieldModel, residual: f64) -> Goal {
    let settings = &model.setup().linear_solver;
    let tolerance = residual.min(LOOSEST).max(0.1 * settings.tolerance / residual).max(settings.tolerance);
    Goal { tolerance, required: tolerance.max(REQUIRED_OF_A_STEP).max(settings.required) }
}

/// Where Newton's method stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewtonProgress {
    /// Linear systems solved.
    pub steps: usize,
    /// `|residual| / |load|`.
    pub residual: f64,
    /// `W` [J]; `None` in harmonics, where eddy currents leave nothing that is minimised.
    pub energy: Option<f64>,
    /// Length of the last step over Newton's own.
    pub damping: f64,
}

/// Watches the steps.
pub type NewtonObserver<'a> = dyn FnMut(NewtonProgress) + 'a;

/// A state on the way.
struct Iterate {
    solution: FieldSolution,
    energy: f64,
    /// What rounding may do to the energy.
    rounding: f64,
    added: Added,
    /// `K u − f` and what the laws add.
    residual: Vec<c64>,
}

impl Iterate {
    /// The state that it is, after so many steps.
    fn into_state(self, report: LinearSolverReport, steps: usize) -> FieldSolution {
        FieldSolution::state(self.solution.values().to_vec(), report).after_newton(steps)
    }
}

/// The problem of one mesh.
struct Energy<'a> {
    model: &'a FieldModel,
    mesh: &'a Mesh,
    /// Of the linear parts.
    matrix: CsrMatrix<c64>,
    load: Vec<c64>,
}

impl<'a> Energy<'a> {
    fn new(model: &'a FieldModel, mesh: &'a Mesh) -> Self {
        Self { model, mesh, matrix: model.assemble(mesh), load: model.load(mesh) }
    }

    /// Energy and residual of some unknowns.
    fn at(&self, values: Vec<c64>) -> Iterate {
        let mut residual = vec![c64::default(); values.len()];
        self.matrix.mul(&values, &mut residual);
        let (quadratic, work) = (0.5 * dot(&values, &residual).re, dot(&values, &self.load).re);
        let solution = FieldSolution::of_state(values);
        let added = nonlinear::added((self.model, self.mesh, &solution));
        axpy(c64::from(-1.0), &self.load, &mut residual);
        axpy(c64::from(1.0), &added.residual, &mut residual);
        Iterate {
            energy: quadratic - work + added.energy,
            rounding: ENERGY_ROUNDING * (quadratic.abs() + work.abs() + added.energy.abs()),
            solution,
            added,
            residual,
        }
    }

    /// Where to start: the share of the field of the linear parts that has the least energy. Newton's step from zero has the initial
    /// permeability, far below the largest, and creeps along the foot of a curve.
    fn start(&self, systems: &mut StepSystems<'_>) -> Result<(Iterate, usize), SolverError> {
        let mut system = systems.prepare(self.matrix.clone())?;
        let (values, report) = system.solve_within(goal_of_a_step(self.model, 1.0), &self.load)?;
        systems.keep(system.into_field());
        let zero = self.at(vec![c64::default(); self.load.len()]);
        let found = self.search(&zero, &values);
        Ok((found.map_or(zero, |(start, _)| start), report.iterations))
    }

    /// A length of a step that lowers the energy, and nearly as much as any: a new iterate with it.
    fn search(&self, from: &Iterate, step: &[c64]) -> Option<(Iterate, f64)> {
        let slope = dot(&from.residual, step).re;
        let place = |length: f64| {
            let mut values = from.solution.values().to_vec();
            axpy(c64::from(length), step, &mut values);
            self.at(values)
        };
        let falls = |trial: &Iterate, length: f64| {
            trial.energy <= from.energy + ARMIJO * length * slope + from.rounding
        };
        // What rounding alone may do no energy can judge: it is Newton's own step, and the residual says what it was worth.
        if slope.abs() <= from.rounding {
            return Some((place(1.0), 1.0));
        }
        let Along { mut length, is_level, state: mut trial, .. } =
            line_search::longest_useful(slope, |length| {
                let trial = place(length);
                (dot(&trial.residual, step).re, trial)
            });
        if is_level && -slope <= ENERGY_NOISE / ENERGY_ROUNDING * from.rounding {
            return Some((trial, length));
        }
        for _ in 0..MOST_HALVINGS {
            if falls(&trial, length) {
                return Some((trial, length));
            }
            length *= 0.5;
            trial = place(length);
        }
        None
    }
}

/// What states take of the load, less that load.
pub(crate) fn residuals(model: &FieldModel, mesh: &Mesh, states: [Vec<c64>; 2]) -> [Vec<c64>; 2] {
    let energy = Energy::new(model, mesh);
    states.map(|values| energy.at(values).residual)
}

/// Solves the state problem of a model with B–H laws; also returns the system with the tangent in that state, for the adjoint.
///
/// # Errors
/// [`SolverError::Newton`], and those of the linear solver.
pub(crate) fn solve(
    model: &FieldModel,
    mesh: &Mesh,
    (systems, start): (&mut StepSystems<'_>, Option<&[c64]>),
    observer: &mut NewtonObserver<'_>,
) -> Result<(FieldSolution, PreparedSystem), SolverError> {
    let problem = Energy::new(model, mesh);
    let scale = norm(&problem.load);
    let mut descent = Descent::new(model.setup().linear_solver.tolerance);
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
        observer(NewtonProgress { steps, residual, energy: Some(iterate.energy), damping });
        let tangent = model.with_tangents(&problem.matrix, &iterate.added.tangents, mesh);
        let mut system = systems.prepare(tangent)?;
        let verdict = descent.after(residual);
        if systems.is_state(verdict, residual, system.method()) {
            return Ok((iterate.into_state(LinearSolverReport { iterations, residual }, steps), system));
        }
        let right_side: Vec<c64> = iterate.residual.iter().map(|r| -r).collect();
        let (step, report) = system.solve_within(goal_of_a_step(model, residual), &right_side)?;
        let goes_on = steps < MOST_STEPS && verdict == Verdict::Falling;
        let found = if goes_on { problem.search(&iterate, &step) } else { None };
        let Some((next, length)) = found else {
            let (method, solution) = (system.method(), iterate.solution.values());
            let left =
                |matrix| Left { matrix, load: &problem.load, solution, residual: &right_side, step: &step };
            if systems.is_least(residual, method) || systems.is_rounding(method, system.matrix().map(left)) {
                return Ok((iterate.into_state(LinearSolverReport { iterations, residual }, steps), system));
            }
            systems.keep(system.into_field());
            let mut values = iterate.solution.values().to_vec();
            axpy(c64::from(1.0), &step, &mut values);
            let to = FieldSolution::of_state(values);
            return Err(refused(model, mesh, (steps, residual), &iterate.solution, &to));
        };
        systems.keep(system.into_field());
        iterations += report.iterations;
        (steps, damping, iterate) = (steps + 1, length, next);
    }
}

/// Why there is no state: what a step from one to another would change most.
pub(crate) fn refused(
    model: &FieldModel,
    mesh: &Mesh,
    (steps, residual): (usize, f64),
    from: &FieldSolution,
    to: &FieldSolution,
) -> SolverError {
    let (element, flux_density) = least_settled(model, mesh, from, to);
    let region = model.topology().region_of()[element.index()];
    SolverError::Newton {
        steps,
        residual,
        region: model.topology().region_names()[region.index()].clone(),
        place: centroid(mesh.vertices(element)),
        flux_density,
        failure: failure(residual),
    }
}

/// The element with a law whose `B` a step changes most, and its `|B|` [T] before.
fn least_settled(
    model: &FieldModel,
    mesh: &Mesh,
    from: &FieldSolution,
    to: &FieldSolution,
) -> (ElementId, f64) {
    let elements = model.elements_with_a_law();
    let fields = |of: &FieldSolution| of.flux_densities_of(model, mesh, elements);
    let mut worst = (elements[0], 0.0, -1.0);
    for ((&e, a), b) in elements.iter().zip(fields(from)).zip(fields(to)) {
        let change = amplitude(&std::array::from_fn(|d| b[d] - a[d]));
        if change > worst.2 {
            worst = (e, amplitude(&a), change);
        }
    }
    (worst.0, worst.1)
}

#[cfg(test)]
mod tests {
    use fluxmorph_geometry::generate::{BlockParameters, block};

    use super::*;
    use crate::{FieldModelSetup, Material};

    #[test]
    fn a_step_is_as_exact_as_the_next_residual_is_small_and_the_last_one_needs() {
        let mesh = block(&BlockParameters { size: [0.2; 3], cells: [2; 3] }).expect("a mesh");
        let setup = FieldModelSetup { materials: vec![Material::AIR], ..FieldModelSetup::default() };
        let model = FieldModel::new(&mesh, setup).expect("a sound problem");
        let goals = [3.0, 1e-4, 1e-7, 2e-11].map(|residual| goal_of_a_step(&model, residual));
        // Quadratic until a tenth of 1e-11 over the residual is more.
        assert_eq!(goals.map(|goal| goal.tolerance), [1e-2, 1e-4, 1e-5, 0.05]);
        assert!(
            goals.iter().all(|goal| goal.required >= goal.tolerance && goal.required >= REQUIRED_OF_A_STEP)
        );
    }
}
