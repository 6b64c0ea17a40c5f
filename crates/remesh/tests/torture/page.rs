//! The tables of docs/torture.md.

use std::fmt::Write;
use std::path::Path;

use fluxmorph_geometry::generate::ShieldParameters;
use fluxmorph_remesh::{KinematicConstraint, StiffnessPolicy};

use super::case::{Case, Outcome};
use super::skin::{self, Kept};
use super::{ALL, arrived, cases};

const MARKS: [[&str; 2]; 2] = [
    ["<!-- torture:begin -->\n", "<!-- torture:end -->\n"],
    ["<!-- skin:begin -->\n", "<!-- skin:end -->\n"],
];

/// One line of the table of motions.
pub(crate) fn row(case: &Case, o: &Outcome) -> String {
    let (single, t) = (&o.single, &o.travelled);
    format!(
        "| {} | {} | {:.4} | {:.4} | {} | {:.3} | {} | {} | {} | {:.3} |",
        case.name,
        o.policy.name(),
        o.start,
        single.worst,
        single.inverted,
        single.step,
        short(o.worst),
        t.steps,
        t.fallbacks,
        t.reached
    )
}

/// Two digits of a quality, however small.
fn short(q: f64) -> String {
    if q.abs() < 1e-3 { format!("{q:.1e}") } else { format!("{q:.4}") }
}

/// One line of the table of layers.
pub(crate) fn skin_row(plate: &str, kept: &Kept) -> String {
    let motion = match kept.kinematic_constraint {
        KinematicConstraint::Free => "free",
        KinematicConstraint::Axis(_) => "along z",
    };
    let mut line = format!("| {plate} | {motion} | {} |", kept.policy.name());
    for layer in &kept.layers {
        let _ = write!(
            line,
            " {:.1} mm: {:.2} / {:.2} / {:.2} |",
            layer.thickness * 1e3,
            layer.clear,
            layer.least,
            layer.mean
        );
    }
    // A cored plate has one layer less than the filled one.
    for _ in kept.layers.len()..5 {
        line.push_str(" |");
    }
    line
}

fn motions() -> String {
    let shield = cases::shield_parameters();
    let mut all: Vec<Case> = [0.45, -0.45, 0.8, -0.8].map(cases::block_line).into();
    all.extend([cases::growing_ball(), cases::rotor_about_own_axis(), cases::rotor_about_cross_axis()]);
    for kinematic_constraint in [KinematicConstraint::Axis(2), KinematicConstraint::Free] {
        all.push(cases::alternating_control_points(&shield, kinematic_constraint));
        all.push(cases::alternating_nodes(&shield, kinematic_constraint));
    }
    let mut table = "| motion | stiffness | q before | one step: worst q | inverted | step to inversion | rounds: worst q | rounds | fallbacks | reached |\n|---|---|---|---|---|---|---|---|---|---|\n".to_owned();
    for case in all {
        for outcome in arrived(&case, &ALL) {
            table += &(row(&case, &outcome) + "\n");
        }
    }
    table
}

fn layers() -> String {
    let plates: [(&str, ShieldParameters); 2] = [("filled", skin::filled()), ("cored", skin::cored())];
    let mut table = "| plate | motion | stiffness | 1st layer | 2nd | 3rd | 4th | 5th |\n|---|---|---|---|---|---|---|---|\n".to_owned();
    for (name, parameters) in plates {
        for kinematic_constraint in [KinematicConstraint::Axis(2), KinematicConstraint::Free] {
            for policy in StiffnessPolicy::ALL {
                table += &(skin_row(name, &skin::kept(&parameters, policy, kinematic_constraint)) + "\n");
            }
        }
    }
    table
}

/// Measures everything and writes the tables between the marks of the page: `just torture`.
#[test]
#[ignore = "writes docs/torture.md: just torture"]
fn write_the_table() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/torture.md");
    let mut page = std::fs::read_to_string(&path).expect("the page is in the repository");
    for ([begin, end], table) in MARKS.into_iter().zip([motions(), layers()]) {
        let (head, rest) = page.split_once(begin).expect("the page has the first mark");
        let (_, tail) = rest.split_once(end).expect("the page has the second mark");
        page = format!("{head}{begin}{table}{end}{tail}");
    }
    std::fs::write(&path, page).expect("the page can be written");
}
