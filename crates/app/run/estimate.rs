//! The estimated error of an analysed design: by one order more, or for second order by halved edges.
//!
//! Of second-order elements there is no higher order. Their objective on halved edges has an error between a sixteenth of that
//! on the mesh, where the field is smooth, and four tenths beside an edge of steel or of a conductor with 270° outside
//! (`h⁴` and `h^(4/3)`): `F(h/2) − F(h)` is 0.94 to 0.6 of the error, and 4/3 of it between 0.8 and 1.25 times. That costs
//! eight times the elements, so that it has to be asked for.

use fluxmorph_geometry::Mesh;
use fluxmorph_optimizer::Error as OptimizerError;
use fluxmorph_optimizer::constraint::Constraint;
use fluxmorph_optimizer::memory_estimate::Sizes;
use fluxmorph_optimizer::problem::{Analysis, EnrichedModels, ErrorEstimate, Measured, Problem, SolverCache};
use fluxmorph_solver::enrichment::Effort;
use fluxmorph_solver::{FieldModel, FieldSolution, SolverError};

use super::finer::{Cut, FinerProblem, looked_at_once};
use super::reported::{self, Reported};
use crate::build::memory_limit;
use crate::config::{Config, ElementOrder, Elements, SourceMap};
use crate::error::Error;
use crate::files::StateErrors;
use crate::show::Observer;

/// Bytes that an estimate takes beside the problem, for each tetrahedron and for each with ψ, all of whose second order the coarse
/// factor holds: pattern, matrix and smoother of second order, of edge elements and of nodal ones. Fits to fourteen devices of 9 to
/// 73 thousand tetrahedra: 8.9 to 10.8 kB without ψ and 26 to 30 more with it, and 8.7 to 8.9 and 15 to 21 of nodal elements.
const ESTIMATE_BYTES: [[usize; 2]; 2] = [[9_200, 29_000], [8_700, 20_000]];

/// What Newton's method adds for each tetrahedron along a B–H curve, at 0 Hz and above: the matrix of the tangent beside that of the
/// linear parts, and the vectors of GMRES.
const TANGENT_BYTES_PER_TET: [usize; 2] = [3_900, 4_800];

/// Error of second order over what halved edges change.
const OF_HALVED_EDGES: f64 = 4.0 / 3.0;

/// Whether an estimate is to be made whatever it costs.
fn is_asked_for(config: &Config) -> bool {
    config.accuracy.estimate.is_some() || config.accuracy.tolerance.is_some()
}

/// Whether an estimate is wanted, be it possible or not.
fn is_wanted(config: &Config, problem: &Problem) -> bool {
    let is_second_order = config.analysis.order == ElementOrder::Quadratic;
    let has_bound = problem.constraints().iter().any(|own| own.quantity.is_of_field());
    let is_of_something =
        problem.objective().is_some() || has_bound || reported::is_something(config, problem);
    config.accuracy.estimate != Some(false) && is_of_something && (!is_second_order || is_asked_for(config))
}

/// Bytes that the process holds at the peak of an estimate, about; `None` where there is none.
pub(crate) fn memory(config: &Config, problem: &Problem) -> Option<usize> {
    if problem.share().is_some() || !is_wanted(config, problem) {
        return None;
    }
    let sizes = Sizes::of(problem);
    let along_curves = problem.states().iter().filter(|state| !state.is_linear());
    let of_state = |state: &FieldModel| TANGENT_BYTES_PER_TET[usize::from(state.angular_frequency() > 0.0)];
    let tangent = along_curves.map(of_state).max().unwrap_or_default();
    let [edge, nodal] = ESTIMATE_BYTES.map(|[all, eddy]| [all + tangent, eddy]);
    Some(match config.analysis.elements {
        _ if config.analysis.order == ElementOrder::Quadratic => sizes.on_other_mesh(8.0)[0],
        Elements::Edge => sizes.beside(edge),
        Elements::Nodal => sizes.beside(nodal),
    })
}

/// The estimated errors of an analysis.
#[derive(Clone)]
pub(crate) struct Estimate {
    /// Of objective and constraints.
    pub(crate) errors: ErrorEstimate,
    /// Of what each state reports beside.
    pub(crate) of_states: Vec<Option<StateErrors>>,
}

/// What errors are estimated of.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Of {
    /// Objective and constraints.
    Objective,
    /// What the states report, too.
    States,
}

/// Estimates the errors of analyses of one problem; what does not depend on the design is set up once.
pub(crate) struct Estimator<'a> {
    config: &'a Config,
    source: &'a SourceMap,
    problem: &'a Problem,
    /// Of the problem, with all regions.
    full_mesh: &'a Mesh,
    effort: Effort,
    /// Whether an estimate was made: that of another design is worth what it takes then, without which this one says little.
    has_one: bool,
    /// Of first order: the models of second order.
    models: EnrichedModels,
    /// Of second order: the problem on halved edges, once it was asked for.
    finer: Option<FinerProblem>,
}

impl<'a> Estimator<'a> {
    /// That of a configuration and what was set up of it: the problem, and its mesh with all regions.
    pub(crate) fn new(
        (config, source): (&'a Config, &'a SourceMap),
        (problem, full_mesh): (&'a Problem, &'a Mesh),
    ) -> Self {
        let effort = if is_asked_for(config) { Effort::Any } else { Effort::Affordable };
        let models = EnrichedModels::new(effort);
        Self { config, source, problem, full_mesh, effort, has_one: false, models, finer: None }
    }

    /// The estimated errors of an analysis; `None` where there is no estimate, for which the reason is reported.
    pub(crate) fn estimate(&mut self, analysis: &Analysis, observer: &mut dyn Observer) -> Option<Estimate> {
        self.estimated(Of::States, analysis, observer)
    }

    /// Those of objective and constraints alone.
    pub(crate) fn errors(
        &mut self,
        analysis: &Analysis,
        observer: &mut dyn Observer,
    ) -> Option<ErrorEstimate> {
        Some(self.estimated(Of::Objective, analysis, observer)?.errors)
    }

    fn estimated(&mut self, of: Of, analysis: &Analysis, observer: &mut dyn Observer) -> Option<Estimate> {
        if self.problem.share().is_some() && is_wanted(self.config, self.problem) {
            return left_out("that takes one process", observer);
        }
        if let Some(shortage) = memory_limit::shortage(memory(self.config, self.problem)?) {
            observer.notice(&format!("the error of the mesh is not estimated, which takes {shortage}"));
            return None;
        }
        observer.phase("estimating the error of the mesh");
        let estimated = if self.config.analysis.order == ElementOrder::Quadratic {
            self.on_halved_edges(of, analysis)
        } else {
            self.by_order(of, analysis)
        };
        match estimated {
            Ok(estimate) => {
                self.has_one = true;
                Some(estimate)
            }
            Err(Error::Optimizer(OptimizerError::Solver(SolverError::NotConverged { .. })))
                if self.effort == Effort::Affordable =>
            {
                if self.has_one {
                    (self.effort, self.models) = (Effort::Any, EnrichedModels::new(Effort::Any));
                    return self.estimated(of, analysis, observer);
                }
                left_out(
                    "it was given up after as much work as six evaluations take; accuracy.estimate = true goes on",
                    observer,
                )
            }
            Err(error) => left_out(error, observer),
        }
    }

    /// Of first order, by one order more.
    fn by_order(&mut self, of: Of, analysis: &Analysis) -> Result<Estimate, Error> {
        let (config, problem, mesh) = (self.config, self.problem, &analysis.mesh);
        let of_run = (config, problem.bodies());
        let mut of_states = vec![None; problem.states().len()];
        let mut inspect = |index: usize, model: &FieldModel, solution: &FieldSolution| {
            if of == Of::Objective {
                return;
            }
            let own = Reported::of(of_run, (&problem.states()[index], mesh, &analysis.solutions[index]));
            let better = Reported::of(of_run, (model, mesh, solution));
            of_states[index] = own.zip(better).and_then(|(own, better)| own.errors(&better, 1.0));
        };
        let errors = problem.estimate_error(analysis, &mut self.models, &mut inspect)?;
        Ok(Estimate { errors, of_states })
    }

    /// Of second order, without the places where the error is made.
    fn on_halved_edges(&mut self, of: Of, analysis: &Analysis) -> Result<Estimate, Error> {
        let finer = match self.finer.take() {
            Some(finer) => finer,
            None => {
                let config = looked_at_once(self.config.clone());
                FinerProblem::new(&config, self.source, self.full_mesh, Cut::Halvings(1))?
            }
        };
        let finer = self.finer.insert(finer);
        let found = finer.analyse(&analysis.mesh, &mut SolverCache::default())?;
        let error = |(fine, coarse): (f64, f64)| OF_HALVED_EDGES * (fine - coarse);
        let values = |own: &Analysis| match own.member_values() {
            members if members.is_empty() => vec![own.objective.unwrap_or(f64::NAN)],
            members => members,
        };
        let errors: Vec<f64> = values(&found).into_iter().zip(values(analysis)).map(error).collect();
        let problem = self.problem;
        let of_field = |(_, own): &(usize, &Constraint)| own.quantity.is_of_field();
        let constrained = problem.constraints().iter().enumerate().filter(of_field);
        let of_constraint = |((k, _), fine): ((usize, &Constraint), &Measured)| {
            (k, error((fine.value, analysis.constraints[k].value)))
        };
        let errors = ErrorEstimate {
            objective: problem.objective().map_or(0.0, |_| problem.error_of_objective(analysis, &errors).1),
            constraints: constrained.zip(&found.constraints).map(of_constraint).collect(),
            by_element: Vec::new(),
            iterations: found.linear_iterations,
        };
        if of == Of::Objective {
            return Ok(Estimate { errors, of_states: Vec::new() });
        }
        let own = Reported::of_states(self.config, problem, analysis);
        let pairs = own.into_iter().zip(Reported::of_states(self.config, &finer.setup.problem, &found));
        let errors_of = |(own, better): (Reported, Reported)| own.errors(&better, OF_HALVED_EDGES);
        let of_states = pairs.map(|(own, better)| own.zip(better).and_then(errors_of)).collect();
        Ok(Estimate { errors, of_states })
    }
}

/// Reports why there is no estimate.
pub(super) fn left_out<T>(reason: impl std::fmt::Display, observer: &mut dyn Observer) -> Option<T> {
    observer.notice(&format!("the error of the mesh is not estimated: {reason}"));
    None
}
