//! `[[coils]]`: sources given by their analytic shape.

use serde::Serialize;

use super::Dimension;
use super::choice::choice;
use super::range::Range;
use super::section::{Section, first_duplicate};

/// A coil with a uniform current density.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coil {
    /// Its name in messages and results.
    pub name: String,
    /// Its shape.
    pub shape: CoilShape,
    /// Current times turns, amplitude [A]; positive is counter-clockwise about the axis.
    pub ampere_turns: f64,
    /// Phase of the current [rad]. Default 0.
    pub phase: f64,
    /// Centre of the coil [m].
    pub center: [f64; 3],
    /// Axis of the winding. Default z.
    pub axis: Axis,
    /// Inner half sizes across the axis, in cyclic order of the coordinates [m].
    pub half_window: [f64; 2],
    /// Radial width of the winding [m].
    pub width: f64,
    /// Axial height of the winding [m].
    pub height: f64,
    /// How the straight sides meet. Default mitred: the rectangular coil of the paper.
    #[serde(flatten)]
    pub corner: Corner,
}

choice! {
    /// Shapes of coils.
    pub enum CoilShape {
        /// Four straight sides.
        Racetrack = "racetrack",
    }
}

choice! {
    /// A coordinate axis.
    pub enum Axis {
        /// x.
        X = "x",
        /// y.
        Y = "y",
        /// z.
        Z = "z",
    }
}

choice! {
    /// Words for `corner`.
    pub enum CornerWord {
        /// The current turns on the diagonal.
        Mitred = "mitred",
    }
}

/// How the sides of a racetrack meet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum Corner {
    /// Straight to the corner.
    #[serde(rename = "corner")]
    Sharp(CornerWord),
    /// Concentric arcs with this inner radius [m].
    #[serde(rename = "inner_radius")]
    Round(f64),
}

/// Read `[[coils]]`.
pub(super) fn read_coils(root: &Section<'_>) -> Vec<Coil> {
    let coils: Vec<_> = root.tables("coils").into_iter().map(Coil::read).collect();
    let names: Vec<_> = coils.iter().map(|coil| coil.name.clone()).filter(|name| !name.is_empty()).collect();
    if let Some(name) = first_duplicate(&names) {
        root.wrong("coils", format!("two coils are named `{name}`"), "a different name for each coil");
    }
    coils
}

impl Coil {
    fn read(section: Section<'_>) -> Self {
        let name = section.text("name");
        let shape = section.choice("shape");
        if section.text("region").is_some() {
            section.wrong(
                "region",
                format!("`{}.region`: coils made of a mesh region are not supported", section.path()),
                "shape = \"racetrack\" with its dimensions",
            );
        } else if shape.is_none() && !section.has("shape") {
            section.missing("shape", "shape = \"racetrack\"");
        }
        let ampere_turns = section.quantity("ampere_turns", Dimension::Current, Range::FINITE);
        if ampere_turns == Some(0.0) {
            let message = format!("`{}.ampere_turns` is 0 A: the coil makes no field", section.path());
            section.wrong("ampere_turns", message, "any current but 0 A");
        }
        let phase = section.quantity("phase", Dimension::Angle, Range::FINITE).unwrap_or(0.0);
        let center = section.lengths("center", Range::FINITE);
        let axis = section.choice("axis").unwrap_or(Axis::Z);
        let half_window = section.lengths("half_window", Range::POSITIVE);
        let width = section.quantity("width", Dimension::Length, Range::POSITIVE);
        let height = section.quantity("height", Dimension::Length, Range::POSITIVE);
        let corner = read_corner(&section, half_window);
        let coil = Self {
            name: section.need("name", name, "\"coil\""),
            shape: shape.unwrap_or(CoilShape::Racetrack),
            ampere_turns: section.need("ampere_turns", ampere_turns, "\"40 kA\""),
            phase,
            center: section.need("center", center, "[\"0 mm\", \"0 mm\", \"60 mm\"]"),
            axis,
            half_window: section.need("half_window", half_window, "[\"60 mm\", \"160 mm\"]"),
            width: section.need("width", width, "\"20 mm\""),
            height: section.need("height", height, "\"40 mm\""),
            corner,
        };
        section.finish();
        coil
    }
}

fn read_corner(section: &Section<'_>, half_window: Option<[f64; 2]>) -> Corner {
    let word = section.choice("corner");
    let radius = section.quantity("inner_radius", Dimension::Length, Range::POSITIVE);
    if section.has("corner") && section.has("inner_radius") {
        section.wrong(
            "inner_radius",
            format!("`{}` has both `corner` and `inner_radius`", section.path()),
            "one of them",
        );
    }
    if let (Some(radius), Some([a, b])) = (radius, half_window)
        && radius > a.min(b)
    {
        section.wrong(
            "inner_radius",
            format!("`{}.inner_radius` is {radius} m, more than a half size of the window", section.path()),
            format!("at most {} m", a.min(b)),
        );
    }
    match radius {
        Some(radius) => Corner::Round(radius),
        None => Corner::Sharp(word.unwrap_or(CornerWord::Mitred)),
    }
}
