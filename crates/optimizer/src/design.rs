//! Design variables: `p` moves the nodes of the design surface along one direction.
//!
//! Either every node of the surface is a variable, or the variables sit on a control grid over the surface's bounding
//! rectangle and the nodes follow by bilinear interpolation. Both are the same sparse linear map `Δx_b = P p`; its
//! transpose takes the derivative at the nodes to the derivative with respect to `p`.

use std::collections::BTreeSet;

use fluxmorph_geometry::tet4::{Point, dot};
use fluxmorph_geometry::{Mesh, NodeId};

/// How far from the control grid's rectangle, in grid cells, a node may lie through rounding.
const GRID_TOLERANCE: f64 = 1e-9;

/// The linear map from design variables to displacements of the design surface's nodes.
#[derive(Clone, Debug)]
pub struct DesignSurface {
    nodes: Vec<NodeId>,
    direction: Point,
    /// Weights of the variables at every node, shape `(n_nodes, ≤ 4)`; they sum to one.
    weights: Vec<Vec<(usize, f64)>>,
    points: Vec<Point>,
}

impl DesignSurface {
    /// Variables on the nodes of `triangles`, moved along the unit vector `direction`.
    ///
    /// With `grid = [n, m]` (both at least 2) the variables sit on an `n × m` grid over the two coordinate directions
    /// across the dominant component of `direction`, in ascending order, the first slow and the second fast.
    ///
    /// # Panics
    /// If there is no triangle.
    pub fn new(mesh: &Mesh, triangles: &[[NodeId; 3]], direction: Point, grid: Option<[usize; 2]>) -> Self {
        let nodes: Vec<NodeId> =
            triangles.iter().flatten().copied().collect::<BTreeSet<_>>().into_iter().collect();
        assert!(!nodes.is_empty(), "a design surface has nodes");
        match grid {
            None => {
                let weights = (0..nodes.len()).map(|i| vec![(i, 1.0)]).collect();
                let points = nodes.iter().map(|&n| mesh.point(n)).collect();
                Self { nodes, direction, weights, points }
            }
            Some(grid) => Self::on_grid(mesh, nodes, direction, grid),
        }
    }

    fn on_grid(mesh: &Mesh, nodes: Vec<NodeId>, direction: Point, [n, m]: [usize; 2]) -> Self {
        let along =
            (0..3).fold(0, |best, d| if direction[d].abs() > direction[best].abs() { d } else { best });
        let across: Vec<usize> = (0..3).filter(|&d| d != along).collect();
        let (u, v) = (across[0], across[1]);
        let limits = |d: usize| {
            nodes
                .iter()
                .map(|&n| mesh.point(n)[d])
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        };
        let (limits_u, limits_v) = (limits(u), limits(v));
        // Cell and local coordinate of a position along one grid direction.
        let cell = |x: f64, (low, high): (f64, f64), count: usize| {
            let position = (x - low) / (high - low) * (count - 1) as f64;
            let nearest = position.round();
            let position = if (position - nearest).abs() < GRID_TOLERANCE { nearest } else { position };
            let index = (position.floor() as usize).min(count - 2);
            (index, position - index as f64)
        };
        let weights = nodes
            .iter()
            .map(|&node| {
                let x = mesh.point(node);
                let ((i, s), (j, t)) = (cell(x[u], limits_u, n), cell(x[v], limits_v, m));
                [
                    (m * i + j, (1.0 - s) * (1.0 - t)),
                    (m * i + j + 1, (1.0 - s) * t),
                    (m * (i + 1) + j, s * (1.0 - t)),
                    (m * (i + 1) + j + 1, s * t),
                ]
                .into_iter()
                .filter(|&(_, weight)| weight != 0.0)
                .collect()
            })
            .collect();
        let at = |k: usize, (low, high): (f64, f64), count: usize| {
            low + (high - low) * k as f64 / (count - 1) as f64
        };
        let points = (0..n * m)
            .map(|k| {
                let (x, y) = (at(k / m, limits_u, n), at(k % m, limits_v, m));
                let distance = |node: &NodeId| {
                    let p = mesh.point(*node);
                    (p[u] - x).hypot(p[v] - y)
                };
                let nearest = nodes
                    .iter()
                    .min_by(|a, b| distance(a).total_cmp(&distance(b)))
                    .expect("a design surface has nodes");
                let mut point = mesh.point(*nearest);
                (point[u], point[v]) = (x, y);
                point
            })
            .collect();
        Self { nodes, direction, weights, points }
    }

    /// Nodes of the surface, ascending.
    pub fn nodes(&self) -> &[NodeId] {
        &self.nodes
    }

    /// Unit direction in which a positive variable moves the surface.
    pub fn direction(&self) -> Point {
        self.direction
    }

    /// Number of design variables.
    pub fn variable_count(&self) -> usize {
        self.points.len()
    }

    /// Where the variables sit on the undeformed surface [m], shape `(n_variables, 3)`.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// How far every node moves along the direction [m] for the variables `p` [m].
    pub fn heights(&self, p: &[f64]) -> Vec<f64> {
        self.weights.iter().map(|row| row.iter().map(|&(k, weight)| weight * p[k]).sum()).collect()
    }

    /// `Δx_b = P p` [m], one displacement per node.
    pub fn displacement(&self, p: &[f64]) -> Vec<Point> {
        self.heights(p).into_iter().map(|height| self.direction.map(|d| height * d)).collect()
    }

    /// The transpose of [`DesignSurface::heights`]: from derivatives with respect to the nodes' heights to those with
    /// respect to the variables.
    pub fn height_gradient(&self, heights: &[f64]) -> Vec<f64> {
        let mut gradient = vec![0.0; self.variable_count()];
        for (row, g) in self.weights.iter().zip(heights) {
            for &(k, weight) in row {
                gradient[k] += weight * g;
            }
        }
        gradient
    }

    /// `Pᵀ g`: from derivatives with respect to the nodes' positions to those with respect to the variables.
    pub fn gradient(&self, nodal: &[Point]) -> Vec<f64> {
        let mut gradient = vec![0.0; self.variable_count()];
        for (row, g) in self.weights.iter().zip(nodal) {
            let along = dot(self.direction, *g);
            for &(k, weight) in row {
                gradient[k] += weight * along;
            }
        }
        gradient
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fluxmorph_geometry::generate::{ShieldParameters, shield};

    fn surface(grid: Option<[usize; 2]>) -> DesignSurface {
        let parameters =
            ShieldParameters { skin: vec![], side_skin: vec![5e-3], ..ShieldParameters::default() };
        let mesh = shield(&parameters).expect("defaults are valid");
        let triangles = mesh.topology().surface("plate_bottom").expect("the shield has it");
        DesignSurface::new(&mesh, triangles, [0.0, 0.0, -1.0], grid)
    }

    #[test]
    fn the_papers_control_grid_has_91_points_in_the_contracts_order() {
        let surface = surface(Some([7, 13]));
        assert_eq!(surface.variable_count(), 91);
        for (k, point) in surface.points().iter().enumerate() {
            let expected = [0.02 * (k / 13) as f64, 0.02 * (k % 13) as f64, -0.01];
            assert!((0..3).all(|d| (point[d] - expected[d]).abs() < 1e-12), "{k}: {point:?}");
        }
    }

    #[test]
    fn a_bilinear_height_is_reproduced_at_every_node() {
        let surface = surface(Some([7, 13]));
        let height = |x: Point| 1e-3 * (1.0 + 3.0 * x[0] - 2.0 * x[1] + 7.0 * x[0] * x[1]);
        let p: Vec<f64> = surface.points().iter().map(|&x| height(x)).collect();
        let parameters =
            ShieldParameters { skin: vec![], side_skin: vec![5e-3], ..ShieldParameters::default() };
        let mesh = shield(&parameters).expect("defaults are valid");
        for (&node, h) in surface.nodes().iter().zip(surface.heights(&p)) {
            assert!((h - height(mesh.point(node))).abs() < 1e-15);
        }
    }

    #[test]
    fn the_gradient_is_the_transpose_of_the_displacement() {
        for grid in [None, Some([7, 13]), Some([2, 2])] {
            let surface = surface(grid);
            let p: Vec<f64> = (0..surface.variable_count()).map(|k| (k as f64 * 0.7).sin()).collect();
            let g: Vec<Point> =
                (0..surface.nodes().len()).map(|k| [0.3, (k as f64).cos(), (k as f64 * 1.3).sin()]).collect();
            let left: f64 = surface.displacement(&p).iter().zip(&g).map(|(u, g)| dot(*u, *g)).sum();
            let right: f64 = surface.gradient(&g).iter().zip(&p).map(|(g, p)| g * p).sum();
            assert!((left - right).abs() < 1e-12 * (1.0 + left.abs()), "{left} {right}");
        }
    }
}
