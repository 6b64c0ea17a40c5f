//! What these tests ask of a problem: its value at a design, and where an optimisation ends.

use fluxmorph::build::{Mode, set_up};
use fluxmorph::config::Optimizer;
use fluxmorph::show::{Evaluation, Observer};
use fluxmorph_optimizer::Error;
use fluxmorph_optimizer::driver::{Optimised, Record, Recorder, optimise};
use fluxmorph_optimizer::problem::{Analysis, Derivatives, NoProgress, Problem, SolverCache};

use crate::support::config;

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

/// The problem of the quick shield with overrides `key=value`, and the settings of its optimiser.
#[track_caller]
pub(crate) fn quick(overrides: &[&str]) -> (Problem, Optimizer) {
    let (config, source) = config("shield_quick.toml", overrides);
    let setup = set_up(&config, &source, Mode::Optimisation).unwrap_or_else(|e| panic!("{e}"));
    (setup.problem, config.optimizer)
}

/// What a run notes and warns of.
#[derive(Default)]
pub(crate) struct Notes(pub(crate) Vec<String>);

impl Observer for Notes {
    fn note(&mut self, message: &str) {
        self.0.push(message.to_owned());
    }

    fn warning(&mut self, message: &str) {
        self.0.push(message.to_owned());
    }
}

/// Keeps rows and residuals of the history, and may fail at one of them.
#[derive(Default)]
pub(crate) struct Rows {
    pub(crate) rows: Vec<Evaluation>,
    pub(crate) residuals: Vec<f64>,
    /// Before which evaluation, and with what.
    pub(crate) fails: Option<(usize, fn() -> Error)>,
}

impl Recorder for Rows {
    fn record(&mut self, record: &Record, _: &Analysis, _: &Problem) -> Result<(), Error> {
        if let Some((_, error)) = self.fails.filter(|(at, _)| *at == record.row.evaluation) {
            return Err(error());
        }
        self.rows.push(record.row.clone());
        self.residuals.push(record.worst_residual);
        Ok(())
    }
}

/// Optimises without writing anything; the result, and the rows of the history.
#[track_caller]
pub(crate) fn optimised(
    problem: &mut Problem,
    settings: &Optimizer,
    observer: &mut dyn Observer,
) -> (Optimised, Vec<Evaluation>) {
    let mut rows = Rows::default();
    let result = optimise(problem, &settings.settings(), observer, &mut rows, &|| false);
    (result.unwrap_or_else(|e| panic!("{e}")), rows.rows)
}
