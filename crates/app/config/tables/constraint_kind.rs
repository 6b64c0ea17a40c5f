//! Every word that `kind` of a constraint may be: those of `[objective]`, and its own.

use serde::Serialize;

use super::functional::ObjectiveKind;
use crate::config::text::dimension::Dimension;
use crate::config::value::choice::{Choice, choice};

choice! {
    /// Kinds of constraints on a body.
    pub enum BodyKind {
        /// Volume of a region [m³], meshed or replaced by its impedance surface.
        Volume = "volume",
        /// Mass of a region [kg], by the `density` of its material.
        Mass = "mass",
    }
}

choice! {
    /// The kind of a constraint on the thickness.
    pub enum ThicknessKind {
        /// Thickness of the designed body along the direction of the design [m].
        Thickness = "thickness",
    }
}

impl BodyKind {
    /// Unit of its values.
    pub fn dimension(self) -> Dimension {
        match self {
            Self::Volume => Dimension::Volume,
            Self::Mass => Dimension::Mass,
        }
    }
}

/// What a constraint bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub(in crate::config) enum Kind {
    /// As in `[objective]`.
    Field(ObjectiveKind),
    /// A measure of a body.
    Body(BodyKind),
    /// The thickness of the designed body.
    Thickness(ThicknessKind),
}

impl Choice for Kind {
    const NAME: &'static str = "Kind";
    const ABOUT: &'static [&'static str] = &[" Every word that `kind` may be."];
    const FORMER: &'static [(&'static str, &'static str)] = ObjectiveKind::FORMER;

    fn choices() -> Vec<(&'static str, Self, &'static [&'static str])> {
        let as_there: &[&str] = &[" As in `[objective]`."];
        let fields =
            ObjectiveKind::choices().into_iter().map(|(word, kind, _)| (word, Self::Field(kind), as_there));
        let bodies = BodyKind::choices().into_iter().map(|(word, kind, own)| (word, Self::Body(kind), own));
        let thickness = ThicknessKind::choices().into_iter();
        fields
            .chain(bodies)
            .chain(thickness.map(|(word, kind, own)| (word, Self::Thickness(kind), own)))
            .collect()
    }
}

impl Kind {
    /// The word of the configuration.
    pub(in crate::config) fn name(self) -> &'static str {
        match self {
            Self::Field(kind) => kind.name(),
            Self::Body(kind) => kind.name(),
            Self::Thickness(kind) => kind.name(),
        }
    }
}
