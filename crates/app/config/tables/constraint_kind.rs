//! Every word that `kind` of a constraint may be: those of `[objective]`, and its own.

use serde::Serialize;

use super::functional::ObjectiveKind;
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

/// How many words there are, of each table.
const COUNTS: [usize; 3] =
    [ObjectiveKind::CHOICES.len(), BodyKind::CHOICES.len(), ThicknessKind::CHOICES.len()];
const COUNT: usize = COUNTS[0] + COUNTS[1] + COUNTS[2];

type Meaning = &'static [&'static str];

const ALL: ([(&str, Kind); COUNT], [Meaning; COUNT]) = {
    let (mut words, mut meanings): ([_; COUNT], [Meaning; COUNT]) =
        ([("", Kind::Thickness(ThicknessKind::Thickness)); COUNT], [&[]; COUNT]);
    let mut i = 0;
    while i < COUNT {
        (words[i], meanings[i]) = if i < COUNTS[0] {
            let (word, kind) = ObjectiveKind::CHOICES[i];
            ((word, Kind::Field(kind)), &[" As in `[objective]`."] as Meaning)
        } else if i < COUNTS[0] + COUNTS[1] {
            let (word, kind) = BodyKind::CHOICES[i - COUNTS[0]];
            ((word, Kind::Body(kind)), BodyKind::MEANINGS[i - COUNTS[0]])
        } else {
            let own = i - COUNTS[0] - COUNTS[1];
            let (word, kind) = ThicknessKind::CHOICES[own];
            ((word, Kind::Thickness(kind)), ThicknessKind::MEANINGS[own])
        };
        i += 1;
    }
    (words, meanings)
};

impl Choice for Kind {
    const NAME: &'static str = "Kind";
    const ABOUT: Meaning = &[" Every word that `kind` may be."];
    const CHOICES: &'static [(&'static str, Self)] = &ALL.0;
    const MEANINGS: &'static [Meaning] = &ALL.1;
    const FORMER: &'static [(&'static str, &'static str)] = ObjectiveKind::FORMER;
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
