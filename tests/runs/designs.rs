//! `--design`: a result is solved again as the run came to it, and that of another device is refused.

use crate::support::changed;
use crate::support::device::{HYPERELASTIC, LINEAR, THROUGH_THE_GAP, shipped, written};
use crate::support::folder::{RunFolder, count, number, read_text};
use crate::support::program::{command, finish, fluxmorph, folder};

/// By every law, of a face that the mesh does not carry to its bound.
#[test]
fn the_result_of_a_run_is_solved_again_to_the_last_bit() {
    for law in [("slide = [", "slide = ["), LINEAR, HYPERELASTIC] {
        let home = folder();
        let device = written(
            "device",
            home.path(),
            &[law, THROUGH_THE_GAP, ("max_evaluations = 6", "max_evaluations = 14")],
        );
        let [run, solved, again] = ["run", "solved", "again"].map(|name| home.path().join(name));
        finish(&mut device.command("run", &run)).completed();
        let result = RunFolder(run.clone()).result();
        for (from, to) in [(&run, &solved), (&solved, &again)] {
            finish(device.command("solve", to).arg("--design").arg(from.join("result.json"))).exits_with(0);
            let own = RunFolder(to.clone()).result();
            assert_eq!(number(&own, "/objective/best"), number(&result, "/objective/best"));
            assert_eq!(own["mesh"]["worst_quality_final"], result["mesh"]["worst_quality_final"]);
            assert_eq!(own["design"], result["design"]);
        }
    }
}

#[test]
fn a_configuration_that_has_changed_since_the_run_is_named() {
    let home = folder();
    let [run, solved] = ["run", "solved"].map(|name| home.path().join(name));
    finish(&mut written("device", home.path(), &[]).command("run", &run)).completed();
    let config = run.join("config.toml");
    let text = read_text(&config);
    let said = "the config.toml is another than when";
    let stronger = changed(&text, &[("b = [0.0, 0.0, 0.1]", "b = [0.0, 0.0, 0.2]")]);
    for (text, is_said) in [(format!("{text}# A word.\n"), false), (stronger, true)] {
        std::fs::write(&config, text).expect("written");
        let again = fluxmorph(&[&"solve", &run.join("result.json"), &"--out", &solved, &"--force"]);
        assert_eq!(again.exits_with(0).stderr.contains(said), is_said);
    }
}

/// Throttled by its mesh, a run ends with 1, says so, and its result is solved again as it is.
#[test]
fn a_run_that_the_mesh_holds_back_never_says_converged() {
    let home = folder();
    let device = written(
        "device",
        home.path(),
        &[
            THROUGH_THE_GAP,
            ("max_evaluations = 6", "max_evaluations = 30"),
            ("ftol_rel = 0", "ftol_rel = 1e-4"),
        ],
    );
    let [run, solved] = ["run", "solved"].map(|name| home.path().join(name));
    finish(&mut device.command("run", &run)).exits_with(1);
    let result = RunFolder(run.clone()).result();
    assert_eq!((&result["status"], &result["stop_reason"]), (&"stopped".into(), &"mesh_limited".into()));
    assert!(count(&result, "/evaluations") < 30, "it ends by itself");
    finish(device.command("solve", &solved).arg("--design").arg(run.join("result.json"))).exits_with(0);
    assert_eq!(number(&RunFolder(solved).result(), "/objective/best"), number(&result, "/objective/best"));
}

#[test]
fn a_design_that_acts_at_other_places_is_refused_whatever_its_count() {
    let home = folder();
    let device = shipped("shield_quick", &[]).with("output.verify_refinement=0");
    let other = device.clone().with("mesh.shield.plate=[\"120 mm\", \"220 mm\", \"10 mm\"]");
    let [run, solved] = ["run", "solved"].map(|name| home.path().join(name));
    finish(device.command("run", &run).args(["--max-evaluations", "2"])).completed();
    let file = run.join("result.json");
    finish(other.command("solve", &solved).arg("--design").arg(&file)).with(
        3,
        &["is that of another device: its variable 1 acts at (0.000, 20.000, -10.000) mm", "design.points_m"],
    );
    assert!(!solved.exists(), "nothing is written for it");
    // The values alone are taken for what they are.
    let result = RunFolder(run).result();
    let list = home.path().join("list.json");
    std::fs::write(&list, result["design"]["values_m"].to_string()).expect("written");
    finish(other.command("solve", &solved).arg("--design").arg(&list)).exits_with(0);
    assert_eq!(count(&RunFolder(solved).result(), "/evaluations"), 1);
}

/// A place that stays is of use where the body does not come: a search that meets one goes on nearer, a design that covers one is
/// refused with the place and what is there.
#[test]
fn a_face_that_reaches_an_observed_place_is_cut_short() {
    let home = folder();
    let changes = [
        ("region = \"observation\"", "region = \"gap\"\nfollow = \"space\"\ngoal = \"maximise\""),
        ("max_evaluations = 6", "max_evaluations = 12"),
    ];
    let device = written("device", home.path(), &changes);
    let reached = &["would lie in `iron`", "narrow the bounds of the design"];
    finish(&mut device.command("run", &home.path().join("run"))).with(1, reached);
    let result = RunFolder(home.path().join("run")).result();
    assert!(number(&result, "/objective/ratio") > 1.0, "it goes on nearer");
    let covered = device.with("design.initial=\"4 mm\"");
    finish(&mut covered.command("solve", &home.path().join("solved"))).with(3, reached);
}

/// Half of a block of iron that grows into the gap above it.
const HALVED: &str = r#"
[mesh]
generator = "boxes"
boxes.box = [["0 mm", "0 mm", "0 mm"], ["40 mm", "40 mm", "40 mm"]]
boxes.regions = [
    { name = "gap", box = [["0 mm", "0 mm", "5 mm"], ["30 mm", "30 mm", "20 mm"]], size = ["5 mm", "5 mm", "5 mm"] },
    { name = "block", box = [["0 mm", "0 mm", "0 mm"], ["20 mm", "20 mm", "5 mm"]], size = ["5 mm", "5 mm", "2.5 mm"] },
]
[materials.iron]
relative_permeability = 100
[regions.block]
material = "iron"
[analysis]
frequency = 0
[boundaries]
flux_parallel = ["x_min", "y_min"]
flux_normal = ["z_min"]
uniform_field = { surfaces = ["x_max", "y_max", "z_max"], b = ["0 T", "0 T", "1 mT"] }
[objective]
kind = "energy"
region = "block"
[[constraints]]
kind = "thickness"
minimum = "4 mm"
[design]
surface = "block|gap"
direction = [0, 0, 1]
lower = "-1 mm"
upper = "1 mm"
[remesh]
region = ["gap"]
"#;

#[test]
fn the_thickness_of_a_body_that_a_plane_halves_is_said_to_be_that_of_the_half() {
    let home = folder();
    let path = home.path().join("halved.toml");
    std::fs::write(&path, HALVED).expect("a configuration");
    let checked = finish(&mut command(&[&"check", &path])).exits_with(0);
    let said = "design nodes ends at `z_min`, at the outside of the mesh, and is that of the meshed part";
    assert!(checked.stderr.contains(said), "{}", checked.stderr);
    // On halved edges no thickness is measured.
    let solved = finish(&mut command(&[&"solve", &path, &"--refine", &"1"])).exits_with(0);
    let left_out = "constraints on the shape are not looked at on a refined mesh: `thickness`";
    assert!(solved.stderr.contains(left_out), "{}", solved.stderr);
}

/// The same block as a perfect conductor, two cells thick: the mesh that is solved on has no nodes within the cut.
#[test]
fn bounds_of_a_body_that_its_surface_replaces_leave_some_of_it_where_a_plane_cuts_it() {
    let home = folder();
    let check = |lower: &str| {
        let changes = [
            ("material = \"iron\"", "material = \"iron\"\nmodel = \"perfect\""),
            ("kind = \"energy\"\nregion = \"block\"", "kind = \"energy\""),
            ("lower = \"-1 mm\"", lower),
        ];
        let path = home.path().join("replaced.toml");
        std::fs::write(&path, changed(HALVED, &changes)).expect("a configuration");
        finish(&mut command(&[&"check", &path]))
    };
    let found = check("lower = \"-1 mm\"");
    assert!(found.stdout.contains("5.000 to 5.000 mm initially"), "{}", found.stdout);
    found.with(0, &["25 of 25 design nodes ends at `z_min`, at the outside of the mesh"]);
    check("lower = \"-6 mm\"").with(3, &["the body is 5.000 mm thick", "nothing would be left of it"]);
}
