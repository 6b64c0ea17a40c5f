//! What is measured of the field: the keys that `[objective]`, its terms and `[[constraints]]` share.

use serde_json::{Value, json};

use super::design::{COMPONENTS, unit_vector};
use super::load::LoadCase;
use crate::config::section::Section;
use crate::config::table::kinds::WORD;
use crate::config::table::rules::{Rules, Then, is};
use crate::config::table::table;
use crate::config::text::dimension::Dimension;
use crate::config::text::message::shown;
use crate::config::value::choice::choice;
use crate::config::value::range::Range;

table! {
    /// A real quantity of the field or of the shape.
    pub struct Functional {
        /// What is measured. The default is the paper's objective.
        kind: ObjectiveKind = WORD => ObjectiveKind::FluxDensitySquared;
        /// The region it is measured in; for `force` and `torque` a body of `[[forces]]`, for `multipole` and `multipole_content` an
        /// expansion of `[[multipoles]]`. Required, but for `energy`: without it the energy is that of everything that is meshed; and
        /// but for quantities of `coils`.
        region: Option<String> = TEXT;
        /// For quantities of coils, required: the coils with `turns` that it is of, one or two as the kind says.
        coils: Option<Vec<String>> = not_empty(NAMES);
        /// For `multipole` and `multipole_content`, required: terms of the expansion, such as `"b3"` and `"a2"` on a circle, `"c2_0"` and
        /// `"s2_1"` (n_m) in a ball; of `multipole` one.
        harmonics: Option<Vec<String>> = not_empty(NAMES);
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
        /// For kinds of B in a region or of an expansion, where the mesh moves there; required then: `"space"`, the places stay and the
        /// mesh moves through them, or `"mesh"`, the cells of the region move with it; an expansion stays.
        follow: Option<Follow> = WORD;
        /// The one frequency it is taken at [Hz], one of `[analysis]` or of `[[loads]]`. Default: the values at all frequencies are
        /// added.
        frequency: Option<f64> = quantity(Frequency, NOT_NEGATIVE);
        /// The one load of `[[loads]]` it is taken under. Default: the values under all loads are added.
        load: Option<String> = TEXT;
    }
}

/// The words of a deviation from a field that is wished for, with the one of earlier versions.
pub(super) const TARGET_FIELD: [&str; 2] = ["target_field", "uniformity"];

/// Kinds that are a component.
const DIRECTED: [&str; 3] = ["field_component", "force", "torque"];

/// Kinds of one coil.
const OF_ONE_COIL: [&str; 8] = [
    "flux_linkage",
    "current",
    "voltage",
    "power",
    "power_factor",
    "inductance",
    "resistance",
    "quality_factor",
];

/// Kinds of two coils.
const OF_TWO_COILS: [&str; 3] = ["mutual_inductance", "coupling", "link_efficiency"];

/// Kinds of an expansion.
const OF_TERMS: [&str; 2] = ["multipole", "multipole_content"];

/// Kinds of the flux density in cells or of an expansion, whose places may stay or follow the mesh.
const OBSERVES: [&str; 7] = [
    "flux_density_squared",
    TARGET_FIELD[0],
    TARGET_FIELD[1],
    "homogeneity",
    "field_component",
    OF_TERMS[0],
    OF_TERMS[1],
];

/// Kinds of the shape alone.
const OF_THE_SHAPE: [&str; 2] = ["volume", "mass"];

/// Kinds that may have one.
const MAY_BE_DIRECTED: [&str; 4] = ["field_component", "force", "torque", "homogeneity"];

/// Which keys go with which kind.
pub(super) fn keys_of_the_kind(rules: Rules) -> Rules {
    let of_coils = [&OF_ONE_COIL[..], &OF_TWO_COILS].concat();
    let of_one = json!({ "maxItems": 1 });
    let of_two = json!({ "minItems": 2, "maxItems": 2 });
    let count = |kinds: &[&str], items: &Value| json!({ "if": is("kind", kinds), "then": { "properties": { "coils": items } } });
    rules
        .not_both(["frequency", "load"])
        .unless("kind", &[&["energy"], &of_coils[..]].concat(), Then { required: &["region"], refused: &[] })
        .when("kind", &of_coils, Then { required: &["coils"], refused: &["region"] })
        .unless("kind", &of_coils, Then { required: &[], refused: &["coils"] })
        .when("kind", &OF_TERMS, Then { required: &["harmonics"], refused: &[] })
        .unless("kind", &OF_TERMS, Then { required: &[], refused: &["harmonics"] })
        .add(json!({ "if": is("kind", &["multipole"]), "then": { "properties": { "harmonics": of_one } } }))
        .add(count(&OF_ONE_COIL, &of_one))
        .add(count(&OF_TWO_COILS, &of_two))
        .when(
            "kind",
            &[&["field_component", "loss", "energy", "force", "torque"], &OF_TERMS[..], &of_coils, &OF_THE_SHAPE].concat(),
            Then { required: &[], refused: &["weighting"] },
        )
        .when("kind", &OF_THE_SHAPE, Then { required: &[], refused: &["frequency", "load"] })
        .when("kind", &TARGET_FIELD, Then { required: &["target"], refused: &[] })
        .unless("kind", &TARGET_FIELD, Then { required: &[], refused: &["target"] })
        .when("kind", &DIRECTED, Then { required: &["direction"], refused: &[] })
        .unless("kind", &MAY_BE_DIRECTED, Then { required: &[], refused: &["direction"] })
        .unless("kind", &["homogeneity"], Then { required: &[], refused: &["compare"] })
        .when_none_of("kind", &OBSERVES, Then { required: &[], refused: &["follow"] })
        .add(json!({ "if": is("kind", &OF_TERMS), "then": { "properties": { "follow": { "const": "space" } } } }))
        .when("compare", &["component"], Then { required: &["direction"], refused: &[] })
        .when("compare", &["vector", "modulus"], Then { required: &[], refused: &["direction"] })
}

choice! {
    /// Kinds of functionals.
    pub enum ObjectiveKind {
        /// Σ w B·B* [T²; by volume T² m³]. Where the mesh moves there, see `follow`.
        FluxDensitySquared = "flux_density_squared",
        /// Deviation from a field that is wished for: Σ w |B − `target`|² [T²; by volume T² m³]; in harmonics the imaginary part is
        /// to vanish. A field that is even but of another strength counts as deviating. Where the mesh moves there, see `follow`.
        TargetField = "target_field" | "uniformity",
        /// Deviation from the field's own mean, whatever that is: Σ w |b − b̄|² / Σ w |b̄|² [1], the square of the relative rms
        /// deviation, for b as `compare` says; the result has its figures in ppm. The mean of a vector is that of the whole device where
        /// the region ends at symmetry planes of `[boundaries]`; that of a component is that of the meshed part, and a direction that the
        /// images turn round, or that is oblique to a plane, is warned of. Where the mesh moves there, see `follow`.
        Homogeneity = "homogeneity",
        /// Mean over the region of B·`direction` [T]; in harmonics the magnitude of its phasor. Where the mesh moves there, see `follow`.
        FieldComponent = "field_component",
        /// Eddy-current loss of a conductor, time average [W]; needs a frequency above 0. The conductor is meshed or replaced by its
        /// impedance surface, and may move.
        Loss = "loss",
        /// Energy of the magnetic field [J]: ½ ∫ ν |B|² dV in statics, of a magnet ½ ∫ ν |B − Br|² dV, along a B–H curve the
        /// integral of H over B; in harmonics its time average, ¼ ∫ ν |B|² dV. The region is meshed and may move.
        Energy = "energy",
        /// Force on a body of `[[forces]]` along `direction` [N], of the meshed part; in harmonics its time average. The body may
        /// move.
        Force = "force",
        /// Torque on a body of `[[forces]]` along `direction` about its point `about` [N m]. The body may move.
        Torque = "torque",
        /// Inductance of a coil [H], of the meshed part.
        Inductance = "inductance",
        /// Mutual inductance of two coils [H].
        MutualInductance = "mutual_inductance",
        /// Coupling factor of two coils: mutual inductance over the root of the product of their inductances [1].
        Coupling = "coupling",
        /// Resistance of a coil [Ω]: that of its wire, and that of the losses which its current alone makes in the field; needs a
        /// frequency above 0.
        Resistance = "resistance",
        /// Quality factor of a coil [1]: its reactance over its resistance; needs a frequency above 0.
        QualityFactor = "quality_factor",
        /// The largest share of the power into one of two coils that a load at the other can take, with the best compensation [1];
        /// needs a frequency above 0.
        LinkEfficiency = "link_efficiency",
        /// Flux linkage of a coil [Wb]; in harmonics the magnitude of its phasor.
        FluxLinkage = "flux_linkage",
        /// Magnitude of the current [A] of a coil that a voltage drives; needs a frequency above 0.
        Current = "current",
        /// Magnitude of the voltage [V] across a coil with its resistance, without what else is in series; needs a frequency above 0.
        Voltage = "voltage",
        /// Power into a coil, time average [W]; needs a frequency above 0.
        Power = "power",
        /// Power factor [1] of a coil with what is in series with it: its power over half the product of the magnitudes of voltage and
        /// current; needs a frequency above 0.
        PowerFactor = "power_factor",
        /// One of the `harmonics` of an expansion [T]; in harmonics the magnitude of its phasor. The places stay; where the mesh moves there, see `follow`.
        Multipole = "multipole",
        /// How much of some `harmonics` an expansion has: their summed squares over those of the main order [1], the square of what
        /// builders of magnets give in units of 1e-4. The places stay; where the mesh moves there, see `follow`.
        MultipoleContent = "multipole_content",
        /// Volume of a region [m³], meshed or replaced by its impedance surface: to be made small while `[[constraints]]` keep what
        /// the field has to do.
        Volume = "volume",
        /// Mass of a region [kg], by the `density` of its material.
        Mass = "mass",
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
    /// What observed places do where the mesh moves.
    pub enum Follow {
        /// They stay as they are at the start, with their weights; what moves must not reach them.
        Space = "space",
        /// The cells move with the mesh.
        Mesh = "mesh",
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

/// What stands behind `a frequency` where a direct current has nothing to offer.
pub(crate) const ABOVE_ZERO_HERTZ: &str = "above 0 Hz; at 0.1 Hz a solid conductor has the resistance of direct current, and with √2 \
     times its amperes the loss";

impl ObjectiveKind {
    /// Whether the cells are weighted.
    fn sums_over_cells(self) -> bool {
        matches!(self, Self::FluxDensitySquared | Self::TargetField | Self::Homogeneity)
    }

    /// What a bound on it may be: its values have either sign, or are positive.
    pub(super) fn range(self) -> Range {
        match self {
            Self::FieldComponent
            | Self::Force
            | Self::Torque
            | Self::MutualInductance
            | Self::Coupling
            | Self::PowerFactor
            | Self::FluxLinkage
            | Self::Power
            | Self::Multipole => Range::FINITE,
            _ => Range::POSITIVE,
        }
    }

    /// Least and greatest value that any device has of it, where they are known.
    pub(super) fn limits(self) -> Option<[f64; 2]> {
        match self {
            Self::Coupling | Self::PowerFactor => Some([-1.0, 1.0]),
            Self::LinkEfficiency => Some([0.0, 1.0]),
            _ => None,
        }
    }

    /// Whether what several states have of it adds up to something: power and energy do, an inductance does not.
    pub fn adds_up_over_states(self) -> bool {
        let own = [Self::FluxDensitySquared, Self::TargetField, Self::Loss, Self::Energy, Self::Power];
        own.contains(&self) || !self.is_of_field()
    }

    /// Unit of its values.
    pub(super) fn dimension(self, weighting: Option<Weighting>) -> Dimension {
        match self {
            Self::FluxDensitySquared | Self::TargetField if weighting == Some(Weighting::Volume) => {
                Dimension::FluxDensityIntegral
            }
            Self::FluxDensitySquared | Self::TargetField => Dimension::FluxDensitySquared,
            Self::FieldComponent | Self::Multipole => Dimension::FluxDensity,
            Self::Loss | Self::Power => Dimension::Power,
            Self::Energy => Dimension::Energy,
            Self::Force => Dimension::Force,
            Self::Torque => Dimension::Torque,
            Self::Inductance | Self::MutualInductance => Dimension::Inductance,
            Self::Homogeneity
            | Self::Coupling
            | Self::QualityFactor
            | Self::LinkEfficiency
            | Self::PowerFactor
            | Self::MultipoleContent => Dimension::Ratio,
            Self::Volume => Dimension::Volume,
            Self::Mass => Dimension::Mass,
            Self::Resistance => Dimension::Resistance,
            Self::FluxLinkage => Dimension::FluxLinkage,
            Self::Current => Dimension::Current,
            Self::Voltage => Dimension::Voltage,
        }
    }

    /// How many coils it is of.
    pub fn coils(self) -> usize {
        match self.name() {
            name if OF_ONE_COIL.contains(&name) => 1,
            name if OF_TWO_COILS.contains(&name) => 2,
            _ => 0,
        }
    }

    /// Whether it has no meaning at 0 Hz, and why.
    fn why_not_static(self) -> Option<&'static str> {
        match self {
            Self::Loss => Some("a loss at 0 Hz, where no current is induced"),
            Self::Resistance | Self::QualityFactor | Self::LinkEfficiency => {
                Some("of losses at 0 Hz, where no current is induced")
            }
            Self::Current | Self::Voltage | Self::Power | Self::PowerFactor => {
                Some("of a coil at 0 Hz, where no shape changes it")
            }
            _ => None,
        }
    }

    /// Whether it is a function of the inductances of coils, whatever their currents.
    pub fn is_of_inductances(self) -> bool {
        matches!(
            self,
            Self::Inductance
                | Self::MutualInductance
                | Self::Coupling
                | Self::Resistance
                | Self::QualityFactor
                | Self::LinkEfficiency
        )
    }

    /// Whether it is of an expansion of `[[multipoles]]`.
    pub fn is_of_terms(self) -> bool {
        matches!(self, Self::Multipole | Self::MultipoleContent)
    }

    /// Whether it is a sum or mean over the cells of its region.
    pub fn is_over_cells(self) -> bool {
        matches!(
            self,
            Self::FluxDensitySquared | Self::TargetField | Self::Homogeneity | Self::FieldComponent
        )
    }

    /// Whether its `region` is one of the mesh.
    pub fn is_of_a_region(self) -> bool {
        !self.is_of_a_body() && !self.is_of_terms()
    }

    /// Whether the field has a say in it.
    pub fn is_of_field(self) -> bool {
        !OF_THE_SHAPE.contains(&self.name())
    }

    /// Whether it acts on a body of `[[forces]]`.
    pub fn is_of_a_body(self) -> bool {
        matches!(self, Self::Force | Self::Torque)
    }
}

impl Functional {
    /// Checks which keys go with the kind, and completes what follows from it.
    pub(super) fn check(&mut self, section: &Section<'_>) {
        if section.has("kind") && section.peek::<_, ObjectiveKind>("kind", &WORD).is_none() {
            // Which keys it takes, and of what it is, cannot be told.
            (self.region, self.coils) = (None, None);
            return;
        }
        let kind = self.kind;
        let is_homogeneity = kind == ObjectiveKind::Homogeneity;
        let is_component =
            DIRECTED.contains(&kind.name()) || is_homogeneity && self.compare == Some(Compared::Component);
        let takes_direction = is_component || is_homogeneity && self.compare.is_none();
        if !section.has("region") && kind != ObjectiveKind::Energy && kind.coils() == 0 {
            let is_of_a_body = !kind.is_of_field() || kind == ObjectiveKind::Loss;
            let example = if is_of_a_body { "region = \"plate\"" } else { "region = \"observation\"" };
            section.missing(&["region"], example);
        }
        let example = ["", "coils = [\"coil\"]", "coils = [\"one\", \"other\"]"][kind.coils()];
        if let Some(named) = &self.coils
            && kind.coils() > 0
            && named.len() != kind.coils()
        {
            let of = ["", "one coil", "two coils"][kind.coils()];
            let message = format!("`{}` is of {of}, and {} named", kind.name(), named.len());
            section.wrong("coils", message, example);
        }
        if let Some(named) = self.harmonics.as_ref().filter(|_| kind == ObjectiveKind::Multipole)
            && named.len() > 1
        {
            let message = format!("`multipole` is one term, and {} are named", named.len());
            section.wrong("harmonics", message, "one of them, or the kind multipole_content");
        }
        if kind.is_of_terms() && self.follow == Some(Follow::Mesh) {
            let message =
                format!("`{}` is of an expansion, whose places do not follow the mesh", kind.name());
            section.wrong("follow", message, "\"space\"");
        }
        for (key, example, wanted) in [
            ("harmonics", Some("harmonics = [\"b3\"]"), kind.is_of_terms()),
            ("coils", Some(example), kind.coils() > 0),
            ("region", None, kind.coils() == 0),
            ("weighting", None, kind.sums_over_cells()),
            ("target", Some("target = [\"0 T\", \"0 T\", \"0.5 T\"]"), kind == ObjectiveKind::TargetField),
            ("direction", is_component.then_some("direction = [0, 0, 1]"), takes_direction),
            ("compare", None, is_homogeneity),
            ("follow", None, OBSERVES.contains(&kind.name())),
            ("frequency", None, kind.is_of_field()),
            ("load", None, kind.is_of_field()),
        ] {
            match (section.has(key), example) {
                (true, _) if !wanted && key == "direction" && is_homogeneity => {
                    let message =
                        format!("`{}.direction` belongs to compare = \"component\"", section.path());
                    section.wrong(key, message, "no such key, or another compare");
                }
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

    /// Whether it is taken under a load case.
    pub fn is_taken_under(&self, case: &LoadCase<'_>) -> bool {
        self.frequency.is_none_or(|own| own == case.frequency)
            && self.load.as_deref().is_none_or(|own| case.name() == Some(own))
    }

    /// Checks that its frequency and its load are analysed, and that a loss is not sought where nothing is induced; `cases` are
    /// empty where they are unknown.
    pub(super) fn check_load(&self, section: &Section<'_>, cases: &[LoadCase<'_>]) {
        if let Some(own) =
            self.frequency.filter(|own| !cases.is_empty() && cases.iter().all(|case| case.frequency != *own))
        {
            let mut known: Vec<String> = cases.iter().map(|case| format!("{} Hz", case.frequency)).collect();
            known.dedup();
            let message = format!("`{}.frequency` is {own} Hz, which is not analysed", section.path());
            section.wrong("frequency", message, format!("a frequency of [analysis]: {}", known.join(", ")));
        }
        if self.frequency.is_some() && self.load.is_some() {
            let message =
                format!("`{}` has both `frequency` and `load`, which has one frequency", section.path());
            section.clash(["frequency", "load"], message, "one of them");
        } else if let Some(own) = self.load.as_deref().filter(|_| !cases.is_empty()) {
            let known: Vec<&str> = cases.iter().filter_map(LoadCase::name).collect();
            if !known.contains(&own) {
                let message = format!("there is no load `{}`", shown(own));
                section.unknown_name("load", message, own, &known);
            }
        }
        let taken: Vec<f64> =
            cases.iter().filter(|case| self.is_taken_under(case)).map(|case| case.frequency).collect();
        let is_void = if self.kind == ObjectiveKind::Loss {
            !taken.is_empty() && taken.iter().all(|&f| f == 0.0)
        } else {
            taken.contains(&0.0)
        };
        if let Some(why) = self.kind.why_not_static().filter(|_| is_void) {
            let expected = format!("a frequency {ABOVE_ZERO_HERTZ}");
            section.wrong("kind", format!("`{}` is {why}", section.path()), expected);
        }
    }

    /// Whether it is a sum or mean over the cells of its region.
    pub fn is_over_cells(&self) -> bool {
        let kind = self.kind;
        matches!(
            kind,
            ObjectiveKind::FluxDensitySquared | ObjectiveKind::TargetField | ObjectiveKind::Homogeneity
        ) && self.weighting != Some(Weighting::Volume)
    }

    /// Unit of its values.
    pub fn dimension(&self) -> Dimension {
        self.kind.dimension(self.weighting)
    }
}
