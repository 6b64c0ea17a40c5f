//! The shield as an engineer meshes it, `fixtures/`: a plate extruded in layers from an unstructured plan, unstructured air.
//!
//! With a variable on every node and nothing tuned a run has to come as far as one with a control grid of 7 × 13 points, which is
//! smooth by itself: the mesh must not be what stops it. The table is in docs/results.md; `--nocapture` prints it.

use fluxmorph::config::Optimizer;
use fluxmorph::files::StopReason;
use fluxmorph::show::{Evaluation, Silent};

use crate::problems::optimised;
use crate::support::{changed, setup_of};

/// All that is not the mesh.
const SHIELD: &str = r#"
[analysis]
elements = "nodal"
frequency = "60 Hz"

[materials.steel]
relative_permeability = 800
conductivity = "7e6 S/m"

[regions.plate]
material = "steel"

[[coils]]
name = "coil"
shape = "racetrack"
ampere_turns = "40 kA"
center = ["0 mm", "0 mm", "60 mm"]
axis = "z"
half_window = ["60 mm", "160 mm"]
width = "20 mm"
height = "40 mm"
corner = "mitred"

[boundaries]
flux_parallel = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"]

[objective]
kind = "flux_density_squared"
region = "observation"
weighting = "volume"

[design]
surface = "plate_bottom"
direction = [0, 0, -1]
lower = "-5 mm"
upper = "20 mm"

[remesh]
region = ["plate", "remesh"]
slide = ["x_min", "y_min", "plate_side"]
"#;

/// Evaluations of every run.
const EVALUATIONS: usize = 15;

/// How a run of so many evaluations ended.
struct End {
    ratio: f64,
    reason: StopReason,
    rows: Vec<Evaluation>,
}

/// The run on a mesh of `fixtures/`, with further lines of `[design]`.
fn run(mesh: &str, design: &str) -> End {
    let mesh = format!("[mesh]\nfile = \"tests/physics/skins/fixtures/{mesh}.msh\"\nunit = \"mm\"\n{SHIELD}");
    let mut setup = setup_of(&changed(&mesh, &[("[design]\n", &format!("[design]\n{design}\n"))]));
    let settings = Optimizer { max_evaluations: EVALUATIONS, ..Optimizer::default() };
    let (optimised, rows) = optimised(&mut setup.problem, &settings, &mut Silent);
    End { ratio: optimised.best.objective / optimised.initial, reason: optimised.stop_reason, rows }
}

/// Every node by default against the grid, on a mesh.
fn every_node_keeps_up_with_a_grid(mesh: &str) {
    let [nodes, grid] = ["", "grid = [7, 13]"].map(|design| run(mesh, design));
    for (name, end) in [("every node", &nodes), ("grid", &grid)] {
        let path: Vec<String> = end.rows.iter().map(|row| format!("{:.4}", row.ratio)).collect();
        println!("{mesh}, {name}: {:.4}, {:?}: {}", end.ratio, end.reason, path.join(" "));
        assert!(end.rows.iter().all(|row| row.worst_quality > 0.0));
    }
    assert!(nodes.ratio <= 1.03 * grid.ratio, "{mesh}: {} against {}", nodes.ratio, grid.ratio);
    assert!(grid.ratio < 0.8, "{mesh}: there is something to gain: {}", grid.ratio);
}

#[test]
fn every_node_of_a_coarse_mesh_with_skin_layers_keeps_up_with_a_grid() {
    every_node_keeps_up_with_a_grid("coarse");
}

#[test]
#[ignore = "a minute: just test-long"]
fn every_node_below_a_lid_keeps_up_with_a_grid() {
    every_node_keeps_up_with_a_grid("lid");
}

#[test]
#[ignore = "a minute: just test-long"]
fn every_node_between_graded_sides_keeps_up_with_a_grid() {
    every_node_keeps_up_with_a_grid("sides");
}
