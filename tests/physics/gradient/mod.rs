//! The gradient through the whole chain p → mesh → field → F, against Taylor's theorem and central differences.

use fluxmorph_geometry::NodeId;
use fluxmorph_optimizer::Error;
use fluxmorph_optimizer::problem::{Derivatives, NoProgress, Problem, SolverCache};
use fluxmorph_optimizer::verify::{Certificate, Certificates, Settings, certify, measure};
use fluxmorph_remesh::{MotionLaw, Moved};

use crate::problems::{initial, variables};
use crate::support::folder::read_text;
use crate::support::shield::quick;
use crate::support::{changed, setup, setup_of};

mod circuits;
mod functionals;
mod loads;
mod saturation;
mod sources;

/// Small meshes: the exactness of a discrete gradient does not depend on the mesh.
const MESHED: [&str; 5] = [
    "regions.plate.model=\"volume\"",
    "mesh.shield.skin=[\"1 mm\", \"4 mm\"]",
    "remesh.region=[\"plate\", \"remesh\"]",
    "remesh.stiffness=\"inverse_volume\"",
    "remesh.poisson=0.1",
];

/// In two directions.
fn holds(problem: &Problem, p: &[f64]) {
    check(&certified(problem, p, &brief()));
}

fn certified(problem: &Problem, p: &[f64], settings: &Settings) -> Certificate {
    certificates(problem, p, settings).objective
}

fn certificates(problem: &Problem, p: &[f64], settings: &Settings) -> Certificates {
    certify(problem, p, settings, &|| false, |_, _, _| {}).unwrap_or_else(|e| panic!("{e}"))
}

/// The certificates of the objective and of every constraint.
fn all_hold(problem: &Problem, p: &[f64], settings: &Settings) {
    let certificates = certificates(problem, p, settings);
    println!("objective {:e}", certificates.objective.objective);
    check(&certificates.objective);
    for named in &certificates.constraints {
        println!("{} {:e}", named.name, named.certificate.objective);
        check(&named.certificate);
    }
}

/// The same in two directions, on a design of the problem.
fn all_hold_on(problem: &Problem, design: fn(&Problem) -> Vec<f64>) {
    all_hold(problem, &design(problem), &brief());
}

/// Two random directions see any wrong part of a gradient that is not nearly orthogonal to both; the shield is measured in five.
fn brief() -> Settings {
    Settings { directions: 2, ..Settings::default() }
}

fn check(certificate: &Certificate) {
    for direction in &certificate.directions {
        println!(
            "slope {:.4}, central difference {:.2e} of {:.1e}",
            direction.slope, direction.error, direction.adjoint
        );
    }
    assert!(certificate.holds, "slope {}, error {:e}", certificate.least_slope, certificate.largest_error);
    assert!(certificate.directions[0].steps.len() >= 6);
}

/// As [`check`], with the number of directions that one function alone is measured in.
fn check_in_five(certificate: &Certificate) {
    check(certificate);
    assert!(certificate.directions.len() >= 5);
}

/// A design so near to where the mesh breaks that the first Taylor step cannot be taken both ways.
#[test]
fn the_steps_of_a_certificate_are_halved_where_the_mesh_does_not_carry_them() {
    let problem = crate::support::setup("shield_quick.toml", &["design.lower=\"-9.9 mm\""]).problem;
    let shape = problem.shape().expect("a shape");
    let thin: Vec<f64> = shape.lower().iter().map(|lower| 0.97 * lower).collect();
    let settings = Settings { directions: 1, halvings: 2, ..Settings::default() };
    let certificates = certify(&problem, &thin, &settings, &|| false, |_, _, _| {}).expect("a certificate");
    let certificate = &certificates.objective;
    let first = certificate.directions[0].steps[0];
    println!("first step {first:e}, slope {:.4}", certificate.least_slope);
    assert!(first < settings.first_step && first >= settings.first_step / 16.0, "{first}");
    assert!(certificate.largest_error < settings.largest_error, "{}", certificate.largest_error);
}

/// dF/dx against the motion of every node that the elastic map may move, each on its own.
fn node_gradient_holds(problem: &Problem) {
    let shape = problem.shape().expect("a shape");
    let at = problem.moved(&wavy(problem)).unwrap_or_else(|e| panic!("{e}"));
    let mesh = at.mesh.clone();
    let analyse = |moved: Moved, derivatives: Derivatives| {
        problem.analyse(moved, derivatives, &mut SolverCache::default(), &mut NoProgress)
    };
    let base = analyse(at.clone(), Derivatives::First).unwrap_or_else(|e| panic!("{e}"));
    let objective = base.objective.expect("an objective");
    let gradient: Vec<f64> = base.sensitivity.expect("it was asked for").into_iter().flatten().collect();
    // A hundredth of a millimetre: a small part of the thinnest layer of 1 mm, so that no element is inverted.
    let moves = |k: usize| {
        let node = NodeId::new(k / 3);
        shape.motion().map().unknown_part(node, [1.0; 3])[k % 3] != 0.0
            || shape.surface().nodes().binary_search(&node).is_ok()
    };
    let span: Vec<f64> = (0..gradient.len()).map(|k| if moves(k) { 1e-5 } else { 0.0 }).collect();
    let settings = Settings { first_step: 1.0, difference_step: 0.01, ..Settings::default() };
    let value = |v: &[f64]| -> Result<f64, Error> {
        let moved = mesh.moved(v.as_chunks::<3>().0)?;
        let analysis = analyse(Moved { mesh: moved, ..at.clone() }, Derivatives::None)?;
        Ok(analysis.objective.expect("an objective"))
    };
    let zero = vec![0.0; gradient.len()];
    let certificate = measure(&value, &zero, objective, &gradient, &span, &settings, |_, _| {});
    check_in_five(&certificate.unwrap_or_else(|e| panic!("{e}")));
}

/// A design inside the bounds that is flat nowhere.
fn wavy(problem: &Problem) -> Vec<f64> {
    (0..variables(problem)).map(|k| 4e-3 + 3e-3 * (1.7 * k as f64).sin()).collect()
}

/// A design of a small coil device that is flat nowhere.
fn uneven(problem: &Problem) -> Vec<f64> {
    (0..variables(problem)).map(|k| 4e-4 + 6e-4 * (1.7 * k as f64).sin()).collect()
}

#[test]
fn the_gradient_is_exact_in_both_models_flat_and_wavy() {
    let linear = ["remesh.law=\"linear\""];
    for overrides in [&[][..], &MESHED] {
        let problem = setup("shield_quick.toml", overrides).problem;
        holds(&problem, &initial(&problem));
        check_in_five(&certified(&problem, &wavy(&problem), &Settings::default()));
        // dF/dx knows nothing of the law.
        node_gradient_holds(&problem);
        let problem = setup("shield_quick.toml", &[overrides, &linear].concat()).problem;
        holds(&problem, &wavy(&problem));
    }
}

#[test]
fn the_gradient_is_exact_with_another_penalty_weighting_frequency_grid_and_force() {
    let meshed: [&[&str]; 2] = [
        &["analysis.penalty=0.3", "objective.weighting=\"volume\""],
        &[
            "analysis.frequency=0",
            "analysis.elements=edge",
            // Residuals of 1e-11 leave 1e-7 to 1e-6 of the slope here, where a gauge is all that holds the gradients.
            "analysis.linear_solver.tolerance=1e-13",
            "remesh.law=\"linear\"",
            "remesh.motion=\"along_design\"",
            "design.grid=[2, 3]",
        ],
    ];
    let forced = ["remesh.force=[0.0, 0.0, 2e-6]", "remesh.stiffness=\"uniform\"", "design.grid=[13, 25]"];
    for overrides in meshed.map(|more| [&MESHED[..], more].concat()).into_iter().chain([forced.to_vec()]) {
        let problem = setup("shield_quick.toml", &overrides).problem;
        holds(&problem, &wavy(&problem));
    }
}

/// The tangent at the equilibrium of each design, and not a map that is fixed once.
#[test]
fn the_gradient_is_exact_on_rails() {
    let rails = ["remesh.law=\"rails\"", "remesh.stiffness=\"inverse_volume\""];
    for overrides in [&rails[..], &[&MESHED[..], &rails].concat()] {
        let problem = setup("shield_quick.toml", overrides).problem;
        holds(&problem, &initial(&problem));
        holds(&problem, &wavy(&problem));
    }
}

/// On one axis, and along the normals of two faces that meet at an edge, far enough for elements to turn.
#[test]
fn the_gradient_is_exact_by_the_hyperelastic_law() {
    let law = ["remesh.law=\"hyperelastic\"", "remesh.stiffness=\"inverse_volume\""];
    for overrides in [&law[..], &[&MESHED[..], &law].concat()] {
        let problem = setup("shield_quick.toml", overrides).problem;
        holds(&problem, &initial(&problem));
        holds(&problem, &wavy(&problem));
    }
    let faces = [
        ("surface = \"plate_bottom\"", "surface = [\"plate_bottom\", \"plate_side\"]"),
        (", \"plate_side\"]\n", "]\n"),
        ("[optimizer]", "law = \"hyperelastic\"\n[optimizer]"),
    ];
    let problem = designed(FILTERED, &faces);
    assert_eq!(problem.shape().expect("a shape").motion().law(), MotionLaw::Hyperelastic);
    holds(&problem, &wavy(&problem));
}

/// The quick shield with another `[design]` in place of its direction and grid.
fn designed(design: &str, overrides: &[(&str, &str)]) -> Problem {
    let mut text = read_text(&quick());
    let start = text.find("direction = [").expect("a direction");
    let end = text.find("lower = \"-5 mm\"").expect("a bound");
    text.replace_range(start..end, &format!("{design}\n"));
    setup_of(&changed(&text, overrides)).problem
}

const FILTERED: &str = "direction = \"normal\"\nfilter_radius = \"50 mm\"";

#[test]
fn the_gradient_is_exact_with_filtered_nodes_along_normals() {
    let meshed =
        [("model = \"impedance\"", "model = \"volume\""), ("\"remesh\"\n", "[\"plate\", \"remesh\"]\n")];
    for overrides in [&[][..], &meshed] {
        let problem = designed(FILTERED, overrides);
        holds(&problem, &wavy(&problem));
    }
}

#[test]
fn the_gradient_is_exact_with_the_filter_of_no_key_and_without_one() {
    let [own, none] = ["", "\nfilter_radius = 0"].map(|filter| {
        let problem = designed(&format!("direction = [0, 0, -1]{filter}"), &[]);
        holds(&problem, &wavy(&problem));
        problem.shape().expect("a shape").surface().filter_radius()
    });
    // Cells of 20 mm, cut at the lines of coil and observation region.
    assert!(own.is_some_and(|radius| (0.01..=0.03).contains(&radius)), "{own:?}");
    assert_eq!(none, None);
}

#[test]
fn the_gradient_is_exact_with_tied_nodes_and_a_fixed_rim() {
    let free = designed("direction = [0, 0, -1]", &[]);
    let tied = designed(
        "direction = [0, 0, -1]\nfilter_radius = \"50 mm\"\nrim = \"fixed\"\n\
         symmetry = [{ axis = \"y\", at = \"120 mm\" }]",
        &[],
    );
    let [few, many] = [&tied, &free].map(variables);
    assert!(2 * few < many + 20, "{few} of {many}");
    holds(&tied, &wavy(&tied));
    holds(&free, &wavy(&free));
}

#[test]
fn normals_of_the_flat_plate_are_its_direction() {
    let (along, normal) = (designed("direction = [0, 0, -1]", &[]), designed("direction = \"normal\"", &[]));
    let p = wavy(&along);
    let meshes = [&along, &normal].map(|problem| problem.moved(&p).expect("inside the bounds").mesh);
    for (a, b) in meshes[0].points().iter().zip(meshes[1].points()) {
        // Normals of flat triangles, carried through the elastic system: rounding of points below a metre.
        assert!((0..3).all(|d| (a[d] - b[d]).abs() < 1e-14), "{a:?} {b:?}");
    }
}
