//! Finer meshes: conforming, of the same bodies, and no worse than a bounded factor however far they are refined.

use fluxmorph_geometry::generate::{
    BlockParameters, ShieldParameters, SphereParameters, block, shield, sphere,
};
use fluxmorph_geometry::quality::QualityReport;
use fluxmorph_geometry::refine::{Bisection, RefineLimits, Refinement, uniform};
use fluxmorph_geometry::tet4::{Point, area_vector, centroid, dot, sub, volume};
use fluxmorph_geometry::{ElementId, Mesh, MeshError, NodeId};

use crate::msh_support::Random;

/// A graded mesh of boxes, one with a curved surface, and a block with crooked nodes.
fn meshes() -> Vec<Mesh> {
    let coarse = ShieldParameters { refinement: 0.25, ..ShieldParameters::default() };
    let ball = SphereParameters { divisions: 2, ..SphereParameters::default() };
    vec![shield(&coarse).expect("valid"), sphere(&ball).expect("valid"), crooked(1)]
}

/// A block whose nodes are moved by up to a quarter of a cell: all edges have lengths of their own.
fn crooked(seed: u64) -> Mesh {
    let mesh = block(&BlockParameters { size: [3.0; 3], cells: [3; 3] }).expect("a block");
    let mut random = Random(seed);
    let inner = |x: f64| x > 0.1 && x < 2.9;
    let mut shift = |x: &Point| x.map(|c| if inner(c) { 0.4 * (random.unit() - 0.5) } else { 0.0 });
    let moved: Vec<Point> = mesh.points().iter().map(&mut shift).collect();
    mesh.moved(&moved).expect("a quarter of a cell inverts nothing")
}

fn worst(mesh: &Mesh) -> f64 {
    QualityReport::of_mesh(mesh).expect("elements").worst
}

fn total_area(mesh: &Mesh, triangles: &[[NodeId; 3]]) -> ([f64; 3], f64) {
    let mut sum = ([0.0; 3], 0.0);
    for triangle in triangles {
        let area = area_vector(triangle.map(|n| mesh.point(n)));
        (0..3).for_each(|d| sum.0[d] += area[d]);
        sum.1 += dot(area, area).sqrt();
    }
    sum
}

/// Sums of up to 1e6 terms of one sign: at most as many roundings, of which most cancel.
fn assert_close(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() <= 1e-11 * expected.abs().max(1e-30), "{what}: {found} {expected}");
}

/// Everything that a finer mesh must keep. A node that hangs would leave faces without a neighbour inside, whose area is that
/// of no outer surface.
fn assert_sound(coarse: &Mesh, refinement: &Refinement) {
    let fine = refinement.mesh();
    let (old, new) = (coarse.topology(), fine.topology());
    let outer = |mesh: &Mesh| {
        total_area(mesh, &mesh.topology().outer_facets().map(|facet| facet.nodes).collect::<Vec<_>>()).1
    };
    assert_close(outer(fine), outer(coarse), "the outside");
    for name in old.region_names() {
        let of = |mesh: &Mesh| -> f64 {
            let topology = mesh.topology();
            let elements = topology.elements_of(topology.region(name).expect("inherited"));
            elements.into_iter().map(|e| volume(mesh.vertices(e))).sum()
        };
        assert_close(of(fine), of(coarse), name);
        if let Some(cells) = old.given_cells(name) {
            let volumes = |mesh: &Mesh, cells: &[Vec<ElementId>]| -> Vec<f64> {
                cells.iter().map(|cell| cell.iter().map(|&e| volume(mesh.vertices(e))).sum()).collect()
            };
            let inherited = new.given_cells(name).expect("inherited");
            let pairs = volumes(fine, inherited).into_iter().zip(volumes(coarse, cells));
            pairs.for_each(|(found, expected)| assert_close(found, expected, name));
        }
    }
    for name in old.surface_names() {
        let (before, after) = (old.surface(name).expect("there"), new.surface(name).expect("inherited"));
        assert!(after.iter().all(|triangle| new.has_face(*triangle)), "{name} is made of faces");
        let ((vector, area), (old_vector, old_area)) = (total_area(fine, after), total_area(coarse, before));
        assert_close(area, old_area, name);
        let turned = sub(vector, old_vector);
        assert!(dot(turned, turned).sqrt() < 1e-12 * old_area, "{name} keeps its side");
    }
    assert_eq!(refinement.prolong(coarse.points()), fine.points(), "nodes lie where their parents say");
    for (e, ancestor) in new.elements().zip(refinement.ancestors()) {
        assert_eq!(new.region_name_at(e), old.region_name_at(*ancestor));
        let barycentric = inside(coarse.vertices(*ancestor), centroid(fine.vertices(e)));
        assert!(barycentric > 0.0, "element {e} lies in its ancestor");
    }
}

/// The least barycentric coordinate of a point, times six volumes.
fn inside(vertices: [Point; 4], point: Point) -> f64 {
    (0..4)
        .map(|v| {
            let mut part = vertices;
            part[v] = point;
            volume(part)
        })
        .fold(f64::INFINITY, f64::min)
}

fn elements_at(mesh: &Mesh, point: Point) -> Vec<ElementId> {
    mesh.topology().elements().filter(|&e| inside(mesh.vertices(e), point) >= 0.0).collect()
}

#[test]
fn a_halved_mesh_has_the_same_bodies_and_eight_times_the_elements() {
    for mesh in meshes() {
        let once = uniform(&mesh, RefineLimits::default()).expect("eight for each");
        assert_eq!(once.mesh().topology().tets().len(), 8 * mesh.topology().tets().len());
        assert_sound(&mesh, &once);
        let again = uniform(once.mesh(), RefineLimits::default()).expect("eight for each");
        assert_sound(&mesh, &once.then(again));
    }
}

/// Kröger and Preusser: the shapes stay regular; here, that they stop changing after the first halving.
#[test]
fn shapes_do_not_degenerate_however_often_edges_are_halved() {
    for seed in 1..4 {
        let mesh = crooked(seed);
        let mut worsts = vec![worst(&mesh)];
        let mut refinement = Refinement::none(mesh);
        for _ in 0..3 {
            let next = uniform(refinement.mesh(), RefineLimits::default()).expect("small");
            worsts.push(worst(next.mesh()));
            refinement = refinement.then(next);
        }
        println!("worst quality by halvings: {worsts:.3?}");
        // Measured 0.6 of the first; a scheme that degenerates loses a factor each time.
        assert!(worsts[3] > 0.9 * worsts[1] && worsts[3] > 0.3 * worsts[0], "{worsts:?}");
    }
}

#[test]
fn bisected_meshes_conform_whatever_is_marked() {
    for (seed, mesh) in (1..).zip(meshes()) {
        let mut random = Random(seed);
        let mut bisection = Bisection::new(&mesh, RefineLimits::default());
        let mut refinement = bisection.refinement().expect("as it is");
        assert_eq!(refinement.mesh().topology().tets(), mesh.topology().tets());
        for _ in 0..8 {
            let all = refinement.mesh().topology().elements();
            let marked: Vec<ElementId> = all.filter(|_| random.below(20) == 0).collect();
            bisection.refine(&marked).expect("no limit is near");
            refinement = bisection.refinement().expect("sound elements");
            assert_sound(&mesh, &refinement);
        }
    }
}

#[test]
fn a_hundred_random_refinements_of_random_meshes_are_sound() {
    for seed in 0..100 {
        let mesh = crooked(seed);
        let mut random = Random(1000 + seed);
        let mut bisection = Bisection::new(&mesh, RefineLimits::default());
        for _ in 0..=random.below(4) {
            let count = bisection.refinement().expect("sound").mesh().topology().tets().len() as u64;
            let marked: Vec<ElementId> =
                (0..1 + random.below(9)).map(|_| ElementId::new(random.below(count) as usize)).collect();
            bisection.refine(&marked).expect("no limit is near");
        }
        assert_sound(&mesh, &bisection.refinement().expect("sound elements"));
    }
}

/// Arnold, Mukherjee and Pouly, theorem 4.2: finitely many shapes. Towards a point, where levels go deep.
#[test]
fn quality_is_bounded_however_deep_a_point_is_refined() {
    for mesh in meshes() {
        let place = centroid(mesh.vertices(ElementId(0)));
        let mut bisection = Bisection::new(&mesh, RefineLimits::default());
        let mut worsts = Vec::new();
        for _ in 0..45 {
            let refinement = bisection.refinement().expect("sound");
            worsts.push(worst(refinement.mesh()));
            bisection.refine(&elements_at(refinement.mesh(), place)).expect("no limit is near");
        }
        let refinement = bisection.refinement().expect("sound");
        assert_sound(&mesh, &refinement);
        println!(
            "worst quality {:.2e} at first, {:.2e} after 15, {:.2e} after 45",
            worsts[0], worsts[15], worsts[44]
        );
        // After a dozen bisections all shapes of an element have come; more bring no worse ones.
        assert!(worsts[44] >= 0.999 * worsts[20], "{worsts:?}");
        assert!(worsts[44] > 0.1 * worsts[0], "{worsts:?}");
    }
}

#[test]
fn all_elements_thrice_halve_every_edge_at_least() {
    let mesh = crooked(7);
    let mut bisection = Bisection::new(&mesh, RefineLimits::default());
    for _ in 0..3 {
        let all: Vec<ElementId> =
            bisection.refinement().expect("sound").mesh().topology().elements().collect();
        bisection.refine(&all).expect("small");
    }
    let refinement = bisection.refinement().expect("sound");
    let mut parts = vec![0; mesh.topology().tets().len()];
    refinement.ancestors().iter().for_each(|e| parts[e.index()] += 1);
    assert!(parts.iter().all(|&count| count >= 8), "{parts:?}");
}

#[test]
fn halved_elements_have_eight_parts_and_the_mesh_conforms() {
    for (seed, mesh) in (1..).zip(meshes()) {
        let mut random = Random(seed);
        let marked: Vec<ElementId> = mesh.topology().elements().filter(|_| random.below(10) == 0).collect();
        let mut bisection = Bisection::new(&mesh, RefineLimits::default());
        bisection.halve(&marked).expect("no limit is near");
        let refinement = bisection.refinement().expect("sound elements");
        assert_sound(&mesh, &refinement);
        let mut parts = vec![0; mesh.topology().tets().len()];
        refinement.ancestors().iter().for_each(|e| parts[e.index()] += 1);
        assert!(marked.iter().all(|e| parts[e.index()] >= 8), "{parts:?}");
        // Others are cut where they must be, and not all of them.
        assert!(parts.contains(&1) || marked.is_empty(), "{parts:?}");
    }
}

#[test]
fn the_same_marks_give_the_same_bits_for_any_number_of_threads() {
    let mesh = crooked(3);
    let refined = || {
        let mut bisection = Bisection::new(&mesh, RefineLimits::default());
        bisection.refine(&[ElementId(5), ElementId(50)]).expect("small");
        let local = bisection.refinement().expect("sound");
        let whole = uniform(local.mesh(), RefineLimits::default()).expect("small");
        let mesh = whole.mesh();
        (mesh.topology().tets().to_vec(), mesh.points().to_vec(), whole.parents().to_vec())
    };
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
    let one = pool(1).install(refined);
    assert!(one == pool(4).install(refined));
}

#[test]
fn a_limit_is_named_and_leaves_the_mesh_as_it_was() {
    let mesh = crooked(2);
    let count = mesh.topology().tets().len();
    let few = RefineLimits { most_tets: count + 10, ..RefineLimits::default() };
    let message = |error: MeshError| error.to_string();
    let error = message(uniform(&mesh, few).expect_err("eight times as many"));
    assert_eq!(error, "a finer mesh would have more than 172 elements: it is refined as far as it may be");
    let mut bisection = Bisection::new(&mesh, few);
    let all: Vec<ElementId> = mesh.topology().elements().collect();
    bisection.refine(&all).expect_err("twice as many");
    let same = bisection.refinement().expect("as it was");
    assert_eq!(same.mesh().topology().tets(), mesh.topology().tets());
    let shallow = RefineLimits { most_levels: 2, ..RefineLimits::default() };
    let mut bisection = Bisection::new(&mesh, shallow);
    let outcome = (0..5).try_for_each(|_| bisection.refine(&[ElementId(0)]));
    let error = message(outcome.expect_err("two levels at most"));
    assert!(error.contains("more than 2 bisections of one element"), "{error}");
    assert_sound(&mesh, &bisection.refinement().expect("as before the limit"));
}
