//! How far the walls of the mesh are from what makes and bends the field, and from where it is observed: what they cut off is not
//! computed.
//!
//! Walls are the sides of the mesh, whatever their names and conditions, but planes of symmetry: those that coils, matter or what is
//! observed reach; and those that flux passes at a right angle, unless such a plane, or one that is reached, lies opposite.

use std::collections::HashSet;

use fluxmorph_geometry::box_tree::AxisBox;
use fluxmorph_geometry::soundness::{Hull, OpenPatch, open_patches};
use fluxmorph_geometry::tet4::{Point, dot, norm, sub};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{ElementId, Mesh, Millimetres, NodeId, millimetres};
use fluxmorph_solver::coil::CoilShape;
use fluxmorph_solver::{Boundary, FieldModel, Material};
use serde::Serialize;

use super::soundness::faces_of;
use super::{Setup, functionals};
use crate::config::{Config, ObjectiveKind};

/// Distance in half diagonals of what makes, bends and observes the field below which a wall is near: at 2.1 the mutual inductance of
/// two coils was 4.3 % off, at 1.6 a coil's field 14 % on its axis, at 1.4 the shield's objective 11 % low
/// (docs/howto/open_space.md).
const NEAR: f64 = 3.0;

/// The same for a plane device, which reaches from one side of the mesh to the other: its field falls with the square of the distance
/// in place of the cube, and is cut off as much at `3^(3/2)` half diagonals as others are at three. Behind a plate of iron with walls
/// at 2.4 its square was 34 % low.
const NEAR_IN_A_PLANE: f64 = 5.2;

/// Sum of the area vectors of a plane side over its area, at least.
const PLANE: f64 = 1.0 - 1e-6;

/// Cosine between the normals of opposite sides, at most.
const OPPOSITE: f64 = -0.99;

/// Share of the diagonal of the mesh that coordinates of a file may be off.
const ROUNDING: f64 = 1e-9;

/// The nearest wall that no coil, magnet, conductor or iron reaches.
#[derive(Debug, Serialize)]
pub(crate) struct Truncation {
    /// Its surface; of a side without a name what it bounds.
    pub(crate) surface: String,
    /// Where a side without a name is [m].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) at_m: Option<Point>,
    /// To it from the box around coils and matter, or from a place that is observed [m].
    pub(crate) distance_m: f64,
    /// Half the diagonal of the box around all of these, with what planes of symmetry cut off [m].
    pub(crate) source_size_m: f64,
    /// In which so many of these are near.
    #[serde(skip)]
    near: f64,
}

/// What a side of the mesh may stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Standing {
    /// A wall.
    Wall,
    /// A plane without a condition, which flux passes at a right angle.
    Free,
    /// A plane of `flux_normal`.
    Normal,
    /// A side that coils or matter reach, or a plane that what is observed does: one of symmetry.
    Reached,
}

/// A side of the mesh.
struct Side {
    patch: OpenPatch,
    /// Its nodes, each at least once, and the box around them.
    nodes: Vec<NodeId>,
    bounds: AxisBox,
    standing: Standing,
}

impl Side {
    /// Whether it is a wall beside these, one of which may be itself.
    fn is_wall(&self, all: &[Self]) -> bool {
        let Self { patch, standing, .. } = self;
        let is_opposite = |other: &&Self| {
            dot(patch.area_vector, other.patch.area_vector) < OPPOSITE * patch.area * other.patch.area
        };
        match standing {
            Standing::Wall => true,
            Standing::Free | Standing::Normal => {
                all.iter().filter(is_opposite).any(|other| other.standing >= *standing)
            }
            Standing::Reached => false,
        }
    }

    /// Square of its distance from the nearest of some places [m²].
    fn square_distance<'a>(&self, mesh: &Mesh, places: impl Iterator<Item = &'a AxisBox>) -> f64 {
        let mut by_bound: Vec<_> = places.map(|place| (place.square_gap(&self.bounds), place)).collect();
        by_bound.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut nearest = f64::INFINITY;
        for (bound, place) in by_bound {
            if bound >= nearest {
                break;
            }
            let to_nodes = self.nodes.iter().map(|&n| place.square_distance(mesh.point(n)));
            nearest = to_nodes.fold(nearest, f64::min);
        }
        nearest
    }
}

impl Truncation {
    /// Of the first state; `None` where space is open, and where no coil and no matter is there or nothing is cut off.
    pub(crate) fn of(config: &Config, setup: &Setup) -> Option<Self> {
        let (model, mesh) = (setup.problem.states().first()?, setup.problem.original());
        if model.setup().open.is_some() {
            return None;
        }
        let mut points: Vec<_> = sources(model).into_iter().flat_map(|e| mesh.vertices(e)).collect();
        points.extend(analytic_coils(model, mesh));
        // A conductor that its surface replaces is matter too.
        let replaced = model.conductors().iter().flat_map(|conductor| conductor.surface.iter().flatten());
        points.extend(replaced.map(|&n| mesh.point(n)));
        if points.is_empty() {
            return None;
        }
        let [lower, upper] = mesh.bounding_box();
        let whole = AxisBox { lower, upper };
        let (sources, observed) = (AxisBox::around(&points), observed(config, mesh, &whole));
        let hull = Hull::new(mesh);
        let sides = sides(&hull, model, (&sources, &observed), rounding(&whole));
        let places = || observed.iter().chain([&sources]);
        let distance = |side: &Side| side.square_distance(mesh, places()).sqrt();
        let walls = sides.iter().filter(|side| side.is_wall(&sides)).map(|side| (side, distance(side)));
        let (side, distance_m) = walls.min_by(|a, b| a.1.total_cmp(&b.1))?;
        let (source_size_m, near) = size(&whole, &sources, &observed);
        let (surface, at_m) = name(&hull, side);
        Some(Self { surface, at_m, distance_m, source_size_m, near })
    }

    /// Its name in marks or not, with the place of a side that has none.
    pub(crate) fn named(&self, mark: &str) -> String {
        let place = self.at_m.map_or(String::new(), |place| format!(" at {}", millimetres(place)));
        format!("{mark}{}{mark}{place}", self.surface)
    }

    /// What no error bar counts, where the wall is near.
    pub(crate) fn described(&self) -> Option<String> {
        let Self { distance_m, source_size_m, near, .. } = self;
        let ratio = distance_m / source_size_m;
        (ratio < *near).then(|| {
            format!(
                "the wall {} is {:.3} mm from the box around coils, matter and what is observed, {ratio:.1} times their half \
                 diagonal: where it stands for open space, no error bar counts what it cuts off; walls farther off show how much that is",
                self.named("`"),
                Millimetres(*distance_m)
            )
        })
    }
}

/// The sides of a mesh, and which of them coils and matter reach, or what is observed, to the rounding of coordinates [m].
fn sides(
    hull: &Hull<'_>,
    model: &FieldModel,
    (sources, observed): (&AxisBox, &[AxisBox]),
    rounding: f64,
) -> Vec<Side> {
    let (mesh, faces) = (hull.mesh(), hull.faces());
    let boundaries = &model.setup().boundaries;
    let with = |is: &dyn Fn(Boundary) -> bool| {
        let names = boundaries.iter().filter(|own| is(own.1)).map(|own| own.0.as_str());
        faces_of(mesh.topology(), names)
    };
    let normal = with(&|own| own == Boundary::FluxNormal);
    let others = with(&|own| own != Boundary::FluxNormal);
    let of = |patch: OpenPatch| {
        let nodes: Vec<NodeId> = patch.faces.iter().flat_map(|&face| faces[face].nodes).collect();
        let bounds = AxisBox::around(&nodes.iter().map(|&n| mesh.point(n)).collect::<Vec<_>>());
        let is_reached = |from: &AxisBox| {
            let of_face = |&face: &usize| AxisBox::around(&hull.corners(face)).grown(rounding).meets(from);
            bounds.grown(rounding).meets(from) && patch.faces.iter().any(of_face)
        };
        let all = |of: &HashSet<_>| patch.faces.iter().all(|&face| of.contains(&face_key(faces[face].nodes)));
        let any = |of: &HashSet<_>| patch.faces.iter().any(|&face| of.contains(&face_key(faces[face].nodes)));
        let is_plane = norm(patch.area_vector) >= PLANE * patch.area;
        let standing = if is_reached(sources) || is_plane && observed.iter().any(is_reached) {
            Standing::Reached
        } else if !is_plane || any(&others) {
            Standing::Wall
        } else if all(&normal) {
            Standing::Normal
        } else {
            Standing::Free
        };
        Side { standing, nodes, bounds, patch }
    };
    let replaced = model.conductors().iter().flat_map(|conductor| &conductor.surface);
    let replaced: HashSet<_> = replaced.map(|triangle| face_key(*triangle)).collect();
    let is_matter: Vec<bool> = faces.iter().map(|face| replaced.contains(&face_key(face.nodes))).collect();
    open_patches(hull, &is_matter).into_iter().map(of).collect()
}

/// What a side is called; of one without a name with a place.
fn name(hull: &Hull<'_>, side: &Side) -> (String, Option<Point>) {
    let topology = hull.mesh().topology();
    let first = face_key(hull.faces()[side.patch.faces[0]].nodes);
    let holds = |name: &&str| {
        topology.surface(name).is_ok_and(|triangles| triangles.iter().any(|t| face_key(*t) == first))
    };
    match topology.surface_names().find(holds) {
        Some(name) => (name.to_owned(), None),
        None => {
            let region = &topology.region_names()[side.patch.region.index()];
            (format!("{region}|outside"), Some(side.patch.place))
        }
    }
}

/// How far off coordinates in a box around a mesh may be [m].
fn rounding(whole: &AxisBox) -> f64 {
    ROUNDING * norm(sub(whole.upper, whole.lower))
}

/// In which directions a box reaches the least and the greatest coordinates of that around the mesh.
fn cuts(whole: &AxisBox, own: &AxisBox) -> [[bool; 2]; 3] {
    let rounding = rounding(whole);
    [0, 1, 2].map(|d| [own.lower[d] <= whole.lower[d] + rounding, own.upper[d] >= whole.upper[d] - rounding])
}

/// Half the diagonal of the box around all that makes, bends and observes the field, with what planes of symmetry cut off [m], and in
/// how many of it a wall is near; `mesh` is the box around that.
fn size(mesh: &AxisBox, sources: &AxisBox, observed: &[AxisBox]) -> (f64, f64) {
    let all = observed.iter().fold(*sources, |all, own| all.with(own));
    // What a plane of symmetry cuts goes on behind it.
    let of_all = cuts(mesh, &all);
    let extent = |d: usize| {
        let own = all.upper[d] - all.lower[d];
        if of_all[d][0] != of_all[d][1] { 2.0 * own } else { own }
    };
    let is_plane = cuts(mesh, sources).contains(&[true, true]);
    (0.5 * norm([0, 1, 2].map(extent)), if is_plane { NEAR_IN_A_PLANE } else { NEAR })
}

/// The places at which B is observed: the boxes around regions and expansions, as far as they lie in the mesh, and the points of
/// probes. A region that fills the mesh, of which `whole` is the box, is no place.
fn observed(config: &Config, mesh: &Mesh, whole: &AxisBox) -> Vec<AxisBox> {
    let topology = mesh.topology();
    let is_of_places = |kind: ObjectiveKind| {
        use ObjectiveKind::{FieldComponent, FluxDensitySquared, Homogeneity, TargetField};
        matches!(kind, FluxDensitySquared | TargetField | FieldComponent | Homogeneity)
    };
    let own = functionals(config).into_iter().filter(|(_, own)| is_of_places(own.kind));
    let regions = own.filter_map(|(_, own)| topology.region(own.region.as_ref()?).ok());
    let corners = |region| -> Vec<Point> {
        topology.elements_of(region).into_iter().flat_map(|e| mesh.vertices(e)).collect()
    };
    let of_regions = regions.map(|region| AxisBox::around(&corners(region)));
    let of_probes = config.probes.iter().flat_map(|probe| &probe.points).map(|&p| AxisBox::around(&[p]));
    let AxisBox { lower, upper } = whole;
    let of_expansions = config.multipoles.iter().map(|set| AxisBox {
        lower: std::array::from_fn(|d| (set.center[d] - set.radius).clamp(lower[d], upper[d])),
        upper: std::array::from_fn(|d| (set.center[d] + set.radius).clamp(lower[d], upper[d])),
    });
    let is_place = |own: &AxisBox| cuts(whole, own) != [[true; 2]; 3];
    of_regions.chain(of_probes).chain(of_expansions).filter(is_place).collect()
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
    fn a_wall_is_near_within_three_half_diagonals_and_farther_beside_a_plane_device() {
        let at = |distance_m: f64, near| Truncation {
            surface: "x_max".to_owned(),
            at_m: None,
            distance_m,
            source_size_m: 0.1,
            near,
        };
        let text = at(0.29, NEAR).described().expect("it is near");
        assert!(
            text.contains(
                "`x_max` is 290.000 mm from the box around coils, matter and what is observed, 2.9 times"
            ),
            "{text}"
        );
        assert_eq!(at(0.31, NEAR).described(), None);
        assert!(at(0.5, NEAR_IN_A_PLANE).described().is_some());
        assert_eq!(at(0.53, NEAR_IN_A_PLANE).described(), None);
    }
}
