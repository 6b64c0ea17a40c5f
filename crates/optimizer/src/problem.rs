//! The optimisation problem as a function: design variables in, objective, constraints and exact gradients out.
//!
//! `p → Δx_b → Δx (Eq. 3) → mesh → state u → F`, and back: `λ → dF/dx → transposed map → dF/dp`. Within a round the
//! reference mesh and the elastic factor are fixed, so `F(p)` is one function and not a path; [`Shape::motion`] holds the
//! round. A problem owns one state a frequency; the
//! objective costs one adjoint solve a state whatever the number of its terms, each constraint of the field another.
//! Nothing here knows an optimiser, a file or a terminal.

use std::time::Instant;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::quality::QualityReport;
use fluxmorph_geometry::ranks::Share;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, Mesh, NodeId};
use fluxmorph_remesh::{Limits, Motion, Moved, RemeshError, StepToInversion};
use fluxmorph_solver::linear::{PreparedSystem, SolverEvent};
use fluxmorph_solver::{FieldModel, FieldSolution, FunctionalValue, adjoint};

use crate::constraint::{Bound, Constraint, Limit, Quantity};
use crate::design::DesignSurface;
use crate::error::Error;
use crate::finite;
use crate::lap::Lap;
use crate::memory::Memory;
use crate::objective::{Term, WeightedSum};
use crate::stage::{Stage, Told};
use crate::thickness::Thickness;

/// What moves, how the mesh follows, and within which bounds.
#[derive(Debug)]
pub struct Shape {
    /// Design variables to surface.
    pub surface: DesignSurface,
    /// Surface to mesh (Eq. 3) in the present round.
    pub motion: Motion,
    /// How far a design may lie from the reference of its round, and how many rounds there may be.
    pub limits: Limits,
    /// Thickness of the designed body, where it has one.
    pub thickness: Option<Thickness>,
    /// Lower bound of every variable [m].
    pub lower: Vec<f64>,
    /// Upper bound of every variable [m].
    pub upper: Vec<f64>,
    /// Where the optimisation starts [m].
    pub initial: Vec<f64>,
}

/// Objective, constraints, states and shape on a reference mesh.
#[derive(Debug)]
pub struct Problem {
    /// The undeformed mesh.
    pub original: Mesh,
    /// One field problem per state, in the order of the analysis' frequencies; at least one.
    pub states: Vec<FieldModel>,
    /// What is optimised; `None` for a field analysis without objective.
    pub objective: Option<WeightedSum>,
    /// What must keep within bounds; empty without a shape.
    pub constraints: Vec<Constraint>,
    /// What moves; `None` for a field analysis without design.
    pub shape: Option<Shape>,
    /// The ranks among which the work is shared out; `None` for one process.
    pub share: Option<Share>,
}

/// Wall time of the parts of an evaluation [s].
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Timings {
    /// Elastic solves, forward and transposed, and the mesh check.
    pub remesh: f64,
    /// Assembly of matrix and load.
    pub assembly: f64,
    /// Factorisation.
    pub factor: f64,
    /// State iterations.
    pub state: f64,
    /// Adjoint iterations.
    pub adjoint: f64,
    /// Objective, element derivatives and their sums.
    pub gradient: f64,
}

impl std::ops::AddAssign for Timings {
    fn add_assign(&mut self, other: Self) {
        self.remesh += other.remesh;
        self.assembly += other.assembly;
        self.factor += other.factor;
        self.state += other.state;
        self.adjoint += other.adjoint;
        self.gradient += other.gradient;
    }
}

/// The field of one design.
#[derive(Debug)]
pub struct Analysis {
    /// The moved mesh.
    pub mesh: Mesh,
    /// Displacement of every node from the undeformed mesh [m], shape `(n_nodes, 3)`.
    pub displacement: Vec<Point>,
    /// First inversion along the motion from the round's reference, as a multiple of it.
    pub inversion: StepToInversion,
    /// One solution per state.
    pub solutions: Vec<FieldSolution>,
    /// The objective, if the problem has one.
    pub objective: Option<f64>,
    /// The terms of the objective without their weights, each summed over its states.
    pub terms: Vec<f64>,
    /// What the constraints measure, in their order.
    pub constraints: Vec<Measured>,
    /// dF/dp [unit of F per m], if asked for.
    pub gradient: Option<Vec<f64>>,
    /// dF/dx at the nodes that may move [unit of F per m], if asked for; shape `(n_nodes, 3)`.
    pub sensitivity: Option<Vec<Point>>,
    /// Quality of the elements that may move; of all elements where nothing moves.
    pub quality: QualityReport,
    /// Iterations of the linear solver, state and adjoint.
    pub linear_iterations: usize,
    /// Largest true relative residual of the linear solves.
    pub worst_residual: f64,
    /// Methods of the linear solver that failed, and what took their place.
    pub solver_events: Vec<SolverEvent>,
    /// Where the time went.
    pub timings: Timings,
}

/// The value of what a constraint measures.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The value, in SI.
    pub value: f64,
    /// Its derivative by the design variables [unit per m], if asked for.
    pub gradient: Option<Vec<f64>>,
}

/// Whether the adjoint problems are solved too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Want {
    /// The objective alone.
    Value,
    /// Objective and constraints with their gradients.
    Gradient,
}

impl Problem {
    /// The mesh of a design in the present round; the undeformed one where nothing moves.
    ///
    /// # Errors
    /// [`RemeshError::Inverted`] says which element breaks and how far the step may go.
    ///
    /// # Panics
    /// If `p` has another length than there are variables.
    pub fn moved(&self, p: &[f64]) -> Result<Moved, RemeshError> {
        match &self.shape {
            Some(shape) => shape.motion.moved(&shape.displacement(p)),
            None => Ok(Moved {
                mesh: self.original.clone(),
                displacement: vec![[0.0; 3]; self.original.points().len()],
                inversion: StepToInversion::NEVER,
            }),
        }
    }

    /// Elements of which a node may move, ascending; empty without a shape.
    pub fn moving_elements(&self) -> &[ElementId] {
        self.shape.as_ref().map_or(&[], |shape| shape.motion.moving())
    }

    /// Quality of the elements that may move, or of all where nothing moves.
    pub fn quality(&self, mesh: &Mesh) -> QualityReport {
        match &self.shape {
            Some(shape) => shape.motion.quality(mesh),
            None => QualityReport::of_mesh(mesh).expect("a mesh has elements"),
        }
    }

    /// Field, objective, constraints and, if wanted, gradients of a design.
    ///
    /// # Errors
    /// [`Error::Remesh`] when the mesh would break, [`Error::Field`] when a linear system cannot be solved,
    /// [`Error::NotFinite`] when what is computed is no number.
    pub fn evaluate(&self, p: &[f64], want: Want) -> Result<Analysis, Error> {
        self.evaluate_with(&mut Memory::default(), p, want)
    }

    /// As [`Problem::evaluate`], with what the linear solvers remember of the design before.
    ///
    /// # Errors
    /// As [`Problem::evaluate`]; the memory is then empty where the solver failed.
    pub fn evaluate_with(&self, memory: &mut Memory, p: &[f64], want: Want) -> Result<Analysis, Error> {
        let clock = Instant::now();
        let moved = self.moved(p)?;
        let remesh = clock.elapsed().as_secs_f64();
        let mut analysis = self.analyse_with(memory, p, moved, want)?;
        analysis.timings.remesh += remesh;
        Ok(analysis)
    }

    /// As [`Problem::evaluate`] on a mesh made before for the variables `p`.
    ///
    /// # Errors
    /// As [`Problem::evaluate`]; [`Error::Remesh`] where the elastic gradient cannot be computed.
    pub fn analyse(&self, p: &[f64], moved: Moved, want: Want) -> Result<Analysis, Error> {
        self.analyse_with(&mut Memory::default(), p, moved, want)
    }

    /// As [`Problem::analyse`], with what the linear solvers remember of the design before.
    ///
    /// # Errors
    /// As [`Problem::analyse`]; the memory is then empty where the solver failed.
    pub fn analyse_with(
        &self,
        memory: &mut Memory,
        p: &[f64],
        moved: Moved,
        want: Want,
    ) -> Result<Analysis, Error> {
        self.analyse_watched(memory, p, moved, want, &mut |_| ())
    }

    /// As [`Problem::analyse_with`]; `told` hears of every stage as it begins.
    ///
    /// # Errors
    /// As [`Problem::analyse_with`].
    pub fn analyse_watched(
        &self,
        memory: &mut Memory,
        p: &[f64],
        moved: Moved,
        want: Want,
        told: Told<'_>,
    ) -> Result<Analysis, Error> {
        let Moved { mesh, displacement, inversion } = moved;
        let mut work = Work { mesh: &mesh, timings: Timings::default(), report: Worst::default(), told };
        let mut events = Vec::new();
        let shape = self.shape.as_ref().filter(|_| want == Want::Gradient);
        let mut solutions = Vec::with_capacity(self.states.len());
        let terms: &[Term] = self.objective.as_ref().map_or(&[], |sum| &sum.terms);
        let all: Vec<(usize, &Term)> = terms.iter().enumerate().collect();
        let mut objective = Gathered::new(terms.len(), mesh.points().len());
        let fields: Vec<(usize, &Term)> = self.field_constraints().collect();
        let mut constrained: Vec<Gathered> =
            fields.iter().map(|_| Gathered::new(1, mesh.points().len())).collect();
        for (index, model) in self.states.iter().enumerate() {
            let mut clock = Lap::start();
            (work.told)(Stage::Assembling);
            let (matrix, load) = (model.assembled(&mesh), model.load(&mesh));
            work.timings.assembly += clock.lap();
            let named = || finite::of_field("the state", model);
            (work.told)(Stage::Factoring);
            let mut system = model.prepare_with(matrix, memory.of_state(index)).map_err(named())?;
            work.timings.factor += clock.lap();
            (work.told)(Stage::State);
            let state = model.solve_prepared(&mut system, &load).map_err(named())?;
            finite::state(model, &mesh, &state)?;
            work.report.include(&state);
            work.timings.state += clock.lap();
            let mut solved = Solved { index, model, system, state };
            objective.add("the objective", &mut work, &mut solved, &all, shape)?;
            for (gathered, (k, term)) in constrained.iter_mut().zip(&fields) {
                let name = format!("the constraint `{}`", self.constraints[*k].name);
                gathered.add(&name, &mut work, &mut solved, &[(0, *term)], shape)?;
            }
            let Solved { system, state, .. } = solved;
            events.extend_from_slice(system.events());
            memory.keep(index, system);
            solutions.push(state);
        }
        let Work { mut timings, report, .. } = work;
        let mut clock = Lap::start();
        let value = terms.iter().zip(&objective.values).map(|(term, value)| term.weight * value).sum();
        let differentiated = shape.filter(|_| !terms.is_empty());
        let gradient =
            differentiated.map(|shape| shape.pull_back("the objective", &objective.nodal)).transpose()?;
        let constraints = self.measure_constraints(p, &mesh, shape, &fields, &constrained)?;
        timings.remesh += clock.lap();
        let sensitivity = differentiated.map(|shape| moved_only(shape, objective.nodal));
        let quality = self.quality(&mesh);
        let analysis = Analysis {
            mesh,
            displacement,
            inversion,
            solutions,
            objective: (!terms.is_empty()).then_some(value),
            terms: objective.values,
            constraints,
            gradient,
            sensitivity,
            quality,
            linear_iterations: report.iterations,
            worst_residual: report.residual,
            solver_events: events,
            timings,
        };
        finite::analysis(&analysis, &self.constraints)?;
        Ok(analysis)
    }

    /// Bounds of the constraints; a share of the initial design's value costs its analysis, unless that is `p`.
    ///
    /// # Errors
    /// As [`Problem::evaluate`], and [`Error::Constraint`].
    pub fn bounds(&self, p: &[f64], analysis: &Analysis) -> Result<Vec<Bound>, Error> {
        let Some(shape) = self.shape.as_ref().filter(|_| !self.constraints.is_empty()) else {
            return Ok(Vec::new());
        };
        let share = |constraint: &Constraint| matches!(constraint.limit, Limit::AtMostRatio(_));
        let initial;
        let measured = if p != shape.initial && self.constraints.iter().any(share) {
            // Of the undeformed mesh's motion, as a run has it, and not of the round around `p`.
            initial = self.analyse(&shape.initial, shape.from_undeformed(&shape.initial)?, Want::Value)?;
            &initial.constraints
        } else {
            &analysis.constraints
        };
        self.constraints.iter().zip(measured).map(|(constraint, m)| constraint.bound(m.value)).collect()
    }

    /// Constraints on functionals of the field, with their numbers.
    fn field_constraints(&self) -> impl Iterator<Item = (usize, &Term)> {
        self.constraints.iter().enumerate().filter_map(|(k, constraint)| match &constraint.quantity {
            Quantity::Field(term) => Some((k, term)),
            _ => None,
        })
    }

    /// All constraints in their order, from what was gathered of the field, from the mesh and from the variables.
    fn measure_constraints(
        &self,
        p: &[f64],
        mesh: &Mesh,
        wanted: Option<&Shape>,
        fields: &[(usize, &Term)],
        gathered: &[Gathered],
    ) -> Result<Vec<Measured>, Error> {
        let Some(shape) = &self.shape else { return Ok(Vec::new()) };
        let of = |(k, constraint): (usize, &Constraint)| {
            if let Some((value, gradient)) = constraint.of_shape(p, mesh, shape)? {
                return Ok(Measured { value, gradient: wanted.map(|_| gradient) });
            }
            let position = fields.iter().position(|(number, _)| *number == k);
            let own = &gathered[position.expect("every constraint of the field was gathered")];
            let name = format!("the constraint `{}`", constraint.name);
            let gradient = wanted.map(|shape| shape.pull_back(&name, &own.nodal)).transpose()?;
            Ok(Measured { value: own.values[0], gradient })
        };
        self.constraints.iter().enumerate().map(of).collect()
    }
}

impl Shape {
    /// Displacement of the design nodes from the undeformed mesh [m], shape `(n_design, 3)`.
    ///
    /// # Panics
    /// If `p` has another length than there are variables.
    pub fn displacement(&self, p: &[f64]) -> Vec<Point> {
        assert_eq!(p.len(), self.surface.variable_count(), "one value a variable");
        self.surface.displacement(p)
    }

    /// The round that begins at a design: `reference` is its mesh, `displacement` that of every node from the undeformed
    /// one [m].
    ///
    /// # Errors
    /// As [`Motion::rebased`].
    pub fn next_round(
        &self,
        p: &[f64],
        reference: Mesh,
        displacement: Vec<Point>,
    ) -> Result<Motion, RemeshError> {
        self.motion.rebased(reference, displacement, self.displacement(p), self.motion.policy())
    }

    /// dF/dp of `owner` from dF/dx at the nodes, shape `(n_nodes, 3)`.
    fn pull_back(&self, owner: &str, nodal: &[Point]) -> Result<Vec<f64>, Error> {
        finite::sensitivity(owner, nodal)?;
        Ok(self.surface.gradient(&self.motion.map().gradient(nodal)?))
    }
}

/// What all states of an evaluation share.
struct Work<'a> {
    mesh: &'a Mesh,
    timings: Timings,
    report: Worst,
    told: Told<'a>,
}

/// One state with its factor.
struct Solved<'a> {
    index: usize,
    model: &'a FieldModel,
    system: PreparedSystem,
    state: FieldSolution,
}

/// A sum of terms over the states.
struct Gathered {
    /// Value of every term without its weight.
    values: Vec<f64>,
    /// dF/dx of the weighted sum, shape `(n_nodes, 3)`.
    nodal: Vec<Point>,
}

impl Gathered {
    fn new(terms: usize, nodes: usize) -> Self {
        Self { values: vec![0.0; terms], nodal: vec![[0.0; 3]; nodes] }
    }

    /// Adds what the terms `(number, term)` of `owner` have on one state; derivatives where a shape is given, by one adjoint.
    fn add(
        &mut self,
        owner: &str,
        work: &mut Work<'_>,
        solved: &mut Solved<'_>,
        terms: &[(usize, &Term)],
        shape: Option<&Shape>,
    ) -> Result<(), Error> {
        let Solved { index, model, system, state } = solved;
        let mut clock = Lap::start();
        let mut right_side: Option<Vec<c64>> = None;
        for (number, term) in terms.iter().filter(|(_, term)| term.states.contains(index)) {
            let evaluated = term.functional.evaluate(model, work.mesh, state);
            let FunctionalValue { value, derivative, explicit } =
                evaluated.map_err(finite::of_term(owner, term, model))?;
            self.values[*number] += value;
            if shape.is_none() {
                continue;
            }
            let sum = right_side.get_or_insert_with(|| vec![c64::default(); derivative.len()]);
            for (sum, d) in sum.iter_mut().zip(derivative) {
                *sum += term.weight * d;
            }
            self.add_nodal(term.weight, explicit.as_deref().unwrap_or_default());
        }
        work.timings.gradient += clock.lap();
        let (Some(right_side), Some(shape)) = (right_side, shape) else { return Ok(()) };
        let named = finite::of_field(&format!("the adjoint of {owner}"), model);
        (work.told)(Stage::Adjoint);
        let lambda = adjoint::solve(system, &right_side).map_err(named)?;
        work.report.include(&lambda);
        work.timings.adjoint += clock.lap();
        (work.told)(Stage::Differentiating);
        let nodal = adjoint::node_gradient(model, work.mesh, state, &lambda, shape.motion.moving())?;
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

/// dF/dx with the components zeroed that cannot move.
fn moved_only(shape: &Shape, mut nodal: Vec<Point>) -> Vec<Point> {
    for (i, g) in nodal.iter_mut().enumerate() {
        let node = NodeId::new(i);
        if shape.surface.nodes().binary_search(&node).is_ok() {
            continue;
        }
        for (component, g) in g.iter_mut().enumerate() {
            if !shape.motion.map().is_unknown(node, component) {
                *g = 0.0;
            }
        }
    }
    nodal
}

/// Sum of iterations and worst residual over several solves.
#[derive(Default)]
struct Worst {
    iterations: usize,
    residual: f64,
}

impl Worst {
    fn include(&mut self, solution: &FieldSolution) {
        let report = solution.report();
        self.iterations += report.iterations;
        self.residual = self.residual.max(report.residual);
    }
}
