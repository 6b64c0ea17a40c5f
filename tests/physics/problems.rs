//! What these tests ask of a problem: its value at a design, and where an optimisation ends.

use fluxmorph::config::Optimizer;
use fluxmorph::show::{Evaluation, Silent};
use fluxmorph_optimizer::Error;
use fluxmorph_optimizer::driver::{Optimised, Record, Recorder, optimise};
use fluxmorph_optimizer::problem::{Analysis, Derivatives, NoProgress, Problem, SolverCache};

/// Number of design variables.
pub(crate) fn variables(problem: &Problem) -> usize {
    problem.shape().expect("a shape").surface().variable_count()
}

/// The initial design.
pub(crate) fn initial(problem: &Problem) -> Vec<f64> {
    problem.shape().expect("a shape").initial().to_vec()
}

/// The analysis of a design, without derivatives.
#[track_caller]
pub(crate) fn analysed(problem: &Problem, p: &[f64]) -> Analysis {
    problem
        .evaluate(p, Derivatives::None, &mut SolverCache::default(), &mut NoProgress)
        .unwrap_or_else(|e| panic!("{e}"))
}

/// F of a design.
#[track_caller]
pub(crate) fn objective(problem: &Problem, p: &[f64]) -> f64 {
    analysed(problem, p).objective.expect("an objective")
}

/// Rows of the history.
#[derive(Default)]
struct Rows(Vec<Evaluation>);

impl Recorder for Rows {
    fn record(&mut self, record: &Record, _: &Analysis, _: &Problem) -> Result<(), Error> {
        self.0.push(record.row.clone());
        Ok(())
    }
}

/// Optimises without writing anything; the rows of the history beside the result, or beside the error.
pub(crate) fn try_optimised(
    problem: &mut Problem,
    settings: &Optimizer,
) -> (Result<Optimised, Error>, Vec<Evaluation>) {
    let mut rows = Rows::default();
    (optimise(problem, &settings.settings(), &mut Silent, &mut rows, &|| false), rows.0)
}

/// Optimises; the result, and the rows of the history.
#[track_caller]
pub(crate) fn optimised(problem: &mut Problem, settings: &Optimizer) -> (Optimised, Vec<Evaluation>) {
    let (result, rows) = try_optimised(problem, settings);
    (result.unwrap_or_else(|e| panic!("{e}")), rows)
}
