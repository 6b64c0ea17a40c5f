//! `[morph]`: a prescribed motion of the mesh, and the cases of a sweep.
//!
//! A case is the whole configuration with the case's own tables laid over it, read by the same readers, so that a fault in
//! it points at its own line. What moves and how lies in `motion`, what the tuner may change in `tune`.

mod motion;
mod tune;

use serde::Serialize;
use serde_json::json;

pub use motion::{DesignMotion, DesignWord, PrescribedMotion, Rotation, Scale, Target};
pub use tune::{Tune, TunedParameter};

use super::config::Config;
use super::design::Design;
use super::mesh::MeshConfig;
use super::remesh::Remesh;
use crate::config::section::Section;
use crate::config::table::{Group, Unread, table};
use crate::config::value::range::Range;

/// Largest number of elements or equations: no table holds more.
const MOST_COUNTED: usize = usize::MAX >> 12;
/// Shares in per cent.
const PER_CENT: Range = Range::closed(0.0, 100.0);
/// A key of earlier versions.
const INCREMENTS: (&str, &str) = (
    "increments",
    "a motion is taken at once; remesh.law = \"hyperelastic\" takes it further than \"linear\"",
);
/// Qualities that can be asked for.
const QUALITIES: Range = Range::half_open(0.0, 1.0);

table! {
    /// A prescribed motion of the mesh, for `fluxmorph morph`; `docs/morph.md` tells more. It needs `[remesh]`, and no field
    /// problem. What moves stands in `[[morph.motion]]`, at least one of which is needed where not every case has its own; the
    /// cases of a sweep stand in `[[morph.case]]`.
    ///
    /// ```toml
    /// [morph]
    /// least_quality = 0.05
    /// ```
    pub struct Morph {
        /// Quality (Eq. 4) below which no element of the body may be for the motion to count as valid.
        least_quality: f64 = number(QUALITIES) => 0.0;
        /// What moves and how; later entries win at nodes of several.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        motion: Vec<PrescribedMotion> = not_empty(TABLES), else Vec::new();
        /// What the tuner may change.
        tune: Tune = TABLE => Tune::default();
        /// The cases of a sweep. Without them the configuration itself is the only one.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        cases["case"]: Vec<Case> = TABLES, else Vec::new();
    }
    former = [INCREMENTS];
    check = Morph::check;
    rules = |rules| rules.add(json!({ "anyOf": [
        { "required": ["motion"] },
        { "required": ["case"], "properties": { "case": { "minItems": 1, "items": { "required": ["motion"] } } } },
    ] }));
}

/// One row of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Case {
    /// What the case is called in the table; each name once.
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

table! {
    /// One row of a sweep: the configuration with the case's own `mesh`, `remesh` and `design` tables laid over it
    /// (`remesh.poisson = 0.1`; a list replaces a list), and with `motion` and `least_quality` of its own where it
    /// gives them.
    ///
    /// ```toml
    /// [[morph.case]]
    /// name = "nu = 0.1"
    /// remesh.poisson = 0.1
    /// ```
    pub(in crate::config) struct CaseKeys as "Case" {
        /// What the case is called in the table; each name once.
        name: String = TEXT, need "\"nu = 0.1\"";
        /// What the paper says of it, printed beside the own values.
        paper: Option<Paper> = TABLE;
        /// Keys of `[mesh]` that are other than outside of the cases.
        mesh: Option<Unread> = overlay::<MeshConfig>();
        /// Keys of `[remesh]` that are other than outside of the cases.
        remesh: Option<Unread> = overlay::<Remesh>();
        /// Keys of `[design]` that are other than outside of the cases.
        design: Option<Unread> = overlay::<Design>();
        /// What moves in this case, instead of `[[morph.motion]]`.
        motion: Option<Unread> = unread::<Vec<PrescribedMotion>, _>(not_empty(TABLES));
        /// As in `[morph]`.
        least_quality: Option<Unread> = unread::<f64, _>(number(QUALITIES));
    }
    former = [INCREMENTS];
}

table! {
    /// Published values of a case, printed in brackets beside the own ones.
    ///
    /// ```toml
    /// [[morph.case]]
    /// name = "uniform stiffness"
    /// remesh.stiffness = "uniform"
    /// paper = { worst_quality = 0.12, poor = 40 }
    /// ```
    #[derive(Copy, Default)]
    pub struct Paper {
        /// Worst quality of an element.
        worst_quality: Option<f64> = number(Range::closed(-1.0, 1.0));
        /// Number of elements with q ≤ 0.3.
        poor: Option<usize> = integer(0, MOST_COUNTED);
        /// Share of elements with q ≤ 0.3, in per cent.
        share_poor_percent: Option<f64> = number(PER_CENT);
        /// Share of elements with 0.3 < q < 0.6, in per cent.
        share_fair_percent: Option<f64> = number(PER_CENT);
        /// Share of elements with q ≥ 0.6, in per cent.
        share_good_percent: Option<f64> = number(PER_CENT);
        /// Number of equations.
        equations: Option<usize> = integer(0, MOST_COUNTED);
    }
}

impl Morph {
    fn check(&mut self, section: &Section<'_>) {
        let moves = |index: usize| section.has(&format!("case[{index}].motion"));
        if !section.has("motion") && (self.cases.is_empty() || !(0..self.cases.len()).all(moves)) {
            section.missing(
                &["motion", "surface"],
                "[[morph.motion]] with surface = \"top\" and displacement = [\"0 mm\", \"0 mm\", \"5 mm\"]",
            );
        }
        section.named_twice("case", self.cases.iter().map(|case| &case.name), "cases", "each name once");
    }
}

impl Group for Case {
    type Written = CaseKeys;

    /// What it changes is read once it is laid over the configuration.
    fn of(CaseKeys { name, paper, .. }: CaseKeys, _: &Section<'_>) -> Self {
        Self { name, paper, overlay: toml::Table::new(), config: None }
    }
}

impl Case {
    /// Enters what the overlaid configuration was read as; a file that the case names is given by its absolute path.
    pub(in crate::config) fn complete(&mut self, mut overlay: toml::Table, config: Config) {
        if let (Some(file), MeshConfig::File { path, .. }) =
            (overlay.get_mut("mesh").and_then(|mesh| mesh.get_mut("file")), &config.mesh)
        {
            *file = toml::Value::String(path.display().to_string());
        }
        self.overlay = overlay;
        self.config = Some(Box::new(config));
    }
}
