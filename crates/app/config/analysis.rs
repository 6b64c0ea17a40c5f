//! `[analysis]`: which field problems are solved, and how exactly.

use schemars::{JsonSchema, Schema};
use serde::Serialize;

use super::Dimension;
use super::linear_solver::LinearSolver;
use super::petsc::Petsc;
use super::range::Range;
use super::section::Section;
use crate::schema::form::{each_once, integer, not_empty, number, quantity};
use crate::schema::rules::Rules;

/// Which field problem is solved, and how exactly. Every frequency is a problem of its own, and all share one mesh.
///
/// The table is required, but for a motion alone: with `[morph]` it may be left out where there is none of `[[coils]]`,
/// `[objective]`, `[boundaries]`, `[[constraints]]`, `[materials]` and `[regions]`.
///
/// ```toml
/// [analysis]
/// frequency = "60 Hz"
/// order = 1
/// linear_solver = { method = "automatic", factor_gib = 4 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Analysis {
    /// One frequency or several.
    #[serde(flatten)]
    #[schemars(with = "FrequencyKeys")]
    pub frequencies: Frequencies,
    /// Penalty reluctivity over reluctivity, ν_p / ν. With 1 the penalised operator is the Laplacian in uniform material,
    /// which is what iterative solvers like best.
    #[schemars(transform = number(Range::POSITIVE), extend("default" = 1))]
    pub penalty: f64,
    /// Polynomial degree of A and ψ in an element. 2 gives about eight times the unknowns, and far smaller errors on the
    /// same mesh.
    #[schemars(with = "usize", transform = integer(1, 2), extend("default" = 1))]
    pub order: ElementOrder,
    /// How the linear systems are solved.
    #[schemars(default)]
    pub linear_solver: LinearSolver,
    /// How they are solved on several ranks.
    #[schemars(default)]
    pub petsc: Petsc,
}

/// The frequency as it is written.
#[derive(JsonSchema)]
#[schemars(transform = one_of_both)]
#[allow(dead_code, reason = "stands for the keys of `Frequencies` in the schema")]
struct FrequencyKeys {
    /// The one frequency that is analysed; 0: magnetostatics. It has no default, since none fits most devices. Either this
    /// or `frequencies`.
    #[schemars(transform = quantity(Dimension::Frequency, Range::NOT_NEGATIVE))]
    frequency: Option<f64>,
    /// Several frequencies, each once: one field problem each, all on the same mesh. The first is the one whose fields and
    /// results have plain names. Instead of `frequency`.
    #[schemars(
        transform = quantity(Dimension::Frequency, Range::NOT_NEGATIVE),
        transform = not_empty,
        transform = each_once,
    )]
    frequencies: Option<Vec<f64>>,
}

fn one_of_both(schema: &mut Schema) {
    Rules::of(schema).exactly_one(&["frequency", "frequencies"]);
}

/// The degree of the potentials in an element, written as its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(into = "u8")]
pub enum ElementOrder {
    /// 1.
    Linear,
    /// 2.
    Quadratic,
}

impl From<ElementOrder> for u8 {
    fn from(order: ElementOrder) -> Self {
        match order {
            ElementOrder::Linear => 1,
            ElementOrder::Quadratic => 2,
        }
    }
}

/// One frequency or several [Hz]; 0: magnetostatic. Each is a field problem of its own.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Frequencies {
    /// One.
    #[serde(rename = "frequency")]
    One(f64),
    /// Several, each once.
    #[serde(rename = "frequencies")]
    Several(Vec<f64>),
}

/// What a motion of the mesh alone is read with: magnetostatic.
impl Default for Analysis {
    fn default() -> Self {
        Self {
            frequencies: Frequencies::One(0.0),
            penalty: 1.0,
            order: ElementOrder::Linear,
            linear_solver: LinearSolver::default(),
            petsc: Petsc::default(),
        }
    }
}

impl Analysis {
    pub(super) fn read(section: &Section<'_>) -> Self {
        let frequencies = Frequencies::read(section);
        let penalty = section.number("penalty", Range::POSITIVE).unwrap_or(1.0);
        let order = match section.integer("order", 1, 2) {
            Some(2) => ElementOrder::Quadratic,
            _ => ElementOrder::Linear,
        };
        let linear_solver = section.table("linear_solver").map(LinearSolver::read).unwrap_or_default();
        let petsc = section.table("petsc").map(Petsc::read).unwrap_or_default();
        Self { frequencies, penalty, order, linear_solver, petsc }
    }

    /// All frequencies [Hz], at least one.
    pub fn frequencies(&self) -> &[f64] {
        match &self.frequencies {
            Frequencies::One(frequency) => std::slice::from_ref(frequency),
            Frequencies::Several(frequencies) => frequencies,
        }
    }

    /// The first frequency [Hz].
    pub fn frequency(&self) -> f64 {
        self.frequencies()[0]
    }
}

impl Frequencies {
    fn read(section: &Section<'_>) -> Self {
        let one = section.quantity("frequency", Dimension::Frequency, Range::NOT_NEGATIVE);
        let several = section.quantity_list("frequencies", Dimension::Frequency, Range::NOT_NEGATIVE);
        if section.has("frequencies") {
            if section.has("frequency") {
                let message = format!("`{}` has both `frequency` and `frequencies`", section.path());
                section.clash(["frequency", "frequencies"], message, "one of them");
            }
            // A list with a fault is not handed out.
            let several = several.unwrap_or_else(|| vec![f64::NAN]);
            if several.is_empty() {
                section.wrong(
                    "frequencies",
                    "`analysis.frequencies` is an empty list",
                    "at least one frequency",
                );
                return Self::One(f64::NAN);
            }
            if let Some(twice) = (1..several.len()).find(|&k| several[..k].contains(&several[k])) {
                let message = format!("`analysis.frequencies` has {} Hz twice", several[twice]);
                section.wrong(&format!("frequencies[{twice}]"), message, "each frequency once");
            }
            return Self::Several(several);
        }
        Self::One(section.need("frequency", one, "\"60 Hz\""))
    }
}
