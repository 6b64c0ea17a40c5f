//! What `run` leaves: every file of the run directory, and the physics in the fields recomputed from the files alone.

use fluxmorph_geometry::io::VtuContents;
use serde_json::Value;

use crate::support::folder::{
    RunFolder, count, files_below, list, number, numbers, read_text, scalars, vectors,
};
use crate::support::program::{command, finish, fluxmorph, folder};
use crate::support::shield::{Model, height, on_quick, plate_bottom, quick};

/// Evaluations of the runs of this file: the plate then reaches its lower bound and doubles its thickness elsewhere.
const EVALUATIONS: usize = 4;

fn run(model: Model, out: &std::path::Path) -> RunFolder {
    let limits = ["--max-evaluations", "4", "--set", "output.fields=every"];
    // Four evaluations are fewer than convergence takes: the documented code of a limit.
    model.command("run", out, &limits).exits_with(1);
    RunFolder(out.to_owned())
}

#[test]
fn a_run_leaves_files_that_agree_and_fields_that_hold_its_design_and_its_objective() {
    for model in Model::ALL {
        let home = folder();
        let run = run(model, &home.path().join("out"));
        let result = run.result();
        all_files_are_there(&run);
        result_has_the_keys_of_its_contract(&result);
        manifest_describes_the_run(&run.json("manifest.json"), &result);
        history_has_a_row_for_each_evaluation(&run, &result);
        collection_lists_the_fields_by_evaluation(&run);
        every_field_file_holds_the_arrays_of_its_contract(&run, &result, model);
        the_plate_in_the_moved_mesh_is_as_thick_as_the_design_says(&run, &result);
        objective_and_losses_follow_from_the_fields(&run, &result, model);
        resolved_configuration_repeats_the_run(&run, &result);
    }
}

fn all_files_are_there(run: &RunFolder) {
    let fields = (0..EVALUATIONS).map(|e| format!("fields/eval_{e:04}.vtu"));
    let others = "config.toml error.vtu fields.pvd history.csv journal.jsonl manifest.json optimum.msh \
                  optimum_plate_bottom.stl report.html resolved.toml result.json";
    let mut expected: Vec<String> = others.split(' ').map(str::to_owned).chain(fields).collect();
    expected.sort();
    assert_eq!(files_below(&run.0), expected);
    assert_eq!(run.text("config.toml"), read_text(&quick()));
}

/// What was read is enough to do the same again, bit for bit.
fn resolved_configuration_repeats_the_run(run: &RunFolder, result: &Value) {
    let (resolved, again) = (run.0.join("resolved.toml"), run.0.with_file_name("again"));
    fluxmorph(&[&"check", &resolved]).exits_with(0);
    // What comes after the search changes no design.
    let search = ["--set", "accuracy.estimate=false", "--set", "output.verify_refinement=0"];
    let mut run = command(&[&"run", &resolved, &"--out", &again, &"--max-evaluations", &"4"]);
    finish(run.args(search)).exits_with(1);
    assert_eq!(RunFolder(again).result()["design"]["values_m"], result["design"]["values_m"]);
}

fn result_has_the_keys_of_its_contract(result: &Value) {
    let contract: &[(&str, &[&str])] = &[
        ("", &["schema_version", "command", "status", "stop_reason", "evaluations", "iterations", "probes"]),
        ("", &["losses_w", "linear_solver", "timings_s", "peak_memory_bytes"]),
        ("/objective", &["initial", "best", "ratio", "best_evaluation", "verified_ratio"]),
        ("/accuracy", &["error_estimate_relative", "refinements", "cross_check"]),
        ("/accuracy/cross_check", &["elements", "order", "ratio"]),
        ("/design", &["values_m", "lower_m", "upper_m", "points_m"]),
        ("/mesh", &["nodes", "tets", "unknowns", "worst_quality_initial", "worst_quality_final"]),
        ("/probes/0", &["name", "points_m", "b_re_t", "b_im_t"]),
        ("/linear_solver", &["worst_residual"]),
        ("/timings_s", &["total"]),
    ];
    for (pointer, keys) in contract {
        let object = result.pointer(pointer).and_then(Value::as_object).expect(pointer);
        assert!(keys.iter().all(|key| object.contains_key(*key)), "{pointer}: {object:?}");
    }
    assert_eq!((count(result, "/schema_version"), &result["command"]), (1, &"run".into()));
    assert_eq!((&result["status"], &result["stop_reason"]), (&"stopped".into(), &"max_evaluations".into()));
    assert_eq!(count(result, "/evaluations"), EVALUATIONS as u64);
    for key in ["values_m", "lower_m", "upper_m"] {
        assert_eq!(numbers(result, &format!("/design/{key}")).len(), 91, "{key}");
    }
    let points = list(result, "/design/points_m");
    for (k, point) in points.iter().enumerate() {
        let expected = [0.02 * (k / 13) as f64, 0.02 * (k % 13) as f64, -0.01];
        // Rounding of coordinates of a quarter of a metre, with room.
        let near = |d: usize| (number(point, &format!("/{d}")) - expected[d]).abs() < 1e-15;
        assert!((0..3).all(near), "{k}: {point}");
    }
    assert_eq!(points.len(), 91);
    for part in ["b_re_t", "b_im_t"] {
        for point in 0..2 {
            assert_eq!(numbers(result, &format!("/probes/0/{part}/{point}")).len(), 3);
        }
    }
    assert!(number(result, "/losses_w/plate") > 0.0);
    // What every accepted linear solution has to reach.
    assert!(number(result, "/linear_solver/worst_residual") <= 1e-9);
    assert!(number(result, "/timings_s/total") > 0.0 && count(result, "/peak_memory_bytes") > 0);
}

fn manifest_describes_the_run(manifest: &Value, result: &Value) {
    assert_eq!(manifest["program"], "fluxmorph");
    assert_eq!(manifest["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!((&manifest["command"], &manifest["status"]), (&result["command"], &result["status"]));
    assert!(count(manifest, "/threads") >= 1);
    for pointer in ["/config/blake3", "/mesh/blake3"] {
        let hash = manifest.pointer(pointer).and_then(Value::as_str).expect(pointer);
        assert!(hash.len() == 64 && hash.bytes().all(|b| b.is_ascii_hexdigit()), "{hash}");
    }
    let time = |key: &str| manifest[key].as_str().expect("a time").to_owned();
    assert!(time("started") <= time("finished") && number(manifest, "/seconds") > 0.0);
}

fn history_has_a_row_for_each_evaluation(run: &RunFolder, result: &Value) {
    const CONTRACT: &str = "evaluation iteration objective ratio gradient_norm step_norm worst_quality \
                            min_thickness_m max_thickness_m linear_iterations seconds";
    let (header, rows) = run.history();
    assert!(CONTRACT.split(' ').all(|column| header.iter().any(|name| name == column)), "{header:?}");
    assert_eq!(rows.len(), EVALUATIONS);

    let text = run.text("journal.jsonl");
    let row = |line| serde_json::from_str::<Value>(line).expect("JSON")["row"].take();
    let lines: Vec<Value> = text.lines().skip(1).map(row).collect();
    assert_eq!(lines.len(), rows.len());
    for (row, line) in rows.iter().zip(&lines) {
        assert_eq!(line.as_object().map(|object| object.len()), Some(header.len()));
        for (name, cell) in header.iter().zip(row) {
            assert_eq!(cell.parse::<f64>().ok(), line[name.as_str()].as_f64(), "{name}");
        }
    }

    let column =
        |name: &str| -> Vec<f64> { lines.iter().map(|line| number(line, &format!("/{name}"))).collect() };
    let (objective, ratio) = (column("objective"), column("ratio"));
    assert_eq!(column("evaluation"), (0..EVALUATIONS).map(|e| e as f64).collect::<Vec<_>>());
    let best = (0..EVALUATIONS).min_by(|&a, &b| objective[a].total_cmp(&objective[b])).expect("rows");
    assert_eq!(count(result, "/objective/best_evaluation"), best as u64);
    assert_eq!(number(result, "/objective/initial"), objective[0]);
    assert_eq!(number(result, "/objective/best"), objective[best]);
    assert_eq!(number(result, "/objective/ratio"), ratio[best]);
    for (f, ratio) in objective.iter().zip(&ratio) {
        assert_eq!(f / objective[0], *ratio);
    }
    assert_eq!((ratio[0], column("step_norm")[0]), (1.0, 0.0));
    assert!(column("gradient_norm").iter().all(|&norm| norm > 0.0));
    assert_eq!(number(result, "/mesh/worst_quality_initial"), column("worst_quality")[0]);
    assert_eq!(number(result, "/mesh/worst_quality_final"), column("worst_quality")[best]);
}

fn collection_lists_the_fields_by_evaluation(run: &RunFolder) {
    let text = run.text("fields.pvd");
    let attribute = |line: &str, name: &str| -> String {
        let (_, rest) = line.split_once(&format!("{name}=\"")).expect("the attribute");
        rest.split('"').next().expect("a value").to_owned()
    };
    let sets: Vec<&str> = text.lines().filter(|line| line.contains("<DataSet")).collect();
    assert_eq!(sets.len(), EVALUATIONS);
    for (evaluation, line) in sets.iter().enumerate() {
        assert_eq!(attribute(line, "timestep").parse::<f64>(), Ok(evaluation as f64));
        let file = attribute(line, "file");
        assert_eq!(file, format!("fields/eval_{evaluation:04}.vtu"));
        assert!(run.0.join(file).is_file());
    }
}

fn every_field_file_holds_the_arrays_of_its_contract(run: &RunFolder, result: &Value, model: Model) {
    for evaluation in 0..EVALUATIONS as u64 {
        let field = run.field(evaluation);
        let (nodes, tets) = (field.points.len(), field.tets.len());
        let counts = ["/mesh/nodes", "/mesh/tets"].map(|pointer| count(result, pointer));
        assert_eq!([nodes as u64, tets as u64], counts);
        assert_eq!((field.point_data.len(), field.cell_data.len()), (7, 8));
        assert_eq!(field.cell_data["region"].len(), tets);
        let (points, cells) = (&field.point_data, &field.cell_data);
        let mut zero = Vec::new();
        for (names, data, length) in
            [("A_re A_im displacement sensitivity", points, nodes), ("B_re B_im J_re J_im", cells, tets)]
        {
            for name in names.split(' ') {
                let values = vectors(&data[name]);
                assert!(values.len() == length && values.iter().flatten().all(|x| x.is_finite()), "{name}");
                zero.extend(values.iter().flatten().all(|&x| x == 0.0).then_some(name));
            }
        }
        for (names, data, length) in
            [("psi_re psi_im thickness", points, nodes), ("B_abs loss_density quality", cells, tets)]
        {
            for name in names.split(' ') {
                let values = scalars(&data[name]);
                assert!(values.len() == length && values.iter().all(|x| x.is_finite()), "{name}");
                zero.extend(values.iter().all(|&x| x == 0.0).then_some(name));
            }
        }
        // Nothing flows in the mesh around an impedance surface, which has ψ; the first design has not moved.
        let mut expected = Vec::new();
        expected.extend((evaluation == 0).then_some("displacement"));
        if model == Model::Impedance {
            expected.extend(["J_re", "J_im", "loss_density"]);
        }
        assert_eq!(zero, expected, "{model:?}, evaluation {evaluation}");
    }
}

fn the_plate_in_the_moved_mesh_is_as_thick_as_the_design_says(run: &RunFolder, result: &Value) {
    // Rounding of coordinates and of the interpolation, a few 1e-17 m, with room.
    let rounding = 1e-15;
    let best = count(result, "/objective/best_evaluation");
    let design = numbers(result, "/design/values_m");
    let (start, end) = (run.field(0), run.field(best));
    assert_eq!(start.tets, end.tets, "the topology stays");

    let bottom = plate_bottom(&start.points);
    // At least the control points themselves.
    assert!(bottom.len() >= 91, "{}", bottom.len());
    let mut thickness = Vec::new();
    for &n in &bottom {
        let ([x, y, _], moved) = (start.points[n], end.points[n]);
        let expected = [x, y, -0.01 - height(&design, x, y)];
        assert!((0..3).all(|d| (moved[d] - expected[d]).abs() < rounding), "{moved:?} {expected:?}");
        thickness.push(-moved[2]);
    }
    let displacement = vectors(&end.point_data["displacement"]);
    for ((a, b), u) in start.points.iter().zip(&end.points).zip(displacement) {
        assert!((0..3).all(|d| (b[d] - a[d] - u[d]).abs() < rounding), "{a:?} {b:?} {u:?}");
    }

    let (header, rows) = run.history();
    let cell = |name: &str| -> f64 {
        let column = header.iter().position(|c| c == name).expect("the column");
        rows[best as usize][column].parse().expect("a number")
    };
    let least = thickness.iter().copied().fold(f64::INFINITY, f64::min);
    let most = thickness.iter().copied().fold(0.0, f64::max);
    assert!((cell("min_thickness_m") - least).abs() < rounding);
    assert!((cell("max_thickness_m") - most).abs() < rounding);
    // The run has done something: the bounds allow 5 to 30 mm.
    assert!((0.005 - rounding..0.006).contains(&least) && most > 0.015, "{least} {most}");
}

/// Relative rounding of sums over thousands of terms of one sign, with room.
const SUM_ROUNDING: f64 = 1e-12;

fn objective_and_losses_follow_from_the_fields(run: &RunFolder, result: &Value, model: Model) {
    let best = count(result, "/objective/best_evaluation");
    // The same residual is asked of both solutions of the initial design, in the run and for its losses.
    let (rounding, solved_twice) = (SUM_ROUNDING, 1e-8);
    for (evaluation, key, loss, tolerance) in [
        (0, "/objective/initial", "/initial/0/losses_w/plate", solved_twice),
        (best, "/objective/best", "/losses_w/plate", rounding),
    ] {
        let field = run.field(evaluation);
        let volumes: Vec<f64> = corners(&field).into_iter().map(volume).collect();
        assert!(volumes.iter().all(|&v| v > 0.0), "no element is inverted");
        let objective = number(result, key);
        assert!((objective_of(&field, &volumes) / objective - 1.0).abs() < SUM_ROUNDING);
        magnitudes_are_those_of_the_parts(&field);
        if model == Model::Meshed {
            let density = scalars(&field.cell_data["loss_density"]);
            let expected = number(result, loss);
            let loss: f64 = density.iter().zip(&volumes).map(|(p, v)| p * v).sum();
            assert!((loss / expected - 1.0).abs() < tolerance, "{loss} {expected}");
            joule_heat_lies_where_the_currents_are(&field);
        }
    }
    the_observed_part_stays_and_has_no_sensitivity(&run.field(best));
}

/// `Σ_k B_k·B_k*` over the 2 by 6 observation cells of 20 mm, `B_k` the volume mean over a cell.
fn objective_of(field: &VtuContents, volumes: &[f64]) -> f64 {
    let (re, im) = (vectors(&field.cell_data["B_re"]), vectors(&field.cell_data["B_im"]));
    let mut sums = [[0.0; 7]; 12];
    for (e, corners) in corners(field).into_iter().enumerate() {
        let c: [f64; 3] = std::array::from_fn(|d| corners.iter().map(|p| p[d]).sum::<f64>() / 4.0);
        if c[0] > 0.04 || c[1] > 0.12 || !(-0.06..=-0.04).contains(&c[2]) {
            continue;
        }
        let sum = &mut sums[6 * (c[0] / 0.02) as usize + (c[1] / 0.02) as usize];
        for d in 0..3 {
            sum[d] += volumes[e] * re[e][d];
            sum[3 + d] += volumes[e] * im[e][d];
        }
        sum[6] += volumes[e];
    }
    sums.iter().map(|sum| sum[..6].iter().map(|b| (b / sum[6]).powi(2)).sum::<f64>()).sum()
}

fn magnitudes_are_those_of_the_parts(field: &VtuContents) {
    let (re, im) = (vectors(&field.cell_data["B_re"]), vectors(&field.cell_data["B_im"]));
    for ((re, im), abs) in re.iter().zip(im).zip(scalars(&field.cell_data["B_abs"])) {
        let expected = re.iter().chain(im).map(|c| c * c).sum::<f64>().sqrt();
        // Both take the root of six squares.
        assert!((expected - abs).abs() <= 4.0 * f64::EPSILON * abs);
    }
}

/// `p = <J·J*> / 2σ` for peak phasors, with the plate's 7 MS/m, and no loss without current. The files hold the mean
/// current of an element, whose square is at most the mean square.
fn joule_heat_lies_where_the_currents_are(field: &VtuContents) {
    let (re, im) = (vectors(&field.cell_data["J_re"]), vectors(&field.cell_data["J_im"]));
    let mut conducting = 0;
    for ((re, im), &p) in re.iter().zip(im).zip(scalars(&field.cell_data["loss_density"])) {
        let square: f64 = re.iter().chain(im).map(|c| c * c).sum();
        // Ten rounded operations.
        assert!(square / (2.0 * 7e6) <= p * (1.0 + 1e-14), "{square} {p}");
        assert_eq!(square == 0.0, p == 0.0);
        conducting += usize::from(p > 0.0);
    }
    assert!(conducting > 0 && conducting < re.len());
}

fn the_observed_part_stays_and_has_no_sensitivity(field: &VtuContents) {
    let displacement = vectors(&field.point_data["displacement"]);
    let sensitivity = vectors(&field.point_data["sensitivity"]);
    let mut outside = 0;
    for (n, point) in field.points.iter().enumerate() {
        // The remesh region ends at 30 mm above and 40 mm below the plate's upper face.
        if point[2] > 0.031 || point[2] < -0.041 {
            outside += 1;
            assert_eq!((displacement[n], sensitivity[n]), ([0.0; 3], [0.0; 3]), "{point:?}");
        }
    }
    assert!(outside > 0);
}

#[test]
fn a_converged_run_exits_with_success() {
    let home = folder();
    let out = home.path().join("out");
    // A tenth of the objective: the cautious first step of the method changes less, and is not taken for convergence.
    let arguments = ["--set", "optimizer.ftol_rel=0.1", "--max-evaluations", "30"];
    on_quick("run", &out, &arguments).with(0, &["goes on with a relative tolerance of 1e-2"]);
    let run = RunFolder(out);
    assert_eq!(run.result()["stop_reason"], "objective_converged");
    assert_eq!(run.json("manifest.json")["status"], "converged");
}

/// Signed volume of a tetrahedron [m³].
fn volume(corners: [[f64; 3]; 4]) -> f64 {
    let edge = |k: usize| -> [f64; 3] { std::array::from_fn(|d| corners[k][d] - corners[0][d]) };
    let (a, b, c) = (edge(1), edge(2), edge(3));
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    (0..3).map(|d| cross[d] * c[d]).sum::<f64>() / 6.0
}

/// Corners of every tetrahedron of a file.
fn corners(field: &VtuContents) -> Vec<[[f64; 3]; 4]> {
    field.tets.iter().map(|tet| tet.map(|node| field.points[node.index()])).collect()
}
