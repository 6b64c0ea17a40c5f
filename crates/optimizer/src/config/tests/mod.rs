//! Reading whole configurations.

mod faults;
mod morph;
mod overrides;
mod sources;

use std::path::Path;

use super::*;

/// Line of a byte of a text, counted from 1.
fn line_of(text: &str, byte: usize) -> usize {
    text[..byte].matches('\n').count() + 1
}

/// A small complete configuration; every fault case changes it in one place.
pub(super) const SMALL: &str = r#"[mesh]
generator = "shield"
[mesh.shield]
skin = ["0.4 mm", "1.2 mm"]
[analysis]
frequency = "60 Hz"
[materials.steel]
relative_permeability = 800
conductivity = "7e6 S/m"
[regions.plate]
material = "steel"
[[coils]]
name = "coil"
shape = "racetrack"
ampere_turns = "40 kA"
center = ["0 mm", "0 mm", "60 mm"]
half_window = ["60 mm", "160 mm"]
width = "20 mm"
height = "40 mm"
phase = "30 deg"
[boundaries]
flux_parallel = ["x_min", "y_min"]
[objective]
region = "observation"
[design]
surface = "plate_bottom"
direction = [1.0, 2.0, -2.5]
grid = [7, 13]
lower = "-5 mm"
upper = "20 mm"
[remesh]
region = "remesh"
slide = ["x_min"]
[optimizer]
max_time = "10 min"
[[probes]]
name = "behind"
points = [["0 mm", "0 mm", "-50 mm"]]
"#;

/// An objective with terms of all kinds.
const SUM: &str = r#"goal = "maximise"
[[objective.terms]]
kind = "flux_density_squared"
region = "observation"
weighting = "volume"
[[objective.terms]]
kind = "uniformity"
region = "observation"
target = ["0 T", "0 T", "5 mT"]
weight = -2.5
[[objective.terms]]
kind = "field_component"
region = "observation"
direction = [1, 2, 2]
[[objective.terms]]
kind = "loss"
region = "plate"
frequency = "60 Hz"
[[objective.terms]]
kind = "energy""#;

/// Constraints of all kinds.
const CONSTRAINTS: &str = r#"[[constraints]]
kind = "flux_density_squared"
region = "observation"
upper = "3 mT2"
[[constraints]]
kind = "loss"
region = "plate"
upper = "20 W"
[[constraints]]
name = "lighter"
kind = "mass"
region = "plate"
upper_ratio = 0.9
[[constraints]]
kind = "thickness"
minimum = "6 mm"
maximum = "25 mm"
[optimizer]"#;

/// The shipped shields.
const SHIPPED: [&str; 5] = [
    "shield.toml",
    "shield_impedance.toml",
    "shield_mass_limit.toml",
    "shield_quick.toml",
    "shield_two_frequencies.toml",
];

fn shipped(name: &str) -> (Config, SourceMap) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs").join(name);
    Config::from_file(&path, &[]).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn the_shipped_configurations_are_read() {
    for name in SHIPPED {
        let (config, source) = shipped(name);
        let parts = config.optimisation(&source).expect("all tables for an optimisation");
        assert_eq!(parts.design.grid, Some([7, 13]), "{name}");
        assert_eq!((parts.design.lower, parts.design.upper), (-0.005, 0.020), "{name}");
        assert_eq!(config.coils[0].ampere_turns, 40e3, "{name}");
        assert!(config.output.directory.is_absolute(), "{name}");
    }
    assert_eq!(shipped("shield.toml").0.regions["plate"].model, RegionModel::Volume);
    let (impedance, _) = shipped("shield_impedance.toml");
    assert_eq!(impedance.regions["plate"].model, RegionModel::Impedance);
    let MeshConfig::Shield(shield) = impedance.mesh else { panic!("the shield's generator") };
    assert_eq!((shield.skin.as_slice(), shield.side_skin.as_slice()), (&[][..], &[0.008][..]));
}

#[test]
fn the_shipped_meshes_are_generated() {
    for name in SHIPPED {
        let MeshConfig::Shield(mesh) = shipped(name).0.mesh else { panic!("{name}: the shield's generator") };
        let mesh = fluxmorph_geometry::generate::shield(&mesh.parameters());
        mesh.unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

#[test]
fn a_mesh_left_to_its_defaults_is_that_of_the_generator() {
    let text = "[mesh]\ngenerator = \"shield\"\n[analysis]\nfrequency = 60\n";
    let (config, _) = Config::from_str(text, "small.toml").expect("enough to solve");
    let MeshConfig::Shield(shield) = config.mesh else { panic!("the shield's generator") };
    assert_eq!(shield.parameters(), fluxmorph_geometry::generate::ShieldParameters::default());

    let (config, _) = Config::from_str(&text.replace("shield", "block"), "small.toml").expect("good");
    let MeshConfig::Block(block) = config.mesh else { panic!("the block's generator") };
    assert_eq!(block.parameters(), fluxmorph_geometry::generate::BlockParameters::default());

    let (config, _) = Config::from_str(&text.replace("shield", "sphere"), "small.toml").expect("good");
    let MeshConfig::Sphere(sphere) = config.mesh else { panic!("the sphere's generator") };
    assert_eq!(sphere.parameters(), fluxmorph_geometry::generate::SphereParameters::default());
}

#[test]
fn the_default_skin_fits_every_thickness_of_the_plate() {
    for (thickness, deepest) in [(5, 0.0025), (6, 0.0025), (10, 0.005), (20, 0.005), (30, 0.005)] {
        let plate = format!("plate = [\"120 mm\", \"240 mm\", \"{thickness} mm\"]");
        let text =
            format!("[mesh]\ngenerator = \"shield\"\n[mesh.shield]\n{plate}\n[analysis]\nfrequency = 60\n");
        let (config, _) = Config::from_str(&text, "plate.toml").unwrap_or_else(|error| panic!("{error}"));
        let MeshConfig::Shield(shield) = config.mesh else { panic!("the shield's generator") };
        assert_eq!(shield.skin.last(), Some(&deepest), "{thickness} mm");
        let mesh = fluxmorph_geometry::generate::shield(&shield.parameters());
        mesh.unwrap_or_else(|error| panic!("{thickness} mm: {error}"));
    }
}

#[test]
fn values_are_in_si_and_defaults_filled_in() {
    let (config, _) = Config::from_str(SMALL, "small.toml").expect("a good configuration");
    assert_eq!(config.title, "small");
    assert_eq!(
        config.analysis,
        Analysis {
            frequencies: Frequencies::One(60.0),
            penalty: 1.0,
            order: ElementOrder::Linear,
            linear_solver: LinearSolver::default(),
            petsc: crate::config::Petsc::default(),
        }
    );
    let CoilShape::Racetrack(coil) = &config.coils[0].shape else { panic!("a racetrack") };
    assert_eq!(coil.half_window, [0.06, 0.16]);
    assert_eq!(coil.corner, Corner::Sharp(CornerWord::Mitred));
    assert!((config.coils[0].phase - std::f64::consts::FRAC_PI_6).abs() < 1e-15);
    assert_eq!(config.optimizer.max_time, Some(600.0));
    assert_eq!(config.optimizer.algorithm, Algorithm::Mma);
    assert_eq!(config.output.directory, Path::new("runs/small"));
    let remesh = config.remesh.expect("remesh");
    assert_eq!((remesh.poisson, remesh.stiffness), (0.3, StiffnessLaw::InverseSize));
    let DesignDirection::Vector(direction) = config.design.expect("design").direction else {
        panic!("a vector")
    };
    let length: f64 = direction.iter().map(|x| x * x).sum();
    assert!((length - 1.0).abs() < 1e-15);
}

#[test]
fn objectives_and_constraints_are_in_si_with_their_names() {
    let text = SMALL.replace("region = \"observation\"", SUM).replace("[optimizer]", CONSTRAINTS);
    let (config, _) = Config::from_str(&text, "small.toml").unwrap_or_else(|error| panic!("{error}"));
    let objective = config.objective.expect("an objective");
    assert_eq!((objective.goal, objective.terms().len()), (Goal::Maximise, 5));
    assert_eq!(objective.terms()[1].functional.target, Some([0.0, 0.0, 0.005]));
    assert_eq!(objective.terms()[1].weight, -2.5);
    assert_eq!(objective.terms()[3].functional.frequency, Some(60.0));
    let names: Vec<_> = config.constraints.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["flux_density_squared_observation", "loss_plate", "lighter", "thickness"]);
    let Limit::Field { bound, .. } = &config.constraints[0].limit else { panic!("a bound on the field") };
    assert_eq!(*bound, UpperBound::Value(3e-6));
    let Limit::Body { bound, .. } = &config.constraints[2].limit else { panic!("a bound on a body") };
    assert_eq!(*bound, UpperBound::Ratio(0.9));
}

#[test]
fn a_resolved_configuration_reads_back_as_itself() {
    let variants = [
        SMALL.to_owned(),
        SMALL.replace("height = ", "inner_radius = \"22 mm\"\nheight = "),
        SMALL.replace("region = \"remesh\"", "box = [[0, 0, 0], [1, 1, \"50 mm\"]]"),
        SMALL.replace(
            "generator = \"shield\"\n[mesh.shield]\nskin = [\"0.4 mm\", \"1.2 mm\"]",
            "file = \"a.msh\"\nunit = \"mm\"",
        ),
        SMALL.replace(
            "generator = \"shield\"\n[mesh.shield]\nskin = [\"0.4 mm\", \"1.2 mm\"]",
            "generator = \"block\"",
        ),
        SMALL.replace(
            "[optimizer]",
            "[[remesh.subregions]]\nname = \"plate\"\nforce = [0, 0, 1.5]\n[optimizer]",
        ),
        "[mesh]\ngenerator = \"block\"\n[analysis]\nfrequency = 0".to_owned(),
        SMALL.replace("frequency = \"60 Hz\"", "frequencies = [\"50 Hz\", \"1 kHz\"]"),
        SMALL.replace("region = \"observation\"", SUM).replace("[optimizer]", CONSTRAINTS),
    ];
    for text in &variants {
        let (config, _) = Config::from_str(text, "small.toml").unwrap_or_else(|error| panic!("{error}"));
        let resolved = resolved_toml(&config);
        let (again, _) =
            Config::from_str(&resolved, "resolved.toml").unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(again, config, "{resolved}");
        assert_eq!(resolved_toml(&again), resolved);
    }
    for name in SHIPPED {
        let (config, _) = shipped(name);
        let (again, _) = Config::from_str(&resolved_toml(&config), "resolved.toml").expect("resolved");
        assert_eq!(again, config);
    }
}

#[test]
fn a_later_fault_points_at_its_key() {
    let (_, source) = Config::from_str(SMALL, "small.toml").expect("a good configuration");
    let faults = vec![
        source.unknown_name("design.surface", "surface", "plate_bottom", &["plate_botom", "plate_top"]),
        source
            .diagnostic("boundaries.flux_parallel[1]", "`y_min` is not planar")
            .expected("a planar surface"),
        source.diagnostic("output.directory", "a default has no place of its own"),
    ];
    assert!(source.check(vec![]).is_ok());
    let text = source.check(faults).expect_err("three faults").to_string();
    for fragment in [
        "there is no surface `plate_bottom`",
        "small.toml:26:11",
        "did you mean `plate_botom`?",
        "known: plate_botom, plate_top",
        "small.toml:22:27",
        "^^^^^^^ a planar surface",
        "3 faults in the configuration `small.toml`",
    ] {
        assert!(text.contains(fragment), "{fragment}\n{text}");
    }
}

#[test]
fn files_that_are_no_configuration_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let error = Config::from_file(&folder.path().join("none.toml"), &[]).expect_err("no file");
    assert!(matches!(error, ConfigError::Read { .. }), "{error}");

    let large = folder.path().join("large.toml");
    std::fs::write(&large, vec![b'#'; 1024 * 1024 + 1]).expect("a file");
    let error = Config::from_file(&large, &[]).expect_err("too large");
    assert!(matches!(error, ConfigError::TooLarge { .. }), "{error}");

    let binary = folder.path().join("binary.toml");
    std::fs::write(&binary, b"# \xff\n").expect("a file");
    let error = Config::from_file(&binary, &[]).expect_err("no text");
    assert!(matches!(error, ConfigError::NotText { offset: 2, .. }), "{error}");
}

#[test]
fn paths_are_relative_to_the_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("case.toml");
    let text = SMALL.replace(
        "generator = \"shield\"\n[mesh.shield]\nskin = [\"0.4 mm\", \"1.2 mm\"]",
        "file = \"meshes/a.msh\"\nunit = \"mm\"",
    );
    std::fs::write(&path, &text).expect("a file");
    let (config, source) = Config::from_file(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(source.text(), text);
    assert_eq!(config.output.directory, source.directory().join("runs/case"));
    let expected =
        MeshConfig::File { path: source.directory().join("meshes/a.msh"), unit: LengthUnit::Millimetre };
    assert_eq!(config.mesh, expected);
}
