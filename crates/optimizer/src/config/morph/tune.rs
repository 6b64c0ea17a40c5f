//! `[morph.tune]`: what `fluxmorph morph --tune` may change, and how far.

use serde::Serialize;

use super::super::choice::{Choice, choice};
use super::super::range::Range;
use super::super::section::Section;

/// What the tuner may change.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tune {
    /// The parameters of every subregion that are searched. Default `young` and `poisson`.
    pub parameters: Vec<TunedParameter>,
    /// Evaluations of the worst quality, for every stiffness policy. Default 60: three subregions have five parameters,
    /// and the quadratic model of the search needs about twice that to begin.
    pub evaluations: usize,
    /// Bounds of log10 of a subregion's Young's modulus over that of the first. Default −3 to 3.
    pub log10_young: [f64; 2],
    /// Bounds of Poisson's ratio. Default −0.2 to 0.45: beyond, the body nearly loses a stiffness.
    pub poisson: [f64; 2],
    /// Bounds of the force, as multiples of the force at which the body yields about as far as it is moved.
    /// Default −3 to 3.
    pub force: [f64; 2],
}

choice! {
    /// A parameter of a subregion.
    pub enum TunedParameter {
        /// Young's modulus; that of the first subregion is kept.
        Young = "young",
        /// Poisson's ratio.
        Poisson = "poisson",
        /// The fictitious force along the mean motion.
        Force = "force",
    }
}

impl Default for Tune {
    fn default() -> Self {
        Self {
            parameters: vec![TunedParameter::Young, TunedParameter::Poisson],
            evaluations: 60,
            log10_young: [-3.0, 3.0],
            poisson: [-0.2, 0.45],
            force: [-3.0, 3.0],
        }
    }
}

impl Tune {
    pub(super) fn read(section: Section<'_>) -> Self {
        let default = Self::default();
        let tune = Self {
            parameters: read_parameters(&section).unwrap_or(default.parameters),
            evaluations: section.integer("evaluations", 1, 100_000).unwrap_or(default.evaluations),
            log10_young: bounds(&section, "log10_young", Range::closed(-9.0, 9.0))
                .unwrap_or(default.log10_young),
            poisson: bounds(&section, "poisson", Range::open(-1.0, 0.5)).unwrap_or(default.poisson),
            force: bounds(&section, "force", Range::closed(-1e6, 1e6)).unwrap_or(default.force),
        };
        section.finish();
        tune
    }
}

/// Two numbers, the first below the second.
fn bounds(section: &Section<'_>, key: &'static str, range: Range) -> Option<[f64; 2]> {
    let bounds = section.numbers::<2>(key, range)?;
    if bounds[0] < bounds[1] {
        return Some(bounds);
    }
    let message = format!("`{}.{key}` runs from {} to {}", section.path(), bounds[0], bounds[1]);
    section.wrong(key, message, "the lower bound first, below the upper bound");
    None
}

fn read_parameters(section: &Section<'_>) -> Option<Vec<TunedParameter>> {
    let names = section.names("parameters")?;
    if names.is_empty() {
        section.wrong("parameters", "`morph.tune.parameters` is an empty list", "at least one parameter");
    }
    let parameter = |name: &String| {
        let found = TunedParameter::CHOICES.iter().find(|(word, _)| word == name).map(|(_, choice)| *choice);
        if found.is_none() {
            let message = format!("`morph.tune.parameters` cannot hold `{}`", name.escape_debug());
            section.wrong("parameters", message, "young, poisson, force");
        }
        found
    };
    names.iter().map(parameter).collect()
}
