//! The flat racetrack coil with mitred or round corners: its `T` and its current density, at a point.
//!
//! About the axis direction `e`, `T = T_e e` inside the coil's height: `J0 W` inside the window, falling linearly to
//! zero across the winding of width `W`, with `J0 = N I/(W · height)`. So `J = curl T` has the constant magnitude `J0`
//! and runs anticlockwise about `e` for positive ampere-turns. With `ρ` the distance from the window's rectangle
//! (mitred: in the maximum norm of the two directions, round: Euclidean from the rounded rectangle), `T = J0 (W − ρ)`.
//! A rectangular coil is one with mitred corners, a circular one has corners as round as its window. The integral of
//! `T` over an element is in [`super::moment`].

use std::f64::consts::FRAC_PI_2;

use fluxmorph_geometry::tet4::{Point, add, centroid};

use super::frame::Frame;
use crate::error::SolverError;

/// How the straight sides of the winding meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Corner {
    /// Along the diagonal: the outer contour is a rectangle too.
    Mitred,
    /// In concentric arcs.
    Round {
        /// Radius of the inner arc [m], positive.
        inner_radius: f64,
    },
}

/// A flat racetrack coil.
#[derive(Clone, Debug, PartialEq)]
pub struct Racetrack {
    pub(super) frame: Frame,
    /// Half sizes of the window along the frame's two directions [m].
    pub(super) half_window: [f64; 2],
    pub(super) width: f64,
    pub(super) height: f64,
    pub(super) corner: Corner,
}

/// Share of the winding's width and height that counts as its skin: a face of the mesh that lies on the winding's
/// surface does not cut it, whatever the rounding of its nodes.
const SKIN: f64 = 1e-6;

/// Cosine of six degrees.
const STRAIGHT_ON: f64 = 0.994_522;

/// In so many pieces goes a straight side of [`Racetrack::edges`].
const STRAIGHT: usize = 8;

/// The same of a quarter of a circle.
const ARC: usize = 16;

impl Racetrack {
    /// A coil about the coordinate axis `axis` (0, 1, 2) through `centre` [m].
    ///
    /// `half_window` [m]: half sizes of the window in the two directions that follow the axis cyclically (x, y for z).
    ///
    /// # Errors
    /// As [`Racetrack::in_frame`].
    pub fn new(
        centre: Point,
        axis: usize,
        half_window: [f64; 2],
        width: f64,
        height: f64,
        corner: Corner,
    ) -> Result<Self, SolverError> {
        Self::in_frame(Frame::coordinate(centre, axis)?, half_window, width, height, corner)
    }

    /// A coil in a frame; `half_window` [m] along its two directions.
    ///
    /// # Errors
    /// [`SolverError::Parameter`] for a size that is not positive or an inner radius larger than the window.
    pub fn in_frame(
        frame: Frame,
        half_window: [f64; 2],
        width: f64,
        height: f64,
        corner: Corner,
    ) -> Result<Self, SolverError> {
        check_sizes(&[
            ("half_window", half_window[0]),
            ("half_window", half_window[1]),
            ("width", width),
            ("height", height),
        ])?;
        if let Corner::Round { inner_radius } = corner
            && !(inner_radius > 0.0 && inner_radius <= half_window[0].min(half_window[1]))
        {
            let expected = "it must be positive and at most the smaller half of the window; use corner = \"mitred\" for sharp \
                            ones";
            return Err(SolverError::parameter("inner_radius", format!("{inner_radius} m"), expected));
        }
        Ok(Self { frame, half_window, width, height, corner })
    }

    /// A circular coil of the inner radius `radius` [m].
    ///
    /// # Errors
    /// [`SolverError::Parameter`] for a size that is not positive.
    pub fn circular(frame: Frame, radius: f64, width: f64, height: f64) -> Result<Self, SolverError> {
        check_sizes(&[("radius", radius)])?;
        Self::in_frame(frame, [radius; 2], width, height, Corner::Round { inner_radius: radius })
    }

    /// Distance outwards from the window's contour (negative inside), in the norm of the corner.
    pub(super) fn distance(&self, local: Point) -> f64 {
        let [a, b] = self.half_window;
        let (x, y) = (local[0].abs(), local[1].abs());
        match self.corner {
            Corner::Mitred => (x - a).max(y - b),
            Corner::Round { inner_radius: r } => {
                let (dx, dy) = (x - (a - r), y - (b - r));
                // `sqrt`, not `hypot`: squares of a coil's lengths are in the range of numbers, and `moment` takes thousands of these an
                // element.
                (dx.max(0.0).powi(2) + dy.max(0.0).powi(2)).sqrt() + dx.max(dy).min(0.0) - r
            }
        }
    }

    /// `∇ρ` in the winding, in local coordinates; the mitred corner's diagonal counts to its first side.
    fn outwards(&self, local: Point) -> [f64; 2] {
        let [a, b] = self.half_window;
        let sign = [local[0].signum(), local[1].signum()];
        let (x, y) = (local[0].abs(), local[1].abs());
        let [p, q] = match self.corner {
            Corner::Mitred if x - a >= y - b => [1.0, 0.0],
            Corner::Mitred => [0.0, 1.0],
            Corner::Round { inner_radius: r } => {
                let (dx, dy) = ((x - (a - r)).max(0.0), (y - (b - r)).max(0.0));
                let length = dx.hypot(dy);
                // Inside the window's core, where ρ < 0 and nothing flows.
                if length == 0.0 { [0.0, 0.0] } else { [dx / length, dy / length] }
            }
        };
        [sign[0] * p, sign[1] * q]
    }

    /// Unit vector that `T` points along.
    pub fn axis(&self) -> Point {
        self.frame.axis()
    }

    /// Where the coil sits and how it is turned.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// `T_e` [A/m] at a point for one ampere-turn.
    pub fn potential(&self, x: Point) -> f64 {
        let local = self.frame.local(x);
        if 2.0 * local[2].abs() > self.height {
            return 0.0;
        }
        (self.width - self.distance(local)).clamp(0.0, self.width) / (self.width * self.height)
    }

    /// Whether a convex body with these vertices is in the window, up to the ends of the coil: `T` is constant in it.
    pub(super) fn encloses(&self, vertices: &[Point]) -> bool {
        vertices.iter().map(|x| self.frame.local(*x)).all(|local| {
            self.distance(local) <= SKIN * self.width && 2.0 * local[2].abs() <= (1.0 + SKIN) * self.height
        })
    }

    /// Whether one point of a triangle stands for all of it: it lies in the window, beyond the coil, or in the winding where the current
    /// turns by less than six degrees. The distance outwards is convex: nowhere more than at one of the vertices, nor less than its
    /// tangent says.
    pub(super) fn is_alike_in(&self, vertices: &[Point; 3]) -> bool {
        let local = vertices.map(|x| self.frame.local(x));
        let middle = centroid(local);
        let [p, q] = self.outwards(middle);
        let [least, _] = span(local.map(|x| p * (x[0] - middle[0]) + q * (x[1] - middle[1])));
        let reach = local.map(|x| (x[0] - middle[0]).hypot(x[1] - middle[1])).into_iter().fold(0.0, f64::max);
        let tangent = if p == 0.0 && q == 0.0 { -reach } else { least };
        let nearest = self.distance(middle) + tangent;
        let farthest = span(local.map(|x| self.distance(x)))[1];
        let [lower, upper] = span(local.map(|x| 2.0 * x[2] / self.height));
        let is_beyond = nearest >= (1.0 - SKIN) * self.width || lower >= 1.0 - SKIN || upper <= SKIN - 1.0;
        let is_between_ends = lower >= -1.0 - SKIN && upper <= 1.0 + SKIN;
        let is_straight =
            || local.iter().map(|x| self.outwards(*x)).all(|[a, b]| a * p + b * q > STRAIGHT_ON);
        let is_one_part =
            farthest <= SKIN * self.width || (nearest >= 0.0 && farthest <= self.width && is_straight());
        is_beyond || is_between_ends && is_one_part
    }

    /// Greatest `T_e` [A/m] for one ampere-turn: that of the window.
    pub fn plateau(&self) -> f64 {
        1.0 / self.height
    }

    /// `J = curl T = ∇T_e × e` [A/m²] at a point for one ampere-turn; zero outside the winding and on its surface.
    pub fn current_density(&self, x: Point) -> Point {
        let local = self.frame.local(x);
        let rho = self.distance(local);
        let skin = SKIN * self.width;
        let inside =
            rho > skin && rho < self.width - skin && 2.0 * local[2].abs() < (1.0 - SKIN) * self.height;
        if !inside {
            return [0.0; 3];
        }
        let [p, q] = self.outwards(local);
        let magnitude = 1.0 / (self.width * self.height);
        self.frame.vector([-q * magnitude, p * magnitude, 0.0])
    }

    /// Half sizes of the box that holds the coil, along the frame's directions [m].
    pub(super) fn extent(&self) -> Point {
        [self.half_window[0] + self.width, self.half_window[1] + self.width, 0.5 * self.height]
    }

    /// Lower and upper corner of the box along the coordinates that holds the coil [m].
    pub fn bounding_box(&self) -> [Point; 2] {
        let (extent, centre) = (self.extent(), self.frame.centre());
        let unit = |k: usize| self.frame.vector(std::array::from_fn(|d| if d == k { 1.0 } else { 0.0 }));
        let units = [unit(0), unit(1), unit(2)];
        let half = |d: usize| (0..3).map(|k| units[k][d].abs() * extent[k]).sum::<f64>();
        [-1.0, 1.0].map(|side| std::array::from_fn(|d| centre[d] + side * half(d)))
    }

    /// Edges of a winding of flat facets inscribed in this one [m]: its contours at both ends, and what joins these along the axis.
    /// A straight side has eight of them and a quarter of a round corner sixteen, so that they leave out .12 % of its radius.
    pub fn edges(&self) -> Vec<[Point; 2]> {
        let place = |local: Point| add(self.frame.centre(), self.frame.vector(local));
        let mut edges = Vec::new();
        for contour in [0.0, self.width].map(|outwards| self.contour(outwards)) {
            for (k, &[x, y]) in contour.iter().enumerate() {
                let [p, q] = contour[(k + 1) % contour.len()];
                let [lower, upper] = [-0.5, 0.5].map(|side| side * self.height);
                edges.extend([lower, upper].map(|z| [place([x, y, z]), place([p, q, z])]));
                edges.push([place([x, y, lower]), place([x, y, upper])]);
            }
        }
        edges
    }

    /// Points around the window at a distance outwards from it, anticlockwise, along the frame's two directions [m].
    fn contour(&self, outwards: f64) -> Vec<[f64; 2]> {
        let (radius, arc) = match self.corner {
            Corner::Mitred => (0.0, 0),
            Corner::Round { inner_radius } => (inner_radius + outwards, ARC),
        };
        let centre = self.half_window.map(|half| half + outwards - radius);
        let signs = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
        let quarter = |k: usize| -> Vec<[f64; 2]> {
            let on_arc = |i: usize| {
                let angle = FRAC_PI_2 * (k as f64 + i as f64 / arc.max(1) as f64);
                [
                    signs[k][0] * centre[0] + radius * angle.cos(),
                    signs[k][1] * centre[1] + radius * angle.sin(),
                ]
            };
            (0..=arc).map(on_arc).collect()
        };
        let corners = [0, 1, 2, 3].map(quarter);
        let mut points = Vec::new();
        for k in 0..4 {
            let (from, to) = (corners[k][arc], corners[(k + 1) % 4][0]);
            points.extend_from_slice(&corners[k][..arc]);
            points.extend((0..STRAIGHT).map(|i| {
                let share = i as f64 / STRAIGHT as f64;
                [0, 1].map(|d| from[d] + share * (to[d] - from[d]))
            }));
        }
        points
    }

    /// The smaller of width and height [m]: the size of the winding's detail.
    pub(super) fn detail(&self) -> f64 {
        self.width.min(self.height)
    }
}

/// The least and the greatest of some numbers.
fn span(numbers: [f64; 3]) -> [f64; 2] {
    let [a, b, c] = numbers;
    [a.min(b).min(c), a.max(b).max(c)]
}

fn check_sizes(sizes: &[(&str, f64)]) -> Result<(), SolverError> {
    match sizes.iter().find(|(_, value)| !(*value > 0.0 && value.is_finite())) {
        Some((what, value)) => {
            Err(SolverError::parameter(*what, format!("{value} m"), "a coil needs a positive size"))
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use fluxmorph_geometry::tet4::{cross, dot, norm, sub};

    use super::*;

    fn paper_coil(corner: Corner) -> Racetrack {
        Racetrack::new([0.0, 0.0, 0.06], 2, [0.06, 0.16], 0.02, 0.04, corner).unwrap()
    }

    fn tilted() -> Frame {
        Frame::new([0.01, 0.02, -0.03], [1.0, 2.0, -0.5], Some([0.0, 1.0, 1.0])).unwrap()
    }

    #[test]
    fn the_potential_falls_linearly_across_the_winding() {
        let coil = paper_coil(Corner::Mitred);
        let plateau = 1.0 / 0.04;
        let near = |x: Point, t: f64| (coil.potential(x) - t).abs() < 1e-12 * plateau;
        assert!(near([0.0, 0.0, 0.06], plateau));
        assert!(near([0.07, 0.0, 0.06], 0.5 * plateau));
        assert!(near([0.0, -0.175, 0.05], 0.25 * plateau));
        assert_eq!(coil.potential([0.0, 0.0, 0.039]), 0.0);
        assert_eq!(coil.potential([0.081, 0.0, 0.06]), 0.0);
    }

    #[test]
    fn the_current_density_is_the_curl_of_the_potential() {
        let round = Corner::Round { inner_radius: 0.02 };
        let coils = [
            Racetrack::in_frame(tilted(), [0.06, 0.16], 0.02, 0.04, Corner::Mitred).unwrap(),
            Racetrack::in_frame(tilted(), [0.06, 0.16], 0.02, 0.04, round).unwrap(),
            Racetrack::circular(tilted(), 0.05, 0.02, 0.04).unwrap(),
        ];
        let h = 1e-6;
        for coil in coils {
            let mut met = 0;
            for i in 0..1000 {
                let s = |k: f64| (f64::from(i) * k).sin();
                let local = [0.09 * s(1.7), 0.19 * s(2.3), 0.019 * s(3.1)];
                let x: Point = std::array::from_fn(|d| coil.frame.centre()[d] + coil.frame.vector(local)[d]);
                // Away from kinks of T, where the difference quotient means nothing.
                let rho = coil.distance(local);
                let kink = (local[0].abs() - local[1].abs() + 0.1).abs() < 1e-3;
                if [rho, rho - 0.02].iter().any(|d| d.abs() < 1e-4) || kink {
                    continue;
                }
                let gradient: Point = std::array::from_fn(|d| {
                    let at = |s: f64| {
                        let mut y = x;
                        y[d] += s;
                        coil.potential(y)
                    };
                    (at(h) - at(-h)) / (2.0 * h)
                });
                let curl = cross(gradient, coil.axis());
                let current = coil.current_density(x);
                let scale = 1.0 / (0.02 * 0.04);
                assert!(norm(sub(curl, current)) < 1e-4 * scale, "{local:?}: {curl:?} {current:?}");
                met += usize::from(norm(current) > 0.0);
            }
            assert!(met > 20, "{met} points in the winding");
        }
    }

    #[test]
    fn the_current_through_a_half_plane_is_the_line_integral_of_the_potential() {
        // Stokes: ∫J·n dS over a cross-section of the winding = ∮T·dl around it = T_window × height = NI.
        let n = 200;
        for (coil, angle) in [
            (Racetrack::in_frame(tilted(), [0.03, 0.05], 0.02, 0.04, Corner::Mitred).unwrap(), 0.0),
            (Racetrack::in_frame(tilted(), [0.03, 0.05], 0.02, 0.04, Corner::Mitred).unwrap(), 0.4),
            (Racetrack::circular(tilted(), 0.04, 0.02, 0.04).unwrap(), 1.1),
        ] {
            let (s, c) = f64::sin_cos(angle);
            let normal = coil.frame.vector([-s, c, 0.0]);
            let (reach, height) = (0.1, 0.05);
            let mut current = 0.0;
            for i in 0..n {
                for k in 0..n {
                    let r = reach * (f64::from(i) + 0.5) / f64::from(n);
                    let z = height * ((f64::from(k) + 0.5) / f64::from(n) - 0.5);
                    let offset = coil.frame.vector([r * c, r * s, z]);
                    let x = std::array::from_fn(|d| coil.frame.centre()[d] + offset[d]);
                    current += dot(coil.current_density(x), normal) * reach * height / f64::from(n * n);
                }
            }
            // One cell more or less at each end of the winding: 2 % of it.
            assert!((current - 1.0).abs() < 0.03, "{current}");
            assert!((coil.potential(coil.frame.centre()) * 0.04 - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn edges_follow_the_contours_of_the_winding() {
        let round = Corner::Round { inner_radius: 0.02 };
        for coil in [
            Racetrack::in_frame(tilted(), [0.06, 0.16], 0.02, 0.04, Corner::Mitred).unwrap(),
            Racetrack::in_frame(tilted(), [0.06, 0.16], 0.02, 0.04, round).unwrap(),
            Racetrack::circular(tilted(), 0.05, 0.02, 0.04).unwrap(),
        ] {
            let edges = coil.edges();
            for x in edges.as_flattened() {
                let local = coil.frame.local(*x);
                let outwards = coil.distance(local);
                assert!(outwards.abs() < 1e-12 || (outwards - 0.02).abs() < 1e-12, "{outwards}");
                assert!((local[2].abs() - 0.02).abs() < 1e-12);
            }
            // Area of the outer contour at the upper end, by the edges that go along it.
            let along = |edge: &&[Point; 2]| {
                let ends = edge.map(|x| coil.frame.local(x));
                ends.iter().all(|x| coil.distance(*x) > 0.01 && x[2] > 0.0)
            };
            let area = |[a, b]: &[Point; 2]| {
                let (a, b) = (coil.frame.local(*a), coil.frame.local(*b));
                0.5 * (a[0] * b[1] - a[1] * b[0])
            };
            let [a, b] = coil.half_window.map(|half| 2.0 * (half + coil.width));
            let missing = match coil.corner {
                Corner::Mitred => 0.0,
                Corner::Round { inner_radius } => {
                    (4.0 - std::f64::consts::PI) * (inner_radius + coil.width).powi(2)
                }
            };
            let sum: f64 = edges.iter().filter(along).map(area).sum();
            assert!((sum / (a * b - missing) - 1.0).abs() < 2e-3, "{sum}");
        }
    }

    #[test]
    fn a_coil_of_zero_size_is_refused() {
        let err = Racetrack::new([0.0; 3], 2, [0.06, 0.16], 0.0, 0.04, Corner::Mitred).unwrap_err();
        assert!(err.to_string().starts_with("width = 0 m"), "{err}");
        let corner = Corner::Round { inner_radius: 0.07 };
        assert!(Racetrack::new([0.0; 3], 2, [0.06, 0.16], 0.02, 0.04, corner).is_err());
        let err = Racetrack::circular(tilted(), -0.1, 0.02, 0.04).unwrap_err();
        assert!(err.to_string().starts_with("radius = -0.1 m"), "{err}");
    }
}
