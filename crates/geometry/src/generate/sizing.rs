//! Lines along one axis from size limits: cells no larger than asked for where it is asked, growing in between.
//!
//! A limit says "between these coordinates no cell is larger than `size`". Away from it cells may grow by a constant
//! ratio `g`: at distance `d` from the limit the local size is `h(d) = ln g (g size/(g − 1) + d)`, whose cells
//! `∫ dx/h = 1` are exactly `g size, g² size, …`. The local size anywhere is the smallest that any limit allows, and
//! between two breakpoints it has at most three pieces (growing, level, shrinking), which are integrated exactly.
//! All lengths in metres. `generate::grading` makes lines from explicit layers instead.

use crate::error::MeshError;
use crate::generate::grading::{self, LINES_LIMIT};

/// The largest cell between two coordinates of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeLimit {
    /// First and last coordinate [m]; equal for a limit at one place.
    pub interval: [f64; 2],
    /// Largest cell there [m]; infinity merely lays a line at both ends.
    pub size: f64,
}

/// Lines of an axis that respect size limits; both ends of the axis and of every limit are lines, bit for bit.
///
/// `growth` is the ratio of neighbouring cells away from the limits, above 1. The number of cells between two
/// breakpoints is rounded up, but for a twentieth of a cell, so that decimal sizes divide as one expects.
///
/// # Errors
/// [`MeshError::Parameter`] with the name `parameter` if the axis is empty, a limit leaves it or is not positive, the
/// growth is not above 1, or more lines are needed than [`LINES_LIMIT`].
pub fn lines(
    parameter: &'static str,
    axis: [f64; 2],
    limits: &[SizeLimit],
    growth: f64,
) -> Result<Vec<f64>, MeshError> {
    let [start, end] = axis;
    if !(start < end && start.is_finite() && end.is_finite()) {
        let expected = "an axis must have a finite positive length";
        return Err(MeshError::parameter(parameter, format!("[{start}, {end}]"), expected));
    }
    if !(growth > 1.0 && growth.is_finite()) {
        return Err(MeshError::parameter(parameter, growth, "cells must grow by a finite ratio above 1"));
    }
    // Breakpoints closer than this are one: decimal lengths differ in their last bits.
    let tolerance = 1e-9 * (end - start);
    for SizeLimit { interval: [low, high], size } in limits {
        if !(low <= high && *low >= start - tolerance && *high <= end + tolerance) {
            let expected = format!("lower end first, within the mesh, which goes from {start} m to {end} m");
            return Err(MeshError::parameter(parameter, format!("[{low}, {high}] m"), expected));
        }
        if size.is_nan() || *size <= 0.0 {
            return Err(MeshError::parameter(parameter, format!("{size} m"), "a mesh size must be positive"));
        }
    }
    let mut breakpoints = vec![start, end];
    breakpoints.extend(limits.iter().flat_map(|limit| limit.interval));
    let breakpoints = grading::merge(&breakpoints, tolerance);

    let mut lines = vec![start];
    for pair in breakpoints.windows(2) {
        let profile = Profile::between([pair[0], pair[1]], limits, growth, tolerance);
        let cells = (profile.cells() - 0.05).ceil().max(1.0);
        if cells + lines.len() as f64 > LINES_LIMIT as f64 {
            let value = format!("{cells} cells between {} m and {} m", pair[0], pair[1]);
            let expected =
                format!("at most {LINES_LIMIT} mesh lines along one axis are made; use larger sizes");
            return Err(MeshError::parameter(parameter, value, expected));
        }
        let parts = cells as usize;
        lines.extend((1..parts).map(|i| pair[0] + profile.distance(i as f64 / cells)));
        lines.push(pair[1]);
    }
    Ok(lines)
}

/// Local size between two neighbouring breakpoints: `min(level, left + k x, right + k (length − x))`.
struct Profile {
    length: f64,
    /// Logarithm of the growth ratio.
    slope: f64,
    level: f64,
    left: f64,
    right: f64,
    /// Ends of the growing and of the level piece [m].
    kinks: [f64; 2],
}

impl Profile {
    fn between([a, b]: [f64; 2], limits: &[SizeLimit], growth: f64, tolerance: f64) -> Self {
        let (length, slope) = (b - a, growth.ln());
        let [mut level, mut left, mut right] = [f64::INFINITY; 3];
        for SizeLimit { interval: [low, high], size } in limits {
            let first = slope * growth * size / (growth - 1.0);
            if *low <= a + tolerance && *high >= b - tolerance {
                level = level.min(*size);
            } else if *high <= a + tolerance {
                left = left.min(first + slope * (a - high).max(0.0));
            } else {
                right = right.min(first + slope * (low - b).max(0.0));
            }
        }
        // Where the growing piece meets the level one, or the shrinking one if that comes first.
        let meeting = if left.is_finite() && right.is_finite() {
            0.5 * (length + (right - left) / slope)
        } else if left.is_finite() {
            length
        } else {
            0.0
        };
        let meeting = meeting.clamp(0.0, length);
        let up = if left.is_finite() { ((level - left) / slope).clamp(0.0, meeting) } else { 0.0 };
        let down = if right.is_finite() {
            (length - (level - right) / slope).clamp(meeting, length)
        } else {
            length
        };
        Self { length, slope, level, left, right, kinks: [up, down] }
    }

    /// `∫ dx/h` over the three pieces; zero where nothing limits the size.
    fn pieces(&self) -> [f64; 3] {
        let [up, down] = self.kinks;
        let grow = |first: f64, run: f64| {
            if run > 0.0 && first.is_finite() { (self.slope * run / first).ln_1p() / self.slope } else { 0.0 }
        };
        let level = if down > up && self.level.is_finite() { (down - up) / self.level } else { 0.0 };
        [grow(self.left, up), level, grow(self.right, self.length - down)]
    }

    fn cells(&self) -> f64 {
        self.pieces().iter().sum()
    }

    /// How far from the lower end a fraction of all cells reaches [m].
    fn distance(&self, fraction: f64) -> f64 {
        let [up, down] = self.kinks;
        let [growing, level, shrinking] = self.pieces();
        let wanted = fraction * (growing + level + shrinking);
        let reach = |first: f64, cells: f64| first * (self.slope * cells).exp_m1() / self.slope;
        if wanted < growing {
            reach(self.left, wanted)
        } else if wanted < growing + level {
            up + (wanted - growing) * self.level
        } else {
            (self.length - reach(self.right, growing + level + shrinking - wanted)).max(down)
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const NAME: &str = "test.size";

    fn limit(low: f64, high: f64, size: f64) -> SizeLimit {
        SizeLimit { interval: [low, high], size }
    }

    #[test]
    fn a_level_size_divides_evenly_and_no_limit_makes_one_cell() {
        let made = lines(NAME, [0.0, 1.0], &[limit(0.0, 1.0, 0.25)], 2.0).expect("fits");
        assert_eq!(made, [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!(lines(NAME, [0.0, 1.0], &[], 2.0).expect("fits"), [0.0, 1.0]);
        let breakpoint = [limit(0.3, 0.3, f64::INFINITY)];
        assert_eq!(lines(NAME, [0.0, 1.0], &breakpoint, 2.0).expect("fits"), [0.0, 0.3, 1.0]);
    }

    #[test]
    fn cells_grow_by_the_ratio_from_the_limit_on_either_side() {
        // 2 + 4 + 8 on both sides of a cell of 1.
        let made = lines(NAME, [-14.0, 15.0], &[limit(0.0, 1.0, 1.0)], 2.0).expect("fits");
        let expected = [-14.0, -6.0, -2.0, 0.0, 1.0, 3.0, 7.0, 15.0];
        assert_eq!(made.len(), expected.len());
        for (found, expected) in made.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{made:?}");
        }
    }

    #[test]
    fn two_fine_places_meet_with_the_largest_cells_between_them() {
        let limits = [limit(0.0, 0.0, 0.1), limit(10.0, 10.0, 0.1)];
        let made = lines(NAME, [0.0, 10.0], &limits, 1.5).expect("fits");
        let cells: Vec<f64> = made.windows(2).map(|w| w[1] - w[0]).collect();
        let largest = cells.iter().copied().fold(0.0, f64::max);
        assert!(cells[0] < 0.2 && cells[cells.len() - 1] < 0.2 && largest > 1.0, "{cells:?}");
        for (first, last) in cells.iter().zip(cells.iter().rev()) {
            assert!((first - last).abs() < 1e-12, "symmetric: {cells:?}");
        }
    }

    #[test]
    fn what_cannot_be_divided_is_refused_by_name() {
        let cases = [
            lines(NAME, [1.0, 1.0], &[], 2.0),
            lines(NAME, [0.0, f64::NAN], &[], 2.0),
            lines(NAME, [0.0, 1.0], &[], 1.0),
            lines(NAME, [0.0, 1.0], &[], f64::NAN),
            lines(NAME, [0.0, 1.0], &[limit(0.5, 1.5, 0.1)], 2.0),
            lines(NAME, [0.0, 1.0], &[limit(0.5, 0.4, 0.1)], 2.0),
            lines(NAME, [0.0, 1.0], &[limit(f64::NAN, 0.4, 0.1)], 2.0),
            lines(NAME, [0.0, 1.0], &[limit(0.0, 1.0, 0.0)], 2.0),
            lines(NAME, [0.0, 1.0], &[limit(0.0, 1.0, f64::NAN)], 2.0),
            lines(NAME, [0.0, 1.0], &[limit(0.0, 1.0, 1e-9)], 2.0),
        ];
        for case in cases {
            assert!(matches!(case, Err(MeshError::Parameter { parameter: NAME, .. })), "{case:?}");
        }
    }

    proptest! {
        #[test]
        fn any_limits_give_ascending_lines_within_their_sizes(
            places in prop::collection::vec((0.0..1.0f64, 0.0..1.0f64, 0.01..0.5f64), 0..5),
            growth in 1.1..3.0f64,
        ) {
            let limits: Vec<SizeLimit> =
                places.iter().map(|&(a, b, size)| limit(a.min(b), a.max(b), size)).collect();
            let made = lines(NAME, [0.0, 1.0], &limits, growth).expect("fits");
            prop_assert!(made.windows(2).all(|w| w[0] < w[1]), "{made:?}");
            prop_assert_eq!((made[0], made[made.len() - 1]), (0.0, 1.0));
            for w in made.windows(2) {
                for SizeLimit { interval: [low, high], size } in &limits {
                    let inside = *low <= w[0] + 1e-9 && *high >= w[1] - 1e-9;
                    // A twentieth of a cell is let go: one cell instead of 1.05.
                    prop_assert!(!inside || w[1] - w[0] <= 1.051 * size, "{made:?} {limits:?}");
                }
            }
        }
    }
}
