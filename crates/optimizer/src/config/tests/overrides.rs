//! `--set key=value`.

use super::*;

fn with(overrides: &[&str]) -> Result<(Config, SourceMap), ConfigError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("small.toml");
    std::fs::write(&path, SMALL).expect("a file");
    let overrides: Vec<_> = overrides.iter().map(|&text| text.to_owned()).collect();
    Config::from_file(&path, &overrides)
}

#[test]
fn overrides_replace_add_and_reach_into_lists() {
    let overrides = [
        "analysis.frequency=50 Hz",
        "optimizer.algorithm=ccsaq",
        "optimizer.max_evaluations = 3",
        "analysis.linear_solver.tolerance=1e-12",
        "coils[0].width=\"30 mm\"",
        "coils.0.center[2]=70 mm",
        "mesh.shield.skin=[]",
        "design.grid=[2, 3]",
        "title=a = b",
    ];
    let (config, source) = with(&overrides).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(config.analysis.frequency(), 50.0);
    assert_eq!(config.analysis.linear_solver.tolerance, 1e-12);
    assert_eq!(config.optimizer.algorithm, Algorithm::Ccsaq);
    assert_eq!(config.optimizer.max_evaluations, 3);
    let CoilShape::Racetrack(coil) = &config.coils[0].shape else { panic!("a racetrack") };
    assert_eq!(coil.width, 0.03);
    assert_eq!(coil.center, [0.0, 0.0, 0.07]);
    assert_eq!(config.design.expect("design").grid, Some([2, 3]));
    assert_eq!(config.title, "a = b");
    assert_eq!(source.text(), SMALL);
    assert_eq!(source.overrides().count(), overrides.len());
}

#[test]
fn the_last_override_of_a_key_holds() {
    let (config, _) = with(&["analysis.frequency=50", "analysis.frequency=70"]).expect("good");
    assert_eq!(config.analysis.frequency(), 70.0);
}

#[test]
fn faulty_overrides_are_named() {
    let cases = [
        ("analysis.freqency=50 Hz", "did you mean `frequency`?"),
        ("analysis.frequency=50 mm", "is a length, not a frequency"),
        ("analysis.frequency=", "must start with a number"),
        ("coils[3].width=1", "is not the number of an item of `coils`"),
        ("title.x=1", "`title` is a table, not a text"),
        ("analysis.frequency.x=1", "has no keys"),
        ("=1", "not valid TOML"),
        ("a b=1", "not valid TOML"),
        ("mesh=1", "not a table"),
        ("analysis.frequency=50\nanalysis.penalty=3", "not a unit of frequency"),
    ];
    for (text, fragment) in cases {
        let message = with(&[text]).map(|(config, _)| config).expect_err(text).to_string();
        assert!(message.contains(fragment), "{text}: {message}");
        assert!(message.contains("--> --set '"), "{text}: {message}");
    }
}
