//! Coordinate lines along one axis: uniform, growing outwards, and at given distances from the ends (skins).
//!
//! Every function returns the lines of an interval in ascending order, both ends included bit for bit, so that the
//! lines of neighbouring intervals join without a gap. Lengths in metres. `parameter` is the name that an error shows.

use crate::error::MeshError;

/// More lines than this along one axis are taken for a mistake in a size.
pub const LINES_LIMIT: usize = 1_000_000;

/// The interval in equal parts, as many as come nearest to parts of `size` [m], at least one.
///
/// # Errors
/// [`MeshError::Parameter`] if the interval is empty or the size is not positive or asks for too many lines.
pub fn uniform(parameter: &'static str, interval: [f64; 2], size: f64) -> Result<Vec<f64>, MeshError> {
    check_interval(parameter, interval)?;
    check_size(parameter, size)?;
    let parts = ((interval[1] - interval[0]) / size).round().max(1.0);
    if parts > LINES_LIMIT as f64 {
        return Err(too_many(parameter, size));
    }
    Ok(equal_parts(interval, parts as usize))
}

/// The interval in `parts` equal parts; the caller vouches for `parts ≥ 1` and an ascending interval.
pub(crate) fn equal_parts([start, end]: [f64; 2], parts: usize) -> Vec<f64> {
    let mut lines: Vec<f64> = (0..parts).map(|i| start + (end - start) * (i as f64 / parts as f64)).collect();
    lines.push(end);
    lines
}

/// Which end of an interval is the fine one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fine {
    /// Cells grow from the start to the end.
    Start,
    /// Cells grow from the end to the start.
    End,
}

/// How cells grow outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// Size of the first cell [m].
    pub first: f64,
    /// Ratio of neighbouring cells, at least 1.
    pub ratio: f64,
    /// No cell is larger than this [m]; infinity for no limit.
    pub largest: f64,
}

/// Cells that grow by a ratio from the fine end to the other, through given ascending breakpoints.
///
/// Between two breakpoints the number of cells is the one whose sum comes nearest to the interval; all are then
/// stretched by one factor to end on it exactly, and the next interval goes on where growth had come to.
///
/// # Errors
/// [`MeshError::Parameter`] as for [`uniform`], and for a ratio below 1.
pub fn growing(
    parameter: &'static str,
    breakpoints: &[f64],
    fine: Fine,
    growth: Growth,
) -> Result<Vec<f64>, MeshError> {
    check_size(parameter, growth.first)?;
    if !(growth.ratio >= 1.0 && growth.ratio.is_finite()) {
        let expected = "cells must grow by a finite ratio of at least 1";
        return Err(MeshError::parameter(parameter, growth.ratio, expected));
    }
    if growth.largest.is_nan() || growth.largest <= 0.0 {
        return Err(not_positive(parameter, growth.largest));
    }
    let outwards: Vec<f64> = match fine {
        Fine::Start => breakpoints.to_vec(),
        Fine::End => breakpoints.iter().rev().map(|c| -c).collect(),
    };
    let mut lines: Vec<f64> = outwards.first().copied().into_iter().collect();
    let mut cell = growth.first.min(growth.largest);
    for pair in outwards.windows(2) {
        check_interval(parameter, [pair[0], pair[1]])?;
        let length = pair[1] - pair[0];
        let mut ends = Vec::new();
        let mut reached = 0.0;
        // The cell that would leave less than half of itself inside is not begun.
        while ends.is_empty() || length - reached > 0.5 * cell {
            if lines.len() + ends.len() > LINES_LIMIT {
                return Err(too_many(parameter, growth.first));
            }
            reached += cell;
            ends.push(reached);
            cell = (cell * growth.ratio).min(growth.largest);
        }
        ends.pop();
        lines.extend(ends.iter().map(|s| pair[0] + length * (s / reached)));
        lines.push(pair[1]);
    }
    if fine == Fine::End {
        lines = lines.iter().rev().map(|c| -c).collect();
    }
    Ok(lines)
}

/// Where the lines of a skin lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Skin {
    /// At the given distances from the end of the interval.
    AtEnd,
    /// At the given distances from both ends.
    AtBothEnds,
}

/// Lines at given ascending distances [m] from the end or from both ends of an interval; nothing else is added.
///
/// A line in the very middle, given from both ends, is one line.
///
/// # Errors
/// [`MeshError::Parameter`] if the distances are not positive and ascending or do not fit into the interval.
pub fn skin(
    parameter: &'static str,
    interval: [f64; 2],
    skin: Skin,
    distances: &[f64],
) -> Result<Vec<f64>, MeshError> {
    check_interval(parameter, interval)?;
    let [start, end] = interval;
    let room = match skin {
        Skin::AtEnd => end - start,
        Skin::AtBothEnds => 0.5 * (end - start),
    };
    // Room for rounding of decimal lengths: 5 mm is half of 10 mm.
    let tolerance = 1e-9 * (end - start);
    let meets = |d: f64| skin == Skin::AtBothEnds && (d - room).abs() <= tolerance;
    let ascending = distances.windows(2).all(|pair| pair[0] < pair[1]);
    let fits = distances.iter().all(|&d| d > tolerance && (d < room - tolerance || meets(d)));
    if !ascending || !fits {
        let expected = format!(
            "distances of mesh lines from a face must be positive and ascending, the last at most {room} m deep; \
             leave lines out or order them"
        );
        return Err(MeshError::parameter(parameter, format!("{distances:?}"), expected));
    }
    let mut lines = vec![start];
    if skin == Skin::AtBothEnds {
        lines.extend(distances.iter().filter(|&&d| !meets(d)).map(|d| start + d));
        lines.extend(distances.iter().filter(|&&d| meets(d)).map(|_| start + room));
    }
    lines.extend(distances.iter().rev().filter(|&&d| !meets(d)).map(|d| end - d));
    lines.push(end);
    Ok(lines)
}

/// Every interval between neighbouring lines in `parts` equal parts.
pub fn subdivide(lines: &[f64], parts: usize) -> Vec<f64> {
    let mut refined: Vec<f64> = lines
        .windows(2)
        .flat_map(|pair| {
            let mut fine = equal_parts([pair[0], pair[1]], parts.max(1));
            fine.pop();
            fine
        })
        .collect();
    refined.extend(lines.last());
    refined
}

/// Sorted lines without doubles: of lines closer than `tolerance` [m] the one given first stays.
pub fn merge(lines: &[f64], tolerance: f64) -> Vec<f64> {
    let mut order: Vec<usize> = (0..lines.len()).collect();
    order.sort_by(|&a, &b| lines[a].total_cmp(&lines[b]));
    order
        .chunk_by(|&a, &b| lines[b] - lines[a] <= tolerance)
        .filter_map(|close| close.iter().min().map(|&first| lines[first]))
        .collect()
}

fn check_interval(parameter: &'static str, [start, end]: [f64; 2]) -> Result<(), MeshError> {
    if start < end && start.is_finite() && end.is_finite() {
        return Ok(());
    }
    let expected = "an interval must have a finite positive length";
    Err(MeshError::parameter(parameter, format!("[{start}, {end}]"), expected))
}

fn check_size(parameter: &'static str, size: f64) -> Result<(), MeshError> {
    if size > 0.0 && size.is_finite() { Ok(()) } else { Err(not_positive(parameter, size)) }
}

fn not_positive(parameter: &'static str, size: f64) -> MeshError {
    MeshError::parameter(parameter, size, "a mesh size must be positive and finite")
}

fn too_many(parameter: &'static str, size: f64) -> MeshError {
    let expected =
        format!("this size needs more than {LINES_LIMIT} mesh lines along one axis; make it larger");
    MeshError::parameter(parameter, size, expected)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAME: &str = "test.size";

    #[test]
    fn uniform_lines_come_nearest_to_the_size_and_keep_the_ends() {
        assert_eq!(uniform(NAME, [0.0, 1.0], 0.26).expect("fits"), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!(uniform(NAME, [0.1, 0.3], 5.0).expect("fits"), [0.1, 0.3]);
    }

    #[test]
    fn growing_cells_keep_their_ratio_and_end_exactly() {
        let growth = Growth { first: 0.02, ratio: 1.6, largest: f64::INFINITY };
        let lines = growing(NAME, &[0.16, 0.6], Fine::Start, growth).expect("fits");
        assert_eq!((lines[0], lines[lines.len() - 1]), (0.16, 0.6));
        for w in lines.windows(3) {
            assert!(((w[2] - w[1]) / (w[1] - w[0]) - 1.6).abs() < 1e-9);
        }
        let back = growing(NAME, &[-0.6, -0.16], Fine::End, growth).expect("fits");
        for (a, b) in lines.iter().zip(back.iter().rev()) {
            assert!((a + b).abs() < 1e-15, "the same cells, mirrored");
        }
    }

    #[test]
    fn growth_stops_at_the_largest_size() {
        let growth = Growth { first: 1.0, ratio: 2.0, largest: 3.0 };
        let lines = growing(NAME, &[0.0, 12.0], Fine::Start, growth).expect("fits");
        assert_eq!(lines, [0.0, 1.0, 3.0, 6.0, 9.0, 12.0]);
        let lines = growing(NAME, &[0.0, 1.0, 3.0, 6.0], Fine::Start, growth).expect("fits");
        assert_eq!(lines, [0.0, 1.0, 3.0, 6.0], "growth goes on through breakpoints");
    }

    #[test]
    fn skin_lines_lie_at_their_distances_and_meet_once_in_the_middle() {
        let lines = skin(NAME, [-4.0, 4.0], Skin::AtBothEnds, &[0.5, 4.0]).expect("fits");
        assert_eq!(lines, [-4.0, -3.5, 0.0, 3.5, 4.0]);
        let lines = skin(NAME, [0.0, 8.0], Skin::AtEnd, &[0.5, 4.0]).expect("fits");
        assert_eq!(lines, [0.0, 4.0, 7.5, 8.0]);
        assert_eq!(subdivide(&[0.0, 1.0, 3.0], 2), [0.0, 0.5, 1.0, 2.0, 3.0]);
        assert_eq!(merge(&[2.0, 1.0, 1.0 + 1e-12], 1e-9), [1.0, 2.0]);
    }

    #[test]
    fn what_cannot_be_divided_is_refused_by_name() {
        let growth = |first, ratio| Growth { first, ratio, largest: f64::INFINITY };
        let cases = [
            uniform(NAME, [1.0, 1.0], 0.1),
            uniform(NAME, [0.0, f64::NAN], 0.1),
            uniform(NAME, [0.0, 1.0], 0.0),
            uniform(NAME, [0.0, 1.0], 1e-12),
            growing(NAME, &[0.0, 1.0], Fine::Start, growth(-1.0, 2.0)),
            growing(NAME, &[0.0, 1.0], Fine::Start, growth(0.1, 0.9)),
            growing(NAME, &[0.0, 1.0], Fine::Start, growth(1e-12, 1.0)),
            growing(NAME, &[0.0, 1.0], Fine::Start, growth(0.1, f64::NAN)),
            skin(NAME, [0.0, 1.0], Skin::AtBothEnds, &[0.3, 0.2]),
            skin(NAME, [0.0, 1.0], Skin::AtBothEnds, &[0.6]),
            skin(NAME, [0.0, 1.0], Skin::AtEnd, &[1.0]),
            skin(NAME, [0.0, 1.0], Skin::AtEnd, &[f64::NAN]),
        ];
        for case in cases {
            assert!(matches!(case, Err(MeshError::Parameter { parameter: NAME, .. })), "{case:?}");
        }
    }
}
