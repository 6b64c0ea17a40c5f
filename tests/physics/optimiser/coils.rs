//! From the tables of sources to the field model.

use fluxmorph::build::{Mode, Setup, set_up};
use fluxmorph::config::Config;
use fluxmorph_solver::coil::CoilShape;

const BLOCK: &str = r#"
[mesh]
generator = "block"
[mesh.block]
size = ["20 mm", "50 mm", "30 mm"]
cells = [2, 4, 3]
[analysis]
frequency = "50 Hz"
[boundaries]
flux_parallel = ["y_min", "y_max", "x_min"]
[[coils]]
name = "bar"
region = "block"
ampere_turns = "1 kA"
terminals = ["y_min", "y_max"]
"#;

fn prepared(text: &str) -> Result<Setup, String> {
    let (config, source) = Config::from_str(text, "coils.toml").unwrap_or_else(|error| panic!("{error}"));
    set_up(&config, &source, Mode::Analysis).map_err(|error| error.to_string())
}

#[test]
fn a_coil_region_becomes_a_source_and_the_divergence_of_its_current_is_told_where_there_is_any() {
    let setup = prepared(BLOCK).unwrap_or_else(|error| panic!("{error}"));
    let coils = setup.problem.states()[0].coils();
    let CoilShape::Region(current) = &coils[0].shape else { panic!("a region") };
    for (_, j) in current.current_density() {
        assert!((j[1] * 0.02 * 0.03 - 1.0).abs() < 1e-11, "one ampere-turn through 20 mm x 30 mm");
    }
    let told = |setup: &Setup| setup.warnings.iter().any(|warning| warning.contains("residual divergence"));
    assert!(!told(&setup), "a straight bar: {:?}", setup.warnings);
    let round = crate::support::setup("inductor.toml", &["analysis.order=1"]);
    assert!(told(&round), "a ring of flat facets: {:?}", round.warnings);
}

#[test]
fn an_analytic_coil_may_be_slanted() {
    let slanted = BLOCK.replace(
        "region = \"block\"\nampere_turns = \"1 kA\"\nterminals = [\"y_min\", \"y_max\"]",
        "shape = \"circular\"\nampere_turns = \"1 kA\"\ncenter = [\"10 mm\", \"25 mm\", \"15 mm\"]\n\
         axis = [1, 2, 0.5]\nradius = \"3 mm\"\nwidth = \"1 mm\"\nheight = \"2 mm\"",
    );
    let setup = prepared(&slanted).unwrap_or_else(|error| panic!("{error}"));
    let CoilShape::Racetrack(coil) = &setup.problem.states()[0].coils()[0].shape else { panic!("analytic") };
    assert!((coil.axis()[1] - 2.0 / 5.25f64.sqrt()).abs() < 1e-15);
}

#[test]
fn remanences_are_given_by_region() {
    let (without_coil, _) = BLOCK.split_once("[[coils]]").expect("it has a coil");
    let magnet = without_coil.replace("50 Hz", "0 Hz")
        + "[materials.m]\n[regions.block]\nmaterial = \"m\"\nremanence = [0, \"1.2 T\", 0]\n";
    let setup = prepared(&magnet).unwrap_or_else(|error| panic!("{error}"));
    let model = &setup.problem.states()[0];
    assert_eq!(model.remanence_of(fluxmorph_geometry::ElementId(0)), [0.0, 1.2, 0.0]);
    assert!(!model.is_unexcited());
}
