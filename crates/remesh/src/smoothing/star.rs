//! The elements around one node, and the best place for that node among them.
//!
//! Two concave searches, both by [`maximin`](super::maximin): out of a tangle the least volume is raised, which is a
//! linear programme in the place of the node (Freitag and Plassmann, Int. J. Numer. Meth. Engng 49, 2000); of upright
//! elements the least measure, linearised step by step with a trust region (in the manner of Freitag and
//! Ollivier-Gooch, ibid. 40, 1997). Lengths are counted in the covariance of the surrounding vertices: in a layer of
//! thickness 1 and pitch 100 a step of given length is 100 times longer along the layer than across it, and the search
//! does the same as in a layer of cubes.

use fluxmorph_geometry::quality::quality;
use fluxmorph_geometry::tet4::{Point, sub};

use super::maximin;
use super::measure::Ideal;

/// Steps of one visit; more are left to the next sweep, when the neighbours have moved too.
const STEPS: usize = 20;
/// First radius of the trust region, in standard deviations of the surrounding vertices.
const FIRST_RADIUS: f64 = 1.0;
/// Largest radius. It is a bound of the step for the steepest element; along the ridge where several elements are
/// equally poor slopes are small, and steps far below it.
const LARGEST_RADIUS: f64 = 1e4;
/// A step that fails at this radius ends the visit.
const SMALLEST_RADIUS: f64 = 1e-3;
/// Share of the promised rise that a step must bring.
const SUFFICIENT: f64 = 0.1;
/// Share of the promised rise above which the region grows.
const GOOD: f64 = 0.75;
/// Factor by which the region grows and shrinks.
const CHANGE: f64 = 4.0;
/// Relative rise of the least measure below which a node is left where it is.
const NEGLIGIBLE: f64 = 1e-3;
/// Relative rise of the least volume that is rounding: the peak of affine functions is reached after a few steps, and a
/// small positive volume there decides about a tangle.
const ROUNDING: f64 = 1e-12;

/// Quality (Eq. 4) and measure of an element.
#[derive(Clone, Copy, Debug)]
pub(super) struct Worth {
    pub quality: f64,
    pub measure: f64,
}

impl Worth {
    /// The worth of a tetrahedron.
    pub(super) fn new(vertices: [Point; 4], ideal: &Ideal) -> Self {
        Self { quality: quality(vertices), measure: ideal.measure(vertices) }
    }

    /// The least quality and the least measure; infinite of nothing.
    pub(super) fn least(all: impl IntoIterator<Item = Self>) -> Self {
        let none = Self { quality: f64::INFINITY, measure: f64::INFINITY };
        all.into_iter()
            .fold(none, |a, b| Self { quality: a.quality.min(b.quality), measure: a.measure.min(b.measure) })
    }
}

/// One element around the node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// Vertices [m]; that of the node is replaced.
    pub vertices: [Point; 4],
    /// Which of them the node is.
    pub local: usize,
    /// The shape it should have.
    pub ideal: Ideal,
}

/// All elements around a node that may move.
#[derive(Debug)]
pub(super) struct Star {
    corners: Vec<Corner>,
    /// Place of the node in the given mesh [m]: all its places are `origin + displacement`, to the bit.
    origin: Point,
    /// Mean of the surrounding vertices [m].
    centre: Point,
    /// Lower triangle `L` of their covariance `L Lᵀ` [m].
    frame: [[f64; 3]; 3],
}

impl Star {
    /// The star of a node that the given mesh has at `origin` [m]; `None` if the surrounding vertices coincide.
    pub(super) fn new(origin: Point, corners: Vec<Corner>) -> Option<Self> {
        let surrounding = || {
            let others = |c: &Corner| {
                (0..4).filter({
                    let local = c.local;
                    move |&v| v != local
                })
            };
            corners.iter().flat_map(move |c| others(c).map(|v| c.vertices[v]))
        };
        let count = (3 * corners.len()) as f64;
        let mut centre = [0.0; 3];
        for p in surrounding() {
            for d in 0..3 {
                centre[d] += p[d] / count;
            }
        }
        let mut covariance = [[0.0; 3]; 3];
        for p in surrounding() {
            let r = sub(p, centre);
            for i in 0..3 {
                for j in 0..3 {
                    covariance[i][j] += r[i] * r[j] / count;
                }
            }
        }
        Some(Self { frame: cholesky(covariance)?, corners, origin, centre })
    }

    /// Worth of the elements with the node displaced by `u` [m].
    pub(super) fn worth(&self, u: Point) -> Vec<Worth> {
        self.corners.iter().map(|c| Worth::new(self.vertices_at(c, u), &c.ideal)).collect()
    }

    /// A better displacement than `u` [m], if there is one.
    ///
    /// Better is, from a tangle, a greater least volume, else a greater least measure; then all elements stay upright and
    /// none falls below the `floor`.
    pub(super) fn improve(&self, u: Point, floor: Worth) -> Option<Point> {
        let untangled = if is_upright(&self.worth(u)) { None } else { Some(self.untangle(u)?) };
        let start = untangled.unwrap_or(u);
        if !is_upright(&self.worth(start)) {
            return untangled;
        }
        self.ascend(start, floor).or(untangled)
    }

    /// Raises the least measure of upright elements.
    fn ascend(&self, mut u: Point, floor: Worth) -> Option<Point> {
        let mut least = Worth::least(self.worth(u)).measure;
        let mut model = self.linearise(u, Ideal::measure_and_gradient);
        let (mut radius, mut moved) = (FIRST_RADIUS, None);
        for _ in 0..STEPS {
            let step = maximin::step(&model.0, &model.1, radius);
            if step.gain.is_nan() || step.gain <= NEGLIGIBLE * least {
                break;
            }
            let trial = self.step(u, step.step);
            let after = self.worth(trial);
            let raised = Worth::least(after.iter().copied()).measure;
            let rise = raised - least;
            if rise >= SUFFICIENT * step.gain && is_allowed(&after, floor) {
                if rise >= GOOD * step.gain {
                    radius = LARGEST_RADIUS.min(CHANGE * radius);
                }
                (u, least, moved) = (trial, raised, Some(trial));
                model = self.linearise(u, Ideal::measure_and_gradient);
            } else {
                radius /= CHANGE;
                if radius < SMALLEST_RADIUS {
                    break;
                }
            }
        }
        moved
    }

    /// The place of the greatest least volume, if it is better than `u`.
    fn untangle(&self, u: Point) -> Option<Point> {
        // The least volume is concave over all space: its peak is found from anywhere, soonest from the middle.
        let mut peak = sub(self.centre, self.origin);
        for _ in 0..STEPS {
            let (volumes, gradients) = self.linearise(peak, Ideal::volume_and_gradient);
            let step = maximin::step(&volumes, &gradients, LARGEST_RADIUS);
            let largest = volumes.iter().fold(0.0, |a: f64, v| a.max(v.abs()));
            if step.gain.is_nan() || step.gain <= ROUNDING * largest {
                break;
            }
            peak = self.step(peak, step.step);
        }
        let least = |u: Point| {
            let (volumes, _) = self.linearise(u, Ideal::volume_and_gradient);
            let largest = volumes.iter().fold(0.0, |a: f64, v| a.max(v.abs()));
            (volumes.into_iter().fold(f64::INFINITY, f64::min), largest)
        };
        let ((before, _), (after, largest)) = (least(u), least(peak));
        (after > before + NEGLIGIBLE * largest || (after > 0.0 && before <= 0.0)).then_some(peak)
    }

    /// `u + L y` [m].
    fn step(&self, u: Point, y: Point) -> Point {
        let l = &self.frame;
        std::array::from_fn(|i| u[i] + l[i][0] * y[0] + l[i][1] * y[1] + l[i][2] * y[2])
    }

    /// Values of a function of the elements and their derivatives `Lᵀ ∇` by `y`.
    fn linearise(
        &self,
        u: Point,
        function: impl Fn(&Ideal, [Point; 4], usize) -> (f64, Point),
    ) -> (Vec<f64>, Vec<Point>) {
        let l = &self.frame;
        let one = |c: &Corner| {
            let (value, g) = function(&c.ideal, self.vertices_at(c, u), c.local);
            (value, std::array::from_fn(|j| l[0][j] * g[0] + l[1][j] * g[1] + l[2][j] * g[2]))
        };
        self.corners.iter().map(one).unzip()
    }

    fn vertices_at(&self, corner: &Corner, u: Point) -> [Point; 4] {
        let mut vertices = corner.vertices;
        vertices[corner.local] = std::array::from_fn(|d| self.origin[d] + u[d]);
        vertices
    }
}

fn is_upright(worth: &[Worth]) -> bool {
    worth.iter().all(|w| w.quality > 0.0)
}

/// Whether all elements are upright and none is below the floor.
fn is_allowed(after: &[Worth], floor: Worth) -> bool {
    after.iter().all(|w| w.quality > 0.0 && w.quality >= floor.quality && w.measure >= floor.measure)
}

/// Lower triangle of a covariance, lifted a little so that a plane star has one too; `None` of no extent.
fn cholesky(matrix: [[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let trace = matrix[0][0] + matrix[1][1] + matrix[2][2];
    if !(trace > 0.0 && trace.is_finite()) {
        return None;
    }
    let mut l = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            if i == j {
                // Layers down to 1e-6 of their pitch are seen as they are.
                l[i][i] = (matrix[i][i] - known).max(1e-13 * trace).sqrt();
            } else {
                l[i][j] = (matrix[i][j] - known) / l[j][j];
            }
        }
    }
    Some(l)
}
