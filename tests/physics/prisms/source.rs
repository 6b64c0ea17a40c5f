//! The source of a prism: a rectangular coil with the axis z that is longer than the prism is high.
//!
//! Within the prism nothing depends on z: `T = (0, 0, T(x, y))` with `T = NI/height` in the window, falling linearly to
//! zero across the winding.

use fluxmorph_geometry::fem::c64;
use fluxmorph_solver::coil::{Coil, Corner, Racetrack};

use super::polygon::{Linear, Place, Polygon, between, cross, difference, length};

/// A rectangular coil about the z direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    pub(super) centre: Place,
    pub(super) half_window: Place,
    pub(super) width: f64,
    /// Along z [m], the middle at half the prism's height.
    pub(super) height: f64,
    pub(super) ampere_turns: f64,
}

impl Source {
    /// A coil of 1 kA over 0.4 m: 2500 A/m in its window.
    pub(super) fn new(centre: Place, half_window: Place, width: f64) -> Self {
        Self { centre, half_window, width, height: 0.4, ampere_turns: 1000.0 }
    }

    /// `T` in the window [A/m].
    pub(super) fn plateau(&self) -> f64 {
        self.ampere_turns / self.height
    }

    /// The window and the four sides of the winding, each with its linear `T` [A/m].
    fn pieces(&self) -> Vec<(Polygon, Linear)> {
        let ([a, b], w) = (self.half_window, self.width);
        let at = |x: f64, y: f64| [self.centre[0] + x, self.centre[1] + y];
        let window = Polygon::rectangle(at(-a, -b), at(a, b));
        let mut pieces = vec![(window, Linear { value: self.plateau(), slope: [0.0; 2] })];
        let (inner, outer) = (
            [at(-a, -b), at(a, -b), at(a, b), at(-a, b)],
            [at(-a - w, -b - w), at(a + w, -b - w), at(a + w, b + w), at(-a - w, b + w)],
        );
        let outwards = [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]];
        for side in 0..4 {
            let next = (side + 1) % 4;
            let trapezium = Polygon::new(&[inner[side], outer[side], outer[next], inner[next]]);
            let slope = outwards[side].map(|n: f64| -n * self.plateau() / w);
            let value = self.plateau() - slope[0] * inner[side][0] - slope[1] * inner[side][1];
            pieces.push((trapezium, Linear { value, slope }));
        }
        pieces
    }

    /// `T` at a place [A/m].
    pub(super) fn at(&self, place: Place) -> f64 {
        let distance = |d: usize| (place[d] - self.centre[d]).abs() - self.half_window[d];
        self.plateau() * (1.0 - distance(0).max(distance(1)) / self.width).clamp(0.0, 1.0)
    }

    /// `∫T²` [A²] of the whole coil: `t²` over the rings of the winding where `T` is a share `t` of the plateau.
    pub(super) fn square_over_all(&self) -> f64 {
        let ([a, b], w) = (self.half_window, self.width);
        let winding = 4.0 * w * ((a + b) / 3.0 + w / 6.0);
        self.plateau().powi(2) * (4.0 * a * b + winding)
    }

    /// Distance from the winding outwards [m], in the maximum norm.
    pub(super) fn clearance(&self, place: Place) -> f64 {
        let distance = |d: usize| (place[d] - self.centre[d]).abs() - self.half_window[d] - self.width;
        distance(0).max(distance(1))
    }

    /// `∇T` at a place off the kinks [A/m²].
    pub(super) fn slope(&self, place: Place) -> Place {
        let pieces = self.pieces();
        pieces.iter().find(|(piece, _)| piece.contains(place)).map_or([0.0; 2], |(_, linear)| linear.slope)
    }

    /// `∫T` over a polygon [A m], exact.
    pub(super) fn over(&self, polygon: &Polygon) -> f64 {
        self.pieces().iter().map(|(piece, linear)| polygon.clipped(piece).integral(*linear)).sum()
    }

    /// `∫ f(place) ds` along a segment, exact where `f` is a polynomial of degree three between the kinks of `T`.
    pub(super) fn along<T: std::iter::Sum<T> + std::ops::Mul<f64, Output = T>>(
        &self,
        segment: [Place; 2],
        f: impl Fn(f64) -> T,
    ) -> T {
        // Gauss's two points, never on a kink.
        let offset = 0.5 / 3f64.sqrt();
        let cuts = self.cuts(segment);
        let pairs = cuts.windows(2).filter(|pair| pair[1] > pair[0]);
        let points = pairs.flat_map(|pair| {
            let (middle, size) = (0.5 * (pair[0] + pair[1]), pair[1] - pair[0]);
            [-offset, offset].map(|o| (middle + o * size, 0.5 * size))
        });
        points.map(|(t, weight)| f(t) * (weight * length(segment))).sum()
    }

    /// `∫T ds` along a segment [A].
    pub(super) fn along_segment(&self, segment: [Place; 2]) -> f64 {
        self.along(segment, |t| self.at(between(segment, t)))
    }

    /// Where a segment meets kinks of `T`, from 0 to 1, ascending.
    fn cuts(&self, [a, b]: [Place; 2]) -> Vec<f64> {
        let direction = difference(b, a);
        let mut cuts = vec![0.0, 1.0];
        for (piece, _) in self.pieces() {
            for [p, q] in piece.edges() {
                let edge = difference(q, p);
                let across = cross(direction, edge);
                if across != 0.0 {
                    let t = cross(difference(p, a), edge) / across;
                    cuts.extend((t > 0.0 && t < 1.0).then_some(t));
                }
            }
        }
        cuts.sort_by(f64::total_cmp);
        cuts
    }

    /// The same coil of the program, in a prism of a height [m].
    pub(super) fn coil(&self, prism_height: f64) -> Coil {
        let centre = [self.centre[0], self.centre[1], 0.5 * prism_height];
        let shape = Racetrack::new(centre, 2, self.half_window, self.width, self.height, Corner::Mitred);
        Coil {
            name: "coil".to_owned(),
            ampere_turns: c64::from(self.ampere_turns),
            shape: shape.expect("a coil with a size").into(),
        }
    }
}

#[test]
fn the_potential_is_that_of_the_programs_coil() {
    let source = Source::new([0.5, 0.4], [0.15, 0.2], 0.1);
    let fluxmorph_solver::coil::CoilShape::Racetrack(racetrack) = source.coil(0.1).shape else {
        panic!("it is a racetrack")
    };
    for i in 0..400 {
        let s = |k: f64| (f64::from(i) * k).sin();
        let place = [0.5 + 0.35 * s(1.7), 0.4 + 0.4 * s(2.3)];
        let theirs = source.ampere_turns * racetrack.potential([place[0], place[1], 0.03]);
        // Rounding.
        assert!((source.at(place) - theirs).abs() < 1e-9, "{place:?}");
        let step = 1e-7;
        let moved = |d: usize, s: f64| {
            source.at([place[0] + if d == 0 { s } else { 0.0 }, place[1] + if d == 1 { s } else { 0.0 }])
        };
        let slope = [0, 1].map(|d| (moved(d, step) - moved(d, -step)) / (2.0 * step));
        // Differences of 2500 A/m over 0.1 µm; the few places within a step of a kink are not among these.
        assert!((0..2).all(|d| (slope[d] - source.slope(place)[d]).abs() < 1e-3), "{place:?} {slope:?}");
    }
}

#[test]
fn integrals_of_the_potential_are_those_by_hand() {
    let source = Source::new([0.5, 0.5], [0.15, 0.15], 0.1);
    let square = Polygon::rectangle([-1.0, -1.0], [1.0, 1.0]);
    // A frustum of a pyramid: w/3 (0.5² + 0.3² + 0.5 × 0.3) over the area of the window, with w = 1.
    let hand = 2500.0 * (0.25 + 0.09 + 0.15) / 3.0;
    // Rounding of sums over five pieces.
    assert!(
        (source.over(&square) - hand).abs() < 1e-10 && (hand - 2500.0 * 0.163_333_333_333_333_3).abs() < 1e-9
    );
    // Half of it, cut by a wall through the middle; a line through the middle: 0.3 + 0.1.
    let half = Polygon::rectangle([-1.0, -1.0], [0.5, 1.0]);
    assert!((source.over(&half) - 0.5 * hand).abs() < 1e-10);
    assert!((source.along_segment([[0.5, -1.0], [0.5, 1.0]]) - 2500.0 * 0.4).abs() < 1e-9);
    // The diagonal runs along the mitre: 0.3 √2 in the window, half of 0.2 √2 in the winding.
    assert!((source.along_segment([[-1.0, -1.0], [1.0, 1.0]]) - 2500.0 * 0.4 * 2f64.sqrt()).abs() < 1e-9);
}
