//! `solve`, `check` and `gradient`, and what goes to standard output.

use std::path::Path;

use super::plausible::{set, texts};
use crate::support::folder::{
    RunFolder, count, files_below, list, named, number, numbers, read_text, vectors,
};
use crate::support::program::{command, finish, fluxmorph, folder};
use crate::support::shield::{Model, height, on_quick, plate_bottom, quick};
use crate::support::{changed, repository};

/// A design as a file that `--design` takes.
fn design_file(home: &Path, design: &[f64]) -> String {
    let file = home.join("design.json");
    std::fs::write(&file, serde_json::to_string(design).expect("JSON")).expect("written");
    file.to_str().expect("UTF-8").to_owned()
}

#[test]
fn solve_writes_one_analysis_of_the_initial_design() {
    for model in Model::ALL {
        let home = folder();
        let out = home.path().join("out");
        model.command("solve", &out, &[]).exits_with(0);
        let expected = "config.toml fields.pvd fields/eval_0000.vtu manifest.json optimum.msh \
                        optimum_plate_bottom.stl resolved.toml result.json";
        assert_eq!(files_below(&out).join(" "), expected);
        let run = RunFolder(out);
        let result = run.result();
        assert_eq!((&result["command"], &result["status"]), (&"solve".into(), &"done".into()));
        assert_eq!(run.json("manifest.json")["status"], "done");
        assert_eq!(count(&result, "/evaluations"), 1);
        assert!(number(&result, "/objective/initial") > 0.0);
        assert_eq!(number(&result, "/objective/initial"), number(&result, "/objective/best"));
        assert!(numbers(&result, "/design/values_m").iter().all(|&p| p == 0.0));
        let field = run.field(0);
        assert!(vectors(&field.point_data["displacement"]).iter().all(|u| *u == [0.0; 3]));
        assert_eq!(field.points.len() as u64, count(&result, "/mesh/nodes"));
    }
}

#[test]
fn solve_repeats_the_best_design_of_a_run_from_its_result_or_its_values() {
    let home = folder();
    let path = |name: &str| home.path().join(name);
    // With nothing kept from design to design, a field is that of its design alone.
    let alone = ["--set", "analysis.linear_solver.reuse=\"never\""];
    on_quick("run", &path("run"), &alone).exits_with(1);
    let run = RunFolder(path("run"));
    let (result, file) = (run.result(), path("run/result.json"));
    let list = design_file(home.path(), &numbers(&result, "/design/values_m"));
    for (name, design) in [("from-result", file.to_str().expect("UTF-8")), ("from-list", &list)] {
        on_quick("solve", &path(name), &["--design", design, "--set", "accuracy.estimate=false"])
            .exits_with(0);
        let solved = RunFolder(path(name));
        let solution = solved.result();
        assert_eq!(solution["design"], result["design"]);
        // The same design on the same mesh: the same bits.
        assert_eq!(solution["objective"]["best"], result["objective"]["best"]);
        assert_eq!(solution["probes"], result["probes"]);
        let best = count(&result, "/objective/best_evaluation");
        assert_eq!(solved.field(0), run.field(best));
    }
}

#[test]
fn a_design_moves_the_nodes_in_the_documented_order() {
    let home = folder();
    // A different height for every control point, within the bounds.
    let design: Vec<f64> = (0..91).map(|k| 1e-4 * f64::from(k) - 3e-3).collect();
    let file = design_file(home.path(), &design);
    let out = home.path().join("out");
    on_quick("solve", &out, &["--design", &file]).exits_with(0);
    let field = RunFolder(out).field(0);
    let displacement = vectors(&field.point_data["displacement"]);
    let original: Vec<[f64; 3]> =
        field.points.iter().zip(displacement).map(|(x, u)| std::array::from_fn(|d| x[d] - u[d])).collect();
    for n in plate_bottom(&original) {
        let [x, y, _] = original[n];
        // Rounding of coordinates and of the interpolation, with room.
        assert!((displacement[n][2] + height(&design, x, y)).abs() < 1e-15, "{n}");
    }
}

#[test]
fn a_file_that_is_no_fitting_design_is_refused_with_its_name() {
    let home = folder();
    let file = home.path().join("design.json");
    let filled = |value: &str| format!("[{}]", vec![value; 91].join(", "));
    let cases = [
        ("[0.001, 0.002]".to_owned(), "has 2 values, but the problem has 91 design variables"),
        (filled("NaN"), "not a design: no valid JSON"),
        (filled("0.05"), "of it can be taken; move less, enlarge the remesh region"),
    ];
    for name in ["solve", "gradient"] {
        for (text, fragment) in &cases {
            std::fs::write(&file, text).expect("written");
            let out = home.path().join("out");
            let design = file.to_str().expect("UTF-8");
            let fragments =
                if text.contains("0.05") { vec![*fragment] } else { vec![*fragment, "design.json"] };
            on_quick(name, &out, &["--design", design, "--quiet", "--force"]).with(3, &fragments);
        }
    }
    let absent = home.path().join("absent.json");
    let absent = absent.to_str().expect("UTF-8");
    on_quick("solve", &home.path().join("out"), &["--design", absent]).with(5, &["absent.json"]);
}

#[test]
fn check_prints_the_mesh_and_writes_nothing() {
    let home = folder();
    let out = home.path().join("out");
    let text = on_quick("check", &out, &[]).exits_with(0).stdout;
    let fragments = ["nodes", "unknowns", "design variables", "bounding box", "worst quality", "memory"];
    for fragment in fragments.into_iter().chain(["plate_bottom", "impedance"]) {
        assert!(text.contains(fragment), "no `{fragment}` in:\n{text}");
    }
    let json = on_quick("check", &out, &["--json"]).exits_with(0).json();
    let region = |name: &str| named(&json["regions"], name);
    // A quarter of a plate of 240 x 480 x 10 mm, and 12 observation cells of 20 mm; sums of some hundred volumes.
    assert!((number(region("plate"), "/volume_m3") / 2.88e-4 - 1.0).abs() < 1e-12);
    assert!((number(region("observation"), "/volume_m3") / 9.6e-5 - 1.0).abs() < 1e-12);
    assert_eq!(
        (&region("plate")["material"], &region("plate")["model"]),
        (&"steel".into(), &"impedance".into())
    );
    assert_eq!(region("air")["material"], "air");
    // sqrt(2 / (ω μ σ)) at 60 Hz with 800 μ0 and 7 MS/m; μ0 = 4e-7 π to ten digits.
    let depth =
        (2.0 / (2.0 * std::f64::consts::PI * 60.0 * 800.0 * 4e-7 * std::f64::consts::PI * 7e6)).sqrt();
    assert!((number(&json, "/skin/0/skin_depth_m") / depth - 1.0).abs() < 1e-9);
    assert_eq!(count(&json, "/design_variables"), 91);
    assert_eq!(json["materials"]["steel"]["relative_permeability"], 800.0);
    assert!(!out.exists());
}

#[test]
fn check_says_how_far_the_mesh_follows_to_the_bounds() {
    let home = folder();
    let of = |arguments: &[&str]| {
        let json = on_quick("check", &home.path().join("out"), &[&["--json"], arguments].concat())
            .exits_with(0)
            .json();
        ["/reach/0", "/reach/1"].map(|bound| {
            let at = |key: &str| json.pointer(&format!("{bound}/{key}")).expect("both bounds").clone();
            (at("share").as_f64().expect("a number"), at("cause").to_string())
        })
    };
    // As shipped; then far through the air of the remesh region, and nearly through the plate.
    for (share, cause) in of(&[]) {
        assert!(share == 1.0 && cause == "null", "{share}: {cause}");
    }
    for (share, cause) in of(&["--set", "design.upper=0.3", "--set", "design.lower=-0.00999"]) {
        assert!(share < 1.0 && cause.contains("narrower bounds"), "{share}: {cause}");
    }
}

#[test]
fn the_gradient_certificate_holds_for_the_quick_configuration() {
    let text = fluxmorph(&[&"gradient", &quick()]).exits_with(0).stdout;
    assert!(text.contains("the certificate holds"), "{text}");
    let json = fluxmorph(&[&"gradient", &quick(), &"--json"]).exits_with(0).json();
    assert_eq!(json["holds"], true);
    // The demands on a certificate: five directions, at least five halvings, second order, adjoint against
    // differences within a millionth.
    let directions = list(&json, "/directions");
    assert_eq!(directions.len(), 5);
    for direction in directions {
        let remainders = numbers(direction, "/remainders");
        assert!(remainders.len() >= 6 && number(direction, "/slope") >= 1.95, "{direction}");
        assert!(number(direction, "/error") <= 1e-6, "{direction}");
        let fall: Vec<f64> = remainders.windows(2).map(|pair| pair[0] / pair[1]).collect();
        // Halving divides a second-order remainder by four; cubic terms and rounding take a few per cent.
        assert!(fall.iter().all(|ratio| (3.8..4.2).contains(ratio)), "{fall:?}");
    }
}

#[test]
fn a_probe_that_the_moving_plate_swallows_is_left_out_of_the_result() {
    let home = folder();
    let out = home.path().join("out");
    // 1 mm below the plate, near its rim: the plate grows over it.
    let probe = "probes[0].points=[[\"110 mm\", \"10 mm\", \"-11 mm\"], [\"0 mm\", \"0 mm\", \"-50 mm\"]]";
    on_quick("run", &out, &["--set", probe]).with(1, &["warning: ", "behind the plate", "left out"]);
    let result = RunFolder(out).json("result.json");
    for part in ["b_re_t", "b_im_t"] {
        assert_eq!(result["probes"][0][part][0], serde_json::Value::Null);
        assert_eq!(numbers(&result, &format!("/probes/0/{part}/1")).len(), 3);
    }
}

#[test]
fn an_objective_that_is_to_be_large_and_is_negative_is_asked_about() {
    let home = folder();
    let out = home.path().join("out");
    let written = "direction = [0, 0, -1]                            # towards the core\n";
    let text = read_text(&repository("configs/actuator.toml"));
    let curve = "steel_team20.csv";
    std::fs::copy(repository("configs").join(curve), home.path().join(curve)).expect("copied");
    let asks = |text: &str, objective: &str| {
        let config = home.path().join("actuator.toml");
        std::fs::write(&config, changed(text, &[(written, objective)])).expect("written");
        let coarse = ["mesh.boxes.refinement=0.5", "output.verify_refinement=0"];
        let further = ["--out", out.to_str().expect("UTF-8"), "--force", "--max-evaluations", "1"];
        finish(command(&[&"run", &config]).args(further).args(set(&coarse))).exits_with(1);
        texts(&RunFolder(out.clone()).result()["warnings"]).contains("reverse its direction or minimise it")
    };
    assert!(asks(&text, "direction = [0, 0, 1]\n") && !asks(&text, "direction = [0, 0, -1]\n"));
    // What counts against the others has no direction to reverse.
    let own = "kind = \"force\"\nregion = \"armature\"\n";
    let term =
        |weight: &str| format!("[[objective.terms]]\n{own}direction = [0, 0, -1]\nweight = {weight}\n");
    assert!(!asks(&changed(&text, &[(own, "")]), &[term("1"), term("-2")].concat()));
}
