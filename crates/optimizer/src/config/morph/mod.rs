//! `[morph]`: a prescribed motion of the mesh, and the cases of a sweep.
//!
//! A case is the whole configuration with the case's own tables laid over it, read by the same readers, so that a fault in
//! it points at its own line. What moves and how lies in `motion`, what the tuner may change in `tune`.

mod motion;
mod tune;

use serde::Serialize;

pub use motion::{DesignMotion, DesignWord, PrescribedMotion, Rotation, Scale, Target};
pub use tune::{Tune, TunedParameter};

use super::Config;
use super::choice::choice;
use super::range::Range;
use super::section::{Section, first_duplicate};
use super::tree::{self, Table};

/// Most increments: far beyond any use.
const MOST_INCREMENTS: usize = 10_000;
/// The tables of the configuration that a case may change.
const OVERLAID: [&str; 3] = ["mesh", "remesh", "design"];
/// The keys of `[morph]` that a case may change.
const OWN: [&str; 3] = ["motion", "increments", "least_quality"];

/// A prescribed motion of the mesh.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Morph {
    /// In how many parts the motion is taken. Default `auto`.
    pub increments: Increments,
    /// Quality (Eq. 4) that an increment may not fall below, 0 to 1. Default 0: only flat and inverted elements are
    /// refused.
    pub least_quality: f64,
    /// What moves and how; later entries win at nodes of several. May be empty where every case has its own.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub motion: Vec<PrescribedMotion>,
    /// What the tuner may change.
    pub tune: Tune,
    /// The cases of a sweep; none: the configuration itself is the only one.
    #[serde(rename = "case", skip_serializing_if = "Vec::is_empty")]
    pub cases: Vec<Case>,
}

/// In how many parts a motion is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum Increments {
    /// In one where that keeps away from inversion, else in as many as are needed.
    Auto(AutoWord),
    /// In equal parts of the path, each from the mesh that the one before left.
    Count(usize),
}

choice! {
    /// Word for `increments`.
    pub enum AutoWord {
        /// As many as are needed.
        Auto = "auto",
    }
}

/// One case of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Case {
    /// Its name in the table.
    pub name: String,
    /// What the paper says of it, printed beside the own values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paper: Option<Paper>,
    /// Its own tables as they are written, paths made absolute.
    #[serde(flatten)]
    overlay: toml::Table,
    /// The configuration with these tables laid over it.
    #[serde(skip)]
    pub config: Option<Box<Config>>,
}

/// Published values of a case.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Paper {
    /// Worst quality.
    pub worst_quality: Option<f64>,
    /// Number of elements with q ≤ 0.3.
    pub poor: Option<usize>,
    /// Share of elements with q ≤ 0.3 [%].
    pub share_poor_percent: Option<f64>,
    /// Share of elements with 0.3 < q < 0.6 [%].
    pub share_fair_percent: Option<f64>,
    /// Share of elements with q ≥ 0.6 [%].
    pub share_good_percent: Option<f64>,
    /// Number of equations.
    pub equations: Option<usize>,
}

impl Morph {
    pub(super) fn read(section: Section<'_>) -> Self {
        let increments = if section.is_text("increments") {
            section.choice("increments").map(Increments::Auto)
        } else {
            section.integer("increments", 1, MOST_INCREMENTS).map(Increments::Count)
        };
        let least_quality = section.number("least_quality", Range::half_open(0.0, 1.0)).unwrap_or(0.0);
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
        if let Some(name) = first_duplicate(&names).filter(|name| !name.is_empty()) {
            section.wrong("case", format!("two cases are named `{name}`"), "each name once");
        }
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
        let share = |key| section.number(key, Range::closed(0.0, 100.0));
        let paper = Self {
            worst_quality: section.number("worst_quality", Range::closed(-1.0, 1.0)),
            poor: section.integer("poor", 0, usize::MAX >> 12),
            share_poor_percent: share("share_poor_percent"),
            share_fair_percent: share("share_fair_percent"),
            share_good_percent: share("share_good_percent"),
            equations: section.integer("equations", 0, usize::MAX >> 12),
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
