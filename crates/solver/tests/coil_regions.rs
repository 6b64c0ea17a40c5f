//! The current of a coil that is a region of the mesh.

use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use crate::terminal;
use fluxmorph_geometry::generate::{BlockParameters, block};
use fluxmorph_geometry::tet4::{self, Point, dot, norm};
use fluxmorph_geometry::{ElementId, Mesh, NodeId, RegionId, Topology};
use fluxmorph_solver::SolverError;
use fluxmorph_solver::coil::{Frame, Path, RegionCurrent, RegionFault, Terminal};

const INNER: f64 = 0.04;
const OUTER: f64 = 0.06;
const HEIGHT: f64 = 0.03;

/// A block whose nodes are moved by `to`.
fn warped(size: [f64; 3], cells: [usize; 3], to: impl Fn(Point) -> Point) -> Mesh {
    let straight = block(&BlockParameters { size, cells }).expect("a block");
    let points = straight.points().iter().map(|x| to(*x)).collect();
    Mesh::new(Arc::clone(straight.topology()), points).expect("a mesh")
}

/// From `(r − INNER, angle, z)` to space.
fn bent([r, angle, z]: Point) -> Point {
    [(INNER + r) * angle.cos(), (INNER + r) * angle.sin(), z]
}

/// A quarter of a ring of rectangular section about z; its ends are `y_min` and `y_max`.
fn quarter(cells: [usize; 3]) -> Mesh {
    warped([OUTER - INNER, FRAC_PI_2, HEIGHT], cells, bent)
}

/// A whole ring: a block bent round, its two ends made one.
fn ring(cells: [usize; 3]) -> Mesh {
    let straight = block(&BlockParameters { size: [OUTER - INNER, TAU, HEIGHT], cells }).expect("a block");
    let per_angle = cells[2] + 1;
    let per_radius = (cells[1] + 1) * per_angle;
    // Nodes are numbered r, angle, z with z fastest: the last angle becomes the first.
    let closed = |n: NodeId| {
        let (r, rest) = (n.index() / per_radius, n.index() % per_radius);
        let (angle, z) = (rest / per_angle, rest % per_angle);
        NodeId::new((r * cells[1] + angle % cells[1]) * per_angle + z)
    };
    let tets: Vec<[NodeId; 4]> = straight.topology().tets().iter().map(|t| t.map(closed)).collect();
    let node_count = (cells[0] + 1) * cells[1] * per_angle;
    let mut points = vec![[0.0; 3]; node_count];
    for (i, x) in straight.points().iter().enumerate().rev() {
        points[closed(NodeId::new(i)).index()] = bent(*x);
    }
    let regions = vec![RegionId(0); tets.len()];
    let topology = Topology::new(node_count, tets, vec!["ring".to_owned()], regions).expect("a ring");
    Mesh::new(Arc::new(topology), points).expect("a mesh")
}

fn between(mesh: &Mesh, from: &str, to: &str) -> Result<RegionCurrent, SolverError> {
    let path = Path::Terminals { from: terminal(mesh, from), to: terminal(mesh, to) };
    let elements: Vec<_> = mesh.topology().elements().collect();
    RegionCurrent::new(mesh, "winding", &elements, &path)
}

fn around(mesh: &Mesh, frame: Frame) -> Result<RegionCurrent, SolverError> {
    let elements: Vec<_> = mesh.topology().elements().collect();
    RegionCurrent::new(mesh, "winding", &elements, &Path::Closed(frame))
}

fn fault(result: Result<RegionCurrent, SolverError>) -> RegionFault {
    match result {
        Err(SolverError::CoilRegion { coil, fault }) if coil == "winding" => fault,
        other => panic!("{other:?}"),
    }
}

fn z_axis(centre: Point) -> Frame {
    Frame::coordinate(centre, 2).expect("z")
}

/// Root mean square of `|J − e_φ/section|` over that of `|J|`, with `e_φ` at the elements' centroids.
fn off_azimuthal(mesh: &Mesh, current: &RegionCurrent, magnitude: f64) -> f64 {
    let (mut error, mut all) = (0.0, 0.0);
    for (e, j) in current.current_density() {
        let vertices = mesh.vertices(*e);
        let (c, v) = (tet4::centroid(vertices), tet4::volume(vertices));
        let r = c[0].hypot(c[1]);
        let exact = [-c[1] / r * magnitude, c[0] / r * magnitude, 0.0];
        error += v * norm(tet4::sub(*j, exact)).powi(2);
        all += v * magnitude * magnitude;
    }
    (error / all).sqrt()
}

#[test]
fn a_straight_bar_carries_exactly_a_uniform_current() {
    let mesh = warped([0.02, 0.1, 0.03], [2, 5, 3], |x| x);
    let current = between(&mesh, "y_max", "y_min").expect("a bar");
    let exact = 1.0 / (0.02 * 0.03);
    for (_, j) in current.current_density() {
        // The solve's rounding on a condition of a few hundred.
        assert!((j[1] / exact + 1.0).abs() < 1e-11 && j[0].abs() + j[2].abs() < 1e-11 * exact, "{j:?}");
    }
    let report = current.report();
    assert!(report.correction < 1e-11 && report.after.jump < 1e-11 && report.after.wall < 1e-11);
    assert!(report.through.iter().all(|i| (i - 1.0).abs() < 1e-11), "{report}");
    assert_eq!(current.current_density().len(), mesh.topology().tets().len());
}

#[test]
fn a_bar_whose_nodes_are_all_terminals_needs_no_solve() {
    let mesh = warped([0.02, 0.1, 0.03], [1, 1, 1], |x| x);
    let current = between(&mesh, "y_min", "y_max").expect("a bar");
    for (_, j) in current.current_density() {
        assert!((j[1] * 0.02 * 0.03 - 1.0).abs() < 1e-12);
    }
}

#[test]
fn a_quarter_ring_carries_a_uniform_azimuthal_current() {
    let exact = 1.0 / ((OUTER - INNER) * HEIGHT);
    let mut last = f64::INFINITY;
    for n in [1, 2, 4] {
        let mesh = quarter([2 * n, 6 * n, 2 * n]);
        let current = between(&mesh, "y_min", "y_max").expect("a quarter ring");
        let error = off_azimuthal(&mesh, &current, exact);
        let report = current.report();
        println!("quarter ring {n}: off azimuthal {error:.4}; {report}");
        // Elements of constant J on chords: first order.
        assert!(error < 0.6 * last, "{error} after {last}");
        assert!(report.after.weak < 1e-13, "{:e}", report.after.weak);
        assert!(report.through.iter().all(|i| (i - 1.0).abs() < 0.02 / n as f64), "{report}");
        last = error;
    }
    assert!(last < 0.03, "{last}");
}

#[test]
fn a_closed_ring_carries_the_same_current_for_any_line_through_its_hole() {
    let exact = 1.0 / ((OUTER - INNER) * HEIGHT);
    let mesh = ring([3, 36, 3]);
    let current = around(&mesh, z_axis([0.0; 3])).expect("a ring");
    println!("ring: off azimuthal {:.4}; {}", off_azimuthal(&mesh, &current, exact), current.report());
    // A chord of 10° is up to 5° off the azimuth, 3 % to 6 % in the mean over elements.
    assert!(off_azimuthal(&mesh, &current, exact) < 0.07);
    assert!(current.report().after.weak < 1e-13);
    assert!(current.report().through.iter().all(|i| (i - 1.0).abs() < 0.01), "{}", current.report());

    let slanted = Frame::new([0.01, -0.005, 0.0], [0.2, 0.1, 1.0], None).expect("a line");
    let other = around(&mesh, slanted).expect("a ring");
    let against =
        around(&mesh, Frame::new([0.0; 3], [0.0, 0.0, -1.0], None).expect("a line")).expect("a ring");
    for ((a, b), c) in
        current.current_density().iter().zip(other.current_density()).zip(against.current_density())
    {
        // The conduction current does not depend on the line: only the solve's rounding differs.
        assert!(norm(tet4::sub(a.1, b.1)) < 1e-9 * exact);
        assert!(dot(a.1, c.1) < 0.0, "the other way round the other way");
    }
}

/// `½∫r×J` about z of a ring, of one ampere [m²].
fn moment(mesh: &Mesh, current: &RegionCurrent) -> f64 {
    let of = |(e, j): &(ElementId, Point)| {
        let vertices = mesh.vertices(*e);
        let c = tet4::centroid(vertices);
        0.5 * tet4::volume(vertices) * (c[0] * j[1] - c[1] * j[0])
    };
    current.current_density().iter().map(of).sum()
}

/// The direction of conduction in one element leans to the inside of a bend, and the current of the winding with it.
#[test]
fn the_current_of_a_ring_is_hardly_nearer_to_the_inside_than_its_chords() {
    for chords in [12, 24, 48] {
        let mesh = ring([3, chords, 3]);
        let current = around(&mesh, z_axis([0.0; 3])).expect("a ring");
        let angle = TAU / chords as f64;
        let of_chords = angle.sin() / angle;
        let of_circles = TAU * (OUTER.powi(3) - INNER.powi(3)) / (6.0 * (OUTER - INNER));
        let off = moment(&mesh, &current) / (of_chords * of_circles) - 1.0;
        println!(
            "{chords} chords: moment {off:+.5} off that of their polygons, these {:+.5}",
            of_chords - 1.0
        );
        // With the direction of each element itself 0.96 of it.
        assert!(off.abs() < 0.4 * (1.0 - of_chords), "{off}");
    }
}

#[test]
fn the_current_of_a_ring_of_changing_section_is_freed_of_divergence() {
    // Twice as high on one side: J1 of uniform magnitude is far from free of divergence.
    let flat = ring([3, 36, 3]);
    let points = flat.points().iter().map(|x| [x[0], x[1], x[2] * (1.5 + 0.5 * x[0] / x[0].hypot(x[1]))]);
    let mesh = Mesh::new(Arc::clone(flat.topology()), points.collect()).expect("a mesh");
    let current = around(&mesh, z_axis([0.0; 3])).expect("a ring");
    let report = current.report();
    println!("ring of changing section: {report}");
    assert!(report.before.weak > 0.01 && report.after.weak < 1e-13, "{report:?}");
    assert!(report.correction > 0.1);
    // 36 chords and three cells across: without the projection the sections differ by a factor of two.
    assert!(report.through.iter().all(|i| (i - 1.0).abs() < 0.04), "{report}");
}

#[test]
fn two_parts_in_series_each_carry_the_whole_current() {
    // A block of three layers of cells along x; the elements of the middle one are left out.
    let mesh = warped([0.03, 0.1, 0.02], [3, 4, 2], |x| x);
    let kept: Vec<_> = mesh
        .topology()
        .elements()
        .filter(|e| (tet4::centroid(mesh.vertices(*e))[0] - 0.015).abs() > 0.005)
        .collect();
    let path = Path::Terminals { from: terminal(&mesh, "y_min"), to: terminal(&mesh, "y_max") };
    let current = RegionCurrent::new(&mesh, "winding", &kept, &path).expect("two bars");
    for (_, j) in current.current_density() {
        assert!((j[1] * 0.01 * 0.02 - 1.0).abs() < 1e-11, "{j:?}");
    }
    let half: Vec<_> =
        terminal(&mesh, "y_max").triangles.into_iter().filter(|t| mesh.point(t[0])[0] < 0.015).collect();
    let to = Terminal { name: "half".to_owned(), triangles: half };
    let path = Path::Terminals { from: terminal(&mesh, "y_min"), to };
    let found = fault(RegionCurrent::new(&mesh, "winding", &kept, &path));
    assert!(
        matches!(&found, RegionFault::PartWithoutTerminal { parts: 2, terminal, .. } if terminal == "half")
    );
    let found = fault(RegionCurrent::new(&mesh, "winding", &kept, &Path::Closed(z_axis([0.5, 0.0, 0.0]))));
    assert_eq!(found, RegionFault::SeveralRings { parts: 2 });
}

/// Nothing passes along a line from strand to strand; with common nodes the two would be in parallel.
#[test]
fn parts_that_touch_along_a_line_are_in_series() {
    let mesh = warped([0.02, 0.1, 0.02], [2, 4, 2], |x| x);
    let is_low = |x: f64| x < 0.01;
    let of_diagonal = |e: &ElementId| {
        let c = tet4::centroid(mesh.vertices(*e));
        is_low(c[0]) == is_low(c[2])
    };
    let kept: Vec<_> = mesh.topology().elements().filter(of_diagonal).collect();
    let path = Path::Terminals { from: terminal(&mesh, "y_min"), to: terminal(&mesh, "y_max") };
    let current = RegionCurrent::new(&mesh, "winding", &kept, &path).expect("two bars");
    for (_, j) in current.current_density() {
        assert!((j[1] * 0.01 * 0.01 - 1.0).abs() < 1e-11, "{j:?}");
    }
}

#[test]
fn a_path_that_is_none_is_refused() {
    let bar = warped([0.02, 0.1, 0.03], [2, 3, 2], |x| x);
    let touching = fault(between(&bar, "y_min", "x_min"));
    assert!(matches!(touching, RegionFault::TerminalsTouch { .. }), "{touching}");
    let inside = Terminal { name: "inside".to_owned(), triangles: vec![[0, 1, 2].map(NodeId)] };
    let path = Path::Terminals { from: inside, to: terminal(&bar, "y_min") };
    let elements: Vec<_> = bar.topology().elements().collect();
    let elsewhere = fault(RegionCurrent::new(&bar, "winding", &elements, &path));
    assert_eq!(elsewhere.to_string().matches("`inside`").count(), 1, "{elsewhere}");
    assert_eq!(fault(RegionCurrent::new(&bar, "winding", &[], &path)), RegionFault::NoElements);

    assert_eq!(fault(around(&quarter([2, 6, 2]), z_axis([0.0; 3]))), RegionFault::NoRing);
    let ring = ring([2, 24, 2]);
    assert_eq!(fault(around(&ring, z_axis([0.2, 0.0, 0.0]))), RegionFault::NoRing);
    for centre in [[0.05, 0.0123, 0.0], ring.point(NodeId(5))] {
        let found = fault(around(&ring, z_axis(centre)));
        assert!(matches!(found, RegionFault::AxisInside { .. }), "{centre:?}: {found}");
    }
}

#[test]
fn the_current_does_not_depend_on_the_order_of_the_elements() {
    let mesh = quarter([2, 6, 2]);
    let forward: Vec<_> = mesh.topology().elements().collect();
    let backward: Vec<_> = forward.iter().rev().copied().collect();
    let path = Path::Terminals { from: terminal(&mesh, "y_min"), to: terminal(&mesh, "y_max") };
    let [a, b] =
        [forward, backward].map(|e| RegionCurrent::new(&mesh, "winding", &e, &path).expect("a coil"));
    assert_eq!(a, b);
    let by_element: HashMap<_, _> = a.current_density().iter().copied().collect();
    assert_eq!(by_element.len(), mesh.topology().tets().len());
}
