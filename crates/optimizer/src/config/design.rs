//! `[design]`: which surface moves, and how far.

use serde::Serialize;

use super::Dimension;
use super::range::Range;
use super::section::Section;

/// The design variables: displacements of a surface along one direction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Design {
    /// Name of the surface whose nodes move.
    pub surface: String,
    /// Direction of a positive displacement, of length 1.
    pub direction: [f64; 3],
    /// Points of the control grid along the two coordinates of the surface, bilinear in between. Default
    /// `None`: every node of the surface is a variable.
    pub grid: Option<[usize; 2]>,
    /// Least displacement [m].
    pub lower: f64,
    /// Greatest displacement [m].
    pub upper: f64,
    /// Displacement that the optimisation starts from [m]. Default 0: the mesh as it is.
    pub initial: f64,
}

impl Design {
    pub(super) fn read(section: Section<'_>) -> Self {
        let surface = section.text("surface");
        let direction = read_direction(&section);
        let grid = section.integers("grid", 2, 300);
        let length = |key| section.quantity(key, Dimension::Length, Range::FINITE);
        let (lower, upper, initial) = (length("lower"), length("upper"), length("initial"));

        if let (Some(lower), Some(upper)) = (lower, upper) {
            check_bounds(&section, lower, upper, initial);
        }
        let design = Self {
            surface: section.need("surface", surface, "\"plate_bottom\""),
            direction: section.need("direction", direction, "[0.0, 0.0, -1.0]"),
            grid,
            lower: section.need("lower", lower, "\"-5 mm\""),
            upper: section.need("upper", upper, "\"20 mm\""),
            initial: initial.unwrap_or(0.0),
        };
        section.finish();
        design
    }
}

fn check_bounds(section: &Section<'_>, lower: f64, upper: f64, initial: Option<f64>) {
    if lower >= upper {
        section.wrong(
            "upper",
            format!("the bounds cross: design.lower is {lower} m, design.upper is {upper} m"),
            format!("design.upper above {lower} m"),
        );
        return;
    }
    let start = initial.unwrap_or(0.0);
    if (lower..=upper).contains(&start) {
        return;
    }
    let expected = format!("from {lower} m to {upper} m");
    match initial {
        Some(initial) => {
            section.wrong(
                "initial",
                format!("design.initial is {initial} m, outside of the bounds"),
                expected,
            );
        }
        None => section.wrong(
            if lower > 0.0 { "lower" } else { "upper" },
            "the bounds leave out 0 m, where the design starts",
            format!("bounds around 0 m, or design.initial {expected}"),
        ),
    }
}

/// The vector `direction` of a table, scaled to length one.
pub(super) fn read_direction(section: &Section<'_>) -> Option<[f64; 3]> {
    let vector = section.numbers::<3>("direction", Range::closed(-1e100, 1e100))?;
    let largest = vector.iter().fold(0.0_f64, |largest, component| largest.max(component.abs()));
    if largest < 1e-100 {
        section.wrong(
            "direction",
            format!("{}.direction has no length", section.path()),
            "a vector that is not zero, such as [0.0, 0.0, -1.0]",
        );
        return None;
    }
    let scaled = vector.map(|component| component / largest);
    let length = largest * scaled.iter().map(|component| component * component).sum::<f64>().sqrt();
    // A vector of length 1 keeps its bits, so that a resolved configuration reads back as itself.
    if (length - 1.0).abs() < 4.0 * f64::EPSILON {
        return Some(vector);
    }
    Some(vector.map(|component| component / length))
}
