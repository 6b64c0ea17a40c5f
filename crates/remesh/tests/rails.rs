//! Motion along one axis by the convex energy: closed forms, derivatives, one function of the design, and its limits.

use crate::support::{self, Point, noise, unit_cells};
use fluxmorph_geometry::Mesh;
use fluxmorph_remesh::{LEAST_ROOM, Motion, MotionLaw, RemeshError, StiffnessPolicy};

/// A block on rails along z.
fn motion(mesh: &Mesh, policy: StiffnessPolicy) -> Motion {
    support::sliding_top(mesh, policy, MotionLaw::Rails(2))
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

#[test]
fn thin_layers_keep_what_their_weight_says() {
    support::assert_layers_keep_what_their_weight_says(MotionLaw::Rails(2), -2.5);
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
    let room = |design: &[Point]| {
        let room = motion.carried_along(&|_| design.to_vec()).unwrap().room;
        (room.value, room.gradient)
    };
    let shortfall = |design: &[Point]| {
        let shortfall = motion.shortfall(design, None).unwrap().unwrap();
        (shortfall.value, shortfall.gradient)
    };
    let (inside, beyond) = (rough(&motion, 1.0, 1), uniform(&motion, -4.3));
    let direction = rough(&motion, 1.0, 9);
    assert_eq!(shortfall(&inside).0, 0.0);
    support::assert_derivative(room, &inside, &direction);
    support::assert_derivative(shortfall, &beyond, &direction);
}
