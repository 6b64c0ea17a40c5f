//! One change, one fault, at the right place.

use super::*;

pub(super) fn report(text: &str) -> DiagnosticReport {
    match Config::from_str(text, "small.toml") {
        Err(ConfigError::Invalid(report)) => *report,
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("accepted:\n{text}"),
    }
}

/// Part of the small configuration, what takes its place, key path, part of the message, line.
type Case = (&'static str, &'static str, &'static str, &'static str, usize);

const CASES: &[Case] = &[
    ("[analysis]", "[analysis]\nfreqency = 1", "analysis.freqency", "unknown key", 6),
    (
        "[mesh.shield]",
        "[mesh.shield]\npich = 1",
        "mesh.shield.pich",
        "unknown key `pich` in `mesh.shield`",
        4,
    ),
    ("[mesh]\n", "colis = 1\n[mesh]\n", "colis", "unknown key `colis`", 1),
    ("[remesh]\n", "[remesh]\nregions = []\n", "remesh.regions", "unknown key", 32),
    ("name = \"coil\"\n", "", "coils[0].name", "missing key `name`", 12),
    ("frequency = \"60 Hz\"\n", "", "analysis.frequency", "missing key `frequency` in `analysis`", 5),
    ("surface = \"plate_bottom\"\n", "", "design.surface", "missing key", 25),
    ("generator = \"shield\"\n", "", "mesh.generator", "missing key", 1),
    ("shape = \"racetrack\"\n", "", "coils[0].shape", "missing key", 12),
    ("[[probes]]\nname = \"behind\"\n", "[[probes]]\n", "probes[0].name", "missing key", 36),
    ("region = \"remesh\"\n", "", "remesh.region", "missing key", 31),
    ("\"60 Hz\"", "\"60 mm\"", "analysis.frequency", "is a length, not a frequency", 6),
    ("\"60 Hz\"", "\"60\"", "analysis.frequency", "has no unit", 6),
    ("\"60 Hz\"", "nan", "analysis.frequency", "not a finite number", 6),
    ("\"60 Hz\"", "inf", "analysis.frequency", "not a finite number", 6),
    ("\"60 Hz\"", "-1", "analysis.frequency", "out of range", 6),
    ("\"60 Hz\"", "true", "analysis.frequency", "is `true`, not a frequency", 6),
    ("\"60 Hz\"", "1979-05-27", "analysis.frequency", "is a date", 6),
    ("\"60 Hz\"", "\"60 Hz", "", "not valid TOML", 6),
    ("\"7e6 S/m\"", "\"1.4e-7 Ohm m\"", "materials.steel.conductivity", "is a resistivity", 9),
    ("= 800", "= 0", "materials.steel.relative_permeability", "out of range", 8),
    ("= 800", "= \"800\"", "materials.steel.relative_permeability", "not a number", 8),
    ("material = \"steel\"", "material = \"stel\"", "regions.plate.material", "no material `stel`", 11),
    (
        "material = \"steel\"",
        "material = \"steel\"\nmodel = \"surface\"",
        "regions.plate.model",
        "cannot be",
        12,
    ),
    ("\"racetrack\"", "\"racetrak\"", "coils[0].shape", "cannot be `racetrak`", 14),
    ("\"racetrack\"", "5", "coils[0].shape", "not a text", 14),
    ("\"40 kA\"", "0", "coils[0].ampere_turns", "makes no field", 15),
    ("\"20 mm\"\nheight", "\"0 mm\"\nheight", "coils[0].width", "out of range", 18),
    ("height = \"40 mm\"", "height = -0.01", "coils[0].height", "out of range", 19),
    ("[\"60 mm\", \"160 mm\"]", "[\"60 mm\"]", "coils[0].half_window", "has 1 items", 17),
    ("[\"60 mm\", \"160 mm\"]", "[\"60 mm\", \"1 Hz\"]", "coils[0].half_window[1]", "is a frequency", 17),
    ("[\"60 mm\", \"160 mm\"]", "60", "coils[0].half_window", "not a list", 17),
    ("\"30 deg\"", "\"30 degrees\"", "coils[0].phase", "`degrees`", 20),
    ("phase = \"30 deg\"", "axis = \"w\"", "coils[0].axis", "cannot be `w`", 20),
    ("phase = \"30 deg\"", "inner_radius = \"61 mm\"", "coils[0].inner_radius", "more than a half size", 20),
    ("phase = \"30 deg\"", "corner = \"mitred\"\ninner_radius = 0.01", "coils[0].inner_radius", "both", 21),
    ("phase = \"30 deg\"", "region = \"winding\"", "coils[0].region", "both `shape` and `region`", 20),
    (
        "[boundaries]",
        "[[coils]]\nname = \"coil\"\nshape = \"racetrack\"\nampere_turns = 1\ncenter = [0, 0, 0]\n\
      half_window = [1, 1]\nwidth = 1\nheight = 1\n[boundaries]",
        "coils[1].name",
        "two coils are named `coil`",
        0,
    ),
    ("[\"x_min\", \"y_min\"]", "[\"x_min\", \"x_min\"]", "boundaries.flux_parallel[1]", "`x_min` twice", 22),
    ("[\"x_min\", \"y_min\"]", "[\"x_min\", 3]", "boundaries.flux_parallel[1]", "not a text", 22),
    ("[\"x_min\", \"y_min\"]", "[\"x_min\", \"\"]", "boundaries.flux_parallel[1]", "is empty", 22),
    ("\"y_min\"]", "\"y_min\"]\nflux_normal = [\"y_min\"]", "boundaries.flux_normal[0]", "at once", 23),
    (
        "region = \"observation\"",
        "region = \"observation\"\nkind = \"lost\"",
        "objective.kind",
        "cannot be",
        25,
    ),
    ("\"60 Hz\"", "60\nfrequencies = [60]", "analysis.frequencies", "both", 7),
    ("frequency = \"60 Hz\"", "frequencies = []", "analysis.frequencies", "is an empty list", 6),
    ("frequency = \"60 Hz\"", "frequencies = [50, 200, 50]", "analysis.frequencies[2]", "has 50 Hz twice", 6),
    ("frequency = \"60 Hz\"", "frequencies = [50, \"1 m\"]", "analysis.frequencies[1]", "is a length", 6),
    (
        "region = \"observation\"",
        "region = \"observation\"\ngoal = \"min\"",
        "objective.goal",
        "cannot be",
        25,
    ),
    ("region = \"observation\"", "region = \"observation\"\nweight = 0", "objective.weight", "no effect", 25),
    ("region = \"observation\"", "kind = \"loss\"", "objective.region", "missing key", 23),
    (
        "region = \"observation\"",
        "region = \"observation\"\nkind = \"uniformity\"",
        "objective.target",
        "missing key",
        23,
    ),
    (
        "region = \"observation\"",
        "region = \"observation\"\ntarget = [0, 0, \"0.5 T\"]",
        "objective.target",
        "no use for the kind `flux_density_squared`",
        25,
    ),
    (
        "region = \"observation\"",
        "region = \"observation\"\nkind = \"field_component\"\ndirection = [0, 0, 0]",
        "objective.direction",
        "has no length",
        26,
    ),
    (
        "region = \"observation\"",
        "region = \"observation\"\nfrequency = \"50 Hz\"",
        "objective.frequency",
        "not analysed",
        25,
    ),
    (
        "region = \"observation\"",
        "weight = 2\n[[objective.terms]]\nregion = \"observation\"",
        "objective.weight",
        "both `terms` and `weight`",
        24,
    ),
    ("region = \"observation\"", "terms = []", "objective.terms", "has no term", 24),
    ("[optimizer]", "[[constraints]]\n[optimizer]", "constraints[0].kind", "missing key", 34),
    (
        "[optimizer]",
        "[[constraints]]\nkind = \"volum\"\n[optimizer]",
        "constraints[0].kind",
        "cannot be `volum`",
        35,
    ),
    (
        "[optimizer]",
        "[[constraints]]\nkind = \"volume\"\nregion = \"plate\"\nupper = \"5 mm\"\n[optimizer]",
        "constraints[0].upper",
        "is a length, not a volume",
        37,
    ),
    (
        "[optimizer]",
        "[[constraints]]\nkind = \"loss\"\nregion = \"plate\"\n[optimizer]",
        "constraints[0].upper",
        "missing key",
        34,
    ),
    (
        "[optimizer]",
        "[[constraints]]\nkind = \"energy\"\nupper = \"1 J\"\nupper_ratio = 0.9\n[optimizer]",
        "constraints[0].upper_ratio",
        "both",
        37,
    ),
    (
        "[optimizer]",
        "[[constraints]]\nkind = \"thickness\"\nminimum = 0.02\nmaximum = 0.01\n[optimizer]",
        "constraints[0].maximum",
        "at most",
        37,
    ),
    (
        "[optimizer]",
        "[[constraints]]\nkind = \"thickness\"\n[optimizer]",
        "constraints[0].minimum",
        "missing key",
        34,
    ),
    (
        "[optimizer]",
        "[[constraints]]\nkind = \"volume\"\nname = \"a,b\"\nregion = \"plate\"\nupper = 1\n[optimizer]",
        "constraints[0].name",
        "`a,b`",
        36,
    ),
    (
        "[optimizer]",
        "[[constraints]]\nkind = \"thickness\"\nminimum = 0.01\n[optimizer]\nalgorithm = \"lbfgs\"",
        "optimizer.algorithm",
        "`lbfgs` cannot keep constraints",
        38,
    ),
    ("[1.0, 2.0, -2.5]", "[0, 0, 0]", "design.direction", "has no length", 27),
    ("[1.0, 2.0, -2.5]", "[0, 0, nan]", "design.direction[2]", "not a finite number", 27),
    ("[1.0, 2.0, -2.5]", "[0, 0, 0, 1]", "design.direction", "has 4 items", 27),
    ("[1.0, 2.0, -2.5]", "\"nromal\"", "design.direction", "cannot be `nromal`", 27),
    ("direction = [1.0, 2.0, -2.5]\n", "", "design.direction", "missing key `direction`", 25),
    ("[7, 13]", "[7, 13]\nfilter_radius = 0.02", "design.filter_radius", "are both given", 29),
    ("grid = [7, 13]", "filter_radius = 0", "design.filter_radius", "out of range", 28),
    ("[7, 13]", "[7, 13]\nrim = \"loose\"", "design.rim", "cannot be `loose`", 29),
    ("[7, 13]", "[7, 13]\nsymmetry = [{ axis = \"w\" }]", "design.symmetry[0].axis", "cannot be `w`", 29),
    ("[7, 13]", "[7, 13]\nsymmetry = [{ at = 1 }]", "design.symmetry[0].axis", "missing key `axis`", 29),
    (
        "[7, 13]",
        "[7, 13]\nsymmetry = [{ axis = \"y\" }]",
        "design.symmetry[0].axis",
        "leaves the symmetry plane",
        29,
    ),
    (
        "[1.0, 2.0, -2.5]",
        "\"normal\"\nsymmetry = [{ axis = \"y\" }, { axis = \"y\", at = 1 }]",
        "design.symmetry[1].axis",
        "two symmetry planes along y",
        28,
    ),
    ("surface = \"plate_bottom\"", "surface = []", "design.surface", "empty list", 26),
    ("= 800", "= 800\ndensity = \"7.85 kg\"", "materials.steel.density", "7.85 kg", 9),
    ("[7, 13]", "[7, 1]", "design.grid[1]", "out of range", 28),
    ("[7, 13]", "[7.0, 13]", "design.grid[0]", "not a whole number", 28),
    ("[7, 13]", "[7, -13]", "design.grid[1]", "out of range", 28),
    ("upper = \"20 mm\"", "upper = \"-20 mm\"", "design.upper", "bounds cross", 30),
    ("lower = \"-5 mm\"", "lower = \"5 mm\"", "design.lower", "leave out 0 m", 29),
    ("upper = \"20 mm\"", "upper = 0.02\ninitial = \"21 mm\"", "design.initial", "outside of the bounds", 31),
    ("[remesh]", "[remesh]\npoisson = 0.5", "remesh.poisson", "out of range", 32),
    ("[remesh]", "[remesh]\nyoung = 0", "remesh.young", "out of range", 32),
    ("[remesh]", "[remesh]\nbox = [[0, 0, 0], [1, 1, 1]]", "remesh.box", "both given", 32),
    ("region = \"remesh\"", "box = [[0, 0, 0], [1, 1, 0]]", "remesh.box", "has no volume", 32),
    ("region = \"remesh\"", "region = []", "remesh.region", "is an empty list", 32),
    (
        "[\"x_min\"]",
        "[\"x_min\"]\nfixed = [\"x_min\"]",
        "remesh.fixed[0]",
        "remesh.slide and remesh.fixed",
        34,
    ),
    ("[optimizer]", "[optimizer]\nalgorithm = \"MMA2\"", "optimizer.algorithm", "cannot be", 35),
    ("[optimizer]", "[optimizer]\nmax_evaluations = 0", "optimizer.max_evaluations", "out of range", 35),
    (
        "[optimizer]",
        "[optimizer]\nmax_evaluations = 99999999999999999999",
        "optimizer.max_evaluations",
        "not a",
        35,
    ),
    ("[optimizer]", "[optimizer]\nftol_rel = 1", "optimizer.ftol_rel", "out of range", 35),
    ("\"10 min\"", "\"10 minutes\"", "optimizer.max_time", "`minutes`", 35),
    ("[[\"0 mm\", \"0 mm\", \"-50 mm\"]]", "[]", "probes[0].points", "is an empty list", 38),
    ("[[\"0 mm\", \"0 mm\", \"-50 mm\"]]", "[[0, 0]]", "probes[0].points[0]", "has 2 items", 38),
    ("[[probes]]", "[output]\nfields = \"all\"\n[[probes]]", "output.fields", "cannot be `all`", 37),
    ("[\"0.4 mm\", \"1.2 mm\"]", "[\"0.4 mm\", \"0.2 mm\"]", "mesh.shield.skin[1]", "goes from", 4),
    ("generator = \"shield\"", "generator = \"block\"", "mesh.shield", "has no use", 3),
    (
        "generator = \"shield\"",
        "generator = \"shield\"\nunit = \"mm\"",
        "mesh.unit",
        "belongs to `mesh.file`",
        3,
    ),
    ("generator = \"shield\"", "generator = \"shield\"\nfile = \"a.msh\"", "mesh.file", "are both given", 3),
    ("[objective]", "[objective", "", "not valid TOML", 23),
    ("[objective]", "[design]", "", "not valid TOML", 0),
    ("surface = ", "surface = \"a\"\nsurface = ", "", "not valid TOML", 27),
];

#[test]
fn every_fault_is_named_at_its_place() {
    for (from, to, path, message, line) in CASES {
        assert!(SMALL.contains(from), "{from}");
        let text = SMALL.replacen(from, to, 1);
        let report = report(&text);
        let fault =
            report.diagnostics.iter().find(|fault| fault.path == *path && fault.message.contains(message));
        let fault = fault.unwrap_or_else(|| panic!("{to}: {path}: {message}\n{report}"));
        let found = line_of(&text, fault.span.range.start);
        assert!(*line == 0 || found == *line, "{to}: line {found}, not {line}\n{report}");
        assert!(fault.message.chars().next().is_some_and(|c| !c.is_uppercase()), "{}", fault.message);
        assert!(!fault.message.ends_with('.'), "{}", fault.message);
        if *line > 0 && !path.is_empty() {
            assert_eq!(report.diagnostics.len(), 1, "{to}: one change, one fault\n{report}");
            assert!(fault.expected.is_some() || fault.help.is_some(), "{to}: says what to do\n{report}");
        }
    }
}

#[test]
fn all_faults_are_reported_at_once_in_the_order_of_the_text() {
    let text = SMALL
        .replace("\"60 Hz\"", "\"60 mm\"")
        .replace("material = \"steel\"", "material = \"stel\"")
        .replace("[7, 13]", "[7, 1]")
        .replace("[optimizer]", "[optimizer]\nalgoritm = \"mma\"");
    let report = report(&text);
    let paths: Vec<_> = report.diagnostics.iter().map(|fault| fault.path.as_str()).collect();
    assert_eq!(
        paths,
        ["analysis.frequency", "regions.plate.material", "design.grid[1]", "optimizer.algoritm"]
    );
    let shown = report.to_string();
    for fragment in ["small.toml:6:13", "small.toml:11:12", "did you mean `algorithm`?", "4 faults"] {
        assert!(shown.contains(fragment), "{fragment}\n{shown}");
    }
    assert!(!shown.contains('\u{1b}'), "no colours");
}

#[test]
fn a_long_list_of_faults_is_cut() {
    let unknown: String = (0..50).map(|index| format!("zzz{index} = 1\n")).collect();
    let shown = report(&format!("{unknown}{SMALL}")).to_string();
    assert_eq!(shown.matches("error: unknown key").count(), 20);
    assert!(shown.contains("50 faults in the configuration `small.toml`, 30 of them not shown"), "{shown}");
}

#[test]
fn an_empty_text_misses_its_tables() {
    let report = report("");
    let paths: Vec<_> = report.diagnostics.iter().map(|fault| fault.path.as_str()).collect();
    assert_eq!(paths, ["mesh", "analysis"]);
    assert!(report.to_string().contains("missing key `mesh`"));
}

#[test]
fn an_impedance_surface_needs_a_frequency_and_a_conductor() {
    let text = SMALL
        .replace("\"60 Hz\"", "0")
        .replace("conductivity = \"7e6 S/m\"\n", "")
        .replace("material = \"steel\"", "material = \"steel\"\nmodel = \"impedance\"");
    let shown = report(&text).to_string();
    assert!(shown.contains("the frequency is 0 Hz") && shown.contains("`steel` does not conduct"), "{shown}");
}

#[test]
fn a_loss_needs_a_frequency_above_zero() {
    let loss = SMALL.replace("region = \"observation\"", "region = \"plate\"\nkind = \"loss\"");
    assert!(Config::from_str(&loss, "small.toml").is_ok());
    let shown = report(&loss.replace("\"60 Hz\"", "0")).to_string();
    assert!(shown.contains("`objective` is a loss at 0 Hz") && shown.contains("small.toml:25:"), "{shown}");
    let several = loss.replace("frequency = \"60 Hz\"", "frequencies = [0, 60]");
    assert!(Config::from_str(&several, "small.toml").is_ok(), "a sum over frequencies has a loss at 60 Hz");
}

#[test]
fn two_constraints_of_one_name_are_refused() {
    let one = "[[constraints]]\nkind = \"volume\"\nregion = \"plate\"\nupper_ratio = 0.9\n";
    let shown = report(&SMALL.replace("[optimizer]", &format!("{one}{one}[optimizer]"))).to_string();
    assert!(shown.contains("two constraints are named `volume_plate`"), "{shown}");
}

#[test]
fn faults_of_boxes_stand_at_their_keys() {
    let text = r#"
        [mesh]
        generator = "boxes"
        [mesh.boxes]
        box = [[0, 0, 0], [1, 1, 1]]
        growth = 1
        [[mesh.boxes.regions]]
        name = "plate"
        box = [[0, 0, 0], [1, 1, "2 m"]]
        [[mesh.boxes.regions]]
        box = [[0, 0, 0.5], [1, 1, 0.5]]
        size = ["1 mm", "1 mm"]
        [[mesh.boxes.sizes]]
        axis = "z"
        from = 0.5
        to = 3
        [[mesh.boxes.surfaces]]
        name = "top"
        box = [[0, 0, 0.5], [1, 1, 0.4]]
        [analysis]
        frequency = 0
    "#;
    let report = report(text);
    let paths: Vec<_> = report.diagnostics.iter().map(|fault| fault.path.as_str()).collect();
    let expected = [
        "mesh.boxes.growth",
        "mesh.boxes.regions[0].box",
        "mesh.boxes.regions[1].box",
        "mesh.boxes.regions[1].name",
        "mesh.boxes.regions[1].size",
        "mesh.boxes.sizes[0].to",
        "mesh.boxes.surfaces[0].box",
    ];
    for path in expected {
        assert!(paths.contains(&path), "{path} is not among {paths:?}");
    }
    assert_eq!(paths.len(), expected.len(), "{report}");
    assert!(report.to_string().contains("which goes from z = 0 m to 1 m"), "{report}");
}

#[test]
fn a_generator_needs_its_own_table_and_no_other() {
    let mesh = |text: &str| report(&format!("[mesh]\n{text}\n[analysis]\nfrequency = 0\n")).to_string();
    assert!(mesh("generator = \"boxes\"").contains("missing key `boxes`"));
    let shown = mesh("generator = \"block\"\n[mesh.sphere]\nradius = 1");
    assert!(shown.contains("`mesh.sphere` has no use without generator = \"sphere\""), "{shown}");
    let shown = mesh("generator = \"sphere\"\n[mesh.sphere]\nwall_layers = 2");
    assert!(shown.contains("divides the wall of a hollow sphere"), "{shown}");
}

#[test]
fn a_design_needs_a_remesh_table_and_an_optimisation_all_three() {
    let without = SMALL.replace("[remesh]\nregion = \"remesh\"\nslide = [\"x_min\"]\n", "");
    assert_eq!(report(&without).diagnostics[0].path, "remesh");

    let text = "[mesh]\ngenerator = \"shield\"\n[analysis]\nfrequency = 60\n";
    let (config, source) = Config::from_str(text, "small.toml").expect("enough to solve");
    let shown = config.optimisation(&source).expect_err("nothing to optimise").to_string();
    assert!(shown.contains("missing table `objective`") && shown.contains("3 faults"), "{shown}");
}

#[test]
fn odd_texts_never_panic() {
    for end in (0..SMALL.len()).step_by(3) {
        let _ = Config::from_str(&SMALL[..end], "small.toml").map_err(|error| error.to_string());
    }
    for text in [
        "\u{feff}",
        "\u{e9} = 1",
        "x = '''\n",
        "\"\\u0000\" = 1",
        "title = \"\u{e9}\"\n\r",
        "a = [[[[[[[1]]]]]]]",
    ] {
        let _ = Config::from_str(text, "small.toml").map_err(|error| error.to_string());
    }
    let deep = format!("a = {}1{}", "[".repeat(5000), "]".repeat(5000));
    let _ = Config::from_str(&deep, "small.toml").map_err(|error| error.to_string());
}

#[test]
fn a_name_that_is_too_long_is_refused_at_its_place() {
    let long = "n".repeat(600);
    let shown = report(&SMALL.replace("[materials.steel]", &format!("[materials.{long}]"))).to_string();
    assert!(shown.contains("names of more than 512 bytes") && shown.contains("small.toml:7:1"), "{shown}");
    // Region names in files of Gmsh have at most 127 bytes.
    let allowed = SMALL.replace("steel", &"n".repeat(400));
    assert!(Config::from_str(&allowed, "small.toml").is_ok());
}

#[test]
fn cases_that_repeat_too_much_are_refused() {
    let case = |n: usize| format!("[[morph.case]]\nname = \"{n}\"\n");
    let cases: String = (0..1000).map(case).collect();
    let text = format!("[mesh]\ngenerator = \"block\"\n[remesh]\nregion = \"block\"\n[morph]\n{cases}");
    let shown = report(&text).to_string();
    assert!(shown.contains("1000 cases repeat a configuration of 2006 values"), "{shown}");
}
