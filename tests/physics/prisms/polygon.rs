//! Simple polygons of the plane: area, integrals of linear functions, clipping by a convex polygon.

/// A point of the plane [m].
pub(super) type Place = [f64; 2];

/// Length below which two places are one [m].
pub(super) const SAME: f64 = 1e-9;

/// A simple polygon, anticlockwise.
#[derive(Clone, Debug)]
pub(super) struct Polygon {
    vertices: Vec<Place>,
}

/// A linear function `value + slope · x`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Linear {
    pub(super) value: f64,
    pub(super) slope: Place,
}

/// `a × b`.
pub(super) fn cross(a: Place, b: Place) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// `a − b`.
pub(super) fn difference(a: Place, b: Place) -> Place {
    [a[0] - b[0], a[1] - b[1]]
}

/// The place at `t` between `a` (0) and `b` (1).
pub(super) fn between([a, b]: [Place; 2], t: f64) -> Place {
    [0, 1].map(|d| a[d] + t * (b[d] - a[d]))
}

/// `|b − a|` [m].
pub(super) fn length([a, b]: [Place; 2]) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

impl Polygon {
    /// A polygon of vertices in either sense.
    pub(super) fn new(vertices: &[Place]) -> Self {
        let mut polygon = Self { vertices: vertices.to_vec() };
        if polygon.area() < 0.0 {
            polygon.vertices.reverse();
        }
        polygon
    }

    /// A rectangle from its lower to its upper corner.
    pub(super) fn rectangle(lower: Place, upper: Place) -> Self {
        Self::new(&[lower, [upper[0], lower[1]], upper, [lower[0], upper[1]]])
    }

    /// The vertices, anticlockwise.
    pub(super) fn vertices(&self) -> &[Place] {
        &self.vertices
    }

    /// The edges, anticlockwise.
    pub(super) fn edges(&self) -> impl Iterator<Item = [Place; 2]> + '_ {
        let count = self.vertices.len();
        (0..count).map(move |i| [self.vertices[i], self.vertices[(i + 1) % count]])
    }

    /// Lower and upper corner of the rectangle around it.
    pub(super) fn bounds(&self) -> [Place; 2] {
        let fold = |start: f64, pick: fn(f64, f64) -> f64| {
            [0, 1].map(|d| self.vertices.iter().map(|v| v[d]).fold(start, pick))
        };
        [fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max)]
    }

    /// Whether it is a rectangle along the axes.
    pub(super) fn is_rectangle(&self) -> bool {
        let [lower, upper] = self.bounds();
        let whole = (upper[0] - lower[0]) * (upper[1] - lower[1]);
        (self.area() / whole - 1.0).abs() < SAME
    }

    /// The area [m²].
    pub(super) fn area(&self) -> f64 {
        0.5 * self.edges().map(|[a, b]| cross(a, b)).sum::<f64>()
    }

    /// The integral of a linear function, exact.
    pub(super) fn integral(&self, f: Linear) -> f64 {
        // Triangles from the origin to every edge: the mean is that of the three vertices.
        let of_edge = |[a, b]: [Place; 2]| {
            let sum = f.slope[0] * (a[0] + b[0]) + f.slope[1] * (a[1] + b[1]);
            0.5 * cross(a, b) * (f.value + sum / 3.0)
        };
        self.edges().map(of_edge).sum()
    }

    /// Whether it holds a place; on its boundary either answer.
    pub(super) fn contains(&self, place: Place) -> bool {
        let crosses = |[a, b]: &[Place; 2]| {
            (a[1] > place[1]) != (b[1] > place[1])
                && place[0] < a[0] + (place[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        };
        self.edges().filter(crosses).count() % 2 == 1
    }

    /// The part within a convex polygon.
    ///
    /// Where it falls apart the pieces hang together along edges that are passed in both senses: integrals are right.
    pub(super) fn clipped(&self, convex: &Self) -> Self {
        let mut kept = self.vertices.clone();
        for [a, b] in convex.edges() {
            let height = |p: Place| cross(difference(b, a), difference(p, a));
            let edges = Self { vertices: std::mem::take(&mut kept) };
            for [p, q] in edges.edges() {
                let (hp, hq) = (height(p), height(q));
                if hp >= 0.0 {
                    kept.push(p);
                }
                if (hp > 0.0 && hq < 0.0) || (hp < 0.0 && hq > 0.0) {
                    kept.push(between([p, q], hp / (hp - hq)));
                }
            }
        }
        Self { vertices: kept }
    }
}

#[test]
fn a_clipped_polygon_has_the_integrals_of_its_part() {
    // An L of area 3 and a square that its notch cuts: three quarters of it are left.
    let shape = Polygon::new(&[[0.0, 0.0], [0.0, 2.0], [1.0, 2.0], [1.0, 1.0], [2.0, 1.0], [2.0, 0.0]]);
    let part = shape.clipped(&Polygon::rectangle([0.5, 0.5], [1.5, 1.5]));
    let f = Linear { value: 1.0, slope: [2.0, -1.0] };
    // ∫1 = 0.75; the first moments are those of the square about (1, 1) less those of its upper right quarter.
    let moment = 1.0 - 0.25 * 1.25;
    // Rounding of a dozen products.
    assert!((shape.area() - 3.0).abs() < 1e-14 && (part.area() - 0.75).abs() < 1e-14);
    assert!((part.integral(f) - (0.75 + 2.0 * moment - moment)).abs() < 1e-14);
    assert!(shape.contains([0.5, 1.5]) && !shape.contains([1.5, 1.5]));
}

#[test]
fn clipping_leaves_two_arms_of_a_u() {
    let u = Polygon::new(&[
        [0.0, 0.0],
        [3.0, 0.0],
        [3.0, 3.0],
        [2.0, 3.0],
        [2.0, 1.0],
        [1.0, 1.0],
        [1.0, 3.0],
        [0.0, 3.0],
    ]);
    // Rounding.
    assert!((u.clipped(&Polygon::rectangle([-1.0, 2.0], [4.0, 2.5])).area() - 1.0).abs() < 1e-14);
}
