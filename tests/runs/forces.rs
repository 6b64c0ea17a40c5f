//! Forces that mean little, or cannot be taken: said by `check`.

use crate::plausible::{MAGNET, set, texts};
use crate::support::program::{command, finish, folder};
use crate::support::repository;
use crate::support::shield::quick;

#[test]
fn a_force_on_air_and_one_on_a_part_of_the_iron_are_asked_about() {
    let with = |region: &str, more: &[&str]| {
        let forces = format!("forces=[{{name=\"body\",regions=[\"{region}\"]}}]");
        // A winding that leaves a layer of air around the tip.
        let wide = ["coils[0].half_window=[\"95 mm\",\"95 mm\"]", "coils[0].width=\"20 mm\"", &forces];
        let mut checked = command(&[&"check", &repository("configs/pole.toml"), &"--json"]);
        texts(&finish(checked.args(set(&[&wide[..], more].concat()))).exits_with(0).json()["warnings"])
    };
    let of = |region: &str| with(region, &[]);
    let air = of("observation");
    assert!(air.contains("no force acts on the body `body`: nothing in `observation`"), "{air}");
    // The air around it holds the winding, whose force it is.
    assert!(!of("air").contains("no force acts"));
    let part = of("tip");
    assert!(part.contains("`body` touches the iron of `iron`"), "{part}");
    // Of no permeability of its own, and beside linear iron.
    let magnet = ["materials.ferrite={}", "regions.tip={material=\"ferrite\",remanence=[0,0,\"0.4 T\"]}"];
    let part = with("tip", &magnet);
    assert!(part.contains("`body` touches the iron of `iron`"), "{part}");
    let alone = finish(&mut command(&[&"check", &repository("configs/actuator.toml"), &"--json"]));
    assert_eq!(texts(&alone.exits_with(0).json()["warnings"]), "");
}

#[test]
fn a_force_beside_the_surface_of_a_conductor_is_refused() {
    let forces = "forces=[{name=\"body\",regions=[\"observation\",\"remesh\"]}]";
    let refused = finish(command(&[&"check", &quick()]).args(set(&[forces]))).exits_with(3).stderr;
    let said = "`body` touches the surface that stands for `plate`";
    assert!(refused.contains(said) && refused.contains("a layer of air"), "{refused}");
}

/// Also of a body whose elements are not there, as the coil feels it.
#[test]
fn a_force_on_a_conductor_that_its_surface_replaces_is_reported() {
    let home = folder();
    let solved = |name: &str, sets: &[&str]| {
        let out = home.path().join(name);
        let mut solve = command(&[&"solve", &quick(), &"--out", &out, &"--json"]);
        finish(solve.args(set(sets))).exits_with(0).json()
    };
    let forces = "forces=[{name=\"plate\",regions=[\"plate\"]}]";
    let nodal = solved("nodal", &[forces]);
    let force = |result: &serde_json::Value| result["forces"][0]["force_n"][2].as_f64().expect("a number");
    let edge = solved("edge", &[forces, "analysis.elements=\"edge\""]);
    // The plate is pulled against z; both are within their error bars of 29 and 15 N.
    let bar = |result: &serde_json::Value| {
        2.0 * result["errors"]["forces"]["plate"]["force_n"].as_f64().expect("one")
    };
    let (found, bars) = ([&nodal, &edge].map(force), [&nodal, &edge].map(bar));
    assert!((found[0] - found[1]).abs() < bars[0] + bars[1] && found[1] > 60.0, "{found:?} {bars:?}");
    assert!(!texts(&nodal["warnings"]).contains("no force acts"), "{nodal}");
}

#[test]
fn a_force_across_a_plane_that_cuts_its_body_is_asked_about() {
    let along = |direction: &str| {
        let direction = format!("objective.direction={direction}");
        let mut checked = command(&[&"check", &repository("configs/actuator.toml"), &"--json"]);
        texts(&finish(checked.args(set(&[&direction]))).exits_with(0).json()["warnings"])
    };
    assert!(
        along("[1, 0, 0]").contains("the surface `x_min` cuts the body `armature`"),
        "{}",
        along("[1, 0, 0]")
    );
    assert!(!along("[0, 0, -1]").contains("cuts the body"));
}

/// The shell stands for all of space: the stress in it is not that of its elements.
#[test]
fn a_force_is_not_taken_in_the_shell_of_open_space() {
    let home = folder();
    let path = home.path().join("magnet.toml");
    std::fs::write(&path, format!("{MAGNET}\n[[forces]]\nname = \"magnet\"\nregions = [\"magnet\"]\n"))
        .expect("written");
    let with = |sets: &[&str]| finish(command(&[&"check", &path]).args(set(sets)));
    with(&[]).exits_with(0);
    let flush = "mesh.boxes.box=[[\"-10 mm\", \"-30 mm\", \"-30 mm\"], [\"30 mm\", \"30 mm\", \"30 mm\"]]";
    let touching = with(&[flush]).exits_with(3);
    assert!(
        touching.stderr.contains("the body touches or holds the shell of open space"),
        "{}",
        touching.stderr
    );
    let shell = with(&["forces[0].regions=[\"magnet\", \"open\"]"]).exits_with(3);
    assert!(shell.stderr.contains("the body touches or holds the shell of open space"), "{}", shell.stderr);
}
