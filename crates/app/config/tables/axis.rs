//! The axis of a coil, of a rotation or of an expansion.

use crate::config::section::Section;
use crate::config::table::one_of;
use crate::config::value::choice::choice;

choice! {
    /// A coordinate axis.
    pub enum AxisWord {
        /// x.
        X = "x",
        /// y.
        Y = "y",
        /// z.
        Z = "z",
    }
}

impl AxisWord {
    /// Its coordinate: 0, 1 or 2.
    pub fn index(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
        }
    }
}

one_of! {
    /// The axis of a coil or of a rotation: the name of a coordinate, or a vector.
    #[derive(Copy)]
    pub enum Axis {
        /// A coordinate axis.
        Coordinate(AxisWord) = WORD;
        /// Along a vector of any length but zero.
        #[also(not_all_zero)]
        Vector([f64; 3]) = number(FINITE), if list;
    }
}

impl Default for Axis {
    fn default() -> Self {
        Self::Coordinate(AxisWord::Z)
    }
}

impl Axis {
    /// A vector along the axis.
    pub fn vector(self) -> [f64; 3] {
        match self {
            Self::Coordinate(word) => {
                let mut vector = [0.0; 3];
                vector[word.index()] = 1.0;
                vector
            }
            Self::Vector(vector) => vector,
        }
    }
}

/// An axis must have a length.
pub(super) fn check_axis(axis: Axis, section: &Section<'_>) {
    if length(axis.vector()) == 0.0 {
        let message = format!("`{}.axis` has no length", section.path());
        section.wrong("axis", message, "\"x\", \"y\", \"z\", or a vector that is not zero");
    }
}

/// Length of a vector.
pub(super) fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}
