//! Places at which a field is made, bent or observed, as walls see them: how far a side of the mesh is from them, and in which box
//! they lie. Which places there are, and what a side is, stands in the parent.

use std::collections::BTreeSet;

use fluxmorph_geometry::box_tree::AxisBox;
use fluxmorph_geometry::depth::depths;
use fluxmorph_geometry::tet4::{Point, dot, sub};
use fluxmorph_geometry::{ElementId, Mesh, NodeId};
use fluxmorph_solver::coil::Racetrack;

use super::Side;

/// Where a field is made, bent or observed.
pub(super) enum Place {
    /// Nodes of the mesh, or the points of a probe [m].
    Points(Vec<Point>),
    /// What an expansion reaches [m].
    Ball { center: Point, radius: f64 },
    /// The edges of an analytic winding [m], and the box around it.
    Winding { edges: Vec<[Point; 2]>, bounds: AxisBox },
}

impl Place {
    /// The nodes of elements, and others.
    pub(super) fn of_nodes(
        mesh: &Mesh,
        elements: impl IntoIterator<Item = ElementId>,
        others: impl IntoIterator<Item = NodeId>,
    ) -> Self {
        let of_elements = elements.into_iter().flat_map(|e| mesh.topology().tets()[e.index()]);
        let nodes: BTreeSet<NodeId> = of_elements.chain(others).collect();
        Self::Points(nodes.into_iter().map(|n| mesh.point(n)).collect())
    }

    pub(super) fn of_winding(coil: &Racetrack) -> Self {
        let [lower, upper] = coil.bounding_box();
        Self::Winding { edges: coil.edges(), bounds: AxisBox { lower, upper } }
    }

    /// Whether anything is there.
    pub(super) fn is_empty(&self) -> bool {
        matches!(self, Self::Points(points) if points.is_empty())
    }

    /// The box around it.
    pub(super) fn bounds(&self) -> AxisBox {
        match self {
            Self::Points(points) => AxisBox::around(points),
            Self::Ball { center, radius } => AxisBox::around(&[*center]).grown(*radius),
            Self::Winding { bounds, .. } => *bounds,
        }
    }

    /// Its points, or those of the box around it.
    pub(super) fn corners(&self) -> Vec<Point> {
        match self {
            Self::Points(points) => points.clone(),
            Self::Ball { .. } | Self::Winding { .. } => {
                let AxisBox { lower, upper } = self.bounds();
                let corner =
                    |k: usize| std::array::from_fn(|d| if k >> d & 1 == 0 { lower[d] } else { upper[d] });
                (0..8).map(corner).collect()
            }
        }
    }

    /// Its distance from a side [m]; beyond `far` a lower bound of it, which is at least `far`.
    pub(super) fn distance(&self, mesh: &Mesh, side: &Side, far: f64) -> f64 {
        if self.bounds().square_gap(&side.bounds) > far * far {
            return far;
        }
        let least = |points: &[Point], far: f64| {
            let near = |x: &Point| side.bounds.square_distance(*x) <= far * far;
            let near: Vec<Point> = points.iter().copied().filter(near).collect();
            depths(mesh, &side.triangles, &near, far).into_iter().fold(far, f64::min)
        };
        match self {
            Self::Points(points) => least(points, far),
            Self::Ball { center, radius } => (least(&[*center], far + radius) - radius).max(0.0),
            Self::Winding { edges, .. } => {
                let mut points = edges.as_flattened().to_vec();
                if let Some(normal) = side.normal {
                    points.extend(edges.iter().filter_map(|edge| crossing(*edge, normal, side.patch.place)));
                }
                least(&points, far)
            }
        }
    }
}

/// Where an edge goes through a plane [m].
fn crossing([from, to]: [Point; 2], normal: Point, on_plane: Point) -> Option<Point> {
    let [first, second] = [from, to].map(|x| dot(normal, sub(x, on_plane)));
    (first * second < 0.0).then(|| {
        let share = first / (first - second);
        std::array::from_fn(|d| from[d] + share * (to[d] - from[d]))
    })
}
