//! What lies behind the outer faces of a mesh: walls that cut a field off, and images of what symmetry planes cut.

use serde_json::Value;

use super::plausible::{set, texts};
use crate::support::folder::{number, read_json, read_text};
use crate::support::program::{command, finish, folder};
use crate::support::shield::quick;
use crate::support::{changed, repository};

/// The wall beside the coil is a wall, although an element that the coil meets reaches it.
#[test]
fn a_near_wall_is_named_with_the_error_that_no_bar_has() {
    let wall = |half: &str| {
        let half = format!("coils[0].half_window=[\"{half}\", \"60 mm\"]");
        let checked =
            finish(command(&[&"check", &quick(), &"--json"]).args(set(&[&half]))).exits_with(0).json();
        (checked["truncation"]["surface"].clone(), number(&checked, "/truncation/distance_m"))
    };
    let (far, near) = (wall("60 mm"), wall("560 mm"));
    println!("{far:?} {near:?}");
    assert_eq!(near.0, "x_max");
    assert!(near.1 < 0.05 && far.1 > 0.3);
    let home = folder();
    let near_wall = |name: &str, overrides: &[&str]| {
        let out = home.path().join(name);
        finish(command(&[&"solve", &quick(), &"--out", &out]).args(set(overrides))).exits_with(0);
        read_json(&out.join("result.json"))["accuracy"]["near_wall"].clone()
    };
    let estimated = "accuracy.estimate=true";
    let text = near_wall("walls", &[estimated]);
    assert!(
        text.as_str().is_some_and(|text| text.contains("no error bar counts what it cuts off")),
        "{text}"
    );
    let conditions = "boundaries.flux_parallel=[\"x_min\", \"y_min\"]";
    let open = "open.surfaces=[\"x_max\", \"y_max\", \"z_min\", \"z_max\"]";
    assert_eq!(near_wall("open", &[estimated, conditions, open]), Value::Null);
}

/// Walls are the sides of the mesh, whatever their names and conditions; a lone plane that flux passes is one of symmetry. What is
/// observed counts as coils and matter do.
#[test]
fn walls_are_known_by_where_they_are() {
    let wall = |overrides: &[&str]| {
        let json =
            finish(command(&[&"check", &quick(), &"--json"]).args(set(overrides))).exits_with(0).json();
        (json["truncation"]["surface"].clone(), number(&json, "/truncation/distance_m"))
    };
    let planes = "boundaries.flux_parallel=[\"x_min\", \"y_min\"]";
    let named = wall(&[]);
    assert_eq!(named.0, "z_min");
    assert_eq!(wall(&[planes]), named, "without conditions");
    let normal = "boundaries.flux_normal=[\"x_max\", \"y_max\", \"z_min\", \"z_max\"]";
    assert_eq!(wall(&[planes, normal]), named, "flux passes them");
    let sides = "boundaries.flux_parallel=[\"x_min\", \"y_min\", \"x_max\", \"y_max\", \"z_max\"]";
    let lone = wall(&[sides, "boundaries.flux_normal=[\"z_min\"]"]);
    assert!(lone.0 != "z_min" && lone.1 > named.1, "{lone:?} in place of {named:?}");
    let with_probe = |height: &str| {
        wall(&[&format!("probes=[{{name = \"far\", points = [[\"0 mm\", \"0 mm\", \"{height}\"]]}}]")])
    };
    let observed = with_probe("-380 mm");
    assert!(observed.0 == "z_min" && (0.015..0.025).contains(&observed.1), "{observed:?}");
    // In a plane at which something is observed the device goes on behind it.
    assert_ne!(with_probe("-400 mm").0, "z_min");
}

/// The field is left normal to it, as to a flux-normal one.
#[test]
fn a_side_without_condition_that_cuts_a_magnet_is_named() {
    let home = folder();
    let sphere = read_text(&repository("configs/sphere.toml"));
    let said = |planes: &str| {
        let (before, rest) = sphere.split_once("flux_parallel").expect("conditions");
        let (_, after) = rest.split_once("\n\n").expect("tables behind them");
        let path = home.path().join("magnet.toml");
        let conditions = format!("flux_parallel = [{planes}]\nflux_normal = [\"z_min\"]");
        std::fs::write(&path, format!("{before}{conditions}\n\n{after}")).expect("written");
        let magnet = set(&["analysis.frequency=0", "regions.sphere.remanence=[0, 1, 1]"]);
        let json = finish(command(&[&"check", &path, &"--json"]).args(magnet)).exits_with(0).json();
        texts(&json["warnings"]).contains("is cut by an outer side without condition, at which")
    };
    assert!(said("\"y_min\", \"outer\"") && !said("\"x_min\", \"y_min\""));
}

/// Of a component that all planes of symmetry keep the mean is the device's; of another one only that of the meshed part. The pole's
/// observation ends at two flux-parallel planes and at a flux-normal one, which keep the component along z.
#[test]
fn the_homogeneity_of_a_component_that_images_change_is_asked_about() {
    let home = folder();
    let pole = read_text(&repository("configs/pole.toml"));
    let said = |direction: &str| {
        let objective = format!("kind = \"homogeneity\"\ndirection = {direction}");
        let target = "target = [0.0, 0.0, \"0.5 T\"]\n";
        let text = changed(&pole, &[("kind = \"target_field\"", &objective), (target, "")]);
        let path = home.path().join("pole.toml");
        std::fs::write(&path, text).expect("written");
        let json = finish(&mut command(&[&"check", &path, &"--json"])).exits_with(0).json();
        texts(&json["warnings"]).contains("behind `x_min` the images of `observation` have another component")
    };
    assert!(said("[1, 0, 1]") && said("[1, 0, 0]") && !said("[0, 0, 1]"));
}
