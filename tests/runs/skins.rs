//! What is said of skins that the mesh does not carry.

use serde_json::Value;

use super::plausible::{set, texts};
use crate::support::folder::{RunFolder, number, read_text};
use crate::support::program::{command, finish, folder};
use crate::support::shield::quick;

/// The quick shield with a plate of iron that is meshed by edge elements, of a permeability of 8000 where it is not saturated.
const IRON: [&str; 4] = [
    "analysis.elements=edge",
    "regions.plate.model=volume",
    "remesh.region=[\"plate\", \"remesh\"]",
    "materials.steel={ relative_permeability = 8000, conductivity = \"7e6 S/m\" }",
];

/// The same with a curve.
const SATURATING: &str =
    "materials.steel={ relative_permeability = 8000, conductivity = \"7e6 S/m\", saturation = \"1.6 T\" }";

fn check(overrides: &[&str]) -> Value {
    finish(command(&[&"check", &quick(), &"--json"]).args(set(overrides))).exits_with(0).json()
}

#[test]
fn the_skin_of_iron_with_a_curve_is_that_of_its_own_permeability() {
    let depth = |summary: &Value| number(summary, "/skin/0/skin_depth_m");
    let (linear, curve) = (check(&IRON), check(&[&IRON[..], &[SATURATING]].concat()));
    assert_eq!(depth(&linear), depth(&curve));
    assert_eq!(number(&curve, "/skin/0/largest_permeability"), 8000.0);
    assert!(linear["skin"][0]["largest_permeability"].is_null());
    let found = texts(&curve["warnings"]);
    assert!(found.contains("the largest permeability of the B–H curve, 8000"), "{found}");
    // An impedance surface takes no curve.
    assert!(!found.contains("model = \"impedance\""), "{found}");
    assert!(texts(&linear["warnings"]).contains("model = \"impedance\""));
}

#[test]
fn an_analysis_says_what_its_field_leaves_of_the_permeability() {
    let home = folder();
    let left = |current: &str| {
        let out = home.path().join("out");
        let current = format!("coils[0].ampere_turns=\"{current}\"");
        let overrides = [&IRON[..], &[SATURATING, &current, "accuracy.estimate=false"]].concat();
        let arguments = ["--out", out.to_str().expect("UTF-8"), "--force"];
        finish(command(&[&"solve", &quick()]).args(arguments).args(set(&overrides))).exits_with(0);
        let found = texts(&RunFolder(out).result()["warnings"]);
        // What is only supposed before the field is known is not said beside it.
        assert!(!found.contains("the largest permeability of the B–H curve"), "{found}");
        let (_, after) = found.split_once("leaves at its surface, ").expect("the skin is coarse");
        let word = after.split([' ', ',']).next().expect("a number");
        word.parse::<f64>().expect("a permeability")
    };
    assert_eq!(left("1 A"), 8000.0);
    let driven = left("200 kA");
    assert!(driven > 1.0 && driven < 100.0, "{driven}");
}

#[test]
fn of_many_frequencies_the_worst_skin_is_warned_of() {
    let home = folder();
    let config = home.path().join("three.toml");
    let one = "frequency = \"60 Hz\"";
    let text = read_text(&quick()).replace(one, "frequencies = [\"60 Hz\", \"6 kHz\", \"600 Hz\"]");
    std::fs::write(&config, text).expect("written");
    let summary = finish(command(&[&"check", &config, &"--json"]).args(set(&IRON[..3]))).exits_with(0).json();
    let found = texts(&summary["warnings"]);
    assert_eq!(found.matches("too thick for the skin depth").count(), 1, "{found}");
    assert!(found.contains("at 6000 Hz, the worst of 3 frequencies: region `plate`"), "{found}");
}
