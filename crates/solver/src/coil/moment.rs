//! The integral of a racetrack's `T` over a tetrahedron, weighted with its barycentric coordinates.
//!
//! `M_b = ∫_e T λ_b dV`: what a quadratic element needs, whose curl is linear; the sum of the four is `∫_e T dV`. The
//! element is cut at the kinks of `T` ([`super::cut`]); on a piece `T λ_b` is quadratic, and the four-point rule of
//! degree two (Hammer and Stroud 1956) is exact. In round corners `T` is curved, and its kinks are arcs: there pieces
//! are halved along all edges, deeper where an arc crosses them.

use fluxmorph_geometry::tet4::{Point, Tet4, add, centroid, dot, norm, sub, volume};

use super::cut::{Plane, for_each_piece};
use super::racetrack::{Corner, Racetrack};

/// `T λ_b` integrated, one value for each vertex [A m²]; the vector is along the coil's axis.
type Weights = [f64; 4];

/// Halvings of the pieces in round corners, where `T` is smooth but not linear.
const CORNER_LEVELS: usize = 2;

/// Halvings where an arc on which `T` has a kink crosses a piece.
const KINK_LEVELS: usize = 4;

/// Share of an element, or of a winding's passage through it, from which the winding is in it: above rounding and the facets of arcs.
const LEAST_SHARE: f64 = 1e-3;

/// Distance to a kink, relative to the smaller of the winding's width and height, below which a vertex is on it.
const ON_PLANE: f64 = 1e-9;

/// The same relative to the coordinates: some times what their sums and differences round, so that a cut puts its new vertex on
/// the plane whatever the size of the winding, and cutting ends.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// The coordinates of the four-point rule.
const NEAR: f64 = 0.585_410_196_624_968_5;
const FAR: f64 = 0.138_196_601_125_010_5;

impl Racetrack {
    /// `∫T λ_b dV` over a tetrahedron for its four barycentric coordinates [A m²], for one ampere-turn: exact where `T`
    /// is piecewise linear, by subdivision in round corners. Shape `(4, 3)`.
    pub fn moment(&self, vertices: [Point; 4]) -> [Point; 4] {
        let local = vertices.map(|x| self.frame.local(x));
        let integral = Integral { coil: self, origin: local[0], gradients: Tet4::new(local).gradients };
        let mut weights = [0.0; 4];
        self.for_each_part(local, &mut |piece| integral.add(piece, &mut weights));
        weights.map(|w| self.axis().map(|e| w * e))
    }

    /// The middle of the largest piece that the winding takes of a tetrahedron, cut as for [`Self::moment`]; `None` where all of them
    /// are next to nothing, as where a face lies along the winding's.
    pub fn wound_place(&self, vertices: [Point; 4]) -> Option<Point> {
        let local = vertices.map(|x| self.frame.local(x));
        let (mut wound, mut largest) = (0.0, (0.0, [0.0; 3]));
        self.for_each_part(local, &mut |piece| {
            let c = centroid(piece);
            if (0.0..self.width).contains(&self.distance(c)) {
                let volume = volume(piece).abs();
                wound += volume;
                if volume > largest.0 {
                    largest = (volume, c);
                }
            }
        });
        let whole = volume(vertices).abs();
        // A winding far thinner than the element has no share of it, but one of what it would take passing through.
        let passing = whole.min(self.width * self.height * whole.cbrt());
        (wound > LEAST_SHARE * passing).then(|| add(self.frame.centre(), self.frame.vector(largest.1)))
    }

    /// Calls `visit` for the pieces of a tetrahedron, in local coordinates, that lie between the ends of the coil and not far from
    /// its winding: cut at the kinks of `T`, and divided where it is curved.
    fn for_each_part(&self, local: [Point; 4], visit: &mut impl FnMut([Point; 4])) {
        let extent = self.extent();
        let misses =
            |d: usize| local.iter().all(|x| x[d] >= extent[d]) || local.iter().all(|x| x[d] <= -extent[d]);
        if (0..3).any(misses) {
            return;
        }
        let reach = local.iter().flatten().chain(&extent).fold(0.0_f64, |reach, c| reach.max(c.abs()));
        let tolerance = (ON_PLANE * self.detail()).max(ROUNDING * reach);
        for_each_piece(local, &self.kinks(), tolerance, &mut |piece| {
            let c = centroid(piece);
            if 2.0 * c[2].abs() > self.height {
                return;
            }
            if self.in_round_corner(c) {
                self.divide_curved(piece.map(|x| (x, self.distance(x))), 0, visit);
            } else {
                visit(piece);
            }
        });
    }

    /// Splits a piece of a round corner into eight as often as its curvature and kinks ask for; vertices come with their distance from
    /// the window.
    fn divide_curved(&self, piece: [(Point, f64); 4], level: usize, visit: &mut impl FnMut([Point; 4])) {
        let (vertices, rho) = (piece.map(|vertex| vertex.0), piece.map(|vertex| vertex.1));
        let (least, greatest) =
            (rho.iter().copied().fold(f64::INFINITY, f64::min), rho.iter().copied().fold(f64::MIN, f64::max));
        // ρ is convex: a piece with its vertices in the window lies in the window, where T is constant.
        if greatest <= 0.0 {
            return visit(vertices);
        }
        // ρ changes no faster than the place: a piece this far outside does not reach the winding.
        if greatest >= self.width && greatest - diameter(vertices) >= self.width {
            return;
        }
        let kinked = (least < 0.0) || (least < self.width && greatest > self.width);
        if level >= if kinked { KINK_LEVELS } else { CORNER_LEVELS } {
            return visit(vertices);
        }
        let middle = |(a, _): (Point, f64), (b, _): (Point, f64)| {
            let x = std::array::from_fn(|d| 0.5 * (a[d] + b[d]));
            (x, self.distance(x))
        };
        for child in eighths(piece, middle) {
            self.divide_curved(child, level + 1, visit);
        }
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
}

/// One element in the coil's coordinates, with its barycentric coordinates.
struct Integral<'a> {
    coil: &'a Racetrack,
    origin: Point,
    gradients: [Point; 4],
}

impl Integral<'_> {
    /// Adds a piece by the four-point rule.
    fn add(&self, piece: [Point; 4], weights: &mut Weights) {
        let coil = self.coil;
        let share = 0.25 * volume(piece).abs() / (coil.width * coil.height);
        for near in 0..4 {
            let x: Point = std::array::from_fn(|d| {
                (0..4).map(|a| if a == near { NEAR } else { FAR } * piece[a][d]).sum()
            });
            let value = share * (coil.width - coil.distance(x)).clamp(0.0, coil.width);
            let from_first = sub(x, self.origin);
            for (b, weight) in weights.iter_mut().enumerate() {
                let lambda = dot(self.gradients[b], from_first) + if b == 0 { 1.0 } else { 0.0 };
                *weight += value * lambda;
            }
        }
    }
}

/// The longest edge of a tetrahedron [m].
fn diameter(vertices: [Point; 4]) -> f64 {
    let edges = (1..4).flat_map(|a| (0..a).map(move |b| (a, b)));
    edges.map(|(a, b)| norm(sub(vertices[a], vertices[b]))).fold(0.0, f64::max)
}

/// The eight tetrahedra that the middles of the edges make; `middle` is that of two vertices.
fn eighths<V: Copy>(tet: [V; 4], middle: impl Fn(V, V) -> V) -> [[V; 4]; 8] {
    let mid = |a: usize, b: usize| middle(tet[a], tet[b]);
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
}

#[cfg(test)]
mod tests {
    use fluxmorph_geometry::tet4::point_at;

    use super::*;
    use crate::coil::frame::Frame;
    use crate::coil::total;

    fn paper_coil(corner: Corner) -> Racetrack {
        Racetrack::new([0.0, 0.0, 0.06], 2, [0.06, 0.16], 0.02, 0.04, corner).unwrap()
    }

    /// A box around a coil, cut into tets that ignore the coil; `∫T_e dV`.
    fn integral_over_box(coil: &Racetrack, origin: Point, size: Point, n: usize) -> f64 {
        let corner = |i: [usize; 3]| -> Point {
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
                sum += dot(total(coil.moment(tet)), coil.axis());
            }
        }
        sum
    }

    fn over_paper_box(coil: &Racetrack, n: usize) -> f64 {
        integral_over_box(coil, [-0.1, -0.2, 0.01], [0.2, 0.4, 0.1], n)
    }

    #[test]
    fn the_mitred_integral_is_exact_on_any_mesh() {
        // ∫T dV per ampere-turn = (1/W) ∫ area of the contour at distance s, s from 0 to W.
        let coil = paper_coil(Corner::Mitred);
        let (a, b, w) = (0.06, 0.16, 0.02);
        let exact = 4.0 * (a * b + (a + b) * w / 2.0 + w * w / 3.0);
        for n in [3, 4] {
            let sum = over_paper_box(&coil, n);
            assert!((sum / exact - 1.0).abs() < 1e-12, "{sum} {exact}");
        }
    }

    #[test]
    fn a_winding_within_an_element_is_found_and_one_along_its_face_is_not() {
        for corner in [Corner::Mitred, Corner::Round { inner_radius: 0.02 }] {
            let coil = Racetrack::new([0.0; 3], 2, [0.02, 0.02], 1e-3, 1e-3, corner).unwrap();
            let tet = |base: Point| -> [Point; 4] {
                std::array::from_fn(|k| {
                    std::array::from_fn(|d| base[d] + if k == d + 1 { 0.012 } else { 0.0 })
                })
            };
            // It passes between the corners and the middle.
            let crossed = tet([0.016, -0.006, -0.004]);
            assert!(crossed.iter().chain([&centroid(crossed)]).all(|x| coil.current_density(*x) == [0.0; 3]));
            let place = coil.wound_place(crossed).expect("a place");
            assert!(coil.current_density(place) != [0.0; 3], "{corner:?}: {place:?}");
            assert_eq!(coil.wound_place(tet([0.021, -0.006, -0.004])), None, "beside it");
            assert_eq!(coil.wound_place(tet([0.016, -0.006, 0.0005])), None, "above it");
            let thread = Racetrack::new([0.0; 3], 2, [0.02, 0.02], 1e-5, 1e-5, corner).unwrap();
            assert!(thread.wound_place(crossed).is_some(), "a winding of no share of the element");
            assert_eq!(coil.wound_place(tet([-0.006, -0.006, -0.006])), None, "in its window");
        }
    }

    #[test]
    fn a_winding_thinner_than_rounding_is_cut_in_finite_time() {
        for (width, height) in [(1e-8, 0.04), (0.02, 1e-9), (1e-12, 1e-12), (1e-15, 1e-18)] {
            for corner in [Corner::Mitred, Corner::Round { inner_radius: 0.022 }] {
                let coil = Racetrack::new([0.0, 0.0, 0.06], 2, [0.06, 0.16], width, height, corner).unwrap();
                let sum = over_paper_box(&coil, 5);
                assert!(sum.is_finite(), "{width} {height} {corner:?}: {sum}");
            }
        }
    }

    #[test]
    fn a_turned_coil_has_the_same_integral() {
        let frame = Frame::new([0.01, 0.02, -0.03], [1.0, 2.0, -0.5], Some([0.0, 1.0, 1.0])).unwrap();
        let (a, b, w) = (0.06, 0.16, 0.02);
        let exact = 4.0 * (a * b + (a + b) * w / 2.0 + w * w / 3.0);
        let coil = Racetrack::in_frame(frame, [a, b], w, 0.04, Corner::Mitred).unwrap();
        let sum = integral_over_box(&coil, [-0.25, -0.25, -0.28], [0.5; 3], 5);
        assert!((sum / exact - 1.0).abs() < 1e-12, "{sum} {exact}");
    }

    #[test]
    fn the_round_integral_is_accurate_on_a_coarse_mesh() {
        let pi = std::f64::consts::PI;
        let (a, b, w) = (0.06, 0.16, 0.02);
        let r = 0.022;
        // Contour at distance s: 4ab − (4 − π) r² + (4(a+b) − (8 − 2π) r) s + π s².
        let exact = 4.0 * a * b - (4.0 - pi) * r * r
            + (4.0 * (a + b) - (8.0 - 2.0 * pi) * r) * w / 2.0
            + pi * w * w / 3.0;
        let sum = over_paper_box(&paper_coil(Corner::Round { inner_radius: r }), 5);
        assert!((sum / exact - 1.0).abs() < 1e-5, "{sum} {exact}");

        let frame = Frame::coordinate([0.0, 0.0, 0.06], 2).unwrap();
        let coil = Racetrack::circular(frame, 0.06, 0.02, 0.04).unwrap();
        let exact = pi * (0.06 * 0.06 + 0.06 * w + w * w / 3.0);
        let sum = over_paper_box(&coil, 5);
        assert!((sum / exact - 1.0).abs() < 1e-4, "{sum} {exact}");
    }

    #[test]
    fn the_weights_match_brute_force_sampling() {
        let tet = [[0.03, 0.1, 0.03], [0.11, 0.12, 0.05], [0.05, 0.19, 0.045], [0.06, 0.14, 0.1]];
        let n = 60;
        for corner in [Corner::Mitred, Corner::Round { inner_radius: 0.03 }] {
            let coil = paper_coil(corner);
            let moment = coil.moment(tet);
            // Points of a regular barycentric grid, one in the middle of each upright cell of a reference cube that
            // lies in the tet.
            let mut sum = [0.0; 4];
            let mut count = 0.0;
            for (i, j, k) in (0..n).flat_map(|i| (0..n).flat_map(move |j| (0..n).map(move |k| (i, j, k)))) {
                let l = [i, j, k].map(|c| (f64::from(c) + 0.5) / f64::from(n));
                let first = 1.0 - l[0] - l[1] - l[2];
                if first < 0.0 {
                    continue;
                }
                let lambda = [first, l[0], l[1], l[2]];
                let t = coil.potential(point_at(&tet, &lambda));
                count += 1.0;
                for (s, lambda) in sum.iter_mut().zip(lambda) {
                    *s += t * lambda;
                }
            }
            let share = volume(tet) / count;
            for (exact, sampled) in moment.iter().zip(sum) {
                // The sampling itself: surface cells over all cells, 1/60 times a few.
                assert!((sampled * share / exact[2] - 1.0).abs() < 0.03, "{exact:?} {}", sampled * share);
                assert_eq!([exact[0], exact[1]], [0.0, 0.0]);
            }
        }
    }

    #[test]
    fn a_constant_potential_gives_every_vertex_a_quarter() {
        let coil = paper_coil(Corner::Mitred);
        let tet = [[0.0, 0.0, 0.05], [0.03, 0.0, 0.05], [0.0, 0.04, 0.05], [0.0, 0.0, 0.07]];
        for weight in coil.moment(tet) {
            assert!((weight[2] / (0.25 * volume(tet) / 0.04) - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn a_linear_potential_has_the_mass_matrix_weights() {
        // T = Σ T_a λ_a on a tet inside one side: ∫T λ_b = V/20 (Σ T_a + T_b).
        let coil = paper_coil(Corner::Mitred);
        let tet = [[0.061, 0.0, 0.05], [0.079, 0.01, 0.055], [0.065, 0.04, 0.05], [0.07, 0.0, 0.07]];
        let t = tet.map(|x| coil.potential(x));
        let sum: f64 = t.iter().sum();
        for (weight, t) in coil.moment(tet).iter().zip(t) {
            assert!((weight[2] / (volume(tet) / 20.0 * (sum + t)) - 1.0).abs() < 1e-12);
        }
    }
}
