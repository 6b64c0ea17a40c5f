//! `[morph]`: reading, cases, and faults at the line of the case.

use super::faults::report;
use super::*;

const MORPH: &str = r#"[mesh]
generator = "block"
[remesh]
region = "block"
free = ["z_max"]
[morph]
increments = 1
least_quality = 0.01
[[morph.motion]]
line = [["0 mm", "40 mm", "80 mm"], ["80 mm", "40 mm", "80 mm"]]
displacement = ["0 mm", "0 mm", "36 mm"]
[[morph.motion]]
surface = "z_min"
rotation = { axis = [0, 0, 2], angle = "45 deg", center = [0.04, 0.04, 0] }
scale = { factor = 0.5 }
[morph.tune]
parameters = ["poisson", "force"]
evaluations = 9
[[morph.case]]
name = "soft"
remesh.poisson = 0.1
mesh.block.cells = [6, 6, 5]
paper = { worst_quality = 0.1, poor = 115, equations = 360 }
[[morph.case]]
name = "turned"
increments = "auto"
motion = [{ nodes = [[0, 0, 0.08]], displacement = [0, 0, 0.01] }]
"#;

/// The same motion by a design.
const DESIGNED: &str = "[[morph.motion]]\ndesign = \"alternating\"\n[optimizer]";

fn config(text: &str) -> (Config, SourceMap) {
    Config::from_str(text, "morph.toml").unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_motion_needs_no_field_problem_and_is_in_si() {
    let (config, _) = config(MORPH);
    assert_eq!(config.analysis.frequencies(), [0.0]);
    let morph = config.morph.expect("a motion");
    assert_eq!((morph.increments, morph.least_quality), (Increments::Count(1), 0.01));
    assert_eq!(morph.motion[0].target, Target::Line([[0.0, 0.04, 0.08], [0.08, 0.04, 0.08]]));
    assert_eq!(morph.motion[0].displacement, Some([0.0, 0.0, 0.036]));
    let rotation = morph.motion[1].rotation.expect("a rotation");
    assert!((rotation.angle - std::f64::consts::FRAC_PI_4).abs() < 1e-15);
    assert_eq!(rotation.axis.vector(), [0.0, 0.0, 2.0]);
    assert_eq!(morph.motion[1].scale, Some(Scale { center: [0.0; 3], factor: 0.5 }));
    assert_eq!(morph.tune.parameters, [TunedParameter::Poisson, TunedParameter::Force]);
    assert_eq!((morph.tune.evaluations, morph.tune.poisson), (9, [-0.2, 0.45]));
}

#[test]
fn only_a_motion_alone_may_be_without_a_field_problem() {
    let tables = [
        ("coils", "[[coils]]\nname = \"c\"\n"),
        ("objective", "[objective]\n"),
        ("boundaries", "[boundaries]\n"),
        ("constraints", "[[constraints]]\n"),
        ("materials", "[materials.iron]\n"),
        ("regions", "[regions.block]\nmaterial = \"air\"\n"),
    ];
    for (table, text) in tables {
        let report = report(&format!("{MORPH}{text}"));
        let fault = report.diagnostics.iter().find(|fault| fault.path == "analysis");
        let help = fault.and_then(|fault| fault.help.as_deref()).unwrap_or_default();
        assert!(help.contains(&format!("`{table}`")), "{report}");
    }
}

#[test]
fn a_case_is_the_configuration_with_its_tables_laid_over_it() {
    let (config, source) = config(MORPH);
    let morph = config.morph.as_ref().expect("a motion");
    let of = |index: usize| morph.cases[index].config.as_deref().expect("it was read");
    let MeshConfig::Block(block) = &of(0).mesh else { panic!("a block") };
    assert_eq!((block.cells, block.size), ([6, 6, 5], [0.08; 3]));
    assert_eq!(of(0).remesh.as_ref().map(|r| (r.poisson, r.free.len())), Some((0.1, 1)));
    let own = of(0).morph.as_ref().expect("a motion");
    assert_eq!((own.motion.len(), own.cases.len(), own.increments), (2, 0, Increments::Count(1)));
    assert_eq!(morph.cases[0].paper.and_then(|paper| paper.poor), Some(115));
    let own = of(1).morph.as_ref().expect("a motion");
    assert_eq!(own.increments, Increments::Auto(AutoWord::Auto));
    assert_eq!(own.motion.len(), 1);
    // A fault that shows later points at the line of the case.
    let fault = source.case(0).diagnostic("remesh.poisson", "too soft");
    assert_eq!(line_of(source.text(), fault.span.range.start), 21);
}

#[test]
fn a_resolved_motion_reads_back_as_itself() {
    for text in [MORPH.to_owned(), SMALL.replace("[optimizer]", DESIGNED)] {
        let (config, _) = config(&text);
        let resolved = resolved_toml(&config);
        let (again, _) = Config::from_str(&resolved, "resolved.toml")
            .unwrap_or_else(|error| panic!("{error}\n{resolved}"));
        assert_eq!(again, config, "{resolved}");
        assert_eq!(resolved_toml(&again), resolved);
    }
}

/// What is replaced, by what, key path, part of the message, line.
const FAULTS: &[(&str, &str, &str, &str, usize)] = &[
    ("increments = 1", "increments = 0", "morph.increments", "out of range", 7),
    ("increments = 1", "increments = \"many\"", "morph.increments", "cannot be `many`", 7),
    ("least_quality = 0.01", "least_quality = 1", "morph.least_quality", "out of range", 8),
    ("least_quality = 0.01", "quality = 1", "morph.quality", "unknown key", 8),
    ("surface = \"z_min\"\n", "", "morph.motion[1].surface", "missing key `surface`", 12),
    (
        "surface = \"z_min\"\n",
        "surface = \"z_min\"\nbox = [[0,0,0],[1,1,0]]\n",
        "morph.motion[1].box",
        "both",
        14,
    ),
    (
        "surface = \"z_min\"\n",
        "design = \"upper\"\n",
        "morph.motion[1].rotation",
        "moves the design nodes",
        14,
    ),
    ("surface = \"z_min\"\n", "design = \"uper\"\n", "morph.motion[1].design", "cannot be `uper`", 13),
    (
        "displacement = [\"0 mm\", \"0 mm\", \"36 mm\"]\n",
        "",
        "morph.motion[0].displacement",
        "missing key",
        9,
    ),
    ("\"36 mm\"", "\"36 Hz\"", "morph.motion[0].displacement[2]", "is a frequency", 11),
    ("factor = 0.5", "factor = 0", "morph.motion[1].scale.factor", "out of range", 15),
    ("factor = 0.5", "center = [0, 0, 0]", "morph.motion[1].scale.factor", "missing key", 15),
    ("angle = \"45 deg\", ", "", "morph.motion[1].rotation.angle", "missing key", 14),
    ("[0, 0, 2]", "[0, 0, 0]", "morph.motion[1].rotation.axis", "has no length", 14),
    ("\"force\"]", "\"forse\"]", "morph.tune.parameters[1]", "cannot hold `forse`", 17),
    ("[\"poisson\", \"force\"]", "[]", "morph.tune.parameters", "empty list", 17),
    ("evaluations = 9", "poisson = [0.3, 0.1]", "morph.tune.poisson", "runs from", 18),
    ("name = \"soft\"\n", "", "morph.case[0].name", "missing key", 19),
    ("\"turned\"", "\"soft\"", "morph.case[1].name", "two cases are named `soft`", 0),
    ("poor = 115", "poor = -1", "morph.case[0].paper.poor", "out of range", 23),
    ("remesh.poisson = 0.1", "poisson = 0.1", "morph.case[0].poisson", "unknown key", 21),
    ("remesh.poisson = 0.1", "remesh.poisson = 0.7", "remesh.poisson", "out of range", 21),
    ("remesh.poisson = 0.1", "remesh.poison = 0.1", "remesh.poison", "unknown key `poison` in `remesh`", 21),
    ("remesh.poisson = 0.1", "remesh.free.x = 1", "remesh.free", "`x` is not the number of an item", 21),
    ("displacement = [0, 0, 0.01]", "", "morph.motion[0].displacement", "missing key", 27),
    ("[remesh]\nregion = \"block\"\nfree = [\"z_max\"]\n", "", "remesh", "missing key `remesh`", 0),
];

#[test]
fn every_fault_of_a_motion_is_found_once_at_its_place() {
    for &(from, to, path, message, line) in FAULTS {
        let text = MORPH.replacen(from, to, 1);
        assert_ne!(text, MORPH, "{from}");
        let report = report(&text);
        let found: Vec<_> = report.diagnostics.iter().filter(|fault| fault.path == path).collect();
        assert_eq!(found.len(), 1, "{from} -> {to}:\n{report}");
        assert!(found[0].message.contains(message), "{}", found[0].message);
        if line > 0 {
            assert_eq!(line_of(&text, found[0].span.range.start), line, "{report}");
        }
    }
}

#[test]
fn without_a_motion_the_fault_shows_one() {
    let (config, source) = config(SMALL);
    let text = config.morphing(&source).expect_err("no motion").to_string();
    assert!(text.contains("missing table `morph`") && text.contains("design = \"upper\""), "{text}");
    let bare = "[mesh]\ngenerator = \"block\"\n[analysis]\nfrequency = 0\n";
    let (config, source) = self::config(bare);
    let text = config.morphing(&source).expect_err("no motion").to_string();
    assert!(text.contains("surface = \"top\""), "{text}");
    // Every case may bring its own.
    let each = bare.to_owned()
        + "[remesh]\nregion = \"block\"\n[[morph.case]]\nname = \"a\"\nmotion = [{ surface = \"z_max\", displacement = [0, 0, 1] }]";
    assert!(Config::from_str(&each, "each.toml").is_ok());
    assert!(Config::from_str(&each.replace("motion", "#"), "each.toml").is_err());
}
