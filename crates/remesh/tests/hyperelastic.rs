//! Motion in all directions by the hyperelastic energy: closed forms, derivatives, one function of the design, and its limits.

use crate::support::{self, Point, noise, product, unit_cells, whole};
use fluxmorph_geometry::Mesh;
use fluxmorph_remesh::{
    Boundary, BoundaryKind, LEAST_ROOM, Motion, MotionLaw, RemeshError, RemeshSetup, StiffnessPolicy,
};

/// A block whose whole outside is designed.
fn outside(mesh: &Mesh, policy: StiffnessPolicy) -> Motion {
    let setup = support::outer_design(mesh, whole(mesh), policy);
    Motion::new(mesh.clone(), RemeshSetup { law: MotionLaw::Hyperelastic, ..setup }).unwrap()
}

/// A block whose top is designed and whose sides slide.
fn top(mesh: &Mesh, policy: StiffnessPolicy) -> Motion {
    let slide = |name| Boundary::of_surface(mesh.topology(), name, BoundaryKind::Slide).unwrap();
    let height = mesh.bounding_box()[1][2];
    let setup = RemeshSetup {
        subregions: whole(mesh),
        policy,
        law: MotionLaw::Hyperelastic,
        design_nodes: support::nodes_where(mesh, |p| p[2] == height),
        boundaries: ["x_min", "x_max", "y_min", "y_max"].map(slide).to_vec(),
        ..RemeshSetup::default()
    };
    Motion::new(mesh.clone(), setup).unwrap()
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

/// Layers of height h in equilibrium have one stress: with a modulus inverse to the volume, J − 1/J is in proportion to h.
#[test]
fn thin_layers_keep_what_their_weight_says() {
    let heights = [0.0, 0.1, 0.4, 1.0, 2.5, 5.0];
    let flat = unit_cells([2, 2, 5]);
    let graded: Vec<Point> =
        flat.points().iter().map(|p| [0.0, 0.0, heights[p[2] as usize] - p[2]]).collect();
    let mesh = flat.moved(&graded).unwrap();
    let motion = top(&mesh, StiffnessPolicy::InverseVolume);
    for depth in [-2.5, 4.0] {
        let moved = motion.moved(&designed(&motion, |_| [0.0, 0.0, depth])).unwrap();
        let height = |layer: usize| {
            let is_there = |n: &fluxmorph_geometry::NodeId| flat.point(*n) == [0.0, 0.0, layer as f64];
            moved.mesh.point(mesh.topology().nodes().find(is_there).unwrap())[2]
        };
        let stress = |layer: usize| {
            let h = heights[layer + 1] - heights[layer];
            let stretch = (height(layer + 1) - height(layer)) / h;
            (stretch - 1.0 / stretch) / h
        };
        for layer in 1..5 {
            assert!((stress(layer) / stress(0) - 1.0).abs() < 1e-9, "{depth}: {layer}");
        }
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
    let motion = top(&mesh, StiffnessPolicy::InverseSize);
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
    let room = |design: &[Point]| motion.carried_along(&|_| design.to_vec()).unwrap().room;
    let exact = room(&design);
    let direction = wavy(&motion, 1.0, 1.0, 9);
    let h = 1e-6;
    let value = |h: f64| {
        let shifted = |(u, d): (&Point, &Point)| std::array::from_fn(|i| u[i] + h * d[i]);
        room(&design.iter().zip(&direction).map(shifted).collect::<Vec<_>>()).value
    };
    assert!(exact.value < 0.5, "a squeezed mesh");
    // The smooth minimum bends by β = 200: truncation of (β h)², rounding over h.
    let difference = (value(h) - value(-h)) / (2.0 * h);
    assert!((difference / product(&exact.gradient, &direction) - 1.0).abs() < 1e-5);
}
