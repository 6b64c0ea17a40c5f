//! Wrong configurations: each is refused before anything is written, with the key, the line, and what would be right.

use std::fs;
use std::path::Path;

use crate::program::{Finished, fluxmorph, folder, quick};

/// One change to the quick configuration and what must be said about it.
struct Case {
    /// What is wrong.
    name: &'static str,
    /// A part of the configuration; the first place where it stands is changed.
    from: &'static str,
    /// What takes its place.
    to: &'static str,
    /// Lines from the change to the place that the message shows; `None` where that is elsewhere in the file.
    line: Option<isize>,
    /// Parts of the message: the key or its line, and the expectation.
    says: &'static [&'static str],
}

const CASES: &[Case] = &[
    Case {
        name: "unknown key",
        from: "frequency = \"60 Hz\"",
        to: "frequency = \"60 Hz\"\npenaltyy = 1.0",
        line: Some(1),
        says: &[
            "unknown key `penaltyy` in `analysis`",
            "did you mean `penalty`?",
            "known: frequencies, frequency",
        ],
    },
    Case {
        name: "unknown table",
        from: "[optimizer]",
        to: "[optimiser]",
        line: Some(0),
        says: &["unknown key `optimiser`", "did you mean `optimizer`?"],
    },
    Case {
        name: "missing key",
        from: "ampere_turns = \"40 kA\"\n",
        to: "",
        line: Some(-3),
        says: &["missing key `ampere_turns` in `coils[0]`", "add a line like: ampere_turns = \"40 kA\""],
    },
    Case {
        name: "missing table",
        from: "[remesh]",
        to: "[leftover]",
        line: None,
        says: &["missing key `remesh`", "the mesh must follow the design"],
    },
    Case {
        name: "wrong unit",
        from: "\"60 Hz\"",
        to: "\"60 mm\"",
        line: Some(0),
        says: &["`analysis.frequency`", "`60 mm` is a length, not a frequency", "accepted units: Hz"],
    },
    Case {
        name: "unit left out",
        from: "\"40 kA\"",
        to: "\"40\"",
        line: Some(0),
        says: &["`coils[0].ampere_turns`", "has no unit", "A"],
    },
    Case {
        name: "NaN",
        from: "\"60 Hz\"",
        to: "nan",
        line: Some(0),
        says: &["`analysis.frequency` is NaN", "must be at least 0 Hz"],
    },
    Case {
        name: "NaN with a unit",
        from: "upper = \"20 mm\"",
        to: "upper = \"nan mm\"",
        line: Some(0),
        says: &["`design.upper`", "must start with a number", "m, cm, mm"],
    },
    Case {
        name: "infinity",
        from: "\"7e6 S/m\"",
        to: "inf",
        line: Some(0),
        says: &["`materials.steel.conductivity`", "not a finite number"],
    },
    Case {
        name: "bounds that cross",
        from: "lower = \"-5 mm\"",
        to: "lower = \"25 mm\"",
        line: Some(1),
        says: &["the bounds cross", "design.lower is 0.025 m", "design.upper above 0.025 m"],
    },
    Case {
        name: "unknown region",
        from: "region = \"observation\"",
        to: "region = \"obsrvation\"",
        line: Some(0),
        says: &["there is no region `obsrvation`", "did you mean `observation`?", "known: air"],
    },
    Case {
        name: "unknown region of a material",
        from: "[regions.plate]",
        to: "[regions.plat]",
        line: Some(0),
        says: &["there is no region `plat`", "did you mean `plate`?"],
    },
    Case {
        name: "unknown surface",
        from: "\"plate_side\"]",
        to: "\"plate_sides\"]",
        line: Some(0),
        says: &["there is no surface `plate_sides`", "did you mean `plate_side`?", "known: plate_bottom"],
    },
    Case {
        name: "unknown material",
        from: "material = \"steel\"",
        to: "material = \"steal\"",
        line: Some(0),
        says: &["there is no material `steal`", "did you mean `steel`?"],
    },
    Case {
        name: "empty remesh region",
        from: "region = \"remesh\"",
        to: "box = [[\"1 m\", \"1 m\", \"1 m\"], [\"2 m\", \"2 m\", \"2 m\"]]",
        line: Some(0),
        says: &["`remesh.box` holds no element", "a box that holds the centroid"],
    },
    Case {
        name: "observation region that moves",
        from: "region = \"remesh\"",
        to: "region = [\"remesh\", \"observation\"]",
        line: None,
        says: &[
            "the observation region lies inside the remesh region",
            "region = \"observation\"",
            "take the region out of remesh.region",
        ],
    },
    Case {
        name: "observed region replaced by its surface",
        from: "region = \"observation\"",
        to: "region = \"plate\"",
        line: Some(0),
        says: &["`plate` is replaced by its impedance surface", "a region that is meshed"],
    },
    Case {
        name: "coil of no width",
        from: "width = \"20 mm\"",
        to: "width = \"0 mm\"",
        line: Some(0),
        says: &["`coils[0].width` is 0 m", "must be greater than 0 m"],
    },
    Case {
        name: "coil of no height",
        from: "height = \"40 mm\"",
        to: "height = 0",
        line: Some(0),
        says: &["`coils[0].height` is 0 m", "must be greater than 0 m"],
    },
    Case {
        name: "coil of no window",
        from: "\"160 mm\"]",
        to: "\"-0 mm\"]",
        line: Some(0),
        says: &["`coils[0].half_window[1]`", "must be greater than 0 m"],
    },
    Case {
        name: "coil without current",
        from: "\"40 kA\"",
        to: "\"0 kA\"",
        line: Some(0),
        says: &["`coils[0].ampere_turns` is 0 A", "any current but 0 A"],
    },
    Case {
        name: "coil in the remesh region",
        from: "center = [\"0 mm\", \"0 mm\", \"60 mm\"]",
        to: "center = [\"0 mm\", \"0 mm\", \"0 mm\"]",
        line: None,
        says: &[
            "a coil reaches into the remesh region",
            "center = ",
            "coils and their windows outside the remesh region",
        ],
    },
    Case {
        name: "bound that inverts the mesh upwards",
        from: "upper = \"20 mm\"",
        to: "upper = \"40 mm\"",
        line: Some(0),
        says: &[
            "`design.upper`: the mesh breaks at 40.000 mm",
            "region `remesh`",
            "a bound nearer to zero than 28.",
        ],
    },
    Case {
        name: "bound that inverts the mesh downwards",
        from: "lower = \"-5 mm\"",
        to: "lower = \"-12 mm\"",
        line: Some(0),
        says: &["`design.lower`: the mesh breaks at -12.000 mm", "a bound nearer to zero than -10.000 mm"],
    },
    Case {
        name: "start outside the bounds",
        from: "upper = \"20 mm\"",
        to: "upper = \"20 mm\"\ninitial = \"21 mm\"",
        line: Some(1),
        says: &["design.initial is 0.021 m", "from -0.005 m to 0.02 m"],
    },
    Case {
        name: "direction without length",
        from: "direction = [0.0, 0.0, -1.0]",
        to: "direction = [0.0, 0.0, 0.0]",
        line: Some(0),
        says: &["design.direction has no length", "such as [0.0, 0.0, -1.0]"],
    },
    Case {
        name: "grid along the direction",
        from: "direction = [0.0, 0.0, -1.0]",
        to: "direction = [1.0, 0.0, 0.0]",
        line: Some(0),
        says: &["a control grid cannot be laid across `design.direction`"],
    },
    Case {
        name: "probe outside the mesh",
        from: "\"-50 mm\"]]",
        to: "\"-50 m\"]]",
        line: Some(0),
        says: &[
            "the point (20.000, 60.000, -50000.000) mm of the probe `behind the plate` lies outside the mesh",
            "a point inside the mesh",
        ],
    },
    Case {
        name: "probe inside the plate",
        from: "\"-50 mm\"]]",
        to: "\"-5 mm\"]]",
        line: Some(0),
        says: &["the probe `behind the plate` lies in a region that its impedance surface replaces"],
    },
    Case {
        name: "generator's parameter",
        from: "\"240 mm\", \"10 mm\"]",
        to: "\"240 mm\", \"1 m\"]",
        line: None,
        says: &["mesh.shield.remesh_z = [-0.04, 0.03]", "must reach below and above the plate"],
    },
    Case {
        name: "face in both lists",
        from: "[objective]",
        to: "flux_normal = [\"x_min\"]\n\n[objective]",
        line: Some(0),
        says: &["`x_min` is flux-parallel and flux-normal at once", "each surface in one of the two lists"],
    },
    Case {
        name: "not TOML",
        from: "grid = [7, 13]",
        to: "grid = [7, 13",
        line: None,
        says: &["not valid TOML"],
    },
];

/// Writes a changed configuration whose mesh has one reference only, runs it, and returns how it ended with the line of the change.
fn run_changed(home: &Path, from: &str, to: &str) -> (Finished, usize) {
    let text = fs::read_to_string(quick()).expect("the quick configuration");
    let text = text.replacen("[remesh]\n", "[remesh]\nrounds = 0\n", 1);
    let place = text.find(from).unwrap_or_else(|| panic!("`{from}` stands in the quick configuration"));
    let line = text[..place].lines().count() + usize::from(text[..place].ends_with('\n'));
    let config = home.join("device.toml");
    fs::write(&config, text.replacen(from, to, 1)).expect("written");
    let out = home.join("out");
    let finished = fluxmorph(&["run".as_ref(), config.as_os_str(), "--out".as_ref(), out.as_os_str()]);
    assert!(finished.stdout.is_empty(), "{}", finished.stdout);
    assert!(!out.exists(), "nothing is written for a wrong configuration");
    (finished, line)
}

#[test]
fn every_fault_is_named_with_its_line_and_the_expectation() {
    for case in CASES {
        let home = folder();
        let (finished, line) = run_changed(home.path(), case.from, case.to);
        assert_eq!(finished.code, Some(3), "{}:\n{}", case.name, finished.stderr);
        let place = match case.line {
            Some(offset) => {
                format!("device.toml:{}:", line.checked_add_signed(offset).expect("the line is in the file"))
            }
            None => "device.toml:".to_owned(),
        };
        for fragment in case.says.iter().copied().chain([place.as_str(), "error: ", " fault"]) {
            assert!(
                finished.stderr.contains(fragment),
                "{}: no `{fragment}` in:\n{}",
                case.name,
                finished.stderr
            );
        }
    }
}

#[test]
fn the_bound_that_the_message_offers_can_be_used() {
    let home = folder();
    let (finished, _) = run_changed(home.path(), "upper = \"20 mm\"", "upper = \"40 mm\"");
    let (_, rest) = finished.stderr.split_once("nearer to zero than ").expect("an offer");
    let offered: f64 = rest.split(' ').next().and_then(|word| word.parse().ok()).expect("a number");
    let check = |millimetres: f64| {
        let bound = format!("design.upper={millimetres:?} mm");
        let set = |key: &str| ["--set".into(), key.into()];
        let arguments = [["check".into(), quick().into_os_string()], set(&bound), set("remesh.rounds=0")];
        // Up to the inversion itself.
        let arguments = [&arguments[..], &[set("optimizer.minimum_quality=0")]].concat();
        fluxmorph(&arguments.concat())
    };
    // A micrometre to either side of the offer, which is rounded to a micrometre.
    check(offered - 1e-3).exits_with(0);
    check(offered + 1e-3).exits_with(3);
}

#[test]
fn all_faults_are_reported_in_one_go_in_the_order_of_the_file() {
    let home = folder();
    let mut text = fs::read_to_string(quick()).expect("the quick configuration");
    let changes = [
        ("\"60 Hz\"", "\"60 mm\"", "`analysis.frequency`"),
        ("\"7e6 S/m\"", "\"7e6 Hz\"", "`materials.steel.conductivity`"),
        ("width = \"20 mm\"", "width = \"0 mm\"", "`coils[0].width`"),
        ("weighting = \"point\"", "weighting = \"points\"", "`objective.weighting`"),
        ("lower = \"-5 mm\"", "lower = \"25 mm\"", "the bounds cross"),
        ("algorithm", "algoritm", "unknown key `algoritm`"),
    ];
    for (from, to, _) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    let config = home.path().join("device.toml");
    fs::write(&config, text).expect("written");
    let stderr = fluxmorph(&["check".as_ref(), config.as_os_str()]).exits_with(3).stderr;
    // One message for each change: nothing is said about what only follows from another fault.
    assert_eq!(stderr.matches("error: ").count(), changes.len(), "{stderr}");
    assert!(stderr.contains(&format!("{} faults in the configuration", changes.len())), "{stderr}");
    let places: Vec<_> = changes.iter().map(|(_, _, message)| stderr.find(message)).collect();
    assert!(places.iter().all(Option::is_some) && places.is_sorted(), "{places:?}\n{stderr}");
}

#[test]
fn names_of_the_mesh_are_reported_together() {
    let home = folder();
    let text = fs::read_to_string(quick()).expect("the quick configuration");
    let text = text.replace("[regions.plate]", "[regions.plat]").replace("\"plate_side\"", "\"plate_sied\"");
    let config = home.path().join("device.toml");
    fs::write(&config, text.replace("\"observation\"", "\"observatory\"")).expect("written");
    fluxmorph(&["check".as_ref(), config.as_os_str()]).exits_with(3).says(&[
        "`plat`",
        "`plate_sied`",
        "`observatory`",
        "3 faults",
    ]);
}

#[test]
fn a_fault_in_an_override_shows_the_override() {
    let set = |value: &str| {
        let config = quick().into_os_string();
        fluxmorph(&["check".into(), config, "--set".into(), value.into()]).exits_with(3)
    };
    set("analysis.freqency=\"50 Hz\"")
        .says(&["--set 'analysis.freqency=\"50 Hz\"'", "did you mean `frequency`?"]);
    set("optimizer.max_evaluations=0").says(&["`optimizer.max_evaluations` is 0", "from 1 to 1000000"]);
    set("coils[3].width=1").says(&["coils[3]"]);
}
