//! Motion in all directions by the hyperelastic energy: closed forms, derivatives, one function of the design, and its limits.

use crate::support::{self, Point, noise, unit_cells, whole};
use fluxmorph_geometry::Mesh;
use fluxmorph_remesh::{LEAST_ROOM, Motion, MotionLaw, RemeshError, RemeshSetup, StiffnessPolicy};

/// A block whose whole outside is designed.
fn outside(mesh: &Mesh, policy: StiffnessPolicy) -> Motion {
    let setup = support::outer_design(mesh, whole(mesh), policy);
    Motion::new(mesh.clone(), RemeshSetup { law: MotionLaw::Hyperelastic, ..setup }).unwrap()
}

fn designed(motion: &Motion, displacement: impl Fn(Point) -> Point) -> Vec<Point> {
    support::at(motion.original(), motion.map().design_nodes(), displacement)
}

/// A wave of all three components with up to `size`, and as much noise as is said.
fn wavy(motion: &Motion, size: f64, rough: f64, seed: u64) -> Vec<Point> {
    let mut noise = noise(seed);
    let shift = seed as f64;
    let wave = |x: Point| std::array::from_fn(|d| (0.9 * x[d] + 0.7 * x[(d + 1) % 3] + shift).sin());
    let smooth = designed(motion, wave);
    smooth.iter().map(|u| u.map(|u| size * (u + rough * noise()))).collect()
}

#[test]
fn any_rotation_turns_the_whole_mesh() {
    let mesh = support::shaken(&unit_cells([4, 4, 4]), 0.15);
    let motion = outside(&mesh, StiffnessPolicy::InverseVolume);
    for angle in [0.4, 2.0, 3.1] {
        let turn = support::rotation(angle);
        let moved = motion.moved(&designed(&motion, &turn)).unwrap();
        let exact: Vec<Point> = mesh.points().iter().map(|x| turn(*x)).collect();
        // Rounding of displacements of order one. The linear solution is another one: its elements are of different weights.
        assert!(support::largest_difference(&moved.displacement, &exact) < 1e-12);
        assert!(moved.newton_steps > 1);
    }
}

#[test]
fn one_weight_a_volume_follows_any_affine_motion() {
    let mesh = support::shaken(&unit_cells([4, 4, 4]), 0.15);
    let motion = outside(&mesh, StiffnessPolicy::Uniform);
    let affine = |x: Point| [0.8 * x[0] + 0.5 * x[1], -0.5 * x[0] - 0.3 * x[2], 0.4 * x[1] - 0.4 * x[2]];
    let moved = motion.moved(&designed(&motion, affine)).unwrap();
    let exact: Vec<Point> = mesh.points().iter().map(|x| affine(*x)).collect();
    assert!(support::largest_difference(&moved.displacement, &exact) < 1e-12);
}

#[test]
fn thin_layers_keep_what_their_weight_says() {
    for depth in [-2.5, 4.0] {
        support::assert_layers_keep_what_their_weight_says(MotionLaw::Hyperelastic, depth);
    }
}

#[test]
fn the_pulled_back_derivative_is_that_of_differences() {
    let mesh = support::shaken(&unit_cells([5, 4, 4]), 0.15);
    let motion = outside(&mesh, StiffnessPolicy::InverseSize);
    let design = wavy(&motion, 0.4, 0.5, 3);
    let moved = motion.moved(&design).unwrap();
    assert!(moved.inversion.step < 2.0, "far from rest: {}", moved.inversion.step);
    // Third derivatives of a steep barrier.
    let directions = (11..16).map(|seed| wavy(&motion, 1.0, 1.0, seed));
    support::assert_pull_back(&motion, &design, directions, 1e-7);
}

#[test]
fn the_mesh_of_a_design_has_the_same_bits_whatever_came_before_and_for_any_number_of_threads() {
    let mesh = support::shaken(&unit_cells([5, 4, 4]), 0.15);
    let motion = || outside(&mesh, StiffnessPolicy::InverseVolume);
    support::assert_one_function(motion, |own| wavy(own, 0.4, 0.5, 7), |own, seed| wavy(own, 0.5, 0.5, seed));
}

#[test]
fn a_way_through_the_floor_is_cut_before_it() {
    let mesh = unit_cells([4, 4, 5]);
    let motion = support::sliding_top(&mesh, StiffnessPolicy::InverseSize, MotionLaw::Hyperelastic);
    let path = |t: f64| designed(&motion, |_| [0.0, 0.0, -6.0 * t]);
    assert!(matches!(
        motion.moved(&path(1.0)),
        Err(RemeshError::Inverted { .. } | RemeshError::NotSettled { .. })
    ));
    let carried = motion.carried_along(&path).unwrap();
    // The top meets the floor at 5/6 of the path, and each element should keep more than the least room.
    assert!(carried.share < 5.0 / 6.0 * (1.0 - LEAST_ROOM) && carried.share > 0.6, "{}", carried.share);
    assert!(carried.room.value <= 0.0 && carried.moved.inversion.step > 1.0);
    let towards: f64 = carried.room.gradient.iter().map(|g| g[2]).sum();
    assert!(towards > 0.0, "up there is more room");
}

#[test]
fn the_room_has_an_exact_derivative() {
    let mesh = support::shaken(&unit_cells([4, 4, 4]), 0.1);
    let motion = outside(&mesh, StiffnessPolicy::InverseSize);
    let design = wavy(&motion, 0.4, 0.5, 1);
    let room = |design: &[Point]| {
        let room = motion.carried_along(&|_| design.to_vec()).unwrap().room;
        (room.value, room.gradient)
    };
    assert!(room(&design).0 < 0.5, "a squeezed mesh");
    support::assert_derivative(room, &design, &wavy(&motion, 1.0, 1.0, 9));
}
