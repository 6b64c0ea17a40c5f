//! Nodal functions of a coarse grid ("hats") beside the aggregates of linear nodal elements: what the coarse space has for long waves
//! around iron.
//!
//! Outside of iron a field `A = ∇χ` with harmonic χ has neither curl nor divergence; its energy is what the iron has of it. Of a wave
//! number `k` [1/m] that is about `1/μr` of `k² ‖A‖²`, the energy of any other field as smooth. Linear elements on cells of size `h`
//! raise it to `max(1/μr, (k h)²)` of that. What functions of a coarse space that are nearest to it have in energy beside is all of
//! `k² ‖A‖²` for piecewise constants, and `(k H)²` of it for continuous functions of width `H`. So the condition is up to `1/(k h)²` with
//! aggregates alone, worst for the longest waves, and `(H/h)²` with hats.
//!
//! The axes of the grid are those of the coordinates or, where the surface of the iron lies askew to them, of its normals: hats that
//! reach across a plate do little. Its lines are quantiles of the nodes' coordinates, so that it is fine where the mesh is. Their
//! numbers are as the roots of those of layers of elements across the axes: as many across each are 56 iterations in place of 48 on a
//! strip of 92 000 unknowns in a box 13 times as long as wide, and as many as there are layers 72 in place of 64 on a plate that is
//! askew. Cells are cut into six tetrahedra, on which hats are linear (H. Freudenthal, Ann. of Math. 43 (1942) 580): four a node.

use fluxmorph_geometry::directions::Frame;
use fluxmorph_geometry::fem::{CsrMatrix, DofMap};
use fluxmorph_geometry::tet4::{Point, dot, norm};
use fluxmorph_geometry::{CarrierId, NodeId, eigen_decomposition};

use super::aggregation::Aggregates;

/// The largest reluctivity over the smallest from which hats pay. On a plate of 51 000 and 210 000 unknowns factor, state and adjoint
/// take 1.19 and 1.13 of the time with aggregates alone at 3, 0.98 and 1.02 at 10, 0.76 and 0.67 at 100.
pub(crate) const RELUCTIVITY_CONTRAST: f64 = 10.0;

/// Unknowns from which hats pay: an optimisation of a plate of 18 000 takes 1.05 of the time with aggregates alone, one of 36 000 0.86.
pub(crate) const UNKNOWNS: usize = 25_000;

/// Vertices of the grid over the square root of the nodes of the mesh, at most. With as many for each node the coarse factor would be
/// most of the work on fine meshes; with as many on every mesh iterations would grow as without hats.
const VERTICES_PER_ROOT_NODE: f64 = 8.0;

/// Nodes for each vertex of the grid, at least: on small meshes, too, the coarse level is to be a small one.
const NODES_PER_VERTEX: f64 = 15.0;

/// What diagonal entries of hats are multiplied by: the hats of a component sum to one, as its aggregates do, and the coarse matrix
/// would be singular but for rounding. From nothing to 1e-4 more the iterations do not change.
pub(crate) const DIAGONAL_FACTOR: f64 = 1.0 + 1e-5;

/// Share of all normals that is along other directions, up to which a surface lies along the axes.
const ALONG: f64 = 1e-3;

/// Share of all normals by which more are along one direction than along another, from which on a surface has directions.
const DIRECTED: f64 = 0.1;

/// Unknowns that a hat has at least: one of fewer is no smoother than an aggregate.
const LEAST_UNKNOWNS: u32 = 4;

/// Lines closer than this share of the length of the mesh are one: the rounding of coordinates.
const SAME: f64 = 1e-9;

/// No column.
const NONE: u32 = u32::MAX;

/// The nodes of the mesh, the axes of the grid and those of the components of `A` at nodes that have others than the coordinates'.
pub(crate) struct Nodes<'a, F> {
    pub(crate) points: &'a [Point],
    pub(crate) elements: &'a [[NodeId; 4]],
    pub(crate) axes: [Point; 3],
    pub(crate) frame: F,
}

/// The prolongation from aggregates of some rows, ascending, and for every component of `A` from hats; shape `(rows, n_coarse)`,
/// aggregates first.
///
/// The hats of a component sum to one, as its aggregates do, unless one has too few unknowns and is left out: the columns depend on
/// each other. Which are left out does not depend on the rows.
pub(crate) fn prolongation<'f>(
    dofs: &DofMap<4>,
    nodes: &Nodes<'_, impl Fn(CarrierId) -> Option<&'f Frame>>,
    (rows, aggregates): (&[u32], &Aggregates),
) -> CsrMatrix<f64> {
    let grid = Grid::new(nodes);
    let corners: Vec<[(usize, f64); 4]> = nodes.points.iter().map(|&point| grid.corners(point)).collect();
    // Hat and weight, of ψ none; in a frame of its own a component has a share of those of all coordinates.
    let hats = |(node, c): (CarrierId, usize)| {
        let axis = (nodes.frame)(node).map_or(Frame::COORDINATES.axes, |frame| frame.axes).get(c).copied();
        let own = axis.into_iter().flat_map(move |axis| (0..3).map(move |d| (d, axis[d])));
        let corners = &corners[node.index()];
        own.flat_map(move |(d, share)| corners.iter().map(move |corner| (3 * corner.0 + d, share * corner.1)))
            .filter(|hat| hat.1 != 0.0)
    };
    let mut unknowns = vec![0; 3 * grid.vertex_count()];
    let places: Vec<_> = dofs.places().collect();
    places.iter().flat_map(|&place| hats(place)).for_each(|hat| unknowns[hat.0] += 1);
    let mut count = aggregates.count as u32;
    let number = |unknowns: u32| {
        let column = if unknowns >= LEAST_UNKNOWNS { count } else { NONE };
        count += u32::from(column != NONE);
        column
    };
    let columns: Vec<u32> = unknowns.into_iter().map(number).collect();
    let row = |(&row, &aggregate): (&u32, &u32)| {
        let mut entries = vec![(aggregate as usize, 1.0)];
        entries.extend(hats(places[row as usize]).map(|(hat, weight)| (columns[hat] as usize, weight)));
        entries.retain(|entry| entry.0 != NONE as usize);
        entries
    };
    CsrMatrix::from_rows(count as usize, rows.iter().zip(&aggregates.of_row).map(row))
}

/// The axes along which the normals of a surface lie, of the area vectors [m²] of its triangles: the eigenvectors of the sum of `n nᵀ`.
/// Of a surface along the axes of the coordinates, and of one that has as much in all directions, these.
pub(crate) fn axes(areas: impl Iterator<Item = Point>) -> [Point; 3] {
    let mut normals = [[0.0; 3]; 3];
    for area in areas {
        let length = norm(area).max(f64::MIN_POSITIVE);
        for i in 0..3 {
            for j in 0..3 {
                normals[i][j] += area[i] / length * area[j];
            }
        }
    }
    let [x, y, z]: [Point; 3] = normals;
    let all = x[0] + y[1] + z[2];
    let (values, axes) = eigen_decomposition(normals);
    let [least, most] = [values.into_iter().fold(all, f64::min), values.into_iter().fold(0.0, f64::max)];
    let is_along = x[1].abs() + x[2].abs() + y[2].abs() <= ALONG * all;
    if is_along || most - least <= DIRECTED * all { Frame::COORDINATES.axes } else { axes }
}

/// Lines across the axes, where a coordinate along one of them is so much [m].
struct Grid {
    axes: [Point; 3],
    lines: [Vec<f64>; 3],
}

impl Grid {
    fn new<F>(nodes: &Nodes<'_, F>) -> Self {
        let Nodes { points, axes, .. } = *nodes;
        let sorted = axes.map(|axis| {
            let mut values: Vec<f64> = points.iter().map(|&point| dot(axis, point)).collect();
            values.sort_unstable_by(f64::total_cmp);
            values
        });
        let distinct = sorted.each_ref().map(|values| merged(values).len());
        let layers = layers(nodes, &sorted);
        let weights = layers.map(f64::sqrt);
        // The axis that its coordinates or its layers leave the fewest lines for its weight is the first: the others have its share.
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| {
            let room = |axis: usize| (distinct[axis] as f64).min(layers[axis] + 1.0) / weights[axis];
            room(a).total_cmp(&room(b))
        });
        let mut lines = [const { Vec::new() }; 3];
        let count = points.len() as f64;
        let mut vertices = (VERTICES_PER_ROOT_NODE * count.sqrt()).min(count / NODES_PER_VERTEX);
        let mut cells: f64 = weights.iter().product();
        for (axis, left) in order.into_iter().zip([3.0, 2.0, 1.0]) {
            let values = &sorted[axis];
            let share = weights[axis] * (vertices / cells).powf(1.0 / left);
            let count = (share.round() as usize).clamp(2, distinct[axis].max(2));
            let quantile = |k: usize| values[k * (values.len() - 1) / (count - 1)];
            lines[axis] = merged(&(0..count).map(quantile).collect::<Vec<_>>());
            vertices /= lines[axis].len() as f64;
            cells /= weights[axis];
        }
        Self { axes, lines }
    }

    fn vertex_count(&self) -> usize {
        self.lines.iter().map(Vec::len).product()
    }

    /// The vertices of the tetrahedron around a point, and their barycentric coordinates there.
    fn corners(&self, point: Point) -> [(usize, f64); 4] {
        let (mut vertex, mut stride) = (0, 1);
        let mut steps = [(0.0, 0); 3];
        for (axis, lines) in self.lines.iter().enumerate() {
            let along = dot(self.axes[axis], point);
            // A mesh with a volume has two lines; where the last ones are merged, a node may lie a rounding beyond.
            let cell = lines.partition_point(|&line| line <= along).min(lines.len() - 1).max(1) - 1;
            let share = ((along - lines[cell]) / (lines[cell + 1] - lines[cell])).clamp(0.0, 1.0);
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

/// How many layers of elements there are across each axis, about: the nodes from one end to the other over the mean number of them along
/// an element, of coordinates sorted along the axes.
fn layers<F>(nodes: &Nodes<'_, F>, sorted: &[Vec<f64>; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| {
        let before = |along: f64| sorted[axis].partition_point(|&value| value < along) as f64;
        let places: Vec<f64> =
            nodes.points.iter().map(|&point| before(dot(nodes.axes[axis], point))).collect();
        let widths = nodes.elements.iter().map(|element| {
            let own = element.map(|node| places[node.index()]);
            own.into_iter().fold(0.0, f64::max) - own.into_iter().fold(f64::INFINITY, f64::min)
        });
        let all = places.iter().copied().fold(0.0, f64::max);
        nodes.elements.len() as f64 * all / widths.sum::<f64>()
    })
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
    use crate::unknowns::PSI;

    const COORDINATES: [Point; 3] = Frame::COORDINATES.axes;

    /// With the directions of the coordinates alone.
    fn straight<'a>(
        points: &'a [Point],
        elements: &'a [[NodeId; 4]],
    ) -> Nodes<'a, fn(CarrierId) -> Option<&'static Frame>> {
        Nodes { points, elements, axes: COORDINATES, frame: |_| None }
    }

    /// The element at the first corner of each cell of a lattice of so many nodes.
    fn corners_of_cells([nx, ny, nz]: [usize; 3]) -> Vec<[NodeId; 4]> {
        let is_first = |n: &usize| n % nx + 1 < nx && n / nx % ny + 1 < ny;
        let corners = |n: usize| [n, n + 1, n + nx, n + nx * ny].map(NodeId::new);
        (0..nx * ny * (nz - 1)).filter(is_first).map(corners).collect()
    }

    /// The points of a lattice of so many nodes, a unit apart.
    fn units([nx, ny, nz]: [usize; 3]) -> Vec<Point> {
        (0..nx * ny * nz).map(|n| [(n % nx) as f64, (n / nx % ny) as f64, (n / (nx * ny)) as f64]).collect()
    }

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
        let elements = corners_of_cells([12, 10, 9]);
        let grid = Grid::new(&straight(&points, &elements));
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
        let all: Vec<u32> = (0..dofs.count() as u32).collect();
        let p = prolongation(&dofs, &straight(&points, &elements), (&all, &aggregates));
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

    /// A field that is linear in space, in the components of nodes with directions of their own.
    #[test]
    fn hats_are_turned_where_components_are() {
        let (dofs, points) = lattice();
        let (sin, cos) = 0.3_f64.sin_cos();
        let turned = Frame { axes: [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]] };
        let frame = |node: CarrierId| node.index().is_multiple_of(3).then_some(&turned);
        let aggregates = Aggregates { count: 1, of_row: vec![0; dofs.count()] };
        let all: Vec<u32> = (0..dofs.count() as u32).collect();
        let elements = corners_of_cells([12, 10, 9]);
        let nodes = Nodes { points: &points, elements: &elements, axes: COORDINATES, frame };
        let p = prolongation(&dofs, &nodes, (&all, &aggregates));
        // The coarse function with all hats of x is the field (1, 0, 0); none is left out in the middle of the lattice.
        let node = 5 + 12 * 5 + 120 * 3;
        let sum_at = |node: usize, c: usize| {
            let row = p.structure.row(dofs.equation(CarrierId::new(node), c).expect("it has one"));
            p.values[row.start + 1..row.end].iter().sum::<f64>()
        };
        for node in [node, node + 1, node + 2] {
            for c in 0..3 {
                let axes = frame(CarrierId::new(node)).unwrap_or(&Frame::COORDINATES).axes;
                let expected: f64 = axes[c].iter().sum();
                assert!((sum_at(node, c) - expected).abs() < 1e-12, "component {c} of node {node}");
            }
        }
    }

    #[test]
    fn lines_are_where_there_are_layers_and_coordinates_for_them() {
        // 800/15 vertices, two planes of five by five, and 2000/15: with as many along each axis five by five by five.
        for (nodes, lines) in [([20, 20, 2], [5, 5, 2]), ([80, 5, 5], [15, 3, 3])] {
            let grid = Grid::new(&straight(&units(nodes), &corners_of_cells(nodes)));
            assert_eq!(grid.lines.each_ref().map(Vec::len), lines);
        }
    }

    #[test]
    fn the_axes_are_those_of_a_surface_that_is_askew() {
        let (sin, cos) = 0.4_f64.sin_cos();
        let turned = |x: Point| [cos * x[0] - sin * x[2], x[1], sin * x[0] + cos * x[2]];
        let block = [[3.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 1.0]];
        let found = axes(block.into_iter().map(turned));
        for axis in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(turned) {
            assert!(found.iter().any(|own| (dot(*own, axis).abs() - 1.0).abs() < 1e-12), "{found:?}");
        }
        assert_eq!(axes(block.into_iter()), COORDINATES);
        assert_eq!(axes([].into_iter()), COORDINATES);
    }
}
