//! Values that stand in order: ends of intervals, corners of boxes, depths that grow.
//!
//! Values that are missing or faulty are NaN: nothing is said of them.

use crate::config::section::Section;
use crate::config::text::tree::join;

/// Two opposite corners of a box [m].
pub(super) type Corners = [[f64; 3]; 2];

/// An example for messages.
pub(super) const CORNERS: &str = "[[\"0 mm\", \"0 mm\", \"0 mm\"], [\"10 mm\", \"10 mm\", \"10 mm\"]]";

/// The two corners of a box, where they span a volume.
pub(super) fn box_with_volume(section: &Section<'_>, key: &str, corners: Corners) -> Option<Corners> {
    let [lower, upper] = corners;
    if (0..3).any(|axis| lower[axis] >= upper[axis]) {
        let message = format!("`{}` has no volume", join(section.path(), key));
        section.wrong(key, message, "the lower corner first, below the upper corner in x, y and z");
        return None;
    }
    is_known(&corners).then_some(corners)
}

/// The two corners of a box that may be flat.
pub(super) fn flat_box(section: &Section<'_>, key: &str, corners: Corners) -> Option<Corners> {
    let [lower, upper] = corners;
    if (0..3).any(|axis| lower[axis] > upper[axis]) {
        let message = format!("`{}` is turned over", join(section.path(), key));
        section.wrong(key, message, "the lower corner first, nowhere above the upper corner");
        return None;
    }
    is_known(&corners).then_some(corners)
}

fn is_known(corners: &Corners) -> bool {
    corners.as_flattened().iter().all(|coordinate| coordinate.is_finite())
}

/// The lower end of an interval comes first.
pub(super) fn check_interval(section: &Section<'_>, key: &str, [lower, upper]: [f64; 2]) {
    if lower >= upper {
        let message = format!("`{}` runs from {lower} m to {upper} m", join(section.path(), key));
        section.wrong(key, message, "the lower end first, below the upper end");
    }
}

/// Depths of layers, each below the one before.
pub(super) fn check_layers(section: &Section<'_>, key: &str, depths: &[f64]) {
    if let Some(k) = (1..depths.len()).find(|&k| depths[k - 1] >= depths[k]) {
        section.wrong(
            &format!("{key}[{k}]"),
            format!("`{}.{key}` goes from {} m to {} m", section.path(), depths[k - 1], depths[k]),
            "depths that grow from one to the next",
        );
    }
}

/// A box, or a part of an axis, lies within the whole one.
pub(super) fn check_within(section: &Section<'_>, key: &str, [lower, upper]: Corners, whole: Corners) {
    let [least, most] = whole;
    // Room for rounding of decimal lengths.
    let outside = (0..3).find(|&d| {
        let room = 1e-9 * (most[d] - least[d]);
        lower[d] < least[d] - room || upper[d] > most[d] + room
    });
    if let Some(d) = outside {
        let axis = ["x", "y", "z"][d];
        section.wrong(
            key,
            format!("`{}.{key}` runs from {axis} = {} m to {} m", section.path(), lower[d], upper[d]),
            format!("within `mesh.boxes.box`, which goes from {axis} = {} m to {} m", least[d], most[d]),
        );
    }
}
