//! The paper's example 2 on the shipped configurations: field, trends, and the optimisation itself.
//!
//! Reference: an independent hexahedral edge-element solution (`tests/reference/shield.json`) and the numbers derived
//! from it, with the tolerances that the shipped meshes are made for. Measured values are in docs/results.md; run with
//! `--nocapture` to see them.

use fluxmorph::build::Setup;
use fluxmorph::config::Optimizer;
use fluxmorph::files::{ObjectiveResult, StopReason};
use fluxmorph::run::mesh_independence::{FreshMesh, MeshIndependence};
use fluxmorph::run::shape_pair::ShapePair;
use fluxmorph::show::{Evaluation, Silent};
use fluxmorph_optimizer::driver::Optimised;
use fluxmorph_optimizer::memory_estimate::Sizes;
use fluxmorph_optimizer::problem::Analysis;
use fluxmorph_solver::recovery;

use crate::problems::{self, analysed, objective, variables};
use crate::support::shield::{ShieldReference, relative_l2};
use crate::support::{config, setup};

/// The plate meshed with skin layers, and replaced by its impedance surface.
const MESHED: &str = "shield.toml";
const IMPEDANCE: &str = "shield_impedance.toml";

/// rms |B| over the 12 observation cells of the flat plate [T].
const REFERENCE_RMS: f64 = 17.453e-3;

fn rms(objective: f64) -> f64 {
    (objective / 12.0).sqrt()
}

/// F of a uniform change of thickness [m].
fn uniform(setup: &Setup, height: f64) -> f64 {
    objective(&setup.problem, &vec![height; variables(&setup.problem)])
}

/// B of flat and framed plate against the reference: in the cells (what the objective sees) and at the probes.
fn field_errors(name: &str) -> (f64, [f64; 2], [f64; 2]) {
    let setup = setup(name, &[]);
    let problem = &setup.problem;
    let reference = ShieldReference::read();
    let mut flat_rms = 0.0;
    let mut cells = [0.0; 2];
    let mut probes = [0.0; 2];
    let flat_design = vec![0.0; reference.framed_design.len()];
    for (case, (p, b)) in [(&flat_design, &reference.flat), (&reference.framed_design, &reference.framed)]
        .into_iter()
        .enumerate()
    {
        let analysis = analysed(problem, p);
        let (model, solution) = (&problem.states()[0], &analysis.solutions[0]);
        let objective = problem.objective().expect("an objective");
        cells[case] = relative_l2(
            &objective.terms[0].functional.cell_flux_densities((model, &analysis.mesh, solution)),
            b,
        );
        let recovered = recovery::probe((model, &analysis.mesh, solution), "cells", &reference.points)
            .unwrap_or_else(|e| panic!("{e}"));
        probes[case] = relative_l2(&recovered, b);
        let value = analysis.objective.expect("an objective");
        println!("{name}: case {case}: rms {:.4} mT, F {value:.6e}", rms(value) * 1e3);
        if case == 0 {
            flat_rms = rms(value);
        }
    }
    println!(
        "{name}: relative l2 of B, flat and framed: cells {cells:.4?}, recovered at points {probes:.4?}"
    );
    (flat_rms, cells, probes)
}

#[test]
fn the_meshed_plate_has_the_references_field() {
    let (flat_rms, cells, probes) = field_errors(MESHED);
    assert!((flat_rms / REFERENCE_RMS - 1.0).abs() <= 0.03, "rms {flat_rms}");
    assert!(cells.iter().chain(&probes).all(|&e| e <= 0.04), "{cells:?} {probes:?}");
}

#[test]
fn the_impedance_surface_has_the_references_field() {
    let (flat_rms, cells, probes) = field_errors(IMPEDANCE);
    assert!((flat_rms / REFERENCE_RMS - 1.0).abs() <= 0.06, "rms {flat_rms}");
    assert!(cells.iter().chain(&probes).all(|&e| e <= 0.07), "{cells:?} {probes:?}");
}

/// Second order is near the reference whatever the ratio of neighbouring cells in the air, on cells of twice the shipped size;
/// first order is not, and its error changes its sign with it.
#[test]
#[ignore = "six fields on coarse cells: just test-long"]
fn the_absolute_field_of_second_order_settles() {
    let deviations = |order: &str| {
        ["1.8", "1.4", "1.2"].map(|growth| {
            let growth = format!("mesh.shield.growth={growth}");
            let overrides = ["analysis.elements=edge", order, "mesh.shield.refinement=0.5", growth.as_str()];
            rms(uniform(&setup(IMPEDANCE, &overrides), 0.0)) / REFERENCE_RMS - 1.0
        })
    };
    let [first, second] = ["analysis.order=1", "analysis.order=2"].map(deviations);
    println!("deviation from the reference by growth: first order {first:.4?}, second order {second:.4?}");
    let largest = |all: [f64; 3]| all.into_iter().fold(0.0_f64, |most, d| most.max(d.abs()));
    assert!(largest(second) < 0.01 && largest(first) > 3.0 * largest(second));
}

/// F/F0 of uniform plates of 5, 20 and 30 mm, of the reference.
const UNIFORM: [(f64, f64); 3] = [(-5e-3, 1.101), (10e-3, 0.852), (20e-3, 0.736)];

fn thickness_trend(name: &str) {
    let setup = setup(name, &[]);
    let flat = uniform(&setup, 0.0);
    for (height, expected) in UNIFORM {
        let ratio = uniform(&setup, height) / flat;
        println!("{name}: {} mm thick: F/F0 {ratio:.4}, reference {expected}", 10.0 + height * 1e3);
        assert!((ratio - expected).abs() <= 0.03, "{height}: {ratio} against {expected}");
    }
}

#[test]
fn a_thicker_meshed_plate_shields_as_the_reference_says() {
    thickness_trend(MESHED);
}

#[test]
fn a_thicker_impedance_plate_shields_as_the_reference_says() {
    thickness_trend(IMPEDANCE);
}

#[test]
fn frequency_and_box_change_the_result_as_the_reference_says() {
    let framed = ShieldReference::read().framed_design;
    // A moderate growth towards the outer box, so that a larger box changes the physics and not the far mesh.
    let ratio = |overrides: &[&str]| {
        let setup = setup(IMPEDANCE, &[overrides, &["mesh.shield.growth=1.4"]].concat());
        let flat = uniform(&setup, 0.0);
        let best = objective(&setup.problem, &framed);
        (flat, best / flat)
    };
    let (flat, base) = ratio(&[]);
    let (_, at_50_hertz) = ratio(&["analysis.frequency=\"50 Hz\""]);
    let (flat_large, large) = ratio(&[
        "mesh.shield.outer=[\"900 mm\", \"1080 mm\"]",
        "mesh.shield.outer_z=[\"-600 mm\", \"720 mm\"]",
    ]);
    println!(
        "framed F/F0: {base:.4}; at 50 Hz {at_50_hertz:.4}; box +50 % {large:.4}, F0 {:+.3}",
        flat_large / flat - 1.0
    );
    // Reference: 0.502, 0.501 (−0.001), 0.512 (+0.010), F0 +9 %. Differences on one kind of mesh are sharper than values.
    assert!((at_50_hertz - base + 0.001).abs() <= 0.003);
    assert!((large - base - 0.010).abs() <= 0.006);
    assert!((flat_large / flat - 1.09).abs() <= 0.02);
}

#[test]
fn one_element_through_the_plate_warns() {
    let coarse = setup(MESHED, &["mesh.shield.skin=[]", "mesh.shield.side_skin=[]"]);
    assert!(coarse.warnings.iter().any(|w| w.contains("skin depth")), "{:?}", coarse.warnings);
    let graded = setup(MESHED, &[]);
    assert!(graded.warnings.is_empty(), "{:?}", graded.warnings);
}

fn run(name: &str) -> (Setup, Optimised, Vec<Evaluation>) {
    let (config, _) = config(name, &[]);
    let mut setup = setup(name, &[]);
    let settings = Optimizer { max_evaluations: 13, ..config.optimizer };
    let (optimised, rows) = problems::optimised(&mut setup.problem, &settings, &mut Silent);
    let path: Vec<String> = rows.iter().map(|r| format!("{:.4}", r.ratio)).collect();
    println!("{name}: F/F0 {}", path.join(" "));
    (setup, optimised, rows)
}

/// The paper's 51.16 % within 13 evaluations, and the frame: 30 mm rim, 5 mm middle.
fn reaches_the_papers_ratio(optimised: &Optimised, rows: &[Evaluation]) {
    assert!(rows.len() <= 13);
    let ratio = optimised.best.objective / optimised.initial;
    assert!(ratio <= 0.5116, "{ratio}");
    assert_ne!(optimised.stop_reason, StopReason::MeshLimited);
    let framed = ShieldReference::read().framed_design;
    let differing: Vec<usize> =
        (0..framed.len()).filter(|&k| (framed[k] - optimised.best.values[k]).abs() > 5e-3).collect();
    println!("variables that differ from the reference's frame by more than 5 mm: {differing:?}");
    // The frame is bang-bang; nodes on the seam between rim and middle may settle on either side.
    assert!(differing.len() <= 9, "{differing:?}");
    let on_rim = |k: usize| k / 13 >= 5 || k % 13 >= 10;
    // Not beside the seam in the reference: the corner of the middle, variable 32, ends at −0.2 mm with a gradient of zero where the
    // meshed run goes on to a tolerance of 1e-6 (F/F0 0.5110).
    let is_thin = |x: usize, y: usize| framed[13 * x + y] < 0.0;
    let deep_inside = |k: usize| {
        let (x, y) = (k / 13, k % 13);
        x <= 2 && y <= 6 && is_thin(x + 1, y) && is_thin(x, y + 1)
    };
    for (k, &p) in optimised.best.values.iter().enumerate() {
        assert!(!on_rim(k) || p >= 0.019, "rim variable {k} is {p}");
        assert!(!deep_inside(k) || p <= -0.004, "inner variable {k} is {p}");
    }
}

/// The ratio of a run is the shape's: on a mesh the optimiser never saw it differs by no more than 0.02.
fn a_fresh_mesh_confirms(name: &str, setup: &Setup, optimised: &Optimised) {
    let (config, source) = config(name, &[]);
    let (initial, best) = (optimised.initial, optimised.best.objective);
    let mut objective = ObjectiveResult {
        initial,
        best,
        ratio: best / initial,
        best_evaluation: optimised.best.evaluation,
        verified_ratio: None,
        verification: None,
        homogeneity: None,
        terms: Vec::new(),
    };
    let shapes = ShapePair::of(&config, setup, &optimised.best.values).unwrap_or_else(|e| panic!("{e}"));
    let stop_reason = optimised.stop_reason;
    let fresh = FreshMesh::of(&config, &setup.problem);
    let fresh = fresh.as_ref();
    let gain = MeshIndependence {
        config: &config,
        source: &source,
        stop_reason,
        shapes: &shapes,
        fresh,
        meshes: None,
        sizes: Sizes::of(&setup.problem),
        constraints: &[],
    };
    gain.verify(&mut objective, &|| false, &mut Silent);
    let verified = objective.verified_ratio.expect("the shield can be generated anew");
    println!("{name}: F/F0 {:.4}, {:?}", objective.ratio, objective.verification);
    assert!((verified - objective.ratio).abs() <= 0.02, "{verified} against {}", objective.ratio);
}

#[test]
fn the_impedance_run_reaches_the_papers_ratio() {
    let (setup, optimised, rows) = run(IMPEDANCE);
    reaches_the_papers_ratio(&optimised, &rows);
    a_fresh_mesh_confirms(IMPEDANCE, &setup, &optimised);
    let worst = rows.iter().map(|r| r.worst_quality).fold(f64::INFINITY, f64::min);
    println!("worst quality {worst:.4}");
    // Of 0.254 at the start; flat cells below a plate that is 20 mm thicker.
    assert!(worst >= 0.05, "{worst}");
}

#[test]
#[ignore = "takes a minute"]
fn the_meshed_run_reaches_the_papers_ratio() {
    let (setup, optimised, rows) = run(MESHED);
    a_fresh_mesh_confirms(MESHED, &setup, &optimised);
    reaches_the_papers_ratio(&optimised, &rows);
    let worst = rows.iter().map(|r| r.worst_quality).fold(f64::INFINITY, f64::min);
    println!("worst quality {worst:.6}, at the start {:.6}", rows[0].worst_quality);
    assert!(worst >= rows[0].worst_quality / 3.0);
    let kept = skin_layers_kept(&setup, &optimised.best.analysis);
    println!(
        "least share of their thickness that the skin layers keep, from the moving face inwards: {kept:.3?}"
    );
    assert!(kept[..2].iter().all(|&share| share >= 0.7), "{kept:?}");
}

/// For the layers between the mesh lines under the moving face: least final over initial thickness of any column.
fn skin_layers_kept(setup: &Setup, analysis: &Analysis) -> Vec<f64> {
    let reference = setup.problem.original().points();
    let lines = [0.0, 0.3e-3, 0.8e-3, 1.6e-3, 3e-3, 5e-3].map(|depth| -0.010 + depth);
    let column = |p: [f64; 3]| (p[0].to_bits(), p[1].to_bits());
    let at_line: Vec<std::collections::HashMap<_, f64>> = lines
        .iter()
        .map(|&z| {
            reference
                .iter()
                .zip(analysis.mesh.points())
                .filter(|(x, _)| (x[2] - z).abs() < 1e-9 && x[0] <= 0.1200001 && x[1] <= 0.2400001)
                .map(|(x, moved)| (column(*x), moved[2]))
                .collect()
        })
        .collect();
    lines
        .windows(2)
        .enumerate()
        .map(|(layer, z)| {
            at_line[layer]
                .iter()
                .map(|(key, below)| (at_line[layer + 1][key] - below) / (z[1] - z[0]))
                .fold(f64::INFINITY, f64::min)
        })
        .collect()
}
