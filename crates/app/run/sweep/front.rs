//! The Pareto front of a sweep: which runs no other one beats in both of two criteria.
//!
//! A sweep over weights or over the bound of a constraint trades one quantity for another. What is traded follows from the keys
//! that are swept: the objective and a constraint whose bound is, else two terms of a sum, those with swept weights first.

use serde::Serialize;

use super::Setting;
use crate::config::{Combination, Config, Constraint, Functional, Limit, Objective, Term, ValueBound};
use crate::files::RunResult;

/// What runs are compared by.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Criterion {
    /// What it is called, such as `loss in plate`.
    pub name: String,
    /// Its unit; empty for none.
    pub unit: &'static str,
    /// Whether the smaller value is the better one.
    pub smaller_is_better: bool,
    #[serde(skip)]
    of: Measured,
}

/// Where a result has its value.
#[derive(Clone, Debug, PartialEq)]
enum Measured {
    /// That of all runs: values of different ones say nothing.
    Objective(Box<Objective>),
    /// The term with this number, and what it is of.
    Term(usize, Box<Functional>),
    /// The constraint with this name, and what it is of.
    Constraint(String, Option<Box<Functional>>),
}

impl Criterion {
    /// The two criteria of a configuration of which these keys are swept; `None` where nothing is traded.
    pub(super) fn pair(config: &Config, settings: &[Setting]) -> Option<[Self; 2]> {
        let objective = config.objective.as_ref()?;
        let keys: Vec<&str> = settings
            .iter()
            .filter(|setting| setting.is_swept())
            .map(|setting| setting.key.as_str())
            .collect();
        let is_bound = |k: usize| {
            let start = format!("constraints.{k}.");
            let bounds = ["upper", "upper_ratio", "lower", "lower_ratio", "minimum", "maximum"];
            keys.iter().any(|key| key.strip_prefix(&start).is_some_and(|bound| bounds.contains(&bound)))
        };
        let mut constraints = config.constraints.iter().enumerate().filter(|(k, _)| is_bound(*k));
        if let Some(constraint) = constraints.find_map(|(_, constraint)| Self::of_constraint(constraint)) {
            return Some([Self::of_objective(objective), constraint]);
        }
        if objective.combine != Combination::Sum {
            return None;
        }
        let terms = objective.terms();
        let is_swept = |k: &usize| keys.contains(&format!("objective.terms.{k}.weight").as_str());
        let (mut order, others): (Vec<usize>, Vec<usize>) = (0..terms.len()).partition(is_swept);
        if order.is_empty() {
            return None;
        }
        order.extend(others);
        let &[first, second, ..] = order.as_slice() else { return None };
        let places = [first.min(second), first.max(second)];
        let mut pair = places.map(|k| Self::of_term(objective, k));
        if pair[0].name == pair[1].name {
            let numbered = pair.iter_mut().zip(places);
            numbered.for_each(|(criterion, k)| criterion.name += &format!(" (term {})", k + 1));
        }
        Some(pair)
    }

    fn of_objective(objective: &Objective) -> Self {
        Self {
            name: match objective.terms() {
                [term] => term.weight_in_words() + &name_of(term),
                _ => "objective".to_owned(),
            },
            unit: objective.shown_unit(),
            smaller_is_better: objective.goal.sign() > 0.0,
            of: Measured::Objective(Box::new(objective.clone())),
        }
    }

    fn of_term(objective: &Objective, k: usize) -> Self {
        let term = &objective.terms()[k];
        Self {
            name: name_of(term),
            unit: term.functional.dimension().shown_unit(),
            smaller_is_better: objective.goal.sign() * term.weight > 0.0,
            of: Measured::Term(k, Box::new(term.functional.clone())),
        }
    }

    /// `None` for a thickness with two bounds, which is two constraints.
    fn of_constraint(constraint: &Constraint) -> Option<Self> {
        let is_upper =
            |bound: &ValueBound| matches!(bound, ValueBound::AtMost(_) | ValueBound::AtMostRatio(_));
        let (unit, smaller_is_better) = match &constraint.limit {
            Limit::Functional { bound, .. } => (constraint.limit.dimension().shown_unit(), is_upper(bound)),
            Limit::Thickness { minimum: Some(_), maximum: Some(_), .. } => return None,
            Limit::Thickness { minimum, .. } => ("m", minimum.is_none()),
        };
        Some(Self {
            name: constraint.name.clone(),
            unit,
            smaller_is_better,
            of: Measured::Constraint(
                constraint.name.clone(),
                constraint.limit.functional().cloned().map(Box::new),
            ),
        })
    }

    /// Its value at the best design of a run.
    pub(super) fn value(&self, result: &RunResult) -> Option<f64> {
        let objective = result.objective.as_ref();
        let value = match &self.of {
            Measured::Objective(_) => objective?.best,
            Measured::Term(k, _) => objective?.terms.get(*k)?.value,
            Measured::Constraint(name, _) => {
                result.constraints.iter().find(|constraint| constraint.name == *name)?.value
            }
        };
        value.is_finite().then_some(value)
    }

    /// Its name with its unit.
    pub(super) fn title(&self) -> String {
        if self.unit.is_empty() { self.name.clone() } else { format!("{} [{}]", self.name, self.unit) }
    }
}

/// `loss in plate under narrow_on`.
fn name_of(term: &Term) -> String {
    let functional = &term.functional;
    let mut name = functional.kind.name().replace('_', " ");
    if let Some(region) = &functional.region {
        name += &format!(" in {region}");
    }
    if let Some(coils) = &functional.coils {
        name += &format!(" of {}", coils.join(", "));
    }
    match (functional.frequency, &functional.load) {
        (_, Some(load)) => name + &format!(" under {load}"),
        (Some(frequency), None) => name + &format!(" at {frequency} Hz"),
        (None, None) => name,
    }
}

/// The points that no other one is better than in one value and at least as good as in the other, by their numbers, ordered by
/// their first value from the best one on; equal points are all on the front. `signs` make the better value the smaller one.
pub(super) fn non_dominated(points: &[(usize, [f64; 2])], signs: [f64; 2]) -> Vec<usize> {
    let mut points: Vec<(usize, [f64; 2])> =
        points.iter().map(|&(index, [a, b])| (index, [signs[0] * a, signs[1] * b])).collect();
    points.sort_by(|(i, p), (j, q)| p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])).then(i.cmp(j)));
    let mut front: Vec<(usize, [f64; 2])> = Vec::new();
    for (index, point) in points {
        if front.last().is_none_or(|(_, last)| point[1] < last[1] || point == *last) {
            front.push((index, point));
        }
    }
    front.into_iter().map(|(index, _)| index).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_what_no_other_point_beats() {
        let points =
            [[3.0, 1.0], [1.0, 3.0], [2.0, 2.0], [2.5, 2.5], [2.0, 4.0], [1.0, 5.0], [4.0, 1.0], [2.0, 2.0]];
        let numbered: Vec<(usize, [f64; 2])> = points.into_iter().enumerate().collect();
        let front = non_dominated(&numbered, [1.0, 1.0]);
        assert_eq!(front, [1, 2, 7, 0]);
        // By the definition.
        let is_beaten =
            |p: [f64; 2]| points.iter().any(|q| q[0] <= p[0] && q[1] <= p[1] && (q[0] < p[0] || q[1] < p[1]));
        for (index, point) in numbered.iter().copied() {
            assert_eq!(front.contains(&index), !is_beaten(point), "{point:?}");
        }
        // Where the larger second value is better another set is.
        assert_eq!(non_dominated(&numbered, [1.0, -1.0]), [5]);
        assert_eq!(non_dominated(&numbered, [-1.0, -1.0]), [6, 3, 4, 5]);
        assert!(non_dominated(&[], [1.0, 1.0]).is_empty());
    }

    #[test]
    fn what_is_traded_follows_from_the_swept_keys() {
        let pair = |file: &str, set: &[&str]| {
            let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("configs").join(file);
            let (config, _) = Config::from_file(&path, &[]).expect("shipped");
            let settings: Vec<Setting> =
                set.iter().map(|typed| Setting::parse(typed).expect("sound")).collect();
            Criterion::pair(&config, &settings).map(|pair| pair.map(|criterion| criterion.title()))
        };
        assert_eq!(
            pair("shield_two_frequencies.toml", &["objective.terms[1].weight=1,2"]),
            Some([
                "flux density squared in observation at 60 Hz [T²]".to_owned(),
                "flux density squared in observation at 200 Hz [T²]".to_owned()
            ])
        );
        assert_eq!(
            pair("shield_mass_limit.toml", &["constraints[0].upper=2 kg,3 kg"]),
            Some(["flux density squared in observation [T²]".to_owned(), "mass_plate [kg]".to_owned()])
        );
        assert_eq!(pair("shield_mass_limit.toml", &["optimizer.algorithm=mma,ccsaq"]), None);
        assert_eq!(
            pair("shield_mass_limit.toml", &["constraints[0].upper=2 kg"]),
            None,
            "one value is no sweep"
        );
        let current = &["coils[0].ampere_turns=20 kA,40 kA"];
        assert_eq!(pair("shield_two_frequencies.toml", current), None, "no weight is swept");
    }
}
