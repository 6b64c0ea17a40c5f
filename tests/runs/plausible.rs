//! What can be computed and cannot be meant: said by `check` where it can be known, and at the end of a run where it cannot.

use std::path::Path;

use serde_json::Value;

use crate::support::device::written;
use crate::support::folder::{RunFolder, list, number, read_text};
use crate::support::program::{command, finish, folder};
use crate::support::repository;
use crate::support::shield::quick;

/// The quick shield with its plate meshed.
const MESHED: [&str; 2] = ["regions.plate.model=volume", "remesh.region=[\"plate\", \"remesh\"]"];

pub(super) fn set<'a>(overrides: &[&'a str]) -> Vec<&'a str> {
    overrides.iter().flat_map(|one| ["--set", *one]).collect()
}

/// The warnings of `check`.
fn check(overrides: &[&str]) -> String {
    let json = finish(command(&[&"check", &quick(), &"--json"]).args(set(overrides))).exits_with(0).json();
    texts(&json["warnings"])
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
fn magnets_and_metals_that_do_not_exist_or_are_mirrored_reversed_are_warned_of() {
    let sphere = repository("configs/sphere.toml");
    let magnet = |remanence: &str| {
        let own = format!("regions.sphere.remanence={remanence}");
        let sets = ["--set", "analysis.frequency=0", "--set", &own];
        texts(&finish(command(&[&"check", &sphere, &"--json"]).args(sets)).exits_with(0).json()["warnings"])
    };
    // The planes x_min and y_min are flux_parallel, z_min is flux_normal.
    let found = magnet("[1, 0, 0]");
    for part in [
        "the magnet `sphere` is cut by `x_min`, a surface of flux_parallel",
        "`z_min`, a surface of flux_normal",
    ] {
        assert!(found.contains(part), "no `{part}` in {found}");
    }
    assert!(!found.contains("y_min") && !found.contains("neodymium"), "along that plane it stays: {found}");
    let found = magnet("[0, 0, 1200]");
    assert!(found.contains("is 1200 T, more than any magnet has") && !found.contains("cut by"), "{found}");
    let found = check(&["materials.steel.conductivity=58"]);
    assert!(found.contains("\"58 MS/m\", where that is meant"), "{found}");
    assert!(check(&["materials.steel.conductivity=3.5e8"]).contains("more than any metal"));
    assert!(!check(&["materials.steel.conductivity=\"35 MS/m\""]).contains("metal"));
    let of_density = |density: &str| check(&[&format!("materials.steel.density={density}")]);
    assert!(of_density("7.85").contains("\"7.85 g/cm3\", where that is meant"));
    assert!(of_density("7.85e6").contains("osmium") && !of_density("7850").contains("density"));
}

#[test]
fn skins_are_audited_in_depth_at_the_bounds_and_of_the_result() {
    let thin = ["mesh.shield.skin=[\"0.4 mm\"]", "mesh.shield.side_skin=[\"0.5 mm\"]"];
    let found = check(&[&MESHED[..], &thin].concat());
    assert!(found.contains("below the first layer the elements are too thick"), "{found}");
    assert_eq!(check(&[]), "", "5 mm are 5.8 skin depths");
    let bound = "design.lower=-9 mm";
    let found = check(&[bound]);
    for part in
        ["at design.lower region `plate` is 1.000 mm thick", "1.2 skin depths", "kind = \"thickness\""]
    {
        assert!(found.contains(part), "no `{part}` in: {found}");
    }
    let home = folder();
    let found = solve(&home.path().join("out"), &[bound, "design.initial=-0.008"]);
    assert!(found.contains("region `plate` is 2.000 mm thick at its thinnest place"), "{found}");
}

#[test]
fn advice_does_not_go_in_a_circle() {
    // The plate of 10 mm is 3.6 skin depths thick.
    let slow = "analysis.frequency=6.7";
    let meshed = check(&[&MESHED[..], &[slow]].concat());
    assert!(meshed.contains("an impedance surface cannot stand for the region"), "{meshed}");
    assert!(!meshed.contains("model = \"impedance\""), "{meshed}");
    let surface = check(&[slow]);
    assert!(
        surface.contains("an impedance surface assumes") && surface.contains("thinner elements"),
        "{surface}"
    );
}

#[test]
fn two_windings_at_one_place_are_warned_of() {
    let home = folder();
    let text = read_text(&quick());
    let start = text.find("[[coils]]").expect("a coil");
    let coil = &text[start..text.find("[boundaries]").expect("boundaries")];
    let beside = |height: &str| {
        let twin = coil.replace("name = \"coil\"", "name = \"twin\"").replace("\"60 mm\"]", height);
        let config = home.path().join("twice.toml");
        std::fs::write(&config, text.replace(coil, &format!("{coil}{twin}"))).expect("written");
        texts(&finish(&mut command(&[&"check", &config, &"--json"])).exits_with(0).json()["warnings"])
    };
    let same = beside("\"60 mm\"]");
    assert!(same.contains("`coil` and `twin` are the same winding at the same place"), "{same}");
    // Windings 40 mm high.
    let overlapping = beside("\"80 mm\"]");
    assert!(
        overlapping.contains("the windings of the coils `coil` and `twin` overlap, at ("),
        "{overlapping}"
    );
    assert_eq!(beside("\"120 mm\"]"), "");
}

#[test]
fn a_frequency_at_which_the_field_is_a_wave_is_asked_about() {
    // The mesh is 1.3 m from corner to corner.
    let at = |frequency| check(&["analysis.elements=edge", frequency]);
    assert!(at("analysis.frequency=\"100 MHz\"").contains("a wave in air is 2.998 m long"));
    assert!(!at("analysis.frequency=\"10 MHz\"").contains("wave"));
}

#[test]
fn a_curve_in_another_unit_is_asked_about() {
    let with = |field: &str| {
        let sheet = format!("materials.sheet.bh=[[{field}, 0.5], [4000, 1.8], [2e5, 2.36]]");
        let conductivity = "materials.sheet.conductivity=\"1 MS/m\"";
        let own = [&sheet, conductivity, "regions.plate.material=sheet", "analysis.elements=edge"];
        check(&[&MESHED[..], &own].concat())
    };
    assert!(with("0.1").contains("more than any material: is H in A/m?"));
    assert!(!with("100").contains("is H in A/m?"));
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
fn a_quality_factor_without_the_loss_of_its_wire_is_asked_about() {
    let of = |kind: &str, more: &[&str]| {
        let (kind, config) = (format!("objective.kind=\"{kind}\""), repository("configs/coupled_coils.toml"));
        let mut checked = command(&[&"check", &config, &"--json", &"--set", &kind]);
        let coarse = set(&["mesh.boxes.refinement=0.5"]);
        texts(&finish(checked.args(coarse).args(set(more))).exits_with(0).json()["warnings"])
    };
    let said = "has no resistance, so that the";
    assert!(!of("link_efficiency", &[]).contains(said));
    let one = of("link_efficiency", &["coils[1].resistance=\"0 ohm\""]);
    assert!(
        one.contains(&format!("`receiver` {said} link efficiency")) && !one.contains("`pad` has no"),
        "{one}"
    );
    let factor = ["objective.coils=[\"pad\"]", "coils[0].resistance=\"0 ohm\""];
    let factor = of("quality_factor", &factor);
    assert!(factor.contains(&format!("`pad` {said} quality factor")), "{factor}");
}

#[test]
fn a_device_in_open_space_needs_no_condition() {
    let home = folder();
    let path = home.path().join("magnet.toml");
    std::fs::write(&path, MAGNET).expect("written");
    let json = finish(&mut command(&[&"check", &path, &"--json"])).exits_with(0).json();
    assert!(!texts(&json["warnings"]).contains("no surface has a condition"), "{}", json["warnings"]);
}

/// Rings in cells of their width, of twice and of ten times that have 10, 17 and 37 % too little.
#[test]
fn a_winding_thinner_than_its_elements_is_said_to_have_too_little_inductance() {
    let with = |sets: &[&str]| {
        let mut checked = command(&[&"check", &repository("configs/coupled_coils.toml"), &"--json"]);
        texts(&finish(checked.args(set(sets))).exits_with(0).json()["warnings"])
    };
    let text = with(&[]);
    assert!(text.contains("the winding of `receiver` is 4.000 mm across in cells of up to"), "{text}");
    // The pad, in cells of its ferrite's height, has 8 % less by first order than by second.
    assert!(
        text.contains("a leakage inductance and the current of a short circuit may be off by half and more")
    );
    assert!(text.contains("the winding of `pad` is 6.000 mm across in cells of up to 14.779 mm"), "{text}");
    // By second order both are as wide as their cells, once they are thicker.
    let thicker = ["mesh.boxes.refinement=1.3", "coils[1].width=\"40 mm\"", "coils[1].height=\"20 mm\""];
    let text = with(&[&["analysis.order=2"], &thicker[..]].concat());
    assert!(!text.contains("mm across in cells of up to"), "{text}");
}

/// A frame with two windows, and a coil around one of them: its current parts.
const FRAME: &str = r#"
[mesh]
generator = "boxes"

[mesh.boxes]
box = [["-60 mm", "-40 mm", "-30 mm"], ["60 mm", "40 mm", "30 mm"]]
growth = 1.8

[[mesh.boxes.regions]]
name = "frame"
box = [["-30 mm", "-18 mm", "-3 mm"], ["30 mm", "18 mm", "3 mm"]]
size = "3 mm"

[[mesh.boxes.regions]]
name = "air"
box = [["-24 mm", "-12 mm", "-3 mm"], ["-3 mm", "12 mm", "3 mm"]]

[[mesh.boxes.regions]]
name = "air"
box = [["3 mm", "-12 mm", "-3 mm"], ["24 mm", "12 mm", "3 mm"]]

[analysis]
frequency = 0

[[coils]]
name = "frame"
region = "frame"
ampere_turns = "100 A"
center = ["-13 mm", "0 mm", "0 mm"]

[open]
surfaces = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"]
"#;

#[test]
fn a_winding_that_branches_is_no_noise() {
    let home = folder();
    let path = home.path().join("frame.toml");
    let notices = |text: &str| {
        std::fs::write(&path, text).expect("written");
        let checked = finish(&mut command(&[&"check", &path])).exits_with(0);
        checked.stdout + &checked.stderr
    };
    let (branched, noise) = ("the region branches", "off from element to element");
    let text = notices(FRAME);
    assert!(text.contains(branched) && !text.contains(noise), "{text}");
    // A frame with one window bends four times, and no more.
    let text =
        notices(&FRAME.replace("[[\"3 mm\", \"-12 mm\", \"-3 mm\"]", "[[\"-3 mm\", \"-12 mm\", \"-3 mm\"]"));
    assert!(!text.contains(branched) && text.contains(noise), "{text}");
}

/// A cube of 20 mm in a box, whole.
pub(super) const MAGNET: &str = r#"
[mesh]
generator = "boxes"

[mesh.boxes]
box = [["-30 mm", "-30 mm", "-30 mm"], ["30 mm", "30 mm", "30 mm"]]

[[mesh.boxes.regions]]
name = "magnet"
box = [["-10 mm", "-10 mm", "-10 mm"], ["10 mm", "10 mm", "10 mm"]]
cells = [2, 2, 2]

[analysis]
elements = "edge"
order = 1
frequency = 0

[materials.ndfeb]
relative_permeability = 1.05

[regions.magnet]
material = "ndfeb"
remanence = [0, 0, "1.2 T"]

[open]
surfaces = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"]
"#;

/// A slab across the lower part of a box, in a field along it.
const SLAB: &str = r#"
[mesh]
generator = "boxes"

[mesh.boxes]
box = [["0 mm", "0 mm", "0 mm"], ["30 mm", "30 mm", "30 mm"]]

[[mesh.boxes.regions]]
name = "slab"
box = [["0 mm", "0 mm", "0 mm"], ["30 mm", "30 mm", "10 mm"]]
cells = [2, 2, 2]

[analysis]
elements = "edge"
order = 1
frequency = "50 Hz"

[materials.copper]
conductivity = "5.8e7 S/m"

[regions.slab]
material = "copper"

[boundaries]
flux_parallel = ["z_min"]
uniform_field = { surfaces = ["x_min", "x_max", "y_min", "y_max", "z_max"], b = [1e-3, 0, 0] }
"#;

/// Eddy currents that reach the surfaces of an applied field depend on its center; a region without a field has no outer faces.
#[test]
fn conductors_at_the_surfaces_of_an_applied_field_are_asked_about() {
    let home = folder();
    let path = home.path().join("slab.toml");
    std::fs::write(&path, SLAB).expect("written");
    let with = |sets: &[&str]| {
        let checked = finish(command(&[&"check", &path, &"--json"]).args(set(sets))).exits_with(0);
        texts(&checked.json()["warnings"])
    };
    let asked = "the conductor `slab` reaches `x_min`, where the applied field is given";
    assert!(with(&[]).contains(asked), "{}", with(&[]));
    assert!(!with(&["analysis.frequency=0"]).contains(asked));
    let in_its_face = "boundaries.uniform_field.center=[0, 0, \"10 mm\"]";
    let perfect = ["regions.slab.model=perfect", "boundaries.flux_parallel=[]", in_its_face];
    assert!(!with(&perfect).contains(asked));
}

#[test]
fn a_current_along_a_wall_that_mirrors_it_reversed_is_asked_about() {
    let with = |walls: &str| {
        let walls = format!("boundaries.flux_parallel={walls}");
        let mut checked = command(&[&"check", &repository("configs/busbar.toml"), &"--json"]);
        texts(&finish(checked.args(set(&[&walls]))).exits_with(0).json()["warnings"])
    };
    // The current crosses its terminals; y_min, the middle of its height, cuts the bar along it.
    assert_eq!(with("[\"z_min\", \"z_max\", \"x_min\", \"x_max\", \"y_max\"]"), "");
    let cut = with("[\"z_min\", \"z_max\", \"x_min\", \"x_max\", \"y_min\", \"y_max\"]");
    assert!(cut.contains("the current of the coil `bar` runs along `y_min`"), "{cut}");
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
fn a_permeability_far_below_one_or_beyond_all_is_asked_about() {
    assert!(check(&["materials.steel.relative_permeability=1e9"]).contains("more than any"));
    assert!(!check(&["materials.steel.relative_permeability=1e6"]).contains("more than any"));
    let found = check(&["materials.odd.relative_permeability=0.0025"]);
    assert!(found.contains("the material `odd` has the relative permeability 0.0025"), "{found}");
    assert!(!check(&["materials.odd.relative_permeability=0.9998"]).contains("`odd` has the relative"));
}

/// Iron whose permeability was forgotten is air to a static field.
#[test]
fn a_design_that_no_field_sees_is_asked_about() {
    let said = "both sides of the design surface `plate_bottom` are alike to the field";
    let forgotten = ["materials.steel.relative_permeability=1", "analysis.elements=edge"];
    let at = |frequency| check(&[&MESHED[..], &forgotten, &[frequency]].concat());
    assert!(at("analysis.frequency=0").contains(said));
    assert!(!at("analysis.frequency=60").contains(said), "it conducts");
    assert!(!check(&[]).contains(said), "an impedance surface is none of air");
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

#[test]
fn surfaces_that_move_otherwise_than_they_are_said_to_are_asked_about() {
    let found = check(&["remesh.fixed=[\"plate_bottom\"]"]);
    assert!(
        found.contains("nodes of `plate_bottom` in remesh.fixed belong to the design and move with it"),
        "{found}"
    );
    // Of the side the design has the lower edge, which its rim may hold.
    let side = ["remesh.slide=[\"x_min\", \"y_min\"]", "remesh.fixed=[\"plate_side\"]"];
    assert!(check(&side).contains("nodes of `plate_side` in remesh.fixed"));
    assert!(!check(&[&side[..], &["design.rim=fixed"]].concat()).contains("in remesh.fixed"));
    let slid = check(&["remesh.slide=[\"x_min\", \"y_min\", \"plate_bottom\"]"]);
    assert!(slid.contains("`plate_bottom` in remesh.slide is a design surface"), "{slid}");
    let said = "`remesh|air` in remesh.free is a face of `air` beyond what moves: its elements there are dragged along";
    assert!(check(&["remesh.free=[\"remesh|air\"]"]).contains(said));
    // The other side of the plate moves too, unless it is held.
    let of = |more: &[&str]| check(&[&MESHED[..], &["remesh.free=[\"plate|remesh\"]"], more].concat());
    let said = "`plate|remesh` in remesh.free has faces across";
    assert!(of(&[]).contains(said) && !of(&[]).contains("dragged along"));
    assert!(!of(&["remesh.fixed=[\"plate_top\"]"]).contains(said));
}

/// What is as light as it can be is at its bounds, unless the field has to do something.
#[test]
fn the_lightest_device_of_all_is_asked_about() {
    let said = "no constraint is on the field: no field has a say in the optimum";
    let least = repository("configs/shield_least_mass.toml");
    let warnings = |overrides: &[&str]| {
        let mut checked = command(&[&"check", &least, &"--json"]);
        texts(&finish(checked.args(set(overrides))).exits_with(0).json()["warnings"])
    };
    assert!(!warnings(&[]).contains(said));
    assert!(warnings(&["constraints=[]"]).contains(said));
}

#[test]
fn a_tolerance_that_no_mesh_is_refined_for_is_said_by_check() {
    let said = "accuracy.tolerance needs analysis.order = 1";
    let tolerance = ["analysis.elements=edge", "accuracy.tolerance=5 %"];
    assert!(check(&[&tolerance[..], &["analysis.order=2"]].concat()).contains(said));
    assert!(!check(&tolerance).contains("accuracy.tolerance needs"));
}

/// Whatever its material has.
#[test]
fn a_perfect_conductor_is_no_iron() {
    let nodal = ["analysis.elements=nodal", "regions.plate.model=perfect"];
    let material = |mu: u32| format!("materials.steel={{ relative_permeability = {mu}, conductivity = 0 }}");
    let [iron, none] = [5000, 1].map(|mu| check(&[&nodal[..], &[&material(mu)]].concat()));
    assert_eq!(iron, none);
}

#[test]
fn degrees_without_their_unit_are_asked_about() {
    let said = "coils[0].phase is 14.3 turns: if degrees are meant";
    assert!(check(&["coils[0].phase=90"]).contains(said));
    assert!(!check(&["coils[0].phase=90 deg"]).contains("turns"));
}

/// A loss adds up over loads, a mean of the field does not.
#[test]
fn a_bound_on_a_sum_over_states_is_asked_about() {
    let field = "constraints=[{kind=\"field_component\", region=\"observation\", direction=[0, 0, 1], upper=\"1 T\"}]";
    let said = "bounds the sum of the field_component over 2 states, and none by itself";
    let of =
        |constraint: &str| check(&["loads=[{name=\"a\"}, {name=\"b\", frequency=\"50 Hz\"}]", constraint]);
    assert!(of(field).contains(said));
    let of_one = field.replace("upper", "load=\"a\", upper");
    let loss = "constraints=[{kind=\"loss\", region=\"plate\", upper=\"1 W\"}]";
    assert!(!of(&of_one).contains("sum") && !of(loss).contains("sum"));
}
