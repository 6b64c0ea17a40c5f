//! How exact the objective of the initial design is on the mesh of a configuration.

use fluxmorph_optimizer::driver::Watching;
use fluxmorph_optimizer::problem::{Derivatives, SolverCache};
use serde::Serialize;

use crate::build::{Mode, set_up};
use crate::config::{Accuracy, Config, Objective, SourceMap};
use crate::error::Error;
use crate::files::relative_bar;
use crate::run::estimate::Estimator;
use crate::show::Observer;

/// An objective with its error bar.
#[derive(Debug, Serialize)]
pub(super) struct EstimateSummary {
    /// The objective of the initial design; `None` where the configuration has none.
    pub(super) objective: Option<f64>,
    /// What the true value has more, as estimated [its unit]; `None` where there is no estimate, for which a warning has the
    /// reason.
    pub(super) error_estimate: Option<f64>,
    /// Twice that, relative to the objective.
    pub(super) error_bar_relative: Option<f64>,
    /// The constraints on the field.
    pub(super) constraints: Vec<ConstraintError>,
    /// Why there is no estimate.
    pub(super) notices: Vec<String>,
}

/// A constraint on the field at the initial design.
#[derive(Debug, Serialize)]
pub(super) struct ConstraintError {
    pub(super) name: String,
    /// In SI.
    pub(super) value: f64,
    /// What the true value has more, as estimated.
    pub(super) error_estimate: f64,
}

/// Keeps what is said, and passes the rest on.
struct Listening<'a> {
    observer: &'a mut dyn Observer,
    notices: Vec<String>,
}

impl Observer for Listening<'_> {
    fn phase(&mut self, name: &str) {
        self.observer.phase(name);
    }

    fn notice(&mut self, message: &str) {
        self.notices.push(message.to_owned());
    }
}

/// Analyses the initial design of a configuration and estimates the error of its objective, whatever that costs.
///
/// # Errors
/// Faults of the configuration, and what the field fails with.
pub(super) fn of_initial_design(
    config: &Config,
    source: &SourceMap,
    observer: &mut dyn Observer,
) -> Result<EstimateSummary, Error> {
    let config =
        Config { accuracy: Accuracy { estimate: Some(true), ..config.accuracy.clone() }, ..config.clone() };
    let setup = set_up(&config, source, Mode::Analysis)?;
    let initial = setup.problem.shape().map(|shape| shape.initial().to_vec()).unwrap_or_default();
    observer.phase("solving the field of the initial design");
    let moved = setup.problem.moved(&initial)?;
    let (cache, stages) = (&mut SolverCache::default(), &mut Watching(observer));
    let analysis = setup.problem.analyse(moved, Derivatives::None, cache, stages)?;
    let mut listening = Listening { observer, notices: Vec::new() };
    let is_shown = analysis.objective.is_some() || !analysis.constraints.is_empty();
    let mut estimator = Estimator::new((&config, source), (&setup.problem, &setup.full_mesh));
    let estimated = is_shown.then(|| estimator.errors(&analysis, &mut listening)).flatten();
    let mut notices = listening.notices;
    if analysis.objective.is_none() {
        notices.push("there is no [objective] whose error could be estimated".to_owned());
    }
    let is_of_field = config.objective.as_ref().is_some_and(Objective::is_of_field);
    if analysis.objective.is_some() && !is_of_field {
        notices.push("the objective is of the shape alone, and has no error of the field".to_owned());
    }
    let constraints = estimated.iter().flat_map(|errors| &errors.constraints);
    let constraints = constraints.map(|&(k, error)| ConstraintError {
        name: setup.problem.constraints()[k].name.clone(),
        value: analysis.constraints[k].value,
        error_estimate: error,
    });
    let constraints = constraints.collect();
    let error = estimated.map(|errors| errors.of_objective()).filter(|_| is_of_field);
    let error_bar_relative =
        analysis.objective.zip(error).and_then(|(value, error)| relative_bar(error.size, value));
    Ok(EstimateSummary {
        objective: analysis.objective,
        error_estimate: error.map(|error| error.signed),
        error_bar_relative,
        constraints,
        notices,
    })
}
