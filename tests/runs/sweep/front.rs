//! What the runs of a sweep trade for each other, and which of them no other one beats.

use super::home::Home;
use super::outcome::cells;
use crate::support::markup::elements;
use crate::support::repository;

/// A sweep of a shipped configuration in a few evaluations, which must be said to have `shown`; head and rows of its table.
fn table(home: &Home, config: &str, set: &str, shown: &[&str]) -> (Vec<String>, Vec<Vec<String>>) {
    let config = repository("configs").join(config).display().to_string();
    let quick =
        ["--set", "output.verify_refinement=0", "--set", "output.report=false", "--max-evaluations", "4"];
    let arguments = [&["sweep", config.as_str(), "--out", "out", "--set", set], &quick[..]].concat();
    home.fluxmorph(&arguments).with(1, shown);
    let text = home.text("out/sweep.csv");
    let mut lines = text.lines().map(cells);
    (lines.next().expect("a head"), lines.collect())
}

/// By the definition, where both values are the better the smaller they are.
fn is_beaten([a, b]: [f64; 2], others: &[[f64; 2]]) -> bool {
    others.iter().any(|&[c, d]| c <= a && d <= b && (c < a || d < b))
}

#[test]
fn two_terms_whose_weight_is_swept_have_a_front() {
    let home = Home::new();
    let (head, rows) =
        table(&home, "shield_two_frequencies.toml", "objective.terms[1].weight=0.1,1,10,100", &[]);
    let place =
        |name: &str| head.iter().position(|own| own == name).unwrap_or_else(|| panic!("{name}: {head:?}"));
    let columns = [60, 200].map(|f| place(&format!("flux density squared in observation at {f} Hz [T²]")));
    let points: Vec<[f64; 2]> =
        rows.iter().map(|row| columns.map(|k| row[k].parse().expect("a number"))).collect();
    for (k, row) in rows.iter().enumerate() {
        let result = home.json(&format!("out/{}/result.json", row[place("directory")]));
        let terms = [0, 1].map(|t| result["objective"]["terms"][t]["value"].as_f64().expect("a number"));
        assert_eq!(points[k], terms);
        assert_eq!(row[place("on_front")], (!is_beaten(points[k], &points)).to_string(), "{points:?}");
    }
    let page = home.text("out/sweep.html");
    let elements = elements(&page);
    assert!(elements.iter().any(|e| e.name == "figure" && e.get("data-chart") == Some("front")));
    let on_front = rows.iter().filter(|row| row[place("on_front")] == "true").count();
    assert!(page.contains(&format!("{on_front} of 4 runs are on the front")));
}

/// The smaller mass and the weaker field are the better ones: every bound that is kept gives a run of the front, and one that is not
/// is named.
#[test]
fn the_objective_over_a_swept_bound_has_a_front() {
    let home = Home::new();
    // At its lower bound everywhere the plate has 1.13 kg.
    let bounds = "constraints[0].upper=1 kg,2.4 kg,2.8 kg,3.2 kg";
    let (head, mut rows) = table(&home, "shield_mass_limit.toml", bounds, &[", violates mass_plate, F/F0 "]);
    let place =
        |name: &str| head.iter().position(|own| own == name).unwrap_or_else(|| panic!("{name}: {head:?}"));
    let violated: Vec<&str> = rows.iter().map(|row| row[place("violated")].as_str()).collect();
    assert_eq!(violated, ["mass_plate", "", "", ""]);
    assert!(home.text("out/sweep.html").contains("violates mass_plate"));
    assert_eq!(rows.remove(0)[place("on_front")], "false");
    let columns = [place("flux density squared in observation [T²]"), place("mass_plate [kg]")];
    let points: Vec<[f64; 2]> =
        rows.iter().map(|row| columns.map(|k| row[k].parse().expect("a number"))).collect();
    println!("{points:?}");
    for (row, point) in rows.iter().zip(&points) {
        assert_eq!(row[place("on_front")], (!is_beaten(*point, &points)).to_string(), "{points:?}");
    }
    assert!(points.windows(2).all(|pair| pair[1][0] < pair[0][0]), "more mass shields better: {points:?}");
    // One key of numbers has its own figure too.
    let page = home.text("out/sweep.html");
    assert!(page.contains("data-chart=\"front\"") && page.contains("data-chart=\"over-value\""));
}

#[test]
fn where_nothing_is_traded_there_is_no_front() {
    let home = Home::new();
    home.sweep("out", &["--set", "design.upper=2 mm,4 mm", "--max-evaluations", "1"]).with(1, &[]);
    let page = home.text("out/sweep.html");
    assert!(!page.contains("data-chart=\"front\"") && !home.text("out/sweep.csv").contains("on_front"));
}
