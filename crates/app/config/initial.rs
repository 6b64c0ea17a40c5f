//! `design.initial`: where an optimisation starts.

use schemars::JsonSchema;
use serde::Serialize;

use super::Dimension;
use super::range::Range;
use super::section::Section;
use crate::schema::form::{integer, length};

/// The design an optimisation starts from.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum InitialDesign {
    /// All variables alike [m]. Default 0: the mesh as it is.
    Uniform(#[schemars(transform = length(Range::FINITE))] f64),
    /// Every variable [m], in the order of `design.points_m` in `result.json`.
    Values(#[schemars(transform = length(Range::FINITE))] Vec<f64>),
    /// Every variable anywhere between its bounds, all equally likely.
    Random {
        /// Seed: the same number gives the same design.
        #[schemars(transform = integer(0, u32::MAX as usize))]
        random: usize,
    },
}

impl InitialDesign {
    /// Reads the key and checks it against the bounds.
    pub(super) fn read(section: &Section<'_>, lower: Option<f64>, upper: Option<f64>) -> Self {
        if section.is_table("initial") {
            let Some(table) = section.table("initial") else { return Self::Uniform(0.0) };
            let seed = table.integer("random", 0, u32::MAX as usize);
            if seed.is_none() && !table.has("random") {
                table.missing("random", "random = 1");
            }
            table.finish();
            check_order(section, lower, upper);
            return Self::Random { random: seed.unwrap_or(0) };
        }
        if section.is_list("initial") {
            let values =
                section.quantity_list("initial", Dimension::Length, Range::FINITE).unwrap_or_default();
            if check_order(section, lower, upper)
                && let (Some(lower), Some(upper)) = (lower, upper)
                && let Some(k) = values.iter().position(|value| !(lower..=upper).contains(value))
            {
                section.wrong(
                    &format!("initial[{k}]"),
                    format!("design.initial[{k}] is {} m, outside of the bounds", values[k]),
                    format!("from {lower} m to {upper} m"),
                );
            }
            return Self::Values(values);
        }
        let value = section.quantity("initial", Dimension::Length, Range::FINITE);
        if check_order(section, lower, upper)
            && let (Some(lower), Some(upper)) = (lower, upper)
        {
            check_uniform(section, lower, upper, value);
        }
        Self::Uniform(value.unwrap_or(0.0))
    }

    /// The variables [m], so many, between these bounds; `None` where a list has another length.
    pub fn values(&self, count: usize, lower: f64, upper: f64) -> Option<Vec<f64>> {
        match self {
            Self::Uniform(value) => Some(vec![*value; count]),
            Self::Values(values) => (values.len() == count).then(|| values.clone()),
            Self::Random { random } => {
                let mut numbers = fastrand::Rng::with_seed(*random as u64);
                Some((0..count).map(|_| lower + (upper - lower) * numbers.f64()).collect())
            }
        }
    }
}

/// Records a fault where the bounds cross; whether they do not.
fn check_order(section: &Section<'_>, lower: Option<f64>, upper: Option<f64>) -> bool {
    let (Some(lower), Some(upper)) = (lower, upper) else { return false };
    if lower >= upper {
        section.clash(
            ["lower", "upper"],
            format!("the bounds cross: design.lower is {lower} m, design.upper is {upper} m"),
            &format!("design.upper above {lower} m"),
        );
    }
    lower < upper
}

fn check_uniform(section: &Section<'_>, lower: f64, upper: f64, initial: Option<f64>) {
    if (lower..=upper).contains(&initial.unwrap_or(0.0)) {
        return;
    }
    let expected = format!("from {lower} m to {upper} m");
    match initial {
        Some(initial) => {
            section.wrong(
                "initial",
                format!("design.initial is {initial} m, outside of the bounds"),
                expected,
            );
        }
        None => section.wrong(
            if lower > 0.0 { "lower" } else { "upper" },
            "the bounds leave out 0 m, where the design starts",
            format!("bounds around 0 m, or design.initial {expected}"),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_random_design_fills_the_bounds_and_a_seed_repeats_it() {
        let design = |random| InitialDesign::Random { random }.values(500, -5e-3, 20e-3).expect("any number");
        let values = design(3);
        assert_eq!(values, design(3));
        assert_ne!(values, design(4));
        assert!(values.iter().all(|v| (-5e-3..=20e-3).contains(v)));
        // Of 500 numbers a tenth of the span stays empty with a probability of 1e-23.
        let tenth = |k: usize| values.iter().filter(|v| ((**v + 5e-3) / 2.5e-3) as usize == k).count();
        assert!((0..10).all(|k| tenth(k) > 0));
        assert_eq!(InitialDesign::Values(vec![1e-3; 2]).values(3, 0.0, 1.0), None);
    }
}
