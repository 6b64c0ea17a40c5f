//! `[objective]` and `[[probes]]`: what is made small or large, and what is looked at.

use serde::Serialize;
use serde_json::json;

use super::functional::{Functional, keys_of_the_kind};
use crate::config::section::Section;
use crate::config::table::rules::Then;
use crate::config::table::{Group, table};
use crate::config::value::choice::choice;

/// The keys that belong to a term.
const OF_A_TERM: [&str; 12] = [
    "kind",
    "region",
    "coils",
    "harmonics",
    "weighting",
    "target",
    "compare",
    "direction",
    "follow",
    "frequency",
    "load",
    "weight",
];

table! {
    /// What is made small or large; needed by `run` and `gradient`. Either one functional, with its keys in `[objective]`
    /// itself, or several, each in `[[objective.terms]]`: the objective is then Σ `weight` · value, or the worst of them, and only
    /// `goal` and `combine` stay in `[objective]`.
    ///
    /// The objective of the initial design must not be zero: a method sees the objective over its size there.
    ///
    /// ```toml
    /// [objective]
    /// kind = "flux_density_squared"
    /// region = "observation"
    /// weighting = "point"
    /// ```
    pub struct Objective {
        /// Which way is better. Most objectives are errors, fields or losses.
        goal: Goal = WORD => Goal::Minimise;
        /// What the terms make together. In a worst case a term without `frequency` and `load` is one under each load, at each
        /// frequency, but for volumes and masses; with the algorithms `mma`,
        /// `ccsaq` and `slsqp`.
        combine: Combination = WORD => Combination::Sum;
        /// What is combined.
        #[serde(flatten)]
        sum: Sum = KEYS;
    }
}

table! {
    /// The keys of one term, or `terms`.
    pub(in crate::config) struct SumKeys {
        /// What is measured.
        #[serde(flatten)]
        functional: Functional = KEYS;
        /// Factor on the value in SI, not 0.
        #[also(not_zero)]
        weight: f64 = number(FINITE) => 1.0;
        /// The terms of a weighted sum, instead of the other keys.
        terms: Option<Vec<Term>> = not_empty(TABLES);
    }
    rules = |rules| rules
        .with("terms", Then { required: &[], refused: &OF_A_TERM })
        .branch(json!({ "not": { "required": ["terms"] } }), "then", keys_of_the_kind);
}

choice! {
    /// Which way an objective is better.
    pub use fluxmorph_optimizer::objective as Goal {
        /// Smaller.
        Minimise = "minimise",
        /// Larger.
        Maximise = "maximise",
    }
}

choice! {
    /// What several terms make together.
    pub use fluxmorph_optimizer::objective as Combination {
        /// Σ `weight` · value.
        Sum = "sum",
        /// The worst of `weight` · value: the largest where it is minimised, the least where it is maximised.
        WorstCase = "worst_case",
    }
}

/// The terms of an objective as they are written.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Sum {
    /// One term, with its keys in `[objective]` itself.
    One(Term),
    /// `[[objective.terms]]`.
    Several {
        /// The terms, at least one.
        terms: Vec<Term>,
    },
}

table! {
    /// One term of the objective.
    ///
    /// ```toml
    /// [[objective.terms]]
    /// kind = "loss"
    /// region = "plate"
    /// weight = 0.2
    ///
    /// [[objective.terms]]
    /// kind = "field_component"
    /// region = "observation"
    /// direction = [0, 0, 1]
    /// weight = 1000
    /// ```
    pub struct Term {
        /// What is measured.
        #[serde(flatten)]
        functional: Functional = KEYS;
        /// Factor on the value in SI, not 0.
        #[also(not_zero)]
        weight: f64 = number(FINITE) => 1.0;
    }
    check = Term::check;
    rules = keys_of_the_kind;
}

table! {
    /// Points at which the flux density is reported.
    ///
    /// ```toml
    /// [[probes]]
    /// name = "behind the plate"
    /// points = [["0 mm", "0 mm", "-50 mm"], ["20 mm", "60 mm", "-50 mm"]]
    /// ```
    pub struct Probe {
        /// What the points are called in the results; each name once.
        name: String = TEXT, need "\"behind the plate\"";
        /// The points [m], at least one. The flux density is recovered from the potentials around a point, within one material
        /// (`docs/theory.md`, section 3). A point outside the mesh at the start is a fault; one that the moving mesh leaves behind
        /// is `null` in the result, with a warning.
        points: Vec<[f64; 3]> = not_empty(length(FINITE)), need "[[\"0 mm\", \"0 mm\", \"-50 mm\"]]";
    }
}

impl Term {
    /// What stands before its name where its value is weighted: `1000 times `.
    pub fn weight_in_words(&self) -> String {
        if self.weight == 1.0 { String::new() } else { format!("{} times ", self.weight) }
    }
}

impl Objective {
    /// What is done to its value.
    pub fn goal_word(&self) -> &'static str {
        match self.goal {
            Goal::Minimise => "minimise",
            Goal::Maximise => "maximise",
        }
    }

    /// Which of its terms a worst case is, in words; `None` of a sum.
    pub fn worst(&self) -> Option<&'static str> {
        match (self.combine, self.goal) {
            (Combination::Sum, _) => None,
            (Combination::WorstCase, Goal::Minimise) => Some("the largest"),
            (Combination::WorstCase, Goal::Maximise) => Some("the least"),
        }
    }

    /// Whether the field has a say in it; a volume or mass alone is of the shape.
    pub fn is_of_field(&self) -> bool {
        self.terms().iter().any(|term| term.functional.kind.is_of_field())
    }

    /// The unit of its value in SI, where all its terms have the same.
    pub fn si_unit(&self) -> Option<&'static str> {
        let mut units = self.terms().iter().map(|term| term.functional.dimension().si_unit());
        let first = units.next()?;
        units.all(|unit| unit == first).then_some(first)
    }

    /// The unit behind its value; empty of a ratio, and where its terms have several.
    pub fn shown_unit(&self) -> &'static str {
        self.si_unit().filter(|unit| *unit != "1").unwrap_or_default()
    }

    /// What stands behind its value: a blank and that unit, or nothing.
    pub fn behind_value(&self) -> String {
        let unit = self.shown_unit();
        if unit.is_empty() { String::new() } else { format!(" {unit}") }
    }

    /// The terms, at least one.
    pub fn terms(&self) -> &[Term] {
        match &self.sum {
            Sum::One(term) => std::slice::from_ref(term),
            Sum::Several { terms } => terms,
        }
    }

    /// The key path of a term, for messages.
    pub fn path(&self, term: usize) -> String {
        match self.sum {
            Sum::One(_) => "objective".to_owned(),
            Sum::Several { .. } => format!("objective.terms[{term}]"),
        }
    }
}

impl Group for Sum {
    type Written = SumKeys;

    fn of(written: SumKeys, section: &Section<'_>) -> Self {
        let SumKeys { functional, weight, terms } = written;
        if !section.has("terms") {
            let mut term = Term { functional, weight };
            term.check(section);
            return Self::One(term);
        }
        for key in OF_A_TERM.into_iter().filter(|key| section.has(key)) {
            let message = format!("`objective` has both `terms` and `{key}`");
            section.wrong(key, message, format!("`{key}` inside [[objective.terms]]"));
        }
        Self::Several { terms: terms.unwrap_or_default() }
    }
}

impl Term {
    fn check(&mut self, section: &Section<'_>) {
        if self.weight == 0.0 {
            let message = format!("`{}.weight` is 0: the term has no effect", section.path());
            section.wrong("weight", message, "any number but 0, or no term");
        }
        self.functional.check(section);
    }
}
