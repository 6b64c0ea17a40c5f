//! What is measured of the field: the keys that `[objective]`, its terms and `[[constraints]]` share.

use super::design::{COMPONENTS, unit_vector};
use crate::config::section::Section;
use crate::config::table::rules::{Rules, Then};
use crate::config::table::table;
use crate::config::text::dimension::Dimension;
use crate::config::value::choice::choice;

table! {
    /// A real quantity of the field.
    pub struct Functional {
        /// What is measured. The default is the paper's objective.
        kind: ObjectiveKind = WORD => ObjectiveKind::FluxDensitySquared;
        /// The region it is measured in; for `force` and `torque` a body of `[[forces]]`. Required, but for `energy`: without it
        /// the energy is that of everything that is meshed.
        region: Option<String> = TEXT;
        /// For `flux_density_squared`, `target_field` and `homogeneity`: how the cells of the region are weighted. Default
        /// `"point"`, as in the paper; of `homogeneity` `"volume"`.
        weighting: Option<Weighting> = WORD;
        /// For `target_field`, required: the flux density wished for [T].
        target: Option<[f64; 3]> = quantity(FluxDensity, FINITE);
        /// For `homogeneity`: what is compared with its mean. Default: the component along `direction`, without one the vector.
        compare: Option<Compared> = WORD;
        /// For `field_component`, `force` and `torque`, required, and for `homogeneity`: a vector along the component; its length
        /// does not matter.
        #[also(not_all_zero)]
        direction: Option<[f64; 3]> = number(COMPONENTS);
        /// The one frequency it is taken at [Hz], one of `[analysis]`. Default: the values at all frequencies are added.
        frequency: Option<f64> = quantity(Frequency, NOT_NEGATIVE);
    }
}

/// The words of a deviation from a field that is wished for, with the one of earlier versions.
pub(super) const TARGET_FIELD: [&str; 2] = ["target_field", "uniformity"];

/// Kinds that are a component.
const DIRECTED: [&str; 3] = ["field_component", "force", "torque"];

/// Kinds that may have one.
const MAY_BE_DIRECTED: [&str; 4] = ["field_component", "force", "torque", "homogeneity"];

/// Which keys go with which kind.
pub(super) fn keys_of_the_kind(rules: Rules) -> Rules {
    rules
        .unless("kind", &["energy"], Then { required: &["region"], refused: &[] })
        .when(
            "kind",
            &["field_component", "loss", "energy", "force", "torque"],
            Then { required: &[], refused: &["weighting"] },
        )
        .when("kind", &TARGET_FIELD, Then { required: &["target"], refused: &[] })
        .unless("kind", &TARGET_FIELD, Then { required: &[], refused: &["target"] })
        .when("kind", &DIRECTED, Then { required: &["direction"], refused: &[] })
        .unless("kind", &MAY_BE_DIRECTED, Then { required: &[], refused: &["direction"] })
        .unless("kind", &["homogeneity"], Then { required: &[], refused: &["compare"] })
        .when("compare", &["component"], Then { required: &["direction"], refused: &[] })
        .when("compare", &["vector", "modulus"], Then { required: &[], refused: &["direction"] })
}

choice! {
    /// Kinds of functionals.
    pub enum ObjectiveKind {
        /// Σ w B·B* [T²; by volume T² m³]. The region must not move.
        FluxDensitySquared = "flux_density_squared",
        /// Deviation from a field that is wished for: Σ w |B − `target`|² [T²; by volume T² m³]; in harmonics the imaginary part is
        /// to vanish. A field that is even but of another strength counts as deviating. The region must not move.
        TargetField = "target_field" | "uniformity",
        /// Deviation from the field's own mean, whatever that is: Σ w |b − b̄|² / Σ w |b̄|² [1], the square of the relative rms
        /// deviation, for b as `compare` says; the result has its figures in ppm. The region must not move.
        Homogeneity = "homogeneity",
        /// Mean over the region of B·`direction` [T]; in harmonics the magnitude of its phasor. The region must not move.
        FieldComponent = "field_component",
        /// Eddy-current loss of a conductor, time average [W]; needs a frequency above 0. The conductor is meshed or replaced by its
        /// impedance surface, and may move.
        Loss = "loss",
        /// Energy of the magnetic field [J]: ½ ∫ ν |B|² dV in statics, its time average ¼ ∫ ν |B|² dV in harmonics. The region
        /// is meshed and may move.
        Energy = "energy",
        /// Force on a body of `[[forces]]` along `direction` [N], of the meshed part; in harmonics its time average. The body may
        /// move.
        Force = "force",
        /// Torque on a body of `[[forces]]` along `direction` about its point `about` [N m]. The body may move.
        Torque = "torque",
    }
}

choice! {
    /// What of B is compared with its mean.
    pub enum Compared {
        /// The vector.
        Vector = "vector",
        /// The component along `direction`.
        Component = "component",
        /// The modulus |B|.
        Modulus = "modulus",
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
        matches!(self, Self::FluxDensitySquared | Self::TargetField | Self::Homogeneity)
    }

    /// Whether it acts on a body of `[[forces]]`.
    pub fn is_of_a_body(self) -> bool {
        matches!(self, Self::Force | Self::Torque)
    }
}

impl Functional {
    /// Checks which keys go with the kind, and completes what follows from it.
    pub(super) fn check(&mut self, section: &Section<'_>) {
        let kind = self.kind;
        let is_homogeneity = kind == ObjectiveKind::Homogeneity;
        let is_component =
            DIRECTED.contains(&kind.name()) || is_homogeneity && self.compare == Some(Compared::Component);
        let takes_direction = is_component || is_homogeneity && self.compare.is_none();
        if !section.has("region") && kind != ObjectiveKind::Energy {
            section.missing(&["region"], "region = \"observation\"");
        }
        for (key, example, wanted) in [
            ("weighting", None, kind.sums_over_cells()),
            ("target", Some("target = [\"0 T\", \"0 T\", \"0.5 T\"]"), kind == ObjectiveKind::TargetField),
            ("direction", is_component.then_some("direction = [0, 0, 1]"), takes_direction),
            ("compare", None, is_homogeneity),
        ] {
            match (section.has(key), example) {
                (true, _) if !wanted => {
                    let message =
                        format!("`{}.{key}` has no use for the kind `{}`", section.path(), kind.name());
                    section.wrong(key, message, "no such key, or another kind");
                }
                (false, Some(example)) if wanted => section.missing(&[key], example),
                _ => {}
            }
        }
        self.direction = self.direction.and_then(|vector| unit_vector(section, vector));
        let usual = if is_homogeneity { Weighting::Volume } else { Weighting::Point };
        self.weighting = kind.sums_over_cells().then(|| self.weighting.unwrap_or(usual));
        if is_homogeneity && self.compare.is_none() {
            let given = if self.direction.is_some() { Compared::Component } else { Compared::Vector };
            self.compare = Some(given);
        }
    }

    /// Checks that its frequency is analysed, and that a loss is not sought where nothing is induced; `analysed` [Hz] is
    /// empty where it is unknown.
    pub(super) fn check_frequencies(&self, section: &Section<'_>, analysed: &[f64]) {
        if let Some(own) = self.frequency.filter(|own| !analysed.is_empty() && !analysed.contains(own)) {
            let known: Vec<String> = analysed.iter().map(|f| format!("{f} Hz")).collect();
            let message = format!("`{}.frequency` is {own} Hz, which is not analysed", section.path());
            section.wrong("frequency", message, format!("a frequency of [analysis]: {}", known.join(", ")));
        }
        let still = |f: f64| f == 0.0;
        let nothing =
            self.frequency.map_or(!analysed.is_empty() && analysed.iter().all(|&f| still(f)), still);
        if self.kind == ObjectiveKind::Loss && nothing {
            let message = format!("`{}` is a loss at 0 Hz, where no current is induced", section.path());
            section.wrong("kind", message, "a frequency above 0 Hz");
        }
    }

    /// Unit of its values.
    pub fn dimension(&self) -> Dimension {
        match (self.kind, self.weighting) {
            (ObjectiveKind::FluxDensitySquared | ObjectiveKind::TargetField, Some(Weighting::Volume)) => {
                Dimension::FluxDensityIntegral
            }
            (ObjectiveKind::FluxDensitySquared | ObjectiveKind::TargetField, _) => {
                Dimension::FluxDensitySquared
            }
            (ObjectiveKind::Homogeneity, _) => Dimension::Ratio,
            (ObjectiveKind::FieldComponent, _) => Dimension::FluxDensity,
            (ObjectiveKind::Loss, _) => Dimension::Power,
            (ObjectiveKind::Energy, _) => Dimension::Energy,
            (ObjectiveKind::Force, _) => Dimension::Force,
            (ObjectiveKind::Torque, _) => Dimension::Torque,
        }
    }
}
