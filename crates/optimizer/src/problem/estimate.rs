//! The error of objective and constraints at an analysed design, estimated by one order more on the same mesh.
//!
//! What one state contributes, and the equations, are in [`fluxmorph_solver::enrichment`].

use fluxmorph_geometry::fem::c64;
use fluxmorph_solver::enrichment::{Effort, Enrichment};
use fluxmorph_solver::{FieldModel, FunctionalValue};

use super::{Analysis, Problem};
use crate::error::Error;
use crate::objective::Term;

/// Estimated errors: what the true value has more than the computed one.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// Of the objective [its unit].
    pub objective: f64,
    /// Of each constraint on a functional of the field, with its number.
    pub constraints: Vec<(usize, f64)>,
    /// Where the objective's error is made: what each element adds to it, shape `(n_tets,)`.
    pub by_element: Vec<f64>,
    /// Iterations of all corrections.
    pub iterations: usize,
}

impl Problem {
    /// The errors of an analysed design's values, with so much effort.
    ///
    /// # Errors
    /// [`fluxmorph_solver::SolverError::Parameter`] for second order and for several ranks; what a linear solver fails with.
    pub fn estimate_error(&self, analysis: &Analysis, effort: Effort) -> Result<ErrorEstimate, Error> {
        let mut estimate = ErrorEstimate {
            objective: 0.0,
            constraints: self.field_constraints().map(|(k, _)| (k, 0.0)).collect(),
            by_element: vec![0.0; analysis.mesh.topology().tets().len()],
            iterations: 0,
        };
        let mut harmonic: Option<FieldModel> = None;
        for (index, coarse) in self.states().iter().enumerate() {
            let fine = match &harmonic {
                Some(model) => model.at_frequency(&analysis.mesh, coarse.setup().frequency)?,
                None => coarse.enriched(&analysis.mesh, effort)?,
            };
            if fine.angular_frequency() > 0.0 {
                harmonic = Some(fine.clone());
            }
            let mut state = State {
                coarse,
                enriched: Enrichment::new(coarse, fine, &analysis.mesh, &analysis.solutions[index])?,
                analysis,
                index,
            };
            let terms: Vec<&Term> = self.terms().iter().collect();
            estimate.objective += state.error_of(&terms, Some(&mut estimate.by_element))?;
            for (error, (_, term)) in estimate.constraints.iter_mut().zip(self.field_constraints()) {
                error.1 += state.error_of(&[term], None)?;
            }
            estimate.iterations += state.enriched.iterations();
        }
        Ok(estimate)
    }
}

/// One state of a design with its correction.
struct State<'a> {
    coarse: &'a FieldModel,
    enriched: Enrichment,
    analysis: &'a Analysis,
    index: usize,
}

impl State<'_> {
    /// The error of the weighted sum of some terms on this state; what each element adds is added to `by_element`.
    fn error_of(&mut self, terms: &[&Term], by_element: Option<&mut Vec<f64>>) -> Result<f64, Error> {
        let mesh = &self.analysis.mesh;
        let solution = &self.analysis.solutions[self.index];
        let own = || terms.iter().filter(|term| term.states.contains(&self.index));
        for &winding in own().flat_map(|term| term.functional.windings()) {
            if let Some(response) = solution.response(winding) {
                self.enriched.respond(winding, response)?;
            }
        }
        let model = self.enriched.model();
        let [before, half_way, after] = [0.0, 0.5, 1.0].map(|share| self.enriched.state(share));
        let mut error = 0.0;
        let mut right_side = vec![c64::default(); model.unknown_count()];
        let mut inductances = Vec::new();
        for term in own() {
            let at = |state| term.functional.evaluate(model, mesh, state);
            error += term.weight * (at(&after)?.value - at(&before)?.value);
            let FunctionalValue { derivative, inductances: of_term, .. } = at(&half_way)?;
            right_side.resize(right_side.len().max(derivative.len()), c64::default());
            right_side.iter_mut().zip(derivative).for_each(|(sum, d)| *sum += term.weight * d);
            inductances.extend(of_term.into_iter().map(|(j, k, slope)| (j, k, term.weight * slope)));
        }
        let weighed = self.enriched.weigh(self.coarse, &right_side)?;
        if let Some(sums) = by_element {
            sums.iter_mut().zip(&weighed.by_element).for_each(|(sum, own)| *sum += own);
            let more = self.enriched.weigh_inductances(self.coarse, &inductances);
            sums.iter_mut().zip(more).for_each(|(sum, own)| *sum += own);
        }
        Ok(error + weighed.remainder)
    }
}
