//! Element quality (Eq. 4) and its distribution over a mesh.
//!
//! `q = 8.47967 V (Σ L² / 6)^(−3/2)` with the **signed** volume `V` and the six edge lengths `L`: 1 for a regular
//! tetrahedron, 0 for a flat one, negative for an inverted one. The constant is the paper's; `6√2 = 8.48528` would
//! make the regular tetrahedron exactly 1 (it is 0.99934 here), but the tables of the paper use this one.

use rayon::prelude::*;

use crate::ids::ElementId;
use crate::mesh::Mesh;
use crate::tet4::{self, EDGES, Point};
use crate::topology::Topology;

/// The constant of Eq. 4, as printed.
pub const NORMALISATION: f64 = 8.47967;

/// Number of equal bins of `0 ≤ q ≤ 1` in [`QualityReport::histogram`].
pub const HISTOGRAM_BINS: usize = 10;

/// Elements per parallel task.
const CHUNK: usize = 4096;

/// Quality `q` of one tetrahedron (Eq. 4): a pure number, its sign that of the volume.
///
/// A tetrahedron whose four vertices coincide has the quality 0.
#[inline]
pub fn quality(vertices: [Point; 4]) -> f64 {
    let mut squares = 0.0;
    for [a, b] in EDGES {
        let edge = tet4::sub(vertices[b], vertices[a]);
        squares += tet4::dot(edge, edge);
    }
    let mean = squares / 6.0;
    if mean == 0.0 {
        return 0.0;
    }
    NORMALISATION * tet4::volume(vertices) / (mean * mean.sqrt())
}

/// Quality of every element, shape `(n_elements,)`.
pub fn qualities(mesh: &Mesh) -> Vec<f64> {
    mesh.topology().tets().par_iter().map(|tet| quality(tet.map(|n| mesh.point(n)))).collect()
}

/// Quality of some elements, in their order; the numbers that [`qualities`] has for them.
pub fn qualities_of(mesh: &Mesh, elements: &[ElementId]) -> Vec<f64> {
    elements.par_iter().map(|&e| quality(mesh.vertices(e))).collect()
}

/// How the quality of a set of elements is distributed.
#[derive(Clone, Debug, PartialEq)]
pub struct QualityReport {
    /// Number of elements looked at.
    pub elements: usize,
    /// Smallest quality.
    pub worst: f64,
    /// The element that has it; the lowest index where several do.
    pub worst_element: ElementId,
    /// Centroid of that element [m].
    pub worst_centroid: Point,
    /// Elements per tenth of `0 ≤ q ≤ 1`, lowest first; what lies outside counts in the first or the last bin.
    pub histogram: [usize; HISTOGRAM_BINS],
    /// Elements with `q ≤ 0.3`: the paper's count of poor ones.
    pub poor: usize,
    /// Elements with `0.3 < q < 0.6`.
    pub fair: usize,
    /// Elements with `q ≥ 0.6`.
    pub good: usize,
}

impl QualityReport {
    /// The report of a whole mesh; `None` of a mesh without elements.
    pub fn of_mesh(mesh: &Mesh) -> Option<Self> {
        let elements: Vec<ElementId> = mesh.topology().elements().collect();
        Self::of_elements(mesh, &elements)
    }

    /// The report of some elements, such as those of a remesh region; `None` if there are none.
    pub fn of_elements(mesh: &Mesh, elements: &[ElementId]) -> Option<Self> {
        Self::of_points(mesh.topology(), mesh.points(), elements)
    }

    /// The report of some elements at any places of the nodes [m], shape `(n_nodes, 3)`: elements may be inverted, which
    /// no [`Mesh`] has.
    ///
    /// # Panics
    /// If there is not one point per node.
    pub fn of_points(topology: &Topology, points: &[Point], elements: &[ElementId]) -> Option<Self> {
        assert_eq!(points.len(), topology.node_count(), "one point per node");
        let vertices = |e: ElementId| topology.tet(e).map(|n| points[n.index()]);
        let of_chunk = |chunk: &[ElementId]| -> Option<Self> {
            let &first = chunk.first()?;
            let mut report = Self::starting_from(first, quality(vertices(first)));
            report.elements = chunk.len();
            for &element in chunk {
                report.count(element, quality(vertices(element)));
            }
            Some(report)
        };
        // Minima and counts: the chunks combine to the same report whatever they are.
        let chunks: Vec<Self> = elements.par_chunks(CHUNK).filter_map(of_chunk).collect();
        let mut report = chunks.into_iter().reduce(Self::with)?;
        report.worst_centroid = tet4::centroid(vertices(report.worst_element));
        Some(report)
    }

    /// A report on nothing yet, with a first candidate for the worst element.
    fn starting_from(worst_element: ElementId, worst: f64) -> Self {
        Self {
            elements: 0,
            worst,
            worst_element,
            worst_centroid: [0.0; 3],
            histogram: [0; HISTOGRAM_BINS],
            poor: 0,
            fair: 0,
            good: 0,
        }
    }

    fn count(&mut self, element: ElementId, q: f64) {
        if (q, element) < (self.worst, self.worst_element) {
            (self.worst, self.worst_element) = (q, element);
        }
        let bin = (q * HISTOGRAM_BINS as f64).clamp(0.0, (HISTOGRAM_BINS - 1) as f64);
        self.histogram[bin as usize] += 1;
        match q {
            q if q >= 0.6 => self.good += 1,
            q if q > 0.3 => self.fair += 1,
            _ => self.poor += 1,
        }
    }

    /// Numbers that say all of a report but the place of the worst element.
    pub const NUMBERS: usize = HISTOGRAM_BINS + 6;

    /// The report as numbers, to be sent to another process.
    pub fn numbers(&self) -> [f64; Self::NUMBERS] {
        let mut numbers = [0.0; Self::NUMBERS];
        let counts = [self.elements, self.poor, self.fair, self.good];
        let all = [self.worst, f64::from(self.worst_element.0)].into_iter();
        let all = all.chain(counts.into_iter().chain(self.histogram).map(|count| count as f64));
        numbers.iter_mut().zip(all).for_each(|(number, value)| *number = value);
        numbers
    }

    /// The report that [`QualityReport::numbers`] says; the place of the worst element is to be found by
    /// [`QualityReport::located_on`].
    ///
    /// # Panics
    /// If there are fewer than [`QualityReport::NUMBERS`].
    pub fn of_numbers(numbers: &[f64]) -> Self {
        let count = |i: usize| numbers[i] as usize;
        Self {
            worst: numbers[0],
            worst_element: ElementId(numbers[1] as u32),
            worst_centroid: [0.0; 3],
            elements: count(2),
            poor: count(3),
            fair: count(4),
            good: count(5),
            histogram: std::array::from_fn(|bin| count(6 + bin)),
        }
    }

    /// The report with the place of its worst element on a mesh.
    pub fn located_on(self, mesh: &Mesh) -> Self {
        Self { worst_centroid: tet4::centroid(mesh.vertices(self.worst_element)), ..self }
    }

    /// The report on the elements of both, without a place.
    pub fn with(mut self, other: Self) -> Self {
        if (other.worst, other.worst_element) < (self.worst, self.worst_element) {
            (self.worst, self.worst_element) = (other.worst, other.worst_element);
        }
        for (own, count) in self.histogram.iter_mut().zip(other.histogram) {
            *own += count;
        }
        self.elements += other.elements;
        self.poor += other.poor;
        self.fair += other.fair;
        self.good += other.good;
        self
    }

    /// Shares of poor (`q ≤ 0.3`), fair and good (`q ≥ 0.6`) elements; they add up to 1.
    pub fn shares(&self) -> [f64; 3] {
        [self.poor, self.fair, self.good].map(|count| count as f64 / self.elements as f64)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::generate::{BlockParameters, block};

    const REGULAR: [Point; 4] = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    const KUHN: [Point; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0; 3]];

    fn mirrored([a, b, c, d]: [Point; 4]) -> [Point; 4] {
        [a, c, b, d]
    }

    #[test]
    fn the_regular_tetrahedron_is_the_constant_over_six_root_two() {
        let expected = NORMALISATION / (6.0 * 2f64.sqrt());
        assert!((quality(REGULAR).abs() - expected).abs() < 1e-14);
        assert!(
            (quality(REGULAR) + quality(mirrored(REGULAR))).abs() < 1e-14,
            "the sign is that of the volume"
        );
    }

    #[test]
    fn a_kuhn_tetrahedron_of_a_cube_has_the_quality_of_the_paper() {
        // V = 1/6, Σ L² = 3·1 + 2·2 + 3 = 10.
        let expected = NORMALISATION / 6.0 * (10f64 / 6.0).powf(-1.5);
        assert!((quality(KUHN) - expected).abs() < 1e-14);
        assert!((quality(KUHN) - 0.6568).abs() < 5e-5);
    }

    #[test]
    fn a_flat_and_a_collapsed_tetrahedron_have_the_quality_zero() {
        assert_eq!(quality([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]), 0.0);
        assert_eq!(quality([[0.5; 3]; 4]), 0.0);
    }

    #[test]
    fn a_block_of_cubes_is_of_one_quality() {
        let mesh = block(&BlockParameters { size: [0.3; 3], cells: [3; 3] }).expect("a block");
        let report = QualityReport::of_mesh(&mesh).expect("there are elements");
        assert_eq!((report.poor, report.fair, report.good), (0, 0, 162));
        assert_eq!(report.histogram, [0, 0, 0, 0, 0, 0, 162, 0, 0, 0]);
        assert_eq!(report.shares(), [0.0, 0.0, 1.0]);
        assert!((report.worst - quality(KUHN)).abs() < 1e-12);
        assert!(QualityReport::of_elements(&mesh, &[]).is_none());
        let one = QualityReport::of_elements(&mesh, &[ElementId(7)]).expect("one element");
        assert_eq!((one.elements, one.worst_element), (1, ElementId(7)));
    }

    proptest! {
        #[test]
        fn quality_does_not_change_with_place_size_and_attitude(
            shift in prop::array::uniform3(-5.0..5.0f64),
            scale in 1e-3..1e3f64,
            angles in prop::array::uniform3(0.0..std::f64::consts::TAU),
        ) {
            let turned = |mut p: Point| {
                for (axis, angle) in angles.iter().enumerate() {
                    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
                    let (sin, cos) = angle.sin_cos();
                    (p[i], p[j]) = (cos * p[i] - sin * p[j], sin * p[i] + cos * p[j]);
                }
                [0, 1, 2].map(|d| scale * (p[d] + shift[d]))
            };
            // Cancellation in the differences of shifted coordinates costs about one digit.
            prop_assert!((quality(KUHN.map(turned)) - quality(KUHN)).abs() < 1e-13);
        }
    }
}
