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
pub(super) struct Place {
    /// The box around it.
    pub(super) bounds: AxisBox,
    form: Form,
}

enum Form {
    /// Nodes of the mesh, or the points of a probe [m].
    Points(Vec<Point>),
    /// What an expansion reaches [m].
    Ball { center: Point, radius: f64 },
    /// The edges of an analytic winding [m].
    Winding(Vec<[Point; 2]>),
}

impl Place {
    pub(super) fn of_points(points: Vec<Point>) -> Self {
        Self { bounds: AxisBox::around(&points), form: Form::Points(points) }
    }

    /// The nodes of elements, and others.
    pub(super) fn of_nodes(
        mesh: &Mesh,
        elements: impl IntoIterator<Item = ElementId>,
        others: impl IntoIterator<Item = NodeId>,
    ) -> Self {
        let of_elements = elements.into_iter().flat_map(|e| mesh.topology().tets()[e.index()]);
        let nodes: BTreeSet<NodeId> = of_elements.chain(others).collect();
        Self::of_points(nodes.into_iter().map(|n| mesh.point(n)).collect())
    }

    pub(super) fn of_ball(center: Point, radius: f64) -> Self {
        Self { bounds: AxisBox::around(&[center]).grown(radius), form: Form::Ball { center, radius } }
    }

    pub(super) fn of_winding(coil: &Racetrack) -> Self {
        let [lower, upper] = coil.bounding_box();
        Self { bounds: AxisBox { lower, upper }, form: Form::Winding(coil.edges()) }
    }

    /// Whether nothing is there.
    pub(super) fn is_empty(&self) -> bool {
        matches!(&self.form, Form::Points(points) if points.is_empty())
    }

    /// Its points, or those of the box around it.
    pub(super) fn corners(&self) -> Vec<Point> {
        match &self.form {
            Form::Points(points) => points.clone(),
            Form::Ball { .. } | Form::Winding(_) => {
                let AxisBox { lower, upper } = self.bounds;
                let corner =
                    |k: usize| std::array::from_fn(|d| if k >> d & 1 == 0 { lower[d] } else { upper[d] });
                (0..8).map(corner).collect()
            }
        }
    }

    /// Its distance from a side [m]; beyond `far` a lower bound of it, which is at least `far`.
    pub(super) fn distance(&self, mesh: &Mesh, side: &Side, far: f64) -> f64 {
        if self.bounds.square_gap(&side.bounds) > far * far {
            return far;
        }
        let least = |points: &[Point], far: f64| {
            let near = |x: &Point| side.bounds.square_distance(*x) <= far * far;
            let near: Vec<Point> = points.iter().copied().filter(near).collect();
            depths(mesh, &side.triangles, &near, far).into_iter().fold(far, f64::min)
        };
        match &self.form {
            Form::Points(points) => least(points, far),
            Form::Ball { center, radius } => (least(&[*center], far + radius) - radius).max(0.0),
            Form::Winding(edges) => {
                let crossings =
                    edges.iter().filter_map(|edge| crossing(*edge, side.normal?, side.patch.place));
                least(&edges.as_flattened().iter().copied().chain(crossings).collect::<Vec<_>>(), far)
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
