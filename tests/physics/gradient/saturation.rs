//! Gradients through iron with a B–H curve: the state is the end of Newton's method, the adjoint one solve with its tangent.
//!
//! Nodal elements of first order, which no configuration may have beside iron, are measured in
//! `crates/solver/tests/saturation.rs` with the other three.

use fluxmorph_optimizer::problem::Problem;
use fluxmorph_optimizer::verify::Settings;

use super::{MESHED, wavy};
use crate::problems::analysed;
use crate::support::device::{BLOCK, SATURATED};
use crate::support::{changed, setup, setup_of};

/// A construction steel that saturates near 2 T; it ends saturated.
const STEEL: &str = "materials.steel={ bh = [[80, 0.1], [160, 0.3], [250, 0.6], [400, 0.95], [700, 1.25], [1500, 1.5], \
                     [4e3, 1.65], [1.2e4, 1.85], [4e4, 2.08], [1e5, 2.2], [2e5, 2.36]] }";

/// Constraints of every kind that a static field has, with force and torque on the plate.
const CONSTRAINTS: &str = "constraints=[\
    { kind = \"field_component\", region = \"observation\", direction = [0.2, -0.1, 1.0], upper = \"1 T\" }, \
    { kind = \"energy\", upper = \"1 kJ\" }, \
    { kind = \"energy\", name = \"inside\", region = \"plate\", upper = \"1 kJ\" }, \
    { kind = \"force\", region = \"shield\", direction = [0.3, -0.2, 1.0], upper = \"1 kN\" }, \
    { kind = \"torque\", region = \"shield\", direction = [1.0, 0.5, -0.3], upper = \"1 kN m\" }]";

/// What is relative to its own mean, terms of an expansion, and the flux linkage.
const QUALITY: &str = "constraints=[\
    { kind = \"homogeneity\", region = \"observation\", upper_ratio = 2 }, \
    { kind = \"homogeneity\", name = \"of_the_modulus\", region = \"observation\", compare = \"modulus\", upper_ratio = 2 }, \
    { kind = \"multipole\", region = \"ball\", harmonics = [\"c1_0\"], follow = \"space\", upper = 1 }, \
    { kind = \"multipole_content\", region = \"ball\", harmonics = [\"c1_0\", \"s2_1\"], follow = \"space\", \
     upper = 1 }, \
    { kind = \"flux_linkage\", coils = [\"coil\"], upper = \"1 Wb\" }]";

/// Where the field is expanded.
const BALL: &str = "multipoles=[{ name = \"ball\", shape = \"ball\", center = [\"20 mm\", \"60 mm\", \"-50 mm\"], \
                    radius = \"8 mm\", order = 2 }]";

/// Statics.
const AT_REST: [&str; 2] = ["analysis.frequency=\"0 Hz\"", CONSTRAINTS];

/// The same of a field that alternates: with the loss, and without a component, which has no sign.
const OF_AMPLITUDES: &str = "constraints=[\
    { kind = \"loss\", region = \"plate\", upper = \"1000 kW\" }, \
    { kind = \"flux_linkage\", coils = [\"coil\"], upper = \"1 Wb\" }, \
    { kind = \"energy\", upper = \"1 kJ\" }, \
    { kind = \"energy\", name = \"inside\", region = \"plate\", upper = \"1 kJ\" }, \
    { kind = \"force\", region = \"shield\", direction = [0.3, -0.2, 1.0], upper = \"1 kN\" }, \
    { kind = \"torque\", region = \"shield\", direction = [1.0, 0.5, -0.3], upper = \"1 kN m\" }]";

/// On the quick shield with linear edge elements, at a design that is flat nowhere.
fn all_hold(directions: usize, case: &[&str]) {
    let mut overrides = MESHED.to_vec();
    overrides.extend([
        "mesh.shield.refinement=0.3",
        "mesh.shield.skin=[\"4 mm\"]",
        "coils=[{ name = \"coil\", turns = 10, shape = \"racetrack\", ampere_turns = \"120 kA\", center = [\"0 mm\", \"0 mm\", \
         \"60 mm\"], axis = \"z\", half_window = [\"60 mm\", \"160 mm\"], width = \"20 mm\", height = \"40 mm\", \
         corner = \"mitred\" }]",
        "analysis.linear_solver.tolerance=1e-13",
        "forces=[{ name = \"shield\", regions = [\"plate\"], about = [\"10 mm\", \"-20 mm\", \"5 mm\"] }]",
        "materials.steel.relative_permeability=1",
        STEEL,
        "materials.steel.conductivity=2e6",
        "analysis.elements=\"edge\"",
    ]);
    overrides.extend(case);
    let problem = setup("shield_quick.toml", &overrides).problem;
    holds_saturated(&problem, &wavy(&problem), directions, case[0]);
}

/// The certificates of the objective and of all constraints, in steel that saturates.
fn holds_saturated(problem: &Problem, p: &[f64], directions: usize, name: &str) {
    let analysis = analysed(problem, p);
    let model = &problem.states()[0];
    let saturation =
        &fluxmorph_solver::saturation::by_region((model, &analysis.mesh, &analysis.solutions[0]))[0];
    let steps = analysis.solutions[0].newton_steps();
    println!("{name}: {steps} steps, {saturation:?}");
    assert!(saturation.share_beyond_knee > 0.05, "a part of the steel saturates");
    // At the points of the curve the second derivative of h jumps, so that a central difference errs by a part of its step and
    // not of the square of it: a quarter of a micrometre, which the tolerance of 1e-13 carries.
    let settings = Settings { directions, difference_step: 1e-5, ..Settings::default() };
    super::all_hold(problem, p, &settings);
}

#[test]
fn gradients_through_a_curve_are_exact_on_linear_edge_elements() {
    all_hold(2, &AT_REST);
}

/// On the block, whose mesh is one or two cells of everything.
#[test]
fn gradients_through_a_curve_are_exact_on_quadratic_elements() {
    for elements in ["edge", "nodal"] {
        let analysis = format!(
            "[analysis]\nelements = \"{elements}\"\norder = 2\nlinear_solver = {{ tolerance = 1e-13 }}\n"
        );
        let constraints = CONSTRAINTS.replace("plate", "iron").replace("shield", "iron");
        let about = "regions = [\"iron\"]\nabout = [0.01, -0.02, 0.005]\n";
        let further = [
            ("title = ", &*format!("{constraints}\ntitle = ")),
            ("[analysis]\n", &analysis),
            ("regions = [\"iron\"]\n", about),
            // Beyond the knee in a part of the iron only.
            ("b = [0.0, 0.0, 1.5]", "b = [0.0, 0.0, 0.9]"),
        ];
        let problem = setup_of(&changed(BLOCK, &[&SATURATED[..], &further].concat())).problem;
        assert_eq!(problem.constraints().len(), 5);
        holds_saturated(&problem, &super::uneven(&problem), 2, elements);
    }
}

#[test]
fn gradients_of_field_quality_and_flux_linkage_through_a_curve_are_exact() {
    all_hold(2, &["analysis.frequency=\"0 Hz\"", BALL, QUALITY]);
}

/// At a frequency at which the steel has a skin of some millimetres, so that its field has many phases.
#[test]
#[ignore = "minutes: just test-long; crates/solver/tests/saturation.rs has the differences of both families and orders"]
fn gradients_through_the_curve_of_amplitudes_are_exact() {
    all_hold(1, &["analysis.frequency=\"5 Hz\"", OF_AMPLITUDES]);
}
