//! Every kind of objective and constraint, in statics and harmonics, with a meshed plate and with its impedance surface.

use std::io::Write;

use fluxmorph::build::{Mode, set_up};
use fluxmorph::config::Config;
use fluxmorph_optimizer::problem::Problem;

use super::{MESHED, all_hold_on, wavy};
use crate::problems::analysed;
use crate::support::folder::read_text;
use crate::support::shield::quick;

/// The quick shield with another objective, lists before its tables, and overrides.
fn problem(objective: &str, lists: &str, frequency: &str, overrides: &[&str]) -> Problem {
    let text = read_text(&quick()).replace("frequency = \"60 Hz\"", frequency);
    let (start, rest) = text.split_once("[objective]").expect("it has an objective");
    let (_, end) = rest.split_once("[design]").expect("a design follows");
    let mut file = tempfile::Builder::new().suffix(".toml").tempfile().expect("a temporary file");
    write!(file, "{lists}\n{start}[objective]\n{objective}\n[design]{end}").expect("written");
    let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
    let (config, source) = Config::from_file(file.path(), &overrides).unwrap_or_else(|e| panic!("{e}"));
    set_up(&config, &source, Mode::Optimisation).unwrap_or_else(|e| panic!("{e}")).problem
}

/// Constraints on what does not need eddy currents.
const FIELD: &str = r#"
    { kind = "target_field", region = "observation", target = ["0 T", "1 mT", "5 mT"], upper_ratio = 0.9 },
    { kind = "field_component", region = "observation", direction = [0.2, -0.1, 1.0], upper = "1 T" },
    { kind = "energy", upper = "1 kJ" },
    { name = "energy_around", kind = "energy", region = "remesh", upper = "1 kJ" },
"#;

/// Constraints on the loss and on the shape.
const REST: &str = r#"
    { kind = "loss", region = "plate", upper = "1 kW" },
    { kind = "volume", region = "plate", upper_ratio = 1.1 },
    { kind = "thickness", minimum = "8 mm", maximum = "15 mm" },
"#;

const OBSERVED: &str = "region = \"observation\"";

#[test]
fn every_kind_is_exact_in_the_volume_model() {
    // The upper face of the plate follows the elastic body, and its thickness counts both.
    let free = [&MESHED[..], &["remesh.free=[\"plate_top\"]"]].concat();
    all_hold_on(&problem(OBSERVED, &format!("constraints = [{FIELD}{REST}]"), "frequency = 60", &free), wavy);
}

#[test]
fn every_kind_is_exact_in_the_impedance_model() {
    all_hold_on(&problem(OBSERVED, &format!("constraints = [{FIELD}{REST}]"), "frequency = 60", &[]), wavy);
}

#[test]
fn every_kind_is_exact_in_statics() {
    let inside = r#"{ kind = "energy", region = "plate", name = "inside", upper = "1 J" }"#;
    // Nodal elements are refused beside iron in statics.
    let overrides = [&MESHED[..], &["analysis.elements=edge"]].concat();
    all_hold_on(
        &problem(OBSERVED, &format!("constraints = [{FIELD}{inside}]"), "frequency = 0", &overrides),
        wavy,
    );
}

/// Two frequencies; one term at each, one at both and one of the shape alone, with weights that make them alike in size.
const SUM: &str = r#"goal = "maximise"
terms = [
    { region = "observation", weight = -1e3 },
    { kind = "loss", region = "plate", frequency = "60 Hz", weight = -1e-2 },
    { kind = "energy", frequency = "200 Hz", weight = -0.1 },
    { kind = "volume", region = "plate", weight = -1e4 },
]
"#;

const TWICE: &str = r#"constraints = [
    { kind = "loss", region = "plate", upper = "1 kW" },
    { kind = "loss", name = "at_200", region = "plate", upper = "1 kW", frequency = "200 Hz" },
]"#;

#[test]
fn sums_over_two_frequencies_are_exact() {
    let problem = problem(SUM, TWICE, "frequencies = [60, 200]", &[]);
    assert_eq!(problem.states().len(), 2);
    let analysis = analysed(&problem, &wavy(&problem));
    let terms = &problem.objective().expect("an objective").terms;
    for (term, value) in terms.iter().zip(&analysis.terms) {
        println!("{}: {:e}", term.label.kind, term.weight * value);
        assert!(
            term.weight * value / analysis.objective.expect("an objective") > 0.05,
            "every term has a say"
        );
    }
    // The volume counts once, whatever the number of frequencies.
    let volume = analysis.terms[3] / (0.12 * 0.24);
    assert!((0.012..0.016).contains(&volume), "a plate of 10 mm that grows by 4 mm in the mean: {volume}");
    all_hold_on(&problem, wavy);
}

/// Observed where the mesh moves: cells that move along, and places that stay; an expansion there.
const WHERE_IT_MOVES: &str = r#"
multipoles = [
    { name = "ball", shape = "ball", center = ["20 mm", "60 mm", "-46 mm"], radius = "8 mm", order = 2 },
]
constraints = [
    { kind = "flux_density_squared", region = "observation", weighting = "volume", follow = "mesh", upper_ratio = 0.9 },
    { kind = "homogeneity", region = "observation", compare = "modulus", follow = "mesh", upper_ratio = 2 },
    { kind = "homogeneity", name = "in_space", region = "observation", follow = "space", upper_ratio = 2 },
    { kind = "field_component", region = "observation", direction = [0.2, -0.1, 1.0], follow = "space", upper = "1 T" },
    { kind = "multipole_content", region = "ball", harmonics = ["c1_0", "s2_1"], follow = "space", upper_ratio = 2 },
]
"#;

#[test]
fn observation_where_the_mesh_moves_is_exact_for_cells_that_follow_and_for_places_that_stay() {
    observed_where_it_moves(&[("nodal", 1, 60), ("edge", 1, 0)]);
}

#[test]
#[ignore = "minutes: many gradients of second order, and of edge elements with eddy currents"]
fn so_it_is_with_elements_of_second_order_and_edges_in_eddy_currents() {
    observed_where_it_moves(&[("edge", 1, 60), ("nodal", 2, 60), ("edge", 2, 60), ("edge", 2, 0)]);
}

/// Of elements and orders at frequencies [Hz].
fn observed_where_it_moves(cases: &[(&str, u8, u8)]) {
    let regions = "remesh.region=[\"plate\", \"remesh\", \"observation\"]";
    for (elements, order, frequency) in cases {
        let elements = [format!("analysis.elements={elements}"), format!("analysis.order={order}")];
        // What 1e-11 leaves is 2e-6 of the least of these differences.
        let exact = "analysis.linear_solver.tolerance=1e-13";
        let coarse = ["mesh.shield.refinement=0.25", "mesh.shield.skin=[\"2 mm\"]", regions, exact];
        let overrides = [&MESHED[..], &[&elements[0], &elements[1]], &coarse].concat();
        let objective = "region = \"observation\"\nfollow = \"space\"";
        println!("{elements:?} {frequency} Hz");
        let frequency = format!("frequency = {frequency}");
        all_hold_on(&problem(objective, WHERE_IT_MOVES, &frequency, &overrides), wavy);
    }
}
