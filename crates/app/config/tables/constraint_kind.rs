//! Every word that `kind` of a constraint may be: those of `[objective]`, and its own.

use serde::Serialize;

use super::functional::ObjectiveKind;
use crate::config::value::choice::{Choice, choice};

choice! {
    /// The kind of a constraint on the thickness.
    pub enum ThicknessKind {
        /// Thickness of the designed bodies, each behind its own part of the design surface, along the direction of the design [m].
        Thickness = "thickness",
    }
}

/// What a constraint bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub(in crate::config) enum Kind {
    /// As in `[objective]`.
    Functional(ObjectiveKind),
    /// The thickness of the designed bodies.
    Thickness(ThicknessKind),
}

impl Choice for Kind {
    const NAME: &'static str = "Kind";
    const ABOUT: &'static [&'static str] = &[" Every word that `kind` may be."];
    const FORMER: &'static [(&'static str, &'static str)] = ObjectiveKind::FORMER;

    fn choices() -> Vec<(&'static str, Self, &'static [&'static str])> {
        let as_there: &[&str] = &[" As in `[objective]`."];
        let fields = ObjectiveKind::choices()
            .into_iter()
            .map(|(word, kind, _)| (word, Self::Functional(kind), as_there));
        let thickness = ThicknessKind::choices().into_iter();
        fields.chain(thickness.map(|(word, kind, own)| (word, Self::Thickness(kind), own))).collect()
    }
}

impl Kind {
    /// The word of the configuration.
    pub(in crate::config) fn name(self) -> &'static str {
        match self {
            Self::Functional(kind) => kind.name(),
            Self::Thickness(kind) => kind.name(),
        }
    }
}
