//! The trends of the paper's example 1: what Tables 1 and 2 say of parameters and region, on the boundary sets where it
//! holds. Lengths are in edges of a cell; the paper's own set-up is not known (`docs/results.md`), so that no printed worst
//! quality is asserted, only the numbers of equations.

use crate::support::{Point, largest_difference, nodes_where, unit_cells};
use fluxmorph_geometry::quality::QualityReport;
use fluxmorph_geometry::tet4::{add, centroid};
use fluxmorph_geometry::{Mesh, NodeId};
use fluxmorph_remesh::{Boundary, BoundaryKind, ElasticMap, RemeshSetup, StiffnessPolicy, Subregion};

/// What the sides of the body do; its top is free and its bottom fixed.
#[derive(Clone, Copy, Debug)]
enum Sides {
    Clamped,
    Sliding,
}

/// A body below the top of a block, and a motion of some of its top nodes straight up.
struct Example {
    mesh: Mesh,
    /// Cells of the body along x, y and z; it is centred along x and y.
    cells: [usize; 3],
    sides: Sides,
    nodes: Vec<NodeId>,
    lift: f64,
}

impl Example {
    /// Body and mesh of `8 × 8 × 8` cells, as in Table 1.
    fn table_1(sides: Sides, lift: f64, moved: impl Fn(Point) -> bool) -> Self {
        let mesh = unit_cells([8; 3]);
        let nodes = nodes_where(&mesh, |p| p[2] == 8.0 && moved(p));
        Self { mesh, cells: [8; 3], sides, nodes, lift }
    }

    /// A line of five nodes in the middle of the top, with one of the regions of Table 2.
    fn table_2(cells: [usize; 3]) -> Self {
        let mesh = unit_cells([14, 14, 13]);
        let nodes = nodes_where(&mesh, |p| p[2] == 13.0 && p[1] == 7.0 && (p[0] - 7.0).abs() <= 2.0);
        Self { mesh, cells, sides: Sides::Clamped, nodes, lift: 5.4 }
    }

    fn map(&self, young: f64, poisson: f64, force: f64) -> ElasticMap {
        let [lower, upper] = self.mesh.bounding_box();
        let inside = |p: Point| {
            let from_middle = |d: usize| (p[d] - 0.5 * (lower[d] + upper[d])).abs();
            (0..2).all(|d| 2.0 * from_middle(d) < self.cells[d] as f64)
                && upper[2] - p[2] < self.cells[2] as f64
        };
        let topology = self.mesh.topology();
        let elements = topology.elements().filter(|&e| inside(centroid(self.mesh.vertices(e)))).collect();
        let mut boundaries = vec![Boundary::of_surface(topology, "z_max", BoundaryKind::Free).unwrap()];
        if let Sides::Sliding = self.sides {
            let slide = |name| Boundary::of_surface(topology, name, BoundaryKind::Slide).unwrap();
            boundaries.extend(["x_min", "x_max", "y_min", "y_max"].map(slide));
        }
        let body = Subregion::new("body", elements);
        let setup = RemeshSetup {
            subregions: vec![Subregion { young, poisson, force: [0.0, 0.0, force], ..body }],
            policy: StiffnessPolicy::Uniform,
            design_nodes: self.nodes.clone(),
            boundaries,
            ..RemeshSetup::default()
        };
        ElasticMap::new(&self.mesh, setup).unwrap()
    }

    fn displacement(&self, map: &ElasticMap) -> Vec<Point> {
        map.displacement(&vec![[0.0, 0.0, self.lift]; self.nodes.len()]).unwrap()
    }

    /// Quality of the body after the motion in one increment; elements may be inverted.
    fn quality(&self, young: f64, poisson: f64, force: f64) -> QualityReport {
        let map = self.map(young, poisson, force);
        let points: Vec<Point> =
            self.mesh.points().iter().zip(self.displacement(&map)).map(|(x, u)| add(*x, u)).collect();
        QualityReport::of_points(self.mesh.topology(), &points, map.elements()).unwrap()
    }
}

/// The diagonal of the top without its ends.
fn diagonal(p: Point) -> bool {
    p[0] + p[1] == 8.0 && p[0] > 0.0 && p[1] > 0.0
}

/// Both centre lines of the top without their ends.
fn cross(p: Point) -> bool {
    let inner = |c: f64| c > 0.0 && c < 8.0;
    (p[0] == 4.0 && inner(p[1])) || (p[1] == 4.0 && inner(p[0]))
}

#[test]
fn the_numbers_of_equations_of_table_2_are_the_papers() {
    for (cells, equations) in [([6, 6, 5], 360), ([10, 10, 9], 2172), ([14, 14, 13], 6576)] {
        assert_eq!(Example::table_2(cells).map(1.0, 0.3, 0.0).equation_count(), equations);
    }
}

#[test]
fn a_larger_region_makes_the_worst_element_better_and_spreads_the_motion() {
    let reports =
        [[6, 6, 5], [10, 10, 9], [14, 14, 13]].map(|cells| Example::table_2(cells).quality(1.0, 0.3, 0.0));
    for pair in reports.windows(2) {
        assert!(pair[0].worst < pair[1].worst);
        assert!(pair[0].poor > pair[1].poor);
        // The share of the good among the elements of the whole mesh falls: those outside a body are good.
        assert!(pair[0].poor + pair[0].fair < pair[1].poor + pair[1].fair);
    }
}

#[test]
fn a_stiff_body_feels_no_force() {
    for sides in [Sides::Clamped, Sides::Sliding] {
        let example = Example::table_1(sides, 6.5, cross);
        let rest = example.displacement(&example.map(1.0, 0.3, 0.0));
        let distance = [1e3, 1e6]
            .map(|young| largest_difference(&example.displacement(&example.map(young, 0.3, 0.065)), &rest));
        // Linear in 1/E, down to the rounding of displacements of 6.5.
        assert!((distance[0] / distance[1] / 1e3 - 1.0).abs() < 1e-3, "{sides:?} {distance:?}");
        let [stiff, none] = [example.quality(1e9, 0.3, 0.065), example.quality(1.0, 0.3, 0.0)];
        assert_eq!((stiff.poor, stiff.fair), (none.poor, none.fair), "{sides:?}");
        assert!((stiff.worst - none.worst).abs() < 1e-6, "{sides:?}");
    }
}

/// The force rows of Table 1: best at a finite f / E.
#[test]
fn with_sliding_sides_the_worst_quality_is_best_at_a_finite_force() {
    let example = Example::table_1(Sides::Sliding, 6.5, cross);
    let [soft, best, stiff, stiffer] = [0.1, 0.5, 5.0, 50.0].map(|young| example.quality(young, 0.3, 0.065));
    assert!(soft.worst < 0.0 && soft.poor > 2000, "{soft:?}");
    assert!(best.worst > 0.3 && best.poor == 0, "{best:?}");
    assert!(best.worst > stiff.worst && stiff.worst > stiffer.worst);
    assert!(0 < stiff.poor && stiff.poor < stiffer.poor);
}

/// The rows of Poisson's ratio of Table 1.
#[test]
fn with_clamped_sides_fewer_elements_are_poor_when_poissons_ratio_is_small() {
    let example = Example::table_1(Sides::Clamped, 4.5, diagonal);
    let poor = [0.3, 0.1, 0.03].map(|poisson| example.quality(0.5, poisson, 0.0).poor);
    assert!(poor[0] > poor[1] && poor[1] >= poor[2], "{poor:?}");
}
