//! `[objective]` and `[[probes]]`: what is made small or large, and what is looked at.

use fluxmorph_optimizer::objective;
use schemars::{JsonSchema, Schema};
use serde::Serialize;
use serde_json::json;

use super::choice::choice;
use super::functional::{Functional, keys_of_the_kind};
use super::range::Range;
use super::section::Section;
use crate::schema::form::{length, not_empty, not_zero, number};
use crate::schema::rules::{Rules, Then};

/// The keys that belong to a term.
const OF_A_TERM: [&str; 7] = ["kind", "region", "weighting", "target", "direction", "frequency", "weight"];

/// What is made small or large; needed by `run` and `gradient`. Either one functional, with its keys in `[objective]`
/// itself, or a weighted sum of several, each in `[[objective.terms]]`: the objective is then Σ `weight` · value, and only
/// `goal` stays in `[objective]`.
///
/// The objective of the initial design must not be zero: a method sees the objective over its size there.
///
/// ```toml
/// [objective]
/// kind = "flux_density_squared"
/// region = "observation"
/// weighting = "point"
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Objective {
    /// Which way is better. Most objectives are errors, fields or losses.
    #[schemars(extend("default" = Goal::Minimise))]
    pub goal: Goal,
    /// What is summed.
    #[serde(flatten)]
    #[schemars(with = "SumKeys")]
    pub sum: Sum,
}

/// The keys of one term, or `terms`.
#[derive(JsonSchema)]
#[schemars(transform = one_term_or_several)]
#[allow(dead_code, reason = "stands for the keys of `Sum` in the schema")]
struct SumKeys {
    #[serde(flatten)]
    one: TermKeys,
    /// The terms of a weighted sum, instead of the other keys.
    #[schemars(transform = not_empty)]
    terms: Option<Vec<Term>>,
}

/// The keys of a term, without their rules.
#[derive(JsonSchema)]
#[allow(dead_code, reason = "stands for the keys of `Term` in the schema")]
struct TermKeys {
    #[serde(flatten)]
    functional: Functional,
    /// Factor on the value in SI, not 0.
    #[schemars(transform = number(Range::FINITE), transform = not_zero, extend("default" = 1))]
    weight: f64,
}

fn one_term_or_several(schema: &mut Schema) {
    let mut one = Schema::default();
    keys_of_the_kind(&mut one);
    let none = Then { required: &[], refused: &OF_A_TERM };
    Rules::of(schema)
        .with("terms", none)
        .add(json!({ "if": { "not": { "required": ["terms"] } }, "then": one }));
}

choice! {
    /// Which way an objective is better.
    pub enum Goal {
        /// Smaller.
        Minimise = "minimise",
        /// Larger.
        Maximise = "maximise",
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
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(transform = keys_of_the_kind)]
pub struct Term {
    /// What is measured.
    #[serde(flatten)]
    pub functional: Functional,
    /// Factor on the value in SI, not 0.
    #[schemars(transform = number(Range::FINITE), transform = not_zero, extend("default" = 1))]
    pub weight: f64,
}

/// Points at which the flux density is reported.
///
/// ```toml
/// [[probes]]
/// name = "behind the plate"
/// points = [["0 mm", "0 mm", "-50 mm"], ["20 mm", "60 mm", "-50 mm"]]
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Probe {
    /// What the points are called in the results; each name once.
    pub name: String,
    /// The points [m], at least one. The flux density is recovered from the potentials around a point, within one material
    /// (`docs/theory.md`, section 3). A point outside the mesh at the start is a fault; one that the moving mesh leaves behind
    /// is `null` in the result, with a warning.
    #[schemars(transform = length(Range::FINITE), transform = not_empty)]
    pub points: Vec<[f64; 3]>,
}

impl Objective {
    /// The unit of its value in SI, where all its terms have the same.
    pub fn si_unit(&self) -> Option<&'static str> {
        let mut units = self.terms().iter().map(|term| term.functional.dimension().si_unit());
        let first = units.next()?;
        units.all(|unit| unit == first).then_some(first)
    }

    /// Reads the table; `frequencies` [Hz] are those of the analysis, empty where they are unknown.
    pub(super) fn read(section: Section<'_>, frequencies: &[f64]) -> Self {
        let goal = section.choice("goal").unwrap_or(Goal::Minimise);
        let sum = if section.has("terms") {
            let terms: Vec<Term> = section
                .tables("terms")
                .into_iter()
                .map(|inner| {
                    let term = Term::read(&inner, frequencies);
                    inner.finish();
                    term
                })
                .collect();
            for key in OF_A_TERM {
                if section.skip(key) {
                    let message = format!("`objective` has both `terms` and `{key}`");
                    section.wrong(key, message, format!("`{key}` inside [[objective.terms]]"));
                }
            }
            if terms.is_empty() {
                section.wrong("terms", "`objective.terms` has no term", "at least one [[objective.terms]]");
            }
            Sum::Several { terms }
        } else {
            section.skip("terms");
            Sum::One(Term::read(&section, frequencies))
        };
        section.finish();
        Self { goal, sum }
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

impl Term {
    fn read(section: &Section<'_>, frequencies: &[f64]) -> Self {
        let weight = section.number("weight", Range::FINITE).unwrap_or(1.0);
        if weight == 0.0 {
            let message = format!("`{}.weight` is 0: the term has no effect", section.path());
            section.wrong("weight", message, "any number but 0, or no term");
        }
        Self { functional: Functional::read(section, frequencies), weight }
    }
}

/// Read `[[probes]]`.
pub(super) fn read_probes(root: &Section<'_>) -> Vec<Probe> {
    let read = |section: Section<'_>| {
        let name = section.text("name");
        let points = section.points("points");
        let probe = Probe {
            name: section.need("name", name, "\"behind the plate\""),
            points: section.need("points", points, "[[\"0 mm\", \"0 mm\", \"-50 mm\"]]"),
        };
        section.finish();
        probe
    };
    let probes: Vec<_> = root.tables("probes").into_iter().map(read).collect();
    let names: Vec<_> = probes.iter().map(|probe| probe.name.clone()).collect();
    root.named_twice("probes", &names, "probes", "a different name for each probe");
    probes
}

impl From<Goal> for objective::Goal {
    fn from(goal: Goal) -> Self {
        match goal {
            Goal::Minimise => Self::Minimise,
            Goal::Maximise => Self::Maximise,
        }
    }
}
