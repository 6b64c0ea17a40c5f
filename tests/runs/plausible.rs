//! What can be computed and cannot be meant, said at the end of a run, where a field is known. What `check` warns of before is in
//! `tests/config/warned`.

use std::path::Path;

use serde_json::Value;

use crate::support::device::written;
use crate::support::folder::{RunFolder, list, number};
use crate::support::program::{command, finish, folder};
use crate::support::shield::quick;

/// The quick shield with its plate meshed.
const MESHED: [&str; 2] = ["regions.plate.model=volume", "remesh.region=[\"plate\", \"remesh\"]"];

pub(super) fn set<'a>(overrides: &[&'a str]) -> Vec<&'a str> {
    overrides.iter().flat_map(|one| ["--set", *one]).collect()
}

pub(super) fn texts(warnings: &Value) -> String {
    let list = warnings.as_array().map(Vec::as_slice).unwrap_or_default();
    list.iter().filter_map(Value::as_str).collect::<Vec<_>>().join("\n")
}

/// The warnings in the result of `solve`, which standard error holds too.
fn solve(out: &Path, overrides: &[&str]) -> String {
    let arguments = ["--out", out.to_str().expect("UTF-8"), "--force"];
    let said =
        finish(command(&[&"solve", &quick()]).args(arguments).args(set(overrides))).exits_with(0).stderr;
    let warnings = texts(&RunFolder(out.to_owned()).result()["warnings"]);
    for line in warnings.lines() {
        assert!(said.contains(line), "{line}\nis missing in\n{said}");
    }
    warnings
}

#[test]
fn steel_beyond_saturation_is_named_with_its_place() {
    let home = folder();
    let out = home.path().join("out");
    let found = solve(
        &out,
        &[&MESHED[..], &["mesh.shield.skin=[\"0.4 mm\", \"1.2 mm\", \"2.5 mm\", \"5 mm\"]"]].concat(),
    );
    for part in ["iron beyond saturation: |B| in `plate` reaches", "T at 60 Hz, at (", "beyond 2 T"] {
        assert!(found.contains(part), "no `{part}` in: {found}");
    }
    // Of an impedance surface it is the field along it.
    let surface = solve(&out, &[]);
    assert!(surface.contains("iron beyond saturation: |B| in `plate` reaches"), "{surface}");
    assert!(!solve(&out, &["coils[0].ampere_turns=\"100 A\""]).contains("saturation"));
    // Copper has no polarisation, whatever its field.
    let copper = [&MESHED[..], &["materials.steel.relative_permeability=1"]].concat();
    assert!(!solve(&out, &copper).contains("saturation"));
}

#[test]
fn the_skin_of_a_result_is_audited_at_its_thinnest_place() {
    let home = folder();
    let found = solve(&home.path().join("out"), &["design.lower=-9 mm", "design.initial=-0.008"]);
    assert!(found.contains("region `plate` is 2.000 mm thick at its thinnest place"), "{found}");
}

#[test]
fn sides_without_condition_are_listed_with_their_areas() {
    let sides = "boundaries.flux_parallel=[\"x_min\", \"x_max\", \"y_min\", \"y_max\", \"z_max\"]";
    let arguments = ["--json", "--set", sides];
    let json = finish(command(&[&"check", &quick()]).args(arguments)).exits_with(0).json();
    let [side] = list(&json, "/open_sides") else { panic!("{}", json["open_sides"]) };
    // The lower side, 600 x 720 mm.
    assert!((number(side, "/area_m2") - 0.6 * 0.72).abs() < 1e-12, "{side}");
    let text = finish(command(&[&"check", &quick()]).args(["--set", sides])).exits_with(0).stdout;
    assert!(text.contains("no condition, field normal") && text.contains("4320.0000"), "{text}");
}

#[test]
fn the_resolved_configuration_of_a_run_is_not_warned_of() {
    let home = folder();
    let out = home.path().join("out");
    // A path that leads upwards is not in it.
    let upwards = home.path().join("out/../out");
    let out_text = upwards.to_str().expect("UTF-8");
    finish(command(&[&"solve", &quick()]).args(["--out", out_text])).exits_with(0);
    let checked = |more: &[&str]| {
        let mut checked = command(&[&"check", &out.join("resolved.toml"), &"--json"]);
        texts(&finish(checked.args(set(more))).exits_with(0).json()["warnings"])
    };
    // It has every default, which says nothing; another number does.
    assert!(!checked(&[]).contains("no effect"), "{}", checked(&[]));
    let others = checked(&["remesh.poisson=0.2", "remesh.motion=along_design"]);
    assert!(others.contains("remesh.poisson, remesh.motion have no effect"), "{others}");
}

#[test]
fn matter_that_a_design_brings_into_an_expansion_is_named() {
    let home = folder();
    let set =
        "multipoles=[{name=\"ball\", shape=\"ball\", center=[0, 0, \"12 mm\"], radius=\"6 mm\", order=2}]";
    let said = |initial: &str| {
        let initial = format!("design.initial={initial}");
        let mut solve = written("block", home.path(), &[]).command("solve", &home.path().join("out"));
        finish(solve.args(["--force", "--set", set, "--set", &initial])).exits_with(0).stderr
    };
    let warning =
        "the ball of the expansion `ball` holds a material with another permeability than air, at (";
    assert!(said("4 mm").contains(warning), "{}", said("4 mm"));
    assert!(!said("1 mm").contains(warning));
}
