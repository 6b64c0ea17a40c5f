//! The check on a fresh mesh, on the coarse shield.

use std::path::Path;

use super::*;
use crate::build::{Setup, set_up};

/// The coarse shield; without its control grid and a filter every node is a variable.
fn quick(variables_on_nodes: bool) -> (Config, SourceMap) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/shield_quick.toml");
    let (mut config, source) = Config::from_file(&path, &[]).expect("a shipped configuration");
    if variables_on_nodes && let Some(design) = &mut config.design {
        (design.grid, design.filter_radius) = (None, Some(0.0));
    }
    (config, source)
}

/// A smooth shape near the frame that the shield's optimiser finds, by the place of every variable.
fn dished(setup: &Setup) -> Vec<f64> {
    let points = setup.problem.shape().expect("a shape").surface().points();
    points.iter().map(|x| 0.2 * x[0].max(0.5 * x[1]) - 4e-3).collect()
}

/// What the observer received.
#[derive(Default)]
struct Recorded {
    notices: Vec<String>,
    warnings: Vec<String>,
}

impl Observer for Recorded {
    fn notice(&mut self, message: &str) {
        self.notices.push(message.to_owned());
    }

    fn warning(&mut self, message: &str) {
        self.warnings.push(message.to_owned());
    }
}

fn verified(
    config: &Config,
    source: &SourceMap,
    shapes: &ShapePair,
    stop_reason: StopReason,
    interrupted: bool,
) -> (ObjectiveResult, Recorded) {
    let parts = config.output.verify_refinement as usize;
    verified_in(parts, (config, source), shapes, stop_reason, interrupted)
}

/// With every cell in so many parts.
fn verified_in(
    parts: usize,
    (config, source): (&Config, &SourceMap),
    shapes: &ShapePair,
    stop_reason: StopReason,
    interrupted: bool,
) -> (ObjectiveResult, Recorded) {
    let mut objective = ObjectiveResult {
        initial: 1.0,
        best: 0.5,
        ratio: 0.5,
        best_evaluation: 1,
        verified_ratio: None,
        verification: None,
        homogeneity: None,
        terms: Vec::new(),
    };
    let mut recorded = Recorded::default();
    let problem = set_up(config, source, Mode::Optimisation).expect("a sound problem").problem;
    let fresh = FreshMesh::of(config, &problem).map(|fresh| {
        let mesh = DividedMesh::of(config, &problem, parts).expect("a generated mesh");
        FreshMesh { mesh, parts, memory: [0; 2], ..fresh }
    });
    let (fresh, meshes, sizes) = (fresh.as_ref(), None, Sizes::of(&problem));
    let constraints = &[];
    let check = MeshIndependence { config, source, stop_reason, shapes, fresh, meshes, sizes, constraints };
    check.verify(&mut objective, &|| interrupted, &mut recorded);
    (objective, recorded)
}

#[test]
fn the_same_cells_give_the_same_ratio_whatever_carries_the_shape() {
    for on_nodes in [false, true] {
        let (config, source) = quick(on_nodes);
        let setup = set_up(&config, &source, Mode::Optimisation).expect("a sound problem");
        let best = dished(&setup);
        let value = |p: &[f64]| {
            let analysis = setup
                .problem
                .evaluate(p, Derivatives::None, &mut SolverCache::default(), &mut NoProgress)
                .expect("a valid mesh");
            analysis.objective.expect("an objective")
        };
        let shape = setup.problem.shape().expect("a shape");
        let expected = value(&best) / value(shape.initial());
        let shapes = ShapePair::of(&config, &setup, &best).expect("a design surface");
        let (objective, recorded) =
            verified_in(1, (&config, &source), &shapes, StopReason::ObjectiveConverged, false);
        let found = objective.verification.unwrap_or_else(|| panic!("{:?}", recorded.warnings));
        // A control grid carries the shape but where every node is a variable, and has the same one on the same cells.
        assert_eq!(found.deviation.map(|found| found.distance_m < 1e-12), (!on_nodes).then_some(true));
        assert_eq!(objective.verified_ratio, Some(found.ratio));
        // The residual that every linear solution has to reach, twice.
        assert!((found.ratio - expected).abs() < 2e-9 * expected, "{} {expected}", found.ratio);
    }
}

#[test]
fn a_smooth_shape_on_nodes_keeps_its_value_on_a_finer_surface() {
    let ratio = |on_nodes| {
        let (mut config, source) = quick(on_nodes);
        config.output.verify_refinement = 2.0;
        let setup = set_up(&config, &source, Mode::Optimisation).expect("a sound problem");
        let shapes = ShapePair::of(&config, &setup, &dished(&setup)).expect("a design surface");
        let (objective, recorded) =
            verified(&config, &source, &shapes, StopReason::ObjectiveConverged, false);
        objective.verified_ratio.unwrap_or_else(|| panic!("{:?}", recorded.warnings))
    };
    let (grid, nodes) = (ratio(false), ratio(true));
    println!("verified ratio of one shape: on a grid {grid:.6}, on nodes {nodes:.6}");
    // Bilinear on squares or linear on triangles: the two differ along the ridge of the shape alone.
    assert!((grid - nodes).abs() < 2e-3, "{grid} {nodes}");
    assert!(grid < 0.99, "the shape changes the field: {grid}");
}

/// Every second point of the grid up and the others down, half as far.
fn peaks() -> Vec<f64> {
    (0..91).map(|k| if k % 2 == 0 { 8e-3 } else { -4e-3 }).collect()
}

/// Peaks of a grid twice as fine as the cells: what lies between nodes of the run's mesh is there on the fresh one alone.
#[test]
fn a_grid_that_is_finer_than_the_cells_has_another_shape_on_a_fresh_mesh() {
    let (mut config, source) = quick(false);
    config.output.verify_refinement = 2.0;
    let setup = set_up(&config, &source, Mode::Optimisation).expect("a sound problem");
    for (best, is_another) in [(peaks(), true), (dished(&setup), false)] {
        let shapes = ShapePair::of(&config, &setup, &best).expect("a design surface");
        let (objective, recorded) =
            verified(&config, &source, &shapes, StopReason::ObjectiveConverged, false);
        let found = objective.verification.unwrap_or_else(|| panic!("{:?}", recorded.warnings));
        let ShapeDeviation { distance_m, motion_m } = found.deviation.expect("a control grid");
        println!("F/F0 {}: up to {distance_m} of {motion_m} m", found.ratio);
        assert_eq!(distance_m > 0.25 * motion_m, is_another, "{distance_m} {motion_m}");
        assert_eq!(recorded.notices.iter().any(|notice| notice.contains("another shape")), is_another);
    }
}

/// Cut elements have the facets of the run, and their ratio says nothing of what lies between the nodes.
#[test]
fn a_grid_that_bends_within_the_facets_is_told_of_on_cut_elements() {
    let (config, source) = quick(false);
    let setup = set_up(&config, &source, Mode::Optimisation).expect("a sound problem");
    for (shape, is_another) in [(peaks(), true), (dished(&setup), false)] {
        let shapes = ShapePair::of(&config, &setup, &shape).expect("a design surface");
        let deviation = shapes.facet_deviation();
        let ShapeDeviation { distance_m, motion_m } = deviation.expect("a control grid");
        println!("up to {distance_m} of {motion_m} m");
        let (mesh, constraints) = (VerificationMesh::Cut, Vec::new());
        let [initial, best, ratio] = [1.0, 0.5, 0.5];
        let found =
            Verification { mesh, refinement: 2.0, tets: 1, deviation, initial, best, ratio, constraints };
        let tells = |text: &String| text.contains("that design.grid describes");
        assert_eq!(of_another_shape(&found, ratio).iter().any(tells), is_another);
        // As much is told where no check is made.
        let (_, recorded) = verified(&config, &source, &shapes, StopReason::Interrupted, false);
        assert_eq!(recorded.notices.iter().any(tells), is_another, "{:?}", recorded.notices);
    }
}

#[test]
fn a_run_that_was_stopped_is_not_checked() {
    let (config, source) = quick(false);
    let setup = set_up(&config, &source, Mode::Optimisation).expect("a sound problem");
    let shapes = ShapePair::of(&config, &setup, &dished(&setup)).expect("a design surface");
    for (reason, interrupted) in [
        (StopReason::Interrupted, false),
        (StopReason::MaxTime, false),
        (StopReason::ObjectiveConverged, true),
    ] {
        let (objective, recorded) = verified(&config, &source, &shapes, reason, interrupted);
        assert_eq!(objective.verified_ratio, None);
        assert!(
            recorded.notices.len() == 1 && recorded.notices[0].contains("was stopped"),
            "{:?}",
            recorded.notices
        );
    }
}

#[test]
fn every_cell_that_moves_or_is_observed_is_halved_and_no_other() {
    let (config, source) = quick(false);
    let setup = set_up(&config, &source, Mode::Optimisation).expect("a sound problem");
    let fresh = FreshMesh::of(&config, &setup.problem).expect("a generated mesh");
    let mesh = fresh.mesh.build(&config, &source).expect("sound parameters");
    let lines = |mesh: &fluxmorph_geometry::Mesh, axis: usize| {
        let mut all: Vec<f64> = mesh.points().iter().map(|x| x[axis]).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    };
    // Plate, moving air and observation cells of the quarter: 160 × 280 mm, from −60 to 30 mm.
    for (axis, low, high) in [(0, 0.0, 0.16), (1, 0.0, 0.28), (2, -0.06, 0.03)] {
        let (old, new) = (lines(&setup.full_mesh, axis), lines(&mesh, axis));
        let inside = |lines: &[f64]| lines.iter().filter(|&&c| (low..=high).contains(&c)).count();
        assert_eq!(inside(&new) - 1, 2 * (inside(&old) - 1), "axis {axis}");
        assert_eq!(new.len() - inside(&new), old.len() - inside(&old), "axis {axis}, far cells");
    }
}

#[test]
fn where_a_fresh_mesh_costs_too_much_elements_are_cut() {
    let (config, source) = quick(false);
    let setup = set_up(&config, &source, Mode::Optimisation).expect("a sound problem");
    let problem = &setup.problem;
    let shape = problem.shape().expect("a shape");
    let original = problem.original().clone();
    let best = shape.carried(shape.initial(), &dished(&setup)).expect("a mild shape").moved.mesh;
    let (full, tets) = (setup.full_mesh.clone(), original.topology().tets().len());
    let meshes = ShapeMeshes { full, solved: [original, best], members: [Vec::new(), Vec::new()] };
    let fresh = FreshMesh { work: 1.0, ..FreshMesh::of(&config, problem).expect("a generated mesh") };
    let shapes = ShapePair::of(&config, &setup, &dished(&setup)).expect("a design");
    let check = MeshIndependence {
        config: &config,
        source: &source,
        stop_reason: StopReason::ObjectiveConverged,
        shapes: &shapes,
        fresh: Some(&fresh),
        meshes: Some(&meshes),
        sizes: Sizes::of(problem),
        constraints: &[],
    };
    let mut recorded = Recorded::default();
    let found = check.compute(&fresh, &|| false, &mut recorded).expect("both are computed");
    let Outcome::Found(found) = found else { panic!("cut short, or too large") };
    assert!(found.tets >= 2 * tets && (0.5..0.999).contains(&found.ratio), "{found:?}");
    assert_eq!(found.deviation, shapes.facet_deviation());
    assert!(recorded.notices.iter().any(|notice| notice.contains("cut, instead")), "{:?}", recorded.notices);
}

#[test]
fn constraints_are_measured_anew_and_a_violated_one_is_a_warning() {
    let (mut config, source) = quick(false);
    let text = "[[constraints]]\nkind = \"volume\"\nregion = \"plate\"\nupper_ratio = 1.0\n";
    let whole = format!("{}\n{text}", source.text());
    config.constraints = Config::from_str(&whole, "device.toml").expect("sound").0.constraints;
    let setup = set_up(&config, &source, Mode::Optimisation).expect("a sound problem");
    let shapes = ShapePair::of(&config, &setup, &[1e-3; 91]).expect("a design");
    let (objective, recorded) = verified(&config, &source, &shapes, StopReason::ObjectiveConverged, false);
    let constraints = objective.verification.expect("it is computed").constraints;
    // The plate of 120 × 240 × 10 mm, a millimetre thicker everywhere.
    assert!((constraints[0].bound - 2.88e-4).abs() < 1e-12, "{constraints:?}");
    assert!((constraints[0].value - 1.1 * 2.88e-4).abs() < 1e-12 && !constraints[0].satisfied);
    assert!(
        recorded.warnings.len() == 1
            && recorded.warnings[0].contains("`volume_plate`: 10.00 % above its bound"),
        "{:?}",
        recorded.warnings
    );
}

#[test]
fn the_initial_design_as_the_best_is_the_ratio_one() {
    let (config, source) = quick(false);
    let setup = set_up(&config, &source, Mode::Optimisation).expect("a sound problem");
    let shapes = ShapePair::of(&config, &setup, &[0.0; 91]).expect("a design");
    assert_eq!(shapes, ShapePair::Unchanged);
    let (objective, recorded) = verified(&config, &source, &shapes, StopReason::MeshLimited, false);
    assert_eq!((objective.verified_ratio, objective.verification), (Some(1.0), None));
    assert!(recorded.notices.is_empty() && recorded.warnings.is_empty());
}
