//! The planes that cut the design surface, where the model ends and the device does not, and the images that it has in them.
//!
//! Planes of constant coordinate are seen one an axis at a time. Where one lies askew, as in a wedge of a device that is round or has
//! poles, images have images: all products of the reflections are taken that come near the surface again. Planes that meet at an angle
//! that does not divide 180 degrees are those of no device, as the facets of a curved wall are; a plane askew among them has no
//! image.

use std::f64::consts::PI;

use fluxmorph_geometry::tet4::{Point, dot, norm, sub};

use super::Mirror;

/// Largest deviation of the angle between two planes from one that divides 180 degrees [rad]: coordinates in files carry 6 or more
/// digits.
const ANGLE_TOLERANCE: f64 = 1e-4;

/// Most images of the device that are taken, itself counted: of a wedge of three degrees all of them.
const MOST_IMAGES: usize = 120;

/// Largest difference of two images that are one, in parts of a vector of unit length and of the surface's size.
const SAME: f64 = 1e-6;

/// A plane in any direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Askew {
    /// Unit normal, away from the surface.
    normal: Point,
    /// `normal · x` on it [m].
    at: f64,
}

impl Askew {
    /// The plane with a unit normal through a point, seen from another.
    pub(super) fn new(normal: Point, through: Point, from: Point) -> Self {
        let sign = if dot(normal, sub(from, through)) > 0.0 { -1.0 } else { 1.0 };
        let normal = normal.map(|c| sign * c);
        Self { normal, at: dot(normal, through) }
    }

    /// Whether both are one plane, to a share of a length.
    fn is(&self, other: &Self, size: f64) -> bool {
        norm(sub(self.normal, other.normal)) < SAME && (self.at - other.at).abs() < SAME * size
    }

    /// Whether both may be symmetry planes of one device: the angle between them divides 180 degrees, or they are parallel.
    fn fits(&self, other: &Self) -> bool {
        let angle = (-dot(self.normal, other.normal)).clamp(-1.0, 1.0).acos();
        if angle < ANGLE_TOLERANCE {
            return true;
        }
        let parts = (PI / angle).round();
        parts >= 2.0 && (angle - PI / parts).abs() < ANGLE_TOLERANCE
    }
}

/// The planes that cut a surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct SymmetryPlanes {
    aligned: Vec<Mirror>,
    askew: Vec<Askew>,
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
        let turned = (0..3).all(|i| norm(sub(self.rows[i], other.rows[i])) < SAME);
        turned && norm(sub(self.of_point(centre), other.of_point(centre))) < SAME * size
    }
}

impl SymmetryPlanes {
    /// Adds a plane of constant coordinate, once.
    pub(super) fn add_aligned(&mut self, plane: Mirror, tolerance: f64) {
        let is = |other: &Mirror| other.axis == plane.axis && (other.at - plane.at).abs() <= tolerance;
        if !self.aligned.iter().any(is) {
            self.aligned.push(plane);
        }
    }

    /// Adds a plane askew, once, for a surface of a size [m].
    pub(super) fn add_askew(&mut self, plane: Askew, size: f64) {
        if !self.askew.iter().any(|other| other.is(&plane, size)) {
            self.askew.push(plane);
        }
    }

    /// Drops the planes askew where they are those of no device that has all of these planes; the surface is around a point.
    pub(super) fn settled(mut self, from: Point) -> Self {
        let all = self.all(from);
        let fit = |k: usize| all[..k].iter().all(|other| other.fits(&all[k]));
        if !(0..all.len()).all(fit) {
            self.askew.clear();
        }
        self
    }

    /// Every plane with its normal away from a point.
    fn all(&self, from: Point) -> Vec<Askew> {
        let of = |plane: &Mirror| {
            let unit: Point = std::array::from_fn(|d| f64::from(u8::from(d == plane.axis)));
            Askew::new(unit, unit.map(|c| c * plane.at), from)
        };
        self.aligned.iter().map(of).chain(self.askew.iter().copied()).collect()
    }

    /// Points and vectors with their images, as far as a point comes within a distance [m] of the others: `(number, point, vector)`.
    pub(super) fn with_images(
        &self,
        places: &[Point],
        vectors: &[Point],
        distance: f64,
    ) -> Vec<(usize, Point, Point)> {
        let own = (0..places.len()).map(|i| (i, places[i], vectors[i])).collect();
        if self.askew.is_empty() { self.aligned_images(own, distance) } else { self.images(own, distance) }
    }

    /// In the planes within the distance, at most one plane an axis at a time.
    fn aligned_images(
        &self,
        mut all: Vec<(usize, Point, Point)>,
        distance: f64,
    ) -> Vec<(usize, Point, Point)> {
        for axis in 0..3 {
            let mut images = Vec::new();
            for plane in self.aligned.iter().filter(|plane| plane.axis == axis) {
                let near = all.iter().filter(|(_, place, _)| (place[axis] - plane.at).abs() < distance);
                images.extend(near.map(|&(i, place, v)| (i, plane.image(place), plane.reflect(v))));
            }
            all.extend(images);
        }
        all
    }

    /// Every product of the reflections that brings a point near the box around all.
    fn images(&self, own: Vec<(usize, Point, Point)>, distance: f64) -> Vec<(usize, Point, Point)> {
        let end = |d: usize, of: fn(f64, f64) -> f64| own.iter().map(|(_, x, _)| x[d]).reduce(of);
        let bound = |of: fn(f64, f64) -> f64| std::array::from_fn(|d| end(d, of).unwrap_or_default());
        let [low, high]: [Point; 2] = [bound(f64::min), bound(f64::max)];
        let is_near = |x: Point| (0..3).all(|d| x[d] > low[d] - distance && x[d] < high[d] + distance);
        let (centre, size) = (std::array::from_fn(|d| 0.5 * (low[d] + high[d])), norm(sub(high, low)));
        let planes = self.all(centre);
        let mut isometries = vec![Isometry::IDENTITY];
        let mut all = own.clone();
        let mut next = 0;
        while next < isometries.len() {
            for plane in &planes {
                let image = isometries[next].reflected(plane);
                let is_known = isometries.iter().any(|known| known.is(&image, centre, size));
                if is_known || isometries.len() == MOST_IMAGES {
                    continue;
                }
                let before = all.len();
                let of = |&(i, x, v): &_| (i, image.of_point(x), image.of_vector(v));
                all.extend(own.iter().map(of).filter(|(_, x, _)| is_near(*x)));
                if all.len() > before {
                    isometries.push(image);
                }
            }
            next += 1;
        }
        all
    }
}
