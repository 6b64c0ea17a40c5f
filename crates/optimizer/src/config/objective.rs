//! `[objective]` and `[[probes]]`: what is made small, and what is looked at.

use serde::Serialize;

use super::choice::choice;
use super::section::{Section, first_duplicate};

/// The function to be minimised.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Objective {
    /// Its integrand. Default: the paper's.
    pub kind: ObjectiveKind,
    /// The region it is taken over.
    pub region: String,
    /// How the elements of the region are weighted. Default `point`: the paper's.
    pub weighting: Weighting,
}

choice! {
    /// Kinds of objectives.
    pub enum ObjectiveKind {
        /// `Σ w B·B*` [T²], or [T² m³] when weighted by volume.
        FluxDensitySquared = "flux_density_squared",
    }
}

choice! {
    /// Weights of an objective.
    pub enum Weighting {
        /// One term for each observation cell.
        Point = "point",
        /// The integral over the region.
        Volume = "volume",
    }
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
    pub(super) fn read(section: Section<'_>) -> Self {
        let region = section.text("region");
        let objective = Self {
            kind: section.choice("kind").unwrap_or(ObjectiveKind::FluxDensitySquared),
            region: section.need("region", region, "\"observation\""),
            weighting: section.choice("weighting").unwrap_or(Weighting::Point),
        };
        section.finish();
        objective
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
