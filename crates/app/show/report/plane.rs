//! A plane to draw on: points in space become places in millimetres.

use fluxmorph_geometry::box_tree::AxisBox;
use fluxmorph_geometry::tet4::{Point, cross, dot, norm, sub};
use fluxmorph_optimizer::design::Mirror;

use crate::config::{Config, MeshConfig};

/// A normal this near to a coordinate axis is taken for it.
const ALIGNED: f64 = 1e-6;

/// A plane with axes along which places count.
#[derive(Clone, Debug)]
pub(super) struct Plane {
    /// Unit vectors: to the right, upwards, towards the reader.
    pub(super) right: Point,
    pub(super) up: Point,
    pub(super) normal: Point,
    origin: Point,
    /// Names of the axes with their unit.
    pub(super) titles: [String; 2],
}

impl Plane {
    /// The plane across a normal, the longer extent of some points to the right.
    pub(super) fn across(normal: Point, points: &[Point]) -> Self {
        let length = norm(normal).max(f64::MIN_POSITIVE);
        let normal = normal.map(|c| c / length);
        if let Some(axis) = (0..3).find(|&d| normal[d].abs() > 1.0 - ALIGNED) {
            let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
            let [right, up] =
                if extent(points, unit(a)) >= extent(points, unit(b)) { [a, b] } else { [b, a] };
            return Self::of_axes(right, up, axis);
        }
        let projected = |axis: usize| {
            let along = unit(axis);
            let flat: Point = std::array::from_fn(|d| along[d] - normal[axis] * normal[d]);
            let length = norm(flat);
            (length > 0.1).then(|| flat.map(|c| c / length))
        };
        let candidates = (0..3).filter_map(projected);
        let right = candidates.max_by(|a, b| extent(points, *a).total_cmp(&extent(points, *b)));
        let right = right.unwrap_or(unit(0));
        let up = cross(normal, right);
        let origin = middle(points);
        let titles = ["along the surface [mm]", "across it [mm]"].map(str::to_owned);
        Self { right, up, normal, origin, titles }
    }

    /// The plane of two coordinate axes, seen along the third.
    pub(super) fn of_axes(right: usize, up: usize, normal: usize) -> Self {
        let titles = [right, up].map(|axis| format!("{} [mm]", ["x", "y", "z"][axis]));
        Self { right: unit(right), up: unit(up), normal: unit(normal), origin: [0.0; 3], titles }
    }

    /// Place of a point [mm].
    pub(super) fn flat(&self, point: Point) -> [f64; 2] {
        let offset = sub(point, self.origin);
        [self.right, self.up].map(|axis| 1e3 * dot(axis, offset))
    }
}

/// Planes across which the device continues, where the configuration leaves no doubt: the generator of the shield makes a
/// quarter, `x ≥ 0` and `y ≥ 0`.
pub(super) fn mirrors(config: &Config) -> Vec<Mirror> {
    match config.mesh {
        MeshConfig::Shield(_) => [0, 1].map(|axis| Mirror { axis, at: 0.0 }).to_vec(),
        _ => Vec::new(),
    }
}

/// Every combination of mirrors, the empty one first.
pub(super) fn images(mirrors: &[Mirror]) -> Vec<Vec<Mirror>> {
    (0..1usize << mirrors.len())
        .map(|set| (0..mirrors.len()).filter(|k| set >> k & 1 == 1).map(|k| mirrors[k]).collect())
        .collect()
}

/// A point as some mirrors show it.
pub(super) fn mirrored(image: &[Mirror], point: Point) -> Point {
    image.iter().fold(point, |point, mirror| mirror.image(point))
}

/// Least and greatest of some numbers; infinite, and the wrong way round, where there are none.
pub(super) fn extremes(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    values.into_iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
}

/// A range of values; one that only rounding makes wider than a point with a tenth of the value on both sides.
pub(super) fn with_room([low, high]: [f64; 2]) -> [f64; 2] {
    let room = if high - low < 1e-9 * high.abs().max(1e-6) { 0.1 * high.abs().max(1e-3) } else { 0.0 };
    [low - room, high + room]
}

/// Lower and upper corner around points.
pub(super) fn bounds(points: impl IntoIterator<Item = Point>) -> [Point; 2] {
    let AxisBox { lower, upper } = AxisBox::around(points);
    [lower, upper]
}

fn middle(points: &[Point]) -> Point {
    let [low, high] = bounds(points.iter().copied());
    let middle: Point = std::array::from_fn(|d| 0.5 * (low[d] + high[d]));
    if middle.iter().all(|c| c.is_finite()) { middle } else { [0.0; 3] }
}

fn unit(axis: usize) -> Point {
    std::array::from_fn(|d| if d == axis { 1.0 } else { 0.0 })
}

fn extent(points: &[Point], along: Point) -> f64 {
    let [low, high] = extremes(points.iter().map(|p| dot(*p, along)));
    high - low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longer_side_lies_to_the_right() {
        let points = [[0.0, 0.0, -0.01], [0.12, 0.24, -0.01]];
        let plane = Plane::across([0.0, 0.0, -1.0], &points);
        assert_eq!(plane.titles, ["y [mm]", "x [mm]"]);
        assert_eq!(plane.flat([0.12, 0.24, 5.0]), [240.0, 120.0]);
    }

    #[test]
    fn an_oblique_plane_keeps_lengths() {
        let points = [[0.0; 3], [0.1, 0.0, 0.1], [0.0, 0.2, 0.0]];
        let plane = Plane::across([-1.0, 0.0, 1.0], &points);
        let [a, b] = [plane.flat(points[0]), plane.flat(points[1])];
        let length = ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sqrt();
        assert!((length - 100.0 * 2f64.sqrt()).abs() < 1e-9, "{length}");
        assert!(dot(plane.right, plane.up).abs() < 1e-12 && dot(plane.up, plane.normal).abs() < 1e-12);
    }

    #[test]
    fn two_mirrors_have_four_images() {
        let mirrors = [0, 1].map(|axis| Mirror { axis, at: 0.0 });
        let images: Vec<Point> = images(&mirrors).iter().map(|i| mirrored(i, [1.0, 2.0, 3.0])).collect();
        assert_eq!(images, [[1.0, 2.0, 3.0], [-1.0, 2.0, 3.0], [1.0, -2.0, 3.0], [-1.0, -2.0, 3.0]]);
    }
}
