//! Coils as circuits through the binary: energy and reciprocity, voltages against currents, runs on what coils are.

use std::path::Path;

use serde_json::Value;

use crate::support::folder::{read_json, read_text};
use crate::support::program::{Finished, fluxmorph, folder};
use crate::support::{changed, with_mesh_file};

pub(crate) const COILS: &str = include_str!("../support/coils.toml");

/// A command on the coils with changes.
fn execute(command: &str, folder: &Path, changes: &[(&str, &str)]) -> Finished {
    let config = folder.join("coils.toml");
    std::fs::write(&config, changed(COILS, changes)).expect("written");
    fluxmorph(&[&command, &config, &"--out", &folder.join("run"), &"--quiet", &"--force"])
}

/// `result.json` of a command that comes to its end.
fn result(command: &str, changes: &[(&str, &str)]) -> Value {
    let folder = folder();
    execute(command, folder.path(), changes).completed();
    read_json(&folder.path().join("run/result.json"))
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("no number: {value}"))
}

/// A phasor `[re, im]`.
fn phasor(value: &Value) -> [f64; 2] {
    [number(&value[0]), number(&value[1])]
}

/// `|a − b| / |b|`.
fn deviation([a, b]: [[f64; 2]; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1]) / b[0].hypot(b[1])
}

#[test]
fn the_energy_is_that_of_the_inductances_and_the_matrix_is_symmetric() {
    let changes = [
        ("phase = \"30 deg\"\n", ""),
        ("frequency = \"200 Hz\"", "frequency = 0"),
        ("goal = \"maximise\"\nkind = \"coupling\"\ncoils = [\"one\", \"two\"]", "kind = \"energy\""),
    ];
    let result = result("solve", &changes);
    let l = |j: usize, k: usize| number(&result["inductance_h"][j][k]);
    let i = [0, 1].map(|k| number(&result["coils"][k]["current_a"]));
    assert_eq!(i[0], 10.0);
    let pairs = [(0, 0), (0, 1), (1, 0), (1, 1)];
    let energy: f64 = pairs.iter().map(|&(j, k)| 0.5 * i[j] * l(j, k) * i[k]).sum();
    // What the issue asks for; the linear solver's residual is 1e-13.
    let found = number(&result["objective"]["initial"]);
    assert!((energy / found - 1.0).abs() < 1e-8, "{energy} {found}");
    assert!((l(0, 1) / l(1, 0) - 1.0).abs() < 1e-9);
    let coupling = l(0, 1) / (l(0, 0) * l(1, 1)).sqrt();
    assert!((number(&result["coupling"][0][1]) / coupling - 1.0).abs() < 1e-12);
}

/// A shell that a mesh file has is that which is put around a mesh.
#[test]
fn a_shell_of_a_mesh_file_is_open_space() {
    let home = folder();
    let walls = "flux_parallel = [\"x_min\", \"y_min\", \"x_max\", \"y_max\", \"z_min\", \"z_max\"]";
    let around = "flux_parallel = [\"x_min\", \"y_min\"]\n\n[open]\nsurfaces = [\"x_max\", \"y_max\", \"z_min\", \"z_max\"]";
    execute("solve", home.path(), &[(walls, around)]).completed();
    let run = home.path().join("run");
    // Of the page it is no part.
    fluxmorph(&[&"report", &run]).completed();
    assert!(read_text(&run.join("report.html")).contains("in a mesh of 70 × 70 × 90 mm"));
    let expected = read_json(&run.join("result.json"));
    std::fs::copy(run.join("optimum.msh"), home.path().join("shell.msh")).expect("copied");
    let own = "flux_parallel = [\"x_min\", \"y_min\", \"infinity\"]\n\n[open]\nregion = \"open\"";
    let text = with_mesh_file(&changed(COILS, &[(walls, own)]), "shell.msh");
    let config = home.path().join("file.toml");
    std::fs::write(&config, text).expect("written");
    fluxmorph(&[&"solve", &config, &"--out", &run, &"--quiet", &"--force"]).completed();
    let found = read_json(&run.join("result.json"));
    for (j, k) in [(0, 0), (0, 1), (1, 1)] {
        let [a, b] = [&found, &expected].map(|result| number(&result["inductance_h"][j][k]));
        // Coordinates of the file are within a rounding.
        assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    }
    let share = |result: &Value| number(&result["open"]["energy_share"][0]);
    assert!(share(&expected) > 1e-3 && (share(&found) / share(&expected) - 1.0).abs() < 1e-9);
}

#[test]
fn a_voltage_drives_the_current_that_needs_it() {
    let given = result("solve", &[]);
    let [re, im] = phasor(&given["coils"][0]["voltage_v"]);
    let drive = format!("voltage = {:?}\nphase = {:?}", re.hypot(im), im.atan2(re));
    let driven = result("solve", &[("ampere_turns = \"100 A\"", &drive)]);
    for (k, key) in [(0, "current_a"), (0, "flux_linkage_wb"), (1, "flux_linkage_wb"), (1, "voltage_v")] {
        let both = [&driven, &given].map(|result| phasor(&result["coils"][k][key]));
        assert!(deviation(both) < 1e-9, "{k} {key}: {both:?}");
    }
    let losses = [&driven, &given].map(|result| number(&result["losses_w"]["plate"]));
    assert!((losses[0] / losses[1] - 1.0).abs() < 1e-9);
    // An objective of the matrix does not know what drives the coils.
    let couplings = [&driven, &given].map(|result| number(&result["objective"]["initial"]));
    assert!((couplings[0] / couplings[1] - 1.0).abs() < 1e-9);
}

#[test]
fn a_run_raises_the_coupling_and_keeps_a_least_inductance() {
    let least = "[[constraints]]\nkind = \"inductance\"\ncoils = [\"one\"]\nlower_ratio = 0.99\n\n[design]";
    let result = result("run", &[("[design]", least)]);
    let [initial, best] = ["initial", "best"].map(|key| number(&result["objective"][key]));
    assert!(best > 1.001 * initial, "{initial} {best}");
    // The objective of the best design is the coupling of its result.
    assert!((number(&result["coupling"][0][1]) / best - 1.0).abs() < 1e-9);
    let constraint = &result["constraints"][0];
    assert_eq!(constraint["name"], "inductance_one");
    assert_eq!(constraint["satisfied"], true);
    let inductance = number(&result["inductance_h"][0][0]);
    assert!((number(&constraint["value"]) / inductance - 1.0).abs() < 1e-9);
    assert_eq!(result["objective"]["terms"][0]["coils"], serde_json::json!(["one", "two"]));
}

#[test]
fn the_current_at_a_voltage_can_be_made_small() {
    let changes = [
        ("ampere_turns = \"100 A\"", "voltage = \"1 V\""),
        (
            "goal = \"maximise\"\nkind = \"coupling\"\ncoils = [\"one\", \"two\"]",
            "kind = \"current\"\ncoils = [\"one\"]",
        ),
    ];
    let result = result("run", &changes);
    let [initial, best] = ["initial", "best"].map(|key| number(&result["objective"][key]));
    let [re, im] = phasor(&result["coils"][0]["current_a"]);
    assert!(best < 0.999 * initial && (re.hypot(im) / best - 1.0).abs() < 1e-9, "{initial} {best}");
}

/// Probes at points of the circle in the meshed quarter, with the weights of a least-squares fit of the terms that the
/// symmetry allows, give the terms of the expansion.
#[test]
fn multipoles_are_those_of_a_fit_of_probes() {
    let (order, radius, height) = (4, 8e-3, 30e-3);
    let count = 2 * order + 16;
    let angles = (0..count).map(|k| 2.0 * std::f64::consts::PI * (f64::from(k) + 0.5) / f64::from(count));
    // Angles from y towards z; the other half is the image in y = 0, where B_y is odd.
    let points: Vec<(f64, [f64; 2])> =
        angles.map(|a| (a, [radius * a.cos(), height + radius * a.sin()])).collect();
    let text: Vec<String> = points.iter().map(|(_, [y, z])| format!("[0.0, {:?}, {z:?}]", y.abs())).collect();
    let probes = format!("[[probes]]\nname = \"circle\"\npoints = [{}]\n\n[output]", text.join(", "));
    let statics =
        [("phase = \"30 deg\"\n", ""), ("frequency = \"200 Hz\"", "frequency = 0"), ("[output]", &probes)];
    let result = result("solve", &statics);
    let field = |k: usize, d: usize| number(&result["probes"][0]["b_re_t"][k][d]);
    for (n, letter) in (1..=order).flat_map(|n| [(n, "b"), (n, "a")]) {
        let coefficient: f64 = (0..points.len())
            .map(|k| {
                let (a, [y, _]) = points[k];
                let radial = field(k, 1) * y.signum() * a.cos() + field(k, 2) * a.sin();
                let along = f64::from(n) * a;
                2.0 / f64::from(count) * radial * if letter == "b" { along.sin() } else { along.cos() }
            })
            .sum();
        let terms = result["multipoles"][0]["terms"].as_array().expect("terms");
        let name = format!("{letter}{n}");
        let term = terms.iter().find(|term| term["name"] == name.as_str()).expect("of the order");
        let main = field(0, 2).abs();
        assert!(
            (number(&term["value_t"]) - coefficient).abs() < 1e-6 * main,
            "{name}: {coefficient:e} {term}"
        );
    }
    let dipole = &result["multipoles"][0]["terms"][0];
    assert_eq!((&dipole["name"], number(&dipole["units"])), (&"b1".into(), 1e4));
    let ball = &result["multipoles"][1];
    assert_eq!(ball["terms"][0]["name"], "c0_0");
    assert_eq!(ball["terms"].as_array().map(Vec::len), Some(16));
}

/// A bar of sea water between walls.
const WEAK_BAR: &str = r#"
[mesh]
generator = "boxes"

[mesh.boxes]
box = [["0 mm", "0 mm", "0 mm"], ["60 mm", "60 mm", "20 mm"]]
growth = 1.8
regions = [
    { name = "bar", box = [["20 mm", "20 mm", "0 mm"], ["30 mm", "30 mm", "20 mm"]], size = ["5 mm", "5 mm", "20 mm"] },
]

[analysis]
elements = "edge"
frequencies = [0, 5, 1e6]

[materials.water]
conductivity = "5 S/m"

[regions.bar]
material = "water"

[[coils]]
name = "bar"
region = "bar"
conductor = "solid"
terminals = ["z_min", "z_max"]
ampere_turns = "100 A"

[boundaries]
flux_parallel = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"]
"#;

/// The skin is deeper than the bar is thick, 0.2 m at 1 MHz: resistance and inductance are those at 0 Hz, though at 5 Hz the
/// reactance is 6e-9 of the resistance, and rounding of the curl in the driving field would be a hundred times that.
#[test]
fn a_weak_solid_conductor_has_its_inductance_at_every_frequency() {
    let home = folder();
    let config = home.path().join("bar.toml");
    std::fs::write(&config, WEAK_BAR).expect("written");
    for order in [1, 2] {
        let order = format!("analysis.order={order}");
        let run = home.path().join("run");
        fluxmorph(&[&"solve", &config, &"--out", &run, &"--quiet", &"--force", &"--set", &order]).completed();
        let result = read_json(&run.join("result.json"));
        fluxmorph(&[&"report", &run]).completed();
        let report = read_text(&run.join("report.html"));
        for title in ["part, at 0 Hz", "part, at 5 Hz", "Inductances [H], at 0 Hz"] {
            assert!(report.contains(title), "{title}");
        }
        let of = |state: usize, key: &str| number(&result["states"][state]["coils"][0][key]);
        let linkage = |state: usize| phasor(&result["states"][state]["coils"][0]["flux_linkage_wb"])[0];
        let at_rest = number(&result["states"][0]["coils"][0]["flux_linkage_wb"]);
        println!("order {order}: {at_rest:e}, {:e}, {:e} Wb", linkage(1), linkage(2));
        for state in [1, 2] {
            assert!((linkage(state) / at_rest - 1.0).abs() < 1e-8);
            assert!((of(state, "resistance_ohm") / of(0, "resistance_ohm") - 1.0).abs() < 1e-8);
        }
    }
}

/// The two tests of a transformer in one analysis: what its terminals see under each load is what the circuit of its inductances
/// says, the leakage of a short-circuited secondary and the voltage of an open one.
#[test]
fn an_open_and_a_short_circuited_coil_are_two_loads_of_one_device() {
    let loads = "[[loads]]\nname = \"open\"\nampere_turns = { two = 0 }\n[[loads]]\nname = \"short\"\n\
                 voltage = { two = 0 }\n[boundaries]";
    // Without conductors the inductances are real.
    let insulating = ("conductivity = \"2e7 S/m\"", "conductivity = 0");
    let folder = folder();
    execute("solve", folder.path(), &[("[boundaries]", loads), insulating]).completed();
    let result = read_json(&folder.path().join("run/result.json"));
    fluxmorph(&[&"report", &folder.path().join("run")]).completed();
    let report = read_text(&folder.path().join("run/report.html"));
    for fragment in [
        "part, under the load open",
        "part, under the load short",
        "[H], under the load open",
        "the first of 2",
    ] {
        assert!(report.contains(fragment), "{fragment}");
    }
    assert_eq!(result["loads"], serde_json::json!(["open", "short"]));
    let at = |load: usize, coil: usize, key: &str| phasor(&result["states"][load]["coils"][coil][key]);
    let l = |j: usize, k: usize| number(&result["inductance_h"][j][k]);
    let omega = 2.0 * std::f64::consts::PI * 200.0;
    assert_eq!((at(0, 0, "current_a"), at(0, 1, "current_a")), ([10.0, 0.0], [0.0, 0.0]));
    let induced = [0.0, omega * l(1, 0) * 10.0];
    assert!(deviation([at(0, 1, "voltage_v"), induced]) < 1e-9);
    // I₂ = −jωM I₁/(R₂ + jωL₂).
    let (r, x, y) = (2e-3, omega * l(1, 1), omega * l(1, 0) * 10.0);
    let square = r * r + x * x;
    let current = [-x * y / square, -r * y / square];
    let found = at(1, 1, "current_a");
    println!("{found:?} {current:?}");
    assert!(deviation([found, current]) < 1e-9);
    assert_eq!(result["coils"], result["states"][0]["coils"]);
}

/// A right-angled bend between planes of equal potential.
const BEND: &str = r#"
[mesh]
generator = "boxes"
[mesh.boxes]
box = [["-20 mm", "-20 mm", "-15 mm"], ["30 mm", "30 mm", "20 mm"]]
growth = 2
regions = [
    { name = "bend", box = [["0 mm", "0 mm", "0 mm"], ["30 mm", "10 mm", "5 mm"]], size = "5 mm" },
    { name = "bend", box = [["0 mm", "0 mm", "0 mm"], ["10 mm", "30 mm", "5 mm"]], size = "5 mm" },
]
[analysis]
frequency = 0
[materials.copper]
conductivity = "58e6 S/m"
[regions.bend]
material = "copper"
[[coils]]
name = "bend"
region = "bend"
conductor = "solid"
voltage = "1 mV"
terminals = ["x_max", "y_max"]
[boundaries]
flux_parallel = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"]
"#;

/// Linear conduction takes 2.5 % off the resistance of a bend, and has a current that is too large by that; both are in the bars.
#[test]
fn the_resistance_of_a_bend_has_an_error_bar_and_so_has_the_current_at_a_voltage() {
    let home = folder();
    let path = home.path().join("bend.toml");
    std::fs::write(&path, BEND).expect("written");
    let out = home.path().join("out");
    fluxmorph(&[&"solve", &path, &"--out", &out]).completed().says(&[" ohm (estimated)", " A (estimated)"]);
    let found = read_json(&out.join("result.json"));
    // In the corner there are 1 - (2/pi) ln 2 squares.
    let resistance = (5.0 - 2.0 / std::f64::consts::PI * 2.0_f64.ln()) / (58e6 * 5e-3);
    for (key, error, exact) in [
        ("resistance_ohm", &found["errors"]["resistances_ohm"]["bend"], resistance),
        ("current_a", &found["errors"]["currents_a"]["bend"], 1e-3 / resistance),
    ] {
        let missing = (exact - number(&found["coils"][0][key])).abs();
        let error = number(error).abs();
        println!("{key}: {error:e} of {missing:e}");
        assert!(
            missing > 0.01 * exact && error < missing && missing < 1.5 * error,
            "{key}: {error} {missing}"
        );
    }
}
