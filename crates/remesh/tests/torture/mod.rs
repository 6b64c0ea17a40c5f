//! Motions that break a mesh in one step, and that rounds take without a single inverted element.
//!
//! `cargo test --release -p fluxmorph-remesh --test remesh torture -- --nocapture` prints what is measured, `write_the_table`
//! (`just torture`) puts all of it into docs/torture.md.

mod ball;
mod case;
mod cases;
mod page;
mod rails;
mod skin;

use case::{Case, Outcome};
use fluxmorph_geometry::quality::qualities;
use fluxmorph_remesh::{KinematicConstraint, StepLimits, StiffnessPolicy};

use crate::support;

/// Outcomes of a case, with what holds for every one: the motion arrives, every element on the way is valid, and every
/// round kept away from inversion.
fn arrived(case: &Case, policies: &[StiffnessPolicy]) -> Vec<Outcome> {
    let outcomes: Vec<_> = policies.iter().map(|&p| case.outcome(p, &StepLimits::default())).collect();
    for outcome in &outcomes {
        println!("{}", page::row(case, outcome));
        let place = format!("{}, {}", case.name, outcome.policy.name());
        assert_eq!(outcome.travelled.reached, 1.0, "{place}");
        let qualities = qualities(&outcome.travelled.moved.mesh);
        assert!(qualities.iter().all(|q| *q > 0.0), "{place}");
        for share in outcome.shares() {
            assert!((0.0..=StepLimits::default().inversion_share).contains(&share), "{place}: {share}");
        }
        let (moved, goal) = (&outcome.travelled.moved, (case.path)(1.0));
        for (node, u) in outcome.travelled.motion.map().design_nodes().iter().zip(&goal) {
            let off = support::largest_difference(&[moved.displacement[node.index()]], &[*u]);
            assert!(off <= 1e-15, "{place}: {off}"); // rounding of sums of centimetres
        }
    }
    outcomes
}

const ALL: [StiffnessPolicy; 4] = StiffnessPolicy::ALL;
const GRADED: [StiffnessPolicy; 2] = [StiffnessPolicy::InverseVolume, StiffnessPolicy::Directional];

#[test]
fn the_top_line_of_a_block_moves_by_45_and_80_percent_of_its_edge() {
    for share in [0.45, -0.45, 0.8, -0.8] {
        let outcomes = arrived(&cases::block_line(share), &ALL);
        // What breaks the mesh in one step, and whether a protected stiffness then leaves more than the plain one.
        assert!(outcomes.iter().all(|o| (o.single.inverted > 0) == (share < 0.0)));
        assert!(share > 0.0 || outcomes[1..].iter().all(|o| o.worst > outcomes[0].worst));
        assert!(outcomes[1..].iter().all(|o| o.worst > 0.01));
    }
}

#[test]
fn a_ball_in_a_box_grows_to_two_and_a_half_times_its_radius() {
    let outcomes = arrived(&cases::growing_ball(), &ALL);
    assert!(outcomes.iter().all(|o| o.single.inverted > 500 && o.worst > 0.08));
}

#[test]
fn a_cylinder_is_shifted_by_80_percent_of_its_gap_and_turned_by_45_degrees() {
    for case in [cases::rotor_about_own_axis(), cases::rotor_about_cross_axis()] {
        let outcomes = arrived(&case, &ALL);
        assert!(outcomes.iter().all(|o| o.single.inverted > 0 && o.worst > 0.04));
    }
}

#[test]
fn control_points_of_the_shield_alternate_between_5_and_30_mm() {
    let parameters = cases::shield_parameters();
    for kinematic_constraint in [KinematicConstraint::Axis(2), KinematicConstraint::Free] {
        let outcomes =
            arrived(&cases::alternating_control_points(&parameters, kinematic_constraint), &GRADED);
        // Skin cells of 0.3 mm by 20 mm have a quality of 0.001 from the start: an eighth of it is left at the least.
        assert!(outcomes.iter().all(|o| o.single.inverted > 0 && o.worst > o.start / 8.0));
    }
}

#[test]
fn surface_nodes_of_the_shield_alternate_between_5_and_30_mm() {
    let parameters = cases::shield_parameters();
    let outcomes = arrived(
        &cases::alternating_nodes(&parameters, KinematicConstraint::Axis(2)),
        &[StiffnessPolicy::InverseVolume],
    );
    assert!(outcomes[0].single.inverted > 1000);
}

#[test]
#[ignore = "minutes: every policy and both kinematic constraints"]
fn every_policy_takes_the_shield_to_its_roughest_designs() {
    let parameters = cases::shield_parameters();
    for kinematic_constraint in [KinematicConstraint::Axis(2), KinematicConstraint::Free] {
        arrived(&cases::alternating_control_points(&parameters, kinematic_constraint), &ALL);
        arrived(&cases::alternating_nodes(&parameters, kinematic_constraint), &ALL);
    }
}

/// (e): layers to two skin depths keep 70 % of their thickness in every column clear of the layers of the free sides.
#[test]
fn skin_layers_keep_70_percent_of_their_thickness() {
    for parameters in [skin::filled(), skin::cored()] {
        for policy in GRADED {
            let kept = skin::kept(&parameters, policy, KinematicConstraint::Axis(2));
            println!("{}", page::skin_row("", &kept));
            for layer in &kept.layers[..3] {
                assert!(layer.clear >= 0.70, "{policy:?}: {layer:?}");
            }
        }
    }
    // The counterpart: one stiffness shares the loss out evenly, and half of every layer goes.
    let kept = skin::kept(&skin::cored(), StiffnessPolicy::Uniform, KinematicConstraint::Axis(2));
    assert!(kept.layers[..3].iter().all(|layer| layer.clear < 0.55));
}
