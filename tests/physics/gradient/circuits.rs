//! Gradients of what coils are in circuits: inductances, losses at terminals, currents that voltages drive; and of the terms of
//! their field.

use fluxmorph_optimizer::problem::Problem;
use fluxmorph_optimizer::verify::Settings;

use super::{all_hold, all_hold_on, uneven};
use crate::support::device::COILS;
use crate::support::{changed, setup_of};

const BUSBAR: &str = include_str!("../../../configs/busbar.toml");

/// A bound on a kind of one coil or a pair, whatever its value.
fn bound(kind: &str, coils: &str, number: usize) -> String {
    format!("{{ name = \"{kind}_{number}\", kind = \"{kind}\", coils = [{coils}], lower = 1e-20 }},\n")
}

/// Every kind that has a meaning at rest.
fn static_kinds() -> String {
    let of_one = ["inductance", "flux_linkage"];
    let of_one = of_one.iter().flat_map(|kind| [bound(kind, "\"one\"", 1), bound(kind, "\"two\"", 2)]);
    of_one.chain([bound("mutual_inductance", "\"one\", \"two\"", 1), TERMS.to_owned()]).collect()
}

/// Terms of the field above the coils.
const TERMS: &str = r#"
    { name = "dipole", kind = "multipole", region = "circle", harmonics = ["b1"], lower = 1e-20 },
    { name = "content", kind = "multipole_content", region = "circle", harmonics = ["a2", "b3"], upper = 1 },
    { name = "slope", kind = "multipole", region = "ball", harmonics = ["c1_0"], upper = 1 },
    { name = "ball_content", kind = "multipole_content", region = "ball", harmonics = ["c1_0", "c2_0", "c2_2"], upper = 1 },
"#;

/// Every other kind.
fn harmonic_kinds() -> String {
    let of_one = ["resistance", "quality_factor", "voltage", "power", "power_factor"];
    let of_one = of_one.iter().flat_map(|kind| [bound(kind, "\"one\"", 1), bound(kind, "\"two\"", 2)]);
    of_one.chain([bound("link_efficiency", "\"two\", \"one\"", 1)]).collect()
}

/// The coils with constraints and changes.
fn problem(constraints: &str, changes: &[(&str, &str)]) -> Problem {
    setup_of(&format!("constraints = [{constraints}]\n{}", changed(COILS, changes))).problem
}

#[test]
fn what_coils_are_is_exact_in_statics() {
    for (order, directions) in [("order = 1", 2), ("order = 2", 1)] {
        let order = format!("frequency = 0\n{order}");
        let changes = [("frequency = \"200 Hz\"", order.as_str()), ("phase = \"30 deg\"\n", "")];
        let problem = problem(&static_kinds(), &changes);
        all_hold(&problem, &uneven(&problem), &Settings { directions, ..Settings::default() });
    }
}

#[test]
fn what_coils_are_is_exact_over_a_conductor_in_both_families() {
    let kinds = format!("{}{}", static_kinds(), harmonic_kinds());
    all_hold_on(&problem(&kinds, &[]), uneven);
    let nodal = [("elements = \"edge\"", "elements = \"nodal\""), ("permeability = 2", "permeability = 1")];
    all_hold_on(&problem(&kinds, &nodal), uneven);
}

#[test]
fn what_coils_are_is_exact_over_an_impedance_surface() {
    let kinds = format!("{}{}", static_kinds(), harmonic_kinds());
    let thin = [
        ("material = \"metal\"", "material = \"metal\"\nmodel = \"impedance\""),
        ("region = [\"gap\", \"plate\"]", "region = \"gap\""),
        ("frequency = \"200 Hz\"", "frequency = \"20 kHz\""),
        ("free = [\"face\"]", ""),
    ];
    all_hold_on(&problem(&kinds, &thin), uneven);
}

/// A voltage drives one coil through a capacitor, the other is short-circuited: both currents follow the shape.
#[test]
fn currents_that_voltages_drive_follow_the_shape() {
    let driven = [
        ("ampere_turns = \"100 A\"", "voltage = \"1 V\"\nphase = \"20 deg\"\nseries_capacitance = 0.2"),
        ("ampere_turns = \"20 A\"", "voltage = \"0 V\"\nseries_inductance = \"1 uH\""),
    ];
    let of_one = ["current", "voltage", "flux_linkage", "power", "power_factor"];
    let mut kinds: String = of_one.iter().map(|kind| bound(kind, "\"one\"", 1)).collect();
    kinds += &bound("current", "\"two\"", 2);
    kinds += r#"{ kind = "loss", region = "plate", upper_ratio = 2 }"#;
    all_hold_on(&problem(&kinds, &driven), uneven);
}

/// A plate in the window of a coil: the load of a patch whose outline stays does not change with the mesh in it.
#[test]
fn what_moves_in_the_window_of_a_coil_is_exact() {
    let around = [
        ("shape = \"circular\"", "shape = \"rectangular\""),
        (
            "center = [\"0 mm\", \"0 mm\", \"3 mm\"]\nradius = \"22 mm\"\nwidth = \"8 mm\"\nheight = \"6 mm\"",
            "center = [\"0 mm\", \"0 mm\", \"-6 mm\"]\nhalf_window = [\"58 mm\", \"58 mm\"]\nwidth = \"8 mm\"\nheight = \"20 mm\"",
        ),
    ];
    let with = |kinds: &str, changes: &[(&str, &str)]| problem(kinds, &[&around, changes].concat());
    let kinds = format!("{}{}", static_kinds(), harmonic_kinds());
    all_hold_on(&with(&kinds, &[]), uneven);
    all_hold_on(&with(&kinds, &[("elements = \"edge\"", "elements = \"nodal\"\norder = 2")]), uneven);
    let driven = [("ampere_turns = \"100 A\"", "voltage = \"1 V\"")];
    let kinds: String =
        ["current", "flux_linkage", "power"].iter().map(|kind| bound(kind, "\"one\"", 1)).collect();
    all_hold_on(&with(&kinds, &driven), uneven);
}

/// The constraint of the busbar, and one of its loss.
const OF_BAR: &str = r#"
    { kind = "volume", region = "bar", upper_ratio = 1.0 },
    { kind = "loss", region = "bar", upper_ratio = 2 },
"#;

/// A busbar whose own face moves: what it is as a coil, at a current and at a voltage.
#[test]
fn what_a_solid_conductor_is_follows_its_own_face() {
    let of = |kinds: &[&str], changes: &[(&str, &str)]| {
        let kinds: String = kinds.iter().map(|kind| bound(kind, "\"bar\"", 1)).collect();
        let order = ("order = 2", "order = 1\nlinear_solver = { tolerance = 1e-13 }");
        let coarse = ("size = [\"2 mm\", \"2 mm\", \"4 mm\"]", "size = [\"4 mm\", \"4 mm\", \"4 mm\"]");
        let own = ("[[constraints]]\nkind = \"volume\"\nregion = \"bar\"\nupper_ratio = 1.0\n", "");
        let text = changed(BUSBAR, &[&[own, order, coarse], changes].concat());
        setup_of(&format!("constraints = [{OF_BAR}{kinds}]\n{text}")).problem
    };
    all_hold_on(&of(&["inductance", "quality_factor", "voltage", "power", "power_factor"], &[]), uneven);
    let voltage = "voltage = \"2 mV\"\nresistance = \"0.001 mohm\"\nseries_inductance = \"1 nH\"";
    let driven = [("ampere_turns = \"1 kA\"", voltage)];
    all_hold_on(&of(&["current", "flux_linkage", "power", "power_factor"], &driven), uneven);
    let nodal = [("elements = \"edge\"", "elements = \"nodal\"")];
    all_hold_on(&of(&["inductance", "voltage"], &nodal), uneven);
}
