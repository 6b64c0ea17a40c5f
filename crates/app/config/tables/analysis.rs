//! `[analysis]`: which field problems are solved, and how exactly.

use fluxmorph_geometry::Readable;
use serde::Serialize;

use super::linear_solver::{LinearSolver, SolverMethod};
use super::petsc::Petsc;
use crate::config::section::Section;
use crate::config::table::{Group, left_out, table};
use crate::config::value::choice::choice;
use crate::config::value::definitions::{Definitions, Keywords};
use crate::config::value::{Entry, Value, Whole};

table! {
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
    pub struct Analysis {
        /// One frequency or several.
        #[serde(flatten)]
        frequencies: Frequencies = KEYS;
        /// Penalty reluctivity over reluctivity, ν_p / ν. With 1 the penalised operator is the Laplacian in uniform material,
        /// which is what iterative solvers like best.
        penalty: f64 = number(POSITIVE) => 1.0;
        /// What is continuous from element to element: all of A at the nodes, or its part along the edges. `docs/theory.md`
        /// tells what each is right for.
        elements: Elements = WORD => Elements::Edge;
        /// Polynomial degree of A and ψ in an element. 2 gives about eight times the unknowns, and far smaller errors on the
        /// same mesh.
        order: ElementOrder = integer(1, 2) => ElementOrder::Linear;
        /// How the linear systems are solved.
        linear_solver: LinearSolver = TABLE => LinearSolver::default();
        /// How they are solved on several ranks.
        petsc: Petsc = TABLE => Petsc::default();
    }
    check = Analysis::check;
}

table! {
    /// The frequency as it is written.
    pub(in crate::config) struct FrequencyKeys {
        /// The one frequency that is analysed; 0: magnetostatics. It has no default, since none fits most devices. Either this
        /// or `frequencies`.
        frequency: Option<f64> = quantity(Frequency, NOT_NEGATIVE);
        /// Several frequencies, each once: one field problem each, all on the same mesh. The first is the one whose fields and
        /// results have plain names. Instead of `frequency`.
        #[also(each_once)]
        frequencies: Option<Vec<f64>> = not_empty(quantity(Frequency, NOT_NEGATIVE));
    }
    rules = |rules| rules.exactly_one(&["frequency", "frequencies"]);
}

choice! {
    /// The family of the elements.
    pub enum Elements {
        /// A and ψ at nodes, with a penalty on div A: the paper's method.
        Nodal = "nodal",
        /// A along edges: right at every corner, in iron and behind impedance surfaces.
        Edge = "edge",
    }
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

impl Value<Whole> for ElementOrder {
    fn read(kind: &Whole, entry: &Entry<'_>) -> Option<Self> {
        usize::read(kind, entry).map(|order| if order == 2 { Self::Quadratic } else { Self::Linear })
    }

    fn schema(kind: &Whole, definitions: &mut Definitions) -> Keywords {
        usize::schema(kind, definitions)
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

impl Analysis {
    /// Edge elements have no penalty, and no coarse level of their own.
    fn check(&mut self, section: &Section<'_>) {
        if self.elements != Elements::Edge {
            return;
        }
        if self.penalty != 1.0 {
            let message = format!("`{}.penalty` has no meaning for edge elements", section.path());
            section.wrong("penalty", message, "no penalty, or elements = \"nodal\"");
        }
        if self.linear_solver.method == SolverMethod::TwoLevel {
            let message = "edge elements have no coarse level for the method `two_level`";
            section.wrong(
                "linear_solver.method",
                message,
                "method = \"automatic\" or a factor, or elements = \"nodal\"",
            );
        }
    }

    /// What a motion of the mesh alone is read with: magnetostatic.
    pub(super) fn static_field() -> Self {
        Self { frequencies: Frequencies::One(0.0), ..left_out() }
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

impl Group for Frequencies {
    type Written = FrequencyKeys;

    /// Unknown frequencies are NaN: nothing is said of them, and nothing follows from them.
    fn of(written: FrequencyKeys, section: &Section<'_>) -> Self {
        section.exactly_one(&["frequency", "frequencies"], "frequency = \"60 Hz\"", "one of them");
        if !section.has("frequencies") {
            return Self::One(written.frequency.unwrap_or(f64::NAN));
        }
        // A list with a fault is not handed out.
        let several = written.frequencies.unwrap_or_else(|| vec![f64::NAN]);
        if let Some(twice) = (1..several.len()).find(|&k| several[..k].contains(&several[k])) {
            let message = format!("`analysis.frequencies` has {} Hz twice", Readable(several[twice]));
            section.wrong(&format!("frequencies[{twice}]"), message, "each frequency once");
        }
        Self::Several(several)
    }
}
