//! Motion along one axis by the convex energy: closed forms, derivatives, one function of the design, and its limits.

use crate::support::{self, Point, noise, product, unit_cells, whole};
use fluxmorph_geometry::Mesh;
use fluxmorph_remesh::{
    Boundary, BoundaryKind, LEAST_ROOM, Motion, MotionLaw, RemeshError, RemeshSetup, StiffnessPolicy,
};

/// A block whose top is designed and whose sides slide, on rails along z.
fn motion(mesh: &Mesh, policy: StiffnessPolicy) -> Motion {
    let slide = |name| Boundary::of_surface(mesh.topology(), name, BoundaryKind::Slide).unwrap();
    let top = mesh.bounding_box()[1][2];
    let setup = RemeshSetup {
        subregions: whole(mesh),
        policy,
        law: MotionLaw::Rails(2),
        design_nodes: support::nodes_where(mesh, |p| p[2] == top),
        boundaries: ["x_min", "x_max", "y_min", "y_max"].map(slide).to_vec(),
        ..RemeshSetup::default()
    };
    Motion::new(mesh.clone(), setup).unwrap()
}

/// Displacements of the top along z.
fn along(values: impl IntoIterator<Item = f64>) -> Vec<Point> {
    values.into_iter().map(|z| [0.0, 0.0, z]).collect()
}

fn uniform(motion: &Motion, z: f64) -> Vec<Point> {
    along(motion.map().design_nodes().iter().map(|_| z))
}

/// Up to `size` up and down.
fn rough(motion: &Motion, size: f64, seed: u64) -> Vec<Point> {
    let mut noise = noise(seed);
    along(motion.map().design_nodes().iter().map(|_| size * noise()))
}

#[test]
fn one_weight_a_volume_stretches_a_block_evenly_however_far() {
    let mesh = support::shaken(&unit_cells([4, 4, 5]), 0.15);
    let motion = motion(&mesh, StiffnessPolicy::Uniform);
    for z in [-4.5, -1.0, 7.0] {
        let moved = motion.moved(&uniform(&motion, z)).unwrap();
        for (x, u) in mesh.points().iter().zip(&moved.displacement) {
            // Rounding of displacements of order one, times the steepness of the barrier.
            assert!(u[0] == 0.0 && u[1] == 0.0 && (u[2] - z * x[2] / 5.0).abs() < 1e-12, "{u:?}");
        }
    }
}

/// Layers of height h in equilibrium have one stress: with a modulus inverse to the volume, J − 1/J is in proportion to h.
#[test]
fn thin_layers_keep_what_their_weight_says() {
    let heights = [0.0, 0.1, 0.4, 1.0, 2.5, 5.0];
    let flat = unit_cells([2, 2, 5]);
    let graded: Vec<Point> =
        flat.points().iter().map(|p| [0.0, 0.0, heights[p[2] as usize] - p[2]]).collect();
    let mesh = flat.moved(&graded).unwrap();
    let motion = motion(&mesh, StiffnessPolicy::InverseVolume);
    let moved = motion.moved(&uniform(&motion, -2.5)).unwrap();
    let height = |layer: usize| {
        let node = mesh.topology().nodes().find(|n| flat.point(*n) == [0.0, 0.0, layer as f64]).unwrap();
        moved.mesh.point(node)[2]
    };
    let stress = |layer: usize| {
        let h = heights[layer + 1] - heights[layer];
        let stretch = (height(layer + 1) - height(layer)) / h;
        (stretch - 1.0 / stretch) / h
    };
    for layer in 1..5 {
        assert!((stress(layer) / stress(0) - 1.0).abs() < 1e-10, "{layer}");
    }
    assert!((height(1) - height(0)) / 0.1 > 0.9, "the skin keeps its thickness");
}

#[test]
fn the_pulled_back_derivative_is_that_of_differences() {
    let mesh = support::shaken(&unit_cells([5, 4, 4]), 0.15);
    let motion = motion(&mesh, StiffnessPolicy::InverseSize);
    let directions = (11..16).map(|seed| rough(&motion, 1.0, seed));
    support::assert_pull_back(&motion, &rough(&motion, 0.8, 3), directions, 1e-8);
}

#[test]
fn the_mesh_of_a_design_has_the_same_bits_whatever_came_before_and_for_any_number_of_threads() {
    let mesh = support::shaken(&unit_cells([5, 4, 4]), 0.15);
    let motion = || motion(&mesh, StiffnessPolicy::InverseVolume);
    support::assert_one_function(motion, |own| rough(own, 0.9, 7), |own, seed| rough(own, 1.0, seed));
}

#[test]
fn a_way_through_the_floor_is_cut_before_it_and_the_room_there_is_the_least_one() {
    let mesh = unit_cells([4, 4, 5]);
    let motion = motion(&mesh, StiffnessPolicy::InverseSize);
    let path = |t: f64| uniform(&motion, -6.0 * t);
    assert!(matches!(motion.moved(&path(1.0)), Err(RemeshError::Inverted { .. })));
    let carried = motion.carried_along(&path).unwrap();
    // The top meets the floor at 5/6 of the path, and each element should keep more than the least room.
    assert!(carried.share < 5.0 / 6.0 * (1.0 - LEAST_ROOM) && carried.share > 0.7, "{}", carried.share);
    assert!(carried.room.value < 0.0 && carried.moved.inversion.step > 1.0);
    let whole = motion.carried_along(&|t| uniform(&motion, -3.0 * t)).unwrap();
    assert!(whole.share == 1.0 && (0.3..0.4).contains(&whole.room.value), "{}", whole.room.value);
}

#[test]
fn room_and_shortfall_have_exact_derivatives_on_both_sides_of_the_limit() {
    let mesh = support::shaken(&unit_cells([4, 4, 4]), 0.1);
    let motion = motion(&mesh, StiffnessPolicy::InverseSize);
    let room = |design: &[Point]| motion.carried_along(&|_| design.to_vec());
    let shortfall = |design: &[Point]| motion.shortfall(design, None).unwrap().unwrap();
    let shifted = |design: &[Point], direction: &[Point], h: f64| -> Vec<Point> {
        design.iter().zip(direction).map(|(u, d)| [0.0, 0.0, u[2] + h * d[2]]).collect()
    };
    let h = 1e-6;
    let (inside, beyond) = (rough(&motion, 1.0, 1), uniform(&motion, -4.3));
    let direction = rough(&motion, 1.0, 9);
    let value = |h: f64| room(&shifted(&inside, &direction, h)).unwrap().room.value;
    let exact = product(&room(&inside).unwrap().room.gradient, &direction);
    // The smooth minimum bends by β = 200: truncation of (β h)², rounding over h.
    assert!(((value(h) - value(-h)) / (2.0 * h) / exact - 1.0).abs() < 1e-5);
    assert_eq!(shortfall(&inside).value, 0.0);
    let exact = product(&shortfall(&beyond).gradient, &direction);
    let value = |h: f64| shortfall(&shifted(&beyond, &direction, h)).value;
    assert!(((value(h) - value(-h)) / (2.0 * h) / exact - 1.0).abs() < 1e-5);
}
