//! Motion over rounds: what a round reproduces, where a path ends, what is tried when it is closed.

use std::ops::ControlFlow::Continue;
use std::path::Path;

use crate::support::{
    self, Point, at, largest_difference, nodes_where, on_threads, product, random, shaken, unit_cells, whole,
};
use fluxmorph_geometry::generate::{BlockParameters, SphereParameters, block, sphere};
use fluxmorph_geometry::io::msh::read_msh_file;
use fluxmorph_geometry::quality::qualities;
use fluxmorph_geometry::tet4::{add, cross};
use fluxmorph_geometry::{Mesh, NodeId};
use fluxmorph_remesh::{
    Boundary, BoundaryKind, Fallback, FallbackLevel, FallbackReport, KinematicConstraint, Motion,
    RemeshSetup, StepEvent, StepLimits, StiffnessPolicy, Subregion,
};

/// Blocks, plain and distorted, the octant of a ball in its layers, and Gmsh meshes; scaled to about a metre, so that
/// 1e-12 is rounding on all of them.
fn meshes() -> Vec<(&'static str, Mesh)> {
    let file = |name: &str| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/meshes").join(name);
        read_msh_file(&path, 0.01).unwrap().mesh
    };
    let ball =
        sphere(&SphereParameters { radius: 0.3, outer_radius: 1.0, divisions: 4, ..Default::default() });
    vec![
        ("block", unit_cells([5, 4, 3])),
        ("distorted block", shaken(&unit_cells([5, 4, 3]), 0.2)),
        ("octant of a ball", ball.unwrap()),
        ("ball.msh", file("ball.msh")),
        ("inductor.msh", file("inductor.msh")),
    ]
}

/// Every surface is designed, those between regions included; every region has the default law.
fn all_surfaces(mesh: &Mesh, policy: StiffnessPolicy) -> RemeshSetup {
    let topology = mesh.topology();
    let mut design_nodes: Vec<NodeId> = topology.facets().iter().flat_map(|f| f.nodes).collect();
    design_nodes.sort_unstable();
    design_nodes.dedup();
    let subregion = |name: &String| Subregion::of_region(topology, name).unwrap();
    let subregions = topology.region_names().iter().map(subregion).collect();
    RemeshSetup { subregions, policy, design_nodes, ..RemeshSetup::default() }
}

fn everywhere(mesh: &Mesh, motion: impl Fn(Point) -> Point) -> Vec<Point> {
    mesh.points().iter().map(|&p| motion(p)).collect()
}

#[test]
fn a_finite_rotation_of_all_surfaces_is_reproduced_in_one_step_and_in_rounds() {
    for (name, mesh) in meshes() {
        let motion = Motion::new(mesh.clone(), all_surfaces(&mesh, StiffnessPolicy::Uniform)).unwrap();
        let nodes = motion.map().design_nodes().to_vec();
        let path = |t: f64| {
            let turn = support::rotation(t);
            at(&mesh, &nodes, |p| add(turn(p), [0.5 * t, -t, 0.2 * t]))
        };
        let turn = support::rotation(1.0);
        let expected = everywhere(&mesh, |p| add(turn(p), [0.5, -1.0, 0.2]));
        let size = expected.iter().flatten().fold(1.0, |a: f64, b| a.max(b.abs()));
        let one = motion.moved(&path(1.0)).unwrap();
        assert!(largest_difference(&one.displacement, &expected) <= 1e-12 * size, "{name}");
        // A turn inverts nothing, so that a journey takes it in one step: rounds are begun by hand.
        let mut round = motion.clone();
        for k in 1..=3 {
            let design = path(f64::from(k) / 3.0);
            let moved = round.moved(&design).unwrap();
            round = round.rebased(moved.mesh, moved.displacement, design, round.policy()).unwrap();
        }
        assert_eq!(round.round(), 3);
        assert!(largest_difference(round.reference_displacement(), &expected) <= 1e-12 * size, "{name}");
        let outcome = motion.step_along(&path, &StepLimits::default(), &mut |_| Continue(())).unwrap();
        assert_eq!((outcome.reached, outcome.steps, outcome.fallbacks), (1.0, 1, 0), "{name}");
        assert_eq!(outcome.moved.displacement, one.displacement, "{name}");
    }
}

/// Translation and infinitesimal rotation have no strain whatever the stiffness, from any reference.
#[test]
fn translations_and_small_rotations_are_reproduced_by_every_policy_in_every_round() {
    for (name, mesh) in meshes() {
        for policy in StiffnessPolicy::ALL {
            let mut motion = Motion::new(mesh.clone(), all_surfaces(&mesh, policy)).unwrap();
            let spin = |p: Point| add(cross([0.02, -0.03, 0.05], p), [0.1, 0.2, -0.1]);
            for _ in 0..3 {
                let to = |n: &NodeId| spin(motion.reference().point(*n));
                let design: Vec<Point> = (motion.map().design_nodes().iter().zip(motion.reference_design()))
                    .map(|(n, u)| add(*u, to(n)))
                    .collect();
                let step = motion.step(&design).unwrap();
                let expected = everywhere(motion.reference(), spin);
                assert!(largest_difference(&step, &expected) <= 1e-12, "{name}, {policy:?}");
                let moved = motion.moved(&design).unwrap();
                motion = motion.rebased(moved.mesh, moved.displacement, design, policy).unwrap();
            }
        }
    }
}

/// A block with its top line designed, sliding sides, fixed bottom, and a force where asked for.
fn lined(cells: [usize; 3], policy: StiffnessPolicy, force: Point) -> Motion {
    let mesh = unit_cells(cells);
    let [_, [_, width, height]] = mesh.bounding_box();
    let kind = |name, kind| Boundary::of_surface(mesh.topology(), name, kind).unwrap();
    let mut boundaries: Vec<_> =
        ["x_min", "x_max", "y_min", "y_max"].map(|name| kind(name, BoundaryKind::Slide)).to_vec();
    boundaries.push(kind("z_max", BoundaryKind::Free));
    let setup = RemeshSetup {
        subregions: vec![Subregion { force, ..whole(&mesh).remove(0) }],
        policy,
        design_nodes: nodes_where(&mesh, |p| p[2] == height && p[1] == width / 2.0),
        boundaries,
        ..RemeshSetup::default()
    };
    Motion::new(mesh, setup).unwrap()
}

/// The line of a block moves along z by `by` at the end of the path.
fn sinking(motion: &Motion, by: f64) -> impl Fn(f64) -> Vec<Point> + Sync + use<> {
    let count = motion.map().design_nodes().len();
    move |t| vec![[0.0, 0.0, t * by]; count]
}

#[test]
fn a_later_round_is_affine_about_its_reference_design_and_transposes_exactly() {
    for policy in StiffnessPolicy::ALL {
        let first = lined([6, 6, 5], policy, [0.0; 3]);
        let reference = sinking(&first, -1.0)(1.0);
        let moved = first.moved(&reference).unwrap();
        let second = first.rebased(moved.mesh, moved.displacement, reference.clone(), policy).unwrap();
        let x = random(reference.len(), 3);
        let design: Vec<Point> = reference.iter().zip(&x).map(|(u, x)| add(*u, x.map(|x| 0.1 * x))).collect();
        let (step, linear) = (second.step(&design).unwrap(), second.map().linear(&x).unwrap());
        let tenth: Vec<Point> = linear.iter().map(|u| u.map(|u| 0.1 * u)).collect();
        assert!(largest_difference(&step, &tenth) < 1e-14, "{policy:?}: the reference is 1, steps are 0.1");
        let y = random(step.len(), 4);
        let (forward, transposed) = (product(&linear, &y), product(&x, &second.map().gradient(&y).unwrap()));
        assert!((forward - transposed).abs() <= 1e-12 * forward.abs().max(1.0), "{policy:?}");
    }
}

#[test]
fn rounds_count_and_know_their_reference() {
    let first = lined([6, 6, 5], StiffnessPolicy::InverseSize, [0.0; 3]);
    assert_eq!((first.round(), first.policy()), (0, StiffnessPolicy::InverseSize));
    assert!(first.reference_design().iter().chain(first.reference_displacement()).all(|u| *u == [0.0; 3]));
    let design = sinking(&first, -1.0)(1.0);
    let moved = first.moved(&design).unwrap();
    let policy = StiffnessPolicy::InverseVolume;
    let second =
        first.rebased(moved.mesh.clone(), moved.displacement.clone(), design.clone(), policy).unwrap();
    assert_eq!((second.round(), second.policy()), (1, policy));
    assert_eq!((second.reference_design(), second.reference().points()), (&design[..], moved.mesh.points()));
    assert_eq!(second.original().points(), first.original().points());
    // At the reference design the mesh is the reference, to the bit.
    let same = second.moved(&design).unwrap();
    assert_eq!((same.mesh.points(), same.displacement), (moved.mesh.points(), moved.displacement));
    assert_eq!(same.inversion.step, f64::INFINITY);
    assert!((first.shape(first.original()) - 1.0).abs() < 1e-12 && first.shape(second.reference()) < 0.9);
}

#[test]
fn the_force_acts_in_the_first_round_only() {
    let first = lined([6, 6, 5], StiffnessPolicy::InverseSize, [0.0, 0.0, 2e-3]);
    let rest = sinking(&first, 0.0)(1.0);
    let moved = first.moved(&rest).unwrap();
    assert_eq!(moved.displacement, first.map().offset());
    assert!(largest_difference(&moved.displacement, first.reference_displacement()) > 1e-3);
    let second = first.rebased(moved.mesh, moved.displacement.clone(), rest.clone(), first.policy()).unwrap();
    assert_eq!(second.moved(&rest).unwrap().displacement, moved.displacement);
    // Another stiffness before the first step does not lose it.
    let softer = first.with_policy(StiffnessPolicy::Uniform).unwrap();
    let expected = lined([6, 6, 5], StiffnessPolicy::Uniform, [0.0, 0.0, 2e-3]).moved(&rest).unwrap();
    let difference = largest_difference(&softer.moved(&rest).unwrap().displacement, &expected.displacement);
    assert!(difference < 1e-14, "{difference}");
}

#[test]
fn a_path_that_a_step_cannot_take_ends_on_its_displacement_with_every_element_whole() {
    for policy in StiffnessPolicy::ALL {
        let motion = lined([8, 8, 8], policy, [0.0; 3]);
        let path = sinking(&motion, -6.4);
        assert!(motion.moved(&path(1.0)).is_err());
        let nodes = motion.map().design_nodes().to_vec();
        let mut reached = vec![0.0];
        let mut on_event = |event: &StepEvent| {
            if let StepEvent::Stepped { reached: to, share, .. } = event {
                assert!(*share <= StepLimits::default().inversion_share);
                reached.push(*to);
            }
            Continue(())
        };
        let outcome = motion.step_along(&path, &StepLimits::default(), &mut on_event).unwrap();
        assert!(reached.windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!((reached.len() - 1, outcome.reached), (outcome.steps, 1.0));
        assert!(outcome.steps > 2 && qualities(&outcome.moved.mesh).iter().all(|q| *q > 0.0));
        for node in nodes {
            let off = largest_difference(&[outcome.moved.displacement[node.index()]], &path(1.0)[..1]);
            assert!(off <= 1e-14, "{off}"); // rounding of a sum of a few steps of 6.4
        }
    }
}

#[test]
fn rounds_and_remedies_have_the_same_bits_for_any_number_of_threads() {
    let bits = || {
        let motion = lined([8, 8, 8], StiffnessPolicy::Directional, [0.0; 3]);
        let path = sinking(&motion, -6.4);
        let travelled = motion.step_along(&path, &StepLimits::default(), &mut |_| Continue(())).unwrap();
        assert!(travelled.fallbacks > 0);
        travelled.moved.displacement.iter().flatten().map(|u| u.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(on_threads(1, bits), on_threads(3, bits));
}

#[test]
fn the_first_fallback_is_a_policy_that_carries_the_step_further() {
    let first = lined([8, 8, 8], StiffnessPolicy::Uniform, [0.0; 3]);
    let design = sinking(&first, -2.0)(1.0);
    let moved = first.moved(&design).unwrap();
    let second = first.rebased(moved.mesh, moved.displacement, design, StiffnessPolicy::Uniform).unwrap();
    let wanted = sinking(&first, -6.4)(1.0);
    let (motion, FallbackReport { fallback, admissible, quality }, level) =
        second.escalate(&wanted, FallbackLevel::None, &StepLimits::default()).unwrap().unwrap();
    assert!(matches!(fallback, Fallback::Policy { from: StiffnessPolicy::Uniform, .. }), "{fallback:?}");
    assert_eq!(
        (level, quality[0], motion.reference_design()),
        (FallbackLevel::Policies, quality[1], second.reference_design())
    );
    assert!(admissible[1] >= 1.1 * admissible[0], "{admissible:?}");
    let step = motion.step(&wanted).unwrap();
    // Half of the way to the inversion is what the limits admit.
    let half = 0.5 * motion.inversion(&step).step;
    assert!(admissible[1] <= half.min(1.0) * (1.0 + 1e-12), "{admissible:?}, {half}");
}

#[test]
fn the_second_fallback_smooths_the_interior_the_third_constrains_it_to_an_axis_and_there_is_no_fourth() {
    let first = lined([6, 6, 5], StiffnessPolicy::InverseVolume, [0.0; 3]);
    let mesh = first.original();
    let degraded = shaken(mesh, 0.32);
    let displacement: Vec<Point> = degraded
        .points()
        .iter()
        .zip(mesh.points())
        .map(|(a, b)| std::array::from_fn(|d| a[d] - b[d]))
        .collect();
    let design = first.reference_design().to_vec();
    let second = first.rebased(degraded, displacement, design, first.policy()).unwrap();
    let wanted = sinking(&first, -6.4)(1.0);
    let (third, FallbackReport { fallback, quality, .. }, level) =
        second.escalate(&wanted, FallbackLevel::Policies, &StepLimits::default()).unwrap().unwrap();
    assert!(matches!(fallback, Fallback::Smoothing { nodes } if nodes > 0), "{fallback:?}");
    assert!(level == FallbackLevel::Smoothing && quality[1] >= quality[0], "{quality:?}");
    let shape = [&second, &third].map(|motion| motion.shape(motion.reference()));
    assert!(shape[0] < 0.3 && shape[1] >= 0.3, "to the target: {shape:?}");
    for (n, u) in mesh.topology().nodes().zip(third.reference_displacement()) {
        assert!(!support::is_outer(mesh, n) || *u == [0.0; 3], "surfaces stay");
        let place = largest_difference(&[add(mesh.point(n), *u)], &[third.reference().point(n)]);
        assert!(place < 1e-14, "the displacement is that from the original mesh");
    }
    let (fourth, FallbackReport { fallback, .. }, level) =
        third.escalate(&wanted, level, &StepLimits::default()).unwrap().unwrap();
    assert!(matches!(fallback, Fallback::AxisConstraint { axis: 2 }), "{fallback:?}");
    assert_eq!(fourth.round(), third.round() + 1);
    assert!(fourth.escalate(&wanted, level, &StepLimits::default()).unwrap().is_none());
}

#[test]
fn columns_that_twist_are_moved_anew_along_their_axis() {
    // Columns 1 mm wide, neighbours on the top 40 mm apart.
    let mesh = block(&BlockParameters { size: [0.006, 0.006, 0.08], cells: [6, 6, 6] }).unwrap();
    let design_nodes = nodes_where(&mesh, |p| p[2] == 0.08);
    let sides = ["x_min", "x_max", "y_min", "y_max"];
    let slide = |name| Boundary::of_surface(mesh.topology(), name, BoundaryKind::Slide).unwrap();
    let setup = RemeshSetup {
        subregions: whole(&mesh),
        design_nodes: design_nodes.clone(),
        boundaries: sides.map(slide).to_vec(),
        ..RemeshSetup::default()
    };
    let up = |p: Point| (p[0] * 1e3 + p[1] * 1e3).round() % 2.0 == 0.0;
    let path = |t: f64| at(&mesh, &design_nodes, |p| [0.0, 0.0, if up(p) { 0.02 * t } else { -0.02 * t }]);
    let motion = Motion::new(mesh.clone(), setup).unwrap();
    let mut constrained = 0;
    let mut on_event = |event: &StepEvent| {
        constrained += usize::from(matches!(
            event,
            StepEvent::FellBack {
                report: FallbackReport { fallback: Fallback::AxisConstraint { axis: 2 }, .. },
                ..
            }
        ));
        Continue(())
    };
    let outcome = motion.step_along(&path, &StepLimits::default(), &mut on_event).unwrap();
    assert_eq!((constrained, outcome.reached), (1, 1.0));
    assert_eq!(outcome.motion.map().kinematic_constraint(), KinematicConstraint::Axis(2));
    assert!(outcome.moved.displacement.iter().all(|u| u[0] == 0.0 && u[1] == 0.0));
    assert!(qualities(&outcome.moved.mesh).iter().all(|q| *q > 0.0));
}

#[test]
fn a_path_through_the_floor_ends_before_it_with_a_whole_mesh() {
    let motion = lined([6, 6, 5], StiffnessPolicy::InverseSize, [0.0; 3]);
    let path = sinking(&motion, -6.0);
    let outcome = motion.step_along(&path, &StepLimits::default(), &mut |_| Continue(())).unwrap();
    // The line meets the bottom at 5/6 of the path.
    assert!((0.7..5.0 / 6.0).contains(&outcome.reached), "{}", outcome.reached);
    assert!(qualities(&outcome.moved.mesh).iter().all(|q| *q > 0.0));
    assert!(outcome.steps < StepLimits::default().rounds, "it ends by itself");

    let motion = lined([6, 6, 5], StiffnessPolicy::InverseSize, [0.0; 3]);
    let few = StepLimits { rounds: 2, ..StepLimits::default() };
    let outcome = motion.step_along(&path, &few, &mut |_| Continue(())).unwrap();
    assert!(outcome.steps == 2 && outcome.reached < 0.8, "{}", outcome.reached);
}
