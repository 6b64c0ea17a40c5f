//! The flat racetrack (rectangular) coil with mitred or round corners.
//!
//! About the axis direction `e`, `T = T_e e` inside the coil's height: `J0 W` inside the window, falling linearly to
//! zero across the winding of width `W`, with `J0 = N I/(W · height)`. So `J = curl T` has the constant magnitude `J0`
//! and runs anticlockwise about `e` for positive ampere-turns. With `ρ` the distance from the window's rectangle
//! (mitred: in the maximum norm of the two directions, round: Euclidean from the rounded rectangle), `T = J0 (W − ρ)`.

use fluxmorph_geometry::tet4::{Point, centroid, volume};

use super::cut::{Plane, for_each_piece};
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
    centre: Point,
    axis: usize,
    half_window: [f64; 2],
    width: f64,
    height: f64,
    corner: Corner,
}

/// Subdivisions of the pieces in round corners, where `T` is smooth but not linear.
const CORNER_LEVELS: usize = 2;

impl Racetrack {
    /// A coil about the coordinate axis `axis` (0, 1, 2) through `centre` [m].
    ///
    /// `half_window` [m]: half sizes of the window in the two directions that follow the axis cyclically (x, y for z).
    ///
    /// # Errors
    /// [`SolverError::Parameter`] for a size that is not positive or an inner radius larger than the window.
    pub fn new(
        centre: Point,
        axis: usize,
        half_window: [f64; 2],
        width: f64,
        height: f64,
        corner: Corner,
    ) -> Result<Self, SolverError> {
        let refuse = |what: &str, value: f64, expected: &str| SolverError::Parameter {
            what: what.to_owned(),
            value: format!("{value} m"),
            expected: expected.to_owned(),
        };
        for (what, value) in [
            ("half_window", half_window[0]),
            ("half_window", half_window[1]),
            ("width", width),
            ("height", height),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(refuse(what, value, "a coil needs a positive size"));
            }
        }
        if let Corner::Round { inner_radius } = corner
            && !(inner_radius > 0.0 && inner_radius <= half_window[0].min(half_window[1]))
        {
            return Err(refuse(
                "inner_radius",
                inner_radius,
                "it must be positive and at most the smaller half of the window; use corner = \"mitred\" for sharp ones",
            ));
        }
        if axis > 2 {
            return Err(SolverError::Parameter {
                what: "axis".to_owned(),
                value: axis.to_string(),
                expected: "0, 1 or 2 for x, y or z".to_owned(),
            });
        }
        Ok(Self { centre, axis, half_window, width, height, corner })
    }

    /// Coordinates relative to the coil: the two directions of the window, then along the axis.
    fn local(&self, x: Point) -> Point {
        std::array::from_fn(|i| {
            let d = (self.axis + 1 + i) % 3;
            x[d] - self.centre[d]
        })
    }

    /// Distance outwards from the window's contour (negative inside), in the norm of the corner.
    fn distance(&self, local: Point) -> f64 {
        let [a, b] = self.half_window;
        let (x, y) = (local[0].abs(), local[1].abs());
        match self.corner {
            Corner::Mitred => (x - a).max(y - b),
            Corner::Round { inner_radius: r } => {
                let (dx, dy) = (x - (a - r), y - (b - r));
                dx.max(0.0).hypot(dy.max(0.0)) + dx.max(dy).min(0.0) - r
            }
        }
    }

    /// The coordinate axis that `T` points along.
    pub fn axis(&self) -> usize {
        self.axis
    }

    /// `T_e` [A/m] at a point for one ampere-turn.
    pub fn potential(&self, x: Point) -> f64 {
        let local = self.local(x);
        if 2.0 * local[2].abs() > self.height {
            return 0.0;
        }
        (self.width - self.distance(local)).clamp(0.0, self.width) / (self.width * self.height)
    }

    /// Planes between which `T` is linear (apart from round corners), in local coordinates.
    fn kinks(&self) -> Vec<Plane> {
        let [a, b] = self.half_window;
        let w = self.width;
        let axis_planes = |d: usize, distances: &[f64]| -> Vec<Plane> {
            let mut normal = [0.0; 3];
            normal[d] = 1.0;
            distances
                .iter()
                .flat_map(|&offset| [Plane { normal, offset }, Plane { normal, offset: -offset }])
                .collect()
        };
        let mut planes = axis_planes(2, &[0.5 * self.height]);
        planes.extend(axis_planes(0, &[a + w, a]));
        planes.extend(axis_planes(1, &[b + w, b]));
        match self.corner {
            Corner::Mitred => {
                for normal in [[1.0, -1.0, 0.0], [1.0, 1.0, 0.0]] {
                    planes.extend([a - b, b - a].map(|offset| Plane { normal, offset }));
                }
            }
            Corner::Round { inner_radius: r } => {
                planes.extend(axis_planes(0, &[a - r]));
                planes.extend(axis_planes(1, &[b - r]));
            }
        }
        planes
    }

    /// Whether `T` is curved somewhere on a piece that no kink crosses.
    fn in_round_corner(&self, local: Point) -> bool {
        match self.corner {
            Corner::Mitred => false,
            Corner::Round { inner_radius: r } => {
                local[0].abs() > self.half_window[0] - r && local[1].abs() > self.half_window[1] - r
            }
        }
    }

    /// `∫T dV` over a tetrahedron [A m²] for one ampere-turn: exact where `T` is piecewise linear, by subdivision in
    /// round corners.
    pub fn moment(&self, vertices: [Point; 4]) -> Point {
        let local = vertices.map(|x| self.local(x));
        let extent = [self.half_window[0] + self.width, self.half_window[1] + self.width, 0.5 * self.height];
        let misses =
            |d: usize| local.iter().all(|x| x[d] >= extent[d]) || local.iter().all(|x| x[d] <= -extent[d]);
        if (0..3).any(misses) {
            return [0.0; 3];
        }
        let tolerance = 1e-9 * self.width.min(self.height);
        let scale = 1.0 / (self.width * self.height);
        let linear = |piece: [Point; 4]| {
            let c = centroid(piece);
            if 2.0 * c[2].abs() > self.height {
                return 0.0;
            }
            volume(piece).abs() * (self.width - self.distance(c)).clamp(0.0, self.width) * scale
        };
        let mut integral = 0.0;
        for_each_piece(local, &self.kinks(), tolerance, &mut |piece| {
            integral += if self.in_round_corner(centroid(piece)) {
                refined(piece, CORNER_LEVELS, &|p| self.smooth(p) * scale)
            } else {
                linear(piece)
            };
        });
        let mut moment = [0.0; 3];
        moment[self.axis] = integral;
        moment
    }

    /// `T` times the winding's cross-section in a round corner at the points of a four-point rule, exact for
    /// quadratics.
    fn smooth(&self, piece: [Point; 4]) -> f64 {
        const NEAR: f64 = 0.585_410_196_624_968_5;
        const FAR: f64 = 0.138_196_601_125_010_5;
        let value = |near: usize| {
            let x: Point = std::array::from_fn(|d| {
                (0..4).map(|a| if a == near { NEAR } else { FAR } * piece[a][d]).sum()
            });
            if 2.0 * x[2].abs() > self.height {
                return 0.0;
            }
            (self.width - self.distance(x)).clamp(0.0, self.width)
        };
        0.25 * volume(piece).abs() * (0..4).map(value).sum::<f64>()
    }
}

/// A quadrature refined by splitting the tet into eight, `levels` times.
fn refined(tet: [Point; 4], levels: usize, rule: &impl Fn([Point; 4]) -> f64) -> f64 {
    if levels == 0 {
        return rule(tet);
    }
    let mid = |a: usize, b: usize| -> Point { std::array::from_fn(|d| 0.5 * (tet[a][d] + tet[b][d])) };
    let (m01, m02, m03) = (mid(0, 1), mid(0, 2), mid(0, 3));
    let (m12, m13, m23) = (mid(1, 2), mid(1, 3), mid(2, 3));
    let [x0, x1, x2, x3] = tet;
    [
        [x0, m01, m02, m03],
        [m01, x1, m12, m13],
        [m02, m12, x2, m23],
        [m03, m13, m23, x3],
        [m01, m02, m03, m13],
        [m01, m02, m13, m12],
        [m02, m03, m13, m23],
        [m02, m12, m23, m13],
    ]
    .into_iter()
    .map(|child| refined(child, levels - 1, rule))
    .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paper_coil(corner: Corner) -> Racetrack {
        Racetrack::new([0.0, 0.0, 0.06], 2, [0.06, 0.16], 0.02, 0.04, corner).unwrap()
    }

    /// A box around the coil, cut into tets that ignore the coil.
    fn integral_over_box(coil: &Racetrack, n: usize) -> f64 {
        let corner = |i: [usize; 3]| -> Point {
            let size = [0.2, 0.4, 0.1];
            let origin = [-0.1, -0.2, 0.01];
            std::array::from_fn(|d| origin[d] + size[d] * i[d] as f64 / n as f64)
        };
        let mut sum = 0.0;
        for cell in 0..n * n * n {
            let base = [cell / n / n, cell / n % n, cell % n];
            for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
                let mut at = base;
                let mut tet = [corner(at); 4];
                for (step, d) in order.into_iter().enumerate() {
                    at[d] += 1;
                    tet[step + 1] = corner(at);
                }
                if volume(tet) < 0.0 {
                    tet.swap(0, 1);
                }
                sum += coil.moment(tet)[2];
            }
        }
        sum
    }

    #[test]
    fn the_mitred_integral_is_exact_on_any_mesh() {
        // ∫T dV per ampere-turn = (1/W) ∫ area of the contour at distance s, s from 0 to W.
        let coil = paper_coil(Corner::Mitred);
        let (a, b, w) = (0.06, 0.16, 0.02);
        let exact = 4.0 * (a * b + (a + b) * w / 2.0 + w * w / 3.0);
        for n in [3, 4] {
            let sum = integral_over_box(&coil, n);
            assert!((sum / exact - 1.0).abs() < 1e-12, "{sum} {exact}");
        }
    }

    #[test]
    fn the_round_integral_is_accurate_on_a_coarse_mesh() {
        let r = 0.022;
        let coil = paper_coil(Corner::Round { inner_radius: r });
        let (a, b, w) = (0.06, 0.16, 0.02);
        let pi = std::f64::consts::PI;
        // Contour at distance s: 4ab − (4 − π) r² + (4(a+b) − (8 − 2π) r) s + π s².
        let exact = 4.0 * a * b - (4.0 - pi) * r * r
            + (4.0 * (a + b) - (8.0 - 2.0 * pi) * r) * w / 2.0
            + pi * w * w / 3.0;
        let sum = integral_over_box(&coil, 5);
        assert!((sum / exact - 1.0).abs() < 1e-4, "{sum} {exact}");
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
    fn a_coil_of_zero_size_is_refused() {
        let err = Racetrack::new([0.0; 3], 2, [0.06, 0.16], 0.0, 0.04, Corner::Mitred).unwrap_err();
        assert!(err.to_string().starts_with("width = 0 m"), "{err}");
        let corner = Corner::Round { inner_radius: 0.07 };
        assert!(Racetrack::new([0.0; 3], 2, [0.06, 0.16], 0.02, 0.04, corner).is_err());
    }
}
