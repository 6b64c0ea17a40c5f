//! CPU time of the parts of one evaluation on the shipped shield configurations: `just bench`.
//!
//! Each part is repeated and its least CPU time (all threads together) and wall time are shown.

use std::path::Path;
use std::time::{Duration, Instant};

use cpu_time::ProcessTime;
use fluxmorph_optimizer::config::Config;
use fluxmorph_optimizer::fields;
use fluxmorph_optimizer::problem::{Problem, Want};
use fluxmorph_optimizer::setup::{Purpose, set_up};
use fluxmorph_solver::adjoint;

const REPETITIONS: usize = 3;

/// Least CPU and wall time of `work`, and its last result.
fn least<T>(mut work: impl FnMut() -> T) -> (Duration, Duration, T) {
    let mut best = (Duration::MAX, Duration::MAX);
    let mut result = None;
    for _ in 0..REPETITIONS {
        let (cpu, wall) = (ProcessTime::now(), Instant::now());
        result = Some(work());
        best = (best.0.min(cpu.elapsed()), best.1.min(wall.elapsed()));
    }
    (best.0, best.1, result.expect("there is a repetition"))
}

fn show(part: &str, cpu: Duration, wall: Duration) {
    println!("  {part:<28}{:>10.1}{:>10.1}", cpu.as_secs_f64() * 1e3, wall.as_secs_f64() * 1e3);
}

fn phases(name: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs").join(name);
    let (config, source) = Config::from_file(&path, &[]).unwrap_or_else(|e| panic!("{e}"));
    let (cpu, wall, setup) = least(|| set_up(&config, &source, Purpose::Optimisation).expect("it is valid"));
    let problem: Problem = setup.problem;
    let (model, shape) = (&problem.states[0], problem.shape.as_ref().expect("it has a design"));
    let topology = problem.original.topology();
    println!(
        "{name}: {} tets, {} unknowns, {} elastic equations",
        topology.tets().len(),
        model.unknown_count(),
        shape.motion.map().equation_count()
    );
    println!("  {:<28}{:>10}{:>10}", "part", "CPU ms", "wall ms");
    show("set-up (once a run)", cpu, wall);

    let p: Vec<f64> = (0..shape.surface.variable_count()).map(|k| 2e-3 * (k as f64).sin()).collect();
    let (cpu, wall, moved) = least(|| problem.moved(&p).expect("a small motion"));
    show("remesh, forward", cpu, wall);
    let mesh = moved.mesh.clone();
    let (cpu, wall, matrix) = least(|| model.assemble(&mesh));
    show("assembly", cpu, wall);
    let load = model.load(&mesh);
    let (cpu, wall, system) = least(|| model.prepare(matrix.clone()).expect("it is regular"));
    show("factor", cpu, wall);
    let (cpu, wall, state) = least(|| model.solve_prepared(&system, &load).expect("it converges"));
    show(&format!("state, {} iterations", state.report().iterations), cpu, wall);
    let objective = problem.objective.as_ref().expect("it has an objective");
    let value = objective.terms[0].functional.evaluate(model, &mesh, &state).expect("it is finite");
    let (cpu, wall, lambda) = least(|| adjoint::solve(&system, &value.derivative).expect("it converges"));
    show(&format!("adjoint, {} iterations", lambda.report().iterations), cpu, wall);
    let (cpu, wall, nodal) =
        least(|| adjoint::node_gradient(model, &mesh, &state, &lambda, shape.motion.moving()));
    show("gradient at nodes", cpu, wall);
    let (cpu, wall, _) =
        least(|| shape.surface.gradient(&shape.motion.map().gradient(&nodal).expect("it converges")));
    show("remesh, transposed", cpu, wall);
    let (cpu, wall, analysis) =
        least(|| problem.analyse(&p, moved.clone(), Want::Gradient).expect("it converges"));
    show("one evaluation, all", cpu, wall);
    let evaluation = cpu;
    let step = shape.motion.step(&shape.displacement(&p)).expect("it converges");
    let (guard, wall, _) = least(|| shape.motion.inversion(&step));
    show("step to inversion", guard, wall);
    let (quality, wall, _) = least(|| problem.quality(&mesh));
    show("quality", quality, wall);
    let share = (guard + quality).as_secs_f64() / evaluation.as_secs_f64();
    println!("  step to inversion and quality: {:.2} % of an evaluation", 100.0 * share);
    let (cpu, wall, bytes) = least(|| fields::vtu(&problem, &analysis).expect("it is finite"));
    show(&format!("VTU, {:.1} MB", bytes.len() as f64 * 1e-6), cpu, wall);
}

fn main() {
    for name in ["shield_quick.toml", "shield_impedance.toml", "shield.toml"] {
        phases(name);
    }
}
