//! `[morph.tune]`: what `fluxmorph morph --tune` may change, and how far.

use schemars::JsonSchema;
use serde::Serialize;

use super::super::choice::{Choice, choice};
use super::super::fault::Fault;
use super::super::range::Range;
use super::super::section::Section;
use super::super::source::suggest;
use super::super::tree::shown;
use crate::config::remesh::POISSON;
use crate::schema::form::{each_once, integer, not_empty, number};

/// Exponents of a ratio of moduli.
const DECADES: Range = Range::closed(-9.0, 9.0);
/// Multiples of the force that counts.
const FORCES: Range = Range::closed(-1e6, 1e6);

/// What `fluxmorph morph --tune` may change. The search is for the motion outside of the cases.
///
/// ```toml
/// [morph.tune]
/// parameters = ["young", "poisson", "force"]
/// evaluations = 200
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default)]
pub struct Tune {
    /// Which parameters of every region of the body are searched; each once. The modulus of the first region is kept.
    #[schemars(transform = not_empty, transform = each_once)]
    pub parameters: Vec<TunedParameter>,
    /// Evaluations of the worst quality, for each stiffness. Three regions have five parameters, and the quadratic model of
    /// the search needs about twice that to begin.
    #[schemars(transform = integer(1, 100_000))]
    pub evaluations: usize,
    /// Bounds of log10 of a region's Young's modulus over that of the first, the lower one first.
    #[schemars(transform = number(DECADES))]
    pub log10_young: [f64; 2],
    /// Bounds of Poisson's ratio, the lower one first. Beyond the default the body nearly loses a stiffness.
    #[schemars(transform = number(POISSON))]
    pub poisson: [f64; 2],
    /// Bounds of the force along the mean motion, the lower one first, in units of E₁ u V / (N L²): modulus of the first
    /// region, longest displacement, volume per node and largest extent of the body. A force of 1 makes the body yield about
    /// as far as it is moved.
    #[schemars(transform = number(FORCES))]
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
            log10_young: bounds(&section, "log10_young", DECADES).unwrap_or(default.log10_young),
            poisson: bounds(&section, "poisson", POISSON).unwrap_or(default.poisson),
            force: bounds(&section, "force", FORCES).unwrap_or(default.force),
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
    let words: Vec<&str> = TunedParameter::CHOICES.iter().map(|(word, _)| *word).collect();
    let parameter = |(i, name): (usize, &String)| {
        let found = TunedParameter::CHOICES.iter().find(|(word, _)| word == name).map(|(_, choice)| *choice);
        if found.is_none() {
            let message = format!("`morph.tune.parameters` cannot hold `{}`", shown(name));
            section.fault(&format!("parameters[{i}]"), |fault| {
                suggest(Fault { message, ..fault }, name, &words)
            });
        }
        found
    };
    let found: Vec<_> = names.iter().enumerate().map(parameter).collect();
    found.into_iter().collect()
}
