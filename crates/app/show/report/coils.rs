//! Where a plane cuts the coils that are given by their shape: rectangles, for coils along a coordinate axis.
//!
//! Coils that lie askew, and rounded corners, are not drawn: an outline helps to find one's way, and nothing is computed
//! from it.

use fluxmorph_geometry::tet4::Point;

use super::cut::CutPlane;
use crate::config::{Axis, Coil, CoilShape};

/// A rectangle in a plane, by two opposite corners [m].
pub(super) type Section = [Point; 2];

/// Half sizes of a coil about its centre: `inner` of the window, across the axis; `width` and `height` of the winding.
struct Winding {
    center: Point,
    axis: usize,
    inner: [f64; 2],
    width: f64,
    height: f64,
    is_round: bool,
}

/// The rectangles in which a plane cuts a coil.
pub(super) fn sections(coil: &Coil, plane: CutPlane) -> Vec<Section> {
    let Some(winding) = winding(coil) else { return Vec::new() };
    if plane.axis == winding.axis {
        return Vec::new();
    }
    // Across the axis: along the plane's normal, and in the plane.
    let normal = plane.axis;
    let along = 3 - winding.axis - normal;
    let first = (winding.axis + 1) % 3;
    let [inner_normal, inner_along] =
        if normal == first { winding.inner } else { [winding.inner[1], winding.inner[0]] };
    let distance = (plane.at - winding.center[normal]).abs();
    let [inner, outer] = if winding.is_round {
        let chord = |radius: f64| (radius * radius - distance * distance).max(0.0).sqrt();
        [chord(inner_normal), chord(inner_normal + winding.width)]
    } else if distance < inner_normal {
        [inner_along, inner_along + winding.width]
    } else if distance < inner_normal + winding.width {
        [0.0, inner_along + winding.width]
    } else {
        [0.0, 0.0]
    };
    if outer <= inner {
        return Vec::new();
    }
    let rectangle = |low: f64, high: f64| {
        let corner = |offset: f64, up: f64| {
            let mut corner = winding.center;
            corner[normal] = plane.at;
            corner[along] += offset;
            corner[winding.axis] += up * 0.5 * winding.height;
            corner
        };
        [corner(low, -1.0), corner(high, 1.0)]
    };
    if inner == 0.0 {
        return vec![rectangle(-outer, outer)];
    }
    vec![rectangle(-outer, -inner), rectangle(inner, outer)]
}

/// Lower and upper corner around a coil [m].
pub(super) fn extent(coil: &Coil) -> Option<[Point; 2]> {
    let winding = winding(coil)?;
    let (a, b) = ((winding.axis + 1) % 3, (winding.axis + 2) % 3);
    let mut half = [0.0; 3];
    half[a] = winding.inner[0] + winding.width;
    half[b] = winding.inner[1] + winding.width;
    half[winding.axis] = 0.5 * winding.height;
    Some([-1.0, 1.0].map(|sign| std::array::from_fn(|d| winding.center[d] + sign * half[d])))
}

fn winding(coil: &Coil) -> Option<Winding> {
    let of = |center, axis: Axis, inner, width, height, is_round| {
        let vector = axis.vector();
        let axis = (0..3).find(|&d| (0..3).all(|e| e == d || vector[e] == 0.0))?;
        Some(Winding { center, axis, inner, width, height, is_round })
    };
    match &coil.shape {
        CoilShape::Racetrack(c) if c.direction.is_none() => {
            of(c.center, c.axis, c.half_window, c.width, c.height, false)
        }
        CoilShape::Circular(c) => of(c.center, c.axis, [c.radius; 2], c.width, c.height, true),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{AxisWord, Circular, Corner, CornerWord, Racetrack};

    fn coil(shape: CoilShape) -> Coil {
        Coil {
            name: "coil".to_owned(),
            ampere_turns: Some(1.0),
            phase: 0.0,
            shape,
            turns: None,
            voltage: None,
            resistance: None,
            series_inductance: None,
            series_capacitance: None,
        }
    }

    #[test]
    fn a_racetrack_is_cut_in_two_legs_or_along_one() {
        let racetrack = Racetrack {
            center: [0.0, 0.0, 0.06],
            axis: Axis::Coordinate(AxisWord::Z),
            direction: None,
            half_window: [0.06, 0.16],
            width: 0.02,
            height: 0.04,
            corner: Corner::Sharp(CornerWord::Mitred),
        };
        let coil = coil(CoilShape::Racetrack(racetrack));
        let at = |axis, at| sections(&coil, CutPlane { axis, at });
        let legs = at(0, 0.03);
        assert_eq!(legs.len(), 2);
        // The lower end is 0.06 - 0.02, which is 0.04 but for rounding.
        let low = 0.06 - 0.02;
        assert_eq!(legs[1], [[0.03, 0.16, low], [0.03, 0.18, 0.08]]);
        assert_eq!(at(1, 0.0)[1], [[0.06, 0.0, low], [0.08, 0.0, 0.08]]);
        assert_eq!(at(0, 0.07), [[[0.07, -0.18, low], [0.07, 0.18, 0.08]]]);
        assert!(at(0, 0.09).is_empty() && at(2, 0.06).is_empty());
        assert_eq!(extent(&coil), Some([[-0.08, -0.18, low], [0.08, 0.18, 0.08]]));
    }

    #[test]
    fn a_circle_is_cut_by_its_chords() {
        let circle = Circular {
            center: [0.0; 3],
            axis: Axis::Coordinate(AxisWord::X),
            radius: 0.03,
            width: 0.02,
            height: 0.01,
        };
        let found = sections(&coil(CoilShape::Circular(circle)), CutPlane { axis: 2, at: 0.03 });
        // The chord of the outer circle at this distance: √(5² − 3²) = 4.
        assert_eq!(found.len(), 1);
        assert!((found[0][1][1] - 0.04).abs() < 1e-15 && (found[0][0][0] + 0.005).abs() < 1e-15);
    }
}
