//! How many variables the design surface of a configuration has on its mesh.

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
