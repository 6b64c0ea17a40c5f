//! A polynomial fitted to values at points, as weights of these values.

use std::ops::{Div, Mul, Sub};

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;

/// Exponents of `x, y, z` in the monomials up to a degree: the constant, the coordinates, then the higher ones.
fn monomials(degree: usize) -> Vec<[i32; 3]> {
    let mut exponents: Vec<[i32; 3]> = Vec::new();
    for total in 0..=degree as i32 {
        for i in (0..=total).rev() {
            for j in (0..=total - i).rev() {
                exponents.push([i, j, total - i - j]);
            }
        }
    }
    exponents
}

/// The part of a monomial that the others do not already contain, relative to it, below which the nodes do not
/// determine its coefficient: nodes in two parallel planes, for instance, leave one square open.
const DEPENDENT: f64 = 1e-3;

/// The polynomial of a degree fitted to values at points, at the origin.
///
/// The least-squares problem is solved by orthogonal factorisation of its matrix (modified Gram–Schmidt), in coordinates
/// that scale with the points: what is fitted follows from where they lie to each other, whatever the axes.
pub(super) struct Fit {
    monomials: Vec<[i32; 3]>,
    /// The points in the scaled coordinates.
    points: Vec<Point>,
    /// Orthonormal columns, one a monomial, of weighted values.
    columns: Vec<Vec<f64>>,
    /// The upper triangle.
    upper: Vec<Vec<f64>>,
    /// Weight of every point.
    weights: Vec<f64>,
    frame: Frame,
}

/// Coordinates `ξ = L⁻¹p` in which the second moments of some points about the origin, `Σ p pᵀ/n = LLᵀ`, are those of unit axes: an
/// affine map of all points leaves `|ξ|` of each as it was.
struct Frame {
    /// `L`, a lower triangle [m].
    lower: [Point; 3],
}

/// The part of a moment that other axes do not already contain, relative to it, below which the points lie in a plane.
const FLAT: f64 = 1e-12;

impl Frame {
    const UNIT: Self = Self { lower: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] };

    /// Of points that do not all lie in a plane with the origin.
    fn of(points: &[Point]) -> Option<Self> {
        let moment =
            |i: usize, j: usize| points.iter().map(|p| p[i] * p[j]).sum::<f64>() / points.len() as f64;
        let mut lower = [[0.0; 3]; 3];
        for i in 0..3 {
            for j in 0..=i {
                let open = moment(i, j) - (0..j).map(|k| lower[i][k] * lower[j][k]).sum::<f64>();
                lower[i][j] = if i == j { open.max(0.0).sqrt() } else { open / lower[j][j] };
            }
            let square = lower[i][i] * lower[i][i];
            if square.is_nan() || square <= FLAT * moment(i, i) {
                return None;
            }
        }
        Some(Self { lower })
    }

    fn coordinates(&self, p: &Point) -> Point {
        let l = &self.lower;
        let x = p[0] / l[0][0];
        let y = (p[1] - l[1][0] * x) / l[1][1];
        [x, y, (p[2] - l[2][0] * x - l[2][1] * y) / l[2][2]]
    }

    /// A gradient by the place [1/m], of one by these coordinates: `L⁻ᵀg`.
    fn gradient<T>(&self, g: [T; 3]) -> [T; 3]
    where
        T: Copy + Sub<Output = T> + Mul<f64, Output = T> + Div<f64, Output = T>,
    {
        let l = &self.lower;
        let z = g[2] / l[2][2];
        let y = (g[1] - z * l[2][1]) / l[1][1];
        [(g[0] - y * l[1][0] - z * l[2][0]) / l[0][0], y, z]
    }
}

impl Fit {
    /// With the weight `exp(−k|ξ|²)` in the scaled coordinates, in which 3 is the mean of `|ξ|²`, that lets the nearest points count
    /// most; `None` where the points do not determine the polynomial.
    pub(super) fn new(degree: usize, points: &[Point], k: f64) -> Option<Self> {
        Self::weighted(degree, points, |square| (-k * square).exp())
    }

    /// All points count alike: a smooth function of their places, whatever the scale. `None` as above.
    pub(super) fn even(degree: usize, points: &[Point]) -> Option<Self> {
        Self::weighted(degree, points, |_| 1.0)
    }

    fn weighted(degree: usize, points: &[Point], weight: impl Fn(f64) -> f64) -> Option<Self> {
        let monomials = monomials(degree);
        let terms = monomials.len();
        if points.len() < terms {
            return None;
        }
        let frame = if degree == 0 { Frame::UNIT } else { Frame::of(points)? };
        let mut columns = vec![Vec::with_capacity(points.len()); terms];
        let mut weights = Vec::with_capacity(points.len());
        let scaled: Vec<Point> = points.iter().map(|p| frame.coordinates(p)).collect();
        for &[x, y, z] in &scaled {
            let weight = weight(x * x + y * y + z * z);
            for (column, &[i, j, k]) in columns.iter_mut().zip(&monomials) {
                column.push(weight * x.powi(i) * y.powi(j) * z.powi(k));
            }
            weights.push(weight);
        }
        let product = |u: &[f64], v: &[f64]| u.iter().zip(v).map(|(u, v)| u * v).sum::<f64>();
        let mut upper = vec![vec![0.0; terms]; terms];
        for k in 0..terms {
            let (done, open) = columns.split_at_mut(k);
            let column = &mut open[0];
            let before = product(column, column).sqrt();
            for (i, q) in done.iter().enumerate() {
                upper[i][k] = product(q, column);
                for (c, q) in column.iter_mut().zip(q) {
                    *c -= upper[i][k] * q;
                }
            }
            let length = product(column, column).sqrt();
            if length.is_nan() || length <= DEPENDENT * before {
                return None;
            }
            upper[k][k] = length;
            for c in column.iter_mut() {
                *c /= length;
            }
        }
        Some(Self { monomials, points: scaled, columns, upper, weights, frame })
    }

    /// Weights of the values in the polynomial's value.
    pub(super) fn value(&self) -> Vec<f64> {
        self.coefficient(0)
    }

    /// Weights of the values in its gradient [1/m].
    pub(super) fn gradient(&self) -> Vec<Point> {
        let [x, y, z] = [1, 2, 3].map(|k| self.coefficient(k));
        x.iter().zip(&y).zip(&z).map(|((x, y), z)| self.frame.gradient([*x, *y, *z])).collect()
    }

    /// Derivatives of the value of an even fit by the places of its points [unit of the values per m], the values held.
    ///
    /// With `M` the monomials at the points, `c = (MᵀM)⁻¹Mᵀv`, `y = (MᵀM)⁻¹e` and the weights `w = My` of the values, moving point
    /// `i` changes `eᵀc` by `(y·δm_i)(v_i − m_i·c) − w_i (δm_i·c)`.
    pub(super) fn value_by_points(&self, weights: &[f64], values: &[c64]) -> Vec<[c64; 3]> {
        let terms = self.columns.len();
        let projected = self.columns.iter().map(|q| q.iter().zip(values).map(|(q, v)| q * v).sum::<c64>());
        let coefficients = self.backward(projected.collect());
        let unit = self.forward(0).into_iter().map(c64::from).collect();
        let dual = self.backward(unit);
        let at = |(p, (&w, v)): (&Point, (&f64, &c64))| -> [c64; 3] {
            let value = |[i, j, k]: [i32; 3]| p[0].powi(i) * p[1].powi(j) * p[2].powi(k);
            let fitted: c64 = (0..terms).map(|t| value(self.monomials[t]) * coefficients[t]).sum();
            let change = std::array::from_fn(|d| {
                let slope = |mut exponents: [i32; 3]| {
                    let power = exponents[d];
                    exponents[d] = (power - 1).max(0);
                    if power == 0 { 0.0 } else { f64::from(power) * value(exponents) }
                };
                let along = |of: &[c64]| (0..terms).map(|t| slope(self.monomials[t]) * of[t]).sum::<c64>();
                along(&dual) * (v - fitted) - w * along(&coefficients)
            });
            self.frame.gradient(change)
        };
        self.points.iter().zip(weights.iter().zip(values)).map(at).collect()
    }

    /// The solution of `Ry = b`.
    fn backward(&self, mut b: Vec<c64>) -> Vec<c64> {
        for k in (0..b.len()).rev() {
            let known: c64 = (k + 1..b.len()).map(|j| self.upper[k][j] * b[j]).sum();
            b[k] = (b[k] - known) / self.upper[k][k];
        }
        b
    }

    /// Weights of the values in the coefficient of a monomial: the row of `R⁻¹ Qᵀ W`.
    fn coefficient(&self, of: usize) -> Vec<f64> {
        let y = self.forward(of);
        let at = |i: usize| self.columns.iter().zip(&y).map(|(q, y)| q[i] * y).sum::<f64>();
        (0..self.weights.len()).map(|i| self.weights[i] * at(i)).collect()
    }

    /// The solution of `Rᵀy = e` for a unit vector.
    fn forward(&self, of: usize) -> Vec<f64> {
        let mut y: Vec<f64> = Vec::with_capacity(self.columns.len());
        for k in 0..self.columns.len() {
            let known: f64 = y.iter().enumerate().map(|(i, y)| self.upper[i][k] * y).sum();
            let unit = if k == of { 1.0 } else { 0.0 };
            y.push((unit - known) / self.upper[k][k]);
        }
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(lines: [usize; 3]) -> Vec<Point> {
        let mut points = Vec::new();
        for i in 0..lines[0] {
            for j in 0..lines[1] {
                points.extend((0..lines[2]).map(|k| [0.01 * i as f64, 0.3 * j as f64, 1e-4 * k as f64]));
            }
        }
        points
    }

    #[test]
    fn the_gradient_of_a_quadratic_is_exact_at_the_corner_of_its_points() {
        let quadratic =
            |[x, y, z]: Point| 0.4 + 2.0 * x - y + 70.0 * z + 3.0 * x * y - 2.0 * z * z + 9.0 * y * z + x * x;
        let points = grid([3, 3, 3]);
        let fit = Fit::new(2, &points, 0.5).expect("27 points determine a quadratic");
        let gradients = fit.gradient();
        for (d, exact) in [2.0, -1.0, 70.0].into_iter().enumerate() {
            let sum: f64 = gradients.iter().zip(&points).map(|(g, &p)| g[d] * quadratic(p)).sum();
            // Values of order 1 on a patch of 0.2 mm: rounding of 1e-16 / 2e-4, a hundredfold.
            assert!((sum - exact).abs() < 1e-10, "{d}: {sum}");
        }
        let value: f64 = fit.value().iter().zip(&points).map(|(w, &p)| w * quadratic(p)).sum();
        assert!((value - 0.4).abs() < 1e-13, "{value}");
    }

    #[test]
    fn what_is_fitted_does_not_depend_on_the_axes() {
        let points: Vec<Point> =
            grid([4, 3, 4]).into_iter().map(|[x, y, z]| [x + 0.003, y - 0.2, z + 0.1 * x * x]).collect();
        let rough = |k: usize| (7.3 * k as f64).sin();
        let slope = |points: &[Point], along: Point| -> f64 {
            let gradients = Fit::new(2, points, 0.5).expect("48 points determine a quadratic").gradient();
            let along = |g: &Point| (0..3).map(|d| g[d] * along[d]).sum::<f64>();
            gradients.iter().enumerate().map(|(k, g)| rough(k) * along(g)).sum()
        };
        // Turned by 30 degrees about z, then sheared: a layer a thousand times as wide as thick that leans.
        let turned = |[x, y, z]: Point| {
            let (x, y) = (0.75f64.sqrt() * x - 0.5 * y, 0.5 * x + 0.75f64.sqrt() * y);
            [x, y + 0.3 * x, z + 0.8 * x - y]
        };
        let moved: Vec<Point> = points.iter().map(|&p| turned(p)).collect();
        for along in [[1e-2, 0.0, 0.0], [0.0, 0.3, 0.0], [0.0, 0.0, 1e-4]] {
            let (before, after) = (slope(&points, along), slope(&moved, turned(along)));
            // Coordinates cancel to 1e-4 of themselves, squared in the moments: rounding of 1e-16 / 1e-8, a hundredfold.
            assert!((before - after).abs() < 1e-6 * before.abs(), "{along:?}: {before} {after}");
        }
    }

    #[test]
    fn an_even_fit_has_the_derivatives_of_its_value_by_the_places_of_the_points() {
        let place = |k: usize| [0.7, 1.9, 4.3].map(|a| 0.02 * (a * (k as f64 + 1.0)).sin());
        let points: Vec<Point> = (0..30).map(place).collect();
        let values: Vec<c64> =
            (0..30).map(|k| c64::new((2.1 * k as f64).cos(), (0.4 * k as f64).sin())).collect();
        for degree in 0..3 {
            let value = |points: &[Point]| -> c64 {
                let fit = Fit::even(degree, points).expect("30 points determine it");
                fit.value().iter().zip(&values).map(|(w, v)| *w * v).sum()
            };
            let fit = Fit::even(degree, &points).expect("30 points determine it");
            let exact = fit.value_by_points(&fit.value(), &values);
            for (i, d) in [(0, 0), (7, 1), (29, 2)] {
                let moved = |h: f64| {
                    let mut points = points.clone();
                    points[i][d] += h;
                    value(&points)
                };
                // Steps of a few thousandths of the extent: of second order, and rounding.
                let difference = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                assert!(
                    (difference - exact[i][d]).norm() < 1e-6,
                    "{degree} {i}: {difference} {}",
                    exact[i][d]
                );
            }
        }
    }

    #[test]
    fn points_that_leave_a_coefficient_open_are_refused() {
        for lines in [[3, 3, 2], [3, 3, 1], [9, 2, 1]] {
            let points = grid(lines);
            assert!(Fit::new(2, &points, 0.5).is_none(), "{lines:?}");
        }
    }
}
