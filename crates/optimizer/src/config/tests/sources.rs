//! Coils of every kind, applied fields, magnets and anisotropic materials.

use super::faults::report;
use super::*;

/// A static configuration with tables of choice.
fn with(tables: &str) -> String {
    format!("[mesh]\ngenerator = \"shield\"\n[analysis]\nfrequency = 0\n{tables}")
}

fn coil(keys: &str) -> String {
    with(&format!("[[coils]]\nname = \"c\"\nampere_turns = 1\n{keys}"))
}

fn read(text: &str) -> Config {
    let (config, _) =
        Config::from_str(text, "sources.toml").unwrap_or_else(|error| panic!("{error}\n{text}"));
    let resolved = resolved_toml(&config);
    let (again, _) =
        Config::from_str(&resolved, "sources.toml").unwrap_or_else(|error| panic!("{error}\n{resolved}"));
    assert_eq!(config, again, "{resolved}");
    config
}

const SIZES: &str = "center = [0, 0, 0]\nwidth = \"20 mm\"\nheight = \"40 mm\"\n";

#[test]
fn every_kind_of_coil_is_read_and_written() {
    let turned = "axis = [0, 1, 1]\ndirection = [1, 0, 0]\nhalf_window = [\"60 mm\", \"160 mm\"]\n";
    let config = read(&coil(&format!("shape = \"racetrack\"\n{SIZES}{turned}inner_radius = 0.01")));
    let CoilShape::Racetrack(racetrack) = &config.coils[0].shape else { panic!("a racetrack") };
    assert_eq!(racetrack.axis, Axis::Vector([0.0, 1.0, 1.0]));
    assert_eq!(racetrack.direction, Some([1.0, 0.0, 0.0]));

    let config = read(&coil(&format!("shape = \"rectangular\"\n{SIZES}{turned}")));
    assert!(matches!(&config.coils[0].shape, CoilShape::Rectangular(r) if r.width == 0.02));

    let config = read(&coil(&format!("shape = \"circular\"\n{SIZES}axis = \"x\"\nradius = \"50 mm\"")));
    let CoilShape::Circular(circular) = &config.coils[0].shape else { panic!("a circle") };
    assert_eq!((circular.radius, circular.axis.vector()), (0.05, [1.0, 0.0, 0.0]));

    let config = read(&coil("region = \"winding\"\nterminals = [\"in\", \"out\"]"));
    let CoilShape::Region(region) = &config.coils[0].shape else { panic!("a region") };
    assert_eq!(region.region, "winding");
    assert_eq!(region.path, CoilPath::Terminals { terminals: ["in".to_owned(), "out".to_owned()] });

    let config = read(&coil("region = \"winding\"\ncenter = [\"94 mm\", 0, 0]\naxis = [0, 0, -1]"));
    let CoilShape::Region(region) = &config.coils[0].shape else { panic!("a region") };
    let axis = Axis::Vector([0.0, 0.0, -1.0]);
    assert_eq!(region.path, CoilPath::Closed { center: [0.094, 0.0, 0.0], axis });
}

#[test]
fn an_applied_field_and_a_magnet_are_read_and_written() {
    let tables = "[boundaries]\nuniform_field = { surfaces = [\"outer\"], b = [\"0 T\", \"0 T\", \"50 mT\"] }\n\
                  [materials.m]\nrelative_permeability = 1.05\n\
                  [regions.magnet]\nmaterial = \"m\"\nremanence = [\"0 T\", 0, \"1.2 T\"]\n\
                  [materials.superconductor]\nrelative_permeability = 0.01\n";
    let config = read(&with(tables));
    let field = config.boundaries.uniform_field.expect("a field");
    assert_eq!((field.b, field.center), ([0.0, 0.0, 0.05], None));
    assert_eq!(config.regions["magnet"].remanence, Some([0.0, 0.0, 1.2]));
    assert_eq!(config.materials["superconductor"].relative_permeability, 0.01, "below 1 is allowed");
}

#[test]
fn contradictions_are_faults_at_their_keys() {
    let racetrack = format!("shape = \"racetrack\"\n{SIZES}half_window = [1, 1]\n");
    let region = "region = \"w\"\n";
    let cases: &[(String, &str, &str)] = &[
        (coil(&format!("{region}terminals = [\"a\"]")), "coils[0].terminals", "has 1 items"),
        (coil(&format!("{region}terminals = [\"a\", \"a\"]")), "coils[0].terminals", "`a` twice"),
        (coil(region), "coils[0].terminals", "missing key `terminals`"),
        (
            coil(&format!("{region}terminals = [\"a\", \"b\"]\ncenter = [0, 0, 0]")),
            "coils[0].center",
            "has terminals",
        ),
        (coil(&format!("{region}center = [0, 0, 0]\nwidth = 1")), "coils[0].width", "unknown key"),
        (coil(&format!("{racetrack}terminals = [\"a\", \"b\"]")), "coils[0].terminals", "closes on itself"),
        (coil(&format!("{racetrack}axis = [0, 0, 0]")), "coils[0].axis", "has no length"),
        (coil(&format!("{racetrack}direction = [0, 0, 2]")), "coils[0].direction", "across the axis"),
        (coil(&format!("shape = \"circular\"\n{SIZES}")), "coils[0].radius", "missing key"),
        (
            coil(&format!("shape = \"rectangular\"\n{SIZES}half_window = [1, 1]\ninner_radius = 1")),
            "coils[0].inner_radius",
            "unknown key",
        ),
        (with("[boundaries]\nuniform_field = {}"), "boundaries.uniform_field", "missing key `surfaces`"),
        (
            with("[boundaries]\nuniform_field = { surfaces = [\"a\"], b = [0, 0, 0] }"),
            "boundaries.uniform_field.b",
            "is zero",
        ),
        (
            with(
                "[boundaries]\nflux_normal = [\"a\"]\nuniform_field = { surfaces = [\"a\"], b = [0, 0, 1] }",
            ),
            "boundaries.uniform_field",
            "flux-normal and has a uniform field at once",
        ),
        (
            with("[materials.m]\n[regions.r]\nmaterial = \"m\"\nremanence = [0, 0, 0]"),
            "regions.r.remanence",
            "is no magnet",
        ),
        (
            with("[materials.m]\n[regions.r]\nmaterial = \"m\"\nremanence = [0, \"1 m\", 0]"),
            "regions.r.remanence[1]",
            "is a length",
        ),
        (
            with("[materials.m]\n[regions.r]\nmaterial = \"m\"\nremanence = [0, 0, 1]")
                .replace("= 0\n", "= 50\n"),
            "regions.r.remanence",
            "the frequency is 50 Hz",
        ),
        (
            with("[materials.m]\nrelative_permeability = [1, 1, 800]"),
            "materials.m.relative_permeability",
            "anisotropic materials are not supported",
        ),
        (
            with("[materials.m]\nconductivity = { x = 1, y = 2, z = 3 }"),
            "materials.m.conductivity",
            "anisotropic materials are not supported",
        ),
    ];
    for (text, path, message) in cases {
        let report = report(text);
        let found =
            report.diagnostics.iter().any(|f| f.message.contains(message) && f.path.starts_with(path));
        assert!(found, "{path}: {message}\n{report}");
        let all_help = report.diagnostics.iter().all(|f| f.expected.is_some() || f.help.is_some());
        assert!(all_help, "says what to do\n{report}");
    }
}
