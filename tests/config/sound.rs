//! Sound configurations: their values in SI with every default filled in, and the resolved form, which reads back the same.

use fluxmorph::build::{Mode, build_mesh, set_up};
use fluxmorph::config::{Config, MeshConfig, SourceMap, resolved_toml};
use fluxmorph_geometry::generate::{BlockParameters, ShieldParameters, SphereParameters};

use crate::case::{Case, overwrite, read};
use crate::support::program::folder;
use crate::support::{repository, repository_text};

/// The configuration must be that of its resolved form, bit for bit.
#[track_caller]
pub(crate) fn assert_reads_back(config: &Config) -> toml::Table {
    let resolved = resolved_toml(config);
    let (again, _) = Config::from_str(&resolved, "resolved.toml")
        .unwrap_or_else(|error| panic!("the resolved configuration is refused: {error}\n{resolved}"));
    assert_eq!(again, *config, "{resolved}");
    assert_eq!(resolved_toml(&again), resolved);
    resolved.parse().expect("it was read")
}

/// Reads a case with its overrides; the configuration that its command names.
fn configuration(case: &Case) -> (Config, SourceMap, String) {
    let home = folder();
    case.write(home.path());
    let overrides: Vec<String> = case.set.clone();
    let read = Config::from_file(&home.path().join("device.toml"), &overrides);
    let (config, source) = read.unwrap_or_else(|error| panic!("{}: {error}", case.at));
    assert_eq!(source.text(), case.config(), "{}: overrides leave the text as it is", case.at);
    let home = home.path().canonicalize().expect("it is there").display().to_string();
    let Some(index) = case.command.strip_prefix("case ") else { return (config, source, home) };
    let cases = &config.morph.as_ref().expect("a motion").cases;
    let index: usize = index.parse().expect("the number of a case");
    (*cases[index].config.clone().expect("it was read"), source, home)
}

/// The value at a path such as `coils.0.center`.
pub(crate) fn value_at<'a>(table: &'a toml::Table, path: &str) -> Option<&'a toml::Value> {
    let (first, rest) = path.split_once('.').unwrap_or((path, ""));
    rest.split('.').filter(|step| !step.is_empty()).try_fold(table.get(first)?, |value, step| match value {
        toml::Value::Array(items) => items.get(step.parse::<usize>().ok()?),
        other => other.get(step),
    })
}

#[test]
fn values_are_in_si_with_every_default() {
    let cases = read("sound");
    let mut objections = Vec::new();
    let mut all = Vec::new();
    for case in &cases {
        let (config, source, home) = configuration(case);
        if case.command == "mesh" {
            build_mesh(&config, &source).unwrap_or_else(|error| panic!("{}: {error}", case.at));
        }
        let resolved = assert_reads_back(&config);
        let line = |expected: &String| {
            let path = expected[2..].split(" = ").next().unwrap_or_default();
            let value = value_at(&resolved, path).map_or("not there".to_owned(), toml::Value::to_string);
            format!("> {path} = {}", value.replace(&home, "HOME"))
        };
        let found: Vec<String> = case.expected.iter().map(line).collect();
        if found != case.expected {
            objections.push(format!("{}:\n{}", case.at, found.join("\n")));
        }
        all.push(found);
    }
    if std::env::var_os("SNAPSHOTS").is_some_and(|value| value == "overwrite") {
        overwrite("sound", &all);
    } else {
        assert!(objections.is_empty(), "{}", objections.join("\n----\n"));
    }
}

#[test]
fn a_mesh_left_to_its_defaults_is_that_of_the_generator() {
    let bare = repository_text("tests/config/bases/bare.toml");
    for generator in ["shield", "block", "sphere"] {
        let (config, _) = Config::from_str(&bare.replace("shield", generator), "bare.toml").expect("sound");
        match config.mesh {
            MeshConfig::Shield(mesh) => assert_eq!(mesh.parameters(), ShieldParameters::default()),
            MeshConfig::Block(mesh) => assert_eq!(mesh.parameters(), BlockParameters::default()),
            MeshConfig::Sphere(mesh) => assert_eq!(mesh.parameters(), SphereParameters::default()),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_word_of_an_earlier_version_is_read_as_the_new_one_with_a_notice() {
    let text = |word: &str| {
        let base = repository_text("tests/config/bases/boxes.toml");
        format!("{base}\n[objective]\nkind = \"{word}\"\nregion = \"air\"\ntarget = [0, 0, \"5 mT\"]\n")
    };
    let [(former, source), (now, silent)] = ["uniformity", "target_field"]
        .map(|word| Config::from_str(&text(word), "device.toml").expect("both words are read"));
    assert_eq!(former, now);
    let notice =
        "`objective.kind` = \"uniformity\" is called \"target_field\" now; the old word is still read";
    assert_eq!((source.notices(), silent.notices()), (&[notice.to_owned()][..], &[][..]));
    // Nothing excites it.
    let setup = set_up(&former, &source, Mode::Analysis).expect("a sound device");
    assert!(setup.warnings.iter().any(|warning| warning == notice), "{:?}", setup.warnings);
}

/// The far side of the shell that is put around a mesh has its condition: no patch of the outside lies on it.
#[test]
fn space_that_is_open_is_no_side_without_a_condition() {
    let path = repository("configs/pole_open.toml");
    let (config, source) = Config::from_file(&path, &[]).expect("a shipped configuration");
    let setup = set_up(&config, &source, Mode::Inspection).expect("a sound device");
    let far = setup.full_mesh.topology().surface("infinity").expect("the far side of the shell").len();
    let open: usize = setup.open_patches.iter().map(|patch| patch.faces.len()).sum();
    let named = config.boundaries.flux_parallel.len() + config.boundaries.flux_normal.len();
    assert!(far > 0 && named > 0);
    assert_eq!(open, 0, "{:?}", setup.open_patches);
}
