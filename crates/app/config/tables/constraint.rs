//! `[[constraints]]`: what must stay below a bound while the objective is optimised.

use fluxmorph_optimizer::geometric::kept_back;
use fluxmorph_solver::frequency_label;
use serde::Serialize;
use serde_json::json;

use super::constraint_kind::{Kind, ThicknessKind};
use super::design::COMPONENTS;
use super::functional::{Compared, Follow, Functional, ObjectiveKind, Weighting, keys_of_the_kind};
use crate::config::section::Section;
use crate::config::table::kinds::{WORD, quantity};
use crate::config::table::rules::{Rules, Then, is, present};
use crate::config::table::{Group, Unread, table};
use crate::config::text::dimension::Dimension;
use crate::config::value::Column;
use crate::config::value::choice::Choice;
use crate::config::value::range::Range;

table! {
    /// What must keep within a bound while the objective is optimised; with the algorithms `mma`, `ccsaq` and `slsqp`, and
    /// with a `[design]`. A constraint counts as kept when it is beyond its bound by no more than a millionth of it, or of the
    /// initial value where the bound is zero. The best design of a run is the best one that keeps all constraints; if none does, the
    /// one that is least beyond a bound, with a warning.
    ///
    /// The bounds on a thickness are on the safe side by a hundredth of them: the true least thickness is a little greater, the
    /// greatest a little smaller. A search keeps them as bounds on the variables or as linear limits at every node, up to a
    /// thousand of these; where the mesh motion decides how far away the opposite face is, as one smooth function, and is slow
    /// along it. With both `minimum` and `maximum` one entry makes two constraints, with `_minimum` and `_maximum` behind their
    /// names.
    ///
    /// ```toml
    /// [[constraints]]
    /// kind = "mass"
    /// region = "plate"
    /// upper = "2.5 kg"
    ///
    /// [[constraints]]
    /// kind = "loss"
    /// region = "plate"
    /// upper_ratio = 0.9
    ///
    /// [[constraints]]
    /// kind = "thickness"
    /// minimum = "6 mm"
    /// ```
    pub struct Constraint {
        /// What the constraint is called in the results, a column of the history: letters, digits, `_` and `-`; each name once.
        /// Default: its kind and region, with its frequency and load where it has them, such as `loss_plate_60Hz`.
        name: String = COLUMN, else String::new();
        /// What is kept within what.
        #[serde(flatten)]
        limit: Limit = KEYS;
    }
    check = Constraint::check;
}

table! {
    /// The keys that say what is limited, for all kinds together.
    pub(in crate::config) struct LimitKeys {
        /// What is limited: a quantity of the field, a volume or mass, or the thickness of the designed bodies.
        kind: Kind = WORD, need "\"volume\"";
        /// The region it is measured in. Required, but for `energy`, `thickness` and quantities of `coils`.
        region: Option<String> = TEXT;
        /// As in `[objective]`.
        coils: Option<Vec<String>> = not_empty(NAMES);
        /// As in `[objective]`.
        harmonics: Option<Vec<String>> = not_empty(NAMES);
        /// As in `[objective]`.
        weighting: Option<Weighting> = WORD;
        /// As in `[objective]`.
        target: Option<[f64; 3]> = quantity(FluxDensity, FINITE);
        /// As in `[objective]`.
        compare: Option<Compared> = WORD;
        /// As in `[objective]`.
        #[also(not_all_zero)]
        direction: Option<[f64; 3]> = number(COMPONENTS);
        /// As in `[objective]`.
        follow: Option<Follow> = WORD;
        /// As in `[objective]`.
        frequency: Option<f64> = quantity(Frequency, NOT_NEGATIVE);
        /// As in `[objective]`.
        load: Option<String> = TEXT;
        /// The greatest value, in the unit of the kind: `"20 W"`, `"2.5 kg"`. One of this, `upper_ratio`, `lower` and
        /// `lower_ratio`.
        upper: Option<Unread> = SOME_QUANTITY;
        /// The greatest value as a multiple of that of the initial design, which must be positive.
        upper_ratio: Option<f64> = number(POSITIVE);
        /// The least value, in the unit of the kind: `"15 uH"`.
        lower: Option<Unread> = SOME_QUANTITY;
        /// The least value as a multiple of that of the initial design, which must be positive.
        lower_ratio: Option<f64> = number(POSITIVE);
        /// For `thickness`: the least thickness, measured at every node of the design surface and of the face opposite [m]. At least one of `minimum` and `maximum` is needed.
        minimum: Option<f64> = length(POSITIVE);
        /// For `thickness`: the greatest thickness [m].
        maximum: Option<f64> = length(POSITIVE);
    }
    unused = LimitKeys::unused;
    rules = keys_of_the_limit;
}

/// The keys of a functional of the field.
const OF_A_FIELD: [&str; 9] =
    ["coils", "harmonics", "weighting", "target", "compare", "direction", "follow", "frequency", "load"];
/// The keys of a bound on a value.
const BOUNDS: [&str; 4] = ["upper", "upper_ratio", "lower", "lower_ratio"];
/// The keys of a bound on a thickness.
const THICKNESSES: [&str; 2] = ["minimum", "maximum"];
/// The keys that a thickness does not have.
fn not_of_a_thickness() -> Vec<&'static str> {
    [&["region"], &OF_A_FIELD[..], &BOUNDS[..]].concat()
}

impl LimitKeys {
    /// `upper_ratio` and `lower_ratio`.
    fn ratios(&self) -> [Option<f64>; 2] {
        [self.upper_ratio, self.lower_ratio]
    }

    /// The keys that go with other kinds.
    fn unused(section: &Section<'_>) -> Vec<&'static str> {
        match section.peek("kind", &WORD) {
            Some(Kind::Thickness(_)) => not_of_a_thickness(),
            Some(_) => THICKNESSES.to_vec(),
            // Nothing can be said of the other keys.
            None => {
                section.silence();
                [not_of_a_thickness(), THICKNESSES.to_vec()].concat()
            }
        }
    }
}

/// Which keys go with which kind, and the unit of the bound.
fn keys_of_the_limit(rules: Rules) -> Rules {
    let thickness = Then { required: &[], refused: &not_of_a_thickness() };
    let mut rules = rules
        .when("kind", &["thickness"], thickness)
        .unless("kind", &["thickness"], Then { required: &[], refused: &THICKNESSES })
        .branch(is("kind", &["thickness"]), "else", keys_of_the_kind)
        .add(json!({
            "if": is("kind", &["thickness"]),
            "then": { "anyOf": present(&THICKNESSES) },
            "else": { "oneOf": present(&BOUNDS) },
        }));
    let by_volume = is("weighting", &["volume"]);
    let mut units = Vec::new();
    for (word, kind, _) in ObjectiveKind::choices() {
        let former = ObjectiveKind::FORMER.iter().filter(|(_, now)| *now == word).map(|(former, _)| *former);
        let is_kind = is("kind", &std::iter::once(word).chain(former).collect::<Vec<_>>());
        if let Some([least, most]) = kind.limits() {
            let bound = json!({ "minimum": least, "maximum": most });
            let bounds = json!({ "upper": bound, "lower": bound });
            rules = rules.add(json!({ "if": is_kind.clone(), "then": { "properties": bounds } }));
        }
        let [usual, over_volume] = [None, Some(Weighting::Volume)].map(|weighting| kind.dimension(weighting));
        if usual == over_volume {
            units.push((is_kind, usual, kind.range()));
        } else {
            let pointwise = json!({ "allOf": [is_kind, { "not": by_volume }] });
            units.push((json!({ "allOf": [is_kind, by_volume] }), over_volume, kind.range()));
            units.push((pointwise, usual, kind.range()));
        }
    }
    for (condition, dimension, range) in units {
        let bound = rules.definitions.quantity(dimension, range);
        let bounds = json!({ "upper": bound, "lower": bound });
        rules = rules.add(json!({ "if": condition, "then": { "properties": bounds } }));
    }
    rules
}

/// What is kept within which bounds.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Limit {
    /// A functional, from one side.
    Functional {
        /// What is measured.
        #[serde(flatten)]
        functional: Functional,
        /// Its bound.
        #[serde(flatten)]
        bound: ValueBound,
    },
    /// Thickness of the designed bodies along the direction of the design; at least one bound.
    Thickness {
        /// The word itself.
        kind: ThicknessKind,
        /// Least thickness [m].
        minimum: Option<f64>,
        /// Greatest thickness [m].
        maximum: Option<f64>,
    },
}

/// A bound on a value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum ValueBound {
    /// From above, in SI.
    #[serde(rename = "upper")]
    AtMost(f64),
    /// From above, as a multiple of the initial design's value.
    #[serde(rename = "upper_ratio")]
    AtMostRatio(f64),
    /// From below, in SI.
    #[serde(rename = "lower")]
    AtLeast(f64),
    /// From below, as a multiple of the initial design's value.
    #[serde(rename = "lower_ratio")]
    AtLeastRatio(f64),
}

impl Constraint {
    /// The default of its name.
    fn check(&mut self, section: &Section<'_>) {
        // Without a kind, or with an unknown one, a constraint is left out.
        let Some(kind) = section.peek::<_, Kind>("kind", &WORD) else { return self.name.clear() };
        if !self.name.is_empty() {
            return;
        }
        let mut words = vec![kind.name().to_owned()];
        match &self.limit {
            Limit::Functional { functional, .. } => {
                let of_coils = functional.coils.as_ref().map(|coils| coils.join("_"));
                words.extend(of_coils.or_else(|| functional.region.clone()));
                words.extend(functional.frequency.map(frequency_label));
                words.extend(functional.load.clone());
            }
            Limit::Thickness { .. } => {}
        }
        self.name = Column::of(&words.join("_"));
    }

    /// Whether a constraint of the results is this one, or one of both of a thickness.
    pub fn is_called(&self, name: &str) -> bool {
        let sides: &[&str] = match &self.limit {
            Limit::Functional { .. } => &[""],
            Limit::Thickness { .. } => &["", "_minimum", "_maximum"],
        };
        name.strip_prefix(self.name.as_str()).is_some_and(|side| sides.contains(&side))
    }
}

/// Bounds on one functional that no value keeps.
pub(super) fn check_bounds(root: &Section<'_>, constraints: &[Constraint]) {
    for (second, Constraint { limit, .. }) in constraints.iter().enumerate() {
        let Limit::Functional { functional, bound } = limit else { continue };
        let path = |index: usize, bound: ValueBound| format!("constraints[{index}].{}", bound.key());
        for (first, other) in constraints[..second].iter().enumerate() {
            if let Limit::Functional { functional: of_other, bound: other } = &other.limit
                && of_other == functional
                && bound.opposes(*other)
            {
                let [other, own] = [path(first, *other), path(second, *bound)];
                let message = format!("no value keeps both `{other}` and `{own}`");
                root.clash([&other, &own], message, "bounds that one value can keep");
            }
        }
    }
}

impl Group for Limit {
    type Written = LimitKeys;

    fn of(written: LimitKeys, section: &Section<'_>) -> Self {
        let Some(kind) = section.peek("kind", &WORD) else {
            return Self::Thickness { kind: ThicknessKind::Thickness, minimum: None, maximum: None };
        };
        match kind {
            Kind::Functional(kind) => Self::of_functional(kind, written, section),
            Kind::Thickness(_) => Self::thickness(&written, section),
        }
    }
}

impl Limit {
    /// Whether the bound is a share of the initial value.
    pub fn is_share_of_initial(&self) -> bool {
        let is_share =
            |bound: &ValueBound| matches!(bound, ValueBound::AtMostRatio(_) | ValueBound::AtLeastRatio(_));
        matches!(self, Self::Functional { bound, .. } if is_share(bound))
    }

    /// The functional that is limited; `None` for a thickness.
    pub fn functional(&self) -> Option<&Functional> {
        match self {
            Self::Functional { functional, .. } => Some(functional),
            Self::Thickness { .. } => None,
        }
    }

    /// Unit of what is limited.
    pub fn dimension(&self) -> Dimension {
        self.functional().map_or(Dimension::Length, Functional::dimension)
    }

    fn of_functional(kind: ObjectiveKind, written: LimitKeys, section: &Section<'_>) -> Self {
        let ratios = written.ratios();
        let LimitKeys {
            region,
            coils,
            harmonics,
            weighting,
            target,
            compare,
            direction,
            follow,
            frequency,
            load,
            ..
        } = written;
        let mut functional = Functional {
            kind,
            region,
            coils,
            harmonics,
            weighting,
            target,
            compare,
            direction,
            follow,
            frequency,
            load,
        };
        functional.check(section);
        let bound = ValueBound::of(ratios, section, functional.dimension(), kind.range());
        if let (Some([least, most]), ValueBound::AtMost(value) | ValueBound::AtLeast(value)) =
            (kind.limits(), bound)
            && (value < least || value > most)
        {
            let key = bound.key();
            let message = format!(
                "`{}.{key}` is {value}, which is out of range for the kind `{}`",
                section.path(),
                kind.name()
            );
            section.wrong(key, message, format!("from {least} to {most}"));
        }
        Self::Functional { functional, bound }
    }

    fn thickness(&LimitKeys { minimum, maximum, .. }: &LimitKeys, section: &Section<'_>) -> Self {
        if !section.has("minimum") && !section.has("maximum") {
            section.missing(&THICKNESSES, "minimum = \"6 mm\", or maximum = \"25 mm\"");
        }
        if let (Some(minimum), Some(maximum)) = (minimum, maximum)
            && minimum + kept_back(minimum) >= maximum - kept_back(maximum)
        {
            let message =
                format!("`{}` asks for {minimum} m at least and {maximum} m at most", section.path());
            section.clash(
                THICKNESSES,
                message,
                "a maximum of 1.021 times the minimum or more: both are held on the safe side",
            );
        }
        Self::Thickness { kind: ThicknessKind::Thickness, minimum, maximum }
    }
}

impl ValueBound {
    fn key(self) -> &'static str {
        match self {
            Self::AtMost(_) => "upper",
            Self::AtMostRatio(_) => "upper_ratio",
            Self::AtLeast(_) => "lower",
            Self::AtLeastRatio(_) => "lower_ratio",
        }
    }

    /// Whether no value keeps both.
    fn opposes(self, other: Self) -> bool {
        match (self, other) {
            (Self::AtMost(most), Self::AtLeast(least))
            | (Self::AtLeast(least), Self::AtMost(most))
            | (Self::AtMostRatio(most), Self::AtLeastRatio(least))
            | (Self::AtLeastRatio(least), Self::AtMostRatio(most)) => least > most,
            _ => false,
        }
    }

    fn of(ratios: [Option<f64>; 2], section: &Section<'_>, dimension: Dimension, range: Range) -> Self {
        let [upper, lower] = ["upper", "lower"].map(|key| section.read(key, &quantity(dimension, range)));
        let example = format!("upper = \"{}\", or upper_ratio = 0.9", dimension.example());
        section.exactly_one(&BOUNDS, &example, "one of them");
        match (BOUNDS.into_iter().find(|key| section.has(key)), ratios) {
            (Some("upper_ratio"), [Some(ratio), _]) => Self::AtMostRatio(ratio),
            (Some("lower_ratio"), [_, Some(ratio)]) => Self::AtLeastRatio(ratio),
            (Some("lower"), _) => Self::AtLeast(lower.unwrap_or(f64::NAN)),
            _ => Self::AtMost(upper.unwrap_or(f64::NAN)),
        }
    }
}
