//! Error bars, confirmations and finer meshes, as a user sees them.

use std::path::Path;

use serde_json::Value;

use crate::coils::COILS;
use crate::support::device::{BLOCK, Device, shipped, written};
use crate::support::essence::{assert_same, essence};
use crate::support::folder::{RunFolder, count, files, number, read_json, read_text, scalars};
use crate::support::program::{Finished, command, finish, fluxmorph, folder};
use crate::support::{changed, repository};

/// The block on edge elements.
const EDGES: (&str, &str) = ("frequency = \"50 Hz\"", "frequency = \"50 Hz\"\nelements = \"edge\"");

fn pole(sets: &[&str], out: &Path) -> Finished {
    let device = sets.iter().fold(shipped("pole", &[]), |device, set| device.with(set));
    finish(&mut device.command("run", out))
}

/// Nodal elements have the field of an iron circuit wrong on coarse meshes, and the optimiser uses what they have wrong.
#[test]
fn a_gain_of_the_mesh_is_not_confirmed_and_one_of_the_shape_is() {
    let home = folder();
    let nodal = home.path().join("nodal");
    pole(&["analysis.elements=nodal", "analysis.order=2", "mesh.boxes.refinement=0.5"], &nodal)
        .says(&["NOT CONFIRMED", "the gain of this run is not confirmed"]);
    let result = read_json(&nodal.join("result.json"));
    assert_eq!(result["accuracy"]["verdict"], "not_confirmed");
    assert_eq!(result["accuracy"]["cross_check"]["elements"], "edge");
    assert_eq!(result["accuracy"]["cross_check"]["by_estimate"], false);
    let edge = home.path().join("edge");
    pole(&["analysis.elements=edge", "analysis.order=1", "mesh.boxes.refinement=0.75"], &edge).says(&[
        "error bar of F/F0",
        "(edge, order 2, by the estimate)",
        "confirmed: the gain is the shape's",
    ]);
    let result = read_json(&edge.join("result.json"));
    assert_eq!(result["accuracy"]["verdict"], "confirmed");
    let (ratio, fresh) = (number(&result, "/objective/ratio"), number(&result, "/objective/verified_ratio"));
    let bar = 2.0 * ratio * number(&result, "/accuracy/error_estimate_relative");
    println!("F/F0 {ratio:.4} ± {bar:.4}, on a fresh mesh {fresh:.4}");
    assert!((fresh - ratio).abs() < bar, "{fresh} is not within {ratio} ± {bar}");
    let page = std::fs::read_to_string(edge.join("report.html")).expect("a report");
    assert!(page.contains("confirmed") && page.contains('±'), "the card of the gain");

    // The best design of that run again, on halved edges.
    let out = home.path().join("finer");
    let path = edge.join("result.json");
    let always = "accuracy.estimate=true";
    fluxmorph(&[&"solve", &path, &"--refine", &"1", &"--set", &always, &"--out", &out]).completed();
    let finer = read_json(&out.join("result.json"));
    assert_eq!(count(&finer, "/mesh/tets"), 8 * count(&result, "/mesh/tets"));
    assert!(out.join("optimum_refined.msh").exists());
    assert_eq!(finer["design"], result["design"]);
    let [value, error] = ["/objective/best", "/accuracy/error_estimate/0"].map(|key| number(&finer, key));
    let [coarse, estimated] =
        ["/objective/best", "/accuracy/error_estimate/1"].map(|key| number(&result, key));
    println!(
        "{coarse:.4e} {estimated:+.1e} on the mesh of the run, {value:.4e} {error:+.1e} on halved edges"
    );
    // Both say the same of the truth, within what the coarser one leaves open.
    assert!((value + error - coarse - estimated).abs() < estimated.abs(), "{value} {coarse}");
}

/// A mass has no error of the field, its constraint has: what the fresh mesh divides is what that observes.
#[test]
fn the_field_of_a_lightest_device_is_what_is_checked() {
    let home = folder();
    let out = home.path().join("out");
    let said = finish(&mut shipped("shield_least_mass", &[]).command("run", &out)).completed().stderr;
    assert!(
        said.contains("(estimated), satisfied") && !said.contains("gain  ") && !said.contains("error bar of"),
        "{said}"
    );
    let result = read_json(&out.join("result.json"));
    let accuracy = result["accuracy"].as_object().expect("the walls are near");
    let said: Vec<&str> =
        accuracy.iter().filter(|(_, value)| !value.is_null()).map(|(key, _)| key.as_str()).collect();
    assert_eq!(said, ["refinements", "near_wall"]);
    assert!(result["constraints"][0]["error_estimate"].is_number());
    let [found, limited] = ["shield_least_mass", "shield_mass_limit"].map(|name| {
        let out = home.path().join(name);
        finish(&mut shipped(name, &["--max-evaluations", "2"]).command("run", &out));
        read_json(&out.join("result.json"))["objective"]["verification"].clone()
    });
    assert_eq!((&found["mesh"], &found["tets"]), (&"fresh".into(), &limited["tets"]));
}

#[test]
fn a_mesh_from_a_file_is_checked_on_finer_elements() {
    let home = folder();
    let out = home.path().join("out");
    let limit = "constraints=[{kind='energy', upper_ratio=1.5, name='energy'}, {kind='volume', region='core', upper_ratio=1}]";
    let options = ["--max-evaluations", "2", "--set", "analysis.order=1", "--set", limit];
    finish(&mut shipped("inductor", &options).command("run", &out)).with(
        1,
        &["checking the best shape on finer elements", "F/F0 on cut elements", "is curved, and its facets"],
    );
    let result = read_json(&out.join("result.json"));
    assert!(count(&result, "/objective/verification/tets") > 3 * count(&result, "/mesh/tets") / 2);
    assert!(result["accuracy"]["verdict"].is_string());
    assert_eq!(result["objective"]["verification"]["mesh"], "cut");
    // A constraint on the field has an error bar, and is measured on the finer elements with a bound from there.
    let [coarse, finer] = ["/constraints/0", "/objective/verification/constraints/0"].map(|key| {
        let own = result.pointer(key).unwrap_or_else(|| panic!("{key} in {result}"));
        assert_eq!(own["name"], "energy");
        [number(own, "/value"), number(own, "/bound")]
    });
    println!("energy {coarse:?}, on finer elements {finer:?}");
    assert!((0..2).all(|k| coarse[k] != finer[k] && (finer[k] / coarse[k] - 1.0).abs() < 0.1));
    assert!(result["constraints"][0]["error_estimate"].is_number());
    assert!(result["constraints"][1]["error_estimate"].is_null(), "a volume has none");
    let on_finer = result["objective"]["verification"]["constraints"].as_array();
    assert_eq!(on_finer.map(Vec::len), Some(1), "the volume is that of the run's mesh");
    // The best design on halved edges, its bound from the initial one there.
    let (halved, best) = (home.path().join("halved"), out.join("result.json"));
    let no_estimate = "accuracy.estimate=false";
    fluxmorph(&[&"solve", &best, &"--refine", &"1", &"--set", &no_estimate, &"--out", &halved]).completed();
    let halved = read_json(&halved.join("result.json"));
    let of_halved = ["/constraints/0/value", "/constraints/0/bound"].map(|key| number(&halved, key));
    assert!((0..2).all(|k| (of_halved[k] / finer[k] - 1.0).abs() < 0.1), "{of_halved:?}");
    assert!((of_halved[1] / of_halved[0] - finer[1] / finer[0]).abs() < 0.01 * finer[1] / finer[0]);
    // A round core and a round coil, of which no refinement of the mesh knows.
    let facets = &result["accuracy"]["facets"];
    println!("{facets}");
    assert!(number(facets, "/off_m") > 1e-5 && number(facets, "/off_m") < 1e-2, "{facets}");
    // The ring of the winding is larger than its polygon, and so is the energy in it.
    let change = ["/change/0", "/change/1"].map(|key| number(facets, key));
    let energy = ["/objective/initial", "/objective/best"].map(|key| number(&result, key));
    assert!(
        (0..2).all(|k| change[k] > 1e-3 * energy[k] && change[k] < 1e-2 * energy[k]),
        "{change:?} {energy:?}"
    );
}

/// A sphere that is smaller than it is meant to be: its loss lacks more than the error bar has, and what its facets change is what is
/// lacking, but for a tenth.
#[test]
fn what_facets_change_is_what_a_closed_form_has_more() {
    let home = folder();
    let out = home.path().join("out");
    let far = "mesh.sphere={radius=0.05, outer_radius=1.2, divisions=3, growth=1.35, \
               skin=[0.0034, 0.0084, 0.0154, 0.0225, 0.0295, 0.0366]}";
    let sets = [far, "objective={kind=\"loss\", region=\"sphere\"}", "accuracy.estimate=true"];
    let sphere = sets.iter().fold(shipped("sphere", &[]), |device, set| device.with(set));
    finish(&mut sphere.command("solve", &out))
        .says(&["on these in the mean, change the objective by about +3."]);
    let result = read_json(&out.join("result.json"));
    // An eighth of the loss in tests/reference/sphere.json.
    let missing = 23346.0 / 8.0 - number(&result, "/objective/best");
    let [error, change] =
        ["/accuracy/error_estimate/0", "/accuracy/facets/change/0"].map(|key| number(&result, key));
    println!("missing {missing:.2} W, error {error:.2} W, facets {change:.2} W");
    assert!(missing > 2.0 * error.abs());
    assert!((missing - error - change).abs() < 0.1 * missing);
    // Without an objective it is said of what is reported, with the wall that is near.
    let without =
        [far, "accuracy.estimate=true"].iter().fold(shipped("sphere", &[]), |device, set| device.with(set));
    finish(without.command("solve", &out).arg("--force")).says(&[
        "warning: `air|sphere` is curved",
        "B at the probe `centre` by about 5.",
        "most of what is reported",
    ]);
    let reported = number(&read_json(&out.join("result.json")), "/facets_change/losses_w/sphere");
    assert!((reported / change - 1.0).abs() < 1e-6, "{reported} {change}");
}

/// A tolerance that so many refinements do not keep: the run says so, and what would.
#[test]
fn a_tolerance_that_the_refinements_do_not_reach_is_said_to_be_missed() {
    let home = folder();
    let out = home.path().join("out");
    let tight = ("[analysis]", "[accuracy]\ntolerance = \"0.1 %\"\nmax_refinements = 1\n\n[analysis]");
    let device = written("block", home.path(), &[EDGES, tight]);
    finish(&mut device.command("run", &out))
        .says(&["all 1 refinements are used", "allow more accuracy.max_refinements"]);
    let result = read_json(&out.join("result.json"));
    assert_eq!(count(&result, "/accuracy/refinements"), 1);
    assert_eq!(result["accuracy"]["within_tolerance"], false);
    let page = std::fs::read_to_string(out.join("report.html")).expect("a report");
    assert!(page.contains("beyond the tolerance"));
    let again = finish(&mut command(&[&"solve", &out.join("result.json")])).exits_with(0).stderr;
    assert!(again.contains("the run of this design refined its mesh (refinements: 1)"), "{again}");
}

/// The time of a run is that of its refinements too: without any left, the initial design is evaluated on the mesh as it is.
#[test]
fn no_mesh_is_refined_when_the_time_is_over() {
    let home = folder();
    let out = home.path().join("out");
    let tight = ("[analysis]", "[accuracy]\ntolerance = \"0.1 %\"\n\n[analysis]");
    let device = written("block", home.path(), &[EDGES, tight]);
    finish(device.command("run", &out).args(["--max-time", "1e-9 s"]))
        .says(&["optimizer.max_time is over before"]);
    let result = read_json(&out.join("result.json"));
    assert_eq!((count(&result, "/evaluations"), &result["stop_reason"]), (1, &"max_time".into()));
}

/// A pole of coarse first-order elements, with a tolerance: what it reports of itself has to hold against second order.
#[test]
fn a_run_with_a_tolerance_refines_its_mesh_until_its_error_bar_is_within() {
    let home = folder();
    let out = home.path().join("out");
    let options = ["--set", "analysis.order=1", "--set", "accuracy.tolerance=0.05", "--max-evaluations", "4"];
    finish(&mut shipped("pole", &options).command("run", &out)).says(&[
        "the error bar of the initial design is",
        "refinement 1,",
        "tolerance",
    ]);
    let result = read_json(&out.join("result.json"));
    let refinements = count(&result, "/accuracy/refinements") as usize;
    assert!(refinements >= 1, "the mesh as shipped is too coarse");
    let [refining, total] =
        ["refinement", "total"].map(|part| number(&result, &format!("/timings_s/{part}")));
    assert!(0.0 < refining && refining < total, "{refining} {total}");
    assert_eq!(result["accuracy"]["within_tolerance"], true);
    assert!(out.join("optimum_refined.msh").exists() && !out.join("optimum.msh").exists());
    let levels = result["accuracy"]["levels"].as_array().expect("a list");
    assert_eq!(levels.len(), refinements);
    for level in levels {
        println!(
            "{} tetrahedra after {} evaluations: F {:.5e}, {:.2} % off",
            level["tets"],
            level["evaluations"],
            level["objective"].as_f64().expect("a number"),
            100.0 * level["error_estimate_relative"].as_f64().expect("a number"),
        );
    }
    let history = std::fs::read_to_string(out.join("history.csv")).expect("a history");
    let header = history.lines().next().expect("a header");
    let column = header.split(',').position(|name| name == "level").expect("a column");
    let last = history.lines().last().expect("a row").split(',').nth(column).expect("a cell");
    assert_eq!(last.parse::<usize>().expect("a number"), refinements);
    let page = std::fs::read_to_string(out.join("report.html")).expect("a report");
    assert!(page.contains("within the tolerance") && !page.contains("do not belong together"));
}

/// The block by a method that takes more than ten evaluations.
fn lengthy(home: &Path, accuracy: &str) -> Device {
    let accurate = format!("[accuracy]\n{accuracy}\n\n[analysis]");
    let slow = [("algorithm = \"mma\"", "algorithm = \"slsqp\""), ("ftol_rel = 0", "ftol_rel = 1e-9")];
    let longer = ("max_evaluations = 6", "max_evaluations = 16");
    written("block", home, &[EDGES, slow[0], slow[1], longer, ("[analysis]", &accurate)])
}

/// An estimate on the way changes nothing of the search.
#[test]
fn a_search_goes_on_after_an_estimate_as_one_without() {
    let home = folder();
    let history = |accuracy: &str| {
        let out = home.path().join("out");
        let device = lengthy(home.path(), accuracy);
        let said = finish(device.command("run", &out).arg("--force")).completed().stderr;
        (said, essence(&files(&out)).remove(Path::new("history.csv")).expect("a history"))
    };
    let (said, rows) = history("tolerance = 0.9");
    assert_eq!(said.matches("of the best design is").count(), 2, "on the way and at the end: {said}");
    assert_eq!(said.lines().filter(|line| line.starts_with("   3    3 ")).count(), 1, "{said}");
    assert!(rows.iter().filter(|byte| **byte == b'\n').count() > 12, "{said}");
    let (said, alone) = history("estimate = true");
    assert!(!said.contains("of the best design is"), "{said}");
    assert_eq!(String::from_utf8(rows), String::from_utf8(alone));
}

/// The mesh is refined where the gain of the search becomes the mesh's, and wherever a run was cut it is the same one.
#[test]
fn a_mesh_is_refined_during_a_search_wherever_the_run_was_interrupted() {
    let home = folder();
    let device = lengthy(home.path(), "tolerance = 0.065");
    let whole = home.path().join("whole");
    finish(&mut device.command("run", &whole));
    let refined = read_json(&whole.join("refinements.json"));
    assert_eq!(count(&refined, "/refinements/0/evaluations"), 10, "{refined}");
    let expected = essence(&files(&whole));
    for cut in ["9", "10", "11", "12"] {
        let out = home.path().join(cut);
        finish(device.command("run", &out).args(["--max-evaluations", cut]));
        // One without time for anything refines the mesh, or gets one evaluation further.
        finish(&mut command(&[&"resume", &out, &"--max-evaluations", &"13", &"--max-time", &"0.001 ms"]))
            .exits_with(1);
        finish(&mut command(&[&"resume", &out, &"--max-evaluations", &"16", &"--max-time", &"1 h"]));
        assert_same(&essence(&files(&out)), &expected, cut);
    }
}

/// One error, wherever it is asked for; the map of the field file adds up to it.
#[test]
fn check_and_solve_say_the_same_error_and_the_field_file_where_it_is() {
    let home = folder();
    let device = written("block", home.path(), &[]);
    let edges = ["--set", "analysis.elements=edge", "--set", "analysis.order=1"];
    let checked = finish(command(&[&"check", &device.config, &"--estimate", &"--json"]).args(edges));
    let checked = number(&checked.exits_with(0).json(), "/estimate/error_estimate");
    let out = home.path().join("out");
    finish(device.command("solve", &out).args(edges)).completed();
    let solved = RunFolder(out);
    assert_eq!(number(&solved.result(), "/accuracy/error_estimate/0"), checked);
    let sum: f64 = scalars(&solved.field(0).cell_data["error_estimate"]).iter().sum();
    // Beside what is quadratic in the correction.
    assert!((sum / checked - 1.0).abs() < 0.1, "{sum} {checked}");
}

/// A field recovered at places is that of second order in the estimate, as its potentials are: without, the error of the recovery
/// itself was missing, and the sign of the estimate with it.
#[test]
fn the_estimate_of_a_recovered_field_is_that_of_second_order() {
    let home = folder();
    let ball = "multipoles=[{name=\"ball\",shape=\"ball\",center=[0,0,\"5 mm\"],radius=\"4 mm\",order=2}]";
    let of_terms = |kind: &str| format!("kind = \"{kind}\"\nregion = \"ball\"\nharmonics = [\"c2_0\"]");
    let objective = "kind = \"flux_density_squared\"\nregion = \"observation\"\nweighting = \"volume\"";
    let in_space = |what: &str| format!("{what}\nfollow = \"space\"");
    let moves = &BLOCK[BLOCK.find("[design]").expect("a design")..BLOCK.find("[output]").expect("an output")];
    for (other, moves) in [
        (of_terms("multipole"), moves),
        (of_terms("multipole_content"), moves),
        (in_space(&of_terms("multipole")), ""),
        (in_space(objective), ""),
    ] {
        let device = written("block", home.path(), &[(objective, &other), (moves, "")]);
        let solve = |order: &str, estimate: &str| {
            let out = home.path().join("out");
            let sets = ["analysis.elements=edge", order, estimate, ball].map(|set| ["--set", set]);
            finish(device.command("solve", &out).arg("--force").args(sets.as_flattened())).completed();
            read_json(&out.join("result.json"))
        };
        let first = solve("analysis.order=1", "accuracy.estimate=true");
        let second = solve("analysis.order=2", "accuracy.estimate=false");
        let [before, after] = [&first, &second].map(|result| number(result, "/objective/best"));
        let estimate = number(&first, "/accuracy/error_estimate/0");
        println!("{other}: {before:e} {estimate:+e}, by second order {:+e}", after - before);
        assert!((estimate / (after - before) - 1.0).abs() < 0.01, "{estimate} {before} {after}");
    }
}

/// Losses, forces, flux linkages, expansions and probes have error bars that hold, of every state and without an objective, too:
/// against second order on halved edges, and of second order by these.
#[test]
fn what_a_result_reports_beside_an_objective_has_error_bars() {
    let home = folder();
    let (device, _) = COILS.split_once("[objective]").expect("what is optimised comes last");
    let frequencies = ("frequency = \"200 Hz\"", "frequencies = [\"200 Hz\", \"300 Hz\"]");
    // Cells as small as the ball asks for.
    let aperture = "[[mesh.boxes.regions]]\nname = \"aperture\"\n\
                    box = [[\"0 mm\", \"0 mm\", \"24 mm\"], [\"8 mm\", \"8 mm\", \"36 mm\"]]\n\
                    size = [\"4 mm\", \"4 mm\", \"4 mm\"]\n\n[[mesh.boxes.surfaces]]";
    let driven = ("ampere_turns = \"20 A\"", "voltage = \"0.1 V\"");
    let coarser = ("growth = 2", "growth = 2\nrefinement = 0.75");
    let device = changed(device, &[("[[mesh.boxes.surfaces]]", aperture), coarser, frequencies, driven]);
    let more = "[[probes]]\nname = \"axis\"\npoints = [[\"0 mm\", \"0 mm\", \"30 mm\"], [\"5 mm\", \"0 mm\", \"10 mm\"]]\n\n\
                [[forces]]\nname = \"plate\"\nregions = [\"plate\"]\n";
    let path = home.path().join("coils.toml");
    std::fs::write(&path, format!("{device}{more}")).expect("written");
    let checked = fluxmorph(&[&"check", &path]).completed().stdout;
    assert!(checked.contains("ball: ball of 6 mm at (0, 0, 30) mm, up to order 3"), "{checked}");
    let solved = |name: &str, options: &[&str]| {
        let out = home.path().join(name);
        let done = finish(command(&[&"solve", &path, &"--out", &out]).args(options)).completed();
        (read_json(&out.join("result.json")), done)
    };
    let second = |set: &'static str| ["--set", "analysis.order=2", "--set", set];
    let (first, said) = solved("first", &[]);
    let refined = [&second("accuracy.estimate=false")[..], &["--refine", "1"]].concat();
    let (halved, _) = solved("halved", &refined);
    let (on_the_mesh, _) = solved("second", &second("accuracy.estimate=true"));
    assert!(first["objective"].is_null() && halved["errors"].is_null(), "{first}");
    let accuracy = &first["accuracy"];
    assert!(accuracy["error_estimate_relative"].is_null() && accuracy["near_wall"].is_string(), "{accuracy}");
    assert!(accuracy.get("facets").is_none() && halved["accuracy"].is_null(), "{accuracy}");
    assert_eq!(first["errors"], first["states"][0]["errors"]);
    let parts = |key: &str, of: &[usize]| of.iter().map(|k| format!("{key}/{k}")).collect::<Vec<_>>();
    let probe = |k: usize| {
        let of = |part: &str| parts(&format!("/probes/0/{part}/{k}"), &[0, 1, 2]);
        [of("b_re_t"), of("b_im_t")].concat()
    };
    let cases = [
        ("losses_w/plate", vec!["/losses_w/plate".to_owned()]),
        ("currents_a/two", parts("/coils/1/current_a", &[0, 1])),
        ("flux_linkages_wb/one", parts("/coils/0/flux_linkage_wb", &[0, 1])),
        ("flux_linkages_wb/two", parts("/coils/1/flux_linkage_wb", &[0, 1])),
        ("forces/plate/force_n", parts("/forces/0/force_n", &[0, 1, 2])),
        ("forces/plate/torque_nm", parts("/forces/0/torque_nm", &[0, 1, 2])),
        ("multipoles_t/ball/c0_0", parts("/multipoles/1/terms/0/value_t", &[0, 1])),
        ("multipoles_t/ball/c1_0", parts("/multipoles/1/terms/1/value_t", &[0, 1])),
        ("probes_t/axis/0", probe(0)),
        ("probes_t/axis/1", probe(1)),
    ];
    for (state, (key, values)) in (0..2).flat_map(|state| cases.iter().map(move |case| (state, case))) {
        let number = |of: &Value, key: &str| number(&of["states"][state], key);
        let difference = |own: &Value| {
            let of = |key: &String| number(&halved, key) - number(own, key);
            values.iter().map(of).map(|part| part * part).sum::<f64>().sqrt()
        };
        let key = format!("/errors/{key}");
        let (estimated, error) = (number(&first, &key).abs(), difference(&first));
        println!("state {state}, {key}: {estimated:.2e} for {error:.2e}");
        assert!(error < 2.0 * estimated && estimated < 2.0 * error, "{key}: {estimated:e} for {error:e}");
        // The other mesh is the one that these errors are of, with a third of its change more.
        let (estimated, change) = (number(&on_the_mesh, &key).abs(), difference(&on_the_mesh));
        assert!((0.75 * estimated / change - 1.0).abs() < 1e-4, "{key}: {estimated:e} for {change:e}");
    }
    said.says(&[
        "W in plate at 200 Hz ± ",
        "N on plate at 300 Hz ± ",
        "Wb ± ",
        "± mT",
        "e-4 T (10000.00 units)",
    ]);
}

/// A copper plate with sharp edges behind an impedance surface; the one of steel has hardly more than its surface.
#[test]
fn a_conductor_that_has_more_loss_than_its_surface_is_named() {
    let home = folder();
    let said = |name: &str, sets: &[&str]| {
        let device = sets.iter().fold(shipped("shield_quick", &[]), |device, set| device.with(set));
        finish(&mut device.command("solve", &home.path().join(name))).completed().stderr
    };
    let of_copper = ["materials.steel.relative_permeability=1", "materials.steel.conductivity=5.8e7"];
    let forces = "forces=[{name=\"plate\",regions=[\"plate\"]}]";
    let copper = said("copper", &[&of_copper[..], &[forces]].concat());
    for words in [
        "% more loss at 60 Hz than its impedance surface, mostly at its sharp edges",
        "force and torque on it are off too",
    ] {
        assert!(copper.contains(words), "{words}: {copper}");
    }
    assert!(!said("steel", &[]).contains("its impedance surface"));
}

/// Of copper, whose loss is what is optimised and bounded.
#[test]
fn what_impedance_surfaces_leave_out_is_said_of_objectives_and_bounds() {
    let home = folder();
    let changes = [
        ("relative_permeability = 800", "relative_permeability = 1"),
        ("conductivity = \"7e6 S/m\"", "conductivity = \"5.8e7 S/m\""),
        (
            "kind = \"flux_density_squared\"\nregion = \"observation\"\nweighting = \"point\"",
            "kind = \"loss\"\nregion = \"plate\"",
        ),
        ("[design]", "[[constraints]]\nkind = \"loss\"\nregion = \"plate\"\nupper = \"430 W\"\n\n[design]"),
    ];
    let config = home.path().join("plate.toml");
    let text = read_text(&repository("configs/shield_quick.toml"));
    std::fs::write(&config, changed(&text, &changes)).expect("written");
    let of = |name: &str, more: &[&str]| {
        let out = home.path().join(name);
        let ended = finish(command(&[&name, &config, &"--out", &out]).args(more));
        (ended, out)
    };
    let (ended, out) = of("solve", &[]);
    ended
        .completed()
        .says(&["the constraint `loss_plate` keeps its bound by the loss of impedance surfaces", "% beyond"])
        .says(&["left out", "the field along them changes; no error bar counts it"]);
    let solved = read_json(&out.join("result.json"));
    let share = number(&solved, "/accuracy/excess/0") / number(&solved, "/objective/initial");
    let warned = format!("`plate` has about {:.1} % more loss", 100.0 * share);
    let warnings = solved["warnings"].to_string();
    assert!(warnings.contains(&warned) && warnings.contains("keeps its bound"), "{warned}: {warnings}");

    // All losses are the plate's: a quality factor of X/R has as much less as its R has more.
    let of_loss = "kind = \"loss\"\nregion = \"plate\"\n\n[[con";
    let turns = ("corner = \"mitred\"", "corner = \"mitred\"\nturns = 1");
    let quality = (of_loss, "kind = \"quality_factor\"\ncoils = [\"coil\"]\n\n[[con");
    let written = read_text(&config);
    std::fs::write(&config, changed(&written, &[turns, quality])).expect("written");
    let (ended, out) = of("solve", &["--force"]);
    ended.completed();
    let result = read_json(&out.join("result.json"));
    let of_quality = number(&result, "/accuracy/excess/0") / number(&result, "/objective/initial");
    assert!((of_quality * (1.0 + share) / -share - 1.0).abs() < 1e-9, "{of_quality} beside {share}");
    std::fs::write(&config, written).expect("written");

    // The error bar of either design is 12 %.
    let search =
        ["--set", "optimizer.algorithm=slsqp", "--set", "accuracy.tolerance=0.2", "--max-evaluations", "3"];
    let (ended, out) = of("run", &search);
    ended.says(&[
        "changes the objective by about +11.25 % at the initial",
        "and F/F0 from",
        "% and what impedance surfaces leave out 11.253 % for the initial design",
        "no refinement takes that away, but meshing the regions that are surfaces",
    ]);
    let run = read_json(&out.join("result.json"));
    assert_eq!(run["accuracy"]["excess"][0], solved["accuracy"]["excess"][0]);
    assert_eq!(run["accuracy"]["within_tolerance"], false);
    let [first, last] = [0, 1].map(|k| number(&run, &format!("/accuracy/excess/{k}")));
    let [initial, best] = ["/objective/initial", "/objective/best"].map(|key| number(&run, key));
    println!("of {initial:.2} and {best:.2} W: {first:.3} and {last:.3}");
    assert!(best < initial && first != last, "of {initial} and {best} W {first} and {last}");
    let page = read_text(&out.join("report.html"));
    assert!(page.contains("with what impedance surfaces leave out of losses"), "the card of the gain");
}
