//! `docs/configuration.md` names every key that the reader knows, and no other, so that it cannot rot unseen.
//!
//! The page is made from the schema; that it is fresh, and the schema right, is tested in `tests/schema`.

use std::collections::BTreeSet;
use std::path::Path;

use fluxmorph_optimizer::config::{Config, ConfigError, resolved_toml};

/// Configurations that together write every table, each with the alternatives that exclude one another.
const FULL: [&str; 6] = [
    r#"
    [mesh]
    generator = "shield"
    [analysis]
    frequency = "60 Hz"
    [analysis.petsc]
    options = "-ksp_monitor"

    [materials.steel]
    conductivity = "7e6 S/m"
    density = "7850 kg/m3"
    [regions.plate]
    material = "steel"
    [[coils]]
    name = "mitred"
    shape = "racetrack"
    ampere_turns = 1
    center = [0, 0, 0]
    half_window = [1, 1]
    width = 1
    height = 1
    [[coils]]
    name = "round"
    shape = "racetrack"
    ampere_turns = 1
    center = [0, 0, 0]
    half_window = [1, 1]
    width = 1
    height = 1
    direction = [1, 0, 0]
    inner_radius = 1
    [[coils]]
    name = "circle"
    shape = "circular"
    ampere_turns = 1
    center = [0, 0, 0]
    radius = 1
    width = 1
    height = 1
    [[coils]]
    name = "winding"
    region = "winding"
    ampere_turns = 1
    terminals = ["in", "out"]
    [boundaries]
    uniform_field = { surfaces = ["outer"], b = [0, 0, 1], center = [0, 0, 0] }
    [objective]
    kind = "uniformity"
    region = "observation"
    target = [0, 0, 1]
    frequency = "60 Hz"
    [[constraints]]
    kind = "uniformity"
    region = "observation"
    target = [0, 0, 1]
    frequency = "60 Hz"
    upper = 1
    [[constraints]]
    kind = "field_component"
    region = "observation"
    direction = [0, 0, 1]
    upper_ratio = 1
    [[constraints]]
    kind = "mass"
    region = "plate"
    upper = 1
    [[constraints]]
    kind = "thickness"
    minimum = 0.001
    maximum = 0.1
    [design]
    surface = "plate_bottom"
    direction = [0, 0, -1]
    grid = [7, 13]
    lower = -0.005
    upper = 0.02
    [remesh]
    region = "remesh"
    [[remesh.subregions]]
    name = "plate"
    young = 1
    poisson = 0.3
    force = [0, 0, 0]
    [optimizer]
    max_time = "1 h"
    minimum_quality = 0
    [[probes]]
    name = "here"
    points = [[0, 0, 0]]
    [[morph.motion]]
    design = "upper"
    "#,
    r#"
    [mesh]
    generator = "block"
    [remesh]
    region = "block"
    [[morph.motion]]
    surface = "z_max"
    displacement = [0, 0, 1]
    rotation = { angle = 1 }
    scale = { factor = 2 }
    [[morph.motion]]
    line = [[0, 0, 0], [1, 0, 0]]
    displacement = [0, 0, 1]
    [[morph.motion]]
    nodes = [[0, 0, 0]]
    displacement = [0, 0, 1]
    [[morph.motion]]
    box = [[0, 0, 0], [1, 0, 0]]
    displacement = [0, 0, 1]
    [[morph.case]]
    name = "one"
    increments = 2
    least_quality = 0.1
    [morph.case.paper]
    worst_quality = 0.1
    poor = 1
    share_poor_percent = 1
    share_fair_percent = 1
    share_good_percent = 1
    equations = 1
    "#,
    r#"
    [mesh]
    generator = "block"
    [analysis]
    frequencies = [0, 50]
    [objective]
    kind = "field_component"
    region = "block"
    direction = [0, 0, 1]
    [design]
    surface = "z_max"
    direction = "normal"
    filter_radius = 0.02
    symmetry = [{ axis = "x", at = 0 }]
    lower = -0.005
    upper = 0.02
    [remesh]
    box = [[0, 0, 0], [1, 1, 1]]
    "#,
    r#"
    [mesh]
    generator = "boxes"
    [mesh.boxes]
    box = [[0, 0, 0], [1, 1, 1]]
    [[mesh.boxes.regions]]
    name = "plate"
    box = [[0, 0, 0], [1, 1, 0.5]]
    size = 0.1
    skin = 0.1
    cells = [1, 1, 1]
    [[mesh.boxes.sizes]]
    axis = "z"
    from = 0.5
    size = 0.1
    [[mesh.boxes.surfaces]]
    name = "top"
    box = [[0, 0, 0.5], [1, 1, 0.5]]
    [analysis]
    frequency = 0
    [materials.magnet]
    [regions.plate]
    material = "magnet"
    remanence = [0, 0, 1]
    "#,
    r#"
    [mesh]
    generator = "sphere"
    [mesh.sphere]
    inner_radius = 0.045
    air_layer = 0.005
    [analysis]
    frequency = 0
    "#,
    r#"
    [mesh]
    file = "device.msh"
    unit = "mm"
    [analysis]
    frequency = 0
    [[objective.terms]]
    kind = "uniformity"
    region = "gap"
    target = [0, 0, 1]
    frequency = 0
    [[objective.terms]]
    kind = "field_component"
    region = "gap"
    direction = [0, 0, 1]
    "#,
];

/// Tables whose keys are names of the user's.
const NAMED: [&str; 2] = ["materials", "regions"];

fn page() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/configuration.md");
    std::fs::read_to_string(path).expect("the page is in the repository")
}

/// The part of the page under a heading, down to the next heading of any level.
fn section<'a>(page: &'a str, heading: &str) -> &'a str {
    let start = page.find(&format!("{heading}\n")).unwrap_or_else(|| panic!("no heading `{heading}`"));
    let body = &page[start + heading.len()..];
    body.find("\n#").map_or(body, |end| &body[..end])
}

/// Collects `(heading, key)` for every key of a table.
fn keys_of(path: &str, table: &toml::Table, keys: &mut BTreeSet<(String, String)>) {
    for (key, value) in table {
        let inner = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        let level = if path.is_empty() { "##" } else { "###" };
        match value {
            toml::Value::Table(tables) if NAMED.contains(&inner.as_str()) => {
                for table in tables.values().filter_map(toml::Value::as_table) {
                    leaves(&format!("## `[{inner}.NAME]`"), &inner, table, keys);
                }
            }
            toml::Value::Table(table) => leaves(&format!("{level} `[{inner}]`"), &inner, table, keys),
            toml::Value::Array(items) if items.iter().any(toml::Value::is_table) => {
                for table in items.iter().filter_map(toml::Value::as_table) {
                    leaves(&format!("{level} `[[{inner}]]`"), &inner, table, keys);
                }
            }
            toml::Value::String(_) if path.is_empty() => {
                keys.insert((format!("## `{key}`"), key.clone()));
            }
            _ => {}
        }
    }
}

/// The keys of one table go under its heading; tables inside it have their own.
fn leaves(heading: &str, path: &str, table: &toml::Table, keys: &mut BTreeSet<(String, String)>) {
    for (key, value) in table {
        match value {
            toml::Value::Table(_) => {}
            toml::Value::Array(items) if items.first().is_some_and(toml::Value::is_table) => {}
            _ => {
                keys.insert((heading.to_owned(), key.clone()));
            }
        }
    }
    keys_of(path, table, keys);
}

/// Every key that a full configuration writes, under the heading of its table.
fn known_keys() -> BTreeSet<(String, String)> {
    let mut keys = BTreeSet::new();
    for text in FULL {
        let (config, _) = Config::from_str(text, "full.toml").unwrap_or_else(|error| panic!("{error}"));
        let resolved: toml::Table = resolved_toml(&config).parse().expect("resolved.toml is TOML");
        keys_of("", &resolved, &mut keys);
    }
    keys
}

/// What the reader says it knows in a table, from its answer to an unknown key.
fn known_to_reader(table: &str, text: &str) -> Vec<String> {
    let error = Config::from_str(text, "probe.toml").expect_err("an unknown key");
    let ConfigError::Invalid(report) = error else { panic!("{error}") };
    let fault = report.diagnostics.iter().find(|fault| fault.message.contains("unknown key `zzzzzzzzzz`"));
    let known =
        fault.and_then(|fault| fault.expected.as_deref()).unwrap_or_else(|| panic!("{table}: {report}"));
    known.trim_start_matches("known: ").split(", ").map(str::to_owned).collect()
}

#[test]
fn every_key_stands_under_the_heading_of_its_table() {
    let page = page();
    let keys = known_keys();
    assert!(keys.len() > 70, "{keys:?}");
    for (heading, key) in &keys {
        let section = section(&page, heading);
        assert!(section.contains(&format!("\n| `{key}` |")), "`{key}` has no row under {heading}");
    }
}

#[test]
fn every_key_that_the_reader_asks_for_is_mentioned() {
    let page = page();
    let tables = [
        "[mesh]",
        "[mesh.shield]",
        "[mesh.block]",
        "[mesh.sphere]",
        "[mesh.boxes]",
        "[[mesh.boxes.regions]]",
        "[[mesh.boxes.sizes]]",
        "[[mesh.boxes.surfaces]]",
        "[analysis]",
        "[analysis.linear_solver]",
        "[analysis.petsc]",
        "[materials.a]",
        "[regions.a]",
        "[[coils]]",
        "[boundaries]",
        "[boundaries.uniform_field]",
        "[objective]",
        "[[objective.terms]]",
        "[[constraints]]\nkind = \"uniformity\"",
        "[[constraints]]\nkind = \"mass\"",
        "[[constraints]]\nkind = \"thickness\"",
        "[design]",
        "[[design.symmetry]]",
        "[remesh]",
        "[[remesh.subregions]]",
        "[morph]",
        "[[morph.motion]]",
        "[[morph.motion]]\n[morph.motion.rotation]",
        "[[morph.motion]]\n[morph.motion.scale]",
        "[morph.tune]",
        "[[morph.case]]",
        "[[morph.case]]\n[morph.case.paper]",
        "[optimizer]",
        "[[probes]]",
        "[output]",
    ];
    for table in tables {
        for key in known_to_reader(table, &format!("{table}\nzzzzzzzzzz = 1\n")) {
            let forms = [format!("`{key}`"), format!(".{key}`"), format!(".{key}]")];
            assert!(forms.iter().any(|form| page.contains(form)), "{table}: `{key}`");
        }
    }
    for key in known_to_reader("the top", "zzzzzzzzzz = 1\n") {
        assert!(page.contains(&format!("`{key}`")) || page.contains(&format!("[{key}")), "`{key}`");
    }
}

#[test]
fn every_row_is_a_key() {
    let page = page();
    let keys = known_keys();
    let configuration = &page[..page.find("generate`: end").expect("the end of the generated part")];
    for heading in configuration.lines().filter(|line| line.starts_with("##")) {
        // A row that leads to a table of its own is no key with a value.
        let leads_on =
            |row: &&str| ["| table ", "| tables ", "| keys of "].iter().any(|kind| row.contains(kind));
        let rows = section(&page, heading).lines().filter(|row| !leads_on(row));
        for key in rows.filter_map(|row| row.strip_prefix("| `")?.split('`').next()) {
            assert!(keys.contains(&(heading.to_owned(), key.to_owned())), "{heading}: `{key}` is no key");
        }
    }
}
