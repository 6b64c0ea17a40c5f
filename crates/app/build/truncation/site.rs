//! Places at which a field is made, bent or observed, as walls see them: how far a side of the mesh is from them, and in which box
//! they lie. Which places there are, and what a side is, stands in the parent.

use std::collections::BTreeSet;

use fluxmorph_geometry::box_tree::AxisBox;
use fluxmorph_geometry::depth::depths;
use fluxmorph_geometry::tet4::{Point, dot, sub};
use fluxmorph_geometry::{Mesh, NodeId};

use super::Side;

/// Where a field is made, bent or observed.
pub(super) struct Site {
    /// The box around it.
    pub(super) bounds: AxisBox,
    form: Form,
}

/// What it consists of.
pub(super) enum Form {
    /// Nodes of the mesh [m].
    Nodes(Vec<Point>),
    /// The points of a probe [m].
    Probe(Vec<Point>),
    /// What an expansion reaches [m].
    Ball { center: Point, radius: f64 },
    /// The edges of an analytic winding [m].
    Winding(Vec<[Point; 2]>),
}

impl Site {
    pub(super) fn new(form: Form) -> Self {
        Self { bounds: AxisBox::around(form.extremes()), form }
    }

    /// Nodes of a mesh, each once or more often.
    pub(super) fn of_nodes(mesh: &Mesh, nodes: impl IntoIterator<Item = NodeId>) -> Self {
        let nodes: BTreeSet<NodeId> = nodes.into_iter().collect();
        Self::new(Form::Nodes(nodes.into_iter().map(|n| mesh.point(n)).collect()))
    }

    /// Points between which it lies [m].
    pub(super) fn extremes(&self) -> Vec<Point> {
        self.form.extremes()
    }

    /// Whether it reaches a side, to the rounding of coordinates [m]; all points of a probe must lie on that, for a scan may end at
    /// any wall.
    pub(super) fn reaches(&self, mesh: &Mesh, side: &Side, rounding: f64) -> bool {
        let far = 2.0 * rounding;
        match &self.form {
            Form::Probe(points) if self.bounds.square_gap(&side.bounds) <= far * far => {
                depths(mesh, &side.triangles, points, far).into_iter().all(|depth| depth <= rounding)
            }
            _ => self.distance(mesh, side, far) <= rounding,
        }
    }

    /// Its distance from a side [m], or `far` where that is no nearer.
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
            Form::Nodes(points) | Form::Probe(points) => least(points, far),
            Form::Ball { center, radius } => (least(&[*center], far + radius) - radius).clamp(0.0, far),
            Form::Winding(edges) => {
                let crossings =
                    edges.iter().filter_map(|edge| crossing(*edge, side.normal?, side.patch.place));
                least(&edges.as_flattened().iter().copied().chain(crossings).collect::<Vec<_>>(), far)
            }
        }
    }
}

impl Form {
    fn extremes(&self) -> Vec<Point> {
        match self {
            Self::Nodes(points) | Self::Probe(points) => points.clone(),
            Self::Winding(edges) => edges.as_flattened().to_vec(),
            Self::Ball { center, radius } => {
                let along = |k: usize, step: f64| {
                    let mut x = *center;
                    x[k] += step;
                    x
                };
                (0..3).flat_map(|k| [along(k, -radius), along(k, *radius)]).collect()
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
