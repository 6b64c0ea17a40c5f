//! What `result.json` says of how exact its objective is.

use fluxmorph_optimizer::problem::ObjectiveError;
use serde::{Deserialize, Serialize};

use super::refinements::{RefinementStep, Refinements};
use super::result::ObjectiveResult;

/// Least share of a gain, as a ratio, that must be left in another discretisation.
const LEAST_SHARE: f64 = 0.5;

/// The same in the unit of the objective, which has the errors of the initial design in full: a mesh that has twice the unwanted
/// harmonics of a magnet at first may be right in that nine tenths of them can go.
const LEAST_SHARE_IN_UNIT: f64 = 0.25;

/// Share of the best value from which on the initial one is a measure of it.
const LEAST_START: f64 = 0.1;

/// Least gain, relative to the objective, of which anything can be said: a hundred times what the fields of checks are solved to.
const LEAST_GAIN: f64 = 1e-5;

/// What an estimate is multiplied by for an error bar: on meshes that show the device, estimates of 0.5 to 1.2 times the error
/// have been measured (docs/verification.md, 2.12).
pub const SAFETY: f64 = 2.0;

/// Share of a loss, or of an objective, that impedance surfaces may leave out without a word.
pub const LEAST_LEFT_OUT: f64 = 0.01;

/// Where they leave it out.
pub const WHERE_LEFT_OUT: &str =
    "at sharp edges, where they are round and where the field along them changes";

/// The share of the relative error of a value that need not cancel in the ratio of two designs, however alike their estimates
/// are: an estimate has an error itself. `shield_two_loads.toml` at a quarter of its refinement has estimates of 1.2 of both
/// values, whose difference is 8e-5 of the ratio; on meshes with 0.9 and 1.4 of its refinement the ratio differs by 1.2e-2.
const UNCANCELLED: f64 = 0.02;

/// The error bar of a value with an estimated error, relative to it: twice the estimate.
pub fn relative_bar(error: f64, value: f64) -> Option<f64> {
    relative(SAFETY * error, value)
}

/// How exact the objective is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct Accuracy {
    /// Estimated error of the ratio of a run, or of the objective of an analysis, relative to it; of a ratio at least a fiftieth of
    /// the larger of the relative errors of its two values. Errors of elements that cancel leave a part of them in each. `None` where
    /// there is no estimate, or no ratio.
    pub error_estimate_relative: Option<f64>,
    /// Estimated errors of the objective at the initial and at the best design, what the true value has more [its unit]; of an
    /// analysis both are the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_estimate: Option<[f64; 2]>,
    /// Times the mesh was refined to keep a tolerance.
    pub refinements: usize,
    /// The meshes before these refinements, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub levels: Vec<Level>,
    /// Whether the error bars are within `accuracy.tolerance`; `None` without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub within_tolerance: Option<bool>,
    /// The curved surface whose facets are farthest off it; `None` where none is curved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub facets: Option<CurvedFacets>,
    /// What the objective at the initial and at the best design has more, about, by the losses that impedance surfaces leave out at
    /// sharp edges, where they are round and where the field along them changes [its unit]; of an analysis both are the same. `None`
    /// where it has no loss of one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub excess: Option<[f64; 2]>,
    /// What a wall that is near may cut off, in words; `None` where none is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub near_wall: Option<String>,
    /// The same two shapes by other elements on the same mesh.
    pub cross_check: Option<CrossCheck>,
    /// Whether the gain of a run is the shape's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
}

/// A mesh that was not fine enough.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// Evaluations of the run before it was refined: 0 before the search.
    pub evaluations: usize,
    /// Its tetrahedra.
    pub tets: usize,
    /// The objective on it, at the initial design before the search, at the best one after.
    pub objective: f64,
    /// Its estimated error relative to it.
    pub error_estimate_relative: Option<f64>,
}

/// How far the facets of the initial mesh are from the curved surface that they stand for: an error of the geometry, in no estimate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CurvedFacets {
    /// The regions on both sides.
    pub surface: String,
    /// Distance of the surface from the middle of the edge that is farthest off it [m].
    pub off_m: f64,
    /// Where that is [m].
    pub at_m: [f64; 3],
    /// What the objective at the initial and at the best design has more, about, where the facets of all curved surfaces lie on
    /// these in the mean [its unit]; of an analysis both are the same. `None` where that is not known.
    pub change: Option<[f64; 2]>,
}

/// The gain of a run by other elements on its own mesh.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CrossCheck {
    /// Their family.
    pub elements: String,
    /// Their order.
    pub order: u8,
    /// `best / initial` by them.
    pub ratio: f64,
    /// The objective at both shapes by them; of an earlier version zero.
    #[serde(default)]
    pub values: [f64; 2],
    /// Whether it is the ratio without the estimated errors, and no opinion beside the estimate.
    #[serde(default)]
    pub by_estimate: bool,
}

/// Whether the gain of a run is the shape's, or the mesh's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Enough of it is left on another mesh, by other elements, and after the estimated error is taken off.
    Confirmed,
    /// It is not.
    NotConfirmed,
}

/// Error bars of a run: twice the estimated errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ErrorBars {
    /// Of the ratio.
    Ratio(f64),
    /// Of the initial and of the best value [unit of the objective], which have no ratio.
    Values([f64; 2]),
}

impl Accuracy {
    /// The error bars of a run with this ratio.
    pub fn error_bars(&self, ratio: f64) -> Option<ErrorBars> {
        let of = |error: f64| SAFETY * error.abs();
        let of_values = || Some(ErrorBars::Values(self.error_estimate?.map(of)));
        self.error_estimate_relative.map(|error| ErrorBars::Ratio(of(error * ratio))).or_else(of_values)
    }

    /// The same with the estimated error of the objective of an analysis.
    #[must_use]
    pub fn of_analysis(self, objective: f64, error: ObjectiveError) -> Self {
        let error_estimate_relative = relative(error.size, objective);
        Self { error_estimate_relative, error_estimate: Some([error.signed; 2]), ..self }
    }

    /// Enters how the mesh was refined.
    pub fn refined(&mut self, refinements: &Refinements) {
        self.refinements = refinements.refinements.len();
        let level = |step: &RefinementStep| Level {
            evaluations: step.evaluations,
            tets: step.tets,
            objective: step.objective,
            error_estimate_relative: relative(step.error_estimate, step.objective),
        };
        self.levels = refinements.refinements.iter().map(level).collect();
    }

    /// Whether a gain that is confirmed, between the values of the initial and of the best design, is smaller than its error bar: as a
    /// ratio, or where it has no error bar in the unit of the objective.
    pub fn hides_gain(&self, own: [f64; 2]) -> bool {
        let [initial, best] = own;
        let hides = match (self.error_estimate_relative, self.error_estimate) {
            (Some(error), _) => {
                let ratio = best / initial;
                SAFETY * error * ratio.abs() >= (ratio - 1.0).abs()
            }
            (None, Some([first, last])) => {
                let error = (last - first).abs().max(UNCANCELLED * first.abs().max(last.abs()));
                SAFETY * error >= (best - initial).abs()
            }
            (None, None) => false,
        };
        self.verdict == Some(Verdict::Confirmed) && hides
    }

    /// Whether the initial value is a measure of the best one: not near zero beside it, and beyond its own error bar where that is known.
    fn has_ratio(&self, own: [f64; 2]) -> bool {
        let bar = self.error_estimate.map_or(0.0, |errors| SAFETY * errors[0].abs());
        !begins_near_zero(own) && own[0].abs() > bar
    }

    /// What is to be said of a gain that is confirmed.
    pub fn reservation(&self, objective: &ObjectiveResult) -> Option<&'static str> {
        match self.verdict? {
            Verdict::NotConfirmed => None,
            Verdict::Confirmed if self.hides_gain([objective.initial, objective.best]) => {
                Some("smaller than its error bar")
            }
            Verdict::Confirmed => objective
                .is_violated_on_finer_mesh()
                .then_some("of a shape that violates constraints on the finer mesh"),
        }
    }

    /// Whether there is something that no estimate of the field counts.
    pub fn says_something_of_the_geometry(&self) -> bool {
        self.facets.is_some() || self.near_wall.is_some() || self.excess.is_some()
    }

    /// Enters the estimated errors of the objective at both designs of a run; its values without them.
    pub fn estimated(&mut self, [initial, best]: [f64; 2], errors: [ObjectiveError; 2]) -> [f64; 2] {
        let signed = errors.map(|error| error.signed);
        let corrected = [initial + signed[0], best + signed[1]];
        self.error_estimate = Some(signed);
        let of_ratio = relative(corrected[1] / corrected[0] - best / initial, best / initial);
        let of_values =
            [(errors[0], initial), (errors[1], best)].map(|(error, value)| relative(error.size, value));
        let is_one_design = best == initial && errors[0] == errors[1];
        let uncancelled = if is_one_design { 0.0 } else { UNCANCELLED };
        let least = of_values.into_iter().flatten().fold(0.0, f64::max) * uncancelled;
        let has_ratio = self.has_ratio([initial, best]);
        self.error_estimate_relative = of_ratio.filter(|_| has_ratio).map(|error| error.max(least));
        corrected
    }

    /// Judges a gain by what other computations have for the objective of the initial and of the best shape; nothing is said of hardly
    /// any gain, or by none. Half of the gain must be left as a ratio, and a quarter of it in the unit of the objective: where a mesh
    /// has most of both values wrong, the ratio of what is left may be anything. Of a value that begins near zero, or passes through
    /// it, there is no ratio: half of the gain must then be left in the unit of the objective. That will do, too, where the initial
    /// value is within its own error bar.
    pub fn judge(&mut self, own: [f64; 2], others: &[[f64; 2]]) {
        let [initial, best] = own;
        let gain = best / initial - 1.0;
        if gain.is_nan() || gain.abs() < LEAST_GAIN || others.is_empty() {
            return;
        }
        let (begins_near_zero, has_ratio) = (begins_near_zero(own), self.has_ratio(own));
        let is_left = others.iter().all(|[first, last]| {
            let (as_ratio, in_unit) = ((last / first - 1.0) / gain, (last - first) / (best - initial));
            !begins_near_zero && as_ratio >= LEAST_SHARE && in_unit >= LEAST_SHARE_IN_UNIT
                || !has_ratio && in_unit >= LEAST_SHARE
        });
        self.verdict = Some(if is_left { Verdict::Confirmed } else { Verdict::NotConfirmed });
    }
}

/// Whether an initial value is next to nothing beside the best one, or has the other sign.
fn begins_near_zero([initial, best]: [f64; 2]) -> bool {
    best / initial < 0.0 || initial.abs() < LEAST_START * best.abs()
}

/// The size of an error relative to a value; `None` where that is no number.
fn relative(error: f64, value: f64) -> Option<f64> {
    Some((error / value).abs()).filter(|relative| relative.is_finite())
}

impl Verdict {
    /// It in words.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Confirmed => "confirmed: the gain is the shape's",
            Self::NotConfirmed => "NOT CONFIRMED: the gain may be the mesh's",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uncancelled(signed: f64) -> ObjectiveError {
        ObjectiveError { signed, size: signed.abs() }
    }

    fn verdict(ratio: f64, others: &[f64]) -> Option<Verdict> {
        verdict_of([3.0, 3.0 * ratio], &others.iter().map(|other| [3.0, 3.0 * other]).collect::<Vec<_>>())
    }

    fn verdict_of(own: [f64; 2], others: &[[f64; 2]]) -> Option<Verdict> {
        let mut accuracy = Accuracy::default();
        accuracy.judge(own, others);
        accuracy.verdict
    }

    #[test]
    fn a_gain_that_the_error_of_the_mesh_is_most_of_is_none() {
        // The force on a magnet over a plate of air: nine tenths of it are the mesh's.
        let own = [6.14e-2, 8.48e-2];
        assert_eq!(verdict_of(own, &[[9.6e-3, 2.2e-2], [7.6e-3, 9.6e-3]]), Some(Verdict::NotConfirmed));
        assert_eq!(verdict_of(own, &[[4.0e-2, 5.6e-2]]), Some(Verdict::Confirmed));
        assert_eq!(verdict_of(own, &[[4.0e-2, -5.6e-2]]), Some(Verdict::NotConfirmed));
        // The content of a quadrupole on a coarse mesh, which has twice too much of it at first.
        let own = [4.369e-5, 2.807e-6];
        assert_eq!(verdict_of(own, &[[2.586e-5, 1.947e-6], [2.154e-5, 2.186e-6]]), Some(Verdict::Confirmed));
    }

    /// Forces that pass through zero or begin there, on a fresh mesh and in second order.
    #[test]
    fn a_value_that_begins_near_zero_has_no_ratio() {
        let own = [0.3308, -0.1923];
        assert_eq!(verdict_of(own, &[[0.7214, 0.2647], [0.70, 0.249]]), Some(Verdict::Confirmed));
        assert_eq!(verdict_of(own, &[[0.7214, 0.5214]]), Some(Verdict::NotConfirmed));
        assert_eq!(verdict_of([5.7e-8, 1.7306], &[[0.3465, 1.9867]]), Some(Verdict::Confirmed));
    }

    /// A force of which the mesh has more error than value at first, on a fresh mesh and in second order.
    #[test]
    fn a_value_within_its_error_bar_is_no_measure_of_a_gain() {
        let own = [1.575e-4, 1.4386e-3];
        let others = [[4.128e-4, 1.9218e-3], [4.012e-4, 1.9723e-3]];
        assert_eq!(verdict_of(own, &others), Some(Verdict::NotConfirmed), "as far as is known");
        let judged = |errors: [f64; 2], others: &[[f64; 2]]| {
            let mut accuracy = Accuracy { error_estimate: Some(errors), ..Accuracy::default() };
            accuracy.judge(own, others);
            accuracy.verdict
        };
        let errors = [2.437e-4, 5.337e-4];
        assert_eq!(judged(errors, &others), Some(Verdict::Confirmed));
        assert_eq!(judged(errors, &[[4.128e-4, 9.2e-4]]), Some(Verdict::NotConfirmed));
        // Most of this content is the mesh's at first, of which the ratio is the measure all the same.
        let content = [4.369e-5, 2.807e-6];
        let mut accuracy = Accuracy { error_estimate: Some([-2.215e-5, -6.2e-7]), ..Accuracy::default() };
        accuracy.judge(content, &[[2.154e-5, 2.186e-6]]);
        assert_eq!(accuracy.verdict, Some(Verdict::Confirmed));
    }

    /// The errors of both values differ by a seventh of the gain, whatever is left of the initial one.
    #[test]
    fn a_gain_from_near_zero_is_held_against_its_error_in_its_unit() {
        let hidden = |own: [f64; 2], errors: [f64; 2]| {
            let mut accuracy = Accuracy::default();
            let corrected = accuracy.estimated(own, errors.map(uncancelled));
            accuracy.judge(own, &[corrected]);
            assert_eq!(accuracy.verdict, Some(Verdict::Confirmed));
            accuracy.hides_gain(own)
        };
        assert!(!hidden([3.648e-4, 2.4518e-3], [-2.94e-4, -8e-6]));
        assert!(!hidden([-3.9e-5, 2.498e-3], [3.1e-5, 4.2e-4]));
        assert!(hidden([-3.9e-5, 2.498e-3], [-1.3e-3, 4.2e-4]));
        assert!(hidden([1.0, 0.99], [-0.1, -0.11]));
        assert!(hidden([1.0, 0.0], [-0.45, 0.2]));
    }

    #[test]
    fn half_of_a_gain_must_be_left_everywhere_whichever_way_is_better() {
        assert_eq!(verdict(0.5, &[0.52, 0.7]), Some(Verdict::Confirmed));
        assert_eq!(verdict(0.5, &[0.52, 0.8]), Some(Verdict::NotConfirmed));
        assert_eq!(verdict(0.155, &[1.37]), Some(Verdict::NotConfirmed), "the pole of nodal elements");
        assert_eq!(verdict(2.0, &[1.6]), Some(Verdict::Confirmed));
        assert_eq!(verdict(2.0, &[1.4]), Some(Verdict::NotConfirmed));
        // A best value of zero is held against the initial one, as every other is.
        assert_eq!(verdict_of([1.0, 0.0], &[[10.0, 9.4]]), Some(Verdict::NotConfirmed));
        assert_eq!(verdict_of([1.0, 0.0], &[[0.4, 0.0]]), Some(Verdict::Confirmed));
        assert_eq!(verdict(1.0, &[1.0]), None);
        assert_eq!(verdict(1.000_002_4, &[1.000_002]), None, "as much may be rounding");
        assert_eq!(verdict(0.5, &[]), None);
    }

    #[test]
    fn errors_that_both_designs_have_alike_cancel_in_the_ratio() {
        let mut accuracy = Accuracy::default();
        assert_eq!(accuracy.estimated([2.0, 1.0], [0.25, 0.125].map(uncancelled)), [2.25, 1.125]);
        assert_eq!(accuracy.error_estimate_relative, Some(0.125 * UNCANCELLED), "but for a fiftieth");
        accuracy.estimated([2.0, 1.0], [0.0, 0.1].map(uncancelled));
        let error = accuracy.error_estimate_relative.expect("a number");
        // One rounding of each of a few operations.
        assert!((error - 0.1).abs() < 1e-15, "{error}");
        assert_eq!(Accuracy::default().of_analysis(0.0, uncancelled(1.0)).error_estimate_relative, None);
        // Of an initial value within its error bar there is no ratio, nor one of it.
        accuracy.estimated([2.0, 1.0], [1.25, 0.1].map(uncancelled));
        assert_eq!((accuracy.error_estimate_relative, accuracy.error_estimate), (None, Some([1.25, 0.1])));
        // Elements whose errors cancel leave a part of theirs in the bar, and no correction.
        let cancelled = ObjectiveError { signed: -0.001, size: 0.125 };
        let accuracy = Accuracy::default().of_analysis(1.0, cancelled);
        assert_eq!(
            (accuracy.error_estimate_relative, accuracy.error_estimate),
            (Some(0.125), Some([-0.001; 2]))
        );
    }
}
