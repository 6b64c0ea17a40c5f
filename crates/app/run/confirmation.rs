//! How exact the objective of a run or an analysis is: estimated errors, the same shapes by other elements, the verdict.
//!
//! A run has second opinions: the ratio on a mesh that the optimiser never saw (`mesh_independence`), the ratio
//! without the estimated errors, and that of other elements on the same mesh. What the facets of curved surfaces change (`facets`)
//! may speak against a gain. First-order edge elements are checked by what
//! the estimate has of second order, which is no third opinion, second-order ones by the first, nodal ones by edge elements of their order, which are
//! right where these are not. None of them costs more than a few evaluations; what fails or does not fit is said, and costs
//! the run nothing else.

use fluxmorph_geometry::Mesh;
use fluxmorph_optimizer::driver::Best;
use fluxmorph_optimizer::problem::{
    Analysis, Derivatives, ErrorEstimate, NoProgress, ObjectiveError, Problem,
};
use fluxmorph_remesh::Moved;

use super::estimate::{Estimate, Estimator, left_out};
use super::facets::Shape;
use super::finer::{Cut, FinerProblem, looked_at_once};
use super::{Session, excess, reported};
use crate::build::memory_limit;
use crate::config::{Config, ElementOrder, Elements, Objective, SolverMethod, SourceMap};
use crate::error::Error;
use crate::files::{
    Accuracy, CrossCheck, CurvedFacets, ObjectiveResult, OverwritePolicy, Refinements, StopReason, Verdict,
    relative_bar,
};
use crate::show::Observer;

/// The meshes of the initial and of the best shape, and the one with all regions that both began as.
#[derive(Clone, Debug)]
pub struct ShapeMeshes {
    /// As read or generated.
    pub full: Mesh,
    /// Without the regions that their surfaces replace: of the initial and of the best shape.
    pub solved: [Mesh; 2],
    /// The terms of a worst case at both, with their weights; empty otherwise.
    pub members: [Vec<f64>; 2],
}

/// The initial design when the search is over.
pub(super) enum InitialField {
    /// Its mesh.
    Moved(Box<Moved>),
    /// Its field, once that was asked for.
    Solved(Box<Analysis>),
}

impl InitialField {
    fn mesh(&self) -> &Mesh {
        match self {
            Self::Moved(moved) => &moved.mesh,
            Self::Solved(analysis) => &analysis.mesh,
        }
    }

    /// The field, where that is known.
    pub(super) fn known(&self) -> Option<&Analysis> {
        match self {
            Self::Moved(_) => None,
            Self::Solved(analysis) => Some(analysis),
        }
    }

    /// The field, by the methods of the linear solver that worked for the best design.
    pub(super) fn analysis(self, problem: &Problem, best: &Analysis) -> Result<Box<Analysis>, Error> {
        match self {
            Self::Moved(moved) => {
                let cache = &mut problem.cache_after(best);
                Ok(Box::new(problem.analyse(*moved, Derivatives::None, cache, &mut NoProgress)?))
            }
            Self::Solved(analysis) => Ok(analysis),
        }
    }
}

/// What is known of the values of a run before they are checked.
pub(super) struct Known<'a> {
    /// Estimated errors of the objective at the initial and the best design [its unit].
    pub(super) errors: Option<[ObjectiveError; 2]>,
    /// What impedance surfaces leave out of it at both [its unit].
    pub(super) excess: Option<[f64; 2]>,
    /// Whether their estimate was cut short.
    pub(super) is_cut_short: bool,
    /// How the mesh was refined.
    pub(super) refinements: Option<&'a Refinements>,
}

impl Session<'_> {
    /// What estimates the errors of this run's analyses.
    pub(super) fn estimator(&self) -> Estimator<'_> {
        Estimator::new((self.config, self.source), (&self.setup.problem, &self.setup.full_mesh))
    }

    /// Whether a run that ends by itself has its errors estimated.
    pub(super) fn has_errors_estimated(&self) -> bool {
        let is_asked_for =
            self.config.output.verify_refinement != 0.0 || self.config.accuracy.tolerance.is_some();
        let constraints = self.setup.problem.constraints();
        let is_of_field = || constraints.iter().any(|own| own.quantity.is_of_field());
        is_asked_for && (self.has_field_objective() || is_of_field())
    }

    /// The estimated errors at the initial and the best design of a run, of which the last is `at_best` where that is known.
    pub(super) fn estimate_errors(
        &self,
        initial: InitialField,
        (best, stop_reason): (&Best, StopReason),
        at_best: Option<Estimate>,
        observer: &mut dyn Observer,
    ) -> Option<(ErrorEstimate, Estimate)> {
        if self.is_cut_short(stop_reason) || !self.has_errors_estimated() {
            return None;
        }
        let (best, mut estimator) = (&best.analysis, self.estimator());
        let at_best = at_best.or_else(|| estimator.estimate(best, observer))?;
        if best.mesh.points() == initial.mesh().points() {
            return Some((at_best.errors.clone(), at_best));
        }
        match initial.analysis(&self.setup.problem, best) {
            Ok(initial) => Some((estimator.errors(&initial, observer)?, at_best)),
            // It was solved when the search began: what fails now costs the estimate, not the run.
            Err(error) => left_out(error, observer),
        }
    }
}

impl Session<'_> {
    /// What is known of how exact the ratio of a run is.
    pub(super) fn accuracy(
        &self,
        (objective, stop_reason, keeps_all): (&ObjectiveResult, StopReason, bool),
        meshes: &ShapeMeshes,
        known: &Known<'_>,
        observer: &mut dyn Observer,
    ) -> Option<Accuracy> {
        let &Known { errors, excess, refinements, .. } = known;
        let is_said = errors.is_some()
            || objective.is_verified_on_cut_elements()
            || self.is_geometry_looked_at() && self.is_checked(stop_reason);
        let facets = if is_said { self.facets_of_run((objective, errors), meshes, observer) } else { None };
        let near_wall = is_said.then(|| self.near_wall_noted(observer)).flatten();
        let mut accuracy = Accuracy { facets, near_wall, excess, ..Accuracy::default() };
        let of_run = [objective.initial, objective.best];
        if let Some(notice) = excess.and_then(|excess| excess::described(excess, of_run)) {
            observer.notice(&notice);
        }
        if !self.has_field_objective() {
            return Some(accuracy).filter(Accuracy::says_something_of_the_geometry);
        }
        if let Some(refinements) = refinements {
            accuracy.refined(refinements);
        }
        accuracy.within_tolerance =
            self.is_within_tolerance(&accuracy, (objective, stop_reason), known, observer);
        let corrected = errors.map(|errors| accuracy.estimated(of_run, errors));
        let analysis = &self.config.analysis;
        let is_checked = self.is_checked(stop_reason) && objective.ratio != 1.0;
        accuracy.cross_check = match (analysis.elements, analysis.order) {
            (Elements::Edge, ElementOrder::Linear) => {
                if is_checked && corrected.is_none() {
                    observer.notice(
                        "the best shape is not checked by other elements: of first-order edge elements the estimated error is \
                         that check, and there is none",
                    );
                }
                let of = |values: [f64; 2]| {
                    let ratio = values[1] / values[0];
                    CrossCheck { elements: "edge".to_owned(), order: 2, ratio, values, by_estimate: true }
                };
                corrected.map(of)
            }
            _ if is_checked => self.by_other_elements(objective, meshes, observer),
            _ => None,
        };
        self.judge(&mut accuracy, (objective, corrected), keeps_all, observer);
        (accuracy != Accuracy::default()).then_some(accuracy)
    }

    /// Whether a tolerance is kept; `None` without one, and where the errors or what facets change are not known.
    fn is_within_tolerance(
        &self,
        accuracy: &Accuracy,
        (objective, stop_reason): (&ObjectiveResult, StopReason),
        &Known { errors, excess, refinements, .. }: &Known<'_>,
        observer: &mut dyn Observer,
    ) -> Option<bool> {
        let of_facets = accuracy.facets.as_ref().map_or(Some([0.0; 2]), |facets| facets.change)?;
        let unrefined = [of_facets, excess.unwrap_or_default()];
        let kept = kept(self.config.accuracy.tolerance?, (errors?, unrefined), objective, observer);
        let at_limit = matches!(stop_reason, StopReason::MaxEvaluations | StopReason::MaxTime);
        let can_refine = |own: &Refinements| own.refinements.len() < self.config.accuracy.max_refinements;
        if kept == Kept::ByNoBar && at_limit && refinements.is_some_and(can_refine) {
            observer.notice(&format!(
                "{}: a run that is resumed with more looks at its mesh again",
                stop_reason.describe()
            ));
        }
        Some(kept == Kept::Yes)
    }

    /// What the facets of a run change at its initial and its best shape.
    fn facets_of_run(
        &self,
        (objective, errors): (&ObjectiveResult, Option<[ObjectiveError; 2]>),
        meshes: &ShapeMeshes,
        observer: &mut dyn Observer,
    ) -> Option<CurvedFacets> {
        let [initial, best] = meshes.solved.each_ref();
        let values = [objective.initial, objective.best];
        let shapes = [initial, best].into_iter().enumerate().map(|(k, mesh)| Shape {
            mesh,
            objective: Some((values[k], errors.map(|errors| errors[k].signed))),
            analysis: None,
        });
        let shapes: Vec<Shape<'_>> = shapes.collect();
        let shapes = match self.has_field_objective() && self.is_geometry_looked_at() {
            false => &[],
            true if initial.points() == best.points() => &shapes[..1],
            true => &shapes[..],
        };
        Some(self.facets_of(self.cut_shape(objective, meshes), shapes, observer)?.facets)
    }

    /// Judges the gain of a run by the other values that are known of its objective, of which `corrected` are those without the
    /// estimated errors.
    fn judge(
        &self,
        accuracy: &mut Accuracy,
        (objective, corrected): (&ObjectiveResult, Option<[f64; 2]>),
        keeps_all: bool,
        observer: &mut dyn Observer,
    ) {
        let cross_check = accuracy.cross_check.as_ref().map(|check| check.values);
        let verified = objective.verification.as_ref().map(|found| [found.initial, found.best]);
        let mut others: Vec<[f64; 2]> = [verified, corrected, cross_check].into_iter().flatten().collect();
        // Of the same mesh and elements: they may speak against a gain, and are none for it.
        let on_surfaces = accuracy.facets.as_ref().and_then(|facets| facets.change);
        if !others.is_empty() {
            let changed = |[first, last]: [f64; 2]| [objective.initial + first, objective.best + last];
            others.extend([on_surfaces, accuracy.excess].into_iter().flatten().map(changed));
        }
        // A best design that is none for the objective alone, as where it has to keep a constraint first, has no gain, nor has one
        // that violates a constraint.
        let sign = self.config.objective.as_ref().map_or(1.0, |objective| objective.goal.sign());
        if keeps_all && sign * objective.best < sign * objective.initial {
            accuracy.judge([objective.initial, objective.best], &others);
        }
        if accuracy.verdict == Some(Verdict::NotConfirmed) {
            let cure = match self.config.analysis.order {
                ElementOrder::Linear => "refine the mesh, or take analysis.order = 2",
                ElementOrder::Quadratic => "refine the mesh",
            };
            observer.warning(&format!(
                "the gain of this run is not confirmed: less than half of F/F0 - 1, or a quarter of F - F0, is left on another \
                 mesh, by other elements, without the estimated errors, with its facets on their surfaces or with what impedance \
                 surfaces leave out. Cure: {cure}, with smaller faces where they are curved"
            ));
        }
        if accuracy.hides_gain([objective.initial, objective.best]) {
            observer.warning(
                "the gain of this run is smaller than its error bar: the checks have a gain as well, but how large it is stays \
                 open; a finer mesh tells",
            );
        }
    }

    /// The ratio by elements that the estimate knows nothing of; where there is none the reason is reported.
    fn by_other_elements(
        &self,
        objective: &ObjectiveResult,
        meshes: &ShapeMeshes,
        observer: &mut dyn Observer,
    ) -> Option<CrossCheck> {
        observer.phase("checking the best shape by other elements");
        let of_run = [objective.initial, objective.best];
        match cross_check(self.config, self.source, (meshes, of_run), self.interrupted) {
            Ok(Some(CrossChecked::Ratio(found))) => return Some(found),
            Ok(Some(CrossChecked::NotResolved([found, own]))) => observer.notice(&format!(
                "the best shape is not checked by other elements: those of first order have {found:.3e} for the objective or a term \
                 of it at the initial shape, {own:.3e} of this run, and do not resolve a change of {:.3e}",
                of_run[1] - of_run[0]
            )),
            Ok(None) => {}
            Err(error) => observer.notice(&format!("there is no check by other elements: {error}")),
        }
        None
    }

    /// Whether what no estimate of the field has is looked at, whatever the order: where there is an objective, or something is
    /// reported.
    pub(super) fn is_geometry_looked_at(&self) -> bool {
        let is_of_something =
            self.config.objective.is_some() || reported::is_something(self.config, &self.setup.problem);
        self.config.accuracy.estimate != Some(false) && is_of_something
    }

    /// Whether the objective has errors of the field; those of a volume or mass are its constraints'.
    pub(super) fn has_field_objective(&self) -> bool {
        self.config.objective.as_ref().is_some_and(Objective::is_of_field)
    }

    /// The best shape, where a control grid gives it between the nodes too and the check kept its facets: a mesh that is generated anew
    /// has other ones.
    fn cut_shape<'a>(&self, objective: &ObjectiveResult, meshes: &'a ShapeMeshes) -> Option<&'a Mesh> {
        (self.has_grid() && objective.is_verified_on_cut_elements()).then_some(&meshes.solved[1])
    }

    /// Whether a control grid gives the shape, between the nodes too.
    pub(super) fn has_grid(&self) -> bool {
        self.config.design.as_ref().is_some_and(|design| design.grid.is_some())
    }

    /// What no estimate has of a near wall, which is reported.
    pub(super) fn near_wall_noted(&self, observer: &mut dyn Observer) -> Option<String> {
        self.near_wall.iter().for_each(|near| observer.notice(near));
        self.near_wall.clone()
    }

    /// Whether the result of a run that has ended so is to be looked at again.
    pub(super) fn is_checked(&self, stop_reason: StopReason) -> bool {
        self.config.output.verify_refinement != 0.0 && !self.is_cut_short(stop_reason)
    }

    /// Whether a run is to end now.
    fn is_cut_short(&self, stop_reason: StopReason) -> bool {
        matches!(stop_reason, StopReason::Interrupted | StopReason::MaxTime) || (self.interrupted)()
    }
}

/// Whether a tolerance is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kept {
    /// By the error bars with what no refinement takes away.
    Yes,
    /// By the error bars, but not with what no refinement takes away.
    ButForUnrefined,
    /// An error bar is beyond it.
    ByNoBar,
}

/// Whether the error bars of both designs, with what facets change and what impedance surfaces leave out, are within a tolerance;
/// which are not is reported.
fn kept(
    tolerance: f64,
    (errors, [of_facets, of_surfaces]): ([ObjectiveError; 2], [[f64; 2]; 2]),
    objective: &ObjectiveResult,
    observer: &mut dyn Observer,
) -> Kept {
    let larger = objective.initial.abs().max(objective.best.abs());
    let designs = [("initial", objective.initial), ("best", larger)];
    let (mut kept, mut beyond) = (Kept::Yes, Vec::new());
    for (k, (design, scale)) in designs.into_iter().enumerate() {
        let bar = relative_bar(errors[k].size, scale).unwrap_or(f64::INFINITY);
        let [facets, surfaces] = [of_facets[k], of_surfaces[k]].map(|change| (change / scale).abs());
        if bar + facets + surfaces <= tolerance {
            continue;
        }
        if bar > tolerance {
            kept = Kept::ByNoBar;
        } else if kept == Kept::Yes {
            kept = Kept::ButForUnrefined;
        }
        let more = [("the change of facets", facets), ("what impedance surfaces leave out", surfaces)];
        let more = more.map(|(what, size)| match size {
            0.0 => String::new(),
            _ => format!(" and {what} {:.3} %", 100.0 * size),
        });
        beyond.push(format!("{:.3} %{} for the {design} design", 100.0 * bar, more.concat()));
    }
    if !beyond.is_empty() {
        let cure = match kept {
            Kept::ButForUnrefined if of_surfaces == [0.0; 2] => {
                "; no refinement takes the facets away, but a mesh with smaller faces on curved surfaces"
            }
            Kept::ButForUnrefined if of_facets == [0.0; 2] => {
                "; no refinement takes that away, but meshing the regions that are surfaces"
            }
            Kept::ButForUnrefined => {
                "; no refinement takes that away, but meshing the regions that are surfaces, with smaller faces where they are curved"
            }
            _ => "",
        };
        observer.notice(&format!(
            "accuracy.tolerance is {:.3} %, and on the last mesh the error bar is {}{cure}",
            100.0 * tolerance,
            beyond.join(", ")
        ));
    }
    kept
}

/// What other elements say of a gain.
#[derive(Debug)]
pub(super) enum CrossChecked {
    /// It by them.
    Ratio(CrossCheck),
    /// Nothing: they are of lower order than those of the run, and have the first of these values at the initial shape where the run
    /// has the second: farther from it than the objectives of both shapes are from each other.
    NotResolved([f64; 2]),
}

/// The ratio of a run with these objectives by other elements on its own mesh; `None` for first-order edge elements, which the
/// estimate checks, and where it was interrupted.
pub(super) fn cross_check(
    config: &Config,
    source: &SourceMap,
    (meshes, [first, last]): (&ShapeMeshes, [f64; 2]),
    interrupted: &dyn Fn() -> bool,
) -> Result<Option<CrossChecked>, Error> {
    let order = match (config.analysis.elements, config.analysis.order) {
        (Elements::Nodal, order) => order,
        (Elements::Edge, ElementOrder::Quadratic) => ElementOrder::Linear,
        (Elements::Edge, ElementOrder::Linear) => return Ok(None),
    };
    let mut other = Config { constraints: Vec::new(), ..config.clone() };
    (other.analysis.elements, other.analysis.order) = (Elements::Edge, order);
    (other.analysis.penalty, other.analysis.linear_solver.method) = (1.0, SolverMethod::Automatic);
    let problem = FinerProblem::new(&looked_at_once(other), source, &meshes.full, Cut::Halvings(0))?;
    memory_limit::check_problem(&problem.setup.problem, source, OverwritePolicy::Keep)?;
    let Some(analyses) = problem.analyses(&meshes.solved, interrupted)? else { return Ok(None) };
    let [initial, best] = analyses.each_ref().map(|analysis| analysis.objective.unwrap_or(f64::NAN));
    let is_lower = u8::from(order) < u8::from(config.analysis.order);
    let mut at_initial = vec![[initial, first]];
    if let Some(objective) = problem.setup.problem.objective() {
        let found = |k: usize| analyses[0].members[k].value;
        let worst = meshes.members.iter().filter(|members| !members.is_empty());
        let worst = worst.map(|members| objective.worst(members));
        at_initial.extend(worst.map(|k| [found(k), meshes.members[0][k]]));
    }
    let gain = if is_lower { (last - first).abs() } else { f64::INFINITY };
    Ok(Some(opinion([initial, best], &at_initial, gain, order.into())))
}

/// What edge elements of an order say with these objectives of the initial and the best shape: nothing where one of their values at
/// the initial shape is farther from the run's beside it than the gain is large.
fn opinion([initial, best]: [f64; 2], at_initial: &[[f64; 2]], gain: f64, order: u8) -> CrossChecked {
    if let Some(off) = at_initial.iter().find(|[found, own]| (found - own).abs() > gain) {
        return CrossChecked::NotResolved(*off);
    }
    let (elements, ratio) = ("edge".to_owned(), best / initial);
    CrossChecked::Ratio(CrossCheck { elements, order, ratio, values: [initial, best], by_estimate: false })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_of_lower_order_say_nothing_of_a_gain_below_their_error() {
        // A C-core's homogeneity: 43 times as large by first order.
        let (first, gain) = (2.16e-6, 1.49e-6);
        let opinion = |found: [f64; 2], others: &[[f64; 2]], gain| {
            opinion(found, &[&[[found[0], first]], others].concat(), gain, 1)
        };
        assert!(matches!(opinion([9.3e-5, 9.2e-5], &[], gain), CrossChecked::NotResolved([9.3e-5, _])));
        // Those of the run's order may be right where it is not.
        assert!(matches!(opinion([9.3e-5, 9.2e-5], &[], f64::INFINITY), CrossChecked::Ratio(_)));
        let CrossChecked::Ratio(check) = opinion([2.4e-6, 1.2e-6], &[], gain) else { panic!("resolved") };
        assert_eq!((check.order, check.ratio), (1, 0.5));
        // Of a worst case the term that is the worst one at the end is hidden below another at the start.
        let hidden = [4e-6, 1e-6];
        assert!(
            matches!(opinion([2.2e-6, 1.2e-6], &[hidden], gain), CrossChecked::NotResolved(of) if of == hidden)
        );
    }
}
