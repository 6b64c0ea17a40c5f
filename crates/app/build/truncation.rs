//! How far the walls of the mesh are from what makes and bends the field: what they cut off is not computed. A flux-normal
//! surface is taken for a symmetry plane, and so is one that coils or matter reach.

use std::collections::HashSet;

use fluxmorph_geometry::box_tree::AxisBox;
use fluxmorph_geometry::tet4::{Point, norm, sub};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{ElementId, Mesh, Millimetres};
use fluxmorph_solver::coil::CoilShape;
use fluxmorph_solver::{Boundary, FieldModel, Material};
use serde::Serialize;

use super::Setup;

/// Distance in half diagonals of what makes and bends the field below which a wall is near: at 1.6 of a coil's its field was 14 %
/// off on the axis, at 1.4 of the shield's its objective 11 % low (docs/howto/open_space.md).
const NEAR: f64 = 2.0;

/// The same for a plane device, which reaches from one side of the mesh to the other: its field falls with the square of the distance
/// in place of the cube, and is cut off as much at 2√2 half diagonals as others are at two. Behind a plate of iron with walls at 2.4
/// its square was 34 % low.
const NEAR_IN_A_PLANE: f64 = 2.83;

/// Share of the diagonal of the mesh that coordinates of a file may be off.
const ROUNDING: f64 = 1e-9;

/// The nearest wall that no coil, magnet, conductor or iron reaches.
#[derive(Debug, Serialize)]
pub(crate) struct Truncation {
    /// Its surface.
    pub(crate) surface: String,
    /// From the box around coils and matter to it [m].
    pub(crate) distance_m: f64,
    /// Half the diagonal of that box, with what planes of symmetry cut off [m].
    pub(crate) source_size_m: f64,
    /// In which so many of these are near.
    #[serde(skip)]
    near: f64,
}

impl Truncation {
    /// Of the first state; `None` where space is open, or nothing is cut off.
    pub(crate) fn of(setup: &Setup) -> Option<Self> {
        let (model, mesh) = (setup.problem.states().first()?, setup.problem.original());
        if model.setup().open.is_some() {
            return None;
        }
        let topology = mesh.topology();
        let mut points: Vec<_> = sources(model).into_iter().flat_map(|e| mesh.vertices(e)).collect();
        points.extend(analytic_coils(model, mesh));
        // A conductor that its surface replaces is matter too.
        let replaced = model.conductors().iter().flat_map(|conductor| conductor.surface.iter().flatten());
        points.extend(replaced.map(|&n| mesh.point(n)));
        let sources = AxisBox::around(&points);
        let outer: HashSet<_> =
            topology.facets().iter().filter(|f| f.outside.is_none()).map(|f| face_key(f.nodes)).collect();
        let distance = |name: &str| -> Option<f64> {
            let is_symmetry =
                |(own, boundary): &(String, Boundary)| own == name && *boundary == Boundary::FluxNormal;
            if model.setup().boundaries.iter().any(is_symmetry) {
                return None;
            }
            let triangles = topology.surface(name).ok()?;
            let is_wall = !triangles.is_empty() && triangles.iter().all(|t| outer.contains(&face_key(*t)));
            let nodes = triangles.iter().flatten();
            let nearest =
                nodes.map(|&n| sources.square_distance(mesh.point(n))).fold(f64::INFINITY, f64::min);
            (is_wall && nearest > 0.0 && nearest.is_finite()).then(|| nearest.sqrt())
        };
        let walls = topology.surface_names().filter_map(|name| Some((name, distance(name)?)));
        let (surface, distance_m) = walls.min_by(|a, b| a.1.total_cmp(&b.1))?;
        // What a plane of symmetry cuts goes on behind it.
        let [lower, upper] = mesh.bounding_box();
        let rounding = ROUNDING * norm(sub(upper, lower));
        let cuts = [0, 1, 2]
            .map(|d| [sources.lower[d] <= lower[d] + rounding, sources.upper[d] >= upper[d] - rounding]);
        let whole = |d: usize| {
            let own = sources.upper[d] - sources.lower[d];
            if cuts[d][0] != cuts[d][1] { 2.0 * own } else { own }
        };
        let source_size_m = 0.5 * norm([0, 1, 2].map(whole));
        let near = if cuts.contains(&[true, true]) { NEAR_IN_A_PLANE } else { NEAR };
        Some(Self { surface: surface.to_owned(), distance_m, source_size_m, near })
    }

    /// What no error bar counts, where the wall is near.
    pub(crate) fn described(&self) -> Option<String> {
        let Self { surface, distance_m, source_size_m, near } = self;
        let ratio = distance_m / source_size_m;
        (ratio < *near).then(|| {
            format!(
                "the wall `{surface}` is {:.3} mm from coils and matter, {ratio:.1} times their half diagonal: where it stands for open \
                 space, no error bar counts what it cuts off; walls farther off show how much that is",
                Millimetres(*distance_m)
            )
        })
    }
}

/// Elements of windings and conductors, or that are not air.
fn sources(model: &FieldModel) -> Vec<ElementId> {
    let is_matter = |&e: &ElementId| {
        let region = model.topology().region_of()[e.index()];
        model.materials()[region.index()] != Material::AIR || model.remanence_of(e) != [0.0; 3]
    };
    let wound = model.coils().iter().filter_map(|coil| coil.shape.region_current());
    let wound = wound.flat_map(|current| current.current_density().iter().map(|(e, _)| *e));
    wound.chain(model.topology().elements().filter(is_matter)).collect()
}

/// The corners of the boxes around coils that the mesh need not follow, as far as these lie in the mesh: a plane of symmetry cuts
/// them.
fn analytic_coils(model: &FieldModel, mesh: &Mesh) -> Vec<Point> {
    let [lower, upper] = mesh.bounding_box();
    let within = |corner: Point| -> Point { std::array::from_fn(|d| corner[d].clamp(lower[d], upper[d])) };
    let shapes = model.coils().iter().map(|coil| &coil.shape);
    let boxes = shapes.filter_map(|shape| match shape {
        CoilShape::Racetrack(coil) => Some(coil.bounding_box()),
        CoilShape::Region(_) | CoilShape::Solid(_) => None,
    });
    boxes.flatten().map(within).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_is_near_within_twice_the_half_diagonal_and_farther_beside_a_plane_device() {
        let at = |distance_m: f64, near| Truncation {
            surface: "x_max".to_owned(),
            distance_m,
            source_size_m: 0.1,
            near,
        };
        let text = at(0.19, NEAR).described().expect("it is near");
        assert!(text.contains("`x_max` is 190.000 mm from coils and matter, 1.9 times"), "{text}");
        assert_eq!(at(0.21, NEAR).described(), None);
        assert!(at(0.24, NEAR_IN_A_PLANE).described().is_some());
        assert_eq!(at(0.29, NEAR_IN_A_PLANE).described(), None);
    }
}
