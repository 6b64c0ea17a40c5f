//! What is measured of the field: the keys that `[objective]`, its terms and `[[constraints]]` share.

use schemars::{JsonSchema, Schema};
use serde::Serialize;

use super::Dimension;
use super::choice::choice;
use super::design::{COMPONENTS, read_vector};
use super::range::Range;
use super::section::Section;
use crate::schema::form::{not_all_zero, number, quantity};
use crate::schema::rules::{Rules, Then};

/// A real quantity of the field.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Functional {
    /// What is measured. The default is the paper's objective.
    #[schemars(extend("default" = ObjectiveKind::FluxDensitySquared))]
    pub kind: ObjectiveKind,
    /// The region it is measured in. Required, but for `energy`: without it the energy is that of everything that is
    /// meshed.
    pub region: Option<String>,
    /// For `flux_density_squared` and `uniformity`: how the cells of the region are weighted. Default `"point"`, as in the
    /// paper.
    pub weighting: Option<Weighting>,
    /// For `uniformity`, required: the flux density wished for [T].
    #[schemars(transform = quantity(Dimension::FluxDensity, Range::FINITE))]
    pub target: Option<[f64; 3]>,
    /// For `field_component`, required: a vector along the component; its length does not matter.
    #[schemars(transform = number(COMPONENTS), transform = not_all_zero)]
    pub direction: Option<[f64; 3]>,
    /// The one frequency it is taken at [Hz], one of `[analysis]`. Default: the values at all frequencies are added.
    #[schemars(transform = quantity(Dimension::Frequency, Range::NOT_NEGATIVE))]
    pub frequency: Option<f64>,
}

/// Which keys go with which kind.
pub(super) fn keys_of_the_kind(schema: &mut Schema) {
    Rules::of(schema)
        .unless("kind", &["energy"], Then { required: &["region"], refused: &[] })
        .when("kind", &["field_component", "loss", "energy"], Then { required: &[], refused: &["weighting"] })
        .when("kind", &["uniformity"], Then { required: &["target"], refused: &[] })
        .unless("kind", &["uniformity"], Then { required: &[], refused: &["target"] })
        .when("kind", &["field_component"], Then { required: &["direction"], refused: &[] })
        .unless("kind", &["field_component"], Then { required: &[], refused: &["direction"] });
}

choice! {
    /// Kinds of functionals.
    pub enum ObjectiveKind {
        /// Σ w B·B* [T²; by volume T² m³]. The region must not move.
        FluxDensitySquared = "flux_density_squared",
        /// Σ w |B − `target`|² [T²; by volume T² m³]; in harmonics the imaginary part is to vanish. The region must not move.
        Uniformity = "uniformity",
        /// Mean over the region of B·`direction` [T]; in harmonics the magnitude of its phasor. The region must not move.
        FieldComponent = "field_component",
        /// Eddy-current loss of a conductor, time average [W]; needs a frequency above 0. The conductor is meshed or replaced by its
        /// impedance surface, and may move.
        Loss = "loss",
        /// Energy of the magnetic field [J]: ½ ∫ ν |B|² dV in statics, its time average ¼ ∫ ν |B|² dV in harmonics. The region
        /// is meshed and may move.
        Energy = "energy",
    }
}

choice! {
    /// Weights of the cells of a region.
    pub enum Weighting {
        /// One term for each observation cell, as in the paper.
        Point = "point",
        /// The integral over the region.
        Volume = "volume",
    }
}

impl ObjectiveKind {
    /// Whether the cells are weighted.
    fn sums_over_cells(self) -> bool {
        matches!(self, Self::FluxDensitySquared | Self::Uniformity)
    }
}

impl Functional {
    /// Reads the keys of a functional from a table; `frequencies` [Hz] are those of the analysis, empty where unknown.
    pub(super) fn read(section: &Section<'_>, frequencies: &[f64]) -> Self {
        let kind = section.choice("kind").unwrap_or(ObjectiveKind::FluxDensitySquared);
        Self::read_kind(kind, section, frequencies)
    }

    /// As [`Functional::read`] for a kind that is known.
    pub(super) fn read_kind(kind: ObjectiveKind, section: &Section<'_>, frequencies: &[f64]) -> Self {
        let region = section.text("region");
        if region.is_none() && !section.has("region") && kind != ObjectiveKind::Energy {
            section.missing("region", "region = \"observation\"");
        }
        let weighting = section.choice("weighting");
        let target = section.quantities("target", Dimension::FluxDensity, Range::FINITE);
        let direction = read_vector(section);
        let frequency = section.quantity("frequency", Dimension::Frequency, Range::NOT_NEGATIVE);
        for (key, example, wanted) in [
            ("weighting", None, kind.sums_over_cells()),
            ("target", Some("target = [\"0 T\", \"0 T\", \"0.5 T\"]"), kind == ObjectiveKind::Uniformity),
            ("direction", Some("direction = [0, 0, 1]"), kind == ObjectiveKind::FieldComponent),
        ] {
            match (section.has(key), example) {
                (true, _) if !wanted => {
                    let message =
                        format!("`{}.{key}` has no use for the kind `{}`", section.path(), kind.name());
                    section.wrong(key, message, "no such key, or another kind");
                }
                (false, Some(example)) if wanted => section.missing(key, example),
                _ => {}
            }
        }
        check_frequencies(section, kind, frequency, frequencies);
        Self {
            kind,
            region,
            weighting: kind.sums_over_cells().then(|| weighting.unwrap_or(Weighting::Point)),
            target,
            direction,
            frequency,
        }
    }

    /// Unit of its values.
    pub fn dimension(&self) -> Dimension {
        match (self.kind, self.weighting) {
            (ObjectiveKind::FluxDensitySquared | ObjectiveKind::Uniformity, Some(Weighting::Volume)) => {
                Dimension::FluxDensityIntegral
            }
            (ObjectiveKind::FluxDensitySquared | ObjectiveKind::Uniformity, _) => {
                Dimension::FluxDensitySquared
            }
            (ObjectiveKind::FieldComponent, _) => Dimension::FluxDensity,
            (ObjectiveKind::Loss, _) => Dimension::Power,
            (ObjectiveKind::Energy, _) => Dimension::Energy,
        }
    }
}

/// A frequency that the analysis does not have, and a loss where nothing is induced.
fn check_frequencies(section: &Section<'_>, kind: ObjectiveKind, own: Option<f64>, analysed: &[f64]) {
    if let Some(own) = own.filter(|own| !analysed.is_empty() && !analysed.contains(own)) {
        let known: Vec<String> = analysed.iter().map(|f| format!("{f} Hz")).collect();
        let message = format!("`{}.frequency` is {own} Hz, which is not analysed", section.path());
        section.wrong("frequency", message, format!("a frequency of [analysis]: {}", known.join(", ")));
    }
    let still = |f: f64| f == 0.0;
    let nothing = own.map_or(!analysed.is_empty() && analysed.iter().all(|&f| still(f)), still);
    if kind == ObjectiveKind::Loss && nothing {
        let message = format!("`{}` is a loss at 0 Hz, where no current is induced", section.path());
        section.wrong("kind", message, "a frequency above 0 Hz");
    }
}
