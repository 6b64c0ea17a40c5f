//! How far the walls of the mesh are from what makes and bends the field, and from where it is observed: what they cut off is not
//! computed.
//!
//! Walls are the sides of the mesh, whatever their names and conditions, but planes of symmetry: those that coils, matter or what is
//! observed reach; and those that flux passes at a right angle, unless such a plane, or one that is reached, lies opposite.

mod return_path;
mod site;

use std::collections::{BTreeMap, BTreeSet, HashSet};

use fluxmorph_geometry::box_tree::AxisBox;
use fluxmorph_geometry::soundness::{Hull, OpenPatch, open_patches};
use fluxmorph_geometry::tet4::{Point, add, cross, dot, norm, sub};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{ElementId, Mesh, Millimetres, NodeId, RegionId, millimetres};
use fluxmorph_solver::coil::CoilShape;
use fluxmorph_solver::{Boundary, FieldModel, Material};
use serde::Serialize;

use self::site::{Form, Site};
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

/// Cosine between the normals of opposite sides, at most: within 0.8°, less than any sector has.
const OPPOSITE: f64 = -0.9999;

/// Planes of symmetry that images are taken in: three at most of those that meet in one point, and one more.
const MOST_IMAGED: usize = 4;

/// Cosine between the normals of sides at right angles, at most in size.
const RIGHT: f64 = 1e-4;

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
    /// To it from coils and matter, or from a place that is observed [m].
    pub(crate) distance_m: f64,
    /// Half the diagonal of the box around all of these, with what planes of symmetry cut off [m].
    pub(crate) source_size_m: f64,
    /// In which so many of these are near.
    #[serde(skip)]
    near: f64,
    /// Planes that a device goes through, and that flux may not leave beside it.
    #[serde(skip)]
    confined: Option<[String; 2]>,
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
    /// A plane that what is observed reaches: one of symmetry.
    Observed,
    /// A plane of symmetry that coils or matter reach, or a curved side all along which there is matter.
    Reached,
}

/// A side of the mesh.
struct Side {
    patch: OpenPatch,
    triangles: Vec<[NodeId; 3]>,
    /// The box around it.
    bounds: AxisBox,
    /// Of a plane, out of the mesh.
    normal: Option<Point>,
    standing: Standing,
}

impl Side {
    /// A side of which nothing is known yet.
    fn new(hull: &Hull<'_>, patch: OpenPatch) -> Self {
        let triangles: Vec<[NodeId; 3]> = patch.faces.iter().map(|&face| hull.faces()[face].nodes).collect();
        let corners: Vec<Point> = triangles.as_flattened().iter().map(|&n| hull.mesh().point(n)).collect();
        let length = norm(patch.area_vector);
        let normal = (length >= PLANE * patch.area).then(|| patch.area_vector.map(|c| c / length));
        Self { bounds: AxisBox::around(&corners), triangles, normal, standing: Standing::Wall, patch }
    }

    /// Cosine between its normal and that of another one; `None` unless both are planes.
    fn cosine(&self, other: &Self) -> Option<f64> {
        Some(dot(self.normal?, other.normal?))
    }

    /// Whether it is a plane that faces another one.
    fn is_opposite(&self, other: &Self) -> bool {
        self.cosine(other).is_some_and(|cosine| cosine < OPPOSITE)
    }

    /// Whether it lies in the plane of another one.
    fn is_coplanar(&self, other: &Self, rounding: f64) -> bool {
        self.cosine(other).is_some_and(|cosine| cosine > -OPPOSITE)
            && self.beyond(other.patch.place).abs() <= rounding
    }

    /// Whether it is a wall beside these, one of which may be itself.
    fn is_wall(&self, all: &[Self]) -> bool {
        let faces_another = |other: &Self| self.is_opposite(other) && other.standing >= self.standing;
        match self.standing {
            Standing::Wall => true,
            Standing::Free | Standing::Normal => all.iter().any(faces_another),
            Standing::Observed | Standing::Reached => false,
        }
    }

    /// Its distance from the nearest of some sites [m], or `far` where none is nearer. What goes through a curved side does not count
    /// for it.
    fn distance(&self, mesh: &Mesh, places: &[&Site], (far, rounding): (f64, f64)) -> f64 {
        let counts = |place: &&&Site| self.normal.is_some() || !place.reaches(mesh, self, rounding);
        places.iter().filter(counts).fold(far, |far, place| place.distance(mesh, self, far))
    }

    /// A point on the other side of its plane is moved onto it, and all others kept [m].
    fn projected_inside(&self, x: Point) -> Point {
        let beyond = self.beyond(x).max(0.0);
        self.along_normal(x, -beyond)
    }

    /// The image of a point in its plane [m].
    fn image(&self, x: Point) -> Point {
        self.along_normal(x, -2.0 * self.beyond(x))
    }

    /// How far a point lies behind its plane [m].
    fn beyond(&self, x: Point) -> f64 {
        self.normal.map_or(0.0, |normal| dot(normal, sub(x, self.patch.place)))
    }

    fn along_normal(&self, x: Point, step: f64) -> Point {
        self.normal.map_or(x, |normal| std::array::from_fn(|d| x[d] + step * normal[d]))
    }
}

impl Truncation {
    /// Of the first state; `None` where space is open, and where no coil and no matter is there or nothing is cut off.
    pub(crate) fn of(config: &Config, setup: &Setup) -> Option<Self> {
        let (model, mesh) = (setup.problem.states().first()?, setup.problem.original());
        if model.setup().open.is_some() {
            return None;
        }
        let sources = sources(model, mesh);
        if sources.is_empty() {
            return None;
        }
        let [lower, upper] = mesh.bounding_box();
        let whole = AxisBox { lower, upper };
        let observed = observed(config, mesh, &whole);
        let hull = Hull::new(mesh);
        let rounding = ROUNDING * norm(sub(upper, lower));
        let sides = sides(&hull, model, (&sources, &observed), rounding);
        let places: Vec<&Site> = sources.iter().chain(&observed).collect();
        let mut nearest: Option<(&Side, f64)> = None;
        for side in sides.iter().filter(|side| side.is_wall(&sides)) {
            let far = nearest.map_or(f64::INFINITY, |(_, distance)| distance);
            let distance = side.distance(mesh, &places, (far, rounding));
            if distance < far {
                nearest = Some((side, distance));
            }
        }
        let (side, distance_m) = nearest?;
        let source_size_m = size(&whole, &places, &planes_of_symmetry(mesh, &sides, rounding));
        let near = if is_plane_device(&sides) { NEAR_IN_A_PLANE } else { NEAR };
        let (surface, at_m) = name(&hull, side);
        let confined = return_path::confined(&sides, (model, mesh), rounding);
        let in_words = |plane| {
            let (surface, at_m) = name(&hull, plane);
            named(&surface, at_m, "`")
        };
        let confined = confined.map(|planes| planes.map(in_words));
        Some(Self { surface, at_m, distance_m, source_size_m, near, confined })
    }

    /// Its name in marks or not, with the place of a side that has none.
    pub(crate) fn named(&self, mark: &str) -> String {
        named(&self.surface, self.at_m, mark)
    }

    /// What no error bar counts, where walls send flux back, however far they are.
    pub(crate) fn sent_back(&self) -> Option<String> {
        self.confined.as_ref().map(|[first, second]| {
            format!(
                "between the planes {first} and {second}, which flux passes, the sides are flux-parallel all round: they send back \
                 beside the device all that passes it, however far they are, and no error bar counts that. Where the device goes on \
                 alike beyond both planes with open space around it, as a long coil or a ring does, leave the far sides without a \
                 condition"
            )
        })
    }

    /// The same, and where walls are near.
    pub(crate) fn described(&self) -> Option<String> {
        let Self { distance_m, source_size_m, near, .. } = self;
        let ratio = distance_m / source_size_m;
        let near = (ratio < *near).then(|| {
            format!(
                "the wall {} is {:.3} mm from coils, matter and what is observed, {ratio:.1} times their half \
                 diagonal: where it stands for open space, no error bar counts what it cuts off; walls farther off show how much that is",
                self.named("`"),
                Millimetres(*distance_m)
            )
        });
        self.sent_back().into_iter().chain(near).reduce(|first, second| format!("{first}; {second}"))
    }
}

/// The name of a side in marks or not, with the place of one that has none.
fn named(surface: &str, place: Option<Point>, mark: &str) -> String {
    let place = place.map_or(String::new(), |place| format!(" at {}", millimetres(place)));
    format!("{mark}{surface}{mark}{place}")
}

/// The sides of a mesh, and what they stand for; coordinates are off by `rounding` [m].
fn sides(
    hull: &Hull<'_>,
    model: &FieldModel,
    (sources, observed): (&[Site], &[Site]),
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
    let matter: HashSet<ElementId> = wound_or_matter(model).collect();
    let of = |patch: OpenPatch| {
        let side = Side::new(hull, patch);
        let all = |of: &HashSet<_>| side.triangles.iter().all(|&face| of.contains(&face_key(face)));
        let any = |of: &HashSet<_>| side.triangles.iter().any(|&face| of.contains(&face_key(face)));
        let is_reached_by = |places: &[Site]| places.iter().any(|place| place.reaches(mesh, &side, rounding));
        let is_covered = || side.patch.faces.iter().all(|&face| matter.contains(&faces[face].inside));
        let standing = if side.normal.is_none() {
            if is_covered() { Standing::Reached } else { Standing::Wall }
        } else if is_reached_by(sources) {
            Standing::Reached
        } else if is_reached_by(observed) {
            Standing::Observed
        } else if any(&others) {
            Standing::Wall
        } else if all(&normal) {
            Standing::Normal
        } else {
            Standing::Free
        };
        Side { standing, ..side }
    };
    let replaced = model.conductors().iter().flat_map(|conductor| &conductor.surface);
    let replaced: HashSet<_> = replaced.map(|triangle| face_key(*triangle)).collect();
    let is_matter: Vec<bool> = faces.iter().map(|face| replaced.contains(&face_key(face.nodes))).collect();
    let sides = open_patches(hull, &is_matter).into_iter().map(of);
    // A hole may part a plane of symmetry, of which then not all parts are reached.
    let (reached, mut others): (Vec<Side>, Vec<Side>) =
        sides.partition(|side| side.standing >= Standing::Observed);
    let is_of_reached = |side: &Side| reached.iter().any(|other| side.is_coplanar(other, rounding));
    for side in others.iter_mut().filter(|side| is_of_reached(side)) {
        side.standing = Standing::Observed;
    }
    reached.into_iter().chain(others).collect()
}

/// What a side is called, by the surface that has most of it; of one without a name with a place.
fn name(hull: &Hull<'_>, side: &Side) -> (String, Option<Point>) {
    let topology = hull.mesh().topology();
    let own: HashSet<[NodeId; 3]> = side.triangles.iter().map(|&triangle| face_key(triangle)).collect();
    let shared = |name: &str| {
        let triangles = topology.surface(name).unwrap_or_default();
        triangles.iter().filter(|&&triangle| own.contains(&face_key(triangle))).count()
    };
    let mut largest = (0, None);
    for name in topology.surface_names() {
        let count = shared(name);
        if count > largest.0 {
            largest = (count, Some(name));
        }
    }
    match largest.1 {
        Some(name) => (name.to_owned(), None),
        None => {
            let region = &topology.region_names()[side.patch.region.index()];
            (format!("{region}|outside"), Some(side.patch.place))
        }
    }
}

/// Half the diagonal of the box around all that makes, bends and observes the field, with what planes of symmetry cut off [m];
/// `whole` is the box around the mesh.
fn size(whole: &AxisBox, places: &[&Site], planes: &[&Side]) -> f64 {
    let within = |x: Point| -> Point { std::array::from_fn(|d| x[d].clamp(whole.lower[d], whole.upper[d])) };
    let meshed = |x: Point| planes.iter().fold(within(x), |x, plane| plane.projected_inside(x));
    // What planes of symmetry cut goes on behind each and behind several, and around the edge of two.
    let planes = &planes[..planes.len().min(MOST_IMAGED)];
    let pairs: Vec<[&Side; 2]> = planes
        .iter()
        .enumerate()
        .flat_map(|(k, &first)| planes[..k].iter().map(move |&second| [first, second]))
        .collect();
    let images = |x: Point| {
        let mut points = vec![x];
        for plane in planes {
            points.extend(points.iter().map(|&x| plane.image(x)).collect::<Vec<_>>());
        }
        pairs.iter().fold(AxisBox::around(&points), |all, pair| all.with(&around_edge(*pair, x)))
    };
    let extremes = places.iter().flat_map(|place| place.extremes()).map(meshed);
    let all = extremes.fold(AxisBox::around(std::iter::empty::<Point>()), |all, x| all.with(&images(x)));
    0.5 * norm(sub(all.upper, all.lower))
}

/// The box around all images of a point in a sector between two planes, which lie on a circle; around the point alone where they meet
/// at right angles.
fn around_edge([first, second]: [&Side; 2], x: Point) -> AxisBox {
    let (Some(n), Some(m)) = (first.normal, second.normal) else { return AxisBox::around([x]) };
    let cosine = dot(n, m);
    if cosine.abs() <= RIGHT {
        return AxisBox::around([x]);
    }
    // The foot of the point on the edge has both distances zero.
    let [b, c] = [first, second].map(|side| side.beyond(x));
    let square_sine = 1.0 - cosine * cosine;
    let [s, t] = [(cosine * c - b) / square_sine, (cosine * b - c) / square_sine];
    let foot: Point = std::array::from_fn(|d| x[d] + s * n[d] + t * m[d]);
    let radius = norm(sub(x, foot));
    let axis = cross(n, m);
    let half = axis.map(|own| radius * (1.0 - own * own / square_sine).max(0.0).sqrt());
    AxisBox { lower: sub(foot, half), upper: add(foot, half) }
}

/// Planes that are reached and have the whole mesh on one side, each once, but for those that face each other.
fn planes_of_symmetry<'s>(mesh: &Mesh, sides: &'s [Side], rounding: f64) -> Vec<&'s Side> {
    let reached = || sides.iter().filter(|side| side.standing >= Standing::Observed && side.normal.is_some());
    let is_lone = |side: &Side| !reached().any(|other| side.is_opposite(other));
    let is_outermost = |side: &Side| mesh.points().iter().all(|&x| side.beyond(x) <= rounding);
    let mut planes: Vec<&Side> = Vec::new();
    for side in reached().filter(|side| is_lone(side) && is_outermost(side)) {
        if !planes.iter().any(|other| side.is_coplanar(other, rounding)) {
            planes.push(side);
        }
    }
    planes
}

/// Whether coils and matter reach from one side of the mesh to the one that faces it.
fn is_plane_device(sides: &[Side]) -> bool {
    let reached = || sides.iter().filter(|side| side.standing == Standing::Reached);
    reached().any(|side| reached().any(|other| side.is_opposite(other)))
}

/// The regions at whose places B is observed, each once.
pub(crate) fn observed_regions(config: &Config, mesh: &Mesh) -> BTreeSet<RegionId> {
    let is_of_places = |kind: ObjectiveKind| {
        use ObjectiveKind::{FieldComponent, FluxDensitySquared, Homogeneity, TargetField};
        matches!(kind, FluxDensitySquared | TargetField | FieldComponent | Homogeneity)
    };
    let own = functionals(config).into_iter().filter(|(_, own)| is_of_places(own.kind));
    own.filter_map(|(_, own)| mesh.topology().region(own.region.as_ref()?).ok()).collect()
}

/// The places at which B is observed: regions, expansions, and the points of probes. What fills the mesh, of which `whole` is the
/// box, is no place.
fn observed(config: &Config, mesh: &Mesh, whole: &AxisBox) -> Vec<Site> {
    let topology = mesh.topology();
    let regions = observed_regions(config, mesh).into_iter();
    let of_regions = regions.map(|region| Site::of_nodes(mesh, nodes_of(mesh, topology.elements_of(region))));
    let of_probes = config.probes.iter().map(|probe| Site::new(Form::Probe(probe.points.clone())));
    let of_expansions =
        config.multipoles.iter().map(|set| Site::new(Form::Ball { center: set.center, radius: set.radius }));
    let fills_mesh = |place: &Site| {
        let AxisBox { lower, upper } = place.bounds;
        (0..3).all(|d| lower[d] <= whole.lower[d] && upper[d] >= whole.upper[d])
    };
    of_regions.chain(of_probes).chain(of_expansions).filter(|place| !fills_mesh(place)).collect()
}

/// Where windings, conductors and matter are, region by region, and conductors that their surfaces replace.
fn sources(model: &FieldModel, mesh: &Mesh) -> Vec<Site> {
    let mut by_region: BTreeMap<usize, Vec<ElementId>> = BTreeMap::new();
    for e in wound_or_matter(model) {
        by_region.entry(model.topology().region_of()[e.index()].index()).or_default().push(e);
    }
    let meshed = by_region.into_values().map(|elements| Site::of_nodes(mesh, nodes_of(mesh, elements)));
    let surfaces = model.conductors().iter().map(|conductor| &conductor.surface);
    let replaced = surfaces.filter(|surface| !surface.is_empty());
    let replaced = replaced.map(|surface| Site::of_nodes(mesh, surface.as_flattened().iter().copied()));
    let analytic = model.coils().iter().filter_map(|coil| match &coil.shape {
        CoilShape::Racetrack(coil) => Some(Site::new(Form::Winding(coil.edges()))),
        CoilShape::Region(_) | CoilShape::Solid(_) => None,
    });
    analytic.chain(meshed).chain(replaced).collect()
}

/// The nodes of elements, of each its four.
fn nodes_of(mesh: &Mesh, elements: Vec<ElementId>) -> impl Iterator<Item = NodeId> {
    elements.into_iter().flat_map(|e| mesh.topology().tets()[e.index()])
}

/// Elements of windings and conductors, or that are not air.
fn wound_or_matter(model: &FieldModel) -> impl Iterator<Item = ElementId> {
    let is_matter = |&e: &ElementId| {
        let region = model.topology().region_of()[e.index()];
        model.materials()[region.index()] != Material::AIR || model.remanence_of(e) != [0.0; 3]
    };
    let wound = model.coils().iter().filter_map(|coil| coil.shape.region_current());
    let wound = wound.flat_map(|current| current.current_density().iter().map(|(e, _)| *e));
    wound.chain(model.topology().elements().filter(is_matter))
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
            confined: None,
        };
        let text = at(0.29, NEAR).described().expect("it is near");
        assert!(
            text.contains("`x_max` is 290.000 mm from coils, matter and what is observed, 2.9 times"),
            "{text}"
        );
        assert_eq!(at(0.31, NEAR).described(), None);
        assert!(at(0.5, NEAR_IN_A_PLANE).described().is_some());
        assert_eq!(at(0.53, NEAR_IN_A_PLANE).described(), None);
    }
}
