//! One evaluation as a recorder keeps it: all that answers the method when a run is resumed.

use fluxmorph_solver::linear::Method;
use serde::{Deserialize, Serialize};

use super::evaluation::Evaluation;
use super::stop_reason::StopReason;
use crate::problem::Timings;

/// One evaluation with everything that a resumed run needs of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Its row in the history, with the objective.
    pub row: Evaluation,
    /// Whether it was the best until then.
    pub improved: bool,
    /// Where no method asked for it, but it is a step back within the bounds: why the search before it ended, or the limit of
    /// evaluations where it came before a supervisor looked at the search.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stepped_back: Option<StopReason>,
    /// The design variables [m].
    pub design: Vec<f64>,
    /// dF/dp [unit of F per m].
    pub gradient: Vec<f64>,
    /// What the constraints measure, in SI, with the derivatives by the variables.
    pub constraints: Vec<(f64, Vec<f64>)>,
    /// Of a worst case: its terms with their weights, in SI, with the derivatives by the variables.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub members: Vec<(f64, Vec<f64>)>,
    /// The method of the linear solver that worked last, by matrix; `None` where it is the first one.
    #[serde(with = "method_names")]
    pub methods: Vec<Option<Method>>,
    /// Largest relative residual of its states.
    pub worst_residual: f64,
    /// Where its time went.
    #[serde(rename = "timings_s")]
    pub timings: Timings,
}

/// Methods by the names that they have in a configuration.
mod method_names {
    use fluxmorph_solver::linear::Method;
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(
        methods: &[Option<Method>],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let names: Vec<_> = methods.iter().map(|method| method.map(Method::name)).collect();
        names.serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<Option<Method>>, D::Error> {
        let method = |name: String| {
            let known = Method::ALL.into_iter().find(|method| method.name() == name);
            known.ok_or_else(|| D::Error::custom("an unknown method of solution"))
        };
        let names = Vec::<Option<String>>::deserialize(deserializer)?;
        names.into_iter().map(|name| name.map(method).transpose()).collect()
    }
}
