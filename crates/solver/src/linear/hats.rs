//! Hat functions on a grid, beside the aggregates of linear nodal elements: what the coarse space has for long waves.
//!
//! Around iron, fields `A = ∇χ` whose χ is harmonic outside of it have no energy but what the iron has of them, `1/μr` of that of
//! other fields as smooth; of linear elements they have `(k h)²` of it, for waves of number `k` in cells `h`, where that is more.
//! Piecewise constants have all of it for any of these fields. With aggregates alone the condition therefore grows as `1/h²` up to
//! `μr`, longest waves first. Continuous functions a few cells wide have `(k H)²` of it, and the condition stays at `(H/h)²`.
//!
//! The grid is one along the axes. Its lines are quantiles of the coordinates of the nodes, so that it is fine where the mesh is;
//! its cells are cut into six tetrahedra, on which hats are linear: four a node (Kuhn's triangulation).

use std::iter;

use fluxmorph_geometry::CarrierId;
use fluxmorph_geometry::fem::{CsrMatrix, DofMap};
use fluxmorph_geometry::parallel::Aggregates;
use fluxmorph_geometry::tet4::Point;

use crate::unknowns::PSI;

/// The largest reluctivity over the smallest from which hats pay. On a plate of 51 000 and 210 000 unknowns factor, state and adjoint
/// take 1.19 and 1.13 of what they take with aggregates alone at 3, .98 and 1.02 at 10, .76 and .67 at 100.
pub(crate) const CONTRAST: f64 = 10.0;

/// Vertices of the grid, of the square root of the nodes of the mesh: between as many for each node, of which the coarse factor would
/// be most of the work on fine meshes, and as many on all meshes, with which iterations would grow as without hats.
const VERTICES: f64 = 8.0;

/// Nodes for each vertex, at least.
const NODES: f64 = 15.0;

/// Unknowns that a hat has at least.
const LEAST_UNKNOWNS: usize = 4;

/// Lines closer than this share of the length of the mesh are one.
const SAME: f64 = 1e-9;

/// The prolongation from aggregates and hats; shape `(dofs.count(), n_coarse)`, aggregates first.
///
/// All hats together are one everywhere, as all aggregates are: the columns depend on each other.
pub(crate) fn prolongation(dofs: &DofMap<4>, points: &[Point], aggregates: &Aggregates) -> CsrMatrix<f64> {
    let grid = Grid::new(points, vertices(points));
    let mut hats = vec![Vec::new(); dofs.count()];
    let mut unknowns = vec![0; PSI * grid.vertex_count()];
    for node in (0..dofs.carrier_count()).map(CarrierId::new) {
        let corners = grid.corners(points[node.index()]);
        for c in 0..PSI {
            if let Some(equation) = dofs.equation(node, c) {
                let own = corners.iter().filter(|corner| corner.1 > 0.0);
                hats[equation] =
                    own.map(|&(vertex, weight)| (c * grid.vertex_count() + vertex, weight)).collect();
                hats[equation].iter().for_each(|hat: &(usize, f64)| unknowns[hat.0] += 1);
            }
        }
    }
    let mut count = aggregates.count;
    let number = |unknowns: usize| {
        let is_column = unknowns >= LEAST_UNKNOWNS;
        count += usize::from(is_column);
        is_column.then(|| count - 1)
    };
    let columns: Vec<Option<usize>> = unknowns.into_iter().map(number).collect();
    let rows = hats.iter().zip(&aggregates.of_row).map(|(own, &aggregate)| {
        let own = own.iter().filter_map(|&(hat, weight)| Some((columns[hat]?, weight)));
        iter::once((aggregate as usize, 1.0)).chain(own).collect()
    });
    let rows: Vec<Vec<(usize, f64)>> = rows.collect();
    CsrMatrix::from_rows(count, rows)
}

/// How many vertices a grid has, about.
fn vertices(points: &[Point]) -> f64 {
    let nodes = points.len() as f64;
    (VERTICES * nodes.sqrt()).min(nodes / NODES)
}

/// Lines along the axes.
struct Grid {
    lines: [Vec<f64>; 3],
}

impl Grid {
    /// A grid of about so many vertices.
    fn new(points: &[Point], mut vertices: f64) -> Self {
        let sorted = [0, 1, 2].map(|axis| {
            let mut values: Vec<f64> = points.iter().map(|point| point[axis]).collect();
            values.sort_unstable_by(f64::total_cmp);
            values
        });
        let distinct = sorted.each_ref().map(|values| merged(values).len());
        let mut axes = [0, 1, 2];
        axes.sort_by_key(|&axis| distinct[axis]);
        let mut lines = [const { Vec::new() }; 3];
        // An axis with few distinct coordinates leaves its share to the others.
        for (axis, left) in axes.into_iter().zip([3.0, 2.0, 1.0]) {
            let values = &sorted[axis];
            let count = (vertices.powf(1.0 / left).round() as usize).clamp(2, distinct[axis].max(2));
            let quantile = |k: usize| values[k * (values.len() - 1) / (count - 1)];
            lines[axis] = merged(&(0..count).map(quantile).collect::<Vec<_>>());
            vertices /= lines[axis].len() as f64;
        }
        Self { lines }
    }

    fn vertex_count(&self) -> usize {
        self.lines.iter().map(Vec::len).product()
    }

    /// The vertices of the tetrahedron around a point, and their barycentric coordinates there.
    fn corners(&self, point: Point) -> [(usize, f64); 4] {
        let (mut vertex, mut stride) = (0, 1);
        let mut steps = [(0.0, 0); 3];
        for (axis, lines) in self.lines.iter().enumerate() {
            let cell = lines.partition_point(|&line| line <= point[axis]).clamp(1, lines.len() - 1) - 1;
            let share = (point[axis] - lines[cell]) / (lines[cell + 1] - lines[cell]);
            steps[axis] = (share, stride);
            vertex += cell * stride;
            stride *= lines.len();
        }
        // From one corner of the cell to the opposite one, along the axis with the largest share first.
        steps.sort_by(|a, b| b.0.total_cmp(&a.0));
        let [(first, along), (second, then), (third, last)] = steps;
        [
            (vertex, 1.0 - first),
            (vertex + along, first - second),
            (vertex + along + then, second - third),
            (vertex + along + then + last, third),
        ]
    }
}

/// Ascending values without those that hardly differ from the one before.
fn merged(values: &[f64]) -> Vec<f64> {
    let length = values[values.len() - 1] - values[0];
    let mut merged = values.to_vec();
    merged.dedup_by(|next, first| *next - *first <= SAME * length);
    merged
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nodes of a lattice that is finer on one side, each with all components but for some of ψ.
    fn lattice() -> (DofMap<4>, Vec<Point>) {
        let along = |i: usize| (0.25 * i as f64).exp();
        let points: Vec<Point> =
            (0..12 * 10 * 9).map(|n| [along(n % 12), along(n / 12 % 10), (n / 120) as f64]).collect();
        (DofMap::of_nodes(points.len(), |node, c| c < PSI || node.index() % 7 == 0), points)
    }

    #[test]
    fn hats_reproduce_linear_functions_and_aggregates_stay() {
        let (dofs, points) = lattice();
        let grid = Grid::new(&points, vertices(&points));
        let plane = |p: Point| 3.0 - 2.0 * p[0] + 0.5 * p[1] + 7.0 * p[2];
        let lines = &grid.lines;
        let at = |vertex: usize| {
            let [nx, ny] = [lines[0].len(), lines[1].len()];
            [lines[0][vertex % nx], lines[1][vertex / nx % ny], lines[2][vertex / (nx * ny)]]
        };
        for &point in &points {
            let corners = grid.corners(point);
            assert!(corners.iter().all(|corner| corner.1 >= 0.0));
            let sum: f64 = corners.iter().map(|&(vertex, weight)| weight * plane(at(vertex))).sum();
            assert!((sum - plane(point)).abs() < 1e-12 * plane(point).abs().max(1.0), "{sum} at {point:?}");
        }
        let of_row: Vec<u32> = (0..dofs.count() as u32).map(|row| row / 5).collect();
        let aggregates = Aggregates { count: of_row[of_row.len() - 1] as usize + 1, of_row };
        let p = prolongation(&dofs, &points, &aggregates);
        for (row, &aggregate) in aggregates.of_row.iter().enumerate() {
            let own = p.structure.row(row);
            assert_eq!((p.structure.columns[own.start], p.values[own.start]), (aggregate, 1.0));
            assert!(
                p.structure.columns[own.start + 1..own.end].iter().all(|&c| c as usize >= aggregates.count)
            );
        }
        let psi = dofs.equation(CarrierId::new(7), PSI).expect("it has one");
        assert_eq!(p.structure.row(psi).len(), 1);
    }

    #[test]
    fn an_axis_with_few_coordinates_leaves_its_lines_to_the_others() {
        let points: Vec<Point> =
            (0..20 * 20 * 2).map(|n| [(n % 20) as f64, (n / 20 % 20) as f64, (n / 400) as f64]).collect();
        let grid = Grid::new(&points, 98.0);
        assert_eq!(grid.lines.each_ref().map(Vec::len), [7, 7, 2]);
    }
}
