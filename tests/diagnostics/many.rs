//! Many faults at once, colours, and lines that are too long to be shown.

use std::fs;
use std::process::Command;

use fluxmorph_optimizer::config::{Config, ConfigError, DiagnosticReport};
use fluxmorph_optimizer::diagnostics::{Style, render};

use crate::case::repository;

/// Changes of the quick configuration in different tables, none of which follows from another.
const CHANGES: &[(&str, &str)] = &[
    ("\"Shield plate, coarse and quick\"", "5"),
    ("\"120 mm\", \"240 mm\", \"10 mm\"]", "\"120 mm\", \"240 mm\", \"10 Hz\"]"),
    ("refinement = 0.5", "refinement = 50"),
    ("side_skin = []", "side_skins = []"),
    ("\"60 Hz\"", "\"60 mm\""),
    ("relative_permeability = 800", "relative_permeability = 0"),
    ("\"7e6 S/m\"", "\"7e6 S\""),
    ("material = \"steel\"", "material = \"stell\""),
    ("shape = \"racetrack\"", "shape = \"racetrak\""),
    ("\"40 kA\"", "\"40 kV\""),
    ("axis = \"z\"", "axis = \"w\""),
    ("width = \"20 mm\"", "width = \"0 mm\""),
    ("height = \"40 mm\"", "hieght = \"40 mm\""),
    ("\"z_min\", \"z_max\"]", "\"z_min\", \"z_min\"]"),
    ("kind = \"flux_density_squared\"", "kind = \"flux\""),
    ("direction = [0.0, 0.0, -1.0]", "direction = [0.0, 0.0]"),
    ("grid = [7, 13]", "grid = [7, 1]"),
    ("lower = \"-5 mm\"", "lower = \"25 mm\""),
    ("poisson = 0.3", "poisson = 0.5"),
    ("stiffness = \"inverse_size\"", "stiffness = \"soft\""),
    ("algorithm = \"mma\"", "algorithm = \"nma\""),
    ("max_evaluations = 5", "max_evaluations = 0"),
    ("name = \"behind the plate\"", "nam = \"behind the plate\""),
    ("fields = \"first_last\"", "fields = \"all\""),
];

fn changed(changes: &[(&str, &str)]) -> String {
    let mut text =
        fs::read_to_string(repository("configs/shield_quick.toml")).expect("a shipped configuration");
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    text
}

fn report(text: &str) -> DiagnosticReport {
    match Config::from_str(text, "device.toml") {
        Err(ConfigError::Invalid(report)) => *report,
        other => panic!("{other:?}"),
    }
}

#[test]
fn twenty_faults_are_shown_and_the_rest_is_counted() {
    let found = report(&changed(CHANGES));
    assert_eq!(found.diagnostics.len(), CHANGES.len(), "{found}\none for each change");
    let shown = render(&found, Style::Plain);
    assert_eq!(shown.matches("error: ").count(), 20);
    assert!(shown.ends_with("24 faults in the configuration `device.toml`, 4 of them not shown"), "{shown}");
    // In the order of the text.
    assert!(found.diagnostics.is_sorted_by_key(|fault| fault.span.range.start));
}

#[test]
fn every_change_alone_is_one_fault() {
    for change in CHANGES {
        let found = report(&changed(std::slice::from_ref(change)));
        assert_eq!(found.diagnostics.len(), 1, "{change:?}\n{found}");
    }
}

#[test]
fn colours_change_nothing_but_colours() {
    let found = report(&changed(&CHANGES[..3]));
    let (plain, coloured) = (render(&found, Style::Plain), render(&found, Style::Coloured));
    assert!(!plain.contains('\u{1b}') && coloured.contains('\u{1b}'));
    let mut bare = String::new();
    let mut rest = coloured.as_str();
    while let Some(start) = rest.find('\u{1b}') {
        bare += &rest[..start];
        let end = rest[start..].find('m').expect("a sequence ends") + 1;
        rest = &rest[start + end..];
    }
    bare += rest;
    let trimmed = |text: &str| text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n");
    assert_eq!(trimmed(&bare), trimmed(&plain));
}

#[test]
fn no_color_and_no_terminal_leave_colours_out() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let config = folder.path().join("device.toml");
    fs::write(&config, changed(&CHANGES[..3])).expect("written");
    let said = |no_color: bool| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_fluxmorph"));
        command.arg("check").arg(&config).env_remove("NO_COLOR");
        if no_color {
            command.env("NO_COLOR", "1");
        }
        String::from_utf8(command.output().expect("the binary starts").stderr).expect("UTF-8")
    };
    assert!(!said(true).contains('\u{1b}'));
    assert_eq!(said(true), said(false));
}

#[test]
fn a_long_line_is_cut_around_the_place() {
    let list = |broken: &str| {
        let values = [vec!["\"1.0 mm\""; 250], vec![broken], vec!["\"1.0 mm\""; 250]].concat().join(", ");
        changed(&[("upper = \"20 mm\"", &format!("initial = [{values}]\nupper = \"20 mm\""))])
    };
    let shown = render(&report(&list("\"10 Hz\"")), Style::Plain);
    let longest = shown.lines().map(|line| line.chars().count()).max().unwrap_or(0);
    assert!(longest <= 160, "{longest}\n{shown}");
    assert!(shown.contains("\"10 Hz\"") && shown.contains("^^^^^^^ expected a length"), "{shown}");
    // A place that is longer than a line shows its start.
    let broken = changed(&[("grid = [7, 13]", &format!("grid = [{}]", vec!["7"; 2500].join(", ")))]);
    let shown = render(&report(&broken), Style::Plain);
    let longest = shown.lines().map(|line| line.chars().count()).max().unwrap_or(0);
    assert!(longest <= 300, "{longest}\n{shown}");
    assert!(shown.contains("has 2500 items"), "{shown}");
}
