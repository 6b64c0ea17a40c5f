//! `[morph]`: a prescribed motion of the mesh, and the cases of a sweep.
//!
//! A case is the whole configuration with the case's own tables laid over it, read by the same readers, so that a fault in
//! it points at its own line. What moves and how lies in `motion`, what the tuner may change in `tune`.

mod motion;
mod tune;

use schemars::{JsonSchema, Schema};
use serde::Serialize;
use serde_json::json;

pub use motion::{DesignMotion, DesignWord, PrescribedMotion, Rotation, Scale, Target};
pub use tune::{Tune, TunedParameter};

use super::Config;
use super::choice::choice;
use super::range::Range;
use super::section::Section;
use super::tree::{self, Table};
use crate::schema::form::{Overlay, integer, number};
use crate::schema::rules::Rules;

/// Most increments: far beyond any use.
const MOST_INCREMENTS: usize = 10_000;
/// Largest number of elements or equations: no table holds more.
const MOST_COUNTED: usize = usize::MAX >> 12;
/// Shares in per cent.
const PER_CENT: Range = Range::closed(0.0, 100.0);
/// Qualities that can be asked for.
const QUALITIES: Range = Range::half_open(0.0, 1.0);
/// The tables of the configuration that a case may change.
const OVERLAID: [&str; 3] = ["mesh", "remesh", "design"];
/// The keys of `[morph]` that a case may change.
const OWN: [&str; 3] = ["motion", "increments", "least_quality"];

/// A prescribed motion of the mesh, for `fluxmorph morph`; `docs/morph.md` tells more. It needs `[remesh]`, and no field
/// problem. What moves stands in `[[morph.motion]]`, at least one of which is needed where not every case has its own; the
/// cases of a sweep stand in `[[morph.case]]`.
///
/// ```toml
/// [morph]
/// increments = "auto"
/// least_quality = 0.05
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(transform = something_moves)]
pub struct Morph {
    /// `"auto"`: one increment where that goes at most half of the way to the first inversion, else as many as are needed,
    /// each on a stiffness of its own. A number: equal parts of the motion; the last may break the mesh, which is then the
    /// result.
    #[schemars(extend("default" = AutoWord::Auto))]
    pub increments: Increments,
    /// Quality (Eq. 4) that an element of the body may not fall below: an increment that would is not taken, and the motion
    /// stops there. The last of a number of increments is the result all the same, and not valid.
    #[schemars(transform = number(QUALITIES), extend("default" = 0))]
    pub least_quality: f64,
    /// What moves and how; later entries win at nodes of several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Option<Vec<PrescribedMotion>>")]
    pub motion: Vec<PrescribedMotion>,
    /// What the tuner may change.
    #[schemars(default)]
    pub tune: Tune,
    /// The cases of a sweep. Without them the configuration itself is the only one.
    #[serde(rename = "case", skip_serializing_if = "Vec::is_empty")]
    #[schemars(default)]
    pub cases: Vec<Case>,
}

fn something_moves(schema: &mut Schema) {
    Rules::of(schema).add(json!({ "anyOf": [
        { "required": ["motion"] },
        { "required": ["case"], "properties": { "case": { "minItems": 1, "items": { "required": ["motion"] } } } },
    ] }));
}

/// In how many parts a motion is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum Increments {
    /// In one where that keeps away from inversion, else in as many as are needed.
    Auto(AutoWord),
    /// In equal parts of the path, each from the mesh that the one before left.
    Count(#[schemars(transform = integer(1, MOST_INCREMENTS))] usize),
}

choice! {
    /// Word for `increments`.
    pub enum AutoWord {
        /// As many increments as are needed.
        Auto = "auto",
    }
}

/// One row of a sweep: the configuration with the case's own `mesh`, `remesh` and `design` tables laid over it
/// (`remesh.poisson = 0.1`; a list replaces a list), and with `motion`, `increments` and `least_quality` of its own where it
/// gives them.
///
/// ```toml
/// [[morph.case]]
/// name = "nu = 0.1"
/// remesh.poisson = 0.1
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Case {
    /// What the case is called in the table; each name once.
    pub name: String,
    /// What the paper says of it, printed beside the own values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paper: Option<Paper>,
    /// Its own tables as they are written, paths made absolute.
    #[serde(flatten)]
    #[schemars(with = "OverlayKeys")]
    overlay: toml::Table,
    /// The configuration with these tables laid over it.
    #[serde(skip)]
    #[schemars(skip)]
    pub config: Option<Box<Config>>,
}

/// What a case may change.
#[derive(JsonSchema)]
#[allow(dead_code, reason = "stands for the overlay of a case in the schema")]
struct OverlayKeys {
    /// Keys of `[mesh]` that are other than outside of the cases.
    mesh: Option<Overlay<super::MeshConfig>>,
    /// Keys of `[remesh]` that are other than outside of the cases.
    remesh: Option<Overlay<super::Remesh>>,
    /// Keys of `[design]` that are other than outside of the cases.
    design: Option<Overlay<super::Design>>,
    /// What moves in this case, instead of `[[morph.motion]]`.
    motion: Option<Vec<PrescribedMotion>>,
    /// As in `[morph]`.
    increments: Option<Increments>,
    /// As in `[morph]`.
    #[schemars(transform = number(QUALITIES))]
    least_quality: Option<f64>,
}

/// Published values of a case, printed in brackets beside the own ones.
///
/// ```toml
/// [[morph.case]]
/// name = "uniform stiffness"
/// remesh.stiffness = "uniform"
/// paper = { worst_quality = 0.12, poor = 40 }
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct Paper {
    /// Worst quality of an element.
    #[schemars(transform = number(Range::closed(-1.0, 1.0)))]
    pub worst_quality: Option<f64>,
    /// Number of elements with q ≤ 0.3.
    #[schemars(transform = integer(0, MOST_COUNTED))]
    pub poor: Option<usize>,
    /// Share of elements with q ≤ 0.3, in per cent.
    #[schemars(transform = number(PER_CENT))]
    pub share_poor_percent: Option<f64>,
    /// Share of elements with 0.3 < q < 0.6, in per cent.
    #[schemars(transform = number(PER_CENT))]
    pub share_fair_percent: Option<f64>,
    /// Share of elements with q ≥ 0.6, in per cent.
    #[schemars(transform = number(PER_CENT))]
    pub share_good_percent: Option<f64>,
    /// Number of equations.
    #[schemars(transform = integer(0, MOST_COUNTED))]
    pub equations: Option<usize>,
}

impl Morph {
    pub(super) fn read(section: Section<'_>) -> Self {
        let increments = if section.is_text("increments") {
            section.choice("increments").map(Increments::Auto)
        } else {
            section.integer("increments", 1, MOST_INCREMENTS).map(Increments::Count)
        };
        let least_quality = section.number("least_quality", QUALITIES).unwrap_or(0.0);
        let motion = section.tables("motion").into_iter().map(PrescribedMotion::read).collect();
        let tune = section.table("tune").map(Tune::read).unwrap_or_default();
        let tables = section.tables("case");
        let all_move = !tables.is_empty() && tables.iter().all(|case| case.has("motion"));
        let cases: Vec<Case> = tables.into_iter().map(Case::read).collect();
        if !section.has("motion") && !all_move {
            section.missing(
                "motion",
                "[[morph.motion]] with surface = \"top\" and displacement = [\"0 mm\", \"0 mm\", \"5 mm\"]",
            );
        }
        let names: Vec<_> = cases.iter().map(|case| case.name.clone()).collect();
        section.named_twice("case", &names, "cases", "each name once");
        section.finish();
        Self {
            increments: increments.unwrap_or(Increments::Auto(AutoWord::Auto)),
            least_quality,
            motion,
            tune,
            cases,
        }
    }
}

impl Case {
    fn read(section: Section<'_>) -> Self {
        let name = section.text("name");
        let name = section.need("name", name, "\"nu = 0.1\"");
        let paper = section.table("paper").map(Paper::read);
        // Read once they are laid over the configuration.
        OWN.into_iter().chain(OVERLAID).for_each(|key| {
            section.skip(key);
        });
        section.finish();
        Self { name, paper, overlay: toml::Table::new(), config: None }
    }

    /// Enters what the overlaid configuration was read as; a file that the case names is given by its absolute path.
    pub(super) fn complete(&mut self, mut overlay: toml::Table, config: Config) {
        if let (Some(file), super::MeshConfig::File { path, .. }) =
            (overlay.get_mut("mesh").and_then(|mesh| mesh.get_mut("file")), &config.mesh)
        {
            *file = toml::Value::String(path.display().to_string());
        }
        self.overlay = overlay;
        self.config = Some(Box::new(config));
    }
}

impl Paper {
    fn read(section: Section<'_>) -> Self {
        let share = |key| section.number(key, PER_CENT);
        let paper = Self {
            worst_quality: section.number("worst_quality", Range::closed(-1.0, 1.0)),
            poor: section.integer("poor", 0, MOST_COUNTED),
            share_poor_percent: share("share_poor_percent"),
            share_fair_percent: share("share_fair_percent"),
            share_good_percent: share("share_good_percent"),
            equations: section.integer("equations", 0, MOST_COUNTED),
        };
        section.finish();
        paper
    }
}

/// The number of cases as written.
pub(super) fn case_count(root: &Table) -> usize {
    let Some(tree::Value::Table(morph)) = root.get("morph").map(|node| &node.value) else { return 0 };
    match morph.get("case").map(|node| &node.value) {
        Some(tree::Value::Array(cases)) => cases.len(),
        _ => 0,
    }
}

/// The trees of the cases, made one at a time: each the root with the tables of the case laid over it and without cases,
/// with what was laid; the fault of a case that goes through something that is not a table.
pub(super) fn case_trees(
    mut root: Table,
) -> impl Iterator<Item = Result<(Table, toml::Table), Box<super::Fault>>> {
    let cases = match root.get_mut("morph").map(|node| &mut node.value) {
        Some(tree::Value::Table(morph)) => morph.remove("case"),
        _ => None,
    };
    let cases = match cases.map(|node| node.value) {
        Some(tree::Value::Array(cases)) => cases,
        _ => Vec::new(),
    };
    let laid = move |case: tree::Node| {
        let tree::Value::Table(case) = case.value else { return Ok((root.clone(), toml::Table::new())) };
        let own = |keys: &[&str]| -> Table {
            case.iter()
                .filter(|(key, _)| keys.contains(&key.as_str()))
                .map(|(key, node)| (key.clone(), node.clone()))
                .collect()
        };
        let (tables, motion) = (own(&OVERLAID), own(&OWN));
        let mut tree = root.clone();
        let mut written = tree::to_toml(&tables);
        written.extend(tree::to_toml(&motion));
        if let Some(tree::Value::Table(morph)) = tree.get_mut("morph").map(|node| &mut node.value) {
            morph.extend(motion);
        }
        tree::overlay(&mut tree, tables, "")?;
        Ok((tree, written))
    };
    cases.into_iter().map(laid)
}
