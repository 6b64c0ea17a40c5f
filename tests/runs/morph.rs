//! `fluxmorph morph`: one motion, sweeps, laws, and the tuner.

use std::path::Path;

use fluxmorph_geometry::io::read_vtu;
use serde_json::Value;

use crate::support::device::MOTION as BLOCK;
use crate::support::folder::{count, files_below, number, read_json, read_text, scalars, vectors};
use crate::support::program::{Finished, command, finish, fluxmorph, fluxmorph_in, folder};
use crate::support::repository;

/// Pressed in by three quarters of the height: no linear map survives that.
fn pressed(law: &str) -> String {
    BLOCK.replace("\"5 mm\"", "\"-30 mm\"").replace("free =", &format!("law = \"{law}\"\nfree ="))
}

fn morph(home: &Path, text: &str, further: &[&str]) -> Finished {
    let config = home.join("block.toml");
    std::fs::write(&config, text).expect("written");
    finish(command(&[&"morph", &config, &"--out", &home.join("out")]).args(further))
}

#[test]
fn one_motion_leaves_both_meshes_and_a_result() {
    let home = folder();
    let finished = morph(home.path(), BLOCK, &["--json"]).exits_with(0);
    let out = home.path().join("out");
    let files = "after.vtu before.vtu config.toml manifest.json morph.csv resolved.toml result.json";
    assert_eq!(files_below(&out).join(" "), files);
    let result = read_json(&out.join("result.json"));
    assert_eq!(finished.json()["cases"], result["cases"]);
    assert_eq!((&result["command"], &result["status"]), (&"morph".into(), &"done".into()));
    let case = &result["cases"][0];
    assert_eq!(
        (count(case, "/tets"), count(case, "/moved_nodes"), count(case, "/newton_steps")),
        (384, 1, 0)
    );
    // Interior nodes of 3 × 3 × 4, top free, without the node that is moved.
    assert_eq!(count(case, "/equations"), 3 * (36 - 1));
    assert_eq!(case["valid"], true);
    let before = read_vtu(&out.join("before.vtu")).expect("a VTU file");
    let after = read_vtu(&out.join("after.vtu")).expect("a VTU file");
    let moved = vectors(&after.point_data["displacement"]);
    for ((x, y), u) in before.points.iter().zip(&after.points).zip(moved) {
        // The points were computed with the same sums.
        assert_eq!(std::array::from_fn::<f64, 3, _>(|d| x[d] + u[d]), *y);
    }
    let top = before.points.iter().position(|p| *p == [0.02, 0.02, 0.04]).expect("a node of the block");
    assert_eq!(moved[top], [0.0, 0.0, 0.005]);
    let worst = scalars(&after.cell_data["quality"]).iter().copied().fold(f64::INFINITY, f64::min);
    assert_eq!(worst, number(case, "/after/worst"));
    assert_eq!(worst, scalars(&after.cell_data["quality"])[count(case, "/worst_element/element") as usize]);
    let table = morph(home.path(), BLOCK, &["--force"]).exits_with(0).stdout;
    assert!(table.contains("elastic body") && table.contains("lifted"), "{table}");
    morph(home.path(), BLOCK, &[]).with(5, &["--force"]);
}

#[test]
fn a_motion_that_breaks_the_mesh_is_a_result_or_goes_by_another_law() {
    let home = folder();
    let run = |law: &str, code: i32| -> Value {
        let finished = morph(home.path(), &pressed(law), &["--json", "--force"]).exits_with(code);
        finished.json()["cases"][0].clone()
    };
    let once = run("linear", 4);
    let ended = |file: &str| read_json(&home.path().join("out").join(file))["status"].clone();
    assert_eq!((ended("result.json"), ended("manifest.json")), ("failed".into(), "failed".into()));
    assert!(number(&once, "/after/worst") < 0.0 && count(&once, "/inverted") > 0 && once["valid"] == false);
    let step = number(&once, "/inversion/step");
    assert!(step > 0.0 && step < 1.0, "{step}");
    // The inverted mesh can be looked at.
    let after = read_vtu(&home.path().join("out/after.vtu")).expect("a VTU file");
    assert!(scalars(&after.cell_data["quality"]).iter().any(|&q| q < 0.0));

    let own = run("hyperelastic", 0);
    assert!(count(&own, "/newton_steps") > 1 && count(&own, "/inverted") == 0, "{own}");
    assert!(number(&own, "/after/worst") > 0.0 && number(&own, "/reached") == 1.0);
}

#[test]
fn a_motion_that_stops_short_on_a_valid_mesh_has_stopped_and_not_failed() {
    let home = folder();
    let stopped = |text: &str| {
        let result = morph(home.path(), text, &["--json", "--force"]).exits_with(1).json();
        assert_eq!((&result["status"], &result["stop_reason"]), (&"stopped".into(), &"mesh_limited".into()));
        result["cases"][0].clone()
    };
    // Through the bottom.
    let case = stopped(&pressed("rails").replace("\"-30 mm\"", "\"-45 mm\""));
    let reached = number(&case, "/reached");
    assert!((0.5..40.0 / 45.0).contains(&reached) && count(&case, "/inverted") == 0, "{case}");
    assert!(case["valid"] == false, "{case}");
    // What is worse than asked for is a result, and not valid.
    let least = "[morph]\nleast_quality = 0.3\n[[morph.motion]]";
    let case = stopped(&BLOCK.replace("\"5 mm\"", "\"-12 mm\"").replace("[[morph.motion]]", least));
    assert!(number(&case, "/after/worst") < 0.3 && number(&case, "/reached") == 1.0);
}

/// Beyond what is carried the nodes come to rest in tangles, which those of shorter motions must not be found from.
#[test]
fn a_hyperelastic_motion_goes_as_far_wherever_it_is_to_end() {
    let home = folder();
    fluxmorph_in(home.path(), &["init", "gmsh"]).exits_with(0);
    let reached = [6.0, 8.0, 12.0].map(|end| {
        let upper = format!("design.upper=\"{end} mm\"");
        let keys = ["remesh.law=hyperelastic", &upper, "morph.motion=[{ design = \"upper\" }]"];
        let overrides = keys.iter().flat_map(|key| ["--set", *key]);
        let arguments = ["morph", "gmsh.toml", "--json", "--force"].into_iter().chain(overrides);
        let finished = fluxmorph_in(home.path(), &arguments.collect::<Vec<_>>()).exits_with(1);
        end * number(&finished.json()["cases"][0], "/reached")
    });
    // A share is found by seven halves.
    for (own, end) in reached.into_iter().zip([6.0, 8.0, 12.0]) {
        assert!(own > 5.0 && (own - reached[0]).abs() < end / 64.0, "{reached:?}");
    }
}

#[test]
fn keys_of_earlier_versions_are_passed_over_and_said() {
    let home = folder();
    let text = BLOCK.replace("free =", "rounds = 3\nfree =");
    let text = text.replace("[[morph.motion]]", "[morph]\nincrements = \"auto\"\n[[morph.motion]]");
    let finished = morph(home.path(), &text, &[]).exits_with(0);
    for key in ["remesh.rounds", "morph.increments"] {
        let said = format!("`{key}` is of an earlier version, and has no effect");
        assert!(finished.stderr.contains(&said), "{}", finished.stderr);
    }
}

#[test]
fn an_older_run_outlives_a_set_up_that_fails() {
    let home = folder();
    morph(home.path(), BLOCK, &[]).exits_with(0);
    let result = home.path().join("out/result.json");
    let before = std::fs::read(&result).expect("written");
    // Known only to the elastic body, and only in the last case.
    let cases = "[[morph.case]]\nname = \"as it is\"\n[[morph.case]]\nname = \"far\"\n\
                 remesh.box = [[0, 0, 0], [\"10 mm\", \"10 mm\", \"10 mm\"]]\n";
    let whole = "box = [[0, 0, 0], [\"40 mm\", \"40 mm\", \"40 mm\"]]";
    let text = BLOCK.replace("region = \"block\"\nfree = [\"z_max\"]", whole) + cases;
    morph(home.path(), &text, &["--force"]).with(3, &["is not in the remesh region"]);
    assert_eq!(std::fs::read(&result).expect("still there"), before);
}

#[test]
fn a_sweep_is_one_table_with_published_values_beside() {
    let home = folder();
    let cases = "[[morph.case]]\nname = \"soft, uniform\"\nremesh = { poisson = 0.1, stiffness = \"uniform\" }\n\
                 paper = { worst_quality = 0.25, poor = 7 }\n\
                 [[morph.case]]\nname = \"fine\"\nmesh.block.cells = [8, 8, 8]\n\
                 [[morph.case]]\nname = \"broken\"\n\
                 motion = [{ nodes = [[0.02, 0.02, 0.04]], displacement = [0, 0, \"-30 mm\"] }]\n";
    let text = format!("{BLOCK}{cases}");
    let finished = morph(home.path(), &text, &[]).with(1, &["(3 of 3)"]);
    for fragment in ["(0.2500)", "(7)", "fine", "broken: ", "inverted elements"] {
        assert!(finished.stdout.contains(fragment), "{}", finished.stdout);
    }
    let out = home.path().join("out");
    let result = read_json(&out.join("result.json"));
    assert_eq!((&result["status"], &result["stop_reason"]), (&"stopped".into(), &"mesh_limited".into()));
    assert_eq!(count(&result, "/cases/1/tets"), 3072);
    assert_eq!(count(&result, "/cases/0/paper/poor"), 7);
    let csv = std::fs::read_to_string(out.join("morph.csv")).expect("read");
    assert_eq!(csv.lines().count(), 4);
    assert!(csv.lines().next().is_some_and(|header| header.ends_with(",paper_equations,error")), "{csv}");
    assert!(
        csv.lines().nth(1).is_some_and(|row| row.starts_with("\"soft, uniform\",true,105,384,")),
        "{csv}"
    );
    for case in 1..=3 {
        assert!(out.join(format!("case_{case:02}_after.vtu")).exists());
    }
    // A later single motion removes the files of the sweep.
    morph(home.path(), BLOCK, &["--force"]).exits_with(0);
    assert!(!out.join("case_01_after.vtu").exists() && out.join("after.vtu").exists());
}

#[test]
fn resolved_configurations_repeat_the_motion_bit_for_bit_on_any_number_of_threads() {
    let home = folder();
    morph(home.path(), &pressed("hyperelastic"), &["--threads", "1"]).exits_with(0);
    let first = std::fs::read(home.path().join("out/after.vtu")).expect("read");
    let resolved = read_text(&home.path().join("out/resolved.toml"));
    morph(home.path(), &resolved, &["--threads", "3", "--force"]).exits_with(0);
    assert_eq!(std::fs::read(home.path().join("out/after.vtu")).expect("read"), first);
}

#[test]
fn the_tuner_writes_a_configuration_that_repeats_what_it_found() {
    let home = folder();
    let text = BLOCK
        .replace("\"5 mm\"", "\"20 mm\"")
        .replace("region = \"block\"", "region = \"block\"\npoisson = 0.4")
        + "[morph.tune]\nparameters = [\"poisson\", \"force\"]\nevaluations = 25\n";
    let tuned = morph(home.path(), &text, &["--tune", "--json"]).exits_with(0).json();
    let [was, found] = [0, 1].map(|k| number(&tuned, &format!("/tuned/worst_quality/{k}")));
    // A force along the motion lets the whole body follow: far better than rounding or luck.
    assert!(found > was + 0.05, "{was} {found}");
    assert_eq!(number(&tuned, "/cases/0/after/worst"), found);
    assert!(count(&tuned, "/tuned/evaluations") <= 4 * 26 + 1);
    let path = home.path().join("out/tuned.toml");
    let again = fluxmorph(&[&"morph", &"--json", &path]).exits_with(0).json();
    assert_eq!(number(&again, "/cases/0/after/worst"), found);
    assert!(home.path().join("out/tuned/after.vtu").exists(), "beside it, within its folder");
    let hyperelastic = text.replace("poisson = 0.4", "law = \"hyperelastic\"");
    morph(home.path(), &hyperelastic, &["--tune", "--force"]).with(3, &["`remesh.law`", "\"linear\""]);
}

#[test]
fn the_tuner_softens_the_region_away_from_the_motion() {
    let home = folder();
    let mut tuner =
        command(&[&"morph", &"--tune", &"--json", &"--force", &"--out", &home.path().join("out")]);
    tuner.arg(repository("configs/block_table2.toml"));
    // Of one region the modulus changes nothing.
    let young = format!("{BLOCK}[morph.tune]\nparameters = [\"young\"]\n");
    morph(home.path(), &young, &["--tune"]).with(0, &["no parameter to search", "\"poisson\""]);
    let regions = "remesh.region=[\"inner\", \"outer\"]";
    for change in [regions, "remesh.free=[\"z_max\", \"inner|outer\"]", "morph.tune.evaluations=15"] {
        tuner.args(["--set", change]);
    }
    let found = finish(&mut tuner).with(0, &["the cases are left out"]).json();
    // The row "middle" of Table 2; the paper's elected parameters make 1.8 times its worst quality.
    assert!((number(&found, "/tuned/worst_quality/0") - 0.0527).abs() < 1e-4);
    assert!(number(&found, "/tuned/worst_quality/1") > 1.8 * 0.0527);
    let [inner, outer] = [0, 1].map(|k| number(&found, &format!("/tuned/regions/{k}/young/1")));
    assert!(outer < inner, "{inner} {outer}");
    assert_eq!(found["tuned"]["policies"].as_array().map(Vec::len), Some(4));
}

#[test]
fn check_lists_the_motions() {
    let home = folder();
    let config = home.path().join("block.toml");
    std::fs::write(&config, BLOCK).expect("written");
    let summary = fluxmorph(&[&"check", &config, &"--json"]).exits_with(0).json();
    assert_eq!((count(&summary, "/motions/0/equations"), count(&summary, "/motions/0/elements")), (105, 384));
    // Solving it all the same is refused: no surface has a condition.
    fluxmorph(&[&"solve", &config]).with(3, &["no surface has a condition"]);
}
