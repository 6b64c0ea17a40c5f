//! One evaluation: mesh, states, objective and constraints, gradients.

use std::time::Instant;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{Mesh, NodeId};
use fluxmorph_remesh::Moved;
use fluxmorph_solver::linear::{LinearSolverCache, Method, PreparedSystem, SolverEvent, SystemAnalysis};
use fluxmorph_solver::{FieldModel, FieldSolution, SolverError};

use super::adjoint_accumulator::{AdjointAccumulator, Solved, Work, Worst};
use super::progress::{Progress, Stage};
use super::stopwatch::Stopwatch;
use super::{Analysis, Measured, Problem, Responses, Shape, SolverCache, Timings, finite};
use crate::body::{Body, BodyForce};
use crate::constraint::{Constraint, Quantity};
use crate::error::Error;
use crate::objective::{Combination, Term};

/// Which derivatives an evaluation gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Derivatives {
    /// Values alone.
    None,
    /// Objective and constraints with their gradients, for a method of optimisation: adjoint problems are solved to
    /// [`SEARCH_ADJOINT_TOLERANCE`], or to the tolerance of the linear solver where that is larger.
    Search,
    /// The same with adjoint problems solved as the states are, for those who hold a gradient against differences of values.
    First,
}

impl Derivatives {
    /// Whether there are gradients.
    fn are_wanted(self) -> bool {
        self != Self::None
    }
}

/// Relative residual [1] of the adjoint problems of a search. Gradients differ by about as much of themselves, more where terms
/// cancel, far below what a mesh leaves of them; values, which methods compare to much smaller differences, come from states alone.
pub const SEARCH_ADJOINT_TOLERANCE: f64 = 1e-7;

/// What the states of an evaluation add up to.
struct Sums<'a> {
    /// The objective's terms in one sum, or each in its own where the worst counts.
    objective: Vec<AdjointAccumulator>,
    /// Constraints on functionals of the field, with their numbers.
    fields: Vec<(usize, &'a Term)>,
    /// One sum for each of these.
    constrained: Vec<AdjointAccumulator>,
    solutions: Vec<FieldSolution>,
    /// By state.
    methods: Vec<Option<Method>>,
    events: Vec<SolverEvent>,
}

impl Problem {
    /// Field, objective, constraints and, if wanted, gradients of a design.
    ///
    /// `cache` holds what the linear solvers keep from the designs before; it is empty where a solver failed.
    ///
    /// # Errors
    /// [`Error::Remesh`] when the mesh would break or the elastic gradient cannot be computed, [`Error::Field`] when a
    /// linear system cannot be solved, [`Error::NotFinite`] when something computed is not finite.
    ///
    /// # Panics
    /// If `p` has another length than there are variables.
    pub fn evaluate(
        &self,
        p: &[f64],
        derivatives: Derivatives,
        cache: &mut SolverCache,
        progress: &mut dyn Progress,
    ) -> Result<Analysis, Error> {
        let clock = Instant::now();
        progress.stage(Stage::Moving);
        let moved = self.moved(p)?;
        let remesh = clock.elapsed().as_secs_f64();
        let mut analysis = self.analyse(moved, derivatives, cache, progress)?;
        analysis.timings.remesh += remesh;
        Ok(analysis)
    }

    /// The second part of [`Problem::evaluate`]: on the mesh of the variables, for callers that check that mesh first.
    ///
    /// # Errors
    /// As [`Problem::evaluate`].
    pub fn analyse(
        &self,
        moved: Moved,
        derivatives: Derivatives,
        cache: &mut SolverCache,
        progress: &mut dyn Progress,
    ) -> Result<Analysis, Error> {
        let is_own_anchor = match (&self.shape, derivatives.are_wanted()) {
            (Some(shape), true) => self.anchor(shape.motion().original(), &moved.mesh, cache, progress)?,
            _ => false,
        };
        let adjoint_tolerance =
            if derivatives == Derivatives::Search { SEARCH_ADJOINT_TOLERANCE } else { 0.0 };
        let (timings, report) = (Timings::default(), Worst::default());
        let mut work = Work { mesh: &moved.mesh, adjoint_tolerance, timings, report, progress };
        let shape = self.shape.as_ref().filter(|_| derivatives.are_wanted());
        let sums = self.sum_states(&mut work, cache, shape)?;
        let Work { mut timings, report, .. } = work;
        if is_own_anchor {
            let values = |(model, state): (&FieldModel, &FieldSolution)| {
                (!model.is_linear()).then(|| state.unknowns())
            };
            cache.anchor_on(&moved.mesh, self.states.iter().zip(&sums.solutions).map(values).collect());
        }
        let mut clock = Stopwatch::start();
        let terms = self.terms();
        let values: Vec<f64> = sums.objective.iter().flat_map(|sum| sum.values.iter().copied()).collect();
        let weighted: Vec<f64> = terms.iter().zip(&values).map(|(term, value)| term.weight * value).collect();
        let differentiated = shape.filter(|_| !terms.is_empty());
        let members = self.members(&moved, differentiated, &sums, &weighted)?;
        // Which of the sums the objective is.
        let active = match &self.objective {
            Some(objective) if !members.is_empty() => objective.worst(&weighted),
            _ => 0,
        };
        let (value, gradient) = match members.get(active) {
            Some(member) => (member.value, member.gradient.clone()),
            None => {
                let pull_back =
                    |shape: &Shape| shape.pull_back("the objective", &moved, &sums.objective[0].nodal);
                (weighted.iter().sum(), differentiated.map(pull_back).transpose()?)
            }
        };
        let constraints = self.measure_constraints(&moved, shape, &sums)?;
        timings.remesh += clock.lap();
        let Sums { mut objective, solutions, methods, events, .. } = sums;
        let nodal = std::mem::take(&mut objective[active].nodal);
        let Moved { mesh, displacement, inversion, .. } = moved;
        let quality = self.quality(&mesh);
        let analysis = Analysis {
            forces: self.forces(|body, state| body.force((&self.states[state], &mesh, &solutions[state]))),
            displacement,
            inversion,
            solutions,
            objective: (!terms.is_empty()).then_some(value),
            terms: values,
            members,
            constraints,
            gradient,
            sensitivity: differentiated.map(|shape| moved_only(shape, nodal)),
            quality,
            linear_iterations: report.iterations,
            worst_residual: report.residual,
            methods,
            solver_events: events,
            timings,
            mesh,
        };
        finite::analysis(&analysis, &self.constraints)?;
        Ok(analysis)
    }

    /// Solves the states with B–H laws on the undeformed mesh, unless that has been done: others begin with these. Nothing
    /// of other designs takes part. Whether the states of `mesh`, which is that one, are to be kept so instead.
    fn anchor(
        &self,
        reference: &Mesh,
        mesh: &Mesh,
        cache: &mut SolverCache,
        progress: &mut dyn Progress,
    ) -> Result<bool, Error> {
        if self.states.iter().all(FieldModel::is_linear) || cache.is_anchored_on(reference) {
            return Ok(false);
        }
        cache.forget_anchor();
        if mesh.points() == reference.points() && cache.methods().iter().all(Option::is_none) {
            return Ok(true);
        }
        progress.stage(Stage::State);
        let state = |model: &FieldModel| -> Result<Option<Vec<c64>>, Error> {
            if model.is_linear() {
                return Ok(None);
            }
            let begin = (&mut LinearSolverCache::default(), None);
            let solved = model.solve_nonlinear(reference, begin, &mut |newton| progress.newton(newton));
            let (state, _) = solved.map_err(finite::of_field("the state of the undeformed mesh", model))?;
            Ok(Some(state.unknowns()))
        };
        let states = self.states.iter().map(state).collect::<Result<_, _>>()?;
        cache.anchor_on(reference, states);
        Ok(false)
    }

    pub(super) fn terms(&self) -> &[Term] {
        self.objective.as_ref().map_or(&[], |sum| &sum.terms)
    }

    /// Solves one state after the other, and adds up what objective and constraints have on it.
    fn sum_states(
        &self,
        work: &mut Work<'_>,
        cache: &mut SolverCache,
        shape: Option<&Shape>,
    ) -> Result<Sums<'_>, Error> {
        let groups = self.groups_of_terms();
        let nodes = work.mesh.points().len();
        let fields: Vec<(usize, &Term)> = self.field_constraints().collect();
        let mut sums = Sums {
            objective: groups.iter().map(|group| AdjointAccumulator::new(group.len(), nodes)).collect(),
            constrained: fields.iter().map(|_| AdjointAccumulator::new(1, nodes)).collect(),
            fields,
            solutions: Vec::new(),
            methods: vec![None; self.states.len()],
            events: Vec::new(),
        };
        let mut solutions: Vec<Option<FieldSolution>> = self.states.iter().map(|_| None).collect();
        for (matrix, members) in self.matrices().iter().enumerate() {
            let mut earlier: Option<(PreparedSystem, usize)> = None;
            for &index in members {
                let shared = earlier.take().and_then(|(system, k)| Some((system, solutions[k].as_ref()?)));
                let mut solved = self.solve_state(index, matrix, shared, work, cache)?;
                for (sum, group) in sums.objective.iter_mut().zip(&groups) {
                    sum.add("the objective", work, &mut solved, group, shape)?;
                }
                for (sum, (k, term)) in sums.constrained.iter_mut().zip(&sums.fields) {
                    let name = format!("the constraint `{}`", self.constraints[*k].name);
                    sum.add(&name, work, &mut solved, &[*term], shape)?;
                }
                if self.responses == Responses::OfEveryWinding && solved.model.is_linear() {
                    let mut clock = Stopwatch::start();
                    let Solved { model, system, state, .. } = &mut solved;
                    let responded = model.respond_to_every_winding(system, state);
                    responded.map_err(finite::of_field("the field of 1 A in a winding", model))?;
                    work.timings.state += clock.lap();
                }
                let Solved { system, state, .. } = solved;
                solutions[index] = Some(state);
                earlier = Some((system, index));
            }
            let (system, _) = earlier.expect("a matrix has a state");
            members.iter().for_each(|&index| sums.methods[index] = system.method());
            sums.events.extend_from_slice(system.events());
            cache.keep(matrix, system);
        }
        sums.solutions = solutions.into_iter().flatten().collect();
        Ok(sums)
    }

    /// Solves a state: with the system of another one of the same matrix, which is `shared` with that state, or with one of its
    /// own. The cache is that of the matrix.
    fn solve_state<'a>(
        &'a self,
        index: usize,
        matrix: usize,
        shared: Option<(PreparedSystem, &FieldSolution)>,
        work: &mut Work<'_>,
        cache: &mut SolverCache,
    ) -> Result<Solved<'a>, Error> {
        let model = &self.states[index];
        let (system, state) = match shared {
            None if model.is_linear() => solve_linear(model, cache.of_matrix(matrix), work)?,
            None => {
                let mut linear = std::mem::take(cache.of_matrix(matrix));
                solve_nonlinear(model, (&mut linear, cache.start(index)), work)?
            }
            Some((system, other)) => {
                let mut clock = Stopwatch::start();
                let system = model.take_over(system).map_err(finite::of_field("the state", model))?;
                work.timings.factor += clock.lap();
                let (system, state) = solve_right_side(model, system, work)?;
                (system, state.with_responses_of(other))
            }
        };
        finite::state((model, work.mesh, &state))?;
        work.report.include(&state);
        Ok(Solved { index, model, system, state })
    }

    /// The states by their matrices: lists of those that share one, each ascending, in the order of their first.
    pub(crate) fn matrices(&self) -> Vec<Vec<usize>> {
        let mut matrices: Vec<Vec<usize>> = Vec::new();
        for (index, model) in self.states.iter().enumerate() {
            match matrices.iter_mut().find(|states| self.states[states[0]].shares_matrix_with(model)) {
                Some(states) => states.push(index),
                None => matrices.push(vec![index]),
            }
        }
        matrices
    }

    /// A cache that begins with the methods that an analysis of this problem ended with, where the first choice had failed.
    pub fn cache_after(&self, analysis: &Analysis) -> SolverCache {
        let of_matrix = |members: &Vec<usize>| {
            let first_choice = self.states[members[0]].linear_solver().map(SystemAnalysis::method);
            let method = analysis.methods[members[0]];
            method.filter(|_| method != first_choice)
        };
        let methods: Vec<_> = self.matrices().iter().map(of_matrix).collect();
        // Without methods a cache has what one frequency offers the next.
        if methods.iter().all(Option::is_none) {
            return SolverCache::default();
        }
        SolverCache::with_methods(&methods)
    }

    /// Counted work of the fields of a design with their adjoints [ns]: multiplications and bytes, no clock. 0 on several ranks.
    pub fn work_of_design(&self) -> f64 {
        let analyses =
            self.matrices().into_iter().filter_map(|states| self.states[states[0]].linear_solver());
        analyses.filter_map(|analysis| analysis.work_of_design().ok()).sum()
    }

    /// What every evaluation reports of the bodies, without values.
    pub fn forces_at_rest(&self) -> Vec<BodyForce> {
        self.forces(|body, _| body.at_rest())
    }

    /// Of every body in every state, state by state.
    fn forces(&self, of: impl Fn(&Body, usize) -> BodyForce) -> Vec<BodyForce> {
        let label = |state: usize| (state > 0).then(|| self.states[state].label());
        let in_state = |state| {
            let force = |body| BodyForce { state: label(state), ..of(body, state) };
            self.bodies.iter().map(force).collect::<Vec<_>>()
        };
        (0..self.states.len()).flat_map(in_state).collect()
    }

    /// Whether what moves has left all observed places as they were.
    ///
    /// # Errors
    /// [`fluxmorph_solver::SolverError::Covered`] for one that it has reached.
    pub(crate) fn check_places(&self, mesh: &Mesh) -> Result<(), SolverError> {
        let constrained = self.field_constraints().map(|(_, term)| term);
        let mut terms = self.terms().iter().chain(constrained);
        terms.try_for_each(|term| term.functional.check_places(&self.states[0], mesh))
    }

    /// Whether the objective is the worst of its terms.
    fn is_worst_case(&self) -> bool {
        self.objective.as_ref().is_some_and(|objective| objective.combination == Combination::WorstCase)
    }

    /// The terms of a worst case with their weights.
    fn members(
        &self,
        moved: &Moved,
        differentiated: Option<&Shape>,
        sums: &Sums<'_>,
        weighted: &[f64],
    ) -> Result<Vec<Measured>, Error> {
        if !self.is_worst_case() {
            return Ok(Vec::new());
        }
        let of = |(&value, sum): (&f64, &AdjointAccumulator)| {
            let pull_back = |shape: &Shape| shape.pull_back("the objective", moved, &sum.nodal);
            Ok(Measured { value, gradient: differentiated.map(pull_back).transpose()? })
        };
        weighted.iter().zip(&sums.objective).map(of).collect()
    }

    /// The terms of the objective: in one sum, or each alone where the worst counts.
    pub(super) fn groups_of_terms(&self) -> Vec<Vec<&Term>> {
        let terms = self.terms().iter();
        if self.is_worst_case() { terms.map(|term| vec![term]).collect() } else { vec![terms.collect()] }
    }

    /// Constraints on functionals of the field, with their numbers.
    pub(super) fn field_constraints(&self) -> impl Iterator<Item = (usize, &Term)> {
        self.constraints.iter().enumerate().filter_map(|(k, constraint)| match &constraint.quantity {
            Quantity::Field(term) => Some((k, &**term)),
            _ => None,
        })
    }

    /// All constraints in their order, from the sums over the states and the mesh.
    fn measure_constraints(
        &self,
        moved: &Moved,
        differentiated: Option<&Shape>,
        sums: &Sums<'_>,
    ) -> Result<Vec<Measured>, Error> {
        let of = |(k, constraint): (usize, &Constraint)| {
            if let Some(shape) = &self.shape
                && let Some((value, gradient)) = constraint.of_shape(moved, shape)?
            {
                return Ok(Measured { value, gradient: differentiated.map(|_| gradient) });
            }
            let position = sums.fields.iter().position(|(number, _)| *number == k);
            let own = &sums.constrained[position.expect("every constraint of the field has a sum")];
            let name = format!("the constraint `{}`", constraint.name);
            let gradient =
                differentiated.map(|shape| shape.pull_back(&name, moved, &own.nodal)).transpose()?;
            Ok(Measured { value: own.values[0], gradient })
        };
        self.constraints.iter().enumerate().map(of).collect()
    }
}

/// Assembles, factors and solves a linear state.
fn solve_linear(
    model: &FieldModel,
    cache: &mut LinearSolverCache,
    work: &mut Work<'_>,
) -> Result<(PreparedSystem, FieldSolution), Error> {
    let mut clock = Stopwatch::start();
    work.progress.stage(Stage::Assembling);
    let matrix = model.assembled(work.mesh);
    work.timings.assembly += clock.lap();
    work.progress.stage(Stage::Factoring);
    let system = model.prepare_with(matrix, cache).map_err(finite::of_field("the state", model))?;
    work.timings.factor += clock.lap();
    solve_right_side(model, system, work)
}

/// Solves a linear state with its system.
fn solve_right_side(
    model: &FieldModel,
    mut system: PreparedSystem,
    work: &mut Work<'_>,
) -> Result<(PreparedSystem, FieldSolution), Error> {
    let mut clock = Stopwatch::start();
    let load = model.load(work.mesh);
    work.timings.assembly += clock.lap();
    work.progress.stage(Stage::State);
    let solved = model.solve_prepared(&mut system, &load);
    let state = solved.map_err(finite::of_field("the state", model))?;
    work.timings.state += clock.lap();
    Ok((system, state))
}

/// Solves a state with B–H laws; its factors count as part of the state.
fn solve_nonlinear(
    model: &FieldModel,
    begin: (&mut LinearSolverCache, Option<&[c64]>),
    work: &mut Work<'_>,
) -> Result<(PreparedSystem, FieldSolution), Error> {
    let mut clock = Stopwatch::start();
    work.progress.stage(Stage::State);
    let progress = &mut *work.progress;
    let solved = model.solve_nonlinear(work.mesh, begin, &mut |newton| progress.newton(newton));
    let (state, system) = solved.map_err(finite::of_field("the state", model))?;
    work.timings.state += clock.lap();
    Ok((system, state))
}

/// dF/dx without the parts along which nodes cannot move.
fn moved_only(shape: &Shape, mut nodal: Vec<Point>) -> Vec<Point> {
    for (i, g) in nodal.iter_mut().enumerate() {
        let node = NodeId::new(i);
        if shape.surface().nodes().binary_search(&node).is_ok() {
            continue;
        }
        *g = shape.motion().map().unknown_part(node, *g);
    }
    nodal
}
