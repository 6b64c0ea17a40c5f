//! A control grid over the surface's bounding rectangle, bilinear in between.
//!
//! The grid lies in the two coordinates across the axis that the nodes' directions follow most, in ascending order. Lives here:
//! cells, weights and the grid's points. Does not live here: what a row of weights is used for.

use fluxmorph_geometry::box_tree::BoxTree;
use fluxmorph_geometry::tet4::Point;

use super::symmetry::Groups;
use super::{DesignError, Row, axis_name};

/// How far from the control grid's rectangle, in grid cells, a node may lie through rounding.
const GRID_TOLERANCE: f64 = 1e-9;

/// Least component of a unit direction across the grid: a grid says nothing of a surface that it sees edge-on, and little
/// of one that stands more upright than this, about 87 degrees.
const STEEPEST: f64 = 0.05;

/// The axis along which a vector is longest; the first of equals.
pub fn dominant_axis(vector: Point) -> usize {
    (0..3).fold(0, |best, d| if vector[d].abs() > vector[best].abs() { d } else { best })
}

/// One side of a control grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridSide {
    /// The coordinate along which its points lie.
    pub axis: usize,
    /// Number of points.
    pub count: usize,
    /// From the first to the last [m].
    pub extent: f64,
}

impl GridSide {
    /// `x`, `y` or `z`.
    pub fn axis_name(&self) -> char {
        axis_name(self.axis)
    }

    /// From one point to the next [m].
    pub fn spacing(&self) -> f64 {
        self.extent / (self.count - 1) as f64
    }
}

/// A control grid with the variables of its points.
#[derive(Clone, Debug)]
pub(super) struct ControlGrid {
    pub(super) grid: Grid,
    pub(super) groups: Groups,
}

impl ControlGrid {
    /// What the variables `p` [m] describe at a place [m].
    pub(super) fn height(&self, place: Point, p: &[f64]) -> f64 {
        self.grid.row(place).into_iter().map(|(k, weight)| weight * p[self.groups.variable(k)]).sum()
    }
}

/// A regular grid over two coordinates.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    along: usize,
    /// The two coordinates, the slow one first.
    across: [usize; 2],
    counts: [usize; 2],
    /// Least and greatest coordinate of the surface along both [m].
    limits: [(f64, f64); 2],
}

impl Grid {
    /// A grid over nodes at `places` that move in `directions`, both of shape `(n_nodes, 3)`.
    ///
    /// # Errors
    /// [`DesignError::NoExtent`], and [`DesignError::Folded`] where not all nodes move to the same side of the grid.
    pub(super) fn new(
        places: &[Point],
        directions: &[Point],
        counts: [usize; 2],
    ) -> Result<Self, DesignError> {
        let size =
            directions.iter().fold([0.0; 3], |sum: Point, d| std::array::from_fn(|i| sum[i] + d[i].abs()));
        let along = dominant_axis(size);
        let side = directions.iter().map(|d| d[along]).find(|&d| d != 0.0).map_or(1.0, f64::signum);
        let against = |d: &Point| *d != [0.0; 3] && d[along] * side < STEEPEST;
        if let Some(i) = directions.iter().position(against) {
            return Err(DesignError::Folded { point: places[i], axis: axis_name(along) });
        }
        let across = match along {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        };
        let limits = across.map(|d| {
            places
                .iter()
                .map(|x| x[d])
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        });
        for (axis, (low, high)) in across.into_iter().zip(limits) {
            if low >= high {
                return Err(DesignError::NoExtent { axis: axis_name(axis) });
            }
        }
        Ok(Self { along, across, counts, limits })
    }

    /// Both sides, the slow one in the order of the points first.
    pub(super) fn sides(&self) -> [GridSide; 2] {
        [0, 1].map(|side| {
            let (low, high) = self.limits[side];
            GridSide { axis: self.across[side], count: self.counts[side], extent: high - low }
        })
    }

    /// Weights of the grid's points at a place.
    pub(super) fn row(&self, x: Point) -> Row {
        let ([u, v], [_, m]) = (self.across, self.counts);
        let ((i, s), (j, t)) = (self.cell(x[u], 0), self.cell(x[v], 1));
        [
            (m * i + j, (1.0 - s) * (1.0 - t)),
            (m * i + j + 1, (1.0 - s) * t),
            (m * (i + 1) + j, s * (1.0 - t)),
            (m * (i + 1) + j + 1, s * t),
        ]
        .into_iter()
        .filter(|&(_, weight)| weight != 0.0)
        .collect()
    }

    /// Cell and local coordinate of a position along one grid direction.
    fn cell(&self, x: f64, side: usize) -> (usize, f64) {
        let ((low, high), count) = (self.limits[side], self.counts[side]);
        let position = (x - low) / (high - low) * (count - 1) as f64;
        let nearest = position.round();
        let position = if (position - nearest).abs() < GRID_TOLERANCE { nearest } else { position };
        let index = (position.floor() as usize).min(count - 2);
        (index, position - index as f64)
    }

    /// The grid's points [m]; across the grid they lie as high as the nearest node.
    pub(super) fn points(&self, places: &[Point]) -> Vec<Point> {
        let ([u, v], [n, m]) = (self.across, self.counts);
        let at = |k: usize, side: usize| {
            let (low, high) = self.limits[side];
            low + (high - low) * k as f64 / (self.counts[side] - 1) as f64
        };
        let flat = BoxTree::of_points(&self.flat(places));
        (0..n * m)
            .map(|k| {
                let mut seen = [0.0; 3];
                (seen[u], seen[v]) = (at(k / m, 0), at(k % m, 1));
                let nearest = flat.nearest(seen).map_or(0.0, |(i, _)| places[i][self.along]);
                seen[self.along] = nearest;
                seen
            })
            .collect()
    }

    /// Points as the grid sees them: without their height.
    pub(super) fn flat(&self, points: &[Point]) -> Vec<Point> {
        points
            .iter()
            .map(|&(mut point)| {
                point[self.along] = 0.0;
                point
            })
            .collect()
    }
}
