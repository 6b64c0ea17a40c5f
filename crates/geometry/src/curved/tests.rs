use std::f64::consts::PI;
use std::sync::Arc;

use super::*;
use crate::Mesh;
use crate::generate::{BlockParameters, SphereParameters, block, sphere};
use crate::tet4::{centroid, volume};

/// An eighth of a ball of 50 mm in air, with the region of the ball.
fn ball(divisions: usize) -> (Mesh, RegionId) {
    let parameters = SphereParameters { radius: 0.05, divisions, ..SphereParameters::default() };
    let mesh = sphere(&parameters).expect("a ball");
    let ball = mesh.topology().region("sphere").expect("it has one");
    (mesh, ball)
}

/// The surfaces of the ball alone, and the outer planes.
fn surfaces(mesh: &Mesh) -> CurvedSurfaces<'_> {
    CurvedSurfaces::new(mesh.topology(), mesh.points(), |_, _| true)
}

#[test]
fn the_facets_of_a_ball_are_off_it_by_the_height_of_their_arcs() {
    let (mesh, ball) = ball(6);
    let found = surfaces(&mesh).farthest().expect("it is curved");
    // The outer sphere is the larger one, and only the outside.
    let air = mesh.topology().region("air").expect("it has it");
    let surface = mesh.topology().interface(ball, air);
    assert!([ball, air].contains(&found.between.0) && found.between.1.is_some());
    let edges = surface.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let middle = |(a, b)| 0.05 - norm(centroid([mesh.point(a), mesh.point(b)]));
    let height = edges.map(middle).fold(0.0, f64::max);
    assert!((found.off / height - 1.0).abs() < 0.1, "{} {height}", found.off);
    let place = centroid(found.ends.map(|n| mesh.point(n)));
    assert!((0.05 - norm(place) - height).abs() < 0.2 * height);
    let flat = block(&BlockParameters { size: [0.1; 3], cells: [3; 3] }).expect("a block");
    assert_eq!(surfaces(&flat).farthest(), None);
    assert!(surfaces(&flat).onto_surfaces().iter().all(|motion| *motion == [0.0; 3]));
}

/// A mesh and its image in the plane through the origin across an axis, at which it ends.
fn with_image(mesh: &Mesh, axis: usize) -> Mesh {
    let topology = mesh.topology();
    let mut points = mesh.points().to_vec();
    let image_of: Vec<NodeId> = topology
        .nodes()
        .map(|node| {
            let mut image = mesh.point(node);
            if image[axis].abs() < 1e-9 {
                return node;
            }
            image[axis] = -image[axis];
            points.push(image);
            NodeId::new(points.len() - 1)
        })
        .collect();
    let images = topology.tets().iter().map(|tet| {
        let [a, b, c, d] = tet.map(|n| image_of[n.index()]);
        [a, b, d, c]
    });
    let tets = topology.tets().iter().copied().chain(images).collect();
    let regions = topology.region_of().repeat(2);
    let both = Topology::new(points.len(), tets, topology.region_names().to_vec(), regions).expect("sound");
    Mesh::new(Arc::new(both), points).expect("right-handed")
}

/// An ellipsoid with waves that go on smoothly in its images.
#[test]
fn a_part_of_a_device_has_the_surfaces_of_the_whole() {
    let (ball, _) = ball(5);
    let wave = |x: &Point| {
        let (r, square) = (0.05, |c: f64| c * c);
        let height =
            0.05 * (60.0 * x[0]).cos() * (45.0 * x[1]).cos() * (-square((norm(*x) - r) / 0.02)).exp();
        [0.2 * x[0] + height * x[0], height * x[1], height * x[2] - 0.2 * x[2]]
    };
    let octant =
        ball.moved(&ball.points().iter().map(wave).collect::<Vec<_>>()).expect("no element turns over");
    let whole = with_image(&with_image(&with_image(&octant, 0), 1), 2);
    let [of_octant, of_whole] = [&octant, &whole].map(|mesh| surfaces(mesh).onto_surfaces());
    let most = of_octant.iter().map(|motion| norm(*motion)).fold(0.0, f64::max);
    assert!(most > 1e-4, "{most}");
    // The nodes of the octant are the first ones of the whole.
    for (node, (own, other)) in of_octant.iter().zip(&of_whole).enumerate() {
        assert!(norm(sub(*own, *other)) < 1e-9 * most, "{:?}: {own:?} {other:?}", octant.points()[node]);
    }
    let [own, other] = [&octant, &whole].map(|mesh| surfaces(mesh).farthest().expect("it is curved").off);
    assert!((own / other - 1.0).abs() < 1e-9, "{own} {other}");
}

/// A sector of a cylinder of so many facets of 15 degrees each, between two planes through its axis, in air.
fn sector(facets: usize) -> Mesh {
    let angle = |k: f64| (15.0 * k).to_radians();
    let cells = BlockParameters { size: [2.0, facets as f64, 1.0], cells: [4, facets, 2] };
    let flat = block(&cells).expect("a block");
    let place = |&[r, k, z]: &Point| [(1.0 + r) * angle(k).cos(), (1.0 + r) * angle(k).sin(), z];
    let points: Vec<Point> = flat.points().iter().map(place).collect();
    let topology = flat.topology();
    let inner = |tet: &[NodeId; 4]| u32::from(centroid(tet.map(|n| flat.point(n)))[0] > 1.0);
    let regions = topology.tets().iter().map(|tet| RegionId(inner(tet))).collect();
    let names = vec!["body".to_owned(), "air".to_owned()];
    let parts = Topology::new(points.len(), topology.tets().to_vec(), names, regions).expect("sound");
    Mesh::new(Arc::new(parts), points).expect("right-handed")
}

#[test]
fn sectors_of_a_cylinder_have_its_facets_however_narrow_they_are() {
    let between = |a: RegionId, b: Option<RegionId>| b.is_some_and(|b| a != b);
    for facets in [1, 2, 5] {
        let mesh = sector(facets);
        let surfaces = CurvedSurfaces::new(mesh.topology(), mesh.points(), between);
        let off = surfaces.farthest().expect("it is curved").off;
        // By the normals of two facets half a per cent less than the height of the arc.
        let height = 2.0 * (1.0 - 7.5_f64.to_radians().cos());
        assert!((off / height - 1.0).abs() < 0.02, "{facets}: {off} {height}");
    }
}

/// Its volume is then that of the ball but for [`SHARED`] and what the next order leaves, a share that falls with the size of the
/// facets; its planes stay planes.
#[test]
fn a_ball_whose_facets_lie_on_it_in_the_mean_has_its_volume() {
    for divisions in [4, 6, 10] {
        let (mesh, ball) = ball(divisions);
        let motion = surfaces(&mesh).onto_surfaces();
        let moved = mesh.moved(&motion).expect("no element turns over");
        let of = |mesh: &Mesh| -> f64 {
            let topology = mesh.topology();
            topology.elements_of(ball).into_iter().map(|e| volume(mesh.vertices(e))).sum()
        };
        let exact = PI / 6.0 * 0.05f64.powi(3);
        let [before, after] = [&mesh, &moved].map(|mesh| of(mesh) / exact - 1.0);
        println!("{divisions}: {before:.5} {after:.5}");
        let share = after.abs() / before.abs();
        assert!(before < 0.0 && share < SHARED + 0.05 / divisions as f64, "{before} {after}");
        for (point, motion) in mesh.points().iter().zip(&motion) {
            assert!((0..3).all(|d| point[d] > 1e-9 || motion[d].abs() < 1e-15), "{point:?} {motion:?}");
        }
    }
}

/// A block whose top is bent along a line into two planes of several cells, and one whose top is an arc of as many chords.
#[test]
fn an_edge_between_planes_is_none_of_a_curved_surface() {
    let bent = |height: &dyn Fn(f64) -> f64| {
        let flat = block(&BlockParameters { size: [0.1; 3], cells: [6; 3] }).expect("a block");
        let [lower, upper] = flat.bounding_box();
        let lift = |x: &Point| {
            let share = (x[0] - lower[0]) / (upper[0] - lower[0]);
            [0.0, 0.0, height(share) * (x[2] - lower[2]) / (upper[2] - lower[2])]
        };
        let lifts: Vec<Point> = flat.points().iter().map(lift).collect();
        flat.moved(&lifts).expect("a sound mesh")
    };
    for slope in [0.1, 0.3, 0.6] {
        let roof = bent(&|share| -slope * 0.1 * (share - 0.5).abs());
        assert_eq!(surfaces(&roof).farthest(), None, "{slope}");
    }
    let arc = bent(&|share| -0.1 * (share - 0.5).powi(2));
    let found = surfaces(&arc).farthest().expect("it is curved");
    // A sixth of a parabola, under a slope of a third at the sides and none in the middle.
    let height = 0.1 / (6.0f64 * 2.0).powi(2);
    let ends = found.ends.map(|n| arc.point(n));
    assert!((found.off / height - 1.0).abs() < 0.15, "{} {height} at {ends:?}", found.off);
}
