//! Colours, lines too long to be shown, faults found later, and that nothing is written for a wrong input.

use fluxmorph::config::{Config, ConfigError, DiagnosticReport};
use fluxmorph::diagnostics::{Style, render};

use crate::case::read;
use crate::program::{assert_holds, limited};
use crate::support::program::folder;
use crate::support::repository_text;

/// The quick configuration with three faults.
fn three_faults() -> String {
    repository_text("configs/shield_quick.toml")
        .replace("\"60 Hz\"", "\"60 mm\"")
        .replace("axis = \"z\"", "axis = \"w\"")
        .replace("stiffness = \"inverse_size\"", "stiffness = \"inverse_sighs\"")
}

pub(crate) fn report(text: &str) -> DiagnosticReport {
    match Config::from_str(text, "device.toml") {
        Err(ConfigError::Invalid(report)) => *report,
        other => panic!("{other:?}\n{text}"),
    }
}

#[test]
fn colours_change_nothing_but_colours() {
    let found = report(&three_faults());
    let (plain, coloured) = (render(&found, Style::Plain), render(&found, Style::Coloured));
    assert!(!plain.contains('\u{1b}') && coloured.contains('\u{1b}'));
    let bare: String = coloured
        .split('\u{1b}')
        .enumerate()
        .map(|(at, part)| if at == 0 { part } else { part.split_once('m').expect("a sequence ends").1 })
        .collect();
    let trimmed = |text: &str| text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n");
    assert_eq!(trimmed(&bare), trimmed(&plain));
}

#[test]
fn a_long_line_is_cut_around_the_place() {
    let quick = repository_text("configs/shield_quick.toml");
    let shown = |from: &str, to: &str| render(&report(&quick.replacen(from, to, 1)), Style::Plain);
    let longest = |text: &str| text.lines().map(|line| line.chars().count()).max().unwrap_or(0);
    let lengths = "\"1.0 mm\", ".repeat(250);
    let list = format!("initial = [{lengths}\"10 Hz\", {lengths}]\nupper = \"20 mm\"");
    let text = shown("upper = \"20 mm\"", &list);
    assert!(longest(&text) <= 160, "{text}");
    assert!(text.contains("\"10 Hz\"") && text.contains("^^^^^^^ expected a length"), "{text}");
    // A place that is longer than a line shows its start.
    let text = shown("grid = [7, 13]", &format!("grid = [{}7]", "7, ".repeat(2499)));
    assert!(longest(&text) <= 300, "{text}");
    assert!(text.contains("has 2500 items"), "{text}");
}

#[test]
fn a_later_fault_points_at_its_key() {
    let small = repository_text("fuzz/seeds/config/small.toml");
    let (_, source) = Config::from_str(&small, "small.toml").expect("sound");
    let faults = vec![
        source.unknown_name("design.surface", "surface", "plate_bottom", &["plate_botom", "plate_top"]),
        source
            .diagnostic("boundaries.flux_parallel[1]", "`y_min` is not planar")
            .expected("a planar surface"),
        source.diagnostic("output.directory", "a default has no place of its own"),
    ];
    assert!(source.check(vec![]).is_ok());
    let text = source.check(faults).expect_err("three faults").to_string();
    for part in [
        "small.toml:26:11",
        "did you mean `plate_botom`?",
        "known: plate_botom, plate_top",
        "small.toml:22:27",
        "^^^^^^^ a planar surface",
        "a default has no place of its own",
        "3 faults in the configuration `small.toml`",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
}

#[test]
fn nothing_is_written_for_a_wrong_input() {
    // One of each kind: no TOML, a wrong value, a name that the mesh does not have.
    let places = read("wrong/names_and_places");
    let of = |group: &str| read(&format!("wrong/{group}")).swap_remove(0);
    let cases = [of("syntax"), of("design"), places[0].clone()];
    for (case, command) in cases.iter().flat_map(|case| ["run", "solve", "gradient"].map(|c| (case, c))) {
        let home = folder();
        case.write(home.path());
        let ended = limited(home.path(), None, &[command, "device.toml", "--out", "out"]);
        ended.refuses(3, &[&case.expected[0]]);
        assert_holds(home.path(), &["device.toml"]);
    }
}
