//! `design.initial`: where an optimisation starts.

use crate::config::section::Section;
use crate::config::table::{one_of, table};

one_of! {
    /// The design an optimisation starts from.
    pub enum InitialDesign {
        /// All variables alike [m]. Default 0: the mesh as it is.
        Uniform(f64) = length(FINITE);
        /// Every variable [m], in the order of `design.points_m` in `result.json`.
        Values(Vec<f64>) = length(FINITE), if list;
        /// Every variable anywhere between its bounds, all equally likely.
        Random(RandomDesign) = INLINE, if table;
    }
}

table! {
    /// Every variable anywhere between its bounds, all equally likely.
    pub struct RandomDesign {
        /// Seed: the same number gives the same design.
        random: usize = integer(0, u32::MAX as usize), need "1";
    }
}

impl InitialDesign {
    /// Checks it against the bounds [m], which are NaN where they are unknown.
    pub(super) fn check(&self, section: &Section<'_>, lower: f64, upper: f64) {
        if lower >= upper {
            section.clash(
                ["lower", "upper"],
                format!("the bounds cross: design.lower is {lower} m, design.upper is {upper} m"),
                &format!("design.upper above {lower} m"),
            );
        }
        let is_outside = |value: f64| lower < upper && !(lower..=upper).contains(&value);
        let within = format!("from {lower} m to {upper} m");
        match self {
            Self::Uniform(value) if is_outside(*value) && section.has("initial") => {
                let message = format!("design.initial is {value} m, outside of the bounds");
                section.wrong("initial", message, within);
            }
            Self::Uniform(value) if is_outside(*value) => section.wrong(
                if lower > 0.0 { "lower" } else { "upper" },
                "the bounds leave out 0 m, where the design starts",
                format!("bounds around 0 m, or design.initial {within}"),
            ),
            Self::Values(values) => {
                if let Some(k) = values.iter().position(|value| is_outside(*value)) {
                    let message = format!("design.initial[{k}] is {} m, outside of the bounds", values[k]);
                    section.wrong(&format!("initial[{k}]"), message, within);
                }
            }
            Self::Uniform(_) | Self::Random(_) => {}
        }
    }

    /// The variables [m], so many, between these bounds; `None` where a list has another length.
    pub fn values(&self, count: usize, lower: f64, upper: f64) -> Option<Vec<f64>> {
        match self {
            Self::Uniform(value) => Some(vec![*value; count]),
            Self::Values(values) => (values.len() == count).then(|| values.clone()),
            Self::Random(RandomDesign { random }) => {
                let mut numbers = fastrand::Rng::with_seed(*random as u64);
                Some((0..count).map(|_| lower + (upper - lower) * numbers.f64()).collect())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_random_design_fills_the_bounds_and_a_seed_repeats_it() {
        let design = |random| {
            let start = InitialDesign::Random(RandomDesign { random });
            start.values(500, -5e-3, 20e-3).expect("any number")
        };
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
