//! One analysis with its directory: the field of a single design.

use fluxmorph_optimizer::driver::Watching;
use fluxmorph_optimizer::problem::{Analysis, Derivatives, Problem, SolverCache, Stage};
use fluxmorph_remesh::Moved;

use super::estimate::Estimate;
use super::excess::LeftOut;
use super::facets::{Found, Shape};
use super::finer::{Cut, FinerProblem, is_of_field};
use super::prepared::Prepared;
use super::recorder::{write_collection, write_field};
use super::reported;
use super::summary::{constraints, design_result, enter_errors, homogeneity, terms};
use super::{Options, Session, timed};
use crate::build::{Mode, memory_limit};
use crate::config::{Config, FieldsKept, SourceMap};
use crate::error::Error;
use crate::files::{Accuracy, DesignFile, ObjectiveResult, RunResult, StateErrors, StopReason, exports};
use crate::show::RunObserver;

/// Analyses one design and writes its field and result; on a mesh with all edges halved so many times, where its mesh is
/// that of the design on the coarse one.
pub fn solve(
    config: &Config,
    source: &SourceMap,
    (design, halvings): (Option<DesignFile>, u32),
    options: Options<'_>,
    observer: &mut dyn RunObserver,
) -> Result<RunResult, Error> {
    let mut prepared = Prepared::new(config, source, Mode::Analysis, options, observer)?;
    let problem = &prepared.setup.problem;
    if let (Some(shape), Some(design)) = (problem.shape(), &design) {
        design.check_places(shape.surface(), problem.original().bounding_box())?;
    }
    if let Some(design) = &design {
        design.check_tables(&prepared.setup.tables)?;
        if let Some(count) = design.refinements_of_run().filter(|_| halvings == 0) {
            observer.notice(&format!(
                "the run of this design refined its mesh (refinements: {count}), and its numbers are of that mesh; this analysis takes the \
                 mesh that it began with, whose errors are larger: --refine 1 halves its edges"
            ));
        }
    }
    let mesh = prepared.mesh_hash();
    for change in design.iter().flat_map(|design| design.changes_since_the_run(&mesh)) {
        observer.warning(&change);
    }
    let values = design_values(problem, design.map(|design| design.values), observer);
    // A design that breaks the mesh is refused before an earlier run is replaced.
    let p = values.as_deref().unwrap_or_default();
    let mut moved = problem.moved(p)?;
    // Bounds may be shares of what the initial design has.
    let initial = problem.shape().filter(|_| problem.has_shared_bounds()).map(|shape| shape.initial());
    let initial = initial.filter(|&initial| initial != p);
    let mut initial = initial.map(|initial| problem.moved(initial)).transpose()?;
    let mut design = problem.shape().zip(values.as_deref()).map(|(s, p)| design_result(s, p));
    if halvings > 0 {
        if problem.share().is_some() {
            observer.warning(
                "a refined mesh is solved on by the first rank alone: it must fit into the memory of one, and the others wait",
            );
        }
        let of_shape = config.constraints.iter().filter(|own| !is_of_field(own));
        let left_out: Vec<String> = of_shape.map(|own| format!("`{}`", own.name)).collect();
        if !left_out.is_empty() {
            observer.notice(&format!(
                "constraints on the shape are not looked at on a refined mesh: {}; they are the same on the mesh as it is",
                left_out.join(", ")
            ));
        }
        let cut = Cut::Halvings(halvings);
        let finer = FinerProblem::new(config, source, &prepared.setup.full_mesh, cut)?;
        moved = finer.moved(&moved.mesh)?;
        initial = initial.map(|initial| finer.moved(&initial.mesh)).transpose()?;
        prepared.facets.refine(finer.parents().to_vec());
        prepared.setup = finer.setup;
        memory_limit::check_problem(&prepared.setup.problem, source, options.overwrite_policy)?;
    }
    prepared.setup.problem.respond_to_every_winding();
    let session = prepared.begin("solve", mesh, observer)?;
    let concluded = session.conclude(observer, |session, observer| {
        let problem = &session.setup.problem;
        observer.phase("solving the field");
        let (cache, stages) = (&mut SolverCache::default(), &mut Watching(observer));
        let analysis = problem.analyse(moved, Derivatives::First, cache, stages)?;
        let result = session.write_analysis((initial.take(), halvings), &analysis, observer)?;
        Ok(RunResult { design: design.take(), ..result })
    })?;
    Ok(concluded.result)
}

/// The design to analyse: the one given, or the initial one; `None` without a design surface.
fn design_values(
    problem: &Problem,
    given: Option<Vec<f64>>,
    observer: &mut dyn RunObserver,
) -> Option<Vec<f64>> {
    let shape = problem.shape()?;
    let values = given.unwrap_or_else(|| shape.initial().to_vec());
    let outside = |k: usize| values[k] < shape.lower()[k] || values[k] > shape.upper()[k];
    if let Some(k) = (0..values.len()).find(|&k| outside(k)) {
        observer.warning(&format!("design variable {k} = {} mm is outside its bounds", values[k] * 1e3));
    }
    Some(values)
}

impl Session<'_> {
    /// Writes the field and the exports of an analysis; returns its result.
    fn write_analysis(
        &self,
        (initial, halvings): (Option<Moved>, u32),
        analysis: &Analysis,
        observer: &mut dyn RunObserver,
    ) -> Result<RunResult, Error> {
        let (config, problem) = (self.config, &self.setup.problem);
        observer.stage(Stage::Writing);
        for event in &analysis.solver_events {
            observer.notice(&event.to_string());
        }
        let has_initial_bounds = initial.is_none();
        let bounds = problem.bounds(initial, analysis)?;
        let mut constraints = constraints(problem, analysis, &bounds);
        let mut seconds = 0.0;
        let estimate = timed(&mut seconds, || self.estimator().estimate(analysis, observer));
        if let Some(estimate) = &estimate {
            let errors = &estimate.errors;
            let at_initial = Some(errors).filter(|_| has_initial_bounds);
            enter_errors(&mut constraints, (problem, &bounds), (at_initial, errors), observer);
        }
        if config.output.fields != FieldsKept::Nothing {
            let error = estimate.as_ref().map(|estimate| estimate.errors.by_element.as_slice());
            let error = error.filter(|by_element| !by_element.is_empty());
            write_field(&self.directory, self.pieces().as_ref(), 0, problem, (analysis, error))?;
            write_collection(&self.directory, &[0])?;
        }
        let optimum = if halvings > 0 { self.directory.optimum_refined() } else { self.directory.optimum() };
        exports::write(config, &self.directory, &optimum, &analysis.mesh, observer)?;
        let initial_quality = problem.quality(problem.original()).worst;
        let left_out = LeftOut::of(problem, analysis);
        let at_initial = Some(&left_out).filter(|_| has_initial_bounds);
        let broken = left_out.broken_bounds(problem, (analysis, &bounds), at_initial);
        broken.iter().for_each(|warning| observer.warning(warning));
        let excess = left_out.of_objective(problem, analysis);
        let (accuracy, of_facets) = timed(&mut seconds, || {
            self.accuracy_of((analysis, halvings), (estimate.as_ref(), excess), observer)
        });
        let mut result = RunResult {
            evaluations: 1,
            objective: analysis.objective.map(|value| ObjectiveResult {
                initial: value,
                best: value,
                ratio: 1.0,
                best_evaluation: 0,
                verified_ratio: None,
                verification: None,
                homogeneity: homogeneity(problem, analysis, value),
                terms: terms(problem, analysis),
            }),
            accuracy,
            constraints,
            ..self.result(StopReason::Done, analysis, None, initial_quality, &analysis.timings, observer)?
        };
        result.timings_s.insert("estimate".to_owned(), seconds);
        result.warnings.extend(broken);
        if let Some(estimate) = estimate {
            result.enter_errors(&estimate.of_states);
        }
        result.enter_facets(&of_facets);
        Ok(result)
    }

    /// What is known of how exact the objective of an analysis is, and what facets change of what its states report.
    fn accuracy_of(
        &self,
        (analysis, halvings): (&Analysis, u32),
        (estimate, excess): (Option<&Estimate>, Option<f64>),
        observer: &mut dyn RunObserver,
    ) -> (Option<Accuracy>, Vec<Option<StateErrors>>) {
        let of_states = estimate.map(|estimate| estimate.of_states.as_slice());
        let estimate = estimate.filter(|_| analysis.objective.is_some());
        let is_looked_at = self.is_geometry_looked_at();
        if estimate.is_none() && excess.is_none() && !is_looked_at {
            return (None, Vec::new());
        }
        let objective = analysis.objective.filter(|_| self.has_field_objective());
        let error = estimate.map(|estimate| estimate.errors.of_objective());
        let shape = Shape {
            mesh: &analysis.mesh,
            objective: objective.map(|value| (value, error.map(|error| error.signed))),
            analysis: reported::is_something(self.config, &self.setup.problem)
                .then_some((analysis, of_states)),
        };
        let shapes = if shape.objective.is_some() || shape.analysis.is_some() { &[shape][..] } else { &[] };
        // What halves edges keeps the facets of the mesh that was halved.
        let shape_of_design = Some(&analysis.mesh).filter(|_| self.has_grid() && halvings == 0);
        let (facets, of_states) = match self.facets_of(shape_of_design, shapes, observer) {
            Some(Found { facets, of_states }) => (Some(facets), of_states),
            None => (None, Vec::new()),
        };
        let known = Accuracy {
            refinements: halvings as usize,
            facets,
            near_wall: self.near_wall_noted(observer),
            excess: excess.map(|excess| [excess; 2]),
            ..Accuracy::default()
        };
        let accuracy = match objective.zip(error) {
            Some((value, error)) => Some(known.of_analysis(value, error)),
            _ => Some(known).filter(Accuracy::says_something_of_the_geometry),
        };
        (accuracy, of_states)
    }
}
