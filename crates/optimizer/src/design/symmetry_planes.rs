//! The planes that cut the design surface, where the model ends and the device does not, and the images that it has in them.
//!
//! Planes of constant coordinate are seen one an axis at a time. Where one lies askew, as in a wedge of a device that is round or has
//! poles, images have images: all products of the reflections are taken that come near the surface again. The facets of a wall that
//! is round are no planes of a device, nor is one that meets the others at an angle that does not divide 180 degrees: they have no
//! image.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use fluxmorph_geometry::box_tree::AxisBox;
use fluxmorph_geometry::curved::SMOOTH;
use fluxmorph_geometry::tet4::{Point, area_vector, centroid, dot, norm, sub};
use fluxmorph_geometry::{Mesh, NodeId};

use super::{Mirror, dominant_axis};

/// Largest component of a unit normal across its axis for a plane of constant coordinate: coordinates in files carry 6 or more digits.
const ALIGNED: f64 = 1e-6;

/// Largest distance of a node from a plane that it is on, in parts of the mesh's size: a plane is known by its largest triangle.
const ON_PLANE: f64 = 1e-4;

/// Largest deviation of the angle between two planes from one that divides 180 degrees [rad].
const ANGLE_TOLERANCE: f64 = 2e-4;

/// Wedges that half a turn has at most: thinner ones are none whose images could be told apart.
const MOST_PARTS: f64 = 90.0;

/// Most images of the device, itself counted; of more none is taken askew.
const MOST_IMAGES: usize = 1000;

/// Largest difference of a component of two rotations that are one: what the tolerance of an angle adds up to over half a turn of the
/// thinnest wedges, and a third of what two images differ by there.
const SAME_ROTATION: f64 = 2e-2;

/// The same of two translations, in parts of the surface's size, beside what their rotations differ by.
const SAME_PLACE: f64 = 1e-6;

/// A plane in any direction.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Askew {
    /// Unit normal, away from the surface.
    normal: Point,
    /// `normal · x` on it [m].
    at: f64,
}

impl Askew {
    /// The plane with a normal through a point, seen from another.
    fn new(normal: Point, through: Point, from: Point) -> Self {
        let sign = if dot(normal, sub(from, through)) > 0.0 { -1.0 } else { 1.0 };
        let normal = normal.map(|c| sign * c / norm(normal));
        Self { normal, at: dot(normal, through) }
    }

    /// That of a constant coordinate.
    fn aligned(plane: &Mirror, from: Point) -> Self {
        let unit: Point = std::array::from_fn(|d| f64::from(u8::from(d == plane.axis)));
        Self::new(unit, unit.map(|c| c * plane.at), from)
    }

    /// Whether both may be symmetry planes of one device: the angle between them divides 180 degrees, or they face each other.
    fn fits(&self, other: &Self) -> bool {
        let angle = (-dot(self.normal, other.normal)).clamp(-1.0, 1.0).acos();
        if angle < ANGLE_TOLERANCE {
            return true;
        }
        let parts = (PI / angle).round();
        (2.0..=MOST_PARTS).contains(&parts) && (angle - PI / parts).abs() < ANGLE_TOLERANCE
    }
}

/// The planes that cut a surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct SymmetryPlanes {
    aligned: Vec<Mirror>,
    askew: Vec<Askew>,
}

/// A node of the surface or one of its images.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub(super) node: usize,
    /// [m]
    pub(super) place: Point,
    /// In which it moves.
    pub(super) direction: Point,
}

/// Triangles in one plane askew.
struct Wall {
    plane: Askew,
    /// The sum of their area vectors away from the surface [m²].
    area: Point,
    /// The sum of their centroids by their areas [m³].
    moment: Point,
    nodes: BTreeSet<NodeId>,
}

/// One image of the device: a rotation or a reflection, and a translation [m].
#[derive(Clone, Copy, Debug)]
struct Isometry {
    rows: [Point; 3],
    shift: Point,
}

impl Isometry {
    const IDENTITY: Self =
        Self { rows: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], shift: [0.0; 3] };

    fn of_vector(&self, x: Point) -> Point {
        self.rows.map(|row| dot(row, x))
    }

    fn of_point(&self, x: Point) -> Point {
        let turned = self.of_vector(x);
        std::array::from_fn(|d| turned[d] + self.shift[d])
    }

    /// What it makes of a node.
    fn of(&self, seen: &Seen) -> Seen {
        let &Seen { node, place, direction } = seen;
        Seen { node, place: self.of_point(place), direction: self.of_vector(direction) }
    }

    /// The reflection of this image in a plane.
    fn reflected(&self, plane: &Askew) -> Self {
        let Askew { normal: n, at } = *plane;
        let columns: [Point; 3] = std::array::from_fn(|j| self.rows.map(|row| row[j]));
        let along = columns.map(|column| dot(n, column));
        let off = dot(n, self.shift) - at;
        Self {
            rows: std::array::from_fn(|i| std::array::from_fn(|j| self.rows[i][j] - 2.0 * n[i] * along[j])),
            shift: std::array::from_fn(|i| self.shift[i] - 2.0 * n[i] * off),
        }
    }

    /// Whether both are one image, about a point and to a share of a length.
    fn is(&self, other: &Self, centre: Point, size: f64) -> bool {
        let turned = (0..3).map(|i| norm(sub(self.rows[i], other.rows[i]))).fold(0.0, f64::max);
        let moved = norm(sub(self.of_point(centre), other.of_point(centre)));
        turned < SAME_ROTATION && moved < SAME_PLACE * size + 3.0 * turned * (size + norm(centre))
    }
}

impl SymmetryPlanes {
    /// The planes of triangles where the model ends, each once, of which the surface is on one side, around a point.
    pub(super) fn new<'t>(
        mesh: &Mesh,
        triangles: impl Iterator<Item = &'t [NodeId; 3]>,
        inside: Point,
    ) -> Self {
        let [lower, upper] = mesh.bounding_box();
        let mut aligned: Vec<Mirror> = Vec::new();
        let mut askew = Vec::new();
        for triangle in triangles {
            let vertices = triangle.map(|n| mesh.point(n));
            let area = area_vector(vertices);
            let axis = dominant_axis(area);
            if (0..3).any(|d| d != axis && area[d].abs() > ALIGNED * norm(area)) {
                askew.push((norm(area), *triangle));
                continue;
            }
            let (at, tolerance) = (centroid(vertices)[axis], ALIGNED * (upper[axis] - lower[axis]));
            if !aligned.iter().any(|plane| plane.axis == axis && (plane.at - at).abs() <= tolerance) {
                aligned.push(Mirror { axis, at });
            }
        }
        // The largest first, which know a plane best.
        askew.sort_by(|a, b| b.0.total_cmp(&a.0));
        let walls = walls(mesh, askew.iter().map(|(_, triangle)| triangle), inside, norm(sub(upper, lower)));
        let mut accepted: Vec<Askew> = aligned.iter().map(|plane| Askew::aligned(plane, inside)).collect();
        for plane in flat(walls, inside) {
            if accepted.iter().all(|other| other.fits(&plane)) {
                accepted.push(plane);
            }
        }
        let askew = accepted.split_off(aligned.len());
        Self { aligned, askew }
    }

    /// All nodes, and their images as far as one comes within a distance [m] of the others.
    pub(super) fn with_images(&self, places: &[Point], directions: &[Point], distance: f64) -> Vec<Seen> {
        let own: Vec<Seen> = (0..places.len())
            .map(|node| Seen { node, place: places[node], direction: directions[node] })
            .collect();
        if self.askew.is_empty() {
            return self.aligned_images(own, distance);
        }
        self.images(&own, distance).unwrap_or_else(|| self.aligned_images(own, distance))
    }

    /// In the planes within the distance, at most one plane an axis at a time.
    fn aligned_images(&self, mut all: Vec<Seen>, distance: f64) -> Vec<Seen> {
        for axis in 0..3 {
            let mut images = Vec::new();
            for plane in self.aligned.iter().filter(|plane| plane.axis == axis) {
                for seen in all.iter().filter(|seen| (seen.place[axis] - plane.at).abs() < distance) {
                    let (place, direction) = (plane.image(seen.place), plane.reflect(seen.direction));
                    images.push(Seen { node: seen.node, place, direction });
                }
            }
            all.extend(images);
        }
        all
    }

    /// Every product of the reflections that brings a point near the box around all; `None` where there are too many.
    fn images(&self, own: &[Seen], distance: f64) -> Option<Vec<Seen>> {
        let around = AxisBox::around(own.iter().map(|seen| seen.place).collect::<Vec<_>>());
        let AxisBox { lower, upper } = around;
        let (centre, size) = (std::array::from_fn(|d| 0.5 * (lower[d] + upper[d])), norm(sub(upper, lower)));
        let near = around.grown(distance);
        let aligned = self.aligned.iter().map(|plane| Askew::aligned(plane, centre));
        let planes: Vec<Askew> = aligned.chain(self.askew.iter().copied()).collect();
        let mut isometries = vec![Isometry::IDENTITY];
        let mut all = own.to_vec();
        let mut next = 0;
        while next < isometries.len() {
            for plane in &planes {
                let image = isometries[next].reflected(plane);
                if isometries.iter().any(|known| known.is(&image, centre, size)) {
                    continue;
                }
                let before = all.len();
                all.extend(own.iter().map(|seen| image.of(seen)).filter(|seen| near.contains(seen.place)));
                if all.len() > before {
                    isometries.push(image);
                }
                if isometries.len() > MOST_IMAGES {
                    return None;
                }
            }
            next += 1;
        }
        Some(all)
    }
}

/// Triangles by the planes that they lie in.
fn walls<'t>(
    mesh: &Mesh,
    triangles: impl Iterator<Item = &'t [NodeId; 3]>,
    inside: Point,
    size: f64,
) -> Vec<Wall> {
    let mut walls: Vec<Wall> = Vec::new();
    for triangle in triangles {
        let vertices = triangle.map(|n| mesh.point(n));
        let is_on = |wall: &Wall| {
            vertices.iter().all(|x| (dot(wall.plane.normal, *x) - wall.plane.at).abs() < ON_PLANE * size)
        };
        let known = walls.iter().position(is_on).unwrap_or_else(|| {
            let plane = Askew::new(area_vector(vertices), centroid(vertices), inside);
            walls.push(Wall { plane, area: [0.0; 3], moment: [0.0; 3], nodes: BTreeSet::new() });
            walls.len() - 1
        });
        let wall = &mut walls[known];
        let (area, middle) = (area_vector(vertices), centroid(vertices));
        let sign = dot(area, wall.plane.normal).signum();
        for d in 0..3 {
            wall.area[d] += sign * area[d];
            wall.moment[d] += norm(area) * middle[d];
        }
        wall.nodes.extend(triangle);
    }
    walls
}

/// The planes of walls that are none of one that is round, the largest first.
fn flat(walls: Vec<Wall>, inside: Point) -> Vec<Askew> {
    let goes_on =
        |a: &Wall, b: &Wall| dot(a.plane.normal, b.plane.normal) > SMOOTH && !a.nodes.is_disjoint(&b.nodes);
    let is_flat = |k: usize| (0..walls.len()).all(|other| other == k || !goes_on(&walls[k], &walls[other]));
    let mut planes: Vec<(f64, Askew)> = (0..walls.len())
        .filter(|&k| is_flat(k))
        .map(|k| {
            let Wall { area, moment, .. } = &walls[k];
            let size = norm(*area);
            (size, Askew::new(*area, moment.map(|c| c / size), inside))
        })
        .collect();
    planes.sort_by(|a, b| b.0.total_cmp(&a.0));
    planes.into_iter().map(|(_, plane)| plane).collect()
}
