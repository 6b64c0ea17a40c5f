//! The optimisation problem as a function: design variables in, objective and exact gradient out.
//!
//! `p → Δx_b → Δx (Eq. 3) → mesh → state u → F`, and back: `λ → dF/dx → transposed map → dF/dp`. The reference mesh and
//! the elastic factor are fixed, so `F(p)` is one function and not a path. A problem owns a list of states (one for
//! now); nothing here knows an optimiser, a file or a terminal.

use std::time::Instant;

use fluxmorph_geometry::quality::QualityReport;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, Mesh, NodeId};
use fluxmorph_remesh::{ElasticMap, RemeshError, check_step};
use fluxmorph_solver::objective::ObjectiveValue;
use fluxmorph_solver::{FieldModel, FieldSolution, Objective, SolverError, adjoint};

use crate::design::DesignSurface;
use crate::error::Error;
use crate::thickness::Thickness;

/// Connectivity, its places in the patterns, element derivatives and output arrays, per element.
const BYTES_PER_ELEMENT: usize = 600;

/// Coordinates, vectors of unknowns and output arrays, per node.
const BYTES_PER_NODE: usize = 1000;

/// What moves, how the mesh follows, and within which bounds.
#[derive(Debug)]
pub struct Shape {
    /// Design variables to surface.
    pub surface: DesignSurface,
    /// Surface to mesh (Eq. 3), factored on the reference mesh.
    pub map: ElasticMap,
    /// Thickness of the designed body, where it has one.
    pub thickness: Option<Thickness>,
    /// Lower bound of every variable [m].
    pub lower: Vec<f64>,
    /// Upper bound of every variable [m].
    pub upper: Vec<f64>,
    /// Where the optimisation starts [m].
    pub initial: Vec<f64>,
}

/// Objective, states and shape on a reference mesh.
#[derive(Debug)]
pub struct Problem {
    /// The undeformed mesh.
    pub reference: Mesh,
    /// One field problem per state.
    pub states: Vec<FieldModel>,
    /// What is minimised, on the first state; `None` for a field analysis without objective.
    pub objective: Option<Objective>,
    /// What moves; `None` for a field analysis without design.
    pub shape: Option<Shape>,
}

/// Wall time of the parts of an evaluation [s].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
    /// Displacement of every node from the reference mesh [m], shape `(n_nodes, 3)`.
    pub displacement: Vec<Point>,
    /// One solution per state.
    pub solutions: Vec<FieldSolution>,
    /// The objective, if the problem has one.
    pub objective: Option<f64>,
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
    /// Where the time went.
    pub timings: Timings,
}

/// Whether the adjoint problem is solved too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Want {
    /// The objective alone.
    Value,
    /// Objective and gradient.
    Gradient,
}

impl Problem {
    /// The mesh of a design, and the displacement that leads to it.
    ///
    /// # Errors
    /// [`RemeshError::Inverted`] says which element breaks and how far the step may go.
    ///
    /// # Panics
    /// If `p` has another length than there are variables.
    pub fn mesh_of(&self, p: &[f64]) -> Result<(Mesh, Vec<Point>), RemeshError> {
        let Some(shape) = &self.shape else {
            return Ok((self.reference.clone(), vec![[0.0; 3]; self.reference.points().len()]));
        };
        assert_eq!(p.len(), shape.surface.variable_count(), "one value a variable");
        let displacement = shape.map.displacement(&shape.surface.displacement(p));
        Ok((check_step(&self.reference, &displacement)?, displacement))
    }

    /// Elements of which a node may move, ascending; empty without a shape.
    pub fn moving_elements(&self) -> &[ElementId] {
        self.shape.as_ref().map_or(&[], |shape| shape.map.elements())
    }

    /// Bytes that an evaluation needs, about: matrices, factors, and the arrays over nodes and elements.
    pub fn memory_estimate(&self) -> usize {
        let elements = self.reference.topology().tets().len();
        let nodes = self.reference.points().len();
        let systems: usize = self.states.iter().map(FieldModel::memory_estimate).sum();
        let elastic = self.shape.as_ref().map_or(0, |shape| shape.map.factor_entries() * size_of::<f64>());
        systems + elastic + elements * BYTES_PER_ELEMENT + nodes * BYTES_PER_NODE
    }

    /// Quality of the elements that may move, or of all where nothing moves.
    pub fn quality(&self, mesh: &Mesh) -> QualityReport {
        match self.moving_elements() {
            [] => QualityReport::of_mesh(mesh),
            moving => QualityReport::of_elements(mesh, moving),
        }
        .expect("a mesh and a remesh region have elements")
    }

    /// Field, objective and, if wanted, gradient of a design.
    ///
    /// # Errors
    /// [`Error::Remesh`] when the mesh would break, [`Error::Solver`] when the field cannot be computed.
    pub fn evaluate(&self, p: &[f64], want: Want) -> Result<Analysis, Error> {
        let clock = Instant::now();
        let (mesh, displacement) = self.mesh_of(p)?;
        let remesh = clock.elapsed().as_secs_f64();
        let mut analysis = self.analyse(mesh, displacement, want)?;
        analysis.timings.remesh += remesh;
        Ok(analysis)
    }

    /// As [`Problem::evaluate`] on a mesh made before.
    ///
    /// # Errors
    /// [`Error::Solver`] when the field cannot be computed.
    pub fn analyse(&self, mesh: Mesh, displacement: Vec<Point>, want: Want) -> Result<Analysis, Error> {
        let mut timings = Timings::default();
        let mut report = Worst::default();
        let mut solutions = Vec::with_capacity(self.states.len());
        let mut objective = None;
        let mut gradient = None;
        let mut sensitivity = None;
        for (index, model) in self.states.iter().enumerate() {
            let mut clock = Lap::start();
            let (matrix, load) = (model.assemble(&mesh), model.load(&mesh));
            timings.assembly += clock.lap();
            let system = model.prepare(matrix)?;
            timings.factor += clock.lap();
            let state = model.solve_prepared(&system, &load)?;
            report.include(&state);
            timings.state += clock.lap();
            if let Some(observed) = self.objective.as_ref().filter(|_| index == 0) {
                let value: ObjectiveValue = observed.evaluate(model, &mesh, &state)?;
                objective = Some(value.value);
                timings.gradient += clock.lap();
                if let (Want::Gradient, Some(shape)) = (want, &self.shape) {
                    let lambda = adjoint::solve(&system, &value)?;
                    report.include(&lambda);
                    timings.adjoint += clock.lap();
                    let nodal = adjoint::node_gradient(model, &mesh, &state, &lambda, shape.map.elements());
                    timings.gradient += clock.lap();
                    gradient = Some(shape.surface.gradient(&shape.map.gradient(&nodal)));
                    timings.remesh += clock.lap();
                    sensitivity = Some(moved_only(shape, nodal));
                }
            }
            solutions.push(state);
        }
        if let Some(value) = gradient.iter().flatten().copied().find(|g| !g.is_finite()) {
            return Err(SolverError::NotFinite { what: "gradient", value }.into());
        }
        let quality = self.quality(&mesh);
        Ok(Analysis {
            mesh,
            displacement,
            solutions,
            objective,
            gradient,
            sensitivity,
            quality,
            linear_iterations: report.iterations,
            worst_residual: report.residual,
            timings,
        })
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
            if !shape.map.is_unknown(node, component) {
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

/// A stop watch with intermediate times.
struct Lap(Instant);

impl Lap {
    fn start() -> Self {
        Self(Instant::now())
    }

    /// Seconds since the start or the last lap.
    fn lap(&mut self) -> f64 {
        let seconds = self.0.elapsed().as_secs_f64();
        self.0 = Instant::now();
        seconds
    }
}
