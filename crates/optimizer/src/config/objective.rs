//! `[objective]` and `[[probes]]`: what is made small or large, and what is looked at.

use serde::Serialize;

use super::choice::choice;
use super::functional::Functional;
use super::range::Range;
use super::section::{Section, first_duplicate};

/// The function to be optimised: one functional, or a weighted sum of several.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Objective {
    /// Which way is better. Default `minimise`: most objectives are errors, fields or losses.
    pub goal: Goal,
    /// What is summed.
    #[serde(flatten)]
    pub sum: Sum,
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

/// One term of an objective.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Term {
    /// What is measured.
    #[serde(flatten)]
    pub functional: Functional,
    /// Its factor. Default 1: the value in SI as it is.
    pub weight: f64,
}

/// Points at which the flux density is reported.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Probe {
    /// Its name in the results.
    pub name: String,
    /// The points [m].
    pub points: Vec<[f64; 3]>,
}

impl Objective {
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
            for key in ["kind", "region", "weighting", "target", "direction", "frequency", "weight"] {
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
    let names: Vec<_> =
        probes.iter().map(|probe| probe.name.clone()).filter(|name| !name.is_empty()).collect();
    if let Some(name) = first_duplicate(&names) {
        root.wrong("probes", format!("two probes are named `{name}`"), "a different name for each probe");
    }
    probes
}
