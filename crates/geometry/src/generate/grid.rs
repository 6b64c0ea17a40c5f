//! A box of graded cells, each cut into six tetrahedra around the same space diagonal (Kuhn 1960).
//!
//! The six tetrahedra of a cell are the monotone paths from its lowest to its highest corner, one per order of the
//! axes. All cells are cut alike, so the diagonals of a face shared by two cells coincide and the mesh conforms.
//! Surfaces are found by line numbers, never by comparing coordinates.

use std::sync::Arc;

use super::grading;
use crate::error::MeshError;
use crate::ids::{ElementId, NodeId, RegionId};
use crate::mesh::Mesh;
use crate::tet4::Point;
use crate::topology::Topology;

/// More tetrahedra than this are refused before anything is allocated (a solve would need terabytes).
pub const TETS_LIMIT: u64 = 50_000_000;

/// Tetrahedra of one cell.
pub const TETS_PER_CELL: usize = 6;

/// The outer faces of a box: name, axis, and whether it is the upper one.
const OUTER_FACES: [(&str, usize, bool); 6] = [
    ("x_min", 0, false),
    ("x_max", 0, true),
    ("y_min", 1, false),
    ("y_max", 1, true),
    ("z_min", 2, false),
    ("z_max", 2, true),
];

/// Paths along the axes from the lowest to the highest corner; the first three are even permutations.
pub(super) const PATHS: [[usize; 3]; TETS_PER_CELL] =
    [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

/// A box in which the cells of a grid are divided along every axis: each new cell lies in one old one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Division {
    /// Lower and upper corner [m]; an interval between two lines is divided where its middle lies within.
    pub inside: [Point; 2],
    /// Parts of an interval, at least one.
    pub parts: usize,
}

impl Division {
    fn of(&self, axis: usize, lines: &[f64]) -> Vec<f64> {
        let [low, high] = self.inside.map(|corner| corner[axis]);
        let mut divided: Vec<f64> = lines.first().copied().into_iter().collect();
        for pair in lines.windows(2) {
            let middle = 0.5 * (pair[0] + pair[1]);
            let parts = if (low..=high).contains(&middle) { self.parts.max(1) } else { 1 };
            divided.extend(&grading::equal_parts([pair[0], pair[1]], parts)[1..]);
        }
        divided
    }
}

/// Three ascending sets of lines [m]; nodes are their crossings, `z` fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    lines: [Vec<f64>; 3],
}

impl Grid {
    /// A grid of lines along x, y and z.
    ///
    /// `parameter` is the name that an error shows.
    ///
    /// # Errors
    /// [`MeshError::Parameter`] if an axis has fewer than two lines, lines are not finite and ascending, or there would
    /// be more than [`TETS_LIMIT`] tetrahedra.
    pub fn new(parameter: &'static str, lines: [Vec<f64>; 3]) -> Result<Self, MeshError> {
        for (axis, line) in ["x", "y", "z"].iter().zip(&lines) {
            let ascending = line.windows(2).all(|pair| pair[0] < pair[1]);
            if line.len() < 2 || !ascending || line.iter().any(|c| !c.is_finite()) {
                let value = format!("{} lines along {axis}", line.len());
                let expected =
                    "at least two finite, strictly ascending mesh lines are needed along every axis";
                return Err(MeshError::parameter(parameter, value, expected));
            }
        }
        let cells = [0, 1, 2].map(|d| lines[d].len() - 1);
        check_size(parameter, cells)?;
        Ok(Self { lines })
    }

    /// The same with a part of its cells divided.
    ///
    /// # Errors
    /// As [`Grid::new`].
    pub fn divided(self, parameter: &'static str, division: Option<&Division>) -> Result<Self, MeshError> {
        let Some(division) = division else { return Ok(self) };
        let [x, y, z] = self.lines;
        Self::new(parameter, [division.of(0, &x), division.of(1, &y), division.of(2, &z)])
    }

    /// Lines along one axis [m], ascending.
    pub fn lines(&self, axis: usize) -> &[f64] {
        &self.lines[axis]
    }

    /// Number of cells along each axis.
    pub fn cells(&self) -> [usize; 3] {
        [0, 1, 2].map(|d| self.lines[d].len() - 1)
    }

    /// Number of tetrahedra.
    pub fn tet_count(&self) -> usize {
        TETS_PER_CELL * self.cells().iter().product::<usize>()
    }

    /// The line nearest to a coordinate [m], by number.
    pub fn nearest_line(&self, axis: usize, coordinate: f64) -> usize {
        let lines = &self.lines[axis];
        let above = lines.partition_point(|&c| c < coordinate);
        match above {
            0 => 0,
            i if i == lines.len() => i - 1,
            i if coordinate - lines[i - 1] < lines[i] - coordinate => i - 1,
            i => i,
        }
    }

    /// The node where three lines cross.
    #[inline]
    pub fn node(&self, [i, j, k]: [usize; 3]) -> NodeId {
        NodeId::new((i * self.lines[1].len() + j) * self.lines[2].len() + k)
    }

    /// The lines that cross in a node.
    #[inline]
    pub fn lines_of(&self, node: NodeId) -> [usize; 3] {
        let (row, k) = (node.index() / self.lines[2].len(), node.index() % self.lines[2].len());
        [row / self.lines[1].len(), row % self.lines[1].len(), k]
    }

    /// The six elements of a cell.
    pub fn elements_of_cell(&self, [i, j, k]: [usize; 3]) -> impl Iterator<Item = ElementId> + use<> {
        let [_, ny, nz] = self.cells();
        let first = TETS_PER_CELL * ((i * ny + j) * nz + k);
        (first..first + TETS_PER_CELL).map(ElementId::new)
    }

    /// The elements of all cells within a box of lines, given by its first and last line along each axis.
    pub fn elements_within(&self, lines: [[usize; 2]; 3]) -> Vec<ElementId> {
        let [x, y, z] = lines.map(|[first, last]| first..last);
        let mut elements = Vec::new();
        for i in x {
            for j in y.clone() {
                elements.extend(z.clone().flat_map(|k| self.elements_of_cell([i, j, k])));
            }
        }
        elements
    }

    /// Coordinates of all nodes [m], shape `(n_nodes, 3)`.
    pub fn points(&self) -> Vec<Point> {
        let [x, y, z] = &self.lines;
        let mut points = Vec::with_capacity(x.len() * y.len() * z.len());
        for &x in x {
            for &y in y {
                points.extend(z.iter().map(|&z| [x, y, z]));
            }
        }
        points
    }

    /// Connectivity, with the six outer faces as surfaces `x_min` … `z_max`, their triangles oriented outwards.
    ///
    /// `paint` yields the region of a cell from its centre [m]; it indexes `region_names`.
    ///
    /// # Errors
    /// Those of [`Topology::new`], which a grid does not provoke.
    ///
    /// # Panics
    /// If `paint` yields a region without a name.
    pub fn topology(
        &self,
        region_names: &[&str],
        paint: impl Fn(Point) -> RegionId,
    ) -> Result<Topology, MeshError> {
        let [nx, ny, nz] = self.cells();
        let mut tets = Vec::with_capacity(self.tet_count());
        let mut region_of = Vec::with_capacity(self.tet_count());
        for i in 0..nx {
            for j in 0..ny {
                for k in 0..nz {
                    let cell = [i, j, k];
                    let centre =
                        [0, 1, 2].map(|d| 0.5 * (self.lines[d][cell[d]] + self.lines[d][cell[d] + 1]));
                    tets.extend(self.tets_of_cell(cell));
                    region_of.extend([paint(centre); TETS_PER_CELL]);
                }
            }
        }
        let nodes = self.lines.iter().map(Vec::len).product();
        let names = region_names.iter().map(|&name| name.to_owned()).collect();
        let mut topology = Topology::new(nodes, tets, names, region_of)?;
        for (name, axis, upper) in OUTER_FACES {
            let line = if upper { self.cells()[axis] } else { 0 };
            let outer = topology.outer_facets().map(|facet| facet.nodes);
            let triangles = outer.filter(|nodes| self.on_line(*nodes, axis, line)).collect();
            topology = topology.with_surface(name, triangles)?;
        }
        Ok(topology)
    }

    /// The mesh with this connectivity and these coordinates.
    ///
    /// # Errors
    /// As [`Grid::topology`] and [`Mesh::new`].
    pub fn mesh(&self, region_names: &[&str], paint: impl Fn(Point) -> RegionId) -> Result<Mesh, MeshError> {
        Mesh::new(Arc::new(self.topology(region_names, paint)?), self.points())
    }

    /// Triangles of a region's boundary that lie on one line of an axis (a plane), oriented out of the region.
    pub fn region_surface(
        &self,
        topology: &Topology,
        region: RegionId,
        axis: usize,
        line: usize,
    ) -> Vec<[NodeId; 3]> {
        let region_at = |e: ElementId| topology.region_of()[e.index()];
        topology
            .facets()
            .iter()
            .filter(|f| self.on_line(f.nodes, axis, line))
            .filter_map(|f| {
                let [a, b, c] = f.nodes;
                match (region_at(f.inside) == region, f.outside.map(region_at) == Some(region)) {
                    (true, false) => Some([a, b, c]),
                    (false, true) => Some([a, c, b]),
                    _ => None,
                }
            })
            .collect()
    }

    fn on_line(&self, nodes: [NodeId; 3], axis: usize, line: usize) -> bool {
        nodes.iter().all(|&n| self.lines_of(n)[axis] == line)
    }

    fn tets_of_cell(&self, lowest: [usize; 3]) -> [[NodeId; 4]; TETS_PER_CELL] {
        let mut tets = [[NodeId(0); 4]; TETS_PER_CELL];
        for (p, path) in PATHS.iter().enumerate() {
            let mut corner = lowest;
            tets[p][0] = self.node(corner);
            for (step, &axis) in path.iter().enumerate() {
                corner[axis] += 1;
                tets[p][step + 1] = self.node(corner);
            }
            if p >= 3 {
                tets[p].swap(1, 2); // odd permutations are left-handed
            }
        }
        tets
    }
}

/// Refuses a grid of too many cells; nothing has been allocated for it yet.
///
/// # Errors
/// [`MeshError::Parameter`].
pub(crate) fn check_size(parameter: &'static str, cells: [usize; 3]) -> Result<(), MeshError> {
    check_tets(parameter, cells, [&format!("{cells:?} cells"), "larger cells"])
}

/// The same in the words of a generator: what asks for so many cells, and what to use instead.
///
/// # Errors
/// [`MeshError::Parameter`].
pub(super) fn check_tets(
    parameter: &'static str,
    cells: [usize; 3],
    [value, instead]: [&str; 2],
) -> Result<(), MeshError> {
    let tets = cells.iter().fold(TETS_PER_CELL as u64, |n, &c| n.saturating_mul(c as u64));
    if tets <= TETS_LIMIT {
        return Ok(());
    }
    let expected = format!("at most {TETS_LIMIT} tetrahedra are made; use {instead}");
    Err(MeshError::parameter(parameter, format!("{value}, {tets} tetrahedra"), expected))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::tet4;

    fn area(mesh: &Mesh, triangles: &[[NodeId; 3]]) -> Point {
        let mut sum = [0.0; 3];
        for t in triangles {
            let a = tet4::area_vector(t.map(|n| mesh.point(n)));
            sum = [sum[0] + a[0], sum[1] + a[1], sum[2] + a[2]];
        }
        sum
    }

    fn lines() -> impl Strategy<Value = Vec<f64>> {
        (-2.0..2.0f64, prop::collection::vec(0.01..3.0f64, 1..6)).prop_map(|(start, steps)| {
            let mut lines = vec![start];
            for step in steps {
                lines.push(lines[lines.len() - 1] + step);
            }
            lines
        })
    }

    proptest! {
        #[test]
        fn any_grid_fills_its_box_and_closes_its_surface(x in lines(), y in lines(), z in lines()) {
            let size = [&x, &y, &z].map(|l| l[l.len() - 1] - l[0]);
            let grid = Grid::new("grid", [x, y, z]).expect("ascending lines");
            let mesh = grid.mesh(&["all"], |_| RegionId(0)).expect("a grid conforms");
            let volume: f64 = mesh.topology().elements().map(|e| tet4::volume(mesh.vertices(e))).sum();
            let box_volume: f64 = size.iter().product();
            prop_assert!((volume / box_volume - 1.0).abs() < 1e-12);
            let mut triangles = 0;
            for (name, axis, upper) in OUTER_FACES {
                let surface = mesh.topology().surface(name).expect("every grid has it");
                triangles += surface.len();
                let mut expected = [0.0; 3];
                expected[axis] = if upper { 1.0 } else { -1.0 } * box_volume / size[axis];
                let found = area(&mesh, surface);
                for d in 0..3 {
                    prop_assert!((found[d] - expected[d]).abs() < 1e-11 * box_volume / size[axis]);
                }
            }
            // A T-junction would leave outside faces in the interior.
            prop_assert_eq!(triangles, mesh.topology().facets().len());
        }
    }

    #[test]
    fn nodes_and_lines_are_each_others_inverse() {
        let grid =
            Grid::new("grid", [vec![0.0, 1.0], vec![0.0, 1.0, 2.0], vec![0.0, 0.5, 1.0, 4.0]]).expect("grid");
        assert_eq!((grid.cells(), grid.tet_count()), ([1, 2, 3], 36));
        for (n, point) in grid.points().iter().enumerate() {
            let lines = grid.lines_of(NodeId::new(n));
            assert_eq!(grid.node(lines), NodeId::new(n));
            assert_eq!([0, 1, 2].map(|d| grid.lines(d)[lines[d]]), *point);
        }
        assert_eq!([-1.0, 0.2, 0.3, 2.0, 9.0].map(|c| grid.nearest_line(2, c)), [0, 0, 1, 2, 3]);
    }

    #[test]
    fn the_surface_of_a_region_points_out_of_it_from_either_side() {
        let grid = Grid::new("grid", [vec![0.0, 1.0], vec![0.0, 2.0], vec![0.0, 1.0, 2.0]]).expect("grid");
        let mesh = grid.mesh(&["low", "high"], |c| RegionId(u32::from(c[2] > 1.0))).expect("a grid conforms");
        let low = grid.region_surface(mesh.topology(), RegionId(0), 2, 1);
        let high = grid.region_surface(mesh.topology(), RegionId(1), 2, 1);
        assert_eq!((area(&mesh, &low), area(&mesh, &high)), ([0.0, 0.0, 2.0], [0.0, 0.0, -2.0]));
    }

    #[test]
    fn lines_that_make_no_grid_are_refused() {
        let good = || vec![0.0, 1.0];
        for bad in
            [vec![], vec![0.0], vec![1.0, 0.0], vec![0.0, 0.0], vec![0.0, f64::NAN], vec![0.0, f64::INFINITY]]
        {
            let result = Grid::new("grid", [good(), bad, good()]);
            assert!(matches!(result, Err(MeshError::Parameter { parameter: "grid", .. })), "{result:?}");
        }
        assert!(check_size("grid", [usize::MAX; 3]).is_err());
        assert!(check_size("grid", [200, 200, 200]).is_ok());
    }
}
