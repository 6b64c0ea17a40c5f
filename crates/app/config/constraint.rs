//! `[[constraints]]`: what must stay below a bound while the objective is optimised.

use schemars::transform::Transform;
use schemars::{JsonSchema, Schema};
use serde::Serialize;
use serde_json::json;

use super::Dimension;
use super::choice::choice;
use super::design::COMPONENTS;
use super::functional::{Functional, ObjectiveKind, Weighting, keys_of_the_kind};
use super::range::Range;
use super::section::Section;
use crate::schema::form::{column_name, length, not_all_zero, number, of_some_dimension, quantity};
use crate::schema::rules::{Rules, Then, is};

/// What must keep within a bound while the objective is optimised; with the algorithms `mma`, `ccsaq` and `slsqp`, and
/// with a `[design]`. A constraint counts as kept when it is beyond its bound by no more than a millionth of it. The best
/// design of a run is the best one that keeps all constraints; if none does, the one that is least beyond a bound, with a
/// warning.
///
/// The bounds on a thickness are smooth ones on the safe side: the true least thickness is a little greater, the greatest a
/// little smaller. Where the flat body is to be limited, `design.lower` and `design.upper` do the same at no cost. With
/// both `minimum` and `maximum` one entry makes two constraints, with `_minimum` and `_maximum` behind their names.
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
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Constraint {
    /// What the constraint is called in the results, a column of the history: letters, digits, `_` and `-`; each name once.
    /// Default: its kind and region, such as `loss_plate`.
    #[schemars(with = "Option<String>", transform = column_name)]
    pub name: String,
    /// What is kept within what.
    #[serde(flatten)]
    #[schemars(with = "LimitKeys")]
    pub limit: Limit,
}

/// The keys that say what is limited, for all kinds together.
#[derive(JsonSchema)]
#[schemars(transform = keys_of_the_limit)]
#[allow(dead_code, reason = "stands for the keys of `Limit` in the schema")]
struct LimitKeys {
    /// What is limited: a quantity of the field, a volume or mass, or the thickness of the body.
    kind: Kind,
    /// The region it is measured in. Required, but for `energy` and `thickness`.
    region: Option<String>,
    /// As in `[objective]`.
    weighting: Option<Weighting>,
    /// As in `[objective]`.
    #[schemars(transform = quantity(Dimension::FluxDensity, Range::FINITE))]
    target: Option<[f64; 3]>,
    /// As in `[objective]`.
    #[schemars(transform = number(COMPONENTS), transform = not_all_zero)]
    direction: Option<[f64; 3]>,
    /// As in `[objective]`.
    #[schemars(transform = quantity(Dimension::Frequency, Range::NOT_NEGATIVE))]
    frequency: Option<f64>,
    /// The greatest value, in the unit of the kind: `"20 W"`, `"2.5 kg"`. Either this or `upper_ratio`.
    #[schemars(transform = of_some_dimension)]
    upper: Option<f64>,
    /// The greatest value as a multiple of that of the initial design, which must be positive.
    #[schemars(transform = number(Range::POSITIVE))]
    upper_ratio: Option<f64>,
    /// For `thickness`: the least thickness at every place [m]. At least one of `minimum` and `maximum` is needed.
    #[schemars(transform = length(Range::POSITIVE))]
    minimum: Option<f64>,
    /// For `thickness`: the greatest thickness [m].
    #[schemars(transform = length(Range::POSITIVE))]
    maximum: Option<f64>,
}

/// Which keys go with which kind, and the unit of the bound.
fn keys_of_the_limit(schema: &mut Schema) {
    const OF_A_FIELD: [&str; 4] = ["weighting", "target", "direction", "frequency"];
    const BOUNDS: [&str; 2] = ["upper", "upper_ratio"];
    const THICKNESSES: [&str; 2] = ["minimum", "maximum"];
    let [weighting, target, direction, frequency] = OF_A_FIELD;
    let thickness = Then {
        required: &[],
        refused: &["region", weighting, target, direction, frequency, BOUNDS[0], BOUNDS[1]],
    };
    let body = Then { required: &["region"], refused: &OF_A_FIELD };
    let mut of_a_field = Schema::default();
    keys_of_the_kind(&mut of_a_field);
    let any_of = |keys: [&str; 2]| keys.map(|key| json!({ "required": [key] }));
    let mut rules = Rules::of(schema)
        .when("kind", &["thickness"], thickness)
        .unless("kind", &["thickness"], Then { required: &[], refused: &THICKNESSES })
        .when("kind", &["volume", "mass"], body)
        .add(json!({ "if": is("kind", &["volume", "mass", "thickness"]), "else": of_a_field }))
        .add(json!({
            "if": is("kind", &["thickness"]),
            "then": { "anyOf": any_of(THICKNESSES) },
            "else": { "oneOf": any_of(BOUNDS) },
        }));
    let by_volume = is("weighting", &["volume"]);
    let sums = is("kind", &["flux_density_squared", "uniformity"]);
    let units = [
        (json!({ "allOf": [sums, by_volume] }), Dimension::FluxDensityIntegral, Range::POSITIVE),
        (json!({ "allOf": [sums, { "not": by_volume }] }), Dimension::FluxDensitySquared, Range::POSITIVE),
        (is("kind", &["field_component"]), Dimension::FluxDensity, Range::FINITE),
        (is("kind", &["loss"]), Dimension::Power, Range::POSITIVE),
        (is("kind", &["energy"]), Dimension::Energy, Range::POSITIVE),
        (is("kind", &["volume"]), Dimension::Volume, Range::POSITIVE),
        (is("kind", &["mass"]), Dimension::Mass, Range::POSITIVE),
    ];
    for (condition, dimension, range) in units {
        let mut upper = Schema::default();
        quantity(dimension, range).transform(&mut upper);
        rules = rules.add(json!({ "if": condition, "then": { "properties": { "upper": upper } } }));
    }
}

/// What is kept within which bounds.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Limit {
    /// A functional of the field, from above.
    Field {
        /// What is measured.
        #[serde(flatten)]
        functional: Functional,
        /// Its bound.
        #[serde(flatten)]
        bound: UpperBound,
    },
    /// Volume or mass of a region, from above.
    Body {
        /// Which of them.
        kind: BodyKind,
        /// The region.
        region: String,
        /// Its bound.
        #[serde(flatten)]
        bound: UpperBound,
    },
    /// Thickness of the designed body along the direction of the design; at least one bound.
    Thickness {
        /// The word itself.
        kind: ThicknessKind,
        /// Least thickness [m].
        minimum: Option<f64>,
        /// Greatest thickness [m].
        maximum: Option<f64>,
    },
}

choice! {
    /// Kinds of constraints on a body.
    pub enum BodyKind {
        /// Volume [m³].
        Volume = "volume",
        /// Mass [kg], by `density` of the material.
        Mass = "mass",
    }
}

choice! {
    /// The kind of a constraint on the thickness.
    pub enum ThicknessKind {
        /// Thickness [m].
        Thickness = "thickness",
    }
}

choice! {
    /// Every word that `kind` may be.
    enum Kind {
        /// As in `[objective]`.
        FluxDensitySquared = "flux_density_squared",
        /// As in `[objective]`.
        Uniformity = "uniformity",
        /// As in `[objective]`.
        FieldComponent = "field_component",
        /// As in `[objective]`.
        Loss = "loss",
        /// As in `[objective]`.
        Energy = "energy",
        /// Volume of a region [m³], meshed or replaced by its impedance surface.
        Volume = "volume",
        /// Mass of a region [kg], by the `density` of its material.
        Mass = "mass",
        /// Thickness of the designed body along the direction of the design [m].
        Thickness = "thickness",
    }
}

/// An upper bound.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum UpperBound {
    /// In SI.
    #[serde(rename = "upper")]
    Value(f64),
    /// As a multiple of the initial design's value.
    #[serde(rename = "upper_ratio")]
    Ratio(f64),
}

/// Read `[[constraints]]`; `frequencies` [Hz] are those of the analysis, empty where they are unknown.
pub(super) fn read_constraints(root: &Section<'_>, frequencies: &[f64]) -> Vec<Constraint> {
    let constraints: Vec<Option<Constraint>> =
        root.tables("constraints").into_iter().map(|s| Constraint::read(s, frequencies)).collect();
    let name =
        |constraint: &Option<Constraint>| constraint.as_ref().map_or(String::new(), |c| c.name.clone());
    let names: Vec<String> = constraints.iter().map(name).collect();
    root.named_twice("constraints", &names, "constraints", "a different `name` for each constraint");
    constraints.into_iter().flatten().collect()
}

impl Constraint {
    /// `None`, with a fault, where the kind is unknown: then nothing can be said of the other keys.
    fn read(section: Section<'_>, frequencies: &[f64]) -> Option<Self> {
        let kind: Option<Kind> = section.choice("kind");
        if kind.is_none() && !section.has("kind") {
            section.missing("kind", "kind = \"volume\"");
        }
        let kind = kind?;
        let given = section.text("name");
        if let Some(name) = given.as_ref().filter(|name| **name != column(name)) {
            let message = format!("`{}.name` is `{}`", section.path(), name.escape_debug());
            section.wrong("name", message, "letters, digits, `_` and `-`: it is a column of the history");
        }
        let limit = match kind {
            Kind::FluxDensitySquared => Self::field(ObjectiveKind::FluxDensitySquared, &section, frequencies),
            Kind::Uniformity => Self::field(ObjectiveKind::Uniformity, &section, frequencies),
            Kind::FieldComponent => Self::field(ObjectiveKind::FieldComponent, &section, frequencies),
            Kind::Loss => Self::field(ObjectiveKind::Loss, &section, frequencies),
            Kind::Energy => Self::field(ObjectiveKind::Energy, &section, frequencies),
            Kind::Volume => Self::body(BodyKind::Volume, Dimension::Volume, &section),
            Kind::Mass => Self::body(BodyKind::Mass, Dimension::Mass, &section),
            Kind::Thickness => Self::thickness(&section),
        };
        let region = match &limit {
            Limit::Field { functional, .. } => functional.region.as_deref(),
            Limit::Body { region, .. } => Some(region.as_str()),
            Limit::Thickness { .. } => None,
        };
        let name = given.unwrap_or_else(|| {
            column(&region.map_or(kind.name().to_owned(), |r| format!("{}_{r}", kind.name())))
        });
        section.finish();
        Some(Self { name, limit })
    }

    fn field(kind: ObjectiveKind, section: &Section<'_>, frequencies: &[f64]) -> Limit {
        let functional = Functional::read_kind(kind, section, frequencies);
        let range = match kind {
            ObjectiveKind::FieldComponent => Range::FINITE,
            _ => Range::POSITIVE,
        };
        let bound = UpperBound::read(section, functional.dimension(), range);
        Limit::Field { functional, bound }
    }

    fn body(kind: BodyKind, dimension: Dimension, section: &Section<'_>) -> Limit {
        let region = section.text("region");
        Limit::Body {
            kind,
            region: section.need("region", region, "\"plate\""),
            bound: UpperBound::read(section, dimension, Range::POSITIVE),
        }
    }

    fn thickness(section: &Section<'_>) -> Limit {
        let minimum = section.quantity("minimum", Dimension::Length, Range::POSITIVE);
        let maximum = section.quantity("maximum", Dimension::Length, Range::POSITIVE);
        if !section.has("minimum") && !section.has("maximum") {
            section.missing("minimum", "minimum = \"6 mm\", or maximum = \"25 mm\"");
        }
        if let (Some(minimum), Some(maximum)) = (minimum, maximum)
            && minimum >= maximum
        {
            let message =
                format!("`{}` asks for {minimum} m at least and {maximum} m at most", section.path());
            section.clash(["minimum", "maximum"], message, "more than the minimum");
        }
        Limit::Thickness { kind: ThicknessKind::Thickness, minimum, maximum }
    }
}

impl UpperBound {
    fn read(section: &Section<'_>, dimension: Dimension, range: Range) -> Self {
        let value = section.quantity("upper", dimension, range);
        let ratio = section.number("upper_ratio", Range::POSITIVE);
        match (section.has("upper"), section.has("upper_ratio")) {
            (true, true) => {
                let message = format!("`{}` has both `upper` and `upper_ratio`", section.path());
                section.clash(["upper", "upper_ratio"], message, "one of them");
            }
            (false, false) => {
                section
                    .missing("upper", &format!("upper = \"{}\", or upper_ratio = 0.9", dimension.example()));
            }
            _ => {}
        }
        ratio.map_or(Self::Value(value.unwrap_or(f64::NAN)), Self::Ratio)
    }
}

/// A name that can stand in the header of a table.
fn column(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || c == '_' || c == '-' { c } else { '_' }).collect()
}
