//! Expansions of the flux density around an axis or a point, from values on a circle or a sphere.
//!
//! Across the axis of a long magnet `B_y + i B_x = Σ (b_n + i a_n)(z/r)^(n−1)`, so that on the circle of reference radius `r`
//! the radial component is `Σ b_n sin nθ + a_n cos nθ`: normal and skew harmonics `b_n`, `a_n` [T], `n = 1` the dipole (A. Jain,
//! Basic theory of magnets, CERN 98-05). In a ball of air any component is harmonic: along the axis
//! `B = Σ (ρ/r)^n P_nm(cos θ) (c_nm cos mφ + s_nm sin mφ)` with associated Legendre functions without normalisation or phase
//! (Roméo and Hoult, Magn. Reson. Med. 1 (1984) 44), in [T] at the radius `r`. Both are linear in B at points: the trapezoidal
//! rule around the axis, that of Gauss along it, with as many points as keep terms of fifteen orders above those that are asked for
//! apart from these.
//! Lives here: points and weights. Does not live here: the field at them ([`crate::recovery`]), functions of the coefficients
//! ([`crate::functional`]).

use std::f64::consts::PI;
use std::fmt;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, centroid};

use crate::coil::Frame;

/// Orders above the highest one asked for whose terms do not disturb those. At a share `q` of the distance to the sources what is
/// above is of the size `q^16`, 1e-5 half way there.
const UNDISTURBED: usize = 15;

/// A term of an expansion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Harmonic {
    /// `b_n`, `n ≥ 1`.
    Normal(usize),
    /// `a_n`, `n ≥ 1`.
    Skew(usize),
    /// `c_nm`, `m ≤ n`.
    Cosine(usize, usize),
    /// `s_nm`, `1 ≤ m ≤ n`.
    Sine(usize, usize),
}

/// As it is written: `b3`, `a1`, `c2_0`, `s2_1`.
impl fmt::Display for Harmonic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Normal(n) => write!(f, "b{n}"),
            Self::Skew(n) => write!(f, "a{n}"),
            Self::Cosine(n, m) => write!(f, "c{n}_{m}"),
            Self::Sine(n, m) => write!(f, "s{n}_{m}"),
        }
    }
}

/// Where an expansion holds: inside a circle, or in a ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Domain {
    frame: Frame,
    /// [m]
    radius: f64,
    is_ball: bool,
}

/// Points, and each term as a linear function of B at them.
#[derive(Clone, Debug)]
pub struct Expansion {
    /// Where it holds.
    pub domain: Domain,
    /// Where B is taken [m].
    pub points: Vec<Point>,
    /// `(term, w)`: the coefficient is `Σ w·B` over the points, `w` of shape `(n_points, 3)` [1].
    pub terms: Vec<(Harmonic, Vec<Point>)>,
}

/// A point of a frame, in units of a reference radius.
fn place(frame: &Frame, radius: f64, local: Point) -> Point {
    let (centre, offset) = (frame.centre(), frame.vector(local.map(|c| radius * c)));
    std::array::from_fn(|d| centre[d] + offset[d])
}

impl Harmonic {
    /// The field of a coefficient of one, at a place in units of the reference radius: in a circle across its axis, in a ball along
    /// it alone.
    fn field(self, [x, y, z]: Point) -> Point {
        let (distance, around) = (x.hypot(y), y.atan2(x));
        let plane = |n: usize, phase: f64| {
            let (size, angle) = (distance.powi(n as i32 - 1), (n as f64 - 1.0) * around + phase);
            [size * angle.sin(), size * angle.cos(), 0.0]
        };
        let solid = |n: usize, m: usize| {
            let radius = distance.hypot(z);
            let along = if radius > 0.0 { z / radius } else { 1.0 };
            radius.powi(n as i32) * legendre(n, m, along)
        };
        match self {
            Self::Normal(n) => plane(n, 0.0),
            Self::Skew(n) => plane(n, 0.5 * PI),
            Self::Cosine(n, m) => [0.0, 0.0, solid(n, m) * (m as f64 * around).cos()],
            Self::Sine(n, m) => [0.0, 0.0, solid(n, m) * (m as f64 * around).sin()],
        }
    }
}

impl Domain {
    /// The centre [m].
    pub fn centre(&self) -> Point {
        self.frame.centre()
    }

    /// The reference radius [m].
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Whether it is a ball, and not a circle.
    pub fn is_ball(&self) -> bool {
        self.is_ball
    }

    /// Whether an element's middle lies in the ball, or in the circle while the element reaches across its plane.
    pub fn meets(&self, vertices: [Point; 4]) -> bool {
        let [x, y, z] = self.frame.local(centroid(vertices));
        if self.is_ball {
            return x.hypot(y).hypot(z) <= self.radius;
        }
        let heights = vertices.map(|vertex| self.frame.local(vertex)[2]);
        let is_above = heights.map(|height| height >= 0.0);
        x.hypot(y) <= self.radius && is_above.contains(&true) && is_above.contains(&false)
    }

    /// What is left of a field [T] at a place [m] without some terms with their coefficients [T]: both components across the axis
    /// of a circle, the one along the axis of a ball.
    pub fn remainder(&self, terms: &[(Harmonic, c64)], place: Point, b: [c64; 3]) -> [Option<c64>; 2] {
        let local = self.frame.local(place).map(|c| c / self.radius);
        let components = if self.is_ball { [Some(2), None] } else { [Some(0), Some(1)] };
        components.map(|component| {
            let d = component?;
            let mut unit = [0.0; 3];
            unit[d] = 1.0;
            let direction = self.frame.vector(unit);
            let own: c64 = (0..3).map(|i| b[i] * direction[i]).sum();
            Some(own - terms.iter().map(|(term, c)| c * term.field(local)[d]).sum::<c64>())
        })
    }
}

impl Expansion {
    /// `b_1, a_1 … b_N, a_N` on the circle of a radius [m] around the axis of a frame.
    pub fn circle(frame: &Frame, radius: f64, order: usize) -> Self {
        // Orders n and n' are taken for each other where n + n' is the number of points.
        let count = 4 * (order + 1).max((2 * order + UNDISTURBED).div_ceil(4));
        let angles: Vec<f64> = (0..count).map(|k| 2.0 * PI * (k as f64 + 0.5) / count as f64).collect();
        let points = angles.iter().map(|a| place(frame, radius, [a.cos(), a.sin(), 0.0])).collect();
        let weights = |along: &dyn Fn(f64) -> f64| -> Vec<Point> {
            let of = |&a: &f64| {
                let radial = frame.vector([a.cos(), a.sin(), 0.0]);
                radial.map(|c| 2.0 / count as f64 * along(a) * c)
            };
            angles.iter().map(of).collect()
        };
        let pair = |n: usize| {
            let normal = (Harmonic::Normal(n), weights(&|a| (n as f64 * a).sin()));
            [normal, (Harmonic::Skew(n), weights(&|a| (n as f64 * a).cos()))]
        };
        let domain = Domain { frame: *frame, radius, is_ball: false };
        Self { domain, points, terms: (1..=order).flat_map(pair).collect() }
    }

    /// `c_nm, s_nm` up to `n = N` on the sphere of a radius [m], of the component along the axis of a frame.
    pub fn ball(frame: &Frame, radius: f64, order: usize) -> Self {
        // Exact of P_n P_n' up to n + n' = 2 (N + 8) − 1, and apart up to m + m' < 2 (N + 8).
        let (rule, around) = (gauss_legendre(order + UNDISTURBED.div_ceil(2)), 2 * order + UNDISTURBED + 1);
        let nodes: Vec<(f64, f64, f64)> = rule
            .iter()
            .flat_map(|&(u, w)| (0..around).map(move |k| (u, w, 2.0 * PI * (k as f64 + 0.5) / around as f64)))
            .collect();
        let point = |&(u, _, phi): &(f64, f64, f64)| {
            let across = (1.0 - u * u).sqrt();
            place(frame, radius, [across * phi.cos(), across * phi.sin(), u])
        };
        let axis = frame.axis();
        let weights = |n: usize, m: usize, around_axis: fn(f64) -> f64| -> Vec<Point> {
            // Σ over the rules of (P_nm cos mφ)² is the norm on the unit sphere: 4π/(2n + 1) (n + m)!/(n − m)!, halved for m > 0.
            let ratio: f64 = (n - m + 1..=n + m).map(|k| k as f64).product();
            let norm = 2.0 / (2 * n + 1) as f64 * ratio * if m == 0 { 1.0 } else { 0.5 };
            let of = |&(u, w, phi): &(f64, f64, f64)| {
                let value = w / around as f64 * legendre(n, m, u) * around_axis(m as f64 * phi) / norm;
                axis.map(|c| value * c)
            };
            nodes.iter().map(of).collect()
        };
        let mut terms = Vec::new();
        for n in 0..=order {
            for m in 0..=n {
                terms.push((Harmonic::Cosine(n, m), weights(n, m, f64::cos)));
                if m > 0 {
                    terms.push((Harmonic::Sine(n, m), weights(n, m, f64::sin)));
                }
            }
        }
        let domain = Domain { frame: *frame, radius, is_ball: true };
        Self { domain, points: nodes.iter().map(point).collect(), terms }
    }
}

/// `P_nm(u)` without normalisation or phase, by the recurrence in `n` (Abramowitz and Stegun, 8.5.3).
fn legendre(n: usize, m: usize, u: f64) -> f64 {
    let across = (1.0 - u * u).max(0.0).sqrt();
    let diagonal: f64 = (0..m).map(|k| (2 * k + 1) as f64 * across).product();
    let (mut before, mut value) = (0.0, diagonal);
    for k in m + 1..=n {
        let next = ((2 * k - 1) as f64 * u * value - (k + m - 1) as f64 * before) / (k - m) as f64;
        (before, value) = (value, next);
    }
    value
}

/// Nodes and weights of the Gauss–Legendre rule on [−1, 1], by Newton's method.
fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    let node = |k: usize| {
        let mut u = (PI * (k as f64 + 0.75) / (count as f64 + 0.5)).cos();
        let slope =
            |u: f64| count as f64 * (u * legendre(count, 0, u) - legendre(count - 1, 0, u)) / (u * u - 1.0);
        for _ in 0..10 {
            u -= legendre(count, 0, u) / slope(u);
        }
        (u, 2.0 / ((1.0 - u * u) * slope(u).powi(2)))
    };
    (0..count).map(node).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const RADIUS: f64 = 0.02;

    /// The axis is y; the first direction lies between z and x.
    fn frame() -> Frame {
        Frame::new([0.01, -0.02, 0.03], [0.0, 1.0, 0.0], Some([1.0, 0.0, 1.0])).expect("a frame")
    }

    fn coefficients(expansion: &Expansion, field: impl Fn(Point) -> Point) -> Vec<(Harmonic, f64)> {
        let dot = |a: Point, b: Point| (0..3).map(|d| a[d] * b[d]).sum::<f64>();
        let sum = |weights: &[Point]| {
            weights.iter().zip(&expansion.points).map(|(w, &x)| dot(*w, field(x))).sum::<f64>()
        };
        expansion.terms.iter().map(|(term, weights)| (*term, sum(weights))).collect()
    }

    /// `B_y + i B_x = Σ (b_n + i a_n) z^(n − 1)` is given back.
    #[test]
    fn multipoles_of_a_plane_field_are_its_own() {
        let frame = frame();
        let given: [(f64, f64); 4] = [(1.0, 0.02), (-0.3, 0.1), (0.05, -0.07), (0.001, 0.4)];
        let field = |x: Point| {
            let [x, y, _] = frame.local(x).map(|c| c / RADIUS);
            let (mut power, mut b) = ((1.0, 0.0), (0.0, 0.0));
            for (normal, skew) in given {
                b.1 += normal * power.0 - skew * power.1;
                b.0 += normal * power.1 + skew * power.0;
                power = (power.0 * x - power.1 * y, power.0 * y + power.1 * x);
            }
            frame.vector([b.0, b.1, 0.0])
        };
        for (term, found) in coefficients(&Expansion::circle(&frame, RADIUS, 6), field) {
            let exact = match term {
                Harmonic::Normal(n) => given.get(n - 1).map_or(0.0, |c| c.0),
                Harmonic::Skew(n) => given.get(n - 1).map_or(0.0, |c| c.1),
                _ => unreachable!("a circle has no others"),
            };
            assert!((found - exact).abs() < 1e-14, "{term:?}: {found} {exact}");
        }
    }

    /// A harmonic polynomial in Cartesian coordinates: `z`, `zx`, `xy` and the zonal `2z³ − 3z(x² + y²)`.
    #[test]
    fn spherical_harmonics_of_a_polynomial_are_its_own() {
        let frame = frame();
        let field = |p: Point| {
            let [x, y, z] = frame.local(p).map(|c| c / RADIUS);
            let along = 2.0 + 0.3 * z + 0.6 * z * x - 0.9 * x * y
                + 0.5 * (2.0 * z.powi(3) - 3.0 * z * (x * x + y * y));
            frame.vector([7.0, -8.0, along])
        };
        for (term, found) in coefficients(&Expansion::ball(&frame, RADIUS, 5), field) {
            // P_21 = 3 u √(1 − u²): zx = P_21 cos φ/3; P_22 = 3(1 − u²): xy = P_22 sin 2φ/6; P_3 = (5u³ − 3u)/2.
            let exact = match term {
                Harmonic::Cosine(0, 0) => 2.0,
                Harmonic::Cosine(1, 0) => 0.3,
                Harmonic::Cosine(2, 1) => 0.2,
                Harmonic::Sine(2, 2) => -0.15,
                Harmonic::Cosine(3, 0) => 1.0,
                _ => 0.0,
            };
            assert!((found - exact).abs() < 1e-13, "{term:?}: {found} {exact}");
        }
    }

    /// Of up to fifteen orders more no term is taken for one that is asked for.
    #[test]
    fn terms_that_are_not_asked_for_disturb_none() {
        let frame = frame();
        for (order, above) in
            [1, 2, 5].into_iter().flat_map(|order| (1..=UNDISTURBED).map(move |k| (order, k)))
        {
            let n = order + above;
            let of_circle = vec![Harmonic::Normal(n), Harmonic::Skew(n)];
            let of_ball = (0..=n).flat_map(|m| [Harmonic::Cosine(n, m), Harmonic::Sine(n, m)]).collect();
            for (expansion, terms) in [
                (Expansion::circle(&frame, RADIUS, order), of_circle),
                (Expansion::ball(&frame, RADIUS, order), of_ball),
            ] {
                for term in terms {
                    let field = |p: Point| frame.vector(term.field(frame.local(p).map(|c| c / RADIUS)));
                    // No value of P_nm is larger than the root of (n + m)!/(n − m)!.
                    let size = match term {
                        Harmonic::Cosine(n, m) | Harmonic::Sine(n, m) => {
                            (n - m + 1..=n + m).map(|k| k as f64).product::<f64>().sqrt()
                        }
                        Harmonic::Normal(_) | Harmonic::Skew(_) => 1.0,
                    };
                    let bar = 1e-12 * size;
                    for (other, found) in coefficients(&expansion, field) {
                        assert!(found.abs() <= bar, "{term} in {other} of {order} orders: {found:e}");
                    }
                }
            }
        }
    }

    /// Coefficients of a term's own field are one for it and zero for all others, so that nothing is left without it.
    #[test]
    fn without_its_own_terms_nothing_is_left_of_a_field() {
        let frame = frame();
        let complex = |b: Point| b.map(c64::from);
        for expansion in [Expansion::circle(&frame, RADIUS, 4), Expansion::ball(&frame, RADIUS, 3)] {
            for &(term, _) in &expansion.terms {
                let field = |p: Point| frame.vector(term.field(frame.local(p).map(|c| c / RADIUS)));
                for (other, found) in coefficients(&expansion, field) {
                    let exact = if other == term { 1.0 } else { 0.0 };
                    assert!((found - exact).abs() < 1e-12, "{term:?} {other:?}: {found}");
                }
                let inside = place(&frame, RADIUS, [0.3, -0.4, 0.2]);
                let terms = [(term, c64::from(1.0))];
                let left = expansion.domain.remainder(&terms, inside, complex(field(inside)));
                assert!(left.iter().flatten().all(|c| c.norm() < 1e-14), "{term:?}: {left:?}");
            }
        }
    }

    #[test]
    fn the_rule_of_gauss_has_its_degree() {
        for count in 1..12 {
            let rule = gauss_legendre(count);
            for power in 0..2 * count as i32 {
                let sum: f64 = rule.iter().map(|(u, w)| w * u.powi(power)).sum();
                let exact = if power % 2 == 0 { 2.0 / f64::from(power + 1) } else { 0.0 };
                assert!((sum - exact).abs() < 1e-14, "{count} {power}: {sum}");
            }
        }
    }
}
