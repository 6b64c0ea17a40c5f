//! The design surface of a configuration on its mesh: what is refused, and how many variables there are.

use std::path::Path;

use fluxmorph::build::{Mode, set_up, variable_count};
use fluxmorph::config::{Config, SourceMap};

/// The quick shield with another `[design]` in place of its surface, direction and grid.
fn designed(design: &str) -> (Config, SourceMap) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/shield_quick.toml");
    let mut text = std::fs::read_to_string(path).unwrap();
    let start = text.find("surface = \"plate_bottom\"").unwrap();
    let end = text.find("lower = \"-5 mm\"").unwrap();
    text.replace_range(start..end, &format!("{design}\n"));
    Config::from_str(&text, "shield.toml").unwrap_or_else(|e| panic!("{e}"))
}

fn refusal(design: &str) -> String {
    let (config, source) = designed(design);
    set_up(&config, &source, Mode::Optimisation)
        .err()
        .unwrap_or_else(|| panic!("accepted: {design}"))
        .to_string()
}

#[test]
fn what_a_surface_cannot_carry_is_refused_at_its_key() {
    let bottom = "surface = \"plate_bottom\"\ndirection = [0, 0, -1]";
    for (design, says) in [
        (
            format!("{bottom}\nsymmetry = [{{ axis = \"y\", at = \"121 mm\" }}]"),
            &["53 | symmetry = [", "no partner in the mirror y = 121.000 mm", "(0.000, 0.000, -10.000) mm"][..],
        ),
        (
            format!("{bottom}\ngrid = [3, 4]\nsymmetry = [{{ axis = \"x\", at = \"61 mm\" }}]"),
            &["the control point at", "no partner in the mirror x = 61.000 mm"],
        ),
        (
            "surface = [\"plate_bottom\", \"plate_botom\"]\ndirection = [0, 0, -1]".to_owned(),
            &["there is no surface `plate_botom`", "did you mean `plate_bottom`?"],
        ),
        (
            "surface = [\"plate_bottom\", \"plate_top\"]\ndirection = \"normal\"\ngrid = [3, 4]".to_owned(),
            &["a control grid cannot be laid over `plate_bottom`, `plate_top`", "it turns back along z"],
        ),
    ] {
        let message = refusal(&design);
        for part in says {
            assert!(message.contains(part), "`{part}` is not in:\n{message}");
        }
    }
}

#[test]
fn motion_along_the_design_needs_one_axis() {
    let (mut config, source) = designed("surface = \"plate_bottom\"\ndirection = \"normal\"");
    config.remesh.as_mut().unwrap().motion = fluxmorph::config::Motion::AlongDesign;
    let message = set_up(&config, &source, Mode::Optimisation).unwrap_err().to_string();
    assert!(message.contains("does not move along a coordinate axis"), "{message}");
}

#[test]
fn a_surface_between_two_airs_has_no_body() {
    let (mut config, source) = designed("surface = \"plate_bottom\"\ndirection = \"normal\"");
    config.regions.clear();
    let message = set_up(&config, &source, Mode::Optimisation).unwrap_err().to_string();
    assert!(message.contains("which side of `plate_bottom` is the body"), "{message}");
}

#[test]
fn the_number_of_variables_is_known_before_the_problem_is_made() {
    let bottom = "surface = \"plate_bottom\"\ndirection = [0, 0, -1]";
    let tie = "symmetry = [{ axis = \"y\", at = \"120 mm\" }]";
    for (design, expected) in [
        (format!("{bottom}\ngrid = [7, 13]"), Some(91)),
        (format!("{bottom}\ngrid = [7, 13]\n{tie}"), Some(49)),
        (bottom.to_owned(), None),
        (format!("{bottom}\nrim = \"fixed\"\nfilter_radius = \"50 mm\"\n{tie}"), None),
    ] {
        let (config, source) = designed(&design);
        let count = variable_count(&config, &source).unwrap();
        let problem = set_up(&config, &source, Mode::Optimisation).unwrap().problem;
        assert_eq!(count, problem.shape().unwrap().surface().variable_count(), "{design}");
        assert!(expected.is_none_or(|expected| expected == count), "{design}: {count}");
    }
}
