//! The force on a conductor behind its surface.

use crate::plausible::{set, texts};
use crate::support::device::written;
use crate::support::folder::{RunFolder, vectors};
use crate::support::program::{command, finish, folder};
use crate::support::shield::quick;

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

/// Of two bodies with a region in common the first is drawn.
#[test]
fn the_forces_of_a_field_file_count_a_region_once() {
    let home = folder();
    let bodies = "[[forces]]\nname = \"iron\"\nregions = [\"iron\"]\n\n\
                  [[forces]]\nname = \"both\"\nregions = [\"gap\", \"iron\"]\n\n[objective]";
    let out = home.path().join("out");
    finish(&mut written("block", home.path(), &[("[objective]", bodies)]).command("solve", &out)).completed();
    let run = RunFolder(out);
    let (field, result) = (run.field(0), run.result());
    let nodal = vectors(&field.point_data["force"]);
    for d in 0..3 {
        let sum: f64 = nodal.iter().map(|force| force[d]).sum();
        let own = result["forces"][0]["force_n"][d].as_f64().expect("a number");
        assert!((sum - own).abs() <= 1e-9 * own.abs() && own != 0.0, "{sum} {own}");
    }
}
