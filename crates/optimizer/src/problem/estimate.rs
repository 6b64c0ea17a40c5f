//! The error of objective and constraints at an analysed design, estimated by one order more on the same mesh.
//!
//! What one state contributes, and the equations, are in [`fluxmorph_solver::enrichment`].

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::{ElementId, Mesh};
use fluxmorph_solver::enrichment::{Effort, Enrichment};
use fluxmorph_solver::{FieldModel, FieldSolution, FunctionalValue};

use super::{Analysis, Problem};
use crate::error::Error;
use crate::objective::Term;

/// Estimated errors: what the true value has more than the computed one.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// Of the objective [its unit]; zero without one.
    pub objective: f64,
    /// Of each constraint on a functional of the field, with its number.
    pub constraints: Vec<(usize, f64)>,
    /// Where the objective's error is made: what each element adds to it, shape `(n_tets,)`, but for what the recovery of a field at
    /// places is off by itself; of a worst case to that of the term which is the worst without the errors.
    pub by_element: Vec<f64>,
    /// Iterations of all corrections.
    pub iterations: usize,
}

/// The estimated error of an objective [its unit].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectiveError {
    /// What the true value has more.
    pub signed: f64,
    /// Its size: elements whose errors cancel leave some of it.
    pub size: f64,
}

/// The models of one order more that estimates at several designs share: those of the undeformed mesh, as a problem's own are.
#[derive(Debug)]
pub struct EnrichedModels {
    effort: Effort,
    /// One in statics, one above 0 Hz: the others share what is large of these.
    known: [Option<FieldModel>; 2],
}

impl EnrichedModels {
    /// None yet, for estimates with so much effort.
    pub fn new(effort: Effort) -> Self {
        Self { effort, known: [None, None] }
    }

    /// That of a state of a problem with this undeformed mesh.
    fn of_state(&mut self, coarse: &FieldModel, original: &Mesh) -> Result<FieldModel, Error> {
        let known = &mut self.known[usize::from(coarse.angular_frequency() > 0.0)];
        let model = match known {
            Some(model) => model.at_load_case(original, &coarse.load_case())?,
            None => coarse.enriched(original, self.effort)?,
        };
        Ok(known.insert(model).clone())
    }
}

/// Share of the sum of their sizes to which the errors of elements cancel at most: each is known to a few per cent. In a gap of iron they
/// cancelled to a thousandth on one mesh, where finer ones have 5 to 8 % less; those of other devices left a seventieth and more.
const UNCANCELLED: f64 = 0.01;

/// Share of the error that is left of a marked element's after its edges are halved: a quarter with first order, whose
/// functionals converge with the square of the size.
const LEFT: f64 = 0.25;

/// Least and greatest share of the error whose elements are marked: less brings hardly anything, more is a uniform refinement.
/// Measured on small blocks: shares of 0.2 and 0.45 leave with 1952 and 3338 elements what 0.8 leaves with 7068 and 5206.
const MARKED: [f64; 2] = [0.2, 0.3];

impl ErrorEstimate {
    /// The error of the objective.
    pub fn of_objective(&self) -> ObjectiveError {
        let sizes: f64 = self.by_element.iter().map(|own| own.abs()).sum();
        ObjectiveError { signed: self.objective, size: self.objective.abs().max(UNCANCELLED * sizes) }
    }

    /// Elements whose refinement takes the share `excess` off the error of the objective, in the order of their numbers: those
    /// that add most to it, whatever their sign (Dörfler, SIAM J. Numer. Anal. 33 (1996) 1106).
    pub fn marked(&self, excess: f64) -> Vec<ElementId> {
        let wanted = (excess / (1.0 - LEFT)).clamp(MARKED[0], MARKED[1]);
        let mut by_size: Vec<usize> = (0..self.by_element.len()).collect();
        by_size
            .sort_by(|&a, &b| self.by_element[b].abs().total_cmp(&self.by_element[a].abs()).then(a.cmp(&b)));
        let total: f64 = by_size.iter().map(|&e| self.by_element[e].abs()).sum();
        let mut sum = 0.0;
        let is_in_share = |e: &usize| {
            let is_below = sum < wanted * total;
            sum += self.by_element[*e].abs();
            is_below
        };
        let mut marked: Vec<ElementId> =
            by_size.into_iter().take_while(is_in_share).map(ElementId::new).collect();
        marked.sort_unstable();
        marked
    }
}

impl Problem {
    /// The errors of an analysed design's values; `models` are those of this problem, as far as they are made. Each state of one
    /// order more is shown to `look` with its number.
    ///
    /// # Errors
    /// [`fluxmorph_solver::SolverError::Parameter`] for second order and for several ranks; what a linear solver fails with.
    pub fn estimate_error(
        &self,
        analysis: &Analysis,
        models: &mut EnrichedModels,
        inspect: &mut dyn FnMut(usize, &FieldModel, &FieldSolution),
    ) -> Result<ErrorEstimate, Error> {
        let groups = if self.objective().is_some() { self.groups_of_terms() } else { Vec::new() };
        let mut errors = vec![0.0; groups.len()];
        let mut by_element = vec![vec![0.0; analysis.mesh.topology().tets().len()]; groups.len()];
        let mut estimate = ErrorEstimate {
            objective: 0.0,
            constraints: self.field_constraints().map(|(k, _)| (k, 0.0)).collect(),
            by_element: Vec::new(),
            iterations: 0,
        };
        let mut before: Option<Enrichment> = None;
        for index in self.matrices().concat() {
            let coarse = &self.states()[index];
            let fine = models.of_state(coarse, self.original())?;
            // Of one frequency the factor too.
            let shared = before.take().filter(|before| before.model().shares_matrix_with(&fine));
            let solution = &analysis.solutions[index];
            let enriched = Enrichment::new(coarse, fine, (&analysis.mesh, solution), shared)?;
            let mut state = State { coarse, enriched, analysis, index };
            for ((error, by_element), group) in errors.iter_mut().zip(&mut by_element).zip(&groups) {
                *error += state.error_of(group, Some(by_element))?;
            }
            for (error, (_, term)) in estimate.constraints.iter_mut().zip(self.field_constraints()) {
                error.1 += state.error_of(&[term], None)?;
            }
            estimate.iterations += state.enriched.iterations();
            inspect(index, state.enriched.model(), &state.enriched.state(1.0));
            before = Some(state.enriched);
        }
        if groups.is_empty() {
            return Ok(estimate);
        }
        let (group, objective) = self.error_of_objective(analysis, &errors);
        // No mesh changes a term of the shape: the error that can be taken off is that of the term before.
        let has_error = |group: usize| groups[group].iter().any(|term| term.functional.is_of_field());
        let shown = match self.objective() {
            Some(sum) if !has_error(group) => sum.worst(&analysis.member_values()),
            _ => group,
        };
        Ok(ErrorEstimate { objective, by_element: by_element.swap_remove(shown), ..estimate })
    }

    /// What the objective of an analysed design has more where each term has so much more, before its weight. With an objective.
    pub fn objective_has_more(&self, analysis: &Analysis, of_term: impl Fn(&Term) -> f64) -> f64 {
        let of_group = |group: Vec<&Term>| group.into_iter().map(|term| term.weight * of_term(term)).sum();
        let errors: Vec<f64> = self.groups_of_terms().into_iter().map(of_group).collect();
        self.error_of_objective(analysis, &errors).1
    }

    /// The error of an analysed design's objective from that of its sum, or from those of each term of a worst case; with it whose
    /// of these it is. Without its error another term may be the worst one.
    ///
    /// # Panics
    /// If there is no error.
    pub fn error_of_objective(&self, analysis: &Analysis, errors: &[f64]) -> (usize, f64) {
        match self.objective() {
            Some(objective) if !analysis.members.is_empty() => {
                objective.error_of_worst(&analysis.member_values(), errors)
            }
            _ => (0, errors[0]),
        }
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
        let is_own = |term: &&&Term| term.states.contains(&self.index) && term.functional.is_of_field();
        let own = || terms.iter().filter(is_own);
        if own().next().is_none() {
            return Ok(0.0);
        }
        for &winding in own().flat_map(|term| term.functional.windings()) {
            if let Some(response) = solution.response(winding) {
                self.enriched.respond(winding, response)?;
            }
        }
        let model = self.enriched.model();
        let [half_way, after] = [0.5, 1.0].map(|share| self.enriched.state(share));
        let mut error = 0.0;
        let mut right_side = vec![c64::default(); model.unknown_count()];
        let mut inductances = Vec::new();
        for term in own() {
            let at = |state| term.functional.evaluate((model, mesh, state));
            // A field that is recovered from the same potentials is another one in either order.
            let before = term.functional.evaluate((self.coarse, mesh, solution))?;
            error += term.weight * (at(&after)?.value - before.value);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_elements_with_most_of_the_error_are_marked_whatever_their_sign() {
        let of = |by_element: &[f64], excess| {
            let estimate = ErrorEstimate {
                objective: 0.0,
                constraints: Vec::new(),
                by_element: by_element.to_vec(),
                iterations: 0,
            };
            estimate.marked(excess).into_iter().map(ElementId::index).collect::<Vec<_>>()
        };
        let errors = [1.0, -2.0, 0.0, 1.5, 2.5, 3.0, 2.0];
        // A tenth is wanted, a fifth the least: 2.4 of twelve.
        assert_eq!(of(&errors, 0.1), [5]);
        assert_eq!(of(&errors, 0.99), [4, 5], "three tenths the most: 3.6 of twelve");
        assert_eq!(of(&[0.0; 3], 0.5), [] as [usize; 0]);
    }

    #[test]
    fn errors_of_elements_cancel_to_a_hundredth_of_their_sizes_at_most() {
        let size = |objective: f64, by_element: &[f64]| {
            let by_element = by_element.to_vec();
            ErrorEstimate { objective, constraints: Vec::new(), by_element, iterations: 0 }
                .of_objective()
                .size
        };
        assert_eq!(size(-0.5, &[1.0, -1.5]), 0.5);
        assert_eq!(size(-1e-6, &[1.0, -1.0078125]), UNCANCELLED * 2.0078125);
        assert_eq!(size(1e-6, &[]), 1e-6);
    }
}
