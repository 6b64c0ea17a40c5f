//! `[[constraints]]`: what must stay below a bound while the objective is optimised.

use serde::Serialize;

use super::Dimension;
use super::choice::choice;
use super::functional::{Functional, ObjectiveKind};
use super::range::Range;
use super::section::{Section, first_duplicate};

/// A constraint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Constraint {
    /// Its name in the results. Default: its kind and region.
    pub name: String,
    /// What is kept within what.
    #[serde(flatten)]
    pub limit: Limit,
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
        /// See [`ObjectiveKind`].
        FluxDensitySquared = "flux_density_squared",
        /// See [`ObjectiveKind`].
        Uniformity = "uniformity",
        /// See [`ObjectiveKind`].
        FieldComponent = "field_component",
        /// See [`ObjectiveKind`].
        Loss = "loss",
        /// See [`ObjectiveKind`].
        Energy = "energy",
        /// See [`BodyKind`].
        Volume = "volume",
        /// See [`BodyKind`].
        Mass = "mass",
        /// See [`ThicknessKind`].
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
    let constraints: Vec<_> =
        root.tables("constraints").into_iter().filter_map(|s| Constraint::read(s, frequencies)).collect();
    let names: Vec<String> = constraints.iter().map(|c| c.name.clone()).collect();
    if let Some(name) = first_duplicate(&names) {
        root.wrong(
            "constraints",
            format!("two constraints are named `{name}`"),
            "a different `name` for each constraint",
        );
    }
    constraints
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
            section.wrong("maximum", message, "more than the minimum");
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
                section.wrong("upper_ratio", message, "one of them");
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
