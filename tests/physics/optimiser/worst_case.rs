//! The worst of several terms as the objective: where it ends, and what its values are.

use fluxmorph::show::Silent;

use crate::problems::{analysed, initial, optimised};
use crate::support::folder::read_text;
use crate::support::shield::quick;
use crate::support::{changed, parsed, setup_of};

/// The objective of the quick shield.
const SQUARED: &str = "kind = \"flux_density_squared\"\nregion = \"observation\"\nweighting = \"point\"\n";

/// The field behind the plate, of order one at the start, against the loss in it, which grows where the field falls.
const AGAINST_EACH_OTHER: &str = r#"combine = "worst_case"
[[objective.terms]]
kind = "flux_density_squared"
region = "observation"
weight = 250
[[objective.terms]]
kind = "loss"
region = "plate"
weight = 1.824e-3
"#;

/// Both terms are alike where the worst is least, to what the issue asks for, 1 %; all methods find the same.
#[test]
fn both_terms_are_alike_where_the_worst_is_least() {
    let mut found = Vec::new();
    for algorithm in ["mma", "ccsaq", "slsqp"] {
        let method = format!("algorithm = \"{algorithm}\"");
        let changes = [(SQUARED, AGAINST_EACH_OTHER), ("algorithm = \"mma\"", &method)];
        let text = changed(&read_text(&quick()), &changes);
        let mut problem = setup_of(&text).problem;
        let start = analysed(&problem, &initial(&problem));
        let members: Vec<f64> = start.members.iter().map(|member| member.value).collect();
        assert!(members.len() == 2 && members[0] > 1.4 * members[1], "{members:?}");
        assert_eq!(start.objective, Some(members[0]));
        let mut settings = parsed(&text).0.optimizer;
        settings.max_evaluations = 40;
        let (best, rows) = optimised(&mut problem, &settings, &mut Silent);
        let members: Vec<f64> = best.best.analysis.members.iter().map(|member| member.value).collect();
        println!("{algorithm}: {members:?} after {} evaluations", rows.len());
        assert!((members[0] / members[1] - 1.0).abs() < 0.01, "{algorithm}: {members:?}");
        assert!(best.best.objective < 0.7 * best.initial, "{algorithm}: {}", best.best.objective);
        found.push(best.best.objective);
    }
    let [least, most] = found.iter().fold([f64::INFINITY, 0.0], |[l, m], v| [v.min(l), v.max(m)]);
    assert!(most < 1.02 * least, "{found:?}");
}

/// A mass among the terms is one member, whatever the number of frequencies, and has no adjoint.
#[test]
fn a_term_of_the_shape_is_one_member_of_a_worst_case() {
    let volume = [("kind = \"loss\"", "kind = \"volume\""), ("weight = 1.824e-3", "weight = 2000")];
    let terms = changed(AGAINST_EACH_OTHER, &volume);
    let changes =
        [(SQUARED, terms.as_str()), ("frequency = \"60 Hz\"", "frequencies = [\"60 Hz\", \"200 Hz\"]")];
    let problem = setup_of(&changed(&read_text(&quick()), &changes)).problem;
    let start = analysed(&problem, &initial(&problem));
    let members: Vec<f64> = start.members.iter().map(|member| member.value).collect();
    assert_eq!(members.len(), 3, "one a frequency, and the volume");
    // 120 x 240 x 10 mm.
    assert!((members[2] - 2000.0 * 2.88e-4).abs() < 1e-12, "{members:?}");
    assert_eq!(problem.objective().expect("an objective").terms[2].label.frequency, None);
}
