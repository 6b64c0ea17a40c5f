//! Cost of the elastic map by size, solver, design and stiffness policy: `cargo bench -p fluxmorph-remesh --bench elastic`.
//!
//! The table is of small blocks; `-- 36 46 58` gives others, in cells along an edge (50, 100 and 200 thousand nodes), and
//! a trailing `direct` or `blocks` one solver only. Every case runs in a process of its own, because the largest memory
//! of a process (`VmHWM`, of Linux) never falls again.

use std::process::Command;

use cpu_time::ProcessTime;
use fluxmorph_geometry::generate::{BlockParameters, block};
use fluxmorph_geometry::{Mesh, NodeId};
use fluxmorph_remesh::{
    Boundary, BoundaryKind, ElasticMap, RemeshSetup, SolverChoice, StiffnessPolicy, Subregion,
};

/// Cells along an edge unless others are given.
const SIZES: [usize; 3] = [12, 18, 24];

const SOLVERS: [(&str, SolverChoice); 2] =
    [("direct", SolverChoice::Direct), ("blocks", SolverChoice::ComponentBlocks)];

/// Which surfaces of the block move, or may.
const DESIGNS: [&str; 3] = ["outer", "top", "slide"];

/// Largest memory of this process so far [GiB].
fn peak() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<f64>().ok()).unwrap_or(0.0)
        / 1024f64.powi(2)
}

/// The whole outer surface designed; or the top, the rest fixed; or the top, the sides sliding, each in its plane.
fn setup(mesh: &Mesh, design: &str, policy: StiffnessPolicy, solver: SolverChoice) -> RemeshSetup {
    let topology = mesh.topology();
    let subregions = vec![Subregion::new("all", topology.elements().collect())];
    let [low, high] = mesh.bounding_box();
    let designed = |node: &NodeId| {
        let p = mesh.point(*node);
        if design == "outer" { (0..3).any(|d| p[d] == low[d] || p[d] == high[d]) } else { p[2] == high[2] }
    };
    let slide = |name| Boundary::of_surface(topology, name, BoundaryKind::Slide).expect("a block's surface");
    let boundaries = match design {
        "slide" => ["x_min", "x_max", "y_min", "y_max"].map(slide).to_vec(),
        _ => Vec::new(),
    };
    let design_nodes = topology.nodes().filter(designed).collect();
    RemeshSetup { subregions, policy, design_nodes, boundaries, solver, ..RemeshSetup::default() }
}

/// One case in this process: its row of the table.
fn measure(cells: usize, design: &str, policy: StiffnessPolicy, solver: SolverChoice) {
    let mesh = block(&BlockParameters { size: [1.0, 1.1, 1.3], cells: [cells; 3] }).expect("valid");
    let setup = setup(&mesh, design, policy, solver);
    let clock = ProcessTime::now();
    let map = ElasticMap::new(&mesh, setup).expect("a body with supports");
    let made = clock.elapsed().as_secs_f64();
    let wave = |i: usize| std::array::from_fn(|d| (0.37 * i as f64 + d as f64).sin());
    let design: Vec<_> = (0..map.design_nodes().len()).map(wave).collect();
    let nodal: Vec<_> = (0..mesh.points().len()).map(wave).collect();
    let clock = ProcessTime::now();
    let displacement = map.displacement(&design).expect("it converges");
    let forward = clock.elapsed().as_secs_f64();
    let clock = ProcessTime::now();
    let gradient = map.gradient(&nodal).expect("it converges");
    let transposed = clock.elapsed().as_secs_f64();
    let inner = |a: &[[f64; 3]], b: &[[f64; 3]]| -> f64 {
        a.iter().flatten().zip(b.iter().flatten()).map(|(x, y)| x * y).sum()
    };
    // The map has no constant part: ⟨G x, y⟩ = ⟨x, Gᵀ y⟩.
    let (left, right) = (inner(&displacement, &nodal), inner(&design, &gradient));
    println!(
        "{:>8}{:>10}{made:>9.2}{forward:>9.2}{transposed:>9.2}{:>9.2}{:>10.2}{:>11.1e}",
        mesh.points().len(),
        map.equation_count(),
        peak(),
        map.solver_bytes() as f64 / 1024f64.powi(3),
        (left - right).abs() / left.abs().max(right.abs())
    );
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    if let ["--case", cells, design, policy, solver] = words[..] {
        let cells = cells.parse().expect("the parent wrote a number");
        let policy = StiffnessPolicy::ALL.into_iter().find(|p| p.name() == policy).expect("a policy");
        let (_, solver) = SOLVERS.into_iter().find(|(name, _)| *name == solver).expect("a solver");
        return measure(cells, design, policy, solver);
    }
    let given: Vec<usize> = words.iter().filter_map(|word| word.parse().ok()).collect();
    let sizes = if given.is_empty() { SIZES.to_vec() } else { given };
    let wanted =
        |names: &[&str], name: &str| !names.iter().any(|n| words.contains(n)) || words.contains(&name);
    println!("CPU s: map = pattern, assembly and factors; memory in GiB; ⟨Gx, y⟩ against ⟨x, Gᵀy⟩");
    println!(
        "{:<8}{:<7}{:<16}{:>8}{:>10}{:>9}{:>9}{:>9}{:>9}{:>10}{:>11}",
        "solver",
        "design",
        "stiffness",
        "nodes",
        "unknowns",
        "map",
        "forward",
        "transp.",
        "peak",
        "solver",
        "transpose"
    );
    let program = std::env::current_exe().expect("this program has a path");
    let policies = StiffnessPolicy::ALL.map(StiffnessPolicy::name);
    for (solver, _) in SOLVERS.iter().filter(|(name, _)| wanted(&["direct", "blocks"], name)) {
        for cells in &sizes {
            for design in DESIGNS.iter().filter(|name| wanted(&DESIGNS, name)) {
                for policy in policies.iter().filter(|name| wanted(&policies, name)) {
                    let mut case = Command::new(&program);
                    case.args(["--case", &cells.to_string(), design, policy, solver]);
                    let output = case.output().expect("it runs");
                    let row = String::from_utf8_lossy(&output.stdout).into_owned();
                    let fault = String::from_utf8_lossy(&output.stderr).into_owned();
                    let row = if output.status.success() { row.trim_end() } else { fault.trim_end() };
                    println!("{solver:<8}{design:<7}{policy:<16}{row}");
                }
            }
        }
    }
}
